//! Grasps in the formats of other programs.
//!
//! Every grasp goes out in three steps that a robot takes: the hand stands off the object in its pre-shape, it has moved
//! in and closed, and it squeezes. Poses are those of the hand's root link in the object's frame.

use nalgebra::{Isometry3, Translation3, Vector3};
use prehend_hand::{Hand, JointKind, JointPositions};
use serde_json::{Map, Value, json};

use crate::Error;
use crate::frame::Frame;
use crate::grasp_table::{GraspRecord, records};

mod mjcf;
mod pieces;
mod yaml;

pub use mjcf::{ServoGains, mjcf_scene};
pub use pieces::{Pieces, convex_pieces};
pub use yaml::{isaac_yaml, moveit_yaml};

/// How far (m) the hand stands off before it comes in.
pub const STAND_OFF: f64 = 0.1;
/// How far beyond touching the closing joints are sent to squeeze: rad, or m for joints that slide.
pub const SQUEEZE: f64 = 0.15;
/// The same for joints that slide, metres.
pub const SQUEEZE_SLIDE: f64 = 0.005;

/// A grasp with what leads to it and what follows.
#[derive(Debug, Clone)]
pub struct ExportedGrasp {
    /// The row of the table.
    pub record: GraspRecord,
    /// The posture in which the hand comes in.
    pub preshape: JointPositions,
    /// Where its root link stands off, object frame.
    pub object_from_pregrasp: Isometry3<f64>,
    /// Unit direction in which it comes in: the palm's z, object frame.
    pub approach: Vector3<f64>,
    /// Where the joints are sent to squeeze: beyond touching, within the limits.
    pub squeeze: JointPositions,
}

/// The grasps of a table that belong to this hand, with pre-grasp and squeeze.
///
/// # Errors
///
/// As [`records`]; [`Error`] where the hand has no description or the table no `egpc` columns.
pub fn exported(frame: &Frame, hand: &Hand) -> Result<Vec<ExportedGrasp>, Error> {
    let description = hand
        .description()
        .ok_or_else(|| Error::input(format!("the hand {} has no hand.toml", hand.name())))?;
    let egpc = [frame.numbers("egpc_1")?, frame.numbers("egpc_2")?];
    let records = records(frame, hand)?;
    Ok(records
        .into_iter()
        .enumerate()
        .map(|(row, record)| {
            let preshape = hand.preshape([egpc[0][row], egpc[1][row]]);
            let object_from_palm = record.object_from_root * hand.root_from_palm(&record.joints);
            let approach = object_from_palm * Vector3::z();
            let mut squeeze = record.joints.as_slice().to_vec();
            for closing in &description.closing {
                let slides = hand.joint(closing.joint).kind == JointKind::Prismatic;
                let by = if slides { SQUEEZE_SLIDE } else { SQUEEZE };
                squeeze[closing.joint.0] += closing.speed.signum() * by;
            }
            ExportedGrasp {
                object_from_pregrasp: Translation3::from(-approach * STAND_OFF) * record.object_from_root,
                squeeze: hand.joint_positions_from_slice(&squeeze),
                preshape,
                approach,
                record,
            }
        })
        .collect())
}

/// One grasp as JSON: poses with `translation` (m) and `quaternion_wxyz`, joints by name, contacts, ε.
pub fn grasp_json(hand: &Hand, grasp: &ExportedGrasp) -> Value {
    let joints = |positions: &JointPositions| json!(hand.positions_by_name(positions));
    json!({
        "grasp_id": grasp.record.grasp_id,
        "hand": hand.name(),
        "pregrasp": {
            "pose": pose_json(&grasp.object_from_pregrasp),
            "joints": joints(&grasp.preshape),
            "approach": grasp.approach.as_slice(),
            "stand_off": STAND_OFF,
        },
        "pose": pose_json(&grasp.record.object_from_root),
        "joints": joints(&grasp.record.joints),
        "squeeze": { "joints": joints(&grasp.squeeze) },
        "epsilon": grasp.record.epsilon,
        "contacts": grasp.record.contact_records,
    })
}

fn pose_json(pose: &Isometry3<f64>) -> Value {
    let (t, q) = (pose.translation.vector, pose.rotation);
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    // Adding 0 turns -0 into 0.
    let [w, x, y, z] = [q.w, q.i, q.j, q.k].map(|v| sign * v + 0.0);
    json!({ "translation": [t.x, t.y, t.z], "quaternion_wxyz": [w, x, y, z] })
}

/// Positions of the joints that move freely, by name.
fn free_joints(hand: &Hand, positions: &JointPositions) -> Map<String, Value> {
    hand.free_joints()
        .map(|j| (hand.joint(j).name.clone(), json!(positions.get(j))))
        .collect()
}
