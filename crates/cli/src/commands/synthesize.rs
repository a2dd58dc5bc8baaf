//! `prehend synthesize --hand H --object O`

use std::path::PathBuf;

use anyhow::Result;
use prehend::frame::Frame;
use prehend::grasp::SynthesisOptions;
use prehend::run_record::timed;
use prehend::stages::decompose::shape_of;
use prehend::stages::synthesize::{HandData, grasp};
use serde_json::{Value, json};

use super::shape_input::PlacementOptions;
use crate::bars::Bars;
use crate::output::{self, Outcome};

/// Plan and close grasps of a hand on an object
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  prehend synthesize --hand hands/schunk_sdh --object objects/mug/coffee_mug.ply --tries 500 --out grasps.parquet"
)]
pub struct Arguments {
    /// A folder with hand.toml and a URDF
    #[arg(long)]
    hand: PathBuf,

    /// A mesh; the .toml beside it is applied
    #[arg(long)]
    object: PathBuf,

    /// How many grasps to try
    #[arg(long, default_value_t = 500)]
    tries: usize,

    /// Seed of pre-shapes and offsets
    #[arg(long, default_value_t = 1)]
    seed: u64,

    /// Where the force-closure grasps go: .parquet, .csv or .jsonl
    #[arg(long)]
    out: Option<PathBuf>,

    /// Height (m, object frame) of a support: no part of the hand below it
    #[arg(long, allow_negative_numbers = true)]
    support_plane: Option<f64>,

    #[command(flatten)]
    placement: PlacementOptions,
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        if let Some(out) = &self.out {
            Frame::check_name(out)?;
        }
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
        watch.progress.begin("synthesize", self.tries as u64);
        let (result, seconds) = timed(|| grasp(&hand, &shape, &options, watch));
        watch.progress.end();
        let (frame, tries) = result?;
        if let Some(out) = &self.out {
            frame.write(out)?;
        }
        let answer = json!({
            "tried": tries.tried,
            "kept": tries.kept,
            "rejected": tries.rejected,
            "seconds": seconds,
            "tries_per_second": tries.tried as f64 / seconds,
            "scale": shape.object.placement.scale,
            "up": shape.object.placement.up,
            "front": shape.object.placement.front,
            "scale_from": shape.object.origins.scale,
            "up_from": shape.object.origins.up,
            "front_from": shape.object.origins.front,
            "notes": shape.object.notes,
        });
        output::answer(json, &answer, text)?;
        Ok(Outcome::Done)
    }
}

fn text(answer: &Value) -> String {
    let mut out = format!(
        "{} of {} tries hold in force closure ({:.0} tries a second)\n",
        answer["kept"],
        answer["tried"],
        answer["tries_per_second"].as_f64().unwrap_or(0.0)
    );
    for (reason, n) in answer["rejected"].as_object().into_iter().flatten() {
        out += &format!("  {n:>6}  {reason}\n");
    }
    for note in answer["notes"].as_array().into_iter().flatten() {
        out += &format!("  note: {}\n", note.as_str().unwrap_or(""));
    }
    out
}
