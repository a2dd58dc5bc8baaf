//! Weighted linear regression with a small ridge.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Added to the diagonal of the standardised normal equations, as a share of the total weight: enough to settle features
/// that say the same thing, too little to move those that do not.
const RIDGE: f64 = 1e-3;

/// Rounds of reweighting; the slopes settle in about ten.
const ROUNDS: usize = 12;

/// Errors beyond this many robust standard deviations pull with a constant force (Huber).
const HUBER: f64 = 0.5;

/// `intercept + Σ slopes · features`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Ridge {
    intercept: f64,
    slopes: Vec<f64>,
}

impl Ridge {
    /// Least weighted squares; features without spread get a slope of 0.
    pub fn fit(
        rows: impl Iterator<Item = Vec<f64>>,
        targets: impl Iterator<Item = f64>,
        weights: &[f64],
    ) -> Self {
        let rows: Vec<Vec<f64>> = rows.collect();
        let y = DVector::from_iterator(rows.len(), targets);
        let dim = rows.first().map_or(0, Vec::len);
        let total: f64 = weights.iter().sum();
        let mean_of = |f: &dyn Fn(usize) -> f64| -> f64 {
            (0..rows.len()).map(|i| weights[i] * f(i)).sum::<f64>() / total
        };
        let mean_y = mean_of(&|i| y[i]);
        let mean_x: Vec<f64> = (0..dim).map(|k| mean_of(&|i| rows[i][k])).collect();
        let sd: Vec<f64> = (0..dim)
            .map(|k| mean_of(&|i| (rows[i][k] - mean_x[k]).powi(2)).sqrt())
            .collect();
        let standard = |row: &[f64], k: usize| {
            if sd[k] > 1e-12 {
                (row[k] - mean_x[k]) / sd[k]
            } else {
                0.0
            }
        };
        let x = DMatrix::from_fn(rows.len(), dim, |i, k| weights[i].sqrt() * standard(&rows[i], k));
        let b = DVector::from_fn(rows.len(), |i, _| weights[i].sqrt() * (y[i] - mean_y));
        let normal = x.transpose() * &x + DMatrix::identity(dim, dim) * (RIDGE * total);
        let slopes: Vec<f64> = match normal.cholesky() {
            Some(factor) => {
                let standardised = factor.solve(&(x.transpose() * b));
                (0..dim)
                    .map(|k| {
                        if sd[k] > 1e-12 {
                            standardised[k] / sd[k]
                        } else {
                            0.0
                        }
                    })
                    .collect()
            }
            None => vec![0.0; dim],
        };
        let intercept = mean_y - slopes.iter().zip(&mean_x).map(|(s, m)| s * m).sum::<f64>();
        Self { intercept, slopes }
    }

    /// Huber's regression by reweighting: between least squares and least absolute deviations, so that the few views that
    /// hide a whole handle do not bend the line for the others.
    pub fn fit_robust(
        rows: impl Iterator<Item = Vec<f64>>,
        targets: impl Iterator<Item = f64>,
        weights: &[f64],
    ) -> Self {
        let rows: Vec<Vec<f64>> = rows.collect();
        let y: Vec<f64> = targets.collect();
        let fit = |w: &[f64]| Self::fit(rows.iter().cloned(), y.iter().copied(), w);
        let mut line = fit(weights);
        for _ in 0..ROUNDS {
            let errors: Vec<f64> = rows
                .iter()
                .zip(&y)
                .map(|(x, y)| (y - line.predict(x)).abs())
                .collect();
            let mut sorted = errors.clone();
            sorted.sort_by(f64::total_cmp);
            // 1.4826 times the median of |e| is the standard deviation of a normal e.
            let deviation = 1.4826 * sorted.get(sorted.len() / 2).copied().unwrap_or(0.0) + 1e-4;
            let reweighted: Vec<f64> = weights
                .iter()
                .zip(&errors)
                .map(|(w, e)| w * (HUBER * deviation / e.max(1e-9)).min(1.0))
                .collect();
            line = fit(&reweighted);
        }
        line
    }

    pub fn predict(&self, features: &[f64]) -> f64 {
        self.intercept + self.slopes.iter().zip(features).map(|(s, f)| s * f).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_comes_back_and_a_constant_feature_has_no_slope() {
        let rows = (0..40).map(|i| vec![f64::from(i), 7.0]);
        let line = Ridge::fit(rows, (0..40).map(|i| 3.0 - 0.5 * f64::from(i)), &[1.0; 40]);
        assert!((line.predict(&[10.0, 7.0]) + 2.0).abs() < 0.02, "{line:?}");
        assert_eq!(line.slopes[1], 0.0);
    }

    #[test]
    fn one_row_far_off_hardly_moves_the_robust_line() {
        let rows = || (0..20).map(|i| vec![f64::from(i)]);
        let y = || (0..20).map(|i| if i == 19 { 500.0 } else { f64::from(i) });
        let plain = Ridge::fit(rows(), y(), &[1.0; 20]).predict(&[0.0]);
        let robust = Ridge::fit_robust(rows(), y(), &[1.0; 20]).predict(&[0.0]);
        assert!(plain.abs() > 10.0 && robust.abs() < 0.2, "{plain} {robust}");
    }

    #[test]
    fn a_weight_of_two_is_the_row_twice() {
        let x = [0.0, 1.0, 2.0, 5.0];
        let y = [0.1, 0.9, 2.3, 4.0];
        let weighted = Ridge::fit(
            x.iter().map(|v| vec![*v]),
            y.iter().copied(),
            &[1.0, 2.0, 1.0, 1.0],
        );
        let repeated = [0, 1, 1, 2, 3];
        let doubled = Ridge::fit(
            repeated.iter().map(|&i| vec![x[i]]),
            repeated.iter().map(|&i| y[i]),
            &[1.0; 5],
        );
        assert!((weighted.predict(&[3.0]) - doubled.predict(&[3.0])).abs() < 1e-12);
    }
}
