//! Why an answer came out as it did, in nats and in words, and what it would have been otherwise.

use serde_json::{Map, Value, json};

use crate::cpd::Cpd;
use crate::error::ModelError;
use crate::evidence::Evidence;
use crate::model::Model;

/// A contribution below this, in nats, is not worth a word: one part in twenty.
const WORTH_A_WORD: f64 = 0.05;

/// Contributions of the observed nodes to the odds between states of a discrete target.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// The target.
    pub target: String,
    /// The likeliest state.
    pub state: String,
    /// For each other state: log P(state | evidence) − log P(other | evidence), and where it comes from.
    pub against: Vec<Contrast>,
}

/// Where the odds against one other state come from.
#[derive(Debug, Clone, PartialEq)]
pub struct Contrast {
    /// The other state.
    pub other: String,
    /// Log odds without evidence, nats.
    pub prior: f64,
    /// Node and nats: how much its observation adds, given those before it in the list. Parents stand first.
    pub contributions: Vec<(String, f64)>,
    /// Their sum: log P(state | evidence) − log P(other | evidence).
    pub total: f64,
}

/// The posterior of a target as it is, and as it would be with some observations replaced.
#[derive(Debug, Clone, PartialEq)]
pub struct Counterfactual {
    /// The target.
    pub target: String,
    /// What is replaced or added, in words: `fvol` and its value.
    pub changes: Vec<(String, String)>,
    /// State, its probability as things are, and as they would be.
    pub states: Vec<(String, f64, f64)>,
}

impl Model {
    /// Splits the log posterior odds of a discrete target into one number per observed node. The evidence is entered
    /// node by node, parents first; each node's number is what its observation changes, given those before it:
    ///
    /// ```text
    /// log p(eⱼ | e₁ … eⱼ₋₁, state) − log p(eⱼ | e₁ … eⱼ₋₁, other)
    /// ```
    ///
    /// so that prior and contributions sum to the log posterior odds exactly, also where nodes are hidden. Infinite odds
    /// stay infinite.
    ///
    /// # Errors
    ///
    /// As [`Model::query`]; a continuous target.
    pub fn explain(&self, target: &str, evidence: &Evidence) -> Result<Explanation, ModelError> {
        let idx = self.index(target)?;
        let Cpd::Discrete(cpd) = &self.node(idx).cpd else {
            return Err(ModelError::BadValue {
                node: target.into(),
                found: "a continuous target to explain".into(),
                expected: "a discrete node".into(),
            });
        };
        let log_posterior = |evidence: &Evidence| -> Result<Vec<f64>, ModelError> {
            let answer = self.query(&[target], evidence)?;
            answer.exact()?;
            let mut out = vec![f64::NEG_INFINITY; cpd.states.len()];
            for term in &answer.terms {
                out[term.states[0]] = term.log_weight;
            }
            Ok(out)
        };
        let mut so_far = Evidence::new();
        let mut steps = vec![(String::new(), log_posterior(&so_far)?)];
        for &node in self.order() {
            if let Some(observation) = evidence.get(node) {
                let name = &self.node(node).name;
                so_far = so_far.with(self, name, observation.clone())?;
                steps.push((name.clone(), log_posterior(&so_far)?));
            }
        }
        let end = &steps[steps.len() - 1].1;
        let best = (0..end.len()).fold(0, |best, i| if end[i] > end[best] { i } else { best });
        let odds = |logs: &[f64], other: usize| logs[best] - logs[other];
        let against = (0..end.len())
            .filter(|&other| other != best)
            .map(|other| Contrast {
                other: cpd.states[other].clone(),
                prior: odds(&steps[0].1, other),
                contributions: steps
                    .windows(2)
                    .map(|pair| {
                        (
                            pair[1].0.clone(),
                            odds(&pair[1].1, other) - odds(&pair[0].1, other),
                        )
                    })
                    .collect(),
                total: odds(end, other),
            })
            .collect();
        Ok(Explanation {
            target: target.into(),
            state: cpd.states[best].clone(),
            against,
        })
    }

    /// What the posterior of a discrete target would be had some nodes been observed otherwise (or at all), everything
    /// else as it was observed. This is a statement about evidence, not about an intervention.
    ///
    /// # Errors
    ///
    /// As [`Model::query`]; a continuous target.
    pub fn counterfactual(
        &self,
        target: &str,
        evidence: &Evidence,
        changes: &Evidence,
    ) -> Result<Counterfactual, ModelError> {
        let mut other = evidence.clone();
        let mut changed = Vec::new();
        for (idx, observation) in changes.iter() {
            let name = &self.node(idx).name;
            other = other.with(self, name, observation.clone())?;
            changed.push((name.clone(), observation.in_words(self.node(idx).states())));
        }
        let posterior = |evidence: &Evidence| -> Result<Vec<f64>, ModelError> {
            let answer = self.query(&[target], evidence)?;
            answer.exact()?;
            answer.probabilities(target).ok_or_else(|| ModelError::BadValue {
                node: target.into(),
                found: "a continuous target to explain".into(),
                expected: "a discrete node".into(),
            })
        };
        let (before, after) = (posterior(evidence)?, posterior(&other)?);
        let states = self.node(self.index(target)?).states().iter().cloned();
        Ok(Counterfactual {
            target: target.into(),
            changes: changed,
            states: states
                .zip(before)
                .zip(after)
                .map(|((state, before), after)| (state, before, after))
                .collect(),
        })
    }
}

impl Explanation {
    /// `{"target", "state", "against": {OTHER: {"prior", "contributions": {NODE: nats}, "total"}}}`.
    pub fn to_json(&self) -> String {
        let mut against = Map::new();
        for contrast in &self.against {
            let parts: Map<String, Value> = contrast
                .contributions
                .iter()
                .map(|(node, nats)| (node.clone(), json!(nats)))
                .collect();
            let entry = json!({ "prior": contrast.prior, "contributions": parts, "total": contrast.total });
            against.insert(contrast.other.clone(), entry);
        }
        json!({ "target": self.target, "state": self.state, "against": against, "words": self.words() })
            .to_string()
    }

    /// One sentence for each other state: how many times more probable the likeliest state is, and which observations
    /// make it so, the strongest first.
    pub fn words(&self) -> Vec<String> {
        self.against
            .iter()
            .map(|contrast| contrast.words(&self.state))
            .collect()
    }
}

impl Contrast {
    fn words(&self, state: &str) -> String {
        let mut parts: Vec<(&str, f64)> = self
            .contributions
            .iter()
            .map(|(node, nats)| (node.as_str(), *nats))
            .collect();
        parts.push(("what is common", self.prior));
        parts.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        let told: Vec<String> = parts
            .iter()
            .filter(|(_, nats)| nats.abs() >= WORTH_A_WORD || nats.is_nan())
            .map(|(node, nats)| {
                let side = if *nats > 0.0 { "for" } else { "against" };
                format!("{node} speaks {side} it ({nats:+.2} nats)")
            })
            .collect();
        let why = if told.is_empty() {
            "no observation tells them apart".into()
        } else {
            told.join(", ")
        };
        format!(
            "`{state}` is {} as probable as `{}`: {why}",
            times(self.total),
            self.other
        )
    }
}

/// exp(nats) as a person says it.
fn times(nats: f64) -> String {
    let ratio = nats.exp();
    if ratio.is_finite() && ratio < 1e4 {
        format!("{ratio:.3} times")
    } else if nats.is_finite() {
        format!("10^{:.0} times", nats / std::f64::consts::LN_10)
    } else {
        "infinitely many times".into()
    }
}

impl Counterfactual {
    /// "had `fvol` been 0.9, `pouring` would have 0.71 (now 0.23)", the state that changes most first.
    pub fn words(&self) -> Vec<String> {
        let had: Vec<String> = self
            .changes
            .iter()
            .map(|(node, value)| format!("`{node}` been {value}"))
            .collect();
        let mut states: Vec<&(String, f64, f64)> = self.states.iter().collect();
        states.sort_by(|a, b| (b.2 - b.1).abs().total_cmp(&(a.2 - a.1).abs()));
        states
            .into_iter()
            .map(|(state, before, after)| {
                format!(
                    "had {}, `{state}` would have {after:.3} (now {before:.3})",
                    had.join(" and ")
                )
            })
            .collect()
    }

    /// `{"target", "changes": {NODE: value in words}, "posterior": {STATE: {"now", "then"}}, "words"}`.
    pub fn to_json(&self) -> String {
        let changes: Map<String, Value> = self
            .changes
            .iter()
            .map(|(node, value)| (node.clone(), json!(value)))
            .collect();
        let states: Map<String, Value> = self
            .states
            .iter()
            .map(|(state, before, after)| (state.clone(), json!({ "now": before, "then": after })))
            .collect();
        json!({ "target": self.target, "changes": changes, "posterior": states, "words": self.words() })
            .to_string()
    }
}
