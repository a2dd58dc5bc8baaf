//! Small random mixed networks with random evidence, the same for the same seed.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A node with its distribution; parents are positions in the list of nodes and stand before it.
#[derive(Debug, Clone)]
pub enum RandomNode {
    /// A table: one row per configuration of the parents, the last one varying fastest.
    Discrete {
        /// Positions of the parents, all discrete.
        parents: Vec<usize>,
        /// One row per configuration, rows sum to 1.
        table: Vec<Vec<f64>>,
    },
    /// A mixture of regressions.
    Continuous {
        /// Positions of the discrete parents.
        discrete: Vec<usize>,
        /// Positions of the continuous parents.
        continuous: Vec<usize>,
        /// One row per configuration.
        components: Vec<Vec<RandomComponent>>,
        /// What the rows share.
        reading: Reading,
        /// Whether the value is the component's or its negative, with equal probability.
        latent_sign: bool,
    },
}

/// The three readings of "a mixture with a discrete parent".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reading {
    /// Own weights and components per configuration.
    Own,
    /// The same components, own weights.
    SharedComponents,
    /// The same weights, own components.
    RootWeights,
}

/// y ~ N(mean + coefficients · parents, covariance).
#[derive(Debug, Clone)]
pub struct RandomComponent {
    /// Probability, zero for some.
    pub weight: f64,
    /// Mean where the parents are zero.
    pub mean: DVector<f64>,
    /// One column per value of the continuous parents.
    pub coefficients: DMatrix<f64>,
    /// Positive definite.
    pub covariance: DMatrix<f64>,
}

/// What is known of a node.
#[derive(Debug, Clone)]
pub enum RandomObservation {
    /// Nothing.
    Hidden,
    /// A state.
    State(usize),
    /// A likelihood for each state, one of them positive.
    Likelihood(Vec<f64>),
    /// A value; NaN for dimensions that are missing.
    Value(Vec<f64>),
    /// A value with a Gaussian error.
    Uncertain(DVector<f64>, DMatrix<f64>),
}

/// A network and what is known of its nodes.
#[derive(Debug, Clone)]
pub struct RandomQuery {
    /// Parents first.
    pub nodes: Vec<RandomNode>,
    /// One entry a node.
    pub evidence: Vec<RandomObservation>,
}

impl RandomNode {
    /// Number of states, 0 for a continuous node.
    pub fn n_states(&self) -> usize {
        match self {
            Self::Discrete { table, .. } => table[0].len(),
            Self::Continuous { .. } => 0,
        }
    }

    /// Dimension of a continuous node, 0 for a discrete one.
    pub fn dim(&self) -> usize {
        match self {
            Self::Discrete { .. } => 0,
            Self::Continuous { components, .. } => components[0][0].mean.len(),
        }
    }
}

/// A network of `n_discrete` + `n_continuous` nodes with at most three states, dimensions and components, and evidence of
/// every kind. About one table entry and one weight in eight is zero; evidence has a positive density.
pub fn random_query(seed: u64, n_discrete: usize, n_continuous: usize) -> RandomQuery {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut nodes: Vec<RandomNode> = Vec::new();
    for _ in 0..n_discrete {
        let parents = some_of(0..nodes.len(), 2, &mut rng);
        let n_states = rng.random_range(1..=3);
        let rows = n_rows(&nodes, &parents);
        let table = (0..rows).map(|_| weights(n_states, &mut rng)).collect();
        nodes.push(RandomNode::Discrete { parents, table });
    }
    for _ in 0..n_continuous {
        let node = continuous(&nodes, n_discrete, &mut rng);
        nodes.push(node);
    }
    let evidence = nodes.iter().map(|node| observation(node, &mut rng)).collect();
    RandomQuery { nodes, evidence }
}

fn continuous(nodes: &[RandomNode], n_discrete: usize, rng: &mut ChaCha8Rng) -> RandomNode {
    let discrete = some_of(0..n_discrete, 2, rng);
    let continuous = some_of(n_discrete..nodes.len(), 2, rng);
    let q: usize = continuous.iter().map(|&parent| nodes[parent].dim()).sum();
    let d = rng.random_range(1..=3);
    let k = rng.random_range(1..=3);
    let reading = [Reading::Own, Reading::SharedComponents, Reading::RootWeights][rng.random_range(0..3)];
    let mut components: Vec<Vec<RandomComponent>> = Vec::new();
    for row in 0..n_rows(nodes, &discrete) {
        let own_k = if reading == Reading::Own {
            rng.random_range(1..=3)
        } else {
            k
        };
        let shares = match components.first() {
            Some(first) if reading == Reading::RootWeights => first.iter().map(|c| c.weight).collect(),
            _ => weights(own_k, rng),
        };
        let of = |i: usize, weight: f64, rng: &mut ChaCha8Rng| match components.first() {
            Some(first) if reading == Reading::SharedComponents && row > 0 => RandomComponent {
                weight,
                ..first[i].clone()
            },
            _ => component(weight, d, q, rng),
        };
        let row = shares
            .into_iter()
            .enumerate()
            .map(|(i, weight)| of(i, weight, rng))
            .collect();
        components.push(row);
    }
    RandomNode::Continuous {
        discrete,
        continuous,
        components,
        reading,
        latent_sign: rng.random::<f64>() < 0.2,
    }
}

fn component(weight: f64, d: usize, q: usize, rng: &mut ChaCha8Rng) -> RandomComponent {
    let mut normal = |scale: f64| -> f64 {
        let z: f64 = StandardNormal.sample(rng);
        scale * z
    };
    let root = DMatrix::from_fn(d, d, |_, _| normal(0.7));
    RandomComponent {
        weight,
        mean: DVector::from_fn(d, |_, _| normal(1.5)),
        coefficients: DMatrix::from_fn(d, q, |_, _| normal(0.6)),
        covariance: &root * root.transpose() + DMatrix::identity(d, d) * 0.05,
    }
}

fn observation(node: &RandomNode, rng: &mut ChaCha8Rng) -> RandomObservation {
    let n = node.n_states();
    if n > 0 {
        return match rng.random_range(0..4) {
            0 => RandomObservation::State(rng.random_range(0..n)),
            1 => {
                let mut likelihood: Vec<f64> = (0..n).map(|_| 3.0 * rng.random::<f64>()).collect();
                if rng.random::<bool>() && n > 1 {
                    likelihood[0] = 0.0;
                }
                RandomObservation::Likelihood(likelihood)
            }
            _ => RandomObservation::Hidden,
        };
    }
    let d = node.dim();
    let value: Vec<f64> = (0..d)
        .map(|_| {
            let z: f64 = StandardNormal.sample(rng);
            2.0 * z
        })
        .collect();
    match rng.random_range(0..5) {
        0 | 1 => RandomObservation::Value(value),
        2 => {
            let gaps = value
                .iter()
                .map(|v| if rng.random::<bool>() { f64::NAN } else { *v });
            RandomObservation::Value(gaps.collect())
        }
        3 => {
            let error = component(1.0, d, 0, rng).covariance;
            RandomObservation::Uncertain(DVector::from_vec(value), error)
        }
        _ => RandomObservation::Hidden,
    }
}

/// Up to `most` of the range, in order.
fn some_of(range: std::ops::Range<usize>, most: usize, rng: &mut ChaCha8Rng) -> Vec<usize> {
    let mut out: Vec<usize> = range.filter(|_| rng.random::<f64>() < 0.6).collect();
    while out.len() > most {
        out.remove(rng.random_range(0..out.len()));
    }
    out
}

fn n_rows(nodes: &[RandomNode], parents: &[usize]) -> usize {
    parents.iter().map(|&parent| nodes[parent].n_states()).product()
}

/// Probabilities, one in eight of them zero.
fn weights(n: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let mut out: Vec<f64> = (0..n)
        .map(|_| {
            if rng.random::<f64>() < 0.125 {
                0.0
            } else {
                0.1 + rng.random::<f64>()
            }
        })
        .collect();
    let sum: f64 = out.iter().sum();
    if sum == 0.0 {
        out[0] = 1.0;
        return out;
    }
    out.into_iter().map(|w| w / sum).collect()
}
