//! Answers: a distribution over states, a mixture of Gaussians, or both together.

use nalgebra::{DMatrix, DVector};
use serde_json::{Map, Value, json};

use crate::error::ModelError;
use crate::gaussian::{Gaussian, cholesky, log_normal_in_place, log_sum_exp};
use crate::json::rows;
use crate::sphere::log_sphere_normalizer;

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

/// One weighted piece of an answer: states of the discrete targets, a Gaussian over the continuous ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// Natural logarithm of its share; the shares of an answer sum to 1.
    pub log_weight: f64,
    /// State of each discrete target, in the order asked for.
    pub states: Vec<usize>,
    /// Mean over the continuous targets' dimensions, in the order asked for.
    pub mean: DVector<f64>,
    /// Covariance of the same; zero rows for a target that was observed.
    pub covariance: DMatrix<f64>,
}

impl From<Gaussian> for Term {
    fn from(gaussian: Gaussian) -> Self {
        Self {
            log_weight: 0.0,
            states: Vec::new(),
            mean: gaussian.mean,
            covariance: gaussian.covariance,
        }
    }
}

/// The posterior of the targets, jointly and exactly.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// Natural logarithm of the density of the evidence.
    pub log_evidence: f64,
    /// What was asked about.
    pub targets: Vec<Target>,
    /// The joint distribution: with only discrete targets one term for each joint state that is possible.
    pub terms: Vec<Term>,
}

/// A mixture of Gaussians.
#[derive(Debug, Clone, PartialEq)]
pub struct Mixture {
    components: Vec<Term>,
    factors: Vec<Option<DMatrix<f64>>>,
}

impl Answer {
    pub(crate) fn new(log_evidence: f64, targets: Vec<Target>, terms: Vec<Term>) -> Self {
        let continuous = targets
            .iter()
            .any(|target| matches!(target, Target::Continuous { .. }));
        let terms = if continuous { terms } else { merge(terms) };
        Self {
            log_evidence,
            targets,
            terms,
        }
    }

    /// Probability of each state of a discrete target; `None` if it was not asked about, or is continuous.
    pub fn posterior(&self, name: &str) -> Option<Vec<f64>> {
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
        let terms = self.terms.iter().map(|term| {
            let whole = Gaussian {
                mean: term.mean.clone(),
                covariance: term.covariance.clone(),
            };
            Term {
                log_weight: term.log_weight,
                ..Term::from(whole.marginal(dims))
            }
        });
        Mixture::new(terms.collect())
    }

    /// The answer as the commands print it: `log_evidence`, and for one target `posterior`, or `mean`, `covariance` and
    /// `components`; for several `targets` with each marginal, and `joint`.
    ///
    /// # Errors
    ///
    /// As [`Answer::to_json_at`], which this is without points.
    pub fn to_json(&self) -> Result<Value, ModelError> {
        self.to_json_at(&[])
    }

    /// [`Answer::to_json`] with `log_density` at each point of the continuous targets' joint space (and
    /// `log_density_sphere` where the only target is a node of unit vectors).
    ///
    /// # Errors
    ///
    /// A point of the wrong length, points without a continuous target, [`ModelError::NoDensity`].
    pub fn to_json_at(&self, at: &[Vec<f64>]) -> Result<Value, ModelError> {
        let mut out = Map::new();
        out.insert("log_evidence".into(), json!(self.log_evidence));
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
        Ok(Value::Object(out))
    }

    fn write_marginal(&self, target: &Target, out: &mut Map<String, Value>) {
        match target {
            Target::Discrete { name, states } => {
                let probabilities = self.posterior(name).unwrap_or_default();
                let pairs = states
                    .iter()
                    .cloned()
                    .zip(probabilities.into_iter().map(Value::from));
                out.insert("posterior".into(), Value::Object(pairs.collect()));
            }
            Target::Continuous { name, .. } => {
                if let Some(mixture) = self.mixture(name) {
                    mixture.write(out);
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
        let flat = || ModelError::NoDensity {
            node: name.clone(),
            configuration: 0,
            component: mixture.first_flat(),
        };
        let densities: Option<Vec<f64>> = at.iter().map(|point| mixture.log_density(point)).collect();
        let densities = densities.ok_or_else(flat)?;
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

impl Mixture {
    fn new(components: Vec<Term>) -> Self {
        let factors = components.iter().map(|term| cholesky(&term.covariance)).collect();
        Self { components, factors }
    }

    /// Its components: weights, means and covariances.
    pub fn components(&self) -> &[Term] {
        &self.components
    }

    /// Dimension.
    pub fn dim(&self) -> usize {
        self.components.first().map_or(0, |term| term.mean.len())
    }

    /// Mean of the whole mixture.
    pub fn mean(&self) -> DVector<f64> {
        let mut mean = DVector::zeros(self.dim());
        for term in &self.components {
            mean += term.log_weight.exp() * &term.mean;
        }
        mean
    }

    /// Covariance of the whole mixture: within the components and between them.
    pub fn covariance(&self) -> DMatrix<f64> {
        let mean = self.mean();
        let mut covariance = DMatrix::zeros(self.dim(), self.dim());
        for term in &self.components {
            let away = &term.mean - &mean;
            covariance += term.log_weight.exp() * (&term.covariance + &away * away.transpose());
        }
        covariance
    }

    /// Natural logarithm of the density at a point; `None` where a component is singular.
    pub fn log_density(&self, point: &[f64]) -> Option<f64> {
        let mut terms = Vec::with_capacity(self.components.len());
        for (term, factor) in self.components.iter().zip(&self.factors) {
            let mut residual: Vec<f64> = point.iter().zip(term.mean.iter()).map(|(x, m)| x - m).collect();
            terms.push(term.log_weight + log_normal_in_place(&mut residual, factor.as_ref()?));
        }
        Some(log_sum_exp(&terms))
    }

    /// log ∫ density over the unit sphere; `None` where a component is singular. `log_density` minus this is the
    /// logarithm of the density on the sphere.
    pub fn log_sphere_normalizer(&self) -> Option<f64> {
        let mut terms = Vec::with_capacity(self.components.len());
        for (term, factor) in self.components.iter().zip(&self.factors) {
            factor.as_ref()?;
            terms.push(term.log_weight + log_sphere_normalizer(&term.mean, &term.covariance)?);
        }
        Some(log_sum_exp(&terms))
    }

    /// The component mean with the highest density; `None` where a component is singular.
    pub fn mode(&self) -> Option<DVector<f64>> {
        let mut best: Option<(f64, &DVector<f64>)> = None;
        for term in &self.components {
            let density = self.log_density(term.mean.as_slice())?;
            if best.is_none_or(|(least, _)| density > least) {
                best = Some((density, &term.mean));
            }
        }
        best.map(|(_, mean)| mean.clone())
    }

    fn first_flat(&self) -> usize {
        self.factors.iter().position(Option::is_none).unwrap_or(0)
    }

    fn write(&self, out: &mut Map<String, Value>) {
        out.insert("mean".into(), json!(self.mean().as_slice()));
        out.insert("covariance".into(), json!(rows(&self.covariance())));
        let components = self.components.iter().map(|term| {
            json!({
                "weight": term.log_weight.exp(),
                "mean": term.mean.as_slice(),
                "covariance": rows(&term.covariance),
            })
        });
        out.insert("components".into(), Value::Array(components.collect()));
    }
}

/// One term for each joint state.
fn merge(terms: Vec<Term>) -> Vec<Term> {
    let mut by_states: std::collections::BTreeMap<Vec<usize>, Vec<f64>> = std::collections::BTreeMap::new();
    for term in terms {
        by_states.entry(term.states).or_default().push(term.log_weight);
    }
    by_states
        .into_iter()
        .map(|(states, logs)| Term {
            log_weight: log_sum_exp(&logs),
            states,
            mean: DVector::zeros(0),
            covariance: DMatrix::zeros(0, 0),
        })
        .collect()
}
