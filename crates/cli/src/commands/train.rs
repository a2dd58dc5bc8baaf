//! `prehend train DATA…`

use std::path::PathBuf;

use anyhow::{Result, bail};
use prehend::frame::Frame;
use prehend::labels::LabelStore;
use prehend::model::{ModelError, TrainOptions, TrainReport, Trained};
use prehend::stages::learn::{NamedNetwork, write_model};
use prehend::training::{balanced_rows, labelled_copies, to_table};
use serde_json::{Value, json};

use super::grasps::{listed, read_tables};
use crate::output::{self, Outcome, Usage};

/// Learn a network from tables
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  prehend train out/grasps/human --labels out/labels.sqlite --persona strict --network networks/paper.toml \\\n      --balance task --group object --out models\n\
  prehend train data.csv --network mine.toml --out models --json"
)]
pub struct Arguments {
    /// Tables (.parquet, .csv, .jsonl) or folders of them
    #[arg(required = true)]
    data: Vec<PathBuf>,

    /// The network: nodes, arcs, mixtures
    #[arg(long)]
    network: PathBuf,

    /// Where NETWORK.json and NETWORK.bin go
    #[arg(long)]
    out: Option<PathBuf>,

    /// Labels for grasp tables: each grasp enters once for each task that it affords
    #[arg(long)]
    labels: Option<PathBuf>,

    /// Whose labels
    #[arg(long, default_value = "strict", requires = "labels")]
    persona: String,

    /// Balance the rows: each value of this column as often as the rarest
    #[arg(long)]
    balance: Option<String>,

    /// Rows of one value of this column are no independent evidence (for example `object`)
    #[arg(long)]
    group: Option<String>,

    /// Column that says which rows are held out
    #[arg(long, default_value = "object")]
    holdout_column: String,

    /// Values of that column to hold out, separated by commas
    #[arg(long, value_delimiter = ',')]
    holdout: Vec<String>,

    /// Seed of balancing and of EM's starts
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        let network = NamedNetwork::read(&self.network)?;
        let mut frame = read_tables(&self.data)?;
        if let Some(labels) = &self.labels {
            if !labels.is_file() {
                bail!(Usage(format!("--labels {}: no such file", labels.display())));
            }
            let answers = LabelStore::open(labels)?.answers(&self.persona, &[])?;
            if answers.is_empty() {
                bail!(
                    "{}: holds no labels of persona `{}`",
                    labels.display(),
                    self.persona
                );
            }
            frame = labelled_copies(&frame, &answers)?;
        } else if frame.column("task").is_none()
            && frame.column("grasp_id").is_some()
            && asks_for_task(&network)
        {
            bail!(
                "these are grasp tables without a column `task`, which the network's node `task` needs; \
                 give --labels out/labels.sqlite, or make labels with `prehend label`"
            );
        }
        let (kept, held_out) = self.split(&frame)?;
        let rows = match &self.balance {
            Some(column) => kept.select(&balanced_rows(&kept, column, self.group.as_deref(), self.seed)?),
            None => kept,
        };
        if rows.n_rows() == 0 {
            bail!(
                "there are no rows to learn from{}",
                if self.holdout.is_empty() {
                    ""
                } else {
                    " after holding out"
                }
            );
        }
        let options = TrainOptions {
            seed: self.seed,
            group: self.group.clone(),
            ..TrainOptions::default()
        };
        let Trained { model, report } = prehend::model::train(&network.network, &to_table(&rows)?, &options)
            .map_err(|e| counted_from_one(e).context(listed(&self.data)))?;
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
                "network": network.name, "seed": self.seed, "rows": rows.n_rows(),
                "balanced_by": self.balance, "held_out": self.holdout,
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

fn asks_for_task(network: &NamedNetwork) -> bool {
    network.network.nodes().iter().any(|node| node.name == "task")
}

/// A cell's error with its row as a person counts.
fn counted_from_one(error: ModelError) -> anyhow::Error {
    match error {
        ModelError::Cell {
            column,
            row,
            found,
            expected,
        } => anyhow::anyhow!(
            "column `{column}`, row {} of those to learn from (counted from 1): found {found}, expected {expected}",
            row + 1
        ),
        other => other.into(),
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
