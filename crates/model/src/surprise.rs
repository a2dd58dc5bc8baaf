//! Does the evidence resemble anything the model knows?

use serde_json::{Map, Value, json};

use crate::batch::BatchQuery;
use crate::cpd::NodeIdx;
use crate::elimination::full_value;
use crate::error::ModelError;
use crate::evidence::{Evidence, Observation};
use crate::mixture::Mixture;
use crate::model::Model;

/// Rows drawn where a compiled query scores them, and where each is a query of its own.
const COMPILED_SAMPLES: usize = 999;
const SINGLE_SAMPLES: usize = 199;
/// The same evidence gets the same score.
const SEED: u64 = 1;
/// Below these tails the words say "rare" and "nothing like it".
const RARE: f64 = 0.05;
const UNLIKE: f64 = 0.01;

/// How far out evidence lies, by comparison with rows drawn from the model.
#[derive(Debug, Clone, PartialEq)]
pub struct Surprise {
    /// Natural logarithm of the density of the evidence.
    pub log_evidence: f64,
    /// (1 + rows at most as dense) / (1 + rows): about 0.5 for an ordinary row, small for "none of these".
    pub tail: f64,
    /// Rows drawn from the model, of which the same dimensions were scored.
    pub n_samples: usize,
    /// The same for each continuous node by itself, against its own marginal: which observation is the odd one. Nodes
    /// whose marginal has no density or too many components, and directions, are left out.
    pub nodes: Vec<(String, f64)>,
}

impl Model {
    /// Out-of-distribution score: the share of rows drawn from the model whose log density in the observed dimensions is
    /// at most that of the evidence. Uniform on (0, 1) for evidence that comes from the model; a robot that gets 0.001
    /// sees something that no state of any node accounts for, whatever the posterior says.
    ///
    /// Soft and uncertain observations are left out of the score.
    ///
    /// # Errors
    ///
    /// As [`Model::query`].
    pub fn surprise(&self, evidence: &Evidence) -> Result<Surprise, ModelError> {
        let mut plain = Evidence::new();
        for (idx, observation) in evidence.iter() {
            if matches!(observation, Observation::State(_) | Observation::Value(_)) {
                plain = plain.with(self, &self.node(idx).name, observation.clone())?;
            }
        }
        let log_evidence = self.log_evidence(&plain)?;
        let scores = match self.compiled_scores(&plain) {
            Some(scores) => scores?,
            None => self.single_scores(&plain)?,
        };
        let mut nodes = Vec::new();
        for (idx, observation) in plain.iter() {
            if let (Observation::Value(value), Some(_)) = (observation, self.mixture(idx)) {
                let tail = self
                    .marginal(idx)?
                    .and_then(|marginal| node_tail(&marginal, value));
                nodes.extend(tail.map(|tail| (self.node(idx).name.clone(), tail)));
            }
        }
        Ok(Surprise {
            log_evidence,
            tail: tail(&scores, log_evidence),
            n_samples: scores.len(),
            nodes,
        })
    }

    /// Scores of sampled rows by a compiled query; `None` where the pattern of the evidence has gaps.
    fn compiled_scores(&self, evidence: &Evidence) -> Option<Result<Vec<f64>, ModelError>> {
        let whole = |(idx, _): (NodeIdx, _)| self.n_states(idx) > 0 || full_value(evidence, idx).is_some();
        if !evidence.iter().all(whole) {
            return None;
        }
        let target = self.nodes().iter().find(|node| !node.states().is_empty())?;
        let observed: Vec<&str> = evidence
            .iter()
            .map(|(idx, _)| self.node(idx).name.as_str())
            .collect();
        let query = BatchQuery::new(self, &target.name, &observed)
            .ok()
            .filter(BatchQuery::is_compiled)?;
        let answers = query.run_table(&self.sample(COMPILED_SAMPLES, SEED));
        Some(answers.and_then(|rows| {
            rows.into_iter()
                .map(|row| row.map(|row| row.log_evidence))
                .collect()
        }))
    }

    fn single_scores(&self, evidence: &Evidence) -> Result<Vec<f64>, ModelError> {
        let rows = Evidence::from_table(self, &self.sample(SINGLE_SAMPLES, SEED))?;
        rows.into_iter()
            .map(|row| {
                let mut same = Evidence::new();
                for (idx, observation) in evidence.iter() {
                    let drawn = match (row.get(idx), observation) {
                        (Some(Observation::Value(drawn)), Observation::Value(value)) => {
                            let masked = drawn
                                .iter()
                                .zip(value)
                                .map(|(x, v)| if v.is_nan() { f64::NAN } else { *x });
                            Observation::Value(masked.collect())
                        }
                        (Some(other), _) => other.clone(),
                        (None, _) => continue,
                    };
                    same = same.with(self, &self.node(idx).name, drawn)?;
                }
                self.log_evidence(&same)
            })
            .collect()
    }

    /// The marginal of a continuous node; `None` where it has too many components.
    fn marginal(&self, idx: NodeIdx) -> Result<Option<Mixture>, ModelError> {
        let name = &self.node(idx).name;
        match self.query(&[name], &Evidence::new()) {
            Ok(answer) => Ok(answer.exact().ok().and_then(|()| answer.mixture(name))),
            Err(ModelError::Pruned { .. } | ModelError::TooManyTerms { .. }) => Ok(None),
            Err(other) => Err(other),
        }
    }
}

fn node_tail(marginal: &Mixture, value: &[f64]) -> Option<f64> {
    let dims: Vec<usize> = (0..value.len()).filter(|&i| !value[i].is_nan()).collect();
    let seen = marginal.over(&dims);
    let here: Vec<f64> = dims.iter().map(|&i| value[i]).collect();
    let density = seen.log_density(&here)?;
    let scores = seen.log_densities(&seen.sample(COMPILED_SAMPLES, SEED))?;
    Some(tail(&scores, density))
}

fn tail(scores: &[f64], density: f64) -> f64 {
    let below = scores.iter().filter(|score| **score <= density).count();
    (1 + below) as f64 / (1 + scores.len()) as f64
}

impl Surprise {
    /// What it means.
    pub fn words(&self) -> String {
        let verdict = if self.tail <= UNLIKE {
            "the model knows nothing like it; take no posterior at its word"
        } else if self.tail <= RARE {
            "rare, but not unheard of"
        } else {
            "nothing out of the ordinary"
        };
        let mut odd: Vec<&(String, f64)> = self.nodes.iter().filter(|(_, tail)| *tail <= UNLIKE).collect();
        odd.sort_by(|a, b| a.1.total_cmp(&b.1));
        let odd: Vec<String> = odd.iter().map(|(node, _)| format!("`{node}`")).collect();
        let by_itself = if odd.is_empty() {
            String::new()
        } else {
            format!("; odd by itself: {}", odd.join(", "))
        };
        format!(
            "{:.1} % of rows drawn from the model are as improbable: {verdict}{by_itself}",
            100.0 * self.tail
        )
    }

    /// `{"log_evidence", "tail", "samples", "nodes": {NODE: tail}, "words"}`.
    pub fn to_json(&self) -> String {
        let nodes: Map<String, Value> = self
            .nodes
            .iter()
            .map(|(node, tail)| (node.clone(), json!(tail)))
            .collect();
        json!({
            "log_evidence": self.log_evidence,
            "tail": self.tail,
            "samples": self.n_samples,
            "nodes": nodes,
            "words": self.words(),
        })
        .to_string()
    }
}
