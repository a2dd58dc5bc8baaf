//! Small dense Gaussian algebra in the log domain: Cholesky factors, never inverses.

use nalgebra::DMatrix;

/// A pivot below this share of its diagonal entry counts as zero: rounding of a d × d product in f64 stays near
/// d · 2e-16, and a correlation above 1 − 1e-13 is not something that data can show.
const RELATIVE_PIVOT: f64 = 1e-13;

/// log(2π).
pub(crate) const LOG_TAU: f64 = 1.837_877_066_409_345_5;

/// log Σ exp(xᵢ), −∞ for none.
pub(crate) fn log_sum_exp(values: &[f64]) -> f64 {
    let max = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if max == f64::NEG_INFINITY {
        return max;
    }
    max + values.iter().map(|value| (value - max).exp()).sum::<f64>().ln()
}

/// log(exp(a) + exp(b)).
pub(crate) fn log_add(a: f64, b: f64) -> f64 {
    let (low, high) = if a < b { (a, b) } else { (b, a) };
    if low == f64::NEG_INFINITY || high == f64::INFINITY {
        return high;
    }
    high + (low - high).exp().ln_1p()
}

/// Lower Cholesky factor of a symmetric matrix, `None` where it is singular or indefinite.
pub(crate) fn cholesky(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = matrix.nrows();
    let mut lower = DMatrix::zeros(n, n);
    for j in 0..n {
        let mut pivot = matrix[(j, j)];
        for k in 0..j {
            pivot -= lower[(j, k)] * lower[(j, k)];
        }
        let positive = pivot > RELATIVE_PIVOT * matrix[(j, j)].abs() && pivot > 0.0 && pivot.is_finite();
        if !positive {
            return None;
        }
        let root = pivot.sqrt();
        lower[(j, j)] = root;
        for i in j + 1..n {
            let mut sum = matrix[(i, j)];
            for k in 0..j {
                sum -= lower[(i, k)] * lower[(j, k)];
            }
            lower[(i, j)] = sum / root;
        }
    }
    Some(lower)
}

/// L⁻¹ b by forward substitution, column by column.
pub(crate) fn solve_lower(lower: &DMatrix<f64>, right: &DMatrix<f64>) -> DMatrix<f64> {
    let mut out = right.clone();
    for c in 0..out.ncols() {
        for i in 0..out.nrows() {
            let mut sum = out[(i, c)];
            for k in 0..i {
                sum -= lower[(i, k)] * out[(k, c)];
            }
            out[(i, c)] = sum / lower[(i, i)];
        }
    }
    out
}

/// L⁻ᵀ b by back substitution, column by column.
pub(crate) fn solve_lower_transpose(lower: &DMatrix<f64>, right: &DMatrix<f64>) -> DMatrix<f64> {
    let mut out = right.clone();
    let n = out.nrows();
    for c in 0..out.ncols() {
        for i in (0..n).rev() {
            let mut sum = out[(i, c)];
            for k in i + 1..n {
                sum -= lower[(k, i)] * out[(k, c)];
            }
            out[(i, c)] = sum / lower[(i, i)];
        }
    }
    out
}

/// log N(r; 0, L Lᵀ); `residual` is overwritten by L⁻¹ r.
pub(crate) fn log_normal_in_place(residual: &mut [f64], lower: &DMatrix<f64>) -> f64 {
    let n = residual.len();
    let mut log_density = -0.5 * n as f64 * LOG_TAU;
    for i in 0..n {
        let mut sum = residual[i];
        for k in 0..i {
            sum -= lower[(i, k)] * residual[k];
        }
        let white = sum / lower[(i, i)];
        residual[i] = white;
        log_density -= 0.5 * white * white + lower[(i, i)].ln();
    }
    log_density
}

/// Lower triangular square root of a positive semidefinite matrix; zero columns where it is flat.
pub(crate) fn semidefinite_root(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let n = matrix.nrows();
    let mut lower = DMatrix::zeros(n, n);
    for j in 0..n {
        let mut pivot = matrix[(j, j)];
        for k in 0..j {
            pivot -= lower[(j, k)] * lower[(j, k)];
        }
        if pivot <= RELATIVE_PIVOT * matrix[(j, j)].abs() {
            continue;
        }
        let root = pivot.sqrt();
        lower[(j, j)] = root;
        for i in j + 1..n {
            let mut sum = matrix[(i, j)];
            for k in 0..j {
                sum -= lower[(i, k)] * lower[(j, k)];
            }
            lower[(i, j)] = sum / root;
        }
    }
    lower
}

/// Makes a matrix that should be symmetric exactly so.
pub(crate) fn symmetrize(matrix: &mut DMatrix<f64>) {
    for i in 0..matrix.nrows() {
        for j in 0..i {
            let mean = 0.5 * (matrix[(i, j)] + matrix[(j, i)]);
            matrix[(i, j)] = mean;
            matrix[(j, i)] = mean;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn log_sum_exp_survives_far_tails() {
        assert_eq!(log_sum_exp(&[]), f64::NEG_INFINITY);
        assert!((log_sum_exp(&[-1e5, -1e5]) - (-1e5 + 2f64.ln())).abs() < 1e-9);
    }

    #[test]
    fn a_singular_matrix_has_no_factor_but_a_root() {
        let flat = DMatrix::from_row_slice(2, 2, &[1.0, 1.0, 1.0, 1.0]);
        assert!(cholesky(&flat).is_none());
        let root = semidefinite_root(&flat);
        assert!((&root * root.transpose() - flat).norm() < 1e-12);
    }
}
