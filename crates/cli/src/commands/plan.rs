//! `prehend plan --hand H --object O --task T --model M`

use std::path::PathBuf;

use anyhow::Result;
use prehend::grasp::SynthesisOptions;
use prehend::grasp_table::ContactRecord;
use prehend::hand::Hand;
use prehend::plan::{Planned, Request, plan};
use prehend::run_record::timed;
use prehend::stages::decompose::shape_of;
use prehend::stages::synthesize::HandData;
use serde_json::{Value, json};

use super::hand::pose_json;
use super::model::read_model;
use super::shape_input::PlacementOptions;
use crate::bars::Bars;
use crate::output::{self, Outcome};

/// Rank grasps of this hand on this object for this task
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  prehend plan --hand hands/schunk_sdh --object objects/mug/coffee_mug.ply --task pouring \\\n      --model out/models/schunk_sdh/task-action.bin --top 5"
)]
pub struct Arguments {
    /// A folder with hand.toml and a URDF
    #[arg(long)]
    hand: PathBuf,

    /// A mesh; the .toml beside it is applied
    #[arg(long)]
    object: PathBuf,

    /// A state of the model's node `task`
    #[arg(long)]
    task: String,

    /// A model trained on grasps of this hand (.bin or .json)
    #[arg(long)]
    model: PathBuf,

    /// How many grasps to answer with
    #[arg(long, default_value_t = 10)]
    top: usize,

    /// How many grasps to try
    #[arg(long, default_value_t = 500)]
    tries: usize,

    /// Close only tries drawn from what the model knows of P(action | task, object)
    #[arg(long)]
    proposals: bool,

    /// Seed of pre-shapes and offsets
    #[arg(long, default_value_t = 1)]
    seed: u64,

    /// Height (m, object frame) of a support: no part of the hand below it
    #[arg(long, allow_negative_numbers = true)]
    support_plane: Option<f64>,

    #[command(flatten)]
    placement: PlacementOptions,
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        let model = read_model(&self.model)?;
        let hand = HandData::read(&self.hand)?;
        let shape = shape_of(&self.object, self.placement.object_options())?;
        let options = SynthesisOptions {
            tries: self.tries,
            seed: self.seed,
            support_plane: self.support_plane,
            ..SynthesisOptions::default()
        };
        let bars = Bars::default();
        let watch = bars.watch();
        watch.progress.begin("plan", self.tries as u64);
        let request = Request {
            task: &self.task,
            model: &model,
            top: self.top,
            proposals: self.proposals,
        };
        let (result, seconds) = timed(|| plan(&hand.hand, &shape, &request, &options, watch));
        watch.progress.end();
        let result = result?;
        let mut answer = json!({
            "grasps": result.grasps.iter().map(|g| planned_json(&hand.hand, g)).collect::<Vec<_>>(),
            "tried": result.tried,
            "closed": result.closed,
            "kept": result.kept,
            "suitable": result.suitable,
            "seconds": seconds,
            "scale": shape.object.placement.scale,
            "up": shape.object.placement.up,
            "front": shape.object.placement.front,
            "scale_from": shape.object.origins.scale,
            "up_from": shape.object.origins.up,
            "front_from": shape.object.origins.front,
            "notes": shape.object.notes,
        });
        if let Some(reason) = result.reason {
            answer["reason"] = json!(reason);
        }
        output::answer(json, &answer, text)?;
        Ok(Outcome::Done)
    }
}

fn planned_json(hand: &Hand, planned: &Planned) -> Value {
    let grasp = &planned.grasp;
    let preshape = hand.preshape(grasp.features.egpc);
    let joints = |p| json!(hand.positions_by_name(p));
    json!({
        "grasp_id": planned.grasp_id,
        "p_task": planned.p_task,
        "epsilon": grasp.features.qeps,
        "pose": pose_json(&grasp.object_from_root),
        "pregrasp": { "pose": pose_json(&planned.pregrasp), "joints": joints(&preshape) },
        "joints": joints(&grasp.joints),
        "contacts": grasp.contacts.iter().map(|c| json!(ContactRecord::new(hand, c))).collect::<Vec<_>>(),
    })
}

fn text(answer: &Value) -> String {
    let mut out = format!(
        "{} of {} tries hold in force closure\n",
        answer["kept"], answer["tried"]
    );
    for note in answer["notes"].as_array().into_iter().flatten() {
        out += &format!("  note: {}\n", note.as_str().unwrap_or(""));
    }
    if let Some(reason) = answer["reason"].as_str() {
        out += &format!("no grasp: {reason}\n");
    }
    for (rank, g) in answer["grasps"].as_array().into_iter().flatten().enumerate() {
        out += &format!(
            "{:>3}. {}  P(task) {:.3}  epsilon {:.3}  {} contacts\n",
            rank + 1,
            g["grasp_id"].as_str().unwrap_or(""),
            g["p_task"].as_f64().unwrap_or(f64::NAN),
            g["epsilon"].as_f64().unwrap_or(f64::NAN),
            g["contacts"].as_array().map_or(0, Vec::len)
        );
    }
    out
}
