//! Expectation maximization of a mixture of linear regressions, in the log domain, in standardised units.
//!
//! ```text
//! y | p ~ Σₖ πₖ N(Bₖ [1, p], Σₖ)
//! ```
//!
//! One pass over the rows, in blocks that stay in the cache, gives the log-likelihood and the moments that the M-step
//! (`moments.rs`) needs; nothing of the size of the data is stored. The two products of a block go through faer; between
//! them all loops run over the rows of the block, several at once.

use faer::{Accum, MatMut, MatRef, Par, linalg::matmul::matmul};
use nalgebra::DMatrix;

use crate::exponential::exp_below_zero;
use crate::gaussian::{LOG_TAU, cholesky, solve_lower};
use crate::moments::{Mixing, Moment, Regression, Settings, log_prior, maximize};

/// Rows of a block: white residuals and products of 256 rows fit into the second-level cache.
const BLOCK: usize = 256;
/// What rounding may take from J in one step, in shares of J.
const ROUNDING: f64 = 1e-7;

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

/// Stacked white maps of several acting components, and the buffer for their residuals.
struct Stack {
    d: usize,
    m: usize,
    /// m × (d · components): one column for each dimension of each component.
    maps: Vec<f64>,
    constants: Vec<f64>,
    residuals: Vec<f64>,
}

impl Stack {
    fn new(d: usize, m: usize, acting: &[Acting]) -> Self {
        let maps = acting
            .iter()
            .flat_map(|part| (0..d).flat_map(move |i| (0..m).map(move |j| part.white[(i, j)])));
        Self {
            d,
            m,
            maps: maps.collect(),
            constants: acting.iter().map(|part| part.constant).collect(),
            residuals: vec![0.0; d * acting.len() * BLOCK],
        }
    }

    /// Log densities of the block's n rows: all rows under the first component, under the second …
    fn log_densities(&mut self, z: &[f64], n: usize, out: &mut Vec<f64>) {
        let columns = self.d * self.constants.len();
        matmul(
            MatMut::from_column_major_slice_mut(&mut self.residuals[..n * columns], n, columns),
            Accum::Replace,
            MatRef::from_row_major_slice(z, n, self.m),
            MatRef::from_column_major_slice(&self.maps, self.m, columns),
            1.0,
            Par::Seq,
        );
        out.clear();
        for (constant, part) in self.constants.iter().zip(self.residuals.chunks_exact(n * self.d)) {
            let start = out.len();
            out.resize(start + n, *constant);
            for dimension in part.chunks_exact(n) {
                for (log, residual) in out[start..].iter_mut().zip(dimension) {
                    *log -= 0.5 * residual * residual;
                }
            }
        }
    }
}

/// Turns log densities of n rows into shares of each row's sum; `totals` become the logarithms of the sums.
fn normalize(logs: &mut [f64], n: usize, totals: &mut Vec<f64>) {
    totals.clear();
    totals.resize(n, f64::NEG_INFINITY);
    for part in logs.chunks_exact(n) {
        for (total, log) in totals.iter_mut().zip(part) {
            *total = if log > total { *log } else { *total };
        }
    }
    let mut sums = [0.0; BLOCK];
    let n_parts = logs.len() / n;
    for part in logs.chunks_exact_mut(n) {
        for ((log, total), sum) in part.iter_mut().zip(totals.iter()).zip(&mut sums) {
            *log = exp_below_zero(*log - total);
            *sum += *log;
        }
    }
    let mut inverse = [0.0; BLOCK];
    for (inverse, sum) in inverse.iter_mut().zip(&sums[..n]) {
        *inverse = 1.0 / sum;
    }
    for part in logs.chunks_exact_mut(n) {
        for (share, inverse) in part.iter_mut().zip(&inverse) {
            *share *= inverse;
        }
    }
    for (b, (total, sum)) in totals.iter_mut().zip(&sums).enumerate() {
        if *total == f64::NEG_INFINITY {
            for share in logs.iter_mut().skip(b).step_by(n) {
                *share = 1.0 / n_parts as f64;
            }
        } else {
            *total += sum.ln();
        }
    }
}

/// Sums responsibilities times z zᵀ, block by block.
pub(crate) struct Gatherer {
    d: usize,
    m: usize,
    n_components: usize,
    latent_sign: bool,
    products: Vec<f64>,
    signed: Vec<f64>,
    packed: Vec<f64>,
    packed_signed: Vec<f64>,
    masses: Vec<f64>,
}

impl Gatherer {
    pub fn new(settings: &Settings, n_components: usize) -> Self {
        let m = settings.m();
        let t = m * (m + 1) / 2;
        let both = usize::from(settings.latent_sign);
        Self {
            d: settings.d,
            m,
            n_components,
            latent_sign: settings.latent_sign,
            products: vec![0.0; t * BLOCK],
            signed: vec![0.0; both * n_components * BLOCK],
            packed: vec![0.0; t * n_components],
            packed_signed: vec![0.0; both * t * n_components],
            masses: vec![0.0; n_components],
        }
    }

    /// One block. `shares` has those of all rows for the first component, for the second …, and with a latent sign those
    /// of −y after them; it becomes shares times weights.
    fn add(&mut self, z: &[f64], weights: &[f64], shares: &mut [f64]) {
        let (n, m, k) = (weights.len(), self.m, self.n_components);
        let t = m * (m + 1) / 2;
        for (row, out) in z.chunks_exact(m).zip(self.products.chunks_exact_mut(t)) {
            let mut at = 0;
            for i in 0..m {
                let scale = row[i];
                for (out, other) in out[at..at + m - i].iter_mut().zip(&row[i..]) {
                    *out = scale * other;
                }
                at += m - i;
            }
        }
        for part in shares.chunks_exact_mut(n) {
            for (share, weight) in part.iter_mut().zip(weights) {
                *share *= weight;
            }
        }
        if self.latent_sign {
            let (plus, minus) = shares.split_at_mut(k * n);
            for ((signed, plus), minus) in self.signed.iter_mut().zip(plus).zip(minus) {
                *signed = *plus - *minus;
                *plus += *minus;
            }
        }
        for (mass, part) in self.masses.iter_mut().zip(shares.chunks_exact(n)) {
            *mass += part.iter().sum::<f64>();
        }
        let gather = |packed: &mut [f64], shares: &[f64]| {
            matmul(
                MatMut::from_column_major_slice_mut(packed, t, k),
                Accum::Add,
                MatRef::from_column_major_slice(&self.products[..t * n], t, n),
                MatRef::from_column_major_slice(&shares[..k * n], n, k),
                1.0,
                Par::Seq,
            );
        };
        gather(&mut self.packed, shares);
        if self.latent_sign {
            gather(&mut self.packed_signed, &self.signed);
        }
    }

    fn finish(self) -> Vec<Moment> {
        let t = self.m * (self.m + 1) / 2;
        (0..self.n_components)
            .map(|c| {
                let mut product = DMatrix::zeros(self.m, self.m);
                let mut at = c * t;
                for i in 0..self.m {
                    for j in i..self.m {
                        let between = i < self.d && j >= self.d && self.latent_sign;
                        let value = if between {
                            self.packed_signed[at]
                        } else {
                            self.packed[at]
                        };
                        product[(i, j)] = value;
                        product[(j, i)] = value;
                        at += 1;
                    }
                }
                Moment {
                    mass: self.masses[c],
                    product,
                }
            })
            .collect()
    }
}

/// The E-step: Σ wᵢ log p, and the moments of each configuration and component, those of earlier rows included.
pub(crate) fn expect(rows: &Rows, mixing: &Mixing) -> (f64, Vec<Vec<Moment>>) {
    let (settings, k) = (&rows.settings, mixing.k());
    let m = settings.m();
    let mut log_likelihood = 0.0;
    let (mut logs, mut totals) = (Vec::new(), Vec::new());
    let moments = (0..rows.ends.len())
        .map(|cell| {
            let parts = acting(settings, &mixing.log_weights[cell], mixing.set(cell));
            let mut stack = Stack::new(settings.d, m, &parts);
            let mut gatherer = Gatherer::new(settings, k);
            let range = rows.cell(cell);
            for start in range.clone().step_by(BLOCK) {
                let n = BLOCK.min(range.end - start);
                let z = &rows.z[start * m..(start + n) * m];
                stack.log_densities(z, n, &mut logs);
                let weights = &rows.weights[start..start + n];
                normalize(&mut logs, n, &mut totals);
                log_likelihood += totals.iter().zip(weights).map(|(log, w)| log * w).sum::<f64>();
                gatherer.add(z, weights, &mut logs);
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
                gatherer.add(z, &rows.weights[start..start + n], &mut shares);
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
    let (mut logs, mut totals) = (Vec::new(), Vec::new());
    for cell in 0..rows.ends.len() {
        let parts = acting(settings, &mixing.log_weights[cell], mixing.set(cell));
        let mut stack = Stack::new(settings.d, m, &parts);
        let range = rows.cell(cell);
        for start in range.clone().step_by(BLOCK) {
            let n = BLOCK.min(range.end - start);
            stack.log_densities(&rows.z[start * m..(start + n) * m], n, &mut logs);
            normalize(&mut logs, n, &mut totals);
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
