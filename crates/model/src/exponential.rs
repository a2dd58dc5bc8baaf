//! exp and ln without a branch, so that a loop over them works on several numbers at once.

use pulp::Simd;

/// 2⁵² · 1.5: adding it rounds to the nearest whole number, which then stands in the last bits.
const ROUNDER: f64 = 6_755_399_441_055_744.0;
/// ln 2 in two parts: the first has few enough bits that its product with an exponent is exact.
const LN_2_HIGH: f64 = 0.693_147_180_369_123_8;
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;
/// exp of less is below 1e-304: 0 for what shares are summed from.
const LEAST: f64 = -700.0;

/// a b + c, in one rounding where the processor has such an instruction.
#[inline(always)]
#[expect(
    clippy::inline_always,
    reason = "part of a loop with the processor's instructions"
)]
fn multiply_add<S: Simd>(a: f64, b: f64, c: f64) -> f64 {
    if S::IS_SCALAR { a * b + c } else { a.mul_add(b, c) }
}

/// exp(x) for x ≤ 0 to two units in the last place; 0 below −700 and for −∞, NaN stays.
///
/// x = n ln 2 + r with |r| ≤ ½ ln 2; the series of exp(r) to the power 12, times 2ⁿ set as exponent bits.
#[inline(always)]
#[expect(
    clippy::inline_always,
    reason = "part of a loop with the processor's instructions"
)]
pub(crate) fn exp_below_zero<S: Simd>(x: f64) -> f64 {
    let clamped = if x < LEAST { LEAST } else { x };
    let shifted = multiply_add::<S>(clamped, std::f64::consts::LOG2_E, ROUNDER);
    let n = shifted - ROUNDER;
    let r = multiply_add::<S>(n, -LN_2_LOW, multiply_add::<S>(n, -LN_2_HIGH, clamped));
    // 1/12!, 1/11!, … in Horner's form.
    let mut sum = 2.087_675_698_786_81e-9;
    for coefficient in [
        2.505_210_838_544_172e-8,
        2.755_731_922_398_589_3e-7,
        2.755_731_922_398_589e-6,
        2.480_158_730_158_73e-5,
        1.984_126_984_126_984e-4,
        1.388_888_888_888_889e-3,
        8.333_333_333_333_333e-3,
        4.166_666_666_666_666_4e-2,
        1.666_666_666_666_666_6e-1,
        0.5,
        1.0,
        1.0,
    ] {
        sum = multiply_add::<S>(sum, r, coefficient);
    }
    // The last bits of `shifted` hold n; beside 2⁰ they become the exponent.
    let power = f64::from_bits((shifted.to_bits() << 52).wrapping_add(1023 << 52));
    let value = sum * power;
    if x < LEAST { 0.0 } else { value }
}

/// ln(x) for finite x ≥ 1, off by less than 1e-16 and two units in the last place.
///
/// x = 2ⁿ y with √½ ≤ y < √2; ln y = 2 artanh s, s = (y − 1) / (y + 1), by the series to the power 21.
#[inline(always)]
pub(crate) fn ln_above_one<S: Simd>(x: f64) -> f64 {
    /// Bits of √½.
    const ROOT_HALF: u64 = 0x3FE6_A09E_667F_3BCD;
    let above = x.to_bits().wrapping_sub(ROOT_HALF);
    // The exponent into the last bits of a number that is whole there.
    let n = f64::from_bits((above >> 52) | 0x4330_0000_0000_0000) - 4_503_599_627_370_496.0;
    let y = f64::from_bits((above & 0x000F_FFFF_FFFF_FFFF).wrapping_add(ROOT_HALF));
    let s = (y - 1.0) / (y + 1.0);
    let square = s * s;
    let mut sum = 2.0 / 21.0;
    for coefficient in [
        2.0 / 19.0,
        2.0 / 17.0,
        2.0 / 15.0,
        2.0 / 13.0,
        2.0 / 11.0,
        2.0 / 9.0,
        2.0 / 7.0,
        2.0 / 5.0,
        2.0 / 3.0,
    ] {
        sum = multiply_add::<S>(sum, square, coefficient);
    }
    let rest = multiply_add::<S>(sum * square, s, multiply_add::<S>(n, LN_2_LOW, 2.0 * s));
    multiply_add::<S>(n, LN_2_HIGH, rest)
}

#[cfg(test)]
mod tests {
    use pulp::{Arch, Scalar, WithSimd};

    use super::*;

    /// Both functions with the processor's instructions.
    struct Both(f64);

    impl WithSimd for Both {
        type Output = (f64, f64);

        #[inline(always)]
        #[expect(
            clippy::inline_always,
            reason = "part of a loop with the processor's instructions"
        )]
        fn with_simd<S: Simd>(self, _: S) -> (f64, f64) {
            (exp_below_zero::<S>(-self.0), ln_above_one::<S>(1.0 + self.0))
        }
    }

    fn everywhere(x: f64) -> [(f64, f64); 2] {
        let plain = (exp_below_zero::<Scalar>(-x), ln_above_one::<Scalar>(1.0 + x));
        [plain, Arch::new().dispatch(Both(x))]
    }

    #[test]
    fn they_agree_with_the_library_to_two_units_in_the_last_place() {
        for i in 0..70_000 {
            let x = 0.01 * f64::from(i) * 1.000_003;
            for (exp, ln) in everywhere(x) {
                let exact = (-x).exp();
                if -x >= LEAST {
                    assert!(
                        (exp - exact).abs() <= 2.0 * f64::EPSILON * exact,
                        "exp({}) came out as {exp}, not {exact}",
                        -x
                    );
                }
                let exact = (1.0 + x).ln();
                assert!(
                    (ln - exact).abs() <= 1e-16 + 2.0 * f64::EPSILON * exact,
                    "ln({}) came out as {ln}, not {exact}",
                    1.0 + x
                );
            }
        }
    }

    #[test]
    fn what_is_beyond_is_zero_and_what_is_no_number_stays_none() {
        assert_eq!(exp_below_zero::<Scalar>(0.0), 1.0);
        assert_eq!(exp_below_zero::<Scalar>(-700.1), 0.0);
        assert_eq!(exp_below_zero::<Scalar>(f64::NEG_INFINITY), 0.0);
        assert!(exp_below_zero::<Scalar>(f64::NAN).is_nan());
        assert_eq!(ln_above_one::<Scalar>(1.0), 0.0);
    }
}
