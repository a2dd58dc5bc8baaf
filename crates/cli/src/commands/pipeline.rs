//! `prehend pipeline`

use std::path::PathBuf;

use anyhow::Result;
use prehend::pipeline::{PipelineOptions, run};
use serde_json::{Value, json};

use crate::bars::Bars;
use crate::output::{self, Outcome};

/// Run every stage and write the report; stop and start again at will
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  prehend pipeline --quick\n  prehend pipeline --objects my/meshes --out out-mine"
)]
pub struct Arguments {
    /// A first look: a few objects, fewer tries
    #[arg(long)]
    quick: bool,

    /// Folder of meshes, at any depth
    #[arg(long, default_value = "objects")]
    objects: PathBuf,

    /// Folder of hands; each has a hand.toml
    #[arg(long, default_value = "hands")]
    hands: PathBuf,

    /// Folder of networks
    #[arg(long, default_value = "networks")]
    networks: PathBuf,

    /// Which hands and objects the experiments use [default: experiments.toml beside the objects, else derived]
    #[arg(long)]
    experiments: Option<PathBuf>,

    /// Where everything goes
    #[arg(long, default_value = "out")]
    out: PathBuf,

    /// Seed of everything drawn
    #[arg(long, default_value_t = 1)]
    seed: u64,

    /// Tries per hand and object, instead of the default for each hand
    #[arg(long)]
    tries: Option<usize>,

    /// Threads [default: one per processor]; results do not depend on it
    #[arg(long)]
    threads: Option<usize>,
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        if let Some(threads) = self.threads {
            super::use_threads(threads)?;
        }
        let options = PipelineOptions {
            quick: self.quick,
            objects: self.objects,
            hands: self.hands,
            networks: self.networks,
            experiments: self.experiments,
            out: self.out,
            seed: self.seed,
            tries: self.tries,
            arguments: std::env::args().skip(1).collect(),
        };
        let bars = Bars::default();
        let summary = run(&options, bars.watch())?;
        let answer = json!({
            "report": summary.report.to_string_lossy(),
            "objects": summary.n_objects,
            "hands": summary.n_hands,
            "grasps": summary.n_grasps,
            "stages": summary.stages.iter().map(|s| json!({"name": s.name, "seconds": s.seconds, "detail": s.detail})).collect::<Vec<_>>(),
        });
        output::answer(json, &answer, text)?;
        Ok(Outcome::Done)
    }
}

fn text(answer: &Value) -> String {
    let mut out = String::new();
    for stage in answer["stages"].as_array().into_iter().flatten() {
        out += &format!(
            "{:12} {:>8.1} s  {}\n",
            stage["name"].as_str().unwrap_or(""),
            stage["seconds"].as_f64().unwrap_or(0.0),
            stage["detail"].as_str().unwrap_or("")
        );
    }
    out + &format!("\nThe report is at {}\n", answer["report"].as_str().unwrap_or(""))
}
