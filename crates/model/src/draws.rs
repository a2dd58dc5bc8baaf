//! Parameters that the training rows allow: draws from their posterior, given the components that the rows were given to.
//!
//! ```text
//! table row ~ Dirichlet(counts + prior)      weights ~ Dirichlet(masses + 1/K)
//! Σₖ ~ inverse Wishart(massₖ + ν − q − 1, scatterₖ + ν s² I)      Bₖ | Σₖ ~ N(B̂ₖ, Σₖ ⊗ (X'X + E)⁻¹)
//! ```
//!
//! Averaged over draws, a Gaussian with few rows is a Student t: what few rows leave open stays open. Which component a
//! row belongs to is taken as training left it, and so is the number of components.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{ChiSquared, Distribution, Gamma, StandardNormal};
use rayon::prelude::*;

use crate::assemble::assemble;
use crate::cell::settings;
use crate::cpd::{Cpd, Scaling, Weights};
use crate::error::ModelError;
use crate::extra::Extra;
use crate::gaussian::{semidefinite_root, solve_lower, solve_lower_transpose, symmetrize};
use crate::model::Model;
use crate::moments::{Mixing, Moment, Regression, Settings, clip, pool, regress};
use crate::network::{MixtureSpec, Network, NodeKind};
use crate::statistics::{DirectionSum, EarlierCell, NodeStatistics, Statistics, shares};
use crate::von_mises_fisher::VonMisesFisher;

/// Smallest parameter of a gamma variable: 0 counts have no density.
const LEAST_SHAPE: f64 = 1e-3;

impl Model {
    /// `n` models of the same structure, each with parameters drawn from what the training rows leave open. The same seed
    /// gives the same models. [`crate::Ensemble`] answers with all of them.
    ///
    /// Concentrations of directions stay as they are; their weights and mean directions are drawn.
    ///
    /// # Errors
    ///
    /// The model keeps no statistics of its rows (a person wrote it, or another program).
    pub fn draws(&self, n: usize, seed: u64) -> Result<Vec<Self>, ModelError> {
        let (statistics, network) = Statistics::of(self)?;
        let units = statistics.units(&network);
        let cells = statistics.in_units(&network, &units);
        (0..n as u64)
            .into_par_iter()
            .map(|number| {
                let mut rng = ChaCha8Rng::seed_from_u64(seed);
                rng.set_stream(number);
                let mut nodes = self.nodes().to_vec();
                for (i, node) in nodes.iter_mut().enumerate() {
                    node.extra = Extra::default();
                    let Some(kept) = statistics.nodes.get(&node.name) else {
                        continue;
                    };
                    draw_node(&network, i, kept, &cells[i], &units, &mut node.cpd, &mut rng);
                }
                Self::new(nodes, Extra::default())
            })
            .collect()
    }
}

fn draw_node(
    network: &Network,
    i: usize,
    kept: &NodeStatistics,
    cells: &[EarlierCell],
    units: &[Scaling],
    cpd: &mut Cpd,
    rng: &mut ChaCha8Rng,
) {
    match (&network.nodes()[i].kind, cpd) {
        (NodeKind::Discrete { prior, .. }, Cpd::Discrete(cpd)) => {
            for (row, counts) in cpd.table.iter_mut().zip(&kept.counts) {
                let shapes: Vec<f64> = counts.iter().map(|count| count + prior).collect();
                *row = dirichlet(&shapes, rng);
            }
        }
        (NodeKind::VonMisesFisher(_), Cpd::VonMisesFisher(cpd)) => {
            for (row, sums) in cpd.components.iter_mut().zip(&kept.directions) {
                draw_directions(row, sums, rng);
            }
        }
        (NodeKind::Mixture(spec), Cpd::Mixture(cpd)) => {
            let mixings = draw_cells(network, i, spec, cells, units, rng);
            let (parents, sources) = (cpd.discrete_parents.clone(), cpd.continuous_parents.clone());
            *cpd = assemble(network, i, spec, units, &mixings.iter().collect::<Vec<_>>());
            // A file may list its nodes in another order than the network.
            (cpd.discrete_parents, cpd.continuous_parents) = (parents, sources);
        }
        _ => {}
    }
}

fn draw_cells(
    network: &Network,
    i: usize,
    spec: &MixtureSpec,
    cells: &[EarlierCell],
    units: &[Scaling],
    rng: &mut ChaCha8Rng,
) -> Vec<Mixing> {
    let parents = network.nodes()[i].parents.iter();
    let q = parents.map(|&parent| units[parent].mean.len()).sum();
    let together = shares(spec) && cells.first().is_some_and(|cell| cell.moments.len() > 1);
    (0..cells.len())
        .filter_map(|number| {
            let mut settings = settings(spec, &units[i], q, together);
            let mut cell = EarlierCell::of(cells, (!together).then_some(number), !together)?;
            // As in training, one component over all configurations stands in where rows are too few.
            if !together && cell.measured.n_effective() < settings.least_mass() && cells.len() > 1 {
                cell = EarlierCell::of(cells, None, true)?;
            }
            settings.prior = cell.prior;
            settings.ridge.clone_from(&cell.ridge);
            let scale = cell.measured.scale();
            Some(draw_mixing(&settings, &cell.scaled(scale), rng))
        })
        .collect()
}

/// As [`crate::moments::maximize`], with draws for maxima.
fn draw_mixing(settings: &Settings, moments: &[Vec<Moment>], rng: &mut ChaCha8Rng) -> Mixing {
    let k = moments[0].len();
    let shapes = |cell: &[Moment]| -> Vec<f64> { cell.iter().map(|m| m.mass + 1.0 / k as f64).collect() };
    let summed = pool(moments);
    let log_weights = if settings.weights == Weights::Root {
        let all = logs(&dirichlet(&shapes(&summed), rng));
        vec![all; moments.len()]
    } else {
        moments
            .iter()
            .map(|cell| logs(&dirichlet(&shapes(cell), rng)))
            .collect()
    };
    let pooled = [summed];
    let sets = if settings.weights == Weights::Shared {
        &pooled[..]
    } else {
        moments
    };
    let fits: Vec<Vec<(Regression, DMatrix<f64>)>> = sets
        .iter()
        .map(|set| set.iter().map(|moment| regress(moment, settings)).collect())
        .collect();
    let common = settings.tied.then(|| {
        let mut scatter = DMatrix::zeros(settings.d, settings.d);
        let mut freedom = settings.prior.rows;
        for ((fit, _), moment) in fits.iter().flatten().zip(sets.iter().flatten()) {
            scatter += &fit.covariance;
            freedom += (moment.mass - (settings.q + 1) as f64).max(0.0);
        }
        draw_covariance(settings, scatter, freedom, rng)
    });
    let components = fits
        .into_iter()
        .zip(sets)
        .map(|(fits, set)| {
            let pairs = fits.into_iter().zip(set);
            pairs
                .map(|((fit, gram), moment)| {
                    let freedom = moment.mass + settings.prior.rows - (settings.q + 1) as f64;
                    let covariance = match &common {
                        Some(common) => common.clone(),
                        None => draw_covariance(settings, fit.covariance, freedom, rng),
                    };
                    let noise =
                        DMatrix::from_fn(settings.d, settings.q + 1, |_, _| StandardNormal.sample(rng));
                    // Z L⁻¹, as (L⁻ᵀ Zᵀ)ᵀ.
                    let spread = solve_lower_transpose(&gram, &noise.transpose()).transpose();
                    Regression {
                        slopes: fit.slopes + semidefinite_root(&covariance) * spread,
                        covariance,
                    }
                })
                .collect()
        })
        .collect();
    Mixing {
        log_weights,
        components,
    }
}

/// From the inverse Wishart with this scatter (the prior's is added) and degrees of freedom, at least d + 1.
fn draw_covariance(
    settings: &Settings,
    mut scatter: DMatrix<f64>,
    freedom: f64,
    rng: &mut ChaCha8Rng,
) -> DMatrix<f64> {
    let d = settings.d;
    for i in 0..d {
        scatter[(i, i)] += settings.prior.scatter();
    }
    symmetrize(&mut scatter);
    let lower = semidefinite_root(&scatter);
    let freedom = freedom.max((d + 1) as f64);
    // Bartlett: W = A Aᵀ is Wishart with unit scale; Σ = L W⁻¹ Lᵀ.
    let mut bartlett = DMatrix::zeros(d, d);
    for i in 0..d {
        for j in 0..i {
            bartlett[(i, j)] = StandardNormal.sample(rng);
        }
        bartlett[(i, i)] = ChiSquared::new(freedom - i as f64).map_or(1.0, |chi| f64::sqrt(chi.sample(rng)));
    }
    let root = solve_lower(&bartlett, &lower.transpose()).transpose();
    clip(&(&root * root.transpose()), &settings.floor)
}

fn draw_directions(components: &mut [VonMisesFisher], sums: &[DirectionSum], rng: &mut ChaCha8Rng) {
    let k = sums.len() as f64;
    let weights = if sums.len() == components.len() {
        dirichlet(
            &sums.iter().map(|part| part.mass + 1.0 / k).collect::<Vec<_>>(),
            rng,
        )
    } else {
        return;
    };
    for ((component, part), weight) in components.iter_mut().zip(sums).zip(weights) {
        component.weight = weight;
        let length = part.sum.iter().map(|v| v * v).sum::<f64>().sqrt();
        let mean = VonMisesFisher {
            weight: 1.0,
            direction: component.direction.clone(),
            concentration: component.concentration * length,
        };
        component.direction = DVector::from_vec(mean.sample(rng));
    }
}

fn dirichlet(shapes: &[f64], rng: &mut ChaCha8Rng) -> Vec<f64> {
    let draws: Vec<f64> = shapes
        .iter()
        .map(|shape| Gamma::new(shape.max(LEAST_SHAPE), 1.0).map_or(1.0, |gamma| gamma.sample(rng)))
        .collect();
    let total: f64 = draws.iter().sum();
    if total > 0.0 {
        draws.iter().map(|draw| draw / total).collect()
    } else {
        vec![1.0 / shapes.len() as f64; shapes.len()]
    }
}

fn logs(weights: &[f64]) -> Vec<f64> {
    weights.iter().map(|weight| weight.ln()).collect()
}
