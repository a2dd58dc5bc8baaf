//! Small objects for tests.

use nalgebra::{Isometry3, Point3, Rotation3, Vector3};
use prehend_geometry::{OrientedBox, Solid, TriMesh};
use prehend_quality::Material;

use crate::GraspObject;

/// An object of axis-aligned boxes given as (centre, extents); the first one is also its root.
pub(crate) fn boxes_object(boxes: &[([f64; 3], [f64; 3])]) -> GraspObject {
    let mut vertices: Vec<Point3<f64>> = Vec::new();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    let mut leaves = Vec::new();
    for (center, extents) in boxes {
        let at = Isometry3::translation(center[0], center[1], center[2]);
        let mesh = Solid::Cuboid {
            half_extents: Vector3::from(*extents) / 2.0,
        }
        .display_mesh()
        .transformed(&at);
        let first = vertices.len() as u32;
        vertices.extend(mesh.vertices());
        triangles.extend(mesh.triangles().iter().map(|t| t.map(|v| v + first)));
        leaves.push(OrientedBox::new((*center).into(), Rotation3::identity(), (*extents).into()).unwrap());
    }
    let mesh = TriMesh::new(vertices, triangles).unwrap();
    GraspObject::from_boxes(mesh, leaves[0], leaves, &[], None, Material::Plastic).unwrap()
}
