//! `prehend query MODEL --target NODE`

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use prehend::frame::Frame;
use prehend::model::{Cpd, Ensemble, EnsemblePosterior, Evidence, Latent, Model, ModelError, Target};
use prehend::training::to_table;
use serde::Deserialize;
use serde_json::{Value, json};

use super::model::read_model;
use crate::output::{self, Outcome, Usage};

/// Ask a model: any nodes given any others
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  prehend query out/models/human/task-action.bin --target task --evidence '{\"size\":[0.11,0.08,0.1],\"cvex\":1.3}'\n\
  prehend query out/models/human/task-action.json --target upos --evidence '{\"task\":\"pouring\"}' --at '[[1,0,0],[0,0,1]]'"
)]
// Flags of a command line are bools, each on its own.
#[allow(clippy::struct_excessive_bools)]
pub struct Arguments {
    /// A model (.bin, .json, .bif, .xmlbif, .net)
    model: PathBuf,

    /// Nodes asked about, separated by commas; several give their joint distribution
    #[arg(long, value_delimiter = ',')]
    target: Vec<String>,

    /// What is known: a JSON object from nodes to values
    #[arg(long)]
    evidence: Option<String>,

    /// A table (CSV, Parquet, JSON lines); one answer a row, with `line` counting rows from 1; columns that belong to no
    /// node are ignored, empty cells are not observed
    #[arg(long, conflicts_with = "evidence")]
    evidence_file: Option<PathBuf>,

    /// JSON lines {"evidence":{…},"target":…,"at":[…]}; - is standard input
    #[arg(long, conflicts_with_all = ["evidence", "evidence_file"])]
    queries: Option<PathBuf>,

    /// Points of a continuous target where the log density is wanted: a JSON array of arrays
    #[arg(long)]
    at: Option<String>,

    /// Distribution of the discrete roots: as trained, uniform, or a JSON object like {"task":{"pouring":1}}
    #[arg(long, default_value = "trained")]
    prior: String,

    /// Also how much each observed node speaks for each state of the (single, discrete) target, and whether the evidence
    /// resembles anything that the model knows
    #[arg(long)]
    explain: bool,

    /// Also what the posterior of the (single, discrete) target would be had these nodes been observed so, the rest as it
    /// is: a JSON object like {"fvol":0.9}
    #[arg(long)]
    counterfactual: Option<String>,

    /// Average the answer over so many models whose parameters are drawn from what the training rows leave open; discrete
    /// targets also get the interval in which nine tenths of them lie
    #[arg(long, default_value_t = 0)]
    draws: usize,

    /// Also so many joint values of the targets, drawn from the answer
    #[arg(long, default_value_t = 0)]
    samples: usize,

    /// Seed of --samples and --draws
    #[arg(long, default_value_t = 0)]
    seed: u64,

    /// Also the modes of a (single, continuous) target, the highest first
    #[arg(long)]
    modes: bool,

    /// Also the most probable explanation: the likeliest values of all nodes that were not observed
    #[arg(long)]
    mpe: bool,

    /// In --mpe, take the likeliest mixture components too, instead of summing over them
    #[arg(long, requires = "mpe")]
    mpe_components: bool,
}

/// Who is asked: the trained model, and the models that its rows allow.
#[derive(Clone, Copy)]
struct Asked<'a> {
    model: &'a Model,
    ensemble: Option<&'a Ensemble>,
}

/// One question.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Question {
    #[serde(default)]
    evidence: Value,
    #[serde(default)]
    target: Option<Targets>,
    #[serde(default)]
    at: Vec<Vec<f64>>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Targets {
    One(String),
    Several(Vec<String>),
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        let trained = read_model(&self.model)?;
        let ensemble = match self.draws {
            0 => None,
            n => {
                let members = trained.draws(n, self.seed).context("--draws")?;
                let members = members.into_iter().map(|member| self.apply_prior(member));
                Some(Ensemble::new(members.collect::<Result<_>>()?)?)
            }
        };
        let model = self.apply_prior(trained)?;
        let asked = Asked {
            model: &model,
            ensemble: ensemble.as_ref(),
        };
        let at: Vec<Vec<f64>> = match &self.at {
            Some(text) => {
                serde_json::from_str(text).map_err(|e| Usage(format!("--at: {e}; expected '[[x,y,…],…]'")))?
            }
            None => Vec::new(),
        };
        if let Some(file) = &self.queries {
            let run = |line: Value| {
                let question: Question =
                    serde_json::from_value(line).context("expected evidence, target and at")?;
                let evidence = Evidence::from_json(&model, &or_empty(&question.evidence))?;
                let targets = match question.target {
                    Some(Targets::One(name)) => name.split(',').map(str::to_owned).collect(),
                    Some(Targets::Several(names)) => names,
                    None => self.target.clone(),
                };
                let at = if question.at.is_empty() { &at } else { &question.at };
                self.ask(asked, &targets, &evidence, at)
            };
            return output::each_json_line(json, file, run, output::plain);
        }
        if let Some(file) = &self.evidence_file {
            let frame = Frame::read(file)?;
            let rows = (0..frame.n_rows()).map(|row| (json!(row + 1), row));
            // Row by row, so that a cell that is no value of its node fails one answer and not all.
            let run = |row: usize| {
                let table = to_table(&frame.select(&[row]))?;
                let answers = Evidence::from_table(&model, &table)
                    .map_err(without_row)
                    .and_then(|rows| self.ask(asked, &self.target, &rows[0], &at));
                answers.with_context(|| format!("{}, row {}", output::shown(file), row + 1))
            };
            return output::each(json, "line", rows, run, output::plain);
        }
        let evidence = match &self.evidence {
            Some(text) => {
                let value: Value = serde_json::from_str(text)
                    .map_err(|e| Usage(format!("--evidence: {e}; expected '{{\"NODE\": value}}'")))?;
                Evidence::from_json(&model, &value.to_string())?
            }
            None => Evidence::new(),
        };
        output::answer(
            json,
            &self.ask(asked, &self.target, &evidence, &at)?,
            output::plain,
        )?;
        Ok(Outcome::Done)
    }

    fn apply_prior(&self, model: Model) -> Result<Model> {
        match self.prior.as_str() {
            "trained" => Ok(model),
            "uniform" => Ok(model.with_uniform_priors()),
            text => {
                let value: Value = serde_json::from_str(text).map_err(|e| {
                    Usage(format!(
                        "--prior: {e}; expected trained, uniform or '{{\"NODE\": {{\"STATE\": p}}}}'"
                    ))
                })?;
                let Value::Object(nodes) = &value else {
                    bail!(Usage(format!("--prior: found {value}, expected a JSON object")))
                };
                nodes.iter().try_fold(model, |model, (node, states)| {
                    let known = model.node(model.index(node)?).states().to_vec();
                    let prior = weights(node, states, &known)?;
                    Ok(model.with_prior(node, &prior)?)
                })
            }
        }
    }

    fn ask(&self, asked: Asked, targets: &[String], evidence: &Evidence, at: &[Vec<f64>]) -> Result<Value> {
        let Asked { model, ensemble } = asked;
        if targets.is_empty() && !self.mpe {
            bail!(Usage("--target is missing: which node is asked about?".into()));
        }
        let mut answer = if targets.is_empty() {
            json!({ "log_evidence": model.log_evidence(evidence)? })
        } else {
            let names: Vec<&str> = targets.iter().map(String::as_str).collect();
            match names[..] {
                [name] if matches!(model.node(model.index(name)?).cpd, Cpd::VonMisesFisher(_)) => model
                    .query_direction(name, evidence)?
                    .to_json_at(at)
                    .map(|text| parsed(&text))?,
                _ => {
                    let all = ensemble
                        .map(|ensemble| ensemble.query(&names, evidence))
                        .transpose()?;
                    let posterior = match &all {
                        Some(all) => all.mean.clone(),
                        None => model.query(&names, evidence)?,
                    };
                    let mut answer = parsed(&posterior.to_json_at(at)?);
                    if let Some(all) = &all {
                        answer["interval"] = interval(all);
                    }
                    if self.samples > 0 {
                        answer["samples"] = parsed(&posterior.samples_json(self.samples, self.seed));
                    }
                    if self.modes {
                        let modes = posterior.modes_json();
                        answer["modes"] = parsed(&modes.map_err(|e| anyhow::anyhow!("--modes: {e}"))?);
                    }
                    answer
                }
            }
        };
        if self.explain {
            let [target] = targets else {
                bail!(Usage("--explain needs exactly one --target".into()))
            };
            answer["explanation"] = parsed(&model.explain(target, evidence)?.to_json());
            answer["surprise"] = parsed(&model.surprise(evidence)?.to_json());
        }
        if let Some(text) = &self.counterfactual {
            let [target] = targets else {
                bail!(Usage("--counterfactual needs exactly one --target".into()))
            };
            let value: Value = serde_json::from_str(text)
                .map_err(|e| Usage(format!("--counterfactual: {e}; expected '{{\"NODE\": value}}'")))?;
            let changes = Evidence::from_json(model, &value.to_string())?;
            answer["counterfactual"] = parsed(&model.counterfactual(target, evidence, &changes)?.to_json());
        }
        if self.mpe {
            let latent = if self.mpe_components {
                Latent::Maximised
            } else {
                Latent::Summed
            };
            answer["mpe"] = parsed(&model.most_probable(evidence, latent)?.to_json());
        }
        Ok(answer)
    }
}

/// Where nine tenths of the members' probabilities lie: `{NODE: {STATE: [low, high]}}`.
fn interval(answer: &EnsemblePosterior) -> Value {
    let of_target = |target: &Target| match target {
        Target::Continuous { .. } => None,
        Target::Discrete { name, states } => {
            let pairs = states.iter().cloned().zip(answer.interval(name, 0.9)?);
            let pairs = pairs.map(|(state, (low, high))| (state, json!([low, high])));
            Some((name.clone(), Value::Object(pairs.collect())))
        }
    };
    Value::Object(answer.mean.targets.iter().filter_map(of_target).collect())
}

fn or_empty(value: &Value) -> String {
    if value.is_null() {
        "{}".into()
    } else {
        value.to_string()
    }
}

/// Our own text, to be joined with others.
fn parsed(json: &str) -> Value {
    serde_json::from_str(json).unwrap_or_default()
}

/// The weights that `--prior` gives to a node's states, scaled to sum 1; a state left out has 0.
fn weights(node: &str, states: &Value, known: &[String]) -> Result<Vec<f64>> {
    let Value::Object(given) = states else {
        bail!(Usage(format!(
            "--prior: `{node}`: found {states}, expected '{{\"STATE\": p}}'"
        )))
    };
    if let Some(state) = given.keys().find(|s| !known.contains(s)) {
        bail!(
            "--prior: `{node}` has no state `{state}`; its states are {}",
            known.join(", ")
        );
    }
    let weight = |state: &String| match given.get(state) {
        None => Ok(0.0),
        Some(value) => match value.as_f64() {
            Some(w) if w.is_finite() && w >= 0.0 => Ok(w),
            _ => bail!("--prior: `{node}`, `{state}`: found {value}, expected a number, 0 or more"),
        },
    };
    let weights = known.iter().map(weight).collect::<Result<Vec<f64>>>()?;
    let total: f64 = weights.iter().sum();
    if total <= 0.0 || !total.is_finite() {
        bail!("--prior: `{node}`: the numbers sum to {total}; give at least one state a positive number");
    }
    Ok(weights.iter().map(|w| w / total).collect())
}

/// A cell's error would say its row in the one-row table that the model saw; the user's row stands before it.
fn without_row(error: ModelError) -> anyhow::Error {
    match error {
        ModelError::Cell {
            column,
            found,
            expected,
            ..
        } => anyhow::anyhow!("column `{column}`: found {found}, expected {expected}"),
        other => other.into(),
    }
}
