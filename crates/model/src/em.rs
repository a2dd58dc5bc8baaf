//! Expectation maximization of a mixture of linear regressions, in the log domain, in standardised units.
//!
//! ```text
//! y | p ~ Σₖ πₖ N(Bₖ [1, p], Σₖ)
//! ```
//!
//! One pass over the rows, in blocks that stay in the cache, gives the log-likelihood and the moments that the M-step
//! (`moments.rs`) needs (`em_block.rs`). Of the size of the data only the products of few rows are stored.

use std::sync::OnceLock;

use nalgebra::DMatrix;

use crate::em_block::{BLOCK, Gatherer, Stack, products};
use crate::gaussian::{LOG_TAU, cholesky, solve_lower};
use crate::moments::{Mixing, Moment, Regression, Settings, log_prior, maximize};

/// What rounding may take from J in one step, in shares of J.
const ROUNDING: f64 = 1e-7;
/// Products of rows that are kept from step to step: 16 MB.
const MOST_KEPT: usize = 2 << 20;

/// Standardised rows: what one mixture is fitted to.
pub(crate) struct Rows {
    pub settings: Settings,
    /// (y, 1, p) row after row.
    pub z: Vec<f64>,
    /// Weight of each row.
    pub weights: Vec<f64>,
    /// End of each configuration's rows: rows are sorted by configuration.
    pub ends: Vec<usize>,
    /// Moments of each configuration and component over rows that are no longer here; empty for none.
    pub earlier: Vec<Vec<Moment>>,
    /// What [`Rows::products`] keeps.
    pub kept: OnceLock<Vec<f64>>,
}

/// A fit and how it came about.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    pub mixing: Mixing,
    /// Σ wᵢ log p, without the priors.
    pub log_likelihood: f64,
    /// Mass of each component, all configurations together.
    pub masses: Vec<f64>,
    /// J after each step.
    pub objectives: Vec<f64>,
    pub converged: bool,
}

impl Rows {
    pub fn n(&self) -> usize {
        self.weights.len()
    }
    /// (y, 1, p) of a row.
    pub fn row(&self, i: usize) -> &[f64] {
        let m = self.settings.m();
        &self.z[i * m..(i + 1) * m]
    }
    /// The products of these rows; `None` where all rows' together are too many to keep.
    fn products(&self, rows: std::ops::Range<usize>) -> Option<&[f64]> {
        let m = self.settings.m();
        let t = m * (m + 1) / 2;
        (self.n() * t <= MOST_KEPT).then(|| {
            let all = self.kept.get_or_init(|| {
                let mut all = Vec::with_capacity(self.n() * t);
                products(&self.z, m, &mut all);
                all
            });
            &all[rows.start * t..rows.end * t]
        })
    }
    pub fn total_weight(&self) -> f64 {
        self.weights.iter().sum()
    }
    /// Rows of a configuration.
    pub fn cell(&self, cell: usize) -> std::ops::Range<usize> {
        let start = if cell == 0 { 0 } else { self.ends[cell - 1] };
        start..self.ends[cell]
    }
    /// The given rows, in rising order, without the earlier ones.
    pub fn select(&self, rows: &[usize]) -> Self {
        Self {
            settings: self.settings.clone(),
            z: rows.iter().flat_map(|&i| self.row(i)).copied().collect(),
            weights: rows.iter().map(|&i| self.weights[i]).collect(),
            ends: self
                .ends
                .iter()
                .map(|&end| rows.partition_point(|&i| i < end))
                .collect(),
            earlier: Vec::new(),
            kept: OnceLock::new(),
        }
    }
}

/// A component as it acts on z: the white residual is `white` z, the log density `constant` − ½ |white z|².
pub(crate) struct Acting {
    pub component: usize,
    /// −1 where −y belongs to the component.
    pub sign: f64,
    pub constant: f64,
    /// d × m.
    pub white: DMatrix<f64>,
}

/// The components with their log weights; with a latent sign each one twice.
pub(crate) fn acting(settings: &Settings, log_weights: &[f64], components: &[Regression]) -> Vec<Acting> {
    let (d, m) = (settings.d, settings.m());
    let signs: &[f64] = if settings.latent_sign {
        &[1.0, -1.0]
    } else {
        &[1.0]
    };
    let share = -(signs.len() as f64).ln();
    let mut out = Vec::with_capacity(signs.len() * components.len());
    for &sign in signs {
        for (c, component) in components.iter().enumerate() {
            let lower = cholesky(&component.covariance).unwrap_or_else(|| DMatrix::identity(d, d));
            let mut residual = DMatrix::zeros(d, m);
            residual.fill_diagonal(sign);
            residual.columns_mut(d, m - d).copy_from(&(-&component.slopes));
            let log_root: f64 = (0..d).map(|i| lower[(i, i)].ln()).sum();
            out.push(Acting {
                component: c,
                sign,
                constant: log_weights[c] + share - 0.5 * d as f64 * LOG_TAU - log_root,
                white: solve_lower(&lower, &residual),
            });
        }
    }
    out
}

/// The E-step: Σ wᵢ log p, and the moments of each configuration and component, those of earlier rows included.
pub(crate) fn expect(rows: &Rows, mixing: &Mixing) -> (f64, Vec<Vec<Moment>>) {
    let (settings, k) = (&rows.settings, mixing.k());
    let m = settings.m();
    let mut log_likelihood = 0.0;
    let (mut shares, mut totals) = (Vec::new(), Vec::new());
    let moments = (0..rows.ends.len())
        .map(|cell| {
            let parts = acting(settings, &mixing.log_weights[cell], mixing.set(cell));
            let mut stack = Stack::new(settings.d, m, &parts);
            let mut gatherer = Gatherer::new(settings, k);
            let range = rows.cell(cell);
            for start in range.clone().step_by(BLOCK) {
                let n = BLOCK.min(range.end - start);
                let z = &rows.z[start * m..(start + n) * m];
                let weights = &rows.weights[start..start + n];
                stack.shares(z, n, &mut shares, &mut totals);
                log_likelihood += totals.iter().zip(weights).map(|(log, w)| log * w).sum::<f64>();
                gatherer.add(z, rows.products(start..start + n), weights, &mut shares);
            }
            let mut moments = gatherer.finish();
            if let Some(earlier) = rows.earlier.get(cell) {
                for (moment, earlier) in moments.iter_mut().zip(earlier) {
                    moment.add(earlier);
                }
                log_likelihood += earlier_log_likelihood(&parts, earlier);
            }
            moments
        })
        .collect();
    (log_likelihood, moments)
}

/// Expected log density of earlier rows and of the components that they were given to: Σₖ [mass · constant − ½ tr W M Wᵀ].
fn earlier_log_likelihood(parts: &[Acting], earlier: &[Moment]) -> f64 {
    // With a latent sign the parts of +1 stand first, and moments count y with the sign under which it belongs.
    let pairs = parts.iter().zip(earlier);
    pairs
        .map(|(part, moment)| {
            let square = (&part.white * &moment.product).dot(&part.white);
            moment.mass * part.constant - 0.5 * square
        })
        .sum()
}

/// Moments of rows with given shares: plus and minus shares of row and component.
pub(crate) fn gather(rows: &Rows, k: usize, share: impl Fn(usize, usize) -> (f64, f64)) -> Vec<Vec<Moment>> {
    let m = rows.settings.m();
    let mut shares = Vec::new();
    (0..rows.ends.len())
        .map(|cell| {
            let mut gatherer = Gatherer::new(&rows.settings, k);
            let range = rows.cell(cell);
            for start in range.clone().step_by(BLOCK) {
                let n = BLOCK.min(range.end - start);
                shares.clear();
                let pairs = || (0..k).flat_map(|c| (start..start + n).map(move |i| (i, c)));
                shares.extend(pairs().map(|(i, c)| share(i, c).0));
                if rows.settings.latent_sign {
                    shares.extend(pairs().map(|(i, c)| share(i, c).1));
                }
                let z = &rows.z[start * m..(start + n) * m];
                let kept = rows.products(start..start + n);
                gatherer.add(z, kept, &rows.weights[start..start + n], &mut shares);
            }
            gatherer.finish()
        })
        .collect()
}

/// log p of each row.
pub(crate) fn row_log_densities(rows: &Rows, mixing: &Mixing) -> Vec<f64> {
    let settings = &rows.settings;
    let m = settings.m();
    let mut out = Vec::with_capacity(rows.n());
    let (mut shares, mut totals) = (Vec::new(), Vec::new());
    for cell in 0..rows.ends.len() {
        let parts = acting(settings, &mixing.log_weights[cell], mixing.set(cell));
        let mut stack = Stack::new(settings.d, m, &parts);
        let range = rows.cell(cell);
        for start in range.clone().step_by(BLOCK) {
            let n = BLOCK.min(range.end - start);
            stack.shares(&rows.z[start * m..(start + n) * m], n, &mut shares, &mut totals);
            out.extend_from_slice(&totals);
        }
    }
    out
}

/// Steps until J gains less than `tolerance` per unit of weight, or `max_steps`.
pub(crate) fn run(rows: &Rows, moments: &[Vec<Moment>], max_steps: usize, tolerance: f64) -> Fit {
    resume(rows, maximize(&rows.settings, moments), max_steps, tolerance)
}

/// [`run`] from parameters.
pub(crate) fn resume(rows: &Rows, mut mixing: Mixing, max_steps: usize, tolerance: f64) -> Fit {
    let settings = &rows.settings;
    let enough = tolerance * rows.total_weight();
    let (mut log_likelihood, mut moments) = expect(rows, &mixing);
    let mut objectives = vec![log_likelihood + log_prior(settings, &mixing)];
    let mut converged = mixing.k() == 1 && !settings.latent_sign;
    while !converged && objectives.len() <= max_steps {
        let next = maximize(settings, &moments);
        let (next_likelihood, next_moments) = expect(rows, &next);
        let objective = next_likelihood + log_prior(settings, &next);
        let before = objectives[objectives.len() - 1];
        debug_assert!(
            objective >= before - ROUNDING * (before.abs() + rows.total_weight()),
            "EM fell from {before} to {objective}"
        );
        objectives.push(objective);
        (mixing, moments, log_likelihood) = (next, next_moments, next_likelihood);
        converged = objective - before < enough;
    }
    let k = mixing.k();
    Fit {
        masses: (0..k)
            .map(|c| moments.iter().map(|cell| cell[c].mass).sum())
            .collect(),
        mixing,
        log_likelihood,
        objectives,
        converged,
    }
}
