//! The M-step: weighted second moments become mixing weights, regressions and covariances, each the exact maximizer of
//!
//! ```text
//! J = Σᵢ wᵢ log p(yᵢ | pᵢ) + Σₖ [ log πₖ / K − ½ ν log|Σₖ| − ½ tr Σₖ⁻¹ (ν s² I + Bₖ E Bₖᵀ) ]
//! ```
//!
//! J is the logarithm of a posterior density up to a constant. The noise floor is the constraint Σₖ ⪰ diag(floor²), whose
//! maximizer clips eigenvalues in units of the floor. What configurations share (components, weights, a covariance) is
//! summed before it is maximized, so J never falls there either.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use crate::cpd::Weights;
use crate::gaussian::{cholesky, solve_lower, solve_lower_transpose, symmetrize};

/// Least ridge of the regressions: it only decides between equal fits.
pub(crate) const RIDGE: f64 = 1e-6;

/// Prior of a component's covariance: `rows` pseudo-rows (ν), each `deviation` (s) away from the mean, in units of the
/// column's standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct CovariancePrior {
    pub rows: f64,
    pub deviation: f64,
}

impl CovariancePrior {
    /// Keeps a component off a single point, and no more.
    pub const WEAK: Self = Self {
        rows: 1.0,
        deviation: 0.01,
    };

    /// What the prior adds to each diagonal entry of the scatter.
    pub fn scatter(self) -> f64 {
        self.rows * self.deviation * self.deviation
    }
}

/// What is estimated from moments, in standardised units.
#[derive(Debug, Clone)]
pub(crate) struct Settings {
    /// Dimension of y.
    pub d: usize,
    /// Dimension of p.
    pub q: usize,
    /// What the configurations share.
    pub weights: Weights,
    /// Whether all components of all configurations have one covariance.
    pub tied: bool,
    /// Smallest standard deviation of each dimension of y.
    pub floor: Vec<f64>,
    /// Whether y and −y are the same.
    pub latent_sign: bool,
    /// Diagonal of E: ridge of the intercept and of each parent.
    pub ridge: Vec<f64>,
    /// Prior of the covariances.
    pub prior: CovariancePrior,
}

/// Σ r and Σ r z zᵀ of one component, z = (y, 1, p). With a latent sign the part between y and (1, p) counts y with the
/// sign under which it belongs to the component.
#[derive(Debug, Clone)]
pub(crate) struct Moment {
    pub mass: f64,
    pub product: DMatrix<f64>,
}

/// One component in standardised units.
#[derive(Debug, Clone)]
pub(crate) struct Regression {
    /// d × (1 + q): intercept and slopes.
    pub slopes: DMatrix<f64>,
    /// d × d.
    pub covariance: DMatrix<f64>,
}

/// Parameters of a mixture.
#[derive(Debug, Clone)]
pub(crate) struct Mixing {
    /// log πₖ for each configuration.
    pub log_weights: Vec<Vec<f64>>,
    /// One set of components for each configuration, or a single one for all.
    pub components: Vec<Vec<Regression>>,
}

impl Mixing {
    /// The components of a configuration.
    pub fn set(&self, cell: usize) -> &[Regression] {
        &self.components[cell.min(self.components.len() - 1)]
    }
    /// Number of components.
    pub fn k(&self) -> usize {
        self.log_weights[0].len()
    }
}

impl Settings {
    /// Length of z = (y, 1, p).
    pub fn m(&self) -> usize {
        self.d + 1 + self.q
    }
    /// Least mass that carries one component: as many rows as unknowns per output, and one more.
    pub fn least_mass(&self) -> f64 {
        (self.d + self.q + 2) as f64
    }
    /// Free parameters with k components in each of so many configurations.
    pub fn n_parameters(&self, k: usize, n_cells: usize) -> usize {
        let sets = if self.weights == Weights::Shared {
            1
        } else {
            n_cells
        };
        let covariances = if self.tied { 1 } else { sets * k };
        let weights = if self.weights == Weights::Root { 1 } else { n_cells };
        sets * k * self.d * (self.q + 1)
            + covariances * self.d * (self.d + 1) / 2
            + weights * k.saturating_sub(1)
    }
}

impl Moment {
    pub fn zero(m: usize) -> Self {
        Self {
            mass: 0.0,
            product: DMatrix::zeros(m, m),
        }
    }
    pub fn add(&mut self, other: &Self) {
        self.mass += other.mass;
        self.product += &other.product;
    }
}

/// The parameters that maximize J given the moments of each configuration and component.
pub(crate) fn maximize(settings: &Settings, moments: &[Vec<Moment>]) -> Mixing {
    let k = moments[0].len();
    let mut masses: Vec<Vec<f64>> = moments
        .iter()
        .map(|cell| cell.iter().map(|moment| moment.mass).collect())
        .collect();
    if settings.weights == Weights::Root {
        let sums: Vec<f64> = (0..k).map(|c| masses.iter().map(|cell| cell[c]).sum()).collect();
        masses.fill(sums);
    }
    let log_weights = masses
        .iter()
        .map(|cell| {
            let total: f64 = cell.iter().sum();
            cell.iter()
                .map(|mass| ((mass + 1.0 / k as f64) / (total + 1.0)).ln())
                .collect()
        })
        .collect();
    let pooled: [Vec<Moment>; 1];
    let sets = if settings.weights == Weights::Shared && moments.len() > 1 {
        pooled = [pool(moments)];
        &pooled[..]
    } else {
        moments
    };
    let mut components: Vec<Vec<Regression>> = sets
        .iter()
        .map(|set| set.iter().map(|moment| regress(moment, settings).0).collect())
        .collect();
    // Here `covariance` still holds the scatter without the prior's.
    let finish = |mut scatter: DMatrix<f64>, mass: f64| {
        for i in 0..settings.d {
            scatter[(i, i)] += settings.prior.scatter();
        }
        symmetrize(&mut scatter);
        clip(&(scatter / (mass + settings.prior.rows)), &settings.floor)
    };
    if settings.tied {
        let mut scatter = DMatrix::zeros(settings.d, settings.d);
        for component in components.iter().flatten() {
            scatter += &component.covariance;
        }
        let covariance = finish(scatter, sets.iter().flatten().map(|moment| moment.mass).sum());
        for component in components.iter_mut().flatten() {
            component.covariance.copy_from(&covariance);
        }
    } else {
        for (component, moment) in components.iter_mut().flatten().zip(sets.iter().flatten()) {
            let scatter = std::mem::replace(&mut component.covariance, DMatrix::zeros(0, 0));
            component.covariance = finish(scatter, moment.mass);
        }
    }
    Mixing {
        log_weights,
        components,
    }
}

/// Each component's moments summed over the configurations.
pub(crate) fn pool(moments: &[Vec<Moment>]) -> Vec<Moment> {
    let mut sum = moments[0].clone();
    for cell in &moments[1..] {
        for (a, b) in sum.iter_mut().zip(cell) {
            a.add(b);
        }
    }
    sum
}

/// One regression from its moments, and the Cholesky factor of its Gram matrix; `covariance` is the scatter that it
/// leaves.
pub(crate) fn regress(moment: &Moment, settings: &Settings) -> (Regression, DMatrix<f64>) {
    let (d, m) = (settings.d, settings.m());
    let yy = moment.product.view((0, 0), (d, d));
    let yx = moment.product.view((0, d), (d, m - d));
    let mut xx = moment.product.view((d, d), (m - d, m - d)).into_owned();
    for (i, ridge) in settings.ridge.iter().enumerate() {
        xx[(i, i)] += ridge;
    }
    symmetrize(&mut xx);
    // Collinear parents leave the Gram matrix singular to rounding; more ridge decides between equal fits.
    let mut extra = RIDGE * xx.diagonal().max().max(1.0);
    let lower = loop {
        if let Some(lower) = cholesky(&xx) {
            break lower;
        }
        for i in 0..xx.nrows() {
            xx[(i, i)] += extra;
        }
        extra *= 10.0;
    };
    let half = solve_lower(&lower, &yx.transpose());
    let slopes = solve_lower_transpose(&lower, &half).transpose();
    let covariance = yy - half.transpose() * &half;
    (Regression { slopes, covariance }, lower)
}

/// The covariance nearest in likelihood that is nowhere below the floor: eigenvalues in units of the floor, at least 1.
pub(crate) fn clip(covariance: &DMatrix<f64>, floor: &[f64]) -> DMatrix<f64> {
    let d = covariance.nrows();
    // A floor of zero becomes a relative one, for rounding's sake only.
    let unit: Vec<f64> = floor.iter().map(|f| f.max(1e-7)).collect();
    let mut white = DMatrix::from_fn(d, d, |i, j| covariance[(i, j)] / (unit[i] * unit[j]));
    symmetrize(&mut white);
    if cholesky(&(&white - DMatrix::identity(d, d))).is_some() {
        return covariance.clone();
    }
    let eigen = white.symmetric_eigen();
    let clipped = eigen.eigenvalues.map(|value| value.max(1.0));
    let mut out = &eigen.eigenvectors * DMatrix::from_diagonal(&clipped) * eigen.eigenvectors.transpose();
    for i in 0..d {
        for j in 0..d {
            out[(i, j)] *= unit[i] * unit[j];
        }
    }
    symmetrize(&mut out);
    out
}

/// The priors' part of J; what is shared counts once.
pub(crate) fn log_prior(settings: &Settings, mixing: &Mixing) -> f64 {
    let ridge = DMatrix::from_diagonal(&DVector::from_column_slice(&settings.ridge));
    let k = mixing.k() as f64;
    let n_weights = if settings.weights == Weights::Root {
        1
    } else {
        mixing.log_weights.len()
    };
    let mut sum: f64 = mixing.log_weights[..n_weights]
        .iter()
        .flatten()
        .map(|log_weight| log_weight / k)
        .sum();
    for (i, component) in mixing.components.iter().flatten().enumerate() {
        let d = settings.d;
        let Some(lower) = cholesky(&component.covariance) else {
            continue;
        };
        let own = if settings.tied && i > 0 { 0.0 } else { 1.0 };
        let log_determinant: f64 = 2.0 * (0..d).map(|i| lower[(i, i)].ln()).sum::<f64>();
        let scatter = DMatrix::from_diagonal(&DVector::from_element(d, own * settings.prior.scatter()))
            + &component.slopes * &ridge * component.slopes.transpose();
        let trace = solve_lower_transpose(&lower, &solve_lower(&lower, &scatter)).trace();
        sum -= 0.5 * (own * settings.prior.rows * log_determinant + trace);
    }
    sum
}
