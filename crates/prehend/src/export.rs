//! Grasps in the formats of other programs.
//!
//! Every grasp goes out in three steps that a robot takes: the hand stands off the object in its pre-shape, it has moved
//! in and closed, and it squeezes. Poses are those of the hand's root link in the object's frame.

use nalgebra::{Isometry3, Translation3, Vector3};
use prehend_hand::{Hand, JointIdx, JointPositions};
use serde_json::{Map, Value, json};

use crate::Error;
use crate::frame::Frame;
use crate::grasp_table::{GraspRecord, records};

mod mjcf;
mod part;
mod picture;
mod pieces;
mod squeeze;
mod yaml;

pub use mjcf::{ServoGains, mjcf_scene};
pub use picture::grasp_pictures;
pub use pieces::{Pieces, convex_pieces};
pub use squeeze::{GRIP, IMBALANCE, Squeeze, squeeze};
pub use yaml::{isaac_yaml, moveit_yaml};

/// How far (m) the hand stands off before it comes in.
pub const STAND_OFF: f64 = 0.1;
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
    /// What the joints do to squeeze.
    pub squeeze: Squeeze,
}

/// The grasps of a table that belong to this hand, with pre-grasp and a squeeze of normal forces that sum to `grip` (N).
///
/// # Errors
///
/// As [`records`] and [`squeeze`]; [`Error`] where the table has no `egpc` columns.
pub fn exported(
    frame: &Frame,
    hand: &Hand,
    gains: &ServoGains,
    grip: f64,
) -> Result<Vec<ExportedGrasp>, Error> {
    let egpc = [frame.numbers("egpc_1")?, frame.numbers("egpc_2")?];
    let records = records(frame, hand)?;
    records
        .into_iter()
        .enumerate()
        .map(|(row, record)| {
            let preshape = hand.preshape([egpc[0][row], egpc[1][row]]);
            let object_from_palm = record.object_from_root * hand.root_from_palm(&record.joints);
            let approach = object_from_palm * Vector3::z();
            Ok(ExportedGrasp {
                object_from_pregrasp: Translation3::from(-approach * STAND_OFF) * record.object_from_root,
                squeeze: squeeze(hand, &record, gains, grip)?,
                preshape,
                approach,
                record,
            })
        })
        .collect()
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
        "squeeze": squeeze_json(hand, &grasp.squeeze),
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

/// Efforts in N·m, or N of joints that slide; forces on the object, N. `forces` is null where the contacts cannot balance.
fn squeeze_json(hand: &Hand, squeeze: &Squeeze) -> Value {
    let by_name = |values: &[f64]| -> Value {
        let named = driven_joints(hand).map(|j| (hand.joint(j).name.clone(), json!(values[j.0])));
        Value::Object(named.collect())
    };
    let forces = squeeze.forces.as_ref().map(|f| {
        let of_contact = f
            .forces
            .iter()
            .map(|c| json!({ "force": c.force.as_slice(), "torsion": c.torsion }));
        of_contact.collect::<Vec<_>>()
    });
    json!({
        "joints": hand.positions_by_name(&squeeze.joints),
        "targets": by_name(&squeeze.targets),
        "efforts": by_name(&squeeze.efforts),
        "balanced": squeeze.forces.is_some(),
        "imbalance": squeeze.forces.as_ref().map(|f| f.imbalance),
        "grip": squeeze.grip,
        "forces": forces,
    })
}

/// The joints that have a place of their own: free ones, and those whose coupling lets go.
fn driven_joints(hand: &Hand) -> impl Iterator<Item = JointIdx> + '_ {
    let let_go = hand.description().map_or(&[][..], |d| &d.break_away);
    let driven = |j: &JointIdx| hand.joint(*j).mimic.is_none() || let_go.contains(j);
    (0..hand.joints().len()).map(JointIdx).filter(driven)
}

/// Positions of the driven joints by name.
fn driven_positions(hand: &Hand, positions: &JointPositions) -> Map<String, Value> {
    driven_joints(hand)
        .map(|j| (hand.joint(j).name.clone(), json!(positions.get(j))))
        .collect()
}
