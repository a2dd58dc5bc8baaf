//! What can go wrong when drawing.

/// Why a picture or a page could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// The bytes given as a picture are not a PNG file.
    #[error(
        "picture `{picture}`: expected a PNG file, found {n_bytes} bytes with no PNG header; encode it with `encode_png`"
    )]
    NotPng {
        /// The picture's name.
        picture: String,
        /// How many bytes it has.
        n_bytes: usize,
    },
    /// A map has not one density per direction of the grid.
    #[error(
        "spherical map `{map}`: expected {expected} densities, one per direction of the grid, found {found}"
    )]
    MapSize {
        /// Name of the map, a task.
        map: String,
        /// Directions of the grid.
        expected: usize,
        /// Densities given.
        found: usize,
    },
    /// A map's densities cannot be normalised.
    #[error(
        "spherical map `{map}`: the densities must be finite and at least 0 with a positive integral, found {integral}"
    )]
    MapDensity {
        /// Name of the map, a task.
        map: String,
        /// Integral over the sphere as given.
        integral: f64,
    },
    /// A picture's size is zero or beyond what is drawn.
    #[error("a picture of {width} × {height} pixels: expected 1 to 8192 along each side")]
    PictureSize {
        /// Pixels across.
        width: usize,
        /// Pixels down.
        height: usize,
    },
}
