//! exp without a branch, so that a loop over it works on several numbers at once.

/// 2⁵² · 1.5: adding it rounds to the nearest whole number, which then stands in the last bits.
const ROUNDER: f64 = 6_755_399_441_055_744.0;
/// ln 2 in two parts: the first has few enough bits that its product with an exponent is exact.
const LN_2_HIGH: f64 = 0.693_147_180_369_123_8;
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;
/// exp of less is below 1e-304: 0 for what shares are summed from.
const LEAST: f64 = -700.0;

/// exp(x) for x ≤ 0 to two units in the last place; 0 below −700 and for −∞, NaN stays.
///
/// x = n ln 2 + r with |r| ≤ ½ ln 2; the series of exp(r) to the power 12, times 2ⁿ set as exponent bits.
#[inline]
pub(crate) fn exp_below_zero(x: f64) -> f64 {
    let clamped = if x < LEAST { LEAST } else { x };
    let shifted = clamped * std::f64::consts::LOG2_E + ROUNDER;
    let n = shifted - ROUNDER;
    let r = (clamped - n * LN_2_HIGH) - n * LN_2_LOW;
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
        sum = sum * r + coefficient;
    }
    // The last bits of `shifted` hold n; beside 2⁰ they become the exponent.
    let power = f64::from_bits((shifted.to_bits() << 52).wrapping_add(1023 << 52));
    let value = sum * power;
    if x < LEAST { 0.0 } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_agrees_with_the_library_to_two_units_in_the_last_place() {
        for i in 0..70_000 {
            let x = -0.01 * f64::from(i) * 1.000_003;
            let (own, exact) = (exp_below_zero(x), x.exp());
            if x >= LEAST {
                assert!(
                    (own - exact).abs() <= 2.0 * f64::EPSILON * exact,
                    "exp({x}) came out as {own}, not {exact}"
                );
            }
        }
        assert_eq!(exp_below_zero(0.0), 1.0);
        assert_eq!(exp_below_zero(-700.1), 0.0);
        assert_eq!(exp_below_zero(f64::NEG_INFINITY), 0.0);
        assert!(exp_below_zero(f64::NAN).is_nan());
    }
}
