//! Numbers with twice the digits, for the few sums whose terms all but cancel.
//!
//! A value is the unevaluated sum of a double and what rounding took from it. Dekker's and Knuth's formulas give both
//! parts of a sum or product exactly with ordinary operations, so results are the same on every processor.

use std::ops::{Add, Mul, Sub};

/// A sum of two doubles, the second far smaller than the first: some 32 decimal digits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Twofold {
    high: f64,
    low: f64,
}

impl Twofold {
    /// `a − b`, exactly.
    pub fn difference(a: f64, b: f64) -> Self {
        exact_sum(a, -b)
    }

    /// The nearest double.
    pub fn value(self) -> f64 {
        self.high + self.low
    }
}

impl From<f64> for Twofold {
    fn from(value: f64) -> Self {
        Self {
            high: value,
            low: 0.0,
        }
    }
}

impl Add for Twofold {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let sum = exact_sum(self.high, other.high);
        exact_sum(sum.high, sum.low + self.low + other.low)
    }
}

impl Sub for Twofold {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + Self {
            high: -other.high,
            low: -other.low,
        }
    }
}

impl Mul for Twofold {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let product = exact_product(self.high, other.high);
        exact_sum(
            product.high,
            product.low + (self.high * other.low + self.low * other.high),
        )
    }
}

/// `a · (b × c)`.
pub(crate) fn determinant([a, b, c]: [[Twofold; 3]; 3]) -> Twofold {
    let minor = |i: usize, j: usize| b[i] * c[j] - b[j] * c[i];
    a[0] * minor(1, 2) + a[1] * minor(2, 0) + a[2] * minor(0, 1)
}

/// A sum and what rounding took from it.
fn exact_sum(a: f64, b: f64) -> Twofold {
    let high = a + b;
    let b_part = high - a;
    Twofold {
        high,
        low: (a - (high - b_part)) + (b - b_part),
    }
}

/// A product and what rounding took from it.
fn exact_product(a: f64, b: f64) -> Twofold {
    let high = a * b;
    let ((a1, a2), (b1, b2)) = (halves(a), halves(b));
    Twofold {
        high,
        low: a2 * b2 - (((high - a1 * b1) - a2 * b1) - a1 * b2),
    }
}

/// A double as the sum of two with half the digits each.
fn halves(value: f64) -> (f64, f64) {
    const SPLITTER: f64 = 134_217_729.0; // 2²⁷ + 1
    let scaled = SPLITTER * value;
    let high = scaled - (scaled - value);
    (high, value - high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_and_products_keep_what_rounding_takes() {
        let tiny = f64::EPSILON / 8.0;
        assert_eq!((Twofold::from(1.0) + tiny.into() - 1.0.into()).value(), tiny);
        let third = 1.0 / 3.0;
        // 1/3 as a double is (1 − 2⁻⁵⁴) / 3, so three times it misses 1 by 2⁻⁵⁴.
        let rest = Twofold::from(third) * 3.0.into() - 1.0.into();
        assert_eq!(rest.value(), -f64::EPSILON / 4.0);
    }

    #[test]
    fn a_determinant_survives_nearly_equal_rows() {
        let row = |x: f64, y: f64, z: f64| [x, y, z].map(Twofold::from);
        let e = 1e-9;
        // Row differences are unit vectors times the step that is left of e, so the determinant is its square.
        let found = determinant([row(1.0, 1.0, 1.0), row(1.0, 1.0 + e, 1.0), row(1.0, 1.0, 1.0 + e)]).value();
        let step = (1.0 + e) - 1.0;
        assert!((found - step * step).abs() < 1e-15 * step * step);
    }
}
