//! Shapes from bytes, one module per format.
//!
//! Readers take bytes, never paths. They trust nothing: a count in a header is checked against the bytes that are
//! there, and whatever is wrong comes back as [`GeometryError::Parse`] with format, place, what was found and what was
//! expected. They also change nothing: vertices come in the file's order and number, degenerate triangles stay.
//! [`crate::repair`] is the place for that.

mod lzf;
mod obj;
mod off;
mod pcd;
mod ply;
mod polygon;
mod stl;
mod text;
mod xyz;

use nalgebra::Point3;

use crate::{GeometryError, TriMesh};

/// A file format for shapes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum MeshFormat {
    /// Geomview's Object File Format, with or without colours and normals.
    Off,
    /// Wavefront OBJ; materials, normals and texture coordinates are passed over.
    Obj,
    /// Stereolithography, ASCII or binary.
    Stl,
    /// Polygon File Format, ASCII or binary of either byte order: a mesh, or a cloud where it has no faces.
    Ply,
    /// A cloud as lines of `x y z`.
    Xyz,
    /// Point Cloud Data, ASCII, binary or compressed.
    Pcd,
}

impl MeshFormat {
    /// The format that a file name's extension stands for, in any case, with or without its dot.
    pub fn from_extension(extension: &str) -> Option<Self> {
        let extension = extension.strip_prefix('.').unwrap_or(extension);
        match extension.to_ascii_lowercase().as_str() {
            "off" => Some(Self::Off),
            "obj" => Some(Self::Obj),
            "stl" => Some(Self::Stl),
            "ply" => Some(Self::Ply),
            "xyz" => Some(Self::Xyz),
            "pcd" => Some(Self::Pcd),
            _ => None,
        }
    }

    /// All extensions that [`from_extension`](Self::from_extension) knows, in lower case.
    pub const EXTENSIONS: [&str; 6] = ["off", "obj", "stl", "ply", "xyz", "pcd"];
}

/// What a file held.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Triangles; convex polygons come as fans around their first corner, others cut where the cuts lie inside.
    Mesh(TriMesh),
    /// Points without triangles; at least one.
    Cloud(Vec<Point3<f64>>),
}

impl Shape {
    /// The points: a mesh's vertices or the cloud itself.
    pub fn points(&self) -> &[Point3<f64>] {
        match self {
            Self::Mesh(mesh) => mesh.vertices(),
            Self::Cloud(points) => points,
        }
    }
}

/// Reads a shape. Coordinates stay in the file's own unit and axes.
///
/// # Errors
///
/// [`GeometryError::Parse`] where the bytes are not of the format or a coordinate is not finite;
/// [`GeometryError::Empty`] where there are no triangles (meshes) or no points (clouds).
///
/// # Examples
///
/// ```
/// use prehend_geometry::{MeshFormat, Shape, read_shape};
///
/// let text = "OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
/// let Shape::Mesh(mesh) = read_shape(text.as_bytes(), MeshFormat::Off)? else { unreachable!() };
/// assert_eq!(mesh.n_triangles(), 1);
///
/// let broken = text.replace("3 0 1 2", "3 0 1 7");
/// let error = read_shape(broken.as_bytes(), MeshFormat::Off).unwrap_err();
/// assert_eq!(error.to_string(), "OFF, line 5: found `7`, expected a vertex index from 0 to 2");
/// # Ok::<(), prehend_geometry::GeometryError>(())
/// ```
pub fn read_shape(bytes: &[u8], format: MeshFormat) -> Result<Shape, GeometryError> {
    match format {
        MeshFormat::Off => off::read(bytes).map(Shape::Mesh),
        MeshFormat::Obj => obj::read(bytes).map(Shape::Mesh),
        MeshFormat::Stl => stl::read(bytes).map(Shape::Mesh),
        MeshFormat::Ply => ply::read(bytes),
        MeshFormat::Xyz => xyz::read(bytes).map(Shape::Cloud),
        MeshFormat::Pcd => pcd::read(bytes).map(Shape::Cloud),
    }
}

/// Reads a mesh; a cloud is an error.
///
/// # Errors
///
/// Those of [`read_shape`], and [`GeometryError::Empty`] where the file holds points only.
pub fn read_mesh(bytes: &[u8], format: MeshFormat) -> Result<TriMesh, GeometryError> {
    match read_shape(bytes, format)? {
        Shape::Mesh(mesh) => Ok(mesh),
        Shape::Cloud(_) => Err(GeometryError::Empty { what: "triangles" }),
    }
}

/// A cloud of at least one point.
fn cloud(points: Vec<Point3<f64>>) -> Result<Vec<Point3<f64>>, GeometryError> {
    if points.is_empty() {
        Err(GeometryError::Empty { what: "points" })
    } else {
        Ok(points)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extensions_are_known_in_any_case_and_with_a_dot() {
        for extension in MeshFormat::EXTENSIONS {
            assert!(MeshFormat::from_extension(extension).is_some());
        }
        assert_eq!(MeshFormat::from_extension(".STL"), Some(MeshFormat::Stl));
        assert_eq!(MeshFormat::from_extension("dae"), None);
    }

    #[test]
    fn a_cloud_is_no_mesh() {
        let error = read_mesh(b"0 0 0\n1 0 0\n", MeshFormat::Xyz).unwrap_err();
        assert_eq!(
            error.to_string(),
            "the shape has no triangles; check that the file is complete"
        );
    }
}
