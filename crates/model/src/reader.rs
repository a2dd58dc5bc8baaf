//! Sums that are worked out for every row: |R [row, 1]|², and log Σ exp as terms come in.

use nalgebra::DMatrix;

/// exp(−45) = 3e-20 is lost in the last digit of a sum that is at least 1.
const NEGLIGIBLE: f64 = 45.0;

/// A matrix applied to [row, 1], row by row; entries left of the first and right of the last that is not zero are
/// skipped.
pub(crate) struct Reader {
    rows: Vec<(usize, usize, usize)>,
    values: Vec<f64>,
}

impl Reader {
    pub fn new(matrix: &DMatrix<f64>) -> Self {
        let mut rows = Vec::with_capacity(matrix.nrows());
        let mut values = Vec::new();
        for row in matrix.row_iter() {
            let first = row.iter().position(|v| *v != 0.0).unwrap_or(0);
            let end = row.iter().rposition(|v| *v != 0.0).map_or(first, |last| last + 1);
            rows.push((first, values.len(), end - first));
            values.extend(row.iter().skip(first).take(end - first));
        }
        Self { rows, values }
    }

    /// |R x|²; x ends with 1.
    pub fn norm_squared(&self, x: &[f64]) -> f64 {
        let mut square = 0.0;
        for &(column, start, n) in &self.rows {
            let mut sum = 0.0;
            for (value, x) in self.values[start..start + n].iter().zip(&x[column..column + n]) {
                sum += value * x;
            }
            square += sum * sum;
        }
        square
    }
}

/// log Σ exp of terms that come one by one.
pub(crate) struct LogSum {
    largest: f64,
    sum: f64,
}

impl Default for LogSum {
    fn default() -> Self {
        Self {
            largest: f64::NEG_INFINITY,
            sum: 0.0,
        }
    }
}

impl LogSum {
    pub fn add(&mut self, log: f64) {
        if log > self.largest {
            // Of nothing so far, exp(−∞) = 0 is left.
            self.sum = 1.0 + self.sum * (self.largest - log).exp();
            self.largest = log;
        } else if log > self.largest - NEGLIGIBLE {
            self.sum += (log - self.largest).exp();
        }
    }

    pub fn largest(&self) -> f64 {
        self.largest
    }

    pub fn value(&self) -> f64 {
        if self.sum > 0.0 {
            self.largest + self.sum.ln()
        } else {
            f64::NEG_INFINITY
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gaussian::log_sum_exp;

    #[test]
    fn a_running_sum_is_the_sum() {
        let logs = [f64::NEG_INFINITY, -3.0, 2.0, -1000.0, 2.0, 1.5];
        let mut sum = LogSum::default();
        for log in logs {
            sum.add(log);
        }
        assert!((sum.value() - log_sum_exp(&logs)).abs() < 1e-14);
        assert_eq!(LogSum::default().value(), f64::NEG_INFINITY);
    }
}
