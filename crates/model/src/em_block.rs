//! EM's work on a block of rows: log densities, shares, moments.
//!
//! The two products of a block go through faer; between them all loops run over the rows of the block, as many at once as
//! the processor's registers hold (pulp looks which it has).

use faer::{Accum, MatMut, MatRef, Par, linalg::matmul::matmul};
use nalgebra::DMatrix;
use pulp::{Arch, Simd, WithSimd};

use crate::em::Acting;
use crate::exponential::{exp_below_zero, ln_above_one};
use crate::moments::{Moment, Settings};

/// Rows of a block: white residuals and products of 256 rows fit into the second-level cache.
pub(crate) const BLOCK: usize = 256;

/// Stacked white maps of several acting components, and the buffer for their residuals.
pub(crate) struct Stack {
    d: usize,
    m: usize,
    /// m × (d · components): one column for each dimension of each component.
    maps: Vec<f64>,
    constants: Vec<f64>,
    residuals: Vec<f64>,
    arch: Arch,
}

impl Stack {
    pub fn new(d: usize, m: usize, acting: &[Acting]) -> Self {
        let maps = acting
            .iter()
            .flat_map(|part| (0..d).flat_map(move |i| (0..m).map(move |j| part.white[(i, j)])));
        Self {
            d,
            m,
            maps: maps.collect(),
            constants: acting.iter().map(|part| part.constant).collect(),
            residuals: vec![0.0; d * acting.len() * BLOCK],
            arch: Arch::new(),
        }
    }

    /// Each row's share of the components, and the logarithm of their sum: all rows under the first component, under the
    /// second …
    pub fn shares(&mut self, z: &[f64], n: usize, shares: &mut Vec<f64>, totals: &mut Vec<f64>) {
        let columns = self.d * self.constants.len();
        matmul(
            MatMut::from_column_major_slice_mut(&mut self.residuals[..n * columns], n, columns),
            Accum::Replace,
            MatRef::from_row_major_slice(z, n, self.m),
            MatRef::from_column_major_slice(&self.maps, self.m, columns),
            1.0,
            Par::Seq,
        );
        shares.resize(n * self.constants.len(), 0.0);
        totals.resize(n, 0.0);
        self.arch.dispatch(Shares {
            residuals: &self.residuals[..n * columns],
            constants: &self.constants,
            parts: shares,
            totals,
        });
    }
}

/// Squares of residuals become log densities, these become shares of each row's sum.
struct Shares<'a> {
    residuals: &'a [f64],
    constants: &'a [f64],
    /// Of each component.
    parts: &'a mut [f64],
    totals: &'a mut [f64],
}

impl WithSimd for Shares<'_> {
    type Output = ();

    #[inline(always)]
    #[expect(
        clippy::inline_always,
        reason = "part of a loop with the processor's instructions"
    )]
    fn with_simd<S: Simd>(self, _: S) {
        let (shares, totals) = (self.parts, self.totals);
        let n = totals.len();
        totals.fill(f64::NEG_INFINITY);
        let of_component = self.residuals.len() / self.constants.len();
        let parts = shares.chunks_exact_mut(n);
        let residuals = self.residuals.chunks_exact(of_component);
        for ((constant, part), residuals) in self.constants.iter().zip(parts).zip(residuals) {
            part.fill(*constant);
            for dimension in residuals.chunks_exact(n) {
                for (log, residual) in part.iter_mut().zip(dimension) {
                    *log -= 0.5 * residual * residual;
                }
            }
            for (total, log) in totals.iter_mut().zip(part) {
                *total = if *log > *total { *log } else { *total };
            }
        }
        let mut sums = [0.0; BLOCK];
        for part in shares.chunks_exact_mut(n) {
            for ((log, total), sum) in part.iter_mut().zip(totals.iter()).zip(&mut sums) {
                *log = exp_below_zero::<S>(*log - total);
                *sum += *log;
            }
        }
        let mut inverse = [0.0; BLOCK];
        for (inverse, sum) in inverse.iter_mut().zip(&sums[..n]) {
            *inverse = 1.0 / sum;
        }
        for part in shares.chunks_exact_mut(n) {
            for (share, inverse) in part.iter_mut().zip(&inverse) {
                *share *= inverse;
            }
        }
        // No component reaches a row: all have the same share of it.
        if totals.contains(&f64::NEG_INFINITY) {
            let equal = 1.0 / self.constants.len() as f64;
            for part in shares.chunks_exact_mut(n) {
                for (share, total) in part.iter_mut().zip(totals.iter()) {
                    *share = if *total == f64::NEG_INFINITY {
                        equal
                    } else {
                        *share
                    };
                }
            }
        }
        for (total, sum) in totals.iter_mut().zip(&sums) {
            let ln = ln_above_one::<S>(*sum);
            *total += if *total == f64::NEG_INFINITY { 0.0 } else { ln };
        }
    }
}

/// Sums shares times z zᵀ, block by block.
pub(crate) struct Gatherer {
    d: usize,
    m: usize,
    n_components: usize,
    latent_sign: bool,
    products: Vec<f64>,
    signed: Vec<f64>,
    packed: Vec<f64>,
    packed_signed: Vec<f64>,
    arch: Arch,
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
            products: Vec::new(),
            signed: vec![0.0; both * n_components * BLOCK],
            packed: vec![0.0; t * n_components],
            packed_signed: vec![0.0; both * t * n_components],
            arch: Arch::new(),
        }
    }

    /// One block of rows. `kept` are their [`products`] where they are known. `shares` has those of all rows for the first
    /// component, for the second …, and with a latent sign those of −y after them; it becomes shares times weights.
    pub fn add(&mut self, z: &[f64], kept: Option<&[f64]>, weights: &[f64], shares: &mut [f64]) {
        let (n, k) = (weights.len(), self.n_components);
        let t = self.m * (self.m + 1) / 2;
        if kept.is_none() {
            self.products.clear();
            products(z, self.m, &mut self.products);
        }
        let products = kept.unwrap_or(&self.products);
        self.arch.dispatch(Weigh {
            weights,
            shares,
            signed: &mut self.signed,
        });
        let gather = |packed: &mut [f64], shares: &[f64]| {
            matmul(
                MatMut::from_column_major_slice_mut(packed, t, k),
                Accum::Add,
                MatRef::from_column_major_slice(products, t, n),
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

    pub fn finish(self) -> Vec<Moment> {
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
                // z[d] is 1.
                let mass = product[(self.d, self.d)];
                Moment { mass, product }
            })
            .collect()
    }
}

/// Appends the upper triangle of z zᵀ, row after row, of each row.
pub(crate) fn products(z: &[f64], m: usize, out: &mut Vec<f64>) {
    for row in z.chunks_exact(m) {
        for (i, scale) in row.iter().enumerate() {
            out.extend(row[i..].iter().map(|other| scale * other));
        }
    }
}

/// Shares times weights; with a latent sign the shares of y and −y become their sum, and `signed` their difference.
struct Weigh<'a> {
    weights: &'a [f64],
    shares: &'a mut [f64],
    signed: &'a mut [f64],
}

impl WithSimd for Weigh<'_> {
    type Output = ();

    #[inline(always)]
    #[expect(
        clippy::inline_always,
        reason = "part of a loop with the processor's instructions"
    )]
    fn with_simd<S: Simd>(self, _: S) {
        for part in self.shares.chunks_exact_mut(self.weights.len()) {
            for (share, weight) in part.iter_mut().zip(self.weights) {
                *share *= weight;
            }
        }
        if !self.signed.is_empty() {
            let (plus, minus) = self.shares.split_at_mut(self.shares.len() / 2);
            for ((signed, plus), minus) in self.signed.iter_mut().zip(plus).zip(minus) {
                *signed = *plus - *minus;
                *plus += *minus;
            }
        }
    }
}
