//! Why a shape could not be read, built or measured.

/// Why a shape could not be read, built or measured.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GeometryError {
    /// A file's text or bytes are not of its format.
    #[error("{format}, {place}: found {found}, expected {expected}")]
    Parse {
        /// Name of the format, for example `OFF`.
        format: &'static str,
        /// Line, element or byte offset, for example `line 3`.
        place: String,
        /// What stands there.
        found: String,
        /// What should stand there.
        expected: String,
    },

    /// The format is read by a feature of the crate that is off.
    #[error(
        "this format is read by the feature `{feature}` of prehend-geometry, which this build leaves out"
    )]
    NotBuilt {
        /// Name of the feature.
        feature: &'static str,
    },

    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex}, but there are only {n_vertices} vertices")]
    VertexOutOfRange {
        /// Index of the triangle, from 0.
        triangle: usize,
        /// The vertex that it names, from 0.
        vertex: u32,
        /// How many vertices there are.
        n_vertices: usize,
    },

    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} has the coordinate {value}; every coordinate must be finite")]
    NotFinite {
        /// Index of the vertex, from 0.
        vertex: usize,
        /// The offending coordinate.
        value: f64,
    },

    /// There is nothing to measure.
    #[error("the shape has no {what}; check that the file is complete")]
    Empty {
        /// What is missing: `points` or `triangles`.
        what: &'static str,
    },

    /// A box needs positive, finite extents.
    #[error("a box has the extents {extents:?} m; each must be positive and finite")]
    BadExtents {
        /// Full lengths along the three axes.
        extents: [f64; 3],
    },

    /// An option lies outside its range.
    #[error("`{name}` is {value}, expected {expected}")]
    BadOption {
        /// Name of the option.
        name: &'static str,
        /// What was given.
        value: f64,
        /// The range, for example `a number above 0 and at most 1`.
        expected: &'static str,
    },
}
