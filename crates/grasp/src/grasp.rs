//! What a grasp is.

use nalgebra::Isometry3;
use prehend_geometry::ContactPoint;
use prehend_hand::{JointPositions, LinkIdx};
use serde::{Deserialize, Serialize};

/// A force-closure grasp, where it comes from and what the network sees of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Grasp {
    /// Which try it was, from 0.
    pub try_idx: usize,
    /// The box: an index into [`crate::GraspObject::regions`].
    pub box_idx: usize,
    /// The box's face, 0 to 5: `2 · axis`, plus 1 for the positive side.
    pub face: usize,
    /// The roll, 0 to 3: closing along +e₁, +e₂, −e₁, −e₂ of the face.
    pub roll: usize,
    /// Which pre-shape of this hypothesis, from 0.
    pub preshape_idx: usize,
    /// Where on the face, from its centre along e₁ and e₂, metres.
    pub offset: [f64; 2],
    /// Pose of the hand's root link in the object's frame.
    pub object_from_root: Isometry3<f64>,
    /// The posture after closing.
    pub joints: JointPositions,
    /// Where it touches, in order of the links.
    pub contacts: Vec<LinkContact>,
    /// The nodes' values.
    pub features: Features,
}

/// A contact and the link that makes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkContact {
    /// The link.
    pub link: LinkIdx,
    /// Point on the object and normal into it, object frame.
    pub at: ContactPoint,
    /// Coulomb friction coefficient.
    pub mu: f64,
    /// Torsion length, metres; 0 for a point contact.
    pub torsion: f64,
}

/// The network's values of a grasp; `docs/conventions.md` defines each.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Features {
    /// Extents of the object's minimum-volume box, metres, matched to x, y, z.
    pub size: [f64; 3],
    /// Volume of that box over the volume of all boxes.
    pub cvex: f64,
    /// Eigengrasp amplitudes of the pre-shape, each in [−1, 1].
    pub egpc: [f64; 2],
    /// Where the approach line leaves the sphere about the object; a unit vector.
    pub upos: [f64; 3],
    /// Orientation of the palm frame in the object's frame: w, x, y, z, unit, w ≥ 0.
    pub dir: [f64; 4],
    /// Share of the boxes' volume outside the tetrahedron of palm and contacts.
    pub fvol: f64,
    /// The same with regions that boxes share counted once.
    pub fvol_union: f64,
    /// ε of the grasp wrench space.
    pub qeps: f64,
}
