//! Least squares with coefficients that may not be negative.

use nalgebra::{DMatrix, DVector};

/// The x ≥ 0 with the least |A x − b|.
///
/// Columns enter a passive set one at a time, the one along which the error falls fastest first; least squares over the
/// set says where to go, and columns whose coefficients would become negative on the way leave. Ends where no column
/// outside would let the error fall.
///
/// Source: Lawson and Hanson, "Solving Least Squares Problems" (1974), chapter 23.
pub(crate) fn non_negative_least_squares(a: &DMatrix<f64>, b: &DVector<f64>) -> DVector<f64> {
    let n = a.ncols();
    let mut x = DVector::zeros(n);
    let mut passive: Vec<usize> = Vec::new();
    let tolerance = 1e-10 * a.amax() * b.amax().max(f64::MIN_POSITIVE);
    // Some steps per column are usual; the bound only stops a cycle that rounding might start.
    for _ in 0..3 * n {
        let gradient = a.tr_mul(&(b - a * &x));
        let outside = (0..n).filter(|j| !passive.contains(j));
        let Some(entering) = outside.reduce(|best, j| if gradient[j] > gradient[best] { j } else { best })
        else {
            break;
        };
        if gradient[entering] <= tolerance {
            break;
        }
        passive.push(entering);
        while let Some(solved) = least_squares(a, b, &passive) {
            if solved.iter().all(|s| *s > 0.0) {
                x.fill(0.0);
                for (j, s) in passive.iter().zip(solved.iter()) {
                    x[*j] = *s;
                }
                break;
            }
            // Go from x towards the solution until the first coefficient reaches 0.
            let mut step = 1.0_f64;
            for (j, s) in passive.iter().zip(solved.iter()) {
                if *s <= 0.0 && x[*j] - s > 0.0 {
                    step = step.min(x[*j] / (x[*j] - s));
                }
            }
            for (j, s) in passive.iter().zip(solved.iter()) {
                x[*j] += step * (s - x[*j]);
            }
            let largest = x.amax();
            passive.retain(|j| x[*j] > 1e-14 * largest);
            for j in 0..n {
                if !passive.contains(&j) {
                    x[j] = 0.0;
                }
            }
        }
    }
    x
}

/// Coefficients of these columns; none where there are no columns, or dependent ones.
fn least_squares(a: &DMatrix<f64>, b: &DVector<f64>, columns: &[usize]) -> Option<DVector<f64>> {
    if columns.is_empty() || columns.len() > a.nrows() {
        return None;
    }
    let qr = a.select_columns(columns).qr();
    let right = qr.q().tr_mul(b);
    qr.r().solve_upper_triangular(&right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_least_squares_would_make_negative_is_zero() {
        // Without the sign the answer is (2, −1); with it, the best multiple of the first column, 5/5.
        let a = DMatrix::from_row_slice(2, 2, &[1.0, 1.0, 2.0, 1.0]);
        let b = DVector::from_vec(vec![1.0, 3.0]);
        let x = non_negative_least_squares(&a, &b);
        assert!((x[0] - 1.4).abs() < 1e-12 && x[1] == 0.0, "{x}");
    }

    #[test]
    fn the_optimality_conditions_hold_on_random_problems() {
        for case in 0..40 {
            let value = |i: usize, j: usize| ((case * 97 + i * 31 + j * 17) as f64 * 0.7).sin();
            let a = DMatrix::from_fn(7, 12, value);
            let b = DVector::from_fn(7, |i, _| value(i, 40));
            let x = non_negative_least_squares(&a, &b);
            let gradient = a.tr_mul(&(&b - &a * &x));
            for j in 0..12 {
                assert!(
                    x[j] >= 0.0 && gradient[j] < 1e-8,
                    "case {case}, {j}: {} {}",
                    x[j],
                    gradient[j]
                );
                assert!(x[j] == 0.0 || gradient[j].abs() < 1e-8);
            }
        }
    }
}
