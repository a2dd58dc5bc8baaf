//! The pictures that the report needs: an object with its boxes, its parts, or in a hand.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Vector3};
use prehend_geometry::OrientedBox;
use prehend_hand::{Hand, JointPositions};

use crate::ReportError;
use crate::camera::Camera;
use crate::display_mesh::DisplayMesh;
use crate::palette_png::encode_png;
use crate::picture::Picture;
use crate::raster::{DrawOptions, draw};
use crate::scene::{Dot, Scene};
use crate::view::{View, looking_from};

/// Objects: warm grey.
pub const OBJECT_COLOR: [u8; 3] = [0xd9, 0xd2, 0xc5];
/// Hands: one hue that no task has.
pub const HAND_COLOR: [u8; 3] = [0x8f, 0xa3, 0xc4];
/// Contacts.
pub const CONTACT_COLOR: [u8; 3] = [0xc2, 0x3b, 0x8a];
/// Boxes of a decomposition.
pub const BOX_COLOR: [u8; 3] = [0x00, 0x72, 0xb2];

const UP_COLOR: [u8; 3] = [0x00, 0x72, 0xb2];
const FRONT_COLOR: [u8; 3] = [0xd5, 0x5e, 0x00];
const OPENING_COLOR: [u8; 3] = [0x00, 0x9e, 0x73];
const HANDLE_COLOR: [u8; 3] = [0x8a, 0x5a, 0x83];
const FUNCTIONAL_COLOR: [u8; 3] = [0xc7, 0x8a, 0x00];
const SHARP_COLOR: [u8; 3] = [0xb2, 0x18, 0x2b];

/// What [`Scene::parts`] draws, in words, for captions.
pub const PARTS_LEGEND: &str = "up: blue arrow; front: orange arrow; opening: green ring; handle: purple; working part: ochre; sharp: red";

/// Directions and parts of an object, given or guessed.
#[derive(Debug, Clone, PartialEq)]
pub struct PartMarks {
    /// Unit vector upwards.
    pub up: Vector3<f64>,
    /// Unit vector to the front.
    pub front: Vector3<f64>,
    /// Centre, outward normal and radius of the opening.
    pub opening: Option<(Point3<f64>, Vector3<f64>, f64)>,
    /// Boxes round the handle.
    pub handle: Vec<OrientedBox>,
    /// Boxes round what does the work: head, blade, shaft, vessel.
    pub functional: Vec<OrientedBox>,
    /// Boxes round what cuts.
    pub sharp: Vec<OrientedBox>,
}

/// A hand made ready for drawing: the links' collision solids, or the visual ones where a hand has no others.
#[derive(Debug, Clone, PartialEq)]
pub struct HandShape {
    /// Link, `link_from_solid`, shape.
    solids: Vec<(usize, Isometry3<f64>, Arc<DisplayMesh>)>,
}

impl HandShape {
    /// Prepares every link once.
    pub fn new(hand: &Hand) -> Self {
        let bare = hand.links().iter().all(|l| l.collision.is_empty());
        let solids = hand.links().iter().enumerate().flat_map(|(l, link)| {
            let shown = if bare { &link.visual } else { &link.collision };
            shown.iter().map(move |s| {
                (
                    l,
                    s.link_from_solid,
                    Arc::new(DisplayMesh::new(&s.solid.display_mesh())),
                )
            })
        });
        Self {
            solids: solids.collect(),
        }
    }
}

impl Scene {
    /// An object alone.
    pub fn object(mesh: &Arc<DisplayMesh>) -> Self {
        let mut scene = Self::default();
        scene.add(mesh, Isometry3::identity(), OBJECT_COLOR);
        scene
    }

    /// An object with the boxes of its decomposition.
    pub fn boxes(mesh: &Arc<DisplayMesh>, boxes: &[OrientedBox]) -> Self {
        let mut scene = Self::object(mesh);
        for solid in boxes {
            scene.add_box(solid, BOX_COLOR);
        }
        scene
    }

    /// An object with its directions and parts; [`PARTS_LEGEND`] says which colour is what.
    pub fn parts(mesh: &Arc<DisplayMesh>, marks: &PartMarks) -> Self {
        let mut scene = Self::object(mesh);
        let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        for p in &mesh.vertices {
            (low, high) = (low.inf(&p.coords), high.sup(&p.coords));
        }
        let (center, half) = (Point3::from((low + high) / 2.0), (high - low) / 2.0);
        for (direction, color) in [(marks.up, UP_COLOR), (marks.front, FRONT_COLOR)] {
            // From the box's side outwards, a third of the object's size.
            let reach = direction.abs().dot(&half);
            scene.add_arrow(
                center + direction * reach,
                direction * (0.35 * half.norm()),
                color,
            );
        }
        if let Some((center, normal, radius)) = marks.opening {
            scene.add_circle(center, normal, radius, OPENING_COLOR);
        }
        let of_parts = [
            (&marks.handle, HANDLE_COLOR),
            (&marks.functional, FUNCTIONAL_COLOR),
            (&marks.sharp, SHARP_COLOR),
        ];
        for (boxes, color) in of_parts {
            for solid in boxes {
                scene.add_box(solid, color);
            }
        }
        scene
    }

    /// A hand on an object, with dots where they touch. All poses and points are in the object's frame.
    pub fn grasp(
        object: &Arc<DisplayMesh>,
        hand: &Hand,
        shape: &HandShape,
        joints: &JointPositions,
        object_from_root: &Isometry3<f64>,
        contacts: &[Point3<f64>],
    ) -> Self {
        let mut scene = Self::object(object);
        let poses = hand.link_poses(joints);
        for (link, link_from_solid, mesh) in &shape.solids {
            let Some(root_from_link) = poses.as_slice().get(*link) else {
                continue;
            };
            scene.add(
                mesh,
                object_from_root * root_from_link * link_from_solid,
                HAND_COLOR,
            );
        }
        scene.dots = contacts
            .iter()
            .map(|&center| Dot {
                center,
                radius: 2.2,
                color: CONTACT_COLOR,
            })
            .collect();
        scene
    }

    /// Draws the scene from a view, whole, on a square of `size` pixels.
    ///
    /// # Errors
    ///
    /// [`ReportError::PictureSize`] where `size` cannot be drawn.
    pub fn picture(&self, view: View, size: usize, name: &str, alt: &str) -> Result<Picture, ReportError> {
        let camera = Camera::fitting(self, view.camera_from_world(), size, size);
        self.taken(&camera, size, name, alt)
    }

    /// Draws the scene from the side that shows most of its first body (the object) and of the others (the hand).
    ///
    /// # Errors
    ///
    /// [`ReportError::PictureSize`] where `size` cannot be drawn.
    pub fn telling_picture(&self, size: usize, name: &str, alt: &str) -> Result<Picture, ReportError> {
        let camera = self.telling_camera(size)?;
        self.taken(&camera, size, name, alt)
    }

    fn taken(&self, camera: &Camera, size: usize, name: &str, alt: &str) -> Result<Picture, ReportError> {
        let raster = draw(self, camera, &DrawOptions::square(size))?;
        Ok(Picture {
            name: name.into(),
            png: encode_png(&raster),
            alt: alt.into(),
        })
    }

    /// Of sixteen cameras round the object, twice eight a little and well above the horizon, the one with the largest
    /// product of the areas that the first body and the other bodies take in the picture.
    fn telling_camera(&self, size: usize) -> Result<Camera, ReportError> {
        // Each body becomes one plain colour that tells the two apart after lighting: red or blue.
        let mut plain = self.clone();
        plain.lines.clear();
        plain.dots.clear();
        for (b, body) in plain.bodies.iter_mut().enumerate() {
            body.color = if b == 0 { [255, 0, 0] } else { [0, 0, 255] };
        }
        let rough = DrawOptions {
            width: 40,
            height: 40,
            samples: 1,
            lines: false,
        };
        let mut best = (
            -1.0,
            Camera::fitting(self, View::Oblique.camera_from_world(), size, size),
        );
        for (elevation, azimuth) in [20.0, 48.0]
            .iter()
            .flat_map(|e| (0..8).map(move |a| (*e, -40.0 + 45.0 * f64::from(a))))
        {
            let rotation = looking_from(elevation, azimuth);
            let raster = draw(&plain, &Camera::fitting(&plain, rotation, 40, 40), &rough)?;
            let count = |channel: usize| {
                raster
                    .rgba
                    .chunks(4)
                    .filter(|p| p[3] > 0 && p[channel] > 0)
                    .count() as f64
            };
            let score = (1.0 + count(0)) * (1.0 + count(2));
            if score > best.0 {
                best = (score, Camera::fitting(self, rotation, size, size));
            }
        }
        Ok(best.1)
    }
}
