//! Laws of densities and of fits.

/// A log density on the line integrates to 1 over [`from`, `to`], by the trapezoidal rule with the given step. The
/// interval has to hold all but 1e-6 of the mass, and the step to resolve the narrowest component.
///
/// # Panics
///
/// If it does not, by more than 1e-6.
pub fn integrates_to_one_on_line(log_density: impl Fn(f64) -> f64, from: f64, to: f64, step: f64) {
    let n = ((to - from) / step).ceil() as usize;
    let sum: f64 = (0..=n).map(|i| log_density(from + i as f64 * step).exp()).sum();
    assert!(
        (sum * step - 1.0).abs() < 1e-6,
        "the density integrates to {}",
        sum * step
    );
}

/// A log density on the unit sphere of ℝ³ integrates to 1 over its surface, by the midpoint rule with `n` rings.
///
/// # Panics
///
/// If it does not, by more than 1e-3.
pub fn integrates_to_one_on_sphere(log_density: impl Fn([f64; 3]) -> f64, n: usize) {
    let mut sum = 0.0;
    for i in 0..n {
        let z = -1.0 + (2.0 * i as f64 + 1.0) / n as f64;
        let r = (1.0 - z * z).sqrt();
        for j in 0..2 * n {
            let phi = std::f64::consts::PI * (j as f64 + 0.5) / n as f64;
            sum += log_density([r * phi.cos(), r * phi.sin(), z]).exp();
        }
    }
    let integral = sum * (2.0 / n as f64) * (std::f64::consts::PI / n as f64);
    assert!(
        (integral - 1.0).abs() < 1e-3,
        "the density integrates to {integral}"
    );
}

/// A sequence never falls, up to rounding: each value is at least the one before, less 1e-9 of its size.
///
/// # Panics
///
/// If it falls.
pub fn never_falls(values: &[f64]) {
    for (i, pair) in values.windows(2).enumerate() {
        assert!(
            pair[1] >= pair[0] - 1e-9 * pair[0].abs().max(1.0),
            "step {}: {} after {}",
            i + 1,
            pair[1],
            pair[0]
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_normal_density_passes_and_a_doubled_one_does_not() {
        let normal = |x: f64| -0.5 * (x * x + (2.0 * std::f64::consts::PI).ln());
        integrates_to_one_on_line(normal, -8.0, 8.0, 0.01);
        assert!(
            std::panic::catch_unwind(|| integrates_to_one_on_line(|x| normal(x) + 1.0, -8.0, 8.0, 0.01))
                .is_err()
        );
        integrates_to_one_on_sphere(|_| -(4.0 * std::f64::consts::PI).ln(), 20);
    }
}
