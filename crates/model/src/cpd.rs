//! Distributions of one node given its parents: a table, or a mixture of linear regressions per configuration.

use nalgebra::{DMatrix, DVector};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use crate::gaussian::{cholesky, log_normal_in_place, log_sum_exp, semidefinite_root};
use crate::von_mises_fisher::VonMisesFisherCpd;

/// Weights that the configurations share agree within this: rounding of a sum of responsibilities.
const WEIGHT_TOLERANCE: f64 = 1e-9;

/// Position of a node in its model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct NodeIdx(pub usize);

/// Distribution of one node given its parents.
#[derive(Debug, Clone, PartialEq)]
pub enum Cpd {
    /// A node with states.
    Discrete(DiscreteCpd),
    /// A vector of real numbers.
    Mixture(MixtureCpd),
    /// A unit vector.
    VonMisesFisher(VonMisesFisherCpd),
}

/// A table of probabilities.
#[derive(Debug, Clone, PartialEq)]
pub struct DiscreteCpd {
    /// Names of the states.
    pub states: Vec<String>,
    /// Discrete parents; their configurations number the rows of `table`, the last parent varying fastest.
    pub parents: Vec<NodeIdx>,
    /// One row per configuration, one probability per state; rows sum to 1.
    pub table: Vec<Vec<f64>>,
}

impl DiscreteCpd {
    /// log P(state | configuration), −∞ where the probability is 0.
    pub fn log_density(&self, configuration: usize, state: usize) -> f64 {
        self.table[configuration][state].ln()
    }

    /// A state drawn from one row.
    pub fn sample(&self, configuration: usize, rng: &mut impl Rng) -> usize {
        draw(self.table[configuration].iter().copied(), rng)
    }

    /// Free parameters: states − 1 for each configuration.
    pub fn n_parameters(&self) -> usize {
        self.table.len() * self.states.len().saturating_sub(1)
    }
}

/// Whether q and −q are the same value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sign {
    /// They are two values.
    #[default]
    Fixed,
    /// They are the same value, as for unit quaternions: the density is ½ N(q) + ½ N(−q) in each component.
    Latent,
}

/// Where the latent component variable of a continuous node hangs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Weights {
    /// Each configuration of the discrete parents has its own weights and components.
    #[default]
    PerConfiguration,
    /// The component depends on the discrete parents, the components are the same for all.
    Shared,
    /// The component is independent of the discrete parents, each configuration has its own Gaussians.
    Root,
}

/// Location and spread of a node's training data, by which it was standardised.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Scaling {
    /// Mean of each column.
    pub mean: Vec<f64>,
    /// Standard deviation of each column, positive.
    pub standard_deviation: Vec<f64>,
}

/// A mixture of Gaussian linear regressions for each configuration of the discrete parents.
#[derive(Debug, Clone, PartialEq)]
pub struct MixtureCpd {
    /// Column of each dimension.
    pub columns: Vec<String>,
    /// Discrete parents; their configurations number the rows of `components`, the last parent varying fastest.
    pub discrete_parents: Vec<NodeIdx>,
    /// Continuous parents; p joins their values in this order.
    pub continuous_parents: Vec<NodeIdx>,
    /// One row per configuration; the weights of a row sum to 1.
    pub components: Vec<Vec<Component>>,
    /// What the configurations share: under `Shared` their Gaussians are equal, under `Root` their weights. Answers do
    /// not depend on it; the number of parameters does.
    pub weights: Weights,
    /// Whether q and −q are the same value.
    pub sign: Sign,
    /// Whether the values are unit vectors, so that answers also carry the density on the sphere.
    pub sphere: bool,
    /// Units of the training data, where known.
    pub scaling: Option<Scaling>,
}

/// One Gaussian regression: x | p ~ N(mean + coefficients · p, covariance).
#[derive(Debug, Clone, PartialEq)]
pub struct Component {
    /// Probability of the component, 0 allowed.
    pub weight: f64,
    /// Mean at p = 0, length d.
    pub mean: DVector<f64>,
    /// d × length of p.
    pub coefficients: DMatrix<f64>,
    /// d × d, symmetric, positive semidefinite.
    pub covariance: DMatrix<f64>,
}

impl MixtureCpd {
    /// Dimension of the node.
    pub fn dim(&self) -> usize {
        self.columns.len()
    }

    /// log p(x | configuration, p), the components summed; `None` where a component with positive weight is singular.
    pub fn log_density(&self, configuration: usize, x: &[f64], parents: &[f64]) -> Option<f64> {
        let mut terms = Vec::new();
        for component in self.components[configuration].iter().filter(|c| c.weight > 0.0) {
            let lower = cholesky(&component.covariance)?;
            let mean = component.mean_at(parents);
            let log_weight = component.weight.ln();
            let mut term = |sign: f64, share: f64| {
                let mut residual: Vec<f64> = x.iter().zip(&mean).map(|(x, mean)| sign * x - mean).collect();
                terms.push(log_weight + share + log_normal_in_place(&mut residual, &lower));
            };
            match self.sign {
                Sign::Fixed => term(1.0, 0.0),
                Sign::Latent => {
                    term(1.0, -std::f64::consts::LN_2);
                    term(-1.0, -std::f64::consts::LN_2);
                }
            }
        }
        Some(log_sum_exp(&terms))
    }

    /// A value drawn given configuration and p.
    pub fn sample(&self, configuration: usize, parents: &[f64], rng: &mut impl Rng) -> Vec<f64> {
        let row = &self.components[configuration];
        let component = &row[draw(row.iter().map(|c| c.weight), rng)];
        let noise = DVector::from_fn(self.dim(), |_, _| StandardNormal.sample(rng));
        let step = semidefinite_root(&component.covariance) * noise;
        let sign = if self.sign == Sign::Latent && rng.random::<bool>() {
            -1.0
        } else {
            1.0
        };
        component
            .mean_at(parents)
            .iter()
            .zip(&step)
            .map(|(mean, step)| sign * (mean + step))
            .collect()
    }

    /// Free parameters: K [d (q + 1) + d (d + 1) / 2] for the Gaussians and K − 1 for the weights of each configuration;
    /// what the configurations share is counted once, and so is a covariance that all components have in common.
    pub fn n_parameters(&self) -> usize {
        let gaussians = |row: &Vec<Component>| {
            let q = row.first().map_or(0, |c| c.coefficients.ncols());
            n_mixture_parameters(row.len(), self.dim(), q) - row.len().saturating_sub(1)
        };
        let free = |row: &Vec<Component>| row.len().saturating_sub(1);
        let (all, first) = (
            &self.components[..],
            &self.components[..self.components.len().min(1)],
        );
        let (own_gaussians, own_weights) = match self.weights {
            Weights::PerConfiguration => (all, all),
            Weights::Shared => (first, all),
            Weights::Root => (all, first),
        };
        let d = self.dim();
        let covariance = d * (d + 1) / 2;
        let n_gaussians: usize = own_gaussians.iter().map(Vec::len).sum();
        let counted_again = if self.has_one_covariance() {
            n_gaussians.saturating_sub(1) * covariance
        } else {
            0
        };
        own_gaussians.iter().map(gaussians).sum::<usize>() + own_weights.iter().map(free).sum::<usize>()
            - counted_again
    }

    /// Whether all components of all configurations have the same covariance, to the bit, as training with
    /// `covariance = "shared"` leaves them.
    fn has_one_covariance(&self) -> bool {
        let mut all = self.components.iter().flatten().map(|c| &c.covariance);
        all.next().is_some_and(|first| all.all(|other| other == first))
    }

    /// The first place where the configurations do not share what `weights` says: configuration, component, problem.
    pub(crate) fn unshared(&self) -> Option<(usize, usize, String)> {
        let (first, others) = self.components.split_first()?;
        let differs = |a: &Component, b: &Component| match self.weights {
            Weights::PerConfiguration => None,
            Weights::Shared => ((&a.mean, &a.coefficients, &a.covariance)
                != (&b.mean, &b.coefficients, &b.covariance))
                .then(|| "differs from configuration 0, though `weights` is \"shared\"".into()),
            Weights::Root => ((a.weight - b.weight).abs() > WEIGHT_TOLERANCE).then(|| {
                format!(
                    "has the weight {}, in configuration 0 it is {}, though `weights` is \"root\"",
                    b.weight, a.weight
                )
            }),
        };
        for (i, row) in others.iter().enumerate() {
            if self.weights != Weights::PerConfiguration && row.len() != first.len() {
                let problem = format!(
                    "the row has {} components, row 0 has {}; `weights` asks for as many",
                    row.len(),
                    first.len()
                );
                return Some((i + 1, 0, problem));
            }
            let mut pairs = first.iter().zip(row).enumerate();
            if let Some((k, problem)) = pairs.find_map(|(k, (a, b))| Some((k, differs(a, b)?))) {
                return Some((i + 1, k, problem));
            }
        }
        None
    }
}

/// K [d (q + 1) + d (d + 1) / 2] + K − 1.
pub(crate) fn n_mixture_parameters(k: usize, d: usize, q: usize) -> usize {
    k * (d * (q + 1) + d * (d + 1) / 2) + k.saturating_sub(1)
}

impl Component {
    /// mean + coefficients · p.
    pub fn mean_at(&self, parents: &[f64]) -> Vec<f64> {
        (0..self.mean.len())
            .map(|i| {
                let shift: f64 = parents
                    .iter()
                    .enumerate()
                    .map(|(j, value)| self.coefficients[(i, j)] * value)
                    .sum();
                self.mean[i] + shift
            })
            .collect()
    }
}

/// An index drawn by weights that sum to about 1.
pub(crate) fn draw(weights: impl Iterator<Item = f64> + Clone, rng: &mut impl Rng) -> usize {
    let total: f64 = weights.clone().sum();
    let mut left = rng.random::<f64>() * total;
    let mut last = 0;
    for (i, weight) in weights.enumerate().filter(|(_, weight)| *weight > 0.0) {
        last = i;
        left -= weight;
        if left <= 0.0 {
            break;
        }
    }
    last
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_shared_counts_once() {
        let component = |weight: f64, variance: f64| Component {
            weight,
            mean: DVector::from_vec(vec![weight, 0.8]),
            coefficients: DMatrix::zeros(2, 1),
            covariance: DMatrix::identity(2, 2) * variance,
        };
        let mut cpd = MixtureCpd {
            columns: vec!["a".into(), "b".into()],
            discrete_parents: vec![NodeIdx(0)],
            continuous_parents: vec![NodeIdx(1)],
            components: vec![vec![component(0.4, 1.0), component(0.6, 2.0)]; 3],
            weights: Weights::PerConfiguration,
            sign: Sign::Fixed,
            sphere: false,
            scaling: None,
        };
        // Each of six Gaussians has 2 means, 2 slopes and 3 entries of the covariance; each of three rows one weight.
        assert_eq!(cpd.n_parameters(), 6 * 7 + 3);
        cpd.weights = Weights::Shared;
        assert_eq!(cpd.n_parameters(), 2 * 7 + 3);
        cpd.weights = Weights::Root;
        assert_eq!(cpd.n_parameters(), 6 * 7 + 1);
        for row in &mut cpd.components {
            row[1] = component(0.6, 1.0);
        }
        assert_eq!(cpd.n_parameters(), 6 * 4 + 3 + 1);
    }

    #[test]
    fn a_latent_sign_makes_the_density_even() {
        let cpd = MixtureCpd {
            columns: vec!["a".into(), "b".into()],
            discrete_parents: vec![],
            continuous_parents: vec![],
            components: vec![vec![Component {
                weight: 1.0,
                mean: DVector::from_vec(vec![0.6, 0.8]),
                coefficients: DMatrix::zeros(2, 0),
                covariance: DMatrix::identity(2, 2) * 0.01,
            }]],
            weights: Weights::PerConfiguration,
            sign: Sign::Latent,
            sphere: true,
            scaling: None,
        };
        let here = cpd.log_density(0, &[0.5, 0.8], &[]).unwrap();
        let there = cpd.log_density(0, &[-0.5, -0.8], &[]).unwrap();
        assert!((here - there).abs() < 1e-12);
        assert_eq!(cpd.n_parameters(), 5);
    }
}
