//! Sums that are worked out for every row: |R [row, 1]|², and log Σ exp as terms come in.

use nalgebra::DMatrix;

/// exp(−45) = 3e-20 is lost in the last digit of a sum that is at least 1.
const NEGLIGIBLE: f64 = 45.0;

/// Rows that are worked out together: as many sums run beside each other.
const LANES: usize = 4;

/// Matrices that are applied to [row, 1], one behind the other in memory.
#[derive(Default)]
pub(crate) struct Readers {
    /// Columns that are not zero.
    columns: Vec<usize>,
    /// For every block of four rows and every such column four entries, zeros where the matrix has fewer rows.
    values: Vec<f64>,
}

/// One of the matrices.
#[derive(Clone, Copy)]
pub(crate) struct Reader {
    first_column: usize,
    n_columns: usize,
    first_value: usize,
    n_blocks: usize,
}

impl Readers {
    pub fn push(&mut self, matrix: &DMatrix<f64>) -> Reader {
        let reader = Reader {
            first_column: self.columns.len(),
            first_value: self.values.len(),
            n_columns: 0,
            n_blocks: matrix.nrows().div_ceil(LANES),
        };
        let used = |j: &usize| matrix.column(*j).iter().any(|v| *v != 0.0);
        self.columns.extend((0..matrix.ncols()).filter(used));
        let columns = &self.columns[reader.first_column..];
        for block in 0..reader.n_blocks {
            for &j in columns {
                let entry = |i: usize| matrix.get((i, j)).copied().unwrap_or(0.0);
                self.values
                    .extend((0..LANES).map(|lane| entry(block * LANES + lane)));
            }
        }
        Reader {
            n_columns: columns.len(),
            ..reader
        }
    }

    /// |R x|²; x ends with 1.
    pub fn norm_squared(&self, reader: Reader, x: &[f64]) -> f64 {
        let columns = &self.columns[reader.first_column..reader.first_column + reader.n_columns];
        let mut square = 0.0;
        let mut start = reader.first_value;
        for _ in 0..reader.n_blocks {
            let end = start + LANES * columns.len();
            let mut sums = [0.0; LANES];
            for (&j, values) in columns.iter().zip(self.values[start..end].chunks_exact(LANES)) {
                let x = x[j];
                for (sum, value) in sums.iter_mut().zip(values) {
                    *sum += value * x;
                }
            }
            square += (sums[0] * sums[0] + sums[1] * sums[1]) + (sums[2] * sums[2] + sums[3] * sums[3]);
            start = end;
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
    fn a_reader_gives_the_squared_norm_of_the_product() {
        let matrix = DMatrix::from_fn(5, 3, |i, j| if j == 1 { 0.0 } else { (i + 1) as f64 - j as f64 });
        let mut readers = Readers::default();
        readers.push(&DMatrix::identity(2, 3));
        let reader = readers.push(&matrix);
        let x = [0.5, 7.0, 1.0];
        let expected = (matrix * nalgebra::DVector::from_column_slice(&x)).norm_squared();
        assert!((readers.norm_squared(reader, &x) - expected).abs() < 1e-12);
    }

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
