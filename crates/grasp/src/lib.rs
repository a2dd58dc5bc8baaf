//! Which grasps has this hand on this object, and what are their features?
//!
//! ```text
//! boxes ──▶ hypotheses ──pose × pre-shape──▶ approach ──▶ closing ──▶ contacts ──▶ ε, features ──▶ Grasp
//!                                               └────────────┴─────────────┴───────────▶ Reason
//! ```
//!
//! A hand comes in along the normal of a box's face until something touches, closes its fingers, and is measured by the
//! contacts that it ends with. What holds is a [`Grasp`] with the values of the network's nodes; every other try is
//! counted under its [`Reason`]. Nothing ever penetrates: links end with a gap between 1 µm and 0.1 mm.
//!
//! Everything random comes from (seed, stream, hypothesis, pre-shape), so the result is the same for any number of
//! threads and any grasp can be made again from its row. This crate knows no probability and opens no files.
//!
//! # Examples
//!
//! The boxes alone say where a hand could come from:
//!
//! ```
//! use nalgebra::Vector3;
//! use prehend_geometry::{OrientedBox, Solid};
//! use prehend_grasp::{GraspObject, hypotheses};
//! use prehend_quality::Material;
//!
//! let mesh = Solid::Cuboid { half_extents: Vector3::new(0.02, 0.02, 0.1) }.display_mesh();
//! let bar = OrientedBox::centered([0.04, 0.04, 0.2]);
//! let object = GraspObject::from_boxes(mesh, bar, vec![bar], &[], None, Material::Wood)?;
//! // An opening of 60 mm closes around the 40 mm sides, not along the bar; a palm of 80 mm gets three places along it.
//! let found = hypotheses(&object, 0.06, 0.08);
//! assert_eq!(found.len(), 4 * 2 * 5 + 2 * 4);
//! # Ok::<(), prehend_grasp::GraspError>(())
//! ```

mod error;
mod reason;

mod grasp;
mod object;

mod hypothesis;
mod tries;

mod first_touch;
mod grasp_hand;

mod approach;
mod closing;
mod contacts;
mod features;
mod free_surface;
mod patch;
mod refine;

mod close;
mod confirm;
mod measure;
mod run_try;
mod synthesis_options;
mod synthesize;

#[cfg(test)]
mod testing;

pub use close::{CloseOptions, Closed, ReadyHand, close};
pub use contacts::CONTACT_TOLERANCE;
pub use error::GraspError;
pub use features::{
    FreeVolume, UPOS_RADIUS, free_volume, free_volume_of_hull, object_size, palm_orientation,
    unified_position,
};
pub use free_surface::{FreeSurface, free_surface};
pub use grasp::{Features, Grasp, LinkContact};
pub use hypothesis::{Face, Hypothesis, OPENING_MARGIN, PALM_CLEARANCE, hypotheses};
pub use object::{GraspObject, Region};
pub use patch::{MERGE_DISTANCE, MOST_CORNERS, SOFT_MERGE_DISTANCE};
pub use reason::Reason;
pub use synthesis_options::{HypothesisBoxes, SynthesisOptions};
pub use synthesize::{Proposal, ROUND, Synthesis, Tally, retry, synthesize, synthesize_each};
pub use tries::{MOST_PRESHAPES, OFFSET_SHARE, PRESHAPES, Preshapes, Tries, Try};
