//! What is known: values of nodes, exact, partial, uncertain or soft.

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use serde_json::Value;

use crate::cpd::{Cpd, NodeIdx};
use crate::error::{ModelError, list};
use crate::extra::parse;
use crate::gaussian::cholesky;
use crate::model::Model;
use crate::table::{Table, state_at};

/// How far from 1 the length of a direction may be: what three printed digits of each coordinate allow.
const UNIT_TOLERANCE: f64 = 2e-3;

/// What is known of one node.
#[derive(Debug, Clone, PartialEq)]
pub enum Observation {
    /// A discrete node's state.
    State(usize),
    /// A likelihood for each state of a discrete node (soft evidence), each at least 0, not all 0.
    Likelihood(Vec<f64>),
    /// A continuous node's value; NaN is a dimension that was not observed.
    Value(Vec<f64>),
    /// A continuous node's value up to Gaussian noise: the likelihood of x is N(mean; x, covariance).
    Uncertain {
        /// What was measured.
        mean: Vec<f64>,
        /// Covariance of the measurement's error.
        covariance: DMatrix<f64>,
    },
}

impl Observation {
    /// As a person says it: a state's name, a number, an array.
    pub(crate) fn in_words(&self, states: &[String]) -> String {
        let number = |x: &f64| if x.is_nan() { "?".into() } else { x.to_string() };
        let array = |values: &[f64]| match values {
            [one] => number(one),
            many => format!("[{}]", many.iter().map(number).collect::<Vec<_>>().join(", ")),
        };
        match self {
            Self::State(state) => states.get(*state).cloned().unwrap_or_default(),
            Self::Likelihood(likelihood) => format!("as likely as {}", array(likelihood)),
            Self::Value(value) => array(value),
            Self::Uncertain { mean, .. } => format!("about {}", array(mean)),
        }
    }
}

/// Observed nodes. The order in which they were entered does not matter.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Evidence {
    entries: BTreeMap<NodeIdx, Observation>,
}

impl Evidence {
    /// Nothing observed.
    pub fn new() -> Self {
        Self::default()
    }

    /// The same evidence with one more node; an earlier observation of it is replaced.
    ///
    /// # Errors
    ///
    /// The node is unknown, or the observation does not fit it.
    pub fn with(mut self, model: &Model, node: &str, observation: Observation) -> Result<Self, ModelError> {
        let idx = model.index(node)?;
        check(model, idx, &observation)?;
        let observation = match (&model.node(idx).cpd, observation) {
            (Cpd::VonMisesFisher(_), Observation::Value(value)) => {
                Observation::Value(unit_vector(node, &value)?)
            }
            (_, other) => other,
        };
        self.entries.insert(idx, observation);
        Ok(self)
    }

    /// [`Evidence::with`] for a discrete node's state, by name.
    ///
    /// # Errors
    ///
    /// The node or the state is unknown.
    pub fn with_state(self, model: &Model, node: &str, state: &str) -> Result<Self, ModelError> {
        let idx = model.index(node)?;
        let state = read_state(model, idx, &Value::from(state))?;
        self.with(model, node, Observation::State(state))
    }

    /// [`Evidence::with`] for a continuous node's value; NaN is a dimension that was not observed.
    ///
    /// # Errors
    ///
    /// The node is unknown, discrete, or of another dimension.
    pub fn with_value(self, model: &Model, node: &str, value: &[f64]) -> Result<Self, ModelError> {
        self.with(model, node, Observation::Value(value.to_vec()))
    }

    /// Reads `{"task": "pouring", "size": [0.1, null, 0.2], "qeps": 0.1, "fvol": {"mean": …, "covariance": …}}`.
    ///
    /// # Errors
    ///
    /// Text that is no JSON; unknown nodes and states, wrong lengths, and what is no observation, each with the node's name.
    pub fn from_json(model: &Model, json: &str) -> Result<Self, ModelError> {
        let json = parse("evidence", json)?;
        let Value::Object(entries) = &json else {
            return Err(ModelError::BadValue {
                node: "evidence".into(),
                found: json.to_string(),
                expected: "an object from node to value, like {\"task\": \"pouring\"}".into(),
            });
        };
        let mut evidence = Self::new();
        for (name, value) in entries {
            let idx = model.index(name)?;
            if value.is_null() {
                continue;
            }
            evidence = evidence.with(model, name, read_observation(model, idx, value)?)?;
        }
        Ok(evidence)
    }

    /// One evidence per row of a table, from the columns that belong to nodes; other columns are left alone, empty
    /// cells are not observed.
    ///
    /// # Errors
    ///
    /// [`ModelError::Cell`] where a cell is no value of its node.
    pub fn from_table(model: &Model, table: &Table) -> Result<Vec<Self>, ModelError> {
        let mut rows = vec![Self::new(); table.n_rows()];
        for (i, node) in model.nodes().iter().enumerate() {
            let columns = node.columns();
            match &node.cpd {
                Cpd::Discrete(cpd) => {
                    if table.column(&columns[0]).is_none() {
                        continue;
                    }
                    let states = table.states(&columns[0], &node.name, &cpd.states)?;
                    for (row, state) in rows.iter_mut().zip(states) {
                        if let Some(state) = state {
                            row.entries.insert(NodeIdx(i), Observation::State(state));
                        }
                    }
                }
                Cpd::Mixture(_) | Cpd::VonMisesFisher(_) => {
                    let mut values = vec![vec![f64::NAN; columns.len()]; table.n_rows()];
                    for (d, column) in columns.iter().enumerate() {
                        if table.column(column).is_some() {
                            for (value, cell) in values.iter_mut().zip(table.numbers(column, &node.name)?) {
                                value[d] = cell;
                            }
                        }
                    }
                    for (row, value) in rows.iter_mut().zip(values) {
                        if value.iter().any(|v| !v.is_nan()) {
                            let value = match &node.cpd {
                                Cpd::VonMisesFisher(_) => unit_vector(&node.name, &value)?,
                                _ => value,
                            };
                            row.entries.insert(NodeIdx(i), Observation::Value(value));
                        }
                    }
                }
            }
        }
        Ok(rows)
    }

    /// The observations, in the model's order.
    pub fn iter(&self) -> impl Iterator<Item = (NodeIdx, &Observation)> {
        self.entries.iter().map(|(idx, observation)| (*idx, observation))
    }

    /// What is known of a node.
    pub fn get(&self, idx: NodeIdx) -> Option<&Observation> {
        self.entries.get(&idx)
    }

    /// The same evidence without one node.
    #[must_use]
    pub fn without(mut self, idx: NodeIdx) -> Self {
        self.entries.remove(&idx);
        self
    }
}

/// Reads one observation of one node from JSON.
fn read_observation(model: &Model, idx: NodeIdx, value: &Value) -> Result<Observation, ModelError> {
    let node = model.node(idx);
    let bad = |expected: String| ModelError::BadValue {
        node: node.name.clone(),
        found: value.to_string(),
        expected,
    };
    match &node.cpd {
        Cpd::Discrete(cpd) => {
            let Value::Object(soft) = value else {
                return Ok(Observation::State(read_state(model, idx, value)?));
            };
            let expected = || bad("a state, an index, or {\"likelihood\": {STATE: number}}".into());
            let Some(Value::Object(given)) = soft.get("likelihood") else {
                return Err(expected());
            };
            let mut likelihood = vec![0.0; cpd.states.len()];
            for (state, number) in given {
                let state = read_state(model, idx, &Value::from(state.as_str()))?;
                likelihood[state] = number.as_f64().ok_or_else(expected)?;
            }
            Ok(Observation::Likelihood(likelihood))
        }
        Cpd::VonMisesFisher(_) => {
            let expected = || bad("an array with the numbers of a unit vector".into());
            Ok(Observation::Value(numbers(value, false).ok_or_else(expected)?))
        }
        Cpd::Mixture(cpd) => {
            let d = cpd.dim();
            let expected = || {
                let shape = if d == 1 {
                    "a number".into()
                } else {
                    format!("an array of {d} numbers or nulls")
                };
                bad(format!("{shape}, or {{\"mean\": …, \"covariance\": …}}"))
            };
            if let Value::Object(uncertain) = value {
                let mean = uncertain
                    .get("mean")
                    .and_then(|v| numbers(v, false))
                    .ok_or_else(expected)?;
                let covariance = match uncertain.get("covariance").ok_or_else(expected)? {
                    Value::Number(variance) if d == 1 => {
                        DMatrix::from_element(1, 1, variance.as_f64().ok_or_else(expected)?)
                    }
                    Value::Array(rows) => {
                        let rows: Option<Vec<Vec<f64>>> =
                            rows.iter().map(|row| numbers(row, false)).collect();
                        let rows = rows.ok_or_else(expected)?;
                        if rows.len() != d || rows.iter().any(|row| row.len() != d) {
                            return Err(bad(format!("a covariance of {d} rows of {d} numbers")));
                        }
                        DMatrix::from_fn(d, d, |i, j| rows[i][j])
                    }
                    _ => return Err(expected()),
                };
                return Ok(Observation::Uncertain { mean, covariance });
            }
            Ok(Observation::Value(numbers(value, true).ok_or_else(expected)?))
        }
    }
}

/// A number, or an array of numbers; nulls become NaN where allowed.
pub(crate) fn numbers(value: &Value, nulls: bool) -> Option<Vec<f64>> {
    match value {
        Value::Number(number) => Some(vec![number.as_f64()?]),
        Value::Array(entries) => entries
            .iter()
            .map(|entry| match entry {
                Value::Null if nulls => Some(f64::NAN),
                Value::Number(number) => number.as_f64(),
                _ => None,
            })
            .collect(),
        _ => None,
    }
}

/// A state by name or index.
pub(crate) fn read_state(model: &Model, idx: NodeIdx, value: &Value) -> Result<usize, ModelError> {
    let node = model.node(idx);
    let states = node.states();
    let state = match value {
        Value::String(name) => states.iter().position(|state| state == name),
        Value::Number(index) => index.as_f64().and_then(|index| state_at(index, states.len())),
        _ => None,
    };
    state.ok_or_else(|| ModelError::BadValue {
        node: node.name.clone(),
        found: value.to_string(),
        expected: if states.is_empty() {
            "a number or an array, as the node is continuous".into()
        } else {
            format!(
                "one of {}, or an index from 0 to {}",
                list(states.iter().map(String::as_str)),
                states.len() - 1
            )
        },
    })
}

/// The vector with length 1 to the last digit; what is farther off than text files round is no direction.
pub(crate) fn unit_vector(node: &str, value: &[f64]) -> Result<Vec<f64>, ModelError> {
    let length = value.iter().map(|v| v * v).sum::<f64>().sqrt();
    if !length.is_finite() || (length - 1.0).abs() > UNIT_TOLERANCE {
        return Err(ModelError::BadValue {
            node: node.into(),
            found: format!("{value:?} of length {length}"),
            expected: "a whole unit vector; divide it by its length".into(),
        });
    }
    Ok(value.iter().map(|v| v / length).collect())
}

/// Whether an observation fits its node.
fn check(model: &Model, idx: NodeIdx, observation: &Observation) -> Result<(), ModelError> {
    let node = model.node(idx);
    let bad = |found: String, expected: String| {
        Err(ModelError::BadValue {
            node: node.name.clone(),
            found,
            expected,
        })
    };
    match (&node.cpd, observation) {
        (Cpd::Discrete(cpd), Observation::State(state)) if *state >= cpd.states.len() => bad(
            format!("state {state}"),
            format!("an index below {}", cpd.states.len()),
        ),
        (Cpd::Discrete(_), Observation::State(_)) => Ok(()),
        (Cpd::Discrete(cpd), Observation::Likelihood(likelihood)) => {
            let legal = likelihood.len() == cpd.states.len()
                && likelihood.iter().all(|l| *l >= 0.0 && l.is_finite())
                && likelihood.iter().any(|l| *l > 0.0);
            if legal {
                Ok(())
            } else {
                let expected = format!("{} likelihoods of at least 0, not all 0", cpd.states.len());
                bad(format!("{likelihood:?}"), expected)
            }
        }
        (Cpd::Discrete(_), _) => bad("numbers".into(), "a state, as the node is discrete".into()),
        (Cpd::VonMisesFisher(cpd), Observation::Value(value)) if value.len() == cpd.dim() => Ok(()),
        (Cpd::VonMisesFisher(cpd), _) => bad(
            "no exact direction".into(),
            format!(
                "a unit vector of {} numbers; a node of this kind is observed whole or not at all",
                cpd.dim()
            ),
        ),
        (Cpd::Mixture(cpd), Observation::Value(value)) => {
            if value.len() == cpd.dim() && !value.iter().any(|v| v.is_infinite()) {
                Ok(())
            } else {
                bad(
                    format!("{value:?}"),
                    format!("{} finite numbers or nulls", cpd.dim()),
                )
            }
        }
        (Cpd::Mixture(cpd), Observation::Uncertain { mean, covariance }) => {
            let d = cpd.dim();
            let legal = mean.len() == d
                && covariance.shape() == (d, d)
                && mean.iter().chain(covariance.iter()).all(|v| v.is_finite());
            if !legal {
                return bad(
                    format!("{mean:?} ± {covariance:?}"),
                    format!("{d} numbers and a {d} × {d} covariance"),
                );
            }
            let symmetric = (covariance - covariance.transpose()).amax() <= 1e-9 * covariance.amax();
            let positive = cholesky(covariance).is_some()
                || covariance.clone().symmetric_eigenvalues().min() >= -1e-9 * covariance.amax();
            if symmetric && positive {
                Ok(())
            } else {
                bad(
                    format!("{covariance:?}"),
                    "a symmetric covariance without negative eigenvalues".into(),
                )
            }
        }
        (Cpd::Mixture(_), _) => bad(
            "a state".into(),
            "a number or an array, as the node is continuous".into(),
        ),
    }
}
