//! `prehend train DATA…`

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use prehend::frame::Frame;
use prehend::model::{Model, TrainOptions, TrainReport, Trained};
use prehend::stages::learn::{NamedNetwork, write_model};
use prehend::training::to_table;
use serde_json::{Value, json};

use super::model::read_model;
use super::training_rows::TrainingRows;
use crate::output::{self, Outcome, Usage};

/// Learn a network from tables
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  prehend train out/grasps/human --labels out/labels.sqlite --persona strict --network networks/paper.toml \\\n      --balance task --group object --out models\n\
  prehend train data.csv --network mine.toml --out models --json\n\
  prehend train new.csv --update models/mine.json --out models"
)]
pub struct Arguments {
    #[command(flatten)]
    rows: TrainingRows,

    /// The network: nodes, arcs, mixtures
    #[arg(long, required_unless_present = "update", conflicts_with = "update")]
    network: Option<PathBuf>,

    /// A trained model that goes on with these rows, without those that it knows (.json, .bin)
    #[arg(long, value_name = "MODEL")]
    update: Option<PathBuf>,

    /// Starts of EM for each mixture
    #[arg(long, default_value_t = TrainOptions::default().restarts)]
    restarts: usize,

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
        let start = match (&self.network, &self.update) {
            (Some(network), _) => Start::Network(NamedNetwork::read(network)?),
            (None, Some(path)) => Start::Model(stem(path), read_model(path)?),
            (None, None) => bail!(Usage("--network or --update is missing".into())),
        };
        let frame = self.rows.read(start.asks_for_task())?;
        let (kept, held_out) = self.split(frame)?;
        let why = if self.holdout.is_empty() {
            ""
        } else {
            " after holding out"
        };
        let rows = self.rows.balanced(kept, why)?;
        let options = TrainOptions {
            seed: self.rows.seed,
            group: self.rows.group.clone(),
            restarts: self.restarts,
            ..TrainOptions::default()
        };
        let table = to_table(&rows)?;
        let n_rows = rows.n_rows();
        drop(rows);
        let trained = match &start {
            Start::Network(network) => Model::fit(&network.network, &table, &options),
            Start::Model(_, model) => model.update(&table, &options),
        };
        let Trained { model, report } = trained.map_err(|e| self.rows.blame(e))?;
        let held_out_likelihood = if held_out.n_rows() == 0 {
            None
        } else {
            Some(model.log_likelihood(&to_table(&held_out)?)?.iter().sum::<f64>())
        };
        let answer = json!({
            "rows": n_rows,
            "rows_in_all": report.n_rows,
            "log_likelihood": report.log_likelihood,
            "holdout_rows": held_out.n_rows(),
            "holdout_log_likelihood": held_out_likelihood,
            "nodes": node_facts(&report),
            "gaps": report.gaps,
            "warnings": report.warnings,
        });
        if let Some(out) = &self.out {
            let provenance = json!({
                "network": start.name(), "seed": self.rows.seed, "rows": report.n_rows,
                "balanced_by": self.rows.balance, "held_out": self.holdout,
            });
            write_model(
                &out.join(start.name()),
                &model.with_extra("provenance", &provenance.to_string())?,
            )?;
        }
        output::answer(json, &answer, text)?;
        Ok(Outcome::Done)
    }

    fn split(&self, frame: Frame) -> Result<(Frame, Frame)> {
        if self.holdout.is_empty() {
            let none = frame.select(&[]);
            return Ok((frame, none));
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

/// What learning starts from.
enum Start {
    Network(NamedNetwork),
    /// A model and its name.
    Model(String, Model),
}

impl Start {
    fn name(&self) -> &str {
        match self {
            Self::Network(network) => &network.name,
            Self::Model(name, _) => name,
        }
    }

    fn asks_for_task(&self) -> bool {
        match self {
            Self::Network(network) => network.network.nodes().iter().any(|node| node.name == "task"),
            Self::Model(_, model) => model.index("task").is_ok(),
        }
    }
}

fn stem(path: &Path) -> String {
    let stem = path.file_stem().and_then(|name| name.to_str());
    stem.unwrap_or("model").to_owned()
}

/// Per continuous node and configuration: components chosen, what each number tried was worth, how EM went.
fn node_facts(report: &TrainReport) -> Value {
    let facts = report.nodes.iter().filter(|n| !n.cells.is_empty()).map(|node| {
        let each = |f: &dyn Fn(&prehend::model::CellReport) -> Value| Value::Array(node.cells.iter().map(f).collect());
        let curve = |c: &prehend::model::CellReport| {
            json!(c.curve.iter().map(|o| json!({ "components": o.components, "bic": o.bic, "held_out": o.held_out })).collect::<Vec<_>>())
        };
        let facts = json!({
            "components": each(&|c| json!(c.components)),
            "bic": each(&|c| json!(c.bic())),
            "rows": each(&|c| json!(c.n_rows)),
            "n_effective": each(&|c| json!(c.n_effective)),
            "steps": each(&|c| json!(c.steps)),
            "converged": each(&|c| json!(c.converged)),
            "reinitialized": each(&|c| json!(c.reinitialized)),
            "dropped": each(&|c| json!(c.dropped)),
            "pooled": each(&|c| json!(c.pooled)),
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
