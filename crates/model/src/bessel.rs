//! Modified Bessel functions of the first kind, as logarithms and ratios that neither overflow nor cancel.
//!
//! For κ up to 30 + ν² the power series, summed outwards from its largest term, all of whose terms are positive; beyond,
//! Hankel's expansion, whose terms fall fast there (Abramowitz and Stegun 9.6.10 and 9.7.1).

use crate::gaussian::LOG_TAU;

/// Shares of the sum below this do not show.
const NEGLIGIBLE: f64 = 1e-18;

/// log I_ν(κ) − κ for ν ≥ 0; −∞ at κ = 0 unless ν = 0.
pub(crate) fn log_bessel_scaled(nu: f64, kappa: f64) -> f64 {
    if kappa == 0.0 {
        return if nu == 0.0 { 0.0 } else { f64::NEG_INFINITY };
    }
    if kappa > hankel_from(nu) {
        return hankel_sum(nu, kappa).ln() - 0.5 * (LOG_TAU + kappa.ln());
    }
    // Terms (κ/2)^(2k + ν) / (k! Γ(ν + k + 1)) rise as long as k (ν + k) < κ²/4.
    let quarter = 0.25 * kappa * kappa;
    let peak = (0.5 * (nu * nu + kappa * kappa).sqrt() - 0.5 * nu)
        .floor()
        .max(0.0);
    let mut sum = 1.0;
    let (mut term, mut k) = (1.0, peak);
    while k > 0.0 && term > NEGLIGIBLE {
        term *= k * (nu + k) / quarter;
        sum += term;
        k -= 1.0;
    }
    (term, k) = (1.0, peak + 1.0);
    while term > NEGLIGIBLE {
        term *= quarter / (k * (nu + k));
        sum += term;
        k += 1.0;
    }
    let log_peak =
        (2.0 * peak + nu) * (0.5 * kappa).ln() - log_gamma(peak + 1.0) - log_gamma(nu + peak + 1.0);
    log_peak + sum.ln() - kappa
}

/// I_{ν+1}(κ) / I_ν(κ), from 0 at κ = 0 up to 1.
pub(crate) fn bessel_ratio(nu: f64, kappa: f64) -> f64 {
    if kappa <= 0.0 {
        return 0.0;
    }
    if kappa > hankel_from(nu + 1.0) {
        return hankel_sum(nu + 1.0, kappa) / hankel_sum(nu, kappa);
    }
    // Gauss's continued fraction 1/(2(ν+1)/κ + 1/(2(ν+2)/κ + …)), from a depth where it no longer matters.
    let depth = 40 + (2.0 * kappa) as usize;
    let mut tail = 0.0;
    for step in (1..=depth).rev() {
        tail = 1.0 / (2.0 * (nu + step as f64) / kappa + tail);
    }
    tail
}

/// κ beyond which Hankel's expansion is exact to rounding.
fn hankel_from(nu: f64) -> f64 {
    30.0 + nu * nu
}

/// 1 − (μ−1)/(8κ) + (μ−1)(μ−9)/(2!(8κ)²) − …, μ = 4ν²; stops at the least term.
fn hankel_sum(nu: f64, kappa: f64) -> f64 {
    let mu = 4.0 * nu * nu;
    let (mut sum, mut term) = (1.0, 1.0_f64);
    for k in 1..200 {
        let odd = f64::from(2 * k - 1);
        let next = -term * (mu - odd * odd) / (f64::from(k) * 8.0 * kappa);
        if next.abs() >= term.abs() {
            break;
        }
        sum += next;
        term = next;
        if term.abs() < NEGLIGIBLE {
            break;
        }
    }
    sum
}

/// log Γ(x) for x > 0: Stirling's series after the recurrence has carried x past 15.
pub(crate) fn log_gamma(mut x: f64) -> f64 {
    let mut shift = 0.0;
    let mut product = 1.0;
    while x < 15.0 {
        product *= x;
        x += 1.0;
    }
    shift -= f64::ln(product);
    let inverse = 1.0 / (x * x);
    let series = (1.0 / 12.0
        - inverse * (1.0 / 360.0 - inverse * (1.0 / 1260.0 - inverse * (1.0 / 1680.0 - inverse / 1188.0))))
        / x;
    shift + (x - 0.5) * x.ln() - x + 0.5 * LOG_TAU + series
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_orders_agree_with_their_closed_forms() {
        // I_{1/2}(κ) = √(2/πκ) sinh κ; I_{3/2}/I_{1/2} = coth κ − 1/κ.
        for kappa in [1e-3, 0.1, 1.0, 10.0, 29.0, 31.0, 300.0, 1e4, 1e6] {
            let exact =
                0.5 * (2.0 / (std::f64::consts::PI * kappa)).ln() + (-(-2.0 * kappa).exp_m1() / 2.0).ln();
            let found = log_bessel_scaled(0.5, kappa);
            assert!(
                (found - exact).abs() < 1e-12 * exact.abs().max(1.0),
                "{kappa}: {found} against {exact}"
            );
            if kappa >= 0.1 {
                let exact = 1.0 / kappa.tanh() - 1.0 / kappa;
                let found = bessel_ratio(0.5, kappa);
                assert!((found - exact).abs() < 1e-13, "{kappa}: {found} against {exact}");
            }
        }
    }

    #[test]
    fn both_ranges_meet() {
        for nu in [0.0, 0.5, 1.0, 2.5, 7.0, 40.0] {
            let edge = hankel_from(nu);
            let (below, above) = (
                log_bessel_scaled(nu, edge),
                log_bessel_scaled(nu, edge * (1.0 + 1e-13)),
            );
            assert!((below - above).abs() < 1e-11, "{nu}: {below} against {above}");
            let edge = hankel_from(nu + 1.0);
            let (below, above) = (bessel_ratio(nu, edge), bessel_ratio(nu, edge * (1.0 + 1e-13)));
            assert!((below - above).abs() < 1e-11, "{nu}: {below} against {above}");
        }
    }

    #[test]
    fn factorials() {
        assert!((log_gamma(11.0) - 3_628_800f64.ln()).abs() < 1e-13);
        assert!((log_gamma(0.5) - 0.5 * std::f64::consts::PI.ln()).abs() < 1e-14);
    }
}
