//! Answers: a distribution over states, a mixture of Gaussians, or both together.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::{Map, Value, json};

use crate::error::ModelError;
use crate::gaussian::log_sum_exp;
use crate::json::rows;
use crate::mixture::{Mixture, Term, draw};

/// What was asked about.
#[derive(Debug, Clone, PartialEq)]
pub enum Target {
    /// A discrete node.
    Discrete {
        /// Its name.
        name: String,
        /// Its states.
        states: Vec<String>,
    },
    /// A continuous node.
    Continuous {
        /// Its name.
        name: String,
        /// Its columns.
        columns: Vec<String>,
        /// Whether its values are unit vectors.
        sphere: bool,
    },
}

/// The posterior of the targets, jointly and exactly.
#[derive(Debug, Clone, PartialEq)]
pub struct Posterior {
    /// Natural logarithm of the density of the evidence.
    pub log_evidence: f64,
    /// What was asked about.
    pub targets: Vec<Target>,
    /// The joint distribution: with only discrete targets one term for each joint state that is possible.
    pub terms: Vec<Term>,
    /// Most that any probability of this answer can be off, because combinations of components were too many to be
    /// summed; 0 where the answer is exact. The density of the evidence is at most 1 / (1 − bound) times what
    /// `log_evidence` says.
    pub error_bound: f64,
}

impl Posterior {
    pub(crate) fn new(log_evidence: f64, targets: Vec<Target>, terms: Vec<Term>, error_bound: f64) -> Self {
        let continuous = targets
            .iter()
            .any(|target| matches!(target, Target::Continuous { .. }));
        let terms = if continuous { terms } else { merge(terms) };
        Self {
            log_evidence,
            targets,
            terms,
            error_bound,
        }
    }

    /// Probability of each state of a discrete target; `None` if it was not asked about, or is continuous.
    pub fn probabilities(&self, name: &str) -> Option<Vec<f64>> {
        let mut position = 0;
        for target in &self.targets {
            if let Target::Discrete { name: other, states } = target {
                if other == name {
                    let mut out = vec![0.0; states.len()];
                    for term in &self.terms {
                        out[term.states[position]] += term.log_weight.exp();
                    }
                    return Some(out);
                }
                position += 1;
            }
        }
        None
    }

    /// The marginal of a continuous target; `None` if it was not asked about, or is discrete.
    pub fn mixture(&self, name: &str) -> Option<Mixture> {
        let mut start = 0;
        for target in &self.targets {
            if let Target::Continuous {
                name: other, columns, ..
            } = target
            {
                if other == name {
                    return Some(self.dimensions(&(start..start + columns.len()).collect::<Vec<_>>()));
                }
                start += columns.len();
            }
        }
        None
    }

    /// The joint marginal of all continuous targets, in the order asked for.
    pub fn joint_mixture(&self) -> Mixture {
        let n = self.terms.first().map_or(0, |term| term.mean.len());
        self.dimensions(&(0..n).collect::<Vec<_>>())
    }

    fn dimensions(&self, dims: &[usize]) -> Mixture {
        Mixture::new(self.terms.iter().map(|term| term.over(dims)).collect())
    }

    /// Joint values of the targets drawn from the answer: states of the discrete ones, numbers of the continuous ones, in
    /// the order asked for. The same seed gives the same values.
    pub fn sample(&self, n: usize, seed: u64) -> Vec<(Vec<usize>, Vec<f64>)> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..n)
            .filter_map(|_| draw(&self.terms, &mut rng).map(|(term, point)| (term.states.clone(), point)))
            .collect()
    }

    /// The answer as the commands print it: `log_evidence`, and for one target `posterior`, or `mean`, `covariance` and
    /// `components`; for several `targets` with each marginal, and `joint`.
    ///
    /// # Errors
    ///
    /// As [`Posterior::to_json_at`], which this is without points.
    pub fn to_json(&self) -> Result<String, ModelError> {
        self.to_json_at(&[])
    }

    /// [`Posterior::to_json`] with `log_density` at each point of the continuous targets' joint space (and
    /// `log_density_sphere` where the only target is a node of unit vectors).
    ///
    /// # Errors
    ///
    /// A point of the wrong length, points without a continuous target, [`ModelError::FlatAnswer`].
    pub fn to_json_at(&self, at: &[Vec<f64>]) -> Result<String, ModelError> {
        let mut out = Map::new();
        out.insert("log_evidence".into(), json!(self.log_evidence));
        if self.error_bound > 0.0 {
            out.insert("error_bound".into(), json!(self.error_bound));
        }
        match self.targets.as_slice() {
            [] => {}
            [only] => self.write_marginal(only, &mut out),
            several => {
                let mut marginals = Map::new();
                for target in several {
                    let mut marginal = Map::new();
                    self.write_marginal(target, &mut marginal);
                    marginals.insert(target.name().into(), Value::Object(marginal));
                }
                out.insert("targets".into(), Value::Object(marginals));
                out.insert("joint".into(), self.joint_json());
            }
        }
        if !at.is_empty() {
            self.write_densities(at, &mut out)?;
        }
        Ok(Value::Object(out).to_string())
    }

    /// [`Posterior::sample`] as JSON: one object a sample, from target to state or array.
    pub fn samples_json(&self, n: usize, seed: u64) -> String {
        let samples = self.sample(n, seed).into_iter().map(|(states, point)| {
            let (mut states, mut left) = (states.into_iter(), &point[..]);
            let pairs = self.targets.iter().map(|target| match target {
                Target::Discrete { name, states: names } => {
                    (name.clone(), json!(states.next().map(|state| &names[state])))
                }
                Target::Continuous { name, columns, .. } => {
                    let (own, rest) = left.split_at(columns.len());
                    left = rest;
                    (name.clone(), json!(own))
                }
            });
            Value::Object(pairs.collect())
        });
        Value::Array(samples.collect()).to_string()
    }

    /// The modes of the continuous targets' joint density as JSON, the highest first: `[{"mode", "log_density"}]`.
    ///
    /// # Errors
    ///
    /// [`ModelError::FlatAnswer`] where there is no density, or no continuous target.
    pub fn modes_json(&self) -> Result<String, ModelError> {
        let mixture = self.joint_mixture();
        let names: Vec<&str> = self.targets.iter().map(Target::name).collect();
        let modes = (mixture.dim() > 0).then(|| mixture.modes()).flatten();
        let modes = modes.ok_or_else(|| ModelError::FlatAnswer {
            node: names.join(","),
        })?;
        let modes = modes
            .iter()
            .map(|(mode, log)| json!({ "mode": mode.as_slice(), "log_density": log }));
        Ok(Value::Array(modes.collect()).to_string())
    }

    fn write_marginal(&self, target: &Target, out: &mut Map<String, Value>) {
        match target {
            Target::Discrete { name, states } => {
                let probabilities = self.probabilities(name).unwrap_or_default();
                let pairs = states
                    .iter()
                    .cloned()
                    .zip(probabilities.into_iter().map(Value::from));
                out.insert("posterior".into(), Value::Object(pairs.collect()));
            }
            Target::Continuous { name, .. } => {
                if let Some(mixture) = self.mixture(name) {
                    write_mixture(&mixture, out);
                }
            }
        }
    }

    fn joint_json(&self) -> Value {
        let discrete: Vec<(&str, &[String])> = self
            .targets
            .iter()
            .filter_map(|target| match target {
                Target::Discrete { name, states } => Some((name.as_str(), states.as_slice())),
                Target::Continuous { .. } => None,
            })
            .collect();
        let terms = self.terms.iter().map(|term| {
            let mut out = Map::new();
            out.insert("weight".into(), json!(term.log_weight.exp()));
            if !discrete.is_empty() {
                let pairs = discrete.iter().zip(&term.states);
                let states = pairs.map(|((name, states), &state)| ((*name).into(), json!(states[state])));
                out.insert("states".into(), Value::Object(states.collect()));
            }
            if !term.mean.is_empty() {
                out.insert("mean".into(), json!(term.mean.as_slice()));
                out.insert("covariance".into(), json!(rows(&term.covariance)));
            }
            Value::Object(out)
        });
        Value::Array(terms.collect())
    }

    fn write_densities(&self, at: &[Vec<f64>], out: &mut Map<String, Value>) -> Result<(), ModelError> {
        let mixture = self.joint_mixture();
        let continuous: Vec<&Target> = self
            .targets
            .iter()
            .filter(|target| matches!(target, Target::Continuous { .. }))
            .collect();
        let name = continuous
            .iter()
            .map(|target| target.name())
            .collect::<Vec<_>>()
            .join(",");
        let d = mixture.dim();
        for point in at {
            if point.len() != d || d == 0 || point.iter().any(|v| !v.is_finite()) {
                return Err(ModelError::BadValue {
                    node: if name.is_empty() { "at".into() } else { name },
                    found: format!("the point {point:?}"),
                    expected: if d == 0 {
                        "no points, as no target is continuous".into()
                    } else {
                        format!("{d} finite numbers")
                    },
                });
            }
        }
        let flat = || ModelError::FlatAnswer { node: name.clone() };
        let densities = mixture.log_densities(at).ok_or_else(flat)?;
        if let [Target::Continuous { sphere: true, .. }] = continuous.as_slice() {
            let normalizer = mixture.log_sphere_normalizer().ok_or_else(flat)?;
            let on_sphere: Vec<f64> = densities
                .iter()
                .map(|log_density| log_density - normalizer)
                .collect();
            out.insert("log_density_sphere".into(), json!(on_sphere));
        }
        out.insert("log_density".into(), json!(densities));
        Ok(())
    }
}

impl Target {
    /// Name of the node.
    pub fn name(&self) -> &str {
        match self {
            Self::Discrete { name, .. } | Self::Continuous { name, .. } => name,
        }
    }
}

fn write_mixture(mixture: &Mixture, out: &mut Map<String, Value>) {
    out.insert("mean".into(), json!(mixture.mean().as_slice()));
    out.insert("covariance".into(), json!(rows(&mixture.covariance())));
    let components = mixture.components().iter().map(|term| {
        json!({
            "weight": term.log_weight.exp(),
            "mean": term.mean.as_slice(),
            "covariance": rows(&term.covariance),
        })
    });
    out.insert("components".into(), Value::Array(components.collect()));
}

/// One term for each joint state.
fn merge(terms: Vec<Term>) -> Vec<Term> {
    let mut by_states: std::collections::BTreeMap<Vec<usize>, Vec<f64>> = std::collections::BTreeMap::new();
    for term in terms {
        by_states.entry(term.states).or_default().push(term.log_weight);
    }
    by_states
        .into_iter()
        .map(|(states, logs)| {
            Term::new(
                log_sum_exp(&logs),
                states,
                DVector::zeros(0),
                DMatrix::zeros(0, 0),
            )
        })
        .collect()
}
