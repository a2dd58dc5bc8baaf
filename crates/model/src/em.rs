//! Expectation maximization of a mixture of linear regressions, in the log domain, in standardised units.
//!
//! ```text
//! y | p ~ Σₖ πₖ N(Bₖ [1, p], Σₖ)
//! J = Σᵢ wᵢ log p(yᵢ | pᵢ) + Σₖ [ log πₖ / K − ½ ν log|Σₖ| − ½ tr Σₖ⁻¹ (ν s² I + Bₖ E Bₖᵀ) ]
//! ```
//!
//! J is the logarithm of a posterior density up to a constant, and both steps are exact maximizers, so J never falls.
//! The noise floor is the constraint Σₖ ⪰ diag(floor²), whose maximizer clips eigenvalues in units of the floor.
//! The products over all rows go through faer; what is d × d stays with plain loops.

use faer::{Accum, Mat, Par, linalg::matmul::matmul};
use nalgebra::{DMatrix, DVector};

use crate::gaussian::{LOG_TAU, cholesky, log_sum_exp, solve_lower, solve_lower_transpose, symmetrize};

/// Least ridge of the regressions: it only decides between equal fits.
pub(crate) const RIDGE: f64 = 1e-6;

/// Prior of a component's covariance: `rows` pseudo-rows (ν), each `deviation` (s) away from the mean, in units of the
/// column's standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
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

    fn scatter(self) -> f64 {
        self.rows * self.deviation * self.deviation
    }
}

/// Standardised rows of one cell: what one mixture is fitted to.
pub(crate) struct Rows {
    /// Dimension of y.
    pub d: usize,
    /// (d + 1 + q) × n: y, 1, p.
    pub z: Mat<f64>,
    /// Weight of each row.
    pub weights: Vec<f64>,
    /// Which mixing weights each row uses.
    pub cell: Vec<usize>,
    /// How many sets of mixing weights there are.
    pub n_cells: usize,
    /// Smallest standard deviation of each dimension of y.
    pub floor: Vec<f64>,
    /// Whether y and −y are the same.
    pub latent_sign: bool,
    /// Diagonal of E: ridge of the intercept and of each parent.
    pub ridge: Vec<f64>,
    /// Prior of the covariances.
    pub prior: CovariancePrior,
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
    /// log πₖ for each cell.
    pub log_weights: Vec<Vec<f64>>,
    pub components: Vec<Regression>,
}

/// Posterior probability of each component (and sign) for each row.
pub(crate) struct Responsibilities {
    /// n × K: both signs together.
    pub total: Vec<Vec<f64>>,
    /// n × K: plus minus minus; empty without a latent sign.
    pub signed: Vec<Vec<f64>>,
}

/// A fit and how it came about.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    pub mixing: Mixing,
    /// Σ wᵢ log p, without the priors.
    pub log_likelihood: f64,
    /// J after each step.
    pub objectives: Vec<f64>,
    pub converged: bool,
}

impl Rows {
    pub fn n(&self) -> usize {
        self.z.ncols()
    }
    pub fn q(&self) -> usize {
        self.z.nrows() - self.d - 1
    }
    pub fn total_weight(&self) -> f64 {
        self.weights.iter().sum()
    }
    /// Least mass that carries one component: as many rows as unknowns per output, and one more.
    pub fn least_mass(&self) -> f64 {
        (self.d + self.q() + 2) as f64
    }
    /// The given rows.
    pub fn select(&self, rows: &[usize]) -> Self {
        Self {
            d: self.d,
            z: Mat::from_fn(self.z.nrows(), rows.len(), |i, j| self.z[(i, rows[j])]),
            weights: rows.iter().map(|&i| self.weights[i]).collect(),
            cell: rows.iter().map(|&i| self.cell[i]).collect(),
            n_cells: self.n_cells,
            floor: self.floor.clone(),
            latent_sign: self.latent_sign,
            ridge: self.ridge.clone(),
            prior: self.prior,
        }
    }
}

/// Steps until J gains less than `tolerance` per unit of weight, or `max_steps`.
pub(crate) fn run(rows: &Rows, start: &Responsibilities, k: usize, max_steps: usize, tolerance: f64) -> Fit {
    let mixing = maximize(rows, start, k);
    resume(rows, mixing, max_steps, tolerance)
}

/// [`run`] from parameters.
pub(crate) fn resume(rows: &Rows, mut mixing: Mixing, max_steps: usize, tolerance: f64) -> Fit {
    let k = mixing.components.len();
    let enough = tolerance * rows.total_weight();
    let (mut responsibilities, mut log_likelihood) = expect(rows, &mixing);
    let mut objectives = vec![log_likelihood + log_prior(rows, &mixing)];
    let mut converged = k == 1 && !rows.latent_sign;
    while !converged && objectives.len() <= max_steps {
        let next = maximize(rows, &responsibilities, k);
        let (next_responsibilities, next_likelihood) = expect(rows, &next);
        let objective = next_likelihood + log_prior(rows, &next);
        let gain = objective - objectives[objectives.len() - 1];
        objectives.push(objective);
        (mixing, responsibilities, log_likelihood) = (next, next_responsibilities, next_likelihood);
        converged = gain < enough;
    }
    Fit {
        mixing,
        log_likelihood,
        objectives,
        converged,
    }
}

/// log p of each row under each component: n × K, and with a latent sign the same for −y.
fn log_densities(rows: &Rows, mixing: &Mixing) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let (d, m, n, k) = (rows.d, rows.z.nrows(), rows.n(), mixing.components.len());
    // Rows k·d … of `own` hold L⁻¹ y, of `pull` L⁻¹ B [1, p]; both signs need them apart.
    let mut own = Mat::<f64>::zeros(k * d, m);
    let mut pull = Mat::<f64>::zeros(k * d, m);
    let mut constants = Vec::with_capacity(k);
    for (c, component) in mixing.components.iter().enumerate() {
        let lower = cholesky(&component.covariance).unwrap_or_else(|| DMatrix::identity(d, d));
        let white = solve_lower(&lower, &DMatrix::identity(d, d));
        let slopes = &white * &component.slopes;
        for i in 0..d {
            for j in 0..d {
                own[(c * d + i, j)] = white[(i, j)];
            }
            for j in d..m {
                pull[(c * d + i, j)] = slopes[(i, j - d)];
            }
        }
        let log_root: f64 = (0..d).map(|i| lower[(i, i)].ln()).sum();
        constants.push(-0.5 * d as f64 * LOG_TAU - log_root);
    }
    let white = |left: &Mat<f64>| {
        let mut out = Mat::<f64>::zeros(k * d, n);
        matmul(&mut out, Accum::Replace, left, &rows.z, 1.0, Par::Seq);
        out
    };
    let halves = |out: &Mat<f64>, shift: Option<&Mat<f64>>, sign: f64| -> Vec<Vec<f64>> {
        (0..n)
            .map(|i| {
                (0..k)
                    .map(|c| {
                        let mut square = 0.0;
                        for j in c * d..(c + 1) * d {
                            let residual = out[(j, i)] * sign - shift.map_or(0.0, |shift| shift[(j, i)]);
                            square += residual * residual;
                        }
                        constants[c] - 0.5 * square + mixing.log_weights[rows.cell[i]][c]
                    })
                    .collect()
            })
            .collect()
    };
    if rows.latent_sign {
        let (own, pull) = (white(&own), white(&pull));
        (halves(&own, Some(&pull), 1.0), halves(&own, Some(&pull), -1.0))
    } else {
        let both = Mat::from_fn(k * d, m, |i, j| own[(i, j)] - pull[(i, j)]);
        (halves(&white(&both), None, 1.0), Vec::new())
    }
}

/// log p of each row, and responsibilities with the weighted log-likelihood.
pub(crate) fn row_log_densities(rows: &Rows, mixing: &Mixing) -> Vec<f64> {
    let (plus, minus) = log_densities(rows, mixing);
    (0..rows.n())
        .map(|i| match minus.get(i) {
            None => log_sum_exp(&plus[i]),
            Some(minus) => log_sum_exp(&[log_sum_exp(&plus[i]), log_sum_exp(minus)]) - std::f64::consts::LN_2,
        })
        .collect()
}

/// The E-step.
fn expect(rows: &Rows, mixing: &Mixing) -> (Responsibilities, f64) {
    let (mut plus, mut minus) = log_densities(rows, mixing);
    let mut log_likelihood = 0.0;
    for i in 0..rows.n() {
        if rows.latent_sign {
            let total = log_sum_exp(&[log_sum_exp(&plus[i]), log_sum_exp(&minus[i])]);
            log_likelihood += rows.weights[i] * (total - std::f64::consts::LN_2);
            for (a, b) in plus[i].iter_mut().zip(&mut minus[i]) {
                let (p, m) = ((*a - total).exp(), (*b - total).exp());
                (*a, *b) = (p + m, p - m);
            }
        } else {
            let total = log_sum_exp(&plus[i]);
            log_likelihood += rows.weights[i] * total;
            for a in &mut plus[i] {
                *a = (*a - total).exp();
            }
        }
    }
    (
        Responsibilities {
            total: plus,
            signed: minus,
        },
        log_likelihood,
    )
}

/// The M-step: mixing weights, regressions and covariances, each the exact maximizer of J.
fn maximize(rows: &Rows, responsibilities: &Responsibilities, k: usize) -> Mixing {
    let (d, m, n) = (rows.d, rows.z.nrows(), rows.n());
    let mut mass = vec![vec![0.0; k]; rows.n_cells];
    for i in 0..n {
        for c in 0..k {
            mass[rows.cell[i]][c] += rows.weights[i] * responsibilities.total[i][c];
        }
    }
    let log_weights = mass
        .iter()
        .map(|row| {
            let total: f64 = row.iter().sum();
            row.iter()
                .map(|mass| ((mass + 1.0 / k as f64) / (total + 1.0)).ln())
                .collect()
        })
        .collect();
    let mut scaled = Mat::<f64>::zeros(m, n);
    let mut moments = Mat::<f64>::zeros(m, m);
    let mut cross = Mat::<f64>::zeros(m, m);
    let components = (0..k)
        .map(|c| {
            let share: f64 = mass.iter().map(|row| row[c]).sum();
            for i in 0..n {
                let r = rows.weights[i] * responsibilities.total[i][c];
                for j in 0..m {
                    scaled[(j, i)] = r * rows.z[(j, i)];
                }
            }
            matmul(
                &mut moments,
                Accum::Replace,
                &scaled,
                rows.z.transpose(),
                1.0,
                Par::Seq,
            );
            if rows.latent_sign {
                for i in 0..n {
                    let r = rows.weights[i] * responsibilities.signed[i][c];
                    for j in 0..m {
                        scaled[(j, i)] = r * rows.z[(j, i)];
                    }
                }
                matmul(
                    &mut cross,
                    Accum::Replace,
                    &scaled,
                    rows.z.transpose(),
                    1.0,
                    Par::Seq,
                );
            }
            let product = if rows.latent_sign { &cross } else { &moments };
            let yy = DMatrix::from_fn(d, d, |i, j| moments[(i, j)]);
            let yx = DMatrix::from_fn(d, m - d, |i, j| product[(i, d + j)]);
            let xx = DMatrix::from_fn(m - d, m - d, |i, j| moments[(d + i, d + j)]);
            regress(&yy, &yx, xx, share, rows)
        })
        .collect();
    Mixing {
        log_weights,
        components,
    }
}

/// One regression from its weighted moments.
fn regress(yy: &DMatrix<f64>, yx: &DMatrix<f64>, mut xx: DMatrix<f64>, mass: f64, rows: &Rows) -> Regression {
    let d = yy.nrows();
    for (i, ridge) in rows.ridge.iter().enumerate() {
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
    let mut scatter = yy - half.transpose() * &half;
    for i in 0..d {
        scatter[(i, i)] += rows.prior.scatter();
    }
    symmetrize(&mut scatter);
    let covariance = clip(&(scatter / (mass + rows.prior.rows)), &rows.floor);
    Regression { slopes, covariance }
}

/// The covariance nearest in likelihood that is nowhere below the floor: eigenvalues in units of the floor, at least 1.
fn clip(covariance: &DMatrix<f64>, floor: &[f64]) -> DMatrix<f64> {
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

/// The priors' part of J.
fn log_prior(rows: &Rows, mixing: &Mixing) -> f64 {
    let ridge = DMatrix::from_diagonal(&DVector::from_column_slice(&rows.ridge));
    let k = mixing.components.len() as f64;
    let mut sum: f64 = mixing
        .log_weights
        .iter()
        .flatten()
        .map(|log_weight| log_weight / k)
        .sum();
    for component in &mixing.components {
        let d = component.covariance.nrows();
        let Some(lower) = cholesky(&component.covariance) else {
            continue;
        };
        let log_determinant: f64 = 2.0 * (0..d).map(|i| lower[(i, i)].ln()).sum::<f64>();
        let scatter = DMatrix::from_diagonal(&DVector::from_element(d, rows.prior.scatter()))
            + &component.slopes * &ridge * component.slopes.transpose();
        let trace = solve_lower_transpose(&lower, &solve_lower(&lower, &scatter)).trace();
        sum -= 0.5 * (rows.prior.rows * log_determinant + trace);
    }
    sum
}

/// Mass of each component over all cells.
pub(crate) fn masses(rows: &Rows, mixing: &Mixing) -> Vec<f64> {
    let (responsibilities, _) = expect(rows, mixing);
    let mut out = vec![0.0; mixing.components.len()];
    for (row, weight) in responsibilities.total.iter().zip(&rows.weights) {
        for (mass, r) in out.iter_mut().zip(row) {
            *mass += weight * r;
        }
    }
    out
}
