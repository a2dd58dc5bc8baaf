//! Why an answer came out as it did, and the single likeliest story.

use serde_json::{Map, Value, json};

use crate::cpd::{Cpd, NodeIdx};
use crate::error::ModelError;
use crate::evidence::{Evidence, Observation};
use crate::json::rows;
use crate::model::Model;

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

/// The likeliest joint state of the unobserved discrete nodes, and the continuous nodes given it.
#[derive(Debug, Clone, PartialEq)]
pub struct MostProbable {
    /// Natural logarithm of the posterior probability of these states.
    pub log_probability: f64,
    /// Natural logarithm of the density of the evidence.
    pub log_evidence: f64,
    /// Unobserved discrete nodes with their states.
    pub states: Vec<(String, String)>,
    /// Unobserved (or partly observed) continuous nodes given those states and the evidence.
    pub values: Vec<ProbableValue>,
}

/// A continuous node in the likeliest story.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbableValue {
    /// The node.
    pub node: String,
    /// Its conditional mean.
    pub mean: Vec<f64>,
    /// The mean of the conditional component where the density is highest; `None` where a component is singular.
    pub mode: Option<Vec<f64>>,
    /// Its conditional covariance.
    pub covariance: Vec<Vec<f64>>,
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
    /// As [`Model::posterior`]; a continuous target.
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
            let answer = self.posterior(&[target], evidence)?;
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

    /// The likeliest joint state of the unobserved discrete nodes, all hidden numbers and mixture components summed out;
    /// then, given it, mean and mode of every continuous node that is not wholly observed, each by itself.
    ///
    /// # Errors
    ///
    /// As [`Model::posterior`].
    pub fn most_probable(&self, evidence: &Evidence) -> Result<MostProbable, ModelError> {
        let is_free = |idx: NodeIdx| match (&self.node(idx).cpd, evidence.get(idx)) {
            // Directions are not Gaussian: they are left out, and asked about by themselves.
            (Cpd::Discrete(_), Some(Observation::State(_))) | (Cpd::VonMisesFisher(_), _) => false,
            (Cpd::Mixture(_), Some(Observation::Value(value))) => value.iter().any(|v| v.is_nan()),
            _ => true,
        };
        let free: Vec<NodeIdx> = (0..self.nodes().len())
            .map(NodeIdx)
            .filter(|&idx| is_free(idx))
            .collect();
        let discrete: Vec<&str> = free
            .iter()
            .filter(|&&idx| self.n_states(idx) > 0)
            .map(|&idx| self.node(idx).name.as_str())
            .collect();
        let answer = self.posterior(&discrete, evidence)?;
        let mut best = &answer.terms[0];
        for term in &answer.terms {
            if term.log_weight > best.log_weight {
                best = term;
            }
        }
        let mut given = evidence.clone();
        let mut states = Vec::with_capacity(discrete.len());
        for (name, &state) in discrete.iter().zip(&best.states) {
            states.push((
                (*name).to_string(),
                self.node(self.index(name)?).states()[state].clone(),
            ));
            given = given.with(self, name, Observation::State(state))?;
        }
        let mut values = Vec::new();
        for &idx in free.iter().filter(|&&idx| self.n_states(idx) == 0) {
            let node = self.node(idx).name.clone();
            let answer = self.posterior(&[&node], &given)?;
            if let Some(mixture) = answer.mixture(&node) {
                values.push(ProbableValue {
                    mean: mixture.mean().iter().copied().collect(),
                    mode: mixture.mode().map(|mode| mode.iter().copied().collect()),
                    covariance: rows(&mixture.covariance()),
                    node,
                });
            }
        }
        Ok(MostProbable {
            log_probability: best.log_weight,
            log_evidence: answer.log_evidence,
            states,
            values,
        })
    }

    /// The same model with other priors: `"trained"`, `"uniform"`, or `{"task": {"pouring": 0.5, …}}`; states left out
    /// get 0, and the numbers are divided by their sum.
    ///
    /// # Errors
    ///
    /// The value is none of these, or names unknown nodes or states.
    pub fn with_priors_json(&self, value: &Value) -> Result<Self, ModelError> {
        let bad = || ModelError::BadValue {
            node: "prior".into(),
            found: value.to_string(),
            expected: "\"trained\", \"uniform\" or {NODE: {STATE: probability}} with a positive sum".into(),
        };
        match value {
            Value::String(word) if word == "trained" => Ok(self.clone()),
            Value::String(word) if word == "uniform" => Ok(self.with_uniform_priors()),
            Value::Object(nodes) => {
                let mut model = self.clone();
                for (name, prior) in nodes {
                    let idx = self.index(name)?;
                    let Value::Object(prior) = prior else {
                        return Err(bad());
                    };
                    let mut numbers = vec![0.0; self.n_states(idx)];
                    for (state, number) in prior {
                        let state = crate::evidence::read_state(self, idx, &Value::from(state.as_str()))?;
                        numbers[state] = number.as_f64().ok_or_else(bad)?;
                    }
                    let sum: f64 = numbers.iter().sum();
                    if !(sum > 0.0 && sum.is_finite()) {
                        return Err(bad());
                    }
                    let numbers: Vec<f64> = numbers.into_iter().map(|p| p / sum).collect();
                    model = model.with_prior(name, &numbers)?;
                }
                Ok(model)
            }
            _ => Err(bad()),
        }
    }
}

impl Explanation {
    /// `{"target", "state", "against": {OTHER: {"prior", "contributions": {NODE: nats}, "total"}}}`.
    pub fn to_json(&self) -> Value {
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
        json!({ "target": self.target, "state": self.state, "against": against })
    }
}

impl MostProbable {
    /// `{"log_probability", "log_evidence", "states": {NODE: state}, "values": {NODE: {"mean", "mode", "covariance"}}}`.
    pub fn to_json(&self) -> Value {
        let states: Map<String, Value> = self
            .states
            .iter()
            .map(|(node, state)| (node.clone(), json!(state)))
            .collect();
        let values: Map<String, Value> = self
            .values
            .iter()
            .map(|value| {
                let entry = json!({ "mean": value.mean, "mode": value.mode, "covariance": value.covariance });
                (value.node.clone(), entry)
            })
            .collect();
        json!({
            "log_probability": self.log_probability,
            "log_evidence": self.log_evidence,
            "states": states,
            "values": values,
        })
    }
}
