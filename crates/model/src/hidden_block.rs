//! Hidden continuous nodes of one configuration, eliminated in information form.

use nalgebra::DMatrix;

use crate::gaussian::log_sum_exp;

/// Terms this far below the largest one are left out, in nats: e⁻⁴⁵ = 3e-20, and a block has fewer than 1e7 terms, so
/// at most 3e-13 of the result goes missing.
const NEGLIGIBLE: f64 = 45.0;
/// Most hidden dimensions in information form.
pub(crate) const MAX_HIDDEN: usize = 8;

/// A component that reads the row only: log weight − ½ |R [row, 1]|².
pub(crate) struct Part {
    pub constant: f64,
    /// d × (row + 1), white.
    pub reader: Dense,
}

/// One configuration of the nodes of a hidden block.
pub(crate) struct HiddenBlock {
    pub h: usize,
    pub combinations: Vec<Prior>,
    /// Per observed child: its components.
    pub children: Vec<Vec<Child>>,
}

/// Gaussian over z of one combination of the hidden nodes' components.
pub(crate) struct Prior {
    pub log_weight: f64,
    /// h × (row + 1): the mean.
    pub mean: Dense,
    /// h × h, row by row.
    pub precision: Vec<f64>,
    pub half_log_determinant: f64,
}

/// A component of an observed child: log weight − ½ |R [row, 1] − G z|².
pub(crate) struct Child {
    pub constant: f64,
    pub reader: Dense,
    /// d × h.
    pub pull: Dense,
    /// GᵀG, h × h.
    pub precision: Vec<f64>,
    /// What no z explains: the projection of R beside the columns of G.
    pub beside: Dense,
}

/// A matrix, row by row, with the columns that are all zero left out of the products.
pub(crate) struct Dense {
    pub rows: usize,
    pub used: Vec<usize>,
    pub values: Vec<f64>,
}
impl Dense {
    pub fn new(matrix: &DMatrix<f64>) -> Self {
        let used: Vec<usize> = (0..matrix.ncols())
            .filter(|&j| matrix.column(j).iter().any(|value| *value != 0.0))
            .collect();
        let values = matrix
            .row_iter()
            .flat_map(|row| used.iter().map(|&j| row[j]).collect::<Vec<_>>())
            .collect();
        Self {
            rows: matrix.nrows(),
            used,
            values,
        }
    }

    /// One entry of the product with [row, 1].
    pub fn entry(&self, i: usize, row: &[f64]) -> f64 {
        let width = self.used.len();
        let mut sum = 0.0;
        for (value, &j) in self.values[i * width..(i + 1) * width].iter().zip(&self.used) {
            sum += value * row.get(j).copied().unwrap_or(1.0);
        }
        sum
    }

    pub fn norm_squared(&self, row: &[f64]) -> f64 {
        (0..self.rows).map(|i| self.entry(i, row).powi(2)).sum()
    }
}
impl HiddenBlock {
    /// log ∫ p(z) Π p(child | z) dz, all components summed.
    pub fn log_integral(
        &self,
        row: &[f64],
        terms: &mut Vec<f64>,
        bases: &mut Vec<Vec<Vec<f64>>>,
        peaks: &mut Vec<Vec<f64>>,
    ) -> f64 {
        bases.clear();
        peaks.clear();
        for child in &self.children {
            bases.push(
                child
                    .iter()
                    .map(|c| (0..c.reader.rows).map(|i| c.reader.entry(i, row)).collect())
                    .collect(),
            );
            peaks.push(
                child
                    .iter()
                    .map(|c| c.constant - 0.5 * c.beside.norm_squared(row))
                    .collect(),
            );
        }
        let mut rest = vec![0.0; self.children.len() + 1];
        for j in (0..self.children.len()).rev() {
            rest[j] = rest[j + 1] + log_sum_exp(&peaks[j]);
        }
        let orders: Vec<Vec<usize>> = peaks
            .iter()
            .map(|peaks| {
                let mut order: Vec<usize> = (0..peaks.len()).collect();
                order.sort_by(|&a, &b| peaks[b].total_cmp(&peaks[a]));
                order
            })
            .collect();
        terms.clear();
        let mut walk = Walk {
            block: self,
            bases,
            peaks,
            rest: &rest,
            orders: &orders,
            terms,
            largest: f64::NEG_INFINITY,
        };
        for prior in &self.combinations {
            let mut mean = [0.0; MAX_HIDDEN];
            for (i, mean) in mean.iter_mut().enumerate().take(self.h) {
                *mean = prior.mean.entry(i, row);
            }
            let mut precision = [0.0; MAX_HIDDEN * MAX_HIDDEN];
            precision[..self.h * self.h].copy_from_slice(&prior.precision);
            let state = State {
                constant: prior.log_weight + prior.half_log_determinant,
                precision,
                vector: [0.0; MAX_HIDDEN],
            };
            walk.visit(0, &state, prior.log_weight, &mean);
        }
        log_sum_exp(walk.terms)
    }
}

/// A quadratic in e = z − mean: constant + vectorᵀ e − ½ eᵀ precision e.
struct State {
    constant: f64,
    precision: [f64; MAX_HIDDEN * MAX_HIDDEN],
    vector: [f64; MAX_HIDDEN],
}

struct Walk<'a> {
    block: &'a HiddenBlock,
    bases: &'a [Vec<Vec<f64>>],
    peaks: &'a [Vec<f64>],
    rest: &'a [f64],
    orders: &'a [Vec<usize>],
    terms: &'a mut Vec<f64>,
    largest: f64,
}

impl Walk<'_> {
    /// `value` is the logarithm of the integral of `state`.
    fn visit(&mut self, depth: usize, state: &State, value: f64, mean: &[f64; MAX_HIDDEN]) {
        if depth == self.block.children.len() {
            self.largest = self.largest.max(value);
            self.terms.push(value);
            return;
        }
        let h = self.block.h;
        for &c in &self.orders[depth] {
            if value + self.peaks[depth][c] + self.rest[depth + 1] < self.largest - NEGLIGIBLE {
                // Later components have lower peaks still.
                break;
            }
            let child = &self.block.children[depth][c];
            let mut next = State {
                constant: state.constant + child.constant,
                ..*state
            };
            for (i, base) in self.bases[depth][c].iter().enumerate() {
                let pull = &child.pull.values[i * h..(i + 1) * h];
                let mut residual = *base;
                for (g, m) in pull.iter().zip(mean) {
                    residual -= g * m;
                }
                next.constant -= 0.5 * residual * residual;
                for (sum, g) in next.vector.iter_mut().zip(pull) {
                    *sum += g * residual;
                }
            }
            for (sum, g) in next.precision[..h * h].iter_mut().zip(&child.precision) {
                *sum += g;
            }
            let value = next.log_integral(h);
            if value + self.rest[depth + 1] >= self.largest - NEGLIGIBLE {
                self.visit(depth + 1, &next, value, mean);
            }
        }
    }
}

impl State {
    /// constant + ½ vᵀ Λ⁻¹ v − ½ log|Λ|: the (2π)^(h/2) cancels against the prior's.
    fn log_integral(&self, h: usize) -> f64 {
        let mut lower = [0.0; MAX_HIDDEN * MAX_HIDDEN];
        let mut white = [0.0; MAX_HIDDEN];
        let mut value = self.constant;
        let mut pivots = 1.0;
        for i in 0..h {
            for j in 0..=i {
                let mut sum = self.precision[i * h + j];
                for k in 0..j {
                    sum -= lower[i * h + k] * lower[j * h + k];
                }
                lower[i * h + j] = if i == j {
                    sum.sqrt()
                } else {
                    sum / lower[j * h + j]
                };
            }
            let mut sum = self.vector[i];
            for k in 0..i {
                sum -= lower[i * h + k] * white[k];
            }
            white[i] = sum / lower[i * h + i];
            value += 0.5 * white[i] * white[i];
            pivots *= lower[i * h + i];
        }
        value - pivots.ln()
    }
}
