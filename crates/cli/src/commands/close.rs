//! `prehend close --hand H --object O FILE`

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use prehend::grasp::{CloseOptions, GraspObject, ReadyHand};
use prehend::grasp_table::ContactRecord;
use prehend::hand::Hand;
use prehend::stages::decompose::shape_of;
use prehend::stages::synthesize::HandData;
use serde::Deserialize;
use serde_json::{Value, json};

use super::hand::pose_json;
use super::shape_input::PlacementOptions;
use crate::output::{self, Outcome};

/// Close a user's own grasp candidates
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  echo '{\"pose\":{\"translation\":[0,0,0.33],\"quaternion_wxyz\":[0,1,0,0]},\"joints\":{\"spread\":0.5,\"finger_1_proximal_joint\":-0.6,\
\"finger_2_proximal_joint\":-0.6,\"thumb_proximal_joint\":-0.6},\"approach\":true}' \\\n      | prehend close --hand hands/schunk_sdh --object objects/mug/coffee_mug.ply - --json"
)]
pub struct Arguments {
    /// A folder with hand.toml and a URDF
    #[arg(long)]
    hand: PathBuf,

    /// A mesh; the .toml beside it is applied
    #[arg(long)]
    object: PathBuf,

    /// JSON lines: the root link's pose in the object's frame, the pre-shape's joints, and whether to approach; - is standard input
    file: PathBuf,

    /// Height (m, object frame) of a support: no part of the hand below it
    #[arg(long, allow_negative_numbers = true)]
    support_plane: Option<f64>,

    #[command(flatten)]
    placement: PlacementOptions,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Candidate {
    pose: Pose,
    #[serde(default)]
    joints: BTreeMap<String, f64>,
    #[serde(default)]
    approach: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Pose {
    translation: [f64; 3],
    quaternion_wxyz: [f64; 4],
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        let hand = HandData::read(&self.hand)?.hand;
        let shape = shape_of(&self.object, self.placement.object_options())?;
        let object = shape.grasp_object()?;
        let ready = ReadyHand::new(&hand).map_err(|e| prehend::Error::file(&self.hand, e))?;
        let run = |line: Value| closed(&hand, &ready, &object, line, self.support_plane);
        output::each_json_line_in_parallel(json, &self.file, run, output::plain)
    }
}

fn closed(
    hand: &Hand,
    ready: &ReadyHand<'_>,
    object: &GraspObject,
    line: Value,
    support_plane: Option<f64>,
) -> Result<Value> {
    let candidate: Candidate = serde_json::from_value(line).context("expected pose, joints and approach")?;
    let [w, x, y, z] = candidate.pose.quaternion_wxyz;
    let quaternion = Quaternion::new(w, x, y, z);
    let off = (quaternion.norm() - 1.0).abs();
    if off.is_nan() || off >= 1e-3 {
        bail!(
            "quaternion_wxyz {:?} has length {:.4}; expected 1",
            candidate.pose.quaternion_wxyz,
            quaternion.norm()
        );
    }
    let pose = Isometry3::from_parts(
        Translation3::from(candidate.pose.translation),
        UnitQuaternion::new_normalize(quaternion),
    );
    let preshape = hand.positions(&candidate.joints)?;
    let options = CloseOptions {
        approach: candidate.approach,
        support_plane,
    };
    let closed = ready.close(object, &pose, &preshape, &options)?;
    let mut answer = json!({
        "pose": pose_json(&closed.object_from_root),
        "joints": hand.positions_by_name(&closed.joints),
        "contacts": closed.contacts.iter().map(|c| json!(ContactRecord::new(hand, c))).collect::<Vec<_>>(),
        "epsilon": closed.epsilon,
        "fvol": closed.free_volume.fvol,
        "fvol_union": closed.free_volume.fvol_union,
        "penetration": closed.penetration,
        "reason": closed.reason.map(|r| r.to_string()),
    });
    if let Some(reason) = closed.reason {
        answer["hint"] = json!(reason.hint());
    }
    Ok(answer)
}
