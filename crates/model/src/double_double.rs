//! Square roots of covariances, worked out in twice the usual precision.
//!
//! Cholesky's algorithm loses the condition number of the matrix: at 1e8 eight of sixteen digits. Its result, rounded
//! once, loses only the square root of it. Roots are taken once per component, so twice the digits cost nothing.

use nalgebra::DMatrix;

/// A pivot below this share of its diagonal entry counts as zero: a correlation above 1 − 1e-13 is not something that
/// data can show, and the entries of a singular matrix that were rounded leave 1e-16.
const RELATIVE_PIVOT: f64 = 1e-13;

/// A lower triangular square root of a covariance.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Root {
    /// Columns without variance are zero.
    pub lower: DMatrix<f64>,
    /// Whether some direction has no variance.
    pub singular: bool,
}

/// The root of a symmetric, positive semidefinite matrix.
pub(crate) fn covariance_root(matrix: &DMatrix<f64>) -> Root {
    let n = matrix.nrows();
    let mut lower = vec![Double::ZERO; n * n];
    let mut singular = false;
    for j in 0..n {
        let mut pivot = Double::from(matrix[(j, j)]);
        for k in 0..j {
            pivot = pivot.minus_product(lower[j * n + k], lower[j * n + k]);
        }
        let positive = pivot.high > RELATIVE_PIVOT * matrix[(j, j)].abs() && pivot.high.is_finite();
        if !positive {
            singular = true;
            continue;
        }
        let root = pivot.sqrt();
        lower[j * n + j] = root;
        for i in j + 1..n {
            let mut sum = Double::from(matrix[(i, j)]);
            for k in 0..j {
                sum = sum.minus_product(lower[i * n + k], lower[j * n + k]);
            }
            lower[i * n + j] = sum.over(root);
        }
    }
    Root {
        lower: DMatrix::from_fn(n, n, |i, j| lower[i * n + j].high),
        singular,
    }
}

/// high + low, |low| at most half a unit in the last place of high.
#[derive(Clone, Copy)]
struct Double {
    high: f64,
    low: f64,
}

impl From<f64> for Double {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

impl Double {
    const ZERO: Self = Self { high: 0.0, low: 0.0 };

    /// a + b and what rounding took from it.
    fn sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let part = high - a;
        let low = (a - (high - part)) + (b - part);
        Self { high, low }
    }

    fn product(a: f64, b: f64) -> Self {
        let high = a * b;
        let low = a.mul_add(b, -high);
        Self { high, low }
    }

    fn plus(self, other: Self) -> Self {
        let high = Self::sum(self.high, other.high);
        Self::sum(high.high, high.low + self.low + other.low)
    }

    fn times(self, other: Self) -> Self {
        let high = Self::product(self.high, other.high);
        Self::sum(
            high.high,
            high.low + self.high * other.low + self.low * other.high,
        )
    }

    fn minus_product(self, a: Self, b: Self) -> Self {
        let product = a.times(b);
        self.plus(Self {
            high: -product.high,
            low: -product.low,
        })
    }

    fn over(self, other: Self) -> Self {
        let first = self.high / other.high;
        let left = self.minus_product(Self::from(first), other);
        Self::sum(first, left.high / other.high)
    }

    fn sqrt(self) -> Self {
        let first = self.high.sqrt();
        let left = self.minus_product(Self::from(first), Self::from(first));
        Self::sum(first, left.high / (2.0 * first))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_of_an_ill_conditioned_covariance_is_right_to_rounding() {
        // [[1, r], [r, 1]]: the second pivot is 1 − r², here 2e-10, of which plain arithmetic keeps six digits.
        let r = 1.0 - 1e-10;
        let root = covariance_root(&DMatrix::from_row_slice(2, 2, &[1.0, r, r, 1.0]));
        let exact = ((1.0 - r) * (1.0 + r)).sqrt();
        assert!((root.lower[(1, 1)] / exact - 1.0).abs() < 1e-15);
        assert!(!root.singular);
    }

    #[test]
    fn a_singular_covariance_has_a_root_too() {
        let v = [0.3, -0.7, 0.1];
        let flat = DMatrix::from_fn(3, 3, |i, j| v[i] * v[j]);
        let root = covariance_root(&flat);
        assert!(root.singular);
        assert!((&root.lower * root.lower.transpose() - flat).norm() < 1e-15);
    }
}
