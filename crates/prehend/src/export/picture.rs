//! Pictures of a grasp, drawn as the report draws.

use std::sync::Arc;

use nalgebra::{Isometry3, Vector3};
use prehend_geometry::TriMesh;
use prehend_hand::Hand;
use prehend_report::{DisplayMesh, HandShape, Picture, Scene, View};

use super::ExportedGrasp;
use crate::Error;

/// A grasp from two sides, in squares of `size` pixels: from the front, across the palm's closing direction with the
/// fingers' plane in the picture, and from the side, along it. The hand comes from above in both; dots are contacts.
///
/// # Errors
///
/// Where `size` cannot be drawn.
pub fn grasp_pictures(
    hand: &Hand,
    mesh: &TriMesh,
    grasp: &ExportedGrasp,
    size: usize,
) -> Result<[Picture; 2], Error> {
    // Pictures have the world's z upwards and look along x or y: so turn the palm's approach down.
    let object_from_palm = grasp.record.object_from_root * hand.root_from_palm(&grasp.record.joints);
    let palm_from_object = object_from_palm.inverse();
    let upright = Isometry3::rotation(Vector3::x() * std::f64::consts::PI) * palm_from_object;
    let placed = mesh.vertices().iter().map(|p| upright * p).collect();
    let placed = TriMesh::new(placed, mesh.triangles().to_vec()).map_err(Error::input)?;
    let contacts: Vec<_> = grasp
        .record
        .contact_records
        .iter()
        .map(|c| upright * nalgebra::Point3::from(c.point))
        .collect();
    let scene = Scene::grasp(
        &Arc::new(DisplayMesh::new(&placed)),
        hand,
        &HandShape::new(hand),
        &grasp.record.joints,
        &(upright * grasp.record.object_from_root),
        &contacts,
    );
    let picture = |view: View, from: &str| {
        let name = format!("{}_{from}", grasp.record.grasp_id);
        let alt = format!("grasp {} from the {from}", grasp.record.grasp_id);
        scene.picture(view, size, &name, &alt).map_err(Error::input)
    };
    // The palm's x lies along the picture's x, the palm's y towards the viewer or away.
    Ok([picture(View::Right, "front")?, picture(View::Front, "side")?])
}
