//! Exact sums over the missing numbers of one row: components enumerated, numbers integrated.
//!
//! In information form over the missing numbers x each component of a family is exp(c + ηᵀx − ½ xᵀJx). A combination of
//! components adds them up; its integral is c + ½ ηᵀJ⁻¹η − ½ log|J| + ½ h log 2π, its moments J⁻¹η and J⁻¹. J is
//! regular: a missing number's own family is in the block, and covariances in training are.

use crate::em::Acting;
use crate::gap_plan::GapBlock;
use crate::gaussian::{LOG_TAU, log_sum_exp};

/// Combinations of components that one block of one row may have: a tenth of a second of work.
pub(crate) const MAX_COMBINATIONS: usize = 200_000;
/// Combinations with less than this share add nothing to the moments that f64 would show.
const NEGLIGIBLE: f64 = 1e-15;

/// A component of a family as a function of the missing numbers.
struct Factor {
    constant: f64,
    shift: Vec<f64>,
    precision: Vec<f64>,
}

/// Expected moments of one acting component: Σ r, Σ r x and Σ r x xᵀ.
#[derive(Clone)]
pub(crate) struct Share {
    pub mass: f64,
    pub first: Vec<f64>,
    pub second: Vec<f64>,
}

/// What a block says: its log integral, and for each family and acting component its share.
pub(crate) struct BlockPosterior {
    pub log_integral: f64,
    pub shares: Vec<Vec<Share>>,
}

/// Sums a block. `acting` are the components of each family under the assumed configuration, `z` each family's entries
/// with anything in place of the missing ones. `None` where there are too many combinations.
pub(crate) fn sum_block(block: &GapBlock, acting: &[&[Acting]], z: &[Vec<f64>]) -> Option<BlockPosterior> {
    let h = block.hidden.len();
    let n = acting
        .iter()
        .try_fold(1usize, |n, parts| n.checked_mul(parts.len()))?;
    if n > MAX_COMBINATIONS {
        return None;
    }
    let factors: Vec<Vec<Factor>> = block
        .families
        .iter()
        .zip(acting)
        .zip(z)
        .map(|((family, parts), z)| {
            parts
                .iter()
                .map(|part| factor(part, &family.place, z, h))
                .collect()
        })
        .collect();
    let mut logs = Vec::with_capacity(n);
    let mut work = Work::new(h, factors.len());
    walk(&factors, 0, &mut work, &mut |work| logs.push(work.integrate()));
    let log_integral = log_sum_exp(&logs);
    let none = Share {
        mass: 0.0,
        first: vec![0.0; h],
        second: vec![0.0; h * h],
    };
    let mut shares: Vec<Vec<Share>> = factors
        .iter()
        .map(|parts| vec![none.clone(); parts.len()])
        .collect();
    let mut at = 0;
    walk(&factors, 0, &mut work, &mut |work| {
        let r = (logs[at] - log_integral).exp();
        at += 1;
        if r <= NEGLIGIBLE {
            return;
        }
        work.integrate();
        work.moments();
        for (parts, &c) in shares.iter_mut().zip(&work.choice) {
            let share = &mut parts[c];
            share.mass += r;
            for i in 0..h {
                share.first[i] += r * work.mean[i];
                for j in 0..h {
                    share.second[i * h + j] += r * (work.covariance[i * h + j] + work.mean[i] * work.mean[j]);
                }
            }
        }
    });
    Some(BlockPosterior { log_integral, shares })
}

/// −½ |W z|² + constant as a function of the missing entries of z.
fn factor(part: &Acting, place: &[Option<usize>], z: &[f64], h: usize) -> Factor {
    let d = part.white.nrows();
    let mut known = vec![0.0; d];
    let mut pull = vec![0.0; d * h];
    for (j, (place, value)) in place.iter().zip(z).enumerate() {
        for i in 0..d {
            match place {
                Some(x) => pull[i * h + x] += part.white[(i, j)],
                None => known[i] += part.white[(i, j)] * value,
            }
        }
    }
    let mut out = Factor {
        constant: part.constant - 0.5 * known.iter().map(|a| a * a).sum::<f64>(),
        shift: vec![0.0; h],
        precision: vec![0.0; h * h],
    };
    for i in 0..d {
        let row = &pull[i * h..(i + 1) * h];
        for a in 0..h {
            out.shift[a] -= row[a] * known[i];
            for b in 0..h {
                out.precision[a * h + b] += row[a] * row[b];
            }
        }
    }
    out
}

/// Running sums of the factors, level by level, and room for one Cholesky factorisation.
struct Work {
    h: usize,
    level: usize,
    constants: Vec<f64>,
    shifts: Vec<f64>,
    precisions: Vec<f64>,
    choice: Vec<usize>,
    lower: Vec<f64>,
    mean: Vec<f64>,
    covariance: Vec<f64>,
}

impl Work {
    fn new(h: usize, levels: usize) -> Self {
        Self {
            h,
            level: 0,
            constants: vec![0.0; levels + 1],
            shifts: vec![0.0; (levels + 1) * h],
            precisions: vec![0.0; (levels + 1) * h * h],
            choice: vec![0; levels],
            lower: vec![0.0; h * h],
            mean: vec![0.0; h],
            covariance: vec![0.0; h * h],
        }
    }

    fn push(&mut self, c: usize, factor: &Factor) {
        let (h, level) = (self.h, self.level);
        self.choice[level] = c;
        self.constants[level + 1] = self.constants[level] + factor.constant;
        for i in 0..h {
            self.shifts[(level + 1) * h + i] = self.shifts[level * h + i] + factor.shift[i];
        }
        for i in 0..h * h {
            self.precisions[(level + 1) * h * h + i] =
                self.precisions[level * h * h + i] + factor.precision[i];
        }
        self.level += 1;
    }

    /// The log integral at the current level; leaves the Cholesky factor, and L⁻¹η in `mean`.
    fn integrate(&mut self) -> f64 {
        let (h, level) = (self.h, self.level);
        let precision = &self.precisions[level * h * h..(level + 1) * h * h];
        let shift = &self.shifts[level * h..(level + 1) * h];
        let mut log = self.constants[level] + 0.5 * h as f64 * LOG_TAU;
        for i in 0..h {
            let mut white = shift[i];
            for j in 0..=i {
                let mut sum = precision[i * h + j];
                for k in 0..j {
                    sum -= self.lower[i * h + k] * self.lower[j * h + k];
                }
                if i == j {
                    let root = sum.max(f64::MIN_POSITIVE).sqrt();
                    self.lower[i * h + i] = root;
                    log -= root.ln();
                } else {
                    self.lower[i * h + j] = sum / self.lower[j * h + j];
                    white -= self.lower[i * h + j] * self.mean[j];
                }
            }
            self.mean[i] = white / self.lower[i * h + i];
            log += 0.5 * self.mean[i] * self.mean[i];
        }
        log
    }

    /// Mean and covariance from what [`Work::integrate`] left.
    fn moments(&mut self) {
        let h = self.h;
        // L⁻¹ in place of the covariance, then J⁻¹ = L⁻ᵀ L⁻¹.
        let mut inverse = vec![0.0; h * h];
        for c in 0..h {
            for i in c..h {
                let mut sum = if i == c { 1.0 } else { 0.0 };
                for k in c..i {
                    sum -= self.lower[i * h + k] * inverse[k * h + c];
                }
                inverse[i * h + c] = sum / self.lower[i * h + i];
            }
        }
        let white = self.mean.clone();
        for i in 0..h {
            self.mean[i] = (i..h).map(|k| inverse[k * h + i] * white[k]).sum();
            for j in 0..=i {
                let sum: f64 = (i..h).map(|k| inverse[k * h + i] * inverse[k * h + j]).sum();
                self.covariance[i * h + j] = sum;
                self.covariance[j * h + i] = sum;
            }
        }
    }
}

/// Depth first over one component of each family, always in the same order.
fn walk(factors: &[Vec<Factor>], level: usize, work: &mut Work, leaf: &mut impl FnMut(&mut Work)) {
    if level == factors.len() {
        leaf(work);
        return;
    }
    for (c, factor) in factors[level].iter().enumerate() {
        work.push(c, factor);
        walk(factors, level + 1, work, leaf);
        work.level = level;
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::gap_plan::GapFamily;

    /// x ~ N(1, 4), y = 3 x + e, e ~ N(0, 1), y = 5 seen, x missing.
    #[test]
    fn a_missing_parent_gets_the_textbook_posterior() {
        let block = GapBlock {
            hidden: vec![(0, 0)],
            families: vec![
                GapFamily {
                    node: 0,
                    place: vec![Some(0), None],
                },
                GapFamily {
                    node: 1,
                    place: vec![None, None, Some(0)],
                },
            ],
        };
        let part = |white: &[f64], deviation: f64| Acting {
            component: 0,
            sign: 1.0,
            constant: -0.5 * LOG_TAU - deviation.ln(),
            white: DMatrix::from_row_slice(1, white.len(), white),
        };
        let (x, y) = ([part(&[0.5, -0.5], 2.0)], [part(&[1.0, 0.0, -3.0], 1.0)]);
        let z = [vec![f64::NAN, 1.0], vec![5.0, 1.0, f64::NAN]];
        let posterior = sum_block(&block, &[&x, &y], &z).unwrap();
        // y ~ N(3, 37).
        let expected = -0.5 * (LOG_TAU + 37f64.ln() + 4.0 / 37.0);
        assert!((posterior.log_integral - expected).abs() < 1e-12);
        let (mean, variance) = (1.0 + 12.0 / 37.0 * 2.0, 4.0 - 144.0 / 37.0);
        let share = &posterior.shares[1][0];
        assert!((share.mass - 1.0).abs() < 1e-12);
        assert!((share.first[0] - mean).abs() < 1e-12);
        assert!((share.second[0] - variance - mean * mean).abs() < 1e-12);
    }
}
