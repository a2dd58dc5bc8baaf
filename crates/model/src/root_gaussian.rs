//! A Gaussian as mean and square root: x = mean + root e, e standard normal.
//!
//! Conditioning is one orthogonal transformation of the root (an array algorithm), so that small variances beside large
//! ones, exact observations and singular covariances lose no digits. The mean is a matrix: one column per entry of a
//! row of evidence, and one for the constant, so that what is compiled for many rows and what is worked out for one
//! (a single column) are the same code.

use nalgebra::{DMatrix, DVector};

use crate::gaussian::LOG_TAU;

/// A standard deviation below this share of what the prior gave counts as zero: orthogonal transformations of a few
/// dozen columns leave less than 1e-14.
const RELATIVE_DEVIATION: f64 = 1e-13;

/// A Gaussian over n values. Its covariance root · rootᵀ may be singular.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RootGaussian {
    /// n × columns of the affine function.
    pub mean: DMatrix<f64>,
    /// n × any.
    pub root: DMatrix<f64>,
    /// Standard deviation of each value before any conditioning: the unit of what is negligible.
    scale: Vec<f64>,
}

/// log density = constant − ½ |white · [row, 1]|².
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Density {
    pub constant: f64,
    pub white: DMatrix<f64>,
}

impl RootGaussian {
    /// The Gaussian over nothing, whose means will have so many columns.
    pub fn empty(columns: usize) -> Self {
        Self {
            mean: DMatrix::zeros(0, columns),
            root: DMatrix::zeros(0, 0),
            scale: Vec::new(),
        }
    }

    pub fn dim(&self) -> usize {
        self.mean.nrows()
    }

    /// Appends y = `offset` + `coefficients` x + `noise` e to the x that this Gaussian is over.
    pub fn append(&self, offset: &DMatrix<f64>, coefficients: &DMatrix<f64>, noise: &DMatrix<f64>) -> Self {
        let (n, d) = (self.dim(), offset.nrows());
        let (old, new) = (self.root.ncols(), noise.ncols());
        let mut mean = DMatrix::zeros(n + d, self.mean.ncols());
        mean.rows_mut(0, n).copy_from(&self.mean);
        mean.rows_mut(n, d)
            .copy_from(&(offset + coefficients * &self.mean));
        let mut root = DMatrix::zeros(n + d, old + new);
        root.view_mut((0, 0), (n, old)).copy_from(&self.root);
        root.view_mut((n, 0), (d, old))
            .copy_from(&(coefficients * &self.root));
        root.view_mut((n, old), (d, new)).copy_from(noise);
        let mut scale = self.scale.clone();
        scale.extend((0..d).map(|i| self.deviation(coefficients, noise, i)));
        Self { mean, root, scale }
    }

    /// Conditions on `residual` = `coefficients` x + `noise` e. Returns the density of what was observed and the
    /// Gaussian over x afterwards; `None` where there is no density.
    pub fn condition(
        &self,
        residual: &DMatrix<f64>,
        coefficients: &DMatrix<f64>,
        noise: &DMatrix<f64>,
    ) -> Option<(Density, Self)> {
        let (n, d) = (self.dim(), residual.nrows());
        let (old, new) = (self.root.ncols(), noise.ncols());
        // [noise, coefficients · root; 0, root] times an orthogonal matrix = [L, 0; gain, what is left].
        let mut array = DMatrix::zeros(d + n, new + old);
        array.view_mut((0, 0), (d, new)).copy_from(noise);
        array
            .view_mut((0, new), (d, old))
            .copy_from(&(coefficients * &self.root));
        array.view_mut((d, new), (n, old)).copy_from(&self.root);
        if new + old < d {
            return None;
        }
        triangularize(&mut array, d);
        let mut white = residual - coefficients * &self.mean;
        let mut constant = -0.5 * d as f64 * LOG_TAU;
        for i in 0..d {
            let pivot = array[(i, i)];
            let scale = self.deviation(coefficients, noise, i);
            if pivot.abs() <= RELATIVE_DEVIATION * scale || pivot.is_nan() {
                return None;
            }
            constant -= pivot.abs().ln();
            for c in 0..white.ncols() {
                let mut sum = white[(i, c)];
                for k in 0..i {
                    sum -= array[(i, k)] * white[(k, c)];
                }
                white[(i, c)] = sum / pivot;
            }
        }
        let mean = &self.mean + array.view((d, 0), (n, d)) * &white;
        let root = array.view((d, d), (n, new + old - d)).into_owned();
        let after = Self {
            mean,
            root,
            scale: self.scale.clone(),
        };
        Some((Density { constant, white }, after))
    }

    /// Sets a value that was observed exactly, where rounding left it a hair beside.
    pub fn pin(&mut self, i: usize, value: &DMatrix<f64>, row: usize) {
        self.mean.row_mut(i).copy_from(&value.row(row));
        self.root.row_mut(i).fill(0.0);
    }

    /// Standard deviation of coefficients · x + noise · e, row i, under the prior of x.
    fn deviation(&self, coefficients: &DMatrix<f64>, noise: &DMatrix<f64>, i: usize) -> f64 {
        let pulled = (0..coefficients.ncols()).map(|j| coefficients[(i, j)] * self.scale[j]);
        let own = (0..noise.ncols()).map(|j| noise[(i, j)]);
        pulled.chain(own).map(|v| v * v).sum::<f64>().sqrt()
    }

    /// The marginal over the given values, in the given order.
    pub fn marginal(&self, dims: &[usize]) -> Self {
        Self {
            mean: self.mean.select_rows(dims),
            root: self.root.select_rows(dims),
            scale: dims.iter().map(|&i| self.scale[i]).collect(),
        }
    }

    /// Makes the root as narrow as it can be.
    pub fn compress(&mut self) {
        let d = self.dim();
        if self.root.ncols() > d {
            triangularize(&mut self.root, d);
            self.root = self.root.columns(0, d).into_owned();
        }
    }

    /// This Gaussian and another, independent of it, side by side.
    pub fn beside(&self, other: &Self) -> Self {
        let (n, m) = (self.dim(), other.dim());
        let (a, b) = (self.root.ncols(), other.root.ncols());
        let mut mean = DMatrix::zeros(n + m, self.mean.ncols());
        mean.rows_mut(0, n).copy_from(&self.mean);
        mean.rows_mut(n, m).copy_from(&other.mean);
        let mut root = DMatrix::zeros(n + m, a + b);
        root.view_mut((0, 0), (n, a)).copy_from(&self.root);
        root.view_mut((n, a), (m, b)).copy_from(&other.root);
        let scale = [&self.scale[..], &other.scale[..]].concat();
        Self { mean, root, scale }
    }
}

/// log of the highest density of a Gaussian with this root (rows: dimensions); +∞ where it is singular.
pub(crate) fn log_peak(root: &DMatrix<f64>) -> f64 {
    let d = root.nrows();
    let flat = RootGaussian::empty(1);
    flat.condition(&DMatrix::zeros(d, 1), &DMatrix::zeros(d, 0), root)
        .map_or(f64::INFINITY, |(density, _)| density.constant)
}

/// A lower triangular root of the same covariance; `None` where it is singular.
pub(crate) fn triangular_root(root: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let d = root.nrows();
    if root.ncols() < d {
        return None;
    }
    let norms: Vec<f64> = root.row_iter().map(|row| row.norm()).collect();
    let mut array = root.clone();
    triangularize(&mut array, d);
    let mut lower = array.columns(0, d).into_owned();
    for j in 0..d {
        if lower[(j, j)].abs() <= RELATIVE_DEVIATION * norms[j] || lower[(j, j)].is_nan() {
            return None;
        }
        if lower[(j, j)] < 0.0 {
            lower.column_mut(j).neg_mut();
        }
    }
    Some(lower)
}

/// Root · rootᵀ, exactly symmetric.
pub(crate) fn covariance_of(root: &DMatrix<f64>) -> DMatrix<f64> {
    let n = root.nrows();
    let mut covariance = DMatrix::zeros(n, n);
    for i in 0..n {
        for j in 0..=i {
            let value = root.row(i).dot(&root.row(j));
            covariance[(i, j)] = value;
            covariance[(j, i)] = value;
        }
    }
    covariance
}

/// Householder reflections from the right that leave the first `d` rows lower triangular.
fn triangularize(array: &mut DMatrix<f64>, d: usize) {
    let columns = array.ncols();
    for i in 0..d {
        let row: DVector<f64> = DVector::from_iterator(columns - i, (i..columns).map(|j| array[(i, j)]));
        let norm = row.norm();
        if norm == 0.0 {
            continue;
        }
        let mut v = row;
        v[0] += if v[0] < 0.0 { -norm } else { norm };
        let factor = 2.0 / v.norm_squared();
        if !factor.is_finite() {
            // The row is below the square root of the smallest number: zero for all that can be told.
            continue;
        }
        for r in i..array.nrows() {
            let mut dot = 0.0;
            for (j, v) in v.iter().enumerate() {
                dot += array[(r, i + j)] * v;
            }
            dot *= factor;
            for (j, v) in v.iter().enumerate() {
                array[(r, i + j)] -= dot * v;
            }
        }
        for j in i + 1..columns {
            array[(i, j)] = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(value: f64) -> DMatrix<f64> {
        DMatrix::from_element(1, 1, value)
    }

    #[test]
    fn conditioning_a_pair_is_the_textbook_formula() {
        let x = RootGaussian::empty(1).append(&one(1.0), &DMatrix::zeros(1, 0), &one(2.0));
        // y = 2 + 3 x + e, e ~ N(0, 1): y ~ N(5, 37); y = 6.
        let (density, after) = x.condition(&one(4.0), &one(3.0), &one(1.0)).unwrap();
        let log_density = density.constant - 0.5 * density.white.norm_squared();
        assert!((log_density + 0.5 * (LOG_TAU + 37f64.ln() + 1.0 / 37.0)).abs() < 1e-14);
        assert!((after.mean[0] - (1.0 + 12.0 / 37.0)).abs() < 1e-14);
        assert!((covariance_of(&after.root)[0] - (4.0 - 144.0 / 37.0)).abs() < 1e-14);
    }

    #[test]
    fn a_sharp_observation_of_a_wide_value_keeps_its_digits() {
        let x = RootGaussian::empty(1).append(&one(0.0), &DMatrix::zeros(1, 0), &one(1.0));
        let (_, after) = x.condition(&one(0.5), &one(1.0), &one(1e-7)).unwrap();
        // 1 / (1 + 1e14); the subtraction of covariances would leave two digits of it.
        assert!((covariance_of(&after.root)[0] * (1.0 + 1e14) - 1.0).abs() < 1e-8);
    }

    #[test]
    fn what_is_known_exactly_has_no_density_left() {
        let x = RootGaussian::empty(1).append(&one(0.0), &DMatrix::zeros(1, 0), &one(1.0));
        let nothing = DMatrix::zeros(1, 0);
        let (_, after) = x.condition(&one(0.5), &one(1.0), &nothing).unwrap();
        assert!(after.condition(&one(0.5), &one(1.0), &nothing).is_none());
        assert_eq!(log_peak(&nothing), f64::INFINITY);
    }

    #[test]
    fn a_triangular_root_has_the_same_covariance() {
        let root = DMatrix::from_row_slice(2, 3, &[1.0, 2.0, -1.0, 0.5, 0.0, 3.0]);
        let lower = triangular_root(&root).unwrap();
        assert!((covariance_of(&lower) - covariance_of(&root)).norm() < 1e-14);
        assert_eq!(lower[(0, 1)], 0.0);
    }
}
