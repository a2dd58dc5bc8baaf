//! Shapes from bytes, one module per format.
//!
//! Readers take bytes, never paths. They trust nothing: a count in a header is checked against the bytes that are
//! there, and whatever is wrong comes back as [`GeometryError::Parse`] with format, place, what was found and what was
//! expected. They also change nothing: vertices come in the file's order and number, degenerate triangles stay.
//! [`crate::repair`] is the place for that.

#[cfg(any(feature = "gltf", feature = "dae"))]
mod assembly;
#[cfg(feature = "dae")]
mod dae;
#[cfg(feature = "gltf")]
mod gltf;
mod lzf;
mod obj;
mod off;
mod pcd;
mod ply;
mod polygon;
mod stl;
mod text;
mod xyz;

#[cfg(feature = "gltf")]
use nalgebra::Vector3;
use nalgebra::{Point3, UnitVector3};

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
    /// glTF 2.0 as JSON; its buffers may be further files. Read with the feature `gltf`.
    Gltf,
    /// glTF 2.0 as one binary file. Read with the feature `gltf`.
    Glb,
    /// COLLADA. Read with the feature `dae`.
    Dae,
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
            "gltf" => Some(Self::Gltf),
            "glb" => Some(Self::Glb),
            "dae" => Some(Self::Dae),
            _ => None,
        }
    }

    /// All extensions that [`from_extension`](Self::from_extension) knows, in lower case.
    pub const EXTENSIONS: [&str; 9] = ["off", "obj", "stl", "ply", "xyz", "pcd", "gltf", "glb", "dae"];
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

/// Takes the name of a further file, as a file gives it, to its bytes, or says why it cannot (`is missing`).
pub type Resolve<'a> = dyn Fn(&str) -> Result<Vec<u8>, String> + 'a;

/// A shape, and what its file says of its coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct FileShape {
    /// The shape, in the file's own unit and axes.
    pub shape: Shape,
    /// Unit and upward axis, where the file or its format states them.
    pub stated: Stated,
}

/// What a file or its format says of its coordinates. Of the formats here, glTF always does, DAE mostly, others never.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stated {
    /// Metres per unit.
    pub metres_per_unit: Option<f64>,
    /// The direction that is up.
    pub up: Option<UnitVector3<f64>>,
}

/// Reads a shape that may name further files, with the unit and upward axis that it states.
///
/// # Errors
///
/// Those of [`read_shape`], also where a further file cannot be had.
///
/// # Examples
///
/// A triangle whose positions stand in a second file:
///
/// ```
/// # #[cfg(feature = "gltf")] {
/// use prehend_geometry::{MeshFormat, read_shape_with};
///
/// let text = r#"{ "asset": {"version": "2.0"},
///     "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
///     "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3}],
///     "bufferViews": [{"buffer": 0, "byteLength": 36}],
///     "buffers": [{"uri": "corners.bin", "byteLength": 36}] }"#;
/// let corners: Vec<u8> = [0_f32, 0., 0., 1., 0., 0., 0., 1., 0.].map(f32::to_le_bytes).concat();
/// let resolve = |name: &str| match name {
///     "corners.bin" => Ok(corners.clone()),
///     _ => Err("is missing".to_owned()),
/// };
/// let read = read_shape_with(text.as_bytes(), MeshFormat::Gltf, &resolve)?;
/// assert_eq!(read.shape.points().len(), 3);
/// assert_eq!(read.stated.metres_per_unit, Some(1.0));
/// # }
/// # Ok::<(), prehend_geometry::GeometryError>(())
/// ```
#[cfg_attr(
    not(feature = "gltf"),
    expect(unused_variables, reason = "only glTF has further files")
)]
pub fn read_shape_with(
    bytes: &[u8],
    format: MeshFormat,
    resolve: &Resolve,
) -> Result<FileShape, GeometryError> {
    let (shape, stated) = match format {
        MeshFormat::Off => (off::read(bytes).map(Shape::Mesh)?, Stated::default()),
        MeshFormat::Obj => (obj::read(bytes).map(Shape::Mesh)?, Stated::default()),
        MeshFormat::Stl => (stl::read(bytes).map(Shape::Mesh)?, Stated::default()),
        MeshFormat::Ply => (ply::read(bytes)?, Stated::default()),
        MeshFormat::Xyz => (xyz::read(bytes).map(Shape::Cloud)?, Stated::default()),
        MeshFormat::Pcd => (pcd::read(bytes).map(Shape::Cloud)?, Stated::default()),
        #[cfg(feature = "gltf")]
        MeshFormat::Gltf | MeshFormat::Glb => {
            let stated = Stated {
                metres_per_unit: Some(1.0),
                up: Some(Vector3::y_axis()),
            };
            (gltf::read(bytes, resolve).map(Shape::Mesh)?, stated)
        }
        #[cfg(not(feature = "gltf"))]
        MeshFormat::Gltf | MeshFormat::Glb => return Err(GeometryError::NotBuilt { feature: "gltf" }),
        #[cfg(feature = "dae")]
        MeshFormat::Dae => {
            let (mesh, stated) = dae::read(bytes)?;
            (Shape::Mesh(mesh), stated)
        }
        #[cfg(not(feature = "dae"))]
        MeshFormat::Dae => return Err(GeometryError::NotBuilt { feature: "dae" }),
    };
    Ok(FileShape { shape, stated })
}

/// Reads a shape from one file. Coordinates stay in the file's own unit and axes.
///
/// # Errors
///
/// [`GeometryError::Parse`] where the bytes are not of the format or a coordinate is not finite;
/// [`GeometryError::Empty`] where there are no triangles (meshes) or no points (clouds);
/// [`GeometryError::NotBuilt`] where the format's feature is off.
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
    let alone = |_: &str| Err("is not at hand".to_owned());
    read_shape_with(bytes, format, &alone).map(|read| read.shape)
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
        assert_eq!(MeshFormat::from_extension("fbx"), None);
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
