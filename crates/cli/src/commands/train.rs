//! `prehend train DATA…`

use std::path::PathBuf;

use anyhow::{Result, bail};
use prehend::frame::Frame;
use prehend::model::{TrainOptions, TrainReport, Trained};
use prehend::stages::learn::{NamedNetwork, write_model};
use prehend::training::to_table;
use serde_json::{Value, json};

use super::training_rows::TrainingRows;
use crate::output::{self, Outcome};

/// Learn a network from tables
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  prehend train out/grasps/human --labels out/labels.sqlite --persona strict --network networks/paper.toml \\\n      --balance task --group object --out models\n\
  prehend train data.csv --network mine.toml --out models --json"
)]
pub struct Arguments {
    #[command(flatten)]
    rows: TrainingRows,

    /// The network: nodes, arcs, mixtures
    #[arg(long)]
    network: PathBuf,

    /// Where NETWORK.json and NETWORK.bin go
    #[arg(long)]
    out: Option<PathBuf>,

    /// Column that says which rows are held out
    #[arg(long, default_value = "object")]
    holdout_column: String,

    /// Values of that column to hold out, separated by commas
    #[arg(long, value_delimiter = ',')]
    holdout: Vec<String>,
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        let network = NamedNetwork::read(&self.network)?;
        let frame = self.rows.read(&network.network)?;
        let (kept, held_out) = self.split(&frame)?;
        let why = if self.holdout.is_empty() {
            ""
        } else {
            " after holding out"
        };
        let rows = self.rows.balanced(kept, why)?;
        let options = TrainOptions {
            seed: self.rows.seed,
            group: self.rows.group.clone(),
            ..TrainOptions::default()
        };
        let Trained { model, report } = prehend::model::train(&network.network, &to_table(&rows)?, &options)
            .map_err(|e| self.rows.blame(e))?;
        let held_out_likelihood = if held_out.n_rows() == 0 {
            None
        } else {
            Some(model.log_likelihood(&to_table(&held_out)?)?.iter().sum::<f64>())
        };
        let answer = json!({
            "rows": rows.n_rows(),
            "log_likelihood": report.log_likelihood,
            "holdout_rows": held_out.n_rows(),
            "holdout_log_likelihood": held_out_likelihood,
            "nodes": node_facts(&report),
            "warnings": report.warnings,
        });
        if let Some(out) = &self.out {
            let provenance = json!({
                "network": network.name, "seed": self.rows.seed, "rows": rows.n_rows(),
                "balanced_by": self.rows.balance, "held_out": self.holdout,
            });
            write_model(
                &out.join(&network.name),
                &model.with_extra("provenance", provenance),
            )?;
        }
        output::answer(json, &answer, text)?;
        Ok(Outcome::Done)
    }

    fn split(&self, frame: &Frame) -> Result<(Frame, Frame)> {
        if self.holdout.is_empty() {
            return Ok((frame.clone(), frame.select(&[])));
        }
        let values = frame.texts(&self.holdout_column)?;
        if let Some(missing) = self.holdout.iter().find(|h| !values.contains(h)) {
            bail!(
                "--holdout {missing}: no row has this value in column `{}`",
                self.holdout_column
            );
        }
        let (held, kept): (Vec<usize>, Vec<usize>) =
            (0..values.len()).partition(|&r| self.holdout.contains(&values[r]));
        Ok((frame.select(&kept), frame.select(&held)))
    }
}

/// Per continuous node: components chosen, BIC of each number tried, and EM steps, one entry a configuration.
fn node_facts(report: &TrainReport) -> Value {
    let facts = report.nodes.iter().filter(|n| !n.cells.is_empty()).map(|node| {
        let each = |f: &dyn Fn(&prehend::model::CellReport) -> Value| Value::Array(node.cells.iter().map(f).collect());
        let curve = |c: &prehend::model::CellReport| {
            json!(c.curve.iter().map(|o| json!({ "components": o.components, "bic": o.bic })).collect::<Vec<_>>())
        };
        let facts = json!({
            "components": each(&|c| json!(c.components)),
            "bic": each(&|c| json!(c.bic())),
            "steps": each(&|c| json!(c.steps)),
            "tried": each(&curve),
            "configurations": each(&|c| json!(c.configuration.iter().map(|(n, s)| format!("{n}={s}")).collect::<Vec<_>>().join(","))),
        });
        (node.name.clone(), facts)
    });
    Value::Object(facts.collect())
}

fn text(answer: &Value) -> String {
    let mut out = format!(
        "{} rows, log-likelihood {}\n",
        answer["rows"], answer["log_likelihood"]
    );
    if !answer["holdout_log_likelihood"].is_null() {
        out += &format!(
            "{} rows held out, log-likelihood {}\n",
            answer["holdout_rows"], answer["holdout_log_likelihood"]
        );
    }
    out + &format!("{}\n", answer["nodes"])
}
