//! A model with other probabilities of its discrete roots.

use serde_json::Value;

use crate::cpd::Cpd;
use crate::error::ModelError;
use crate::extra::parse;
use crate::model::Model;

impl Model {
    /// The same model with another distribution of a discrete root.
    ///
    /// # Errors
    ///
    /// The node is unknown, continuous, or has parents; the numbers are no distribution over its states.
    pub fn with_prior(&self, name: &str, prior: &[f64]) -> Result<Self, ModelError> {
        let idx = self.index(name)?;
        let mut nodes = self.nodes.clone();
        match &mut nodes[idx.0].cpd {
            Cpd::Discrete(cpd) if cpd.parents.is_empty() => cpd.table = vec![prior.to_vec()],
            _ => {
                return Err(ModelError::BadValue {
                    node: name.into(),
                    found: "a prior for a node that is continuous or has parents".into(),
                    expected: "a discrete node without parents".into(),
                });
            }
        }
        Self::new(nodes, self.extra().clone())
    }

    /// The same model with a uniform distribution in every discrete root.
    #[must_use]
    pub fn with_uniform_priors(&self) -> Self {
        let mut model = self.clone();
        for node in &mut model.nodes {
            if let Cpd::Discrete(cpd) = &mut node.cpd
                && cpd.parents.is_empty()
            {
                cpd.table = vec![vec![1.0 / cpd.states.len() as f64; cpd.states.len()]];
            }
        }
        model
    }

    /// The same model with other priors, as JSON: `{"task": {"pouring": 0.5, …}}`; states left out get 0, and the numbers
    /// are divided by their sum.
    ///
    /// # Errors
    ///
    /// The text is nothing like it, or names unknown nodes or states.
    pub fn with_priors_json(&self, json: &str) -> Result<Self, ModelError> {
        let value = parse("prior", json)?;
        let bad = || ModelError::BadValue {
            node: "prior".into(),
            found: value.to_string(),
            expected: "{NODE: {STATE: probability}} with a positive sum".into(),
        };
        match &value {
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
