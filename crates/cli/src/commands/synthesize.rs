//! `prehend synthesize --hand H --object O`

use std::path::PathBuf;

use anyhow::Result;
use prehend::frame::TableWriter;
use prehend::grasp::{HypothesisBoxes, Preshapes, SynthesisOptions};
use prehend::run_record::timed;
use prehend::stages::decompose::shape_of;
use prehend::stages::synthesize::{HandData, grasp_to};
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

    /// Which boxes hypotheses come from: the leaves of the decomposition only, or the inner nodes of its tree, too
    #[arg(long, value_enum, default_value = "tree")]
    boxes: Boxes,

    /// How pre-shapes are spread: drawn at random, or by a sequence that fills their square evenly
    #[arg(long, value_enum, default_value = "random")]
    preshapes: Spread,

    /// Steps of local search for a larger epsilon, for each grasp that holds
    #[arg(long, default_value_t = 0)]
    refine: usize,

    #[command(flatten)]
    placement: PlacementOptions,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Boxes {
    Leaves,
    Tree,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Spread {
    Random,
    LowDiscrepancy,
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        let table = self.out.as_deref().map(TableWriter::create).transpose()?;
        let hand = HandData::read(&self.hand)?;
        let shape = shape_of(&self.object, self.placement.object_options())?;
        let options = SynthesisOptions {
            tries: self.tries,
            seed: self.seed,
            support_plane: self.support_plane,
            boxes: match self.boxes {
                Boxes::Leaves => HypothesisBoxes::Leaves,
                Boxes::Tree => HypothesisBoxes::Tree,
            },
            preshapes: match self.preshapes {
                Spread::Random => Preshapes::Random,
                Spread::LowDiscrepancy => Preshapes::LowDiscrepancy,
            },
            refinement: self.refine,
            ..SynthesisOptions::default()
        };
        let bars = Bars::default();
        let watch = bars.watch();
        watch.progress.begin("synthesize", self.tries as u64);
        let (result, seconds) = timed(|| grasp_to(&hand, &shape, &options, table, watch));
        watch.progress.end();
        let harvest = result?;
        let tries = &harvest.tries;
        let answer = json!({
            "tried": tries.tried,
            "kept": tries.kept,
            "rejected": tries.rejected,
            "hints": harvest.hints,
            "mean_epsilon": harvest.mean_epsilon,
            "directions": harvest.directions,
            "seconds": seconds,
            "tries_per_second": tries.tried as f64 / seconds,
            "kept_per_second": tries.kept as f64 / seconds,
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
    let number = |key: &str| answer[key].as_f64().unwrap_or(0.0);
    let mut out = format!(
        "{} of {} tries hold in force closure ({:.0} tries a second, {:.0} kept)\n\
         mean epsilon {:.3}, from {:.0} % of all directions\n",
        answer["kept"],
        answer["tried"],
        number("tries_per_second"),
        number("kept_per_second"),
        number("mean_epsilon"),
        100.0 * number("directions"),
    );
    for (reason, n) in answer["rejected"].as_object().into_iter().flatten() {
        let hint = answer["hints"][reason].as_str().unwrap_or("");
        out += &format!("  {n:>6}  {reason}: {hint}\n");
    }
    for note in answer["notes"].as_array().into_iter().flatten() {
        out += &format!("  note: {}\n", note.as_str().unwrap_or(""));
    }
    out
}
