//! Several rows (or points) side by side: the compiler turns a loop over lanes into vector instructions.

/// Rows that are worked on together.
pub(crate) const LANES: usize = 8;

/// One number for each row.
pub(crate) type Lanes = [f64; LANES];

/// exp(−45) = 3e-20: what is below the largest term by that is lost in the last digit of a sum.
pub(crate) const NEGLIGIBLE: f64 = 45.0;

/// Below this exp is smaller than any normal number.
const LEAST: f64 = -708.0;
/// 1.5 · 2⁵²: a number of moderate size added to it is rounded to a whole one, which stands in the lowest bits.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// ln 2 in two parts; the first has so few bits that its product with a whole number below 2048 is exact.
const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
/// 1 / k!, k = 13 to 0: the rest is 4e-18 for |r| ≤ ½ ln 2.
const TAYLOR: [f64; 14] = [
    1.0 / 6_227_020_800.0,
    1.0 / 479_001_600.0,
    1.0 / 39_916_800.0,
    1.0 / 3_628_800.0,
    1.0 / 362_880.0,
    1.0 / 40_320.0,
    1.0 / 5_040.0,
    1.0 / 720.0,
    1.0 / 120.0,
    1.0 / 24.0,
    1.0 / 6.0,
    0.5,
    1.0,
    1.0,
];

/// exp of numbers of at most 0, to two units in the last place; what would be below 3e-308, and NaN, is 3e-308.
#[inline]
pub(crate) fn exp(x: Lanes) -> Lanes {
    let (mut whole, mut rest, mut sum) = ([0.0; LANES], [0.0; LANES], [TAYLOR[0]; LANES]);
    for lane in 0..LANES {
        let x = if x[lane] > LEAST { x[lane] } else { LEAST };
        whole[lane] = x * std::f64::consts::LOG2_E + ROUND;
        let n = whole[lane] - ROUND;
        rest[lane] = (x - n * LN_2[0]) - n * LN_2[1];
    }
    for factor in &TAYLOR[1..] {
        for lane in 0..LANES {
            sum[lane] = sum[lane] * rest[lane] + factor;
        }
    }
    for lane in 0..LANES {
        // 2ⁿ: n + 1023 in the place of the exponent.
        sum[lane] *= f64::from_bits(whole[lane].to_bits().wrapping_add(1023) << 52);
    }
    sum
}

/// |r|².
#[inline(always)]
#[expect(
    clippy::inline_always,
    reason = "unrolled where the dimension is known when compiling"
)]
pub(crate) fn norm_squared(residual: &[Lanes]) -> Lanes {
    let mut square = [0.0; LANES];
    for row in residual {
        for lane in 0..LANES {
            square[lane] += row[lane] * row[lane];
        }
    }
    square
}

/// |L r|², L a lower triangle given row by row.
#[inline(always)]
#[expect(
    clippy::inline_always,
    reason = "unrolled where the dimension is known when compiling"
)]
pub(crate) fn norm_of_product(lower: &[f64], residual: &[Lanes]) -> Lanes {
    let mut square = [0.0; LANES];
    let mut start = 0;
    for r in 0..residual.len() {
        let mut white = [0.0; LANES];
        for (factor, row) in lower[start..=start + r].iter().zip(residual) {
            for lane in 0..LANES {
                white[lane] += factor * row[lane];
            }
        }
        for lane in 0..LANES {
            square[lane] += white[lane] * white[lane];
        }
        start += r + 1;
    }
    square
}

/// log Σ exp of terms that come one by one, in each lane.
pub(crate) struct LogSums {
    largest: Lanes,
    sum: Lanes,
}

impl Default for LogSums {
    fn default() -> Self {
        Self {
            largest: [f64::MIN; LANES],
            sum: [0.0; LANES],
        }
    }
}

impl LogSums {
    /// Adds a term to each lane.
    #[inline]
    pub fn add(&mut self, logs: &Lanes) {
        if !self.matters(logs) {
            return;
        }
        let mut away = [0.0; LANES];
        for lane in 0..LANES {
            away[lane] = -(logs[lane] - self.largest[lane]).abs();
        }
        let small = exp(away);
        for lane in 0..LANES {
            let higher = logs[lane] > self.largest[lane];
            let (kept, added) = if higher {
                (small[lane], 1.0)
            } else {
                (1.0, small[lane])
            };
            self.sum[lane] = self.sum[lane] * kept + added;
            self.largest[lane] = if higher { logs[lane] } else { self.largest[lane] };
        }
    }

    /// Whether a term as large as this would be seen in some lane.
    #[inline]
    pub fn matters(&self, logs: &Lanes) -> bool {
        let mut some = false;
        for (log, largest) in logs.iter().zip(&self.largest) {
            some |= *log > largest - NEGLIGIBLE;
        }
        some
    }

    /// The sums; −∞ where no term was finite.
    pub fn values(&self) -> Lanes {
        std::array::from_fn(|lane| {
            if self.largest[lane] > f64::MIN {
                self.largest[lane] + self.sum[lane].ln()
            } else {
                f64::NEG_INFINITY
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gaussian::log_sum_exp;

    #[test]
    fn the_exponential_is_right_to_two_units_in_the_last_place() {
        for i in 0..70_000 {
            let x = -0.01 * f64::from(i) - 1e-3 * f64::from(i % 7);
            let error = exp([x; LANES])[i as usize % LANES] / x.exp() - 1.0;
            assert!(error.abs() <= 2.0 * f64::EPSILON, "{x}: {error:e}");
        }
        assert_eq!(exp([0.0; LANES]), [1.0; LANES]);
        assert!(exp([f64::NEG_INFINITY; LANES])[0] < 1e-307);
    }

    #[test]
    fn running_sums_are_the_sums() {
        let logs = [f64::NEG_INFINITY, -3.0, 2.0, -1000.0, 2.0, 1.5];
        let mut sums = LogSums::default();
        for log in logs {
            let mut lanes = [log; LANES];
            lanes[1] = f64::NEG_INFINITY;
            lanes[2] = if log.is_finite() { -log } else { 0.0 };
            sums.add(&lanes);
        }
        let values = sums.values();
        assert!((values[0] - log_sum_exp(&logs)).abs() < 1e-14);
        assert_eq!(values[1], f64::NEG_INFINITY);
        assert!((values[2] - 1000.0).abs() < 1e-12);
    }
}
