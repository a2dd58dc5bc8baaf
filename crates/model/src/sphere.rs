//! Mass that a Gaussian of ℝᵈ puts on the unit sphere, by which its density there is normalized.
//!
//! For x ~ N(m, Σ), ∫ over the sphere of the density is twice the density of |x|² at 1, and that one is an inverse
//! Laplace transform of a closed form:
//!
//! ```text
//! K(s) = Σⱼ [ −½ log(1 − 2sλⱼ) + s bⱼ² / (1 − 2sλⱼ) ]      λ, b: Σ and m in Σ's eigenbasis
//! f(1) = 1/(2πi) ∫ exp(K(s) − s) ds
//! ```
//!
//! The contour is the parabola s = s₀ + iy + y²/4p through the saddle point s₀ with its focus at the last branch point,
//! s₀ + p = 1 / 2λ_min. On it every factor is largest at the saddle and the integrand falls like exp(−y²/4p), so the
//! trapezoidal rule converges exponentially, whatever the floor of the covariance and however flat it is.

use nalgebra::{Complex, DMatrix, DVector};

/// Trapezoid steps per width of the saddle: the error of the rule falls like exp(−2π² · steps²).
const STEPS_PER_WIDTH: f64 = 6.0;
/// Terms below this share of the peak do not show in the sum.
const NEGLIGIBLE: f64 = 1e-18;
/// More steps than any well-posed Gaussian takes.
const MAX_STEPS: usize = 200_000;

/// log ∫ N(x; mean, covariance) over |x| = 1 (surface measure); `None` where the covariance is singular.
pub(crate) fn log_sphere_normalizer(mean: &DVector<f64>, covariance: &DMatrix<f64>) -> Option<f64> {
    let eigen = covariance.clone().symmetric_eigen();
    let lambdas: Vec<f64> = eigen.eigenvalues.iter().copied().collect();
    if lambdas.iter().any(|l| *l <= 0.0 || l.is_nan()) {
        return None;
    }
    let squares: Vec<f64> = (eigen.eigenvectors.transpose() * mean)
        .iter()
        .map(|b| b * b)
        .collect();
    let branch = 0.5 / lambdas.iter().copied().fold(0.0, f64::max);
    let distance = saddle_distance(&lambdas, &squares, branch);
    let saddle = branch - distance;
    let largest = 0.5 / branch;
    let gaps: Vec<f64> = lambdas
        .iter()
        .map(|l| (1.0 - l / largest) + 2.0 * l * distance)
        .collect();
    let mut peak = -saddle;
    let mut curvature = 0.0;
    for ((&lambda, &square), &gap) in lambdas.iter().zip(&squares).zip(&gaps) {
        peak += -0.5 * gap.ln() + saddle * square / gap;
        curvature += 2.0 * lambda * lambda / (gap * gap) + 4.0 * lambda * square / (gap * gap * gap);
    }
    let four_p = 4.0 * (0.5 / lambdas.iter().copied().fold(f64::INFINITY, f64::min) - saddle);
    let step = 1.0 / (curvature.sqrt() * STEPS_PER_WIDTH);
    // The lower half of the contour mirrors the upper one.
    let mut sum = 0.5;
    let mut quiet = 0;
    for n in 1..MAX_STEPS {
        let y = n as f64 * step;
        let away = Complex::new(y * y / four_p, y);
        let mut exponent = -away;
        for ((&lambda, &square), &gap) in lambdas.iter().zip(&squares).zip(&gaps) {
            let here = gap - away * (2.0 * lambda);
            exponent += (here / gap).ln() * -0.5 + away * square / (here * gap);
        }
        let value = exponent.exp() * Complex::new(2.0 * y / four_p, 1.0);
        sum += value.im;
        quiet = if value.norm() < NEGLIGIBLE { quiet + 1 } else { 0 };
        if quiet > 4 {
            break;
        }
    }
    Some((2.0 * sum * step / std::f64::consts::PI).ln() + peak)
}

/// Distance of the saddle K'(s) = 1 to the left of the branch point: K' rises there from 0 to ∞.
fn saddle_distance(lambdas: &[f64], squares: &[f64], branch: f64) -> f64 {
    let slope = |distance: f64| -> f64 {
        lambdas
            .iter()
            .zip(squares)
            .map(|(&lambda, &square)| {
                let gap = 1.0 - 2.0 * (branch - distance) * lambda;
                lambda / gap + square / (gap * gap)
            })
            .sum()
    };
    let (mut low, mut high) = (branch, branch);
    while slope(low) < 1.0 {
        low *= 0.5;
    }
    while slope(high) > 1.0 {
        high *= 2.0;
    }
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if slope(middle) > 1.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gaussian::{cholesky, log_normal_in_place};

    /// ∫ over the sphere of ℝ³ by Gauss-free brute force: the midpoint rule in cos θ and φ.
    fn brute(mean: &DVector<f64>, covariance: &DMatrix<f64>, n: usize) -> f64 {
        let lower = cholesky(covariance).unwrap();
        let mut sum = 0.0;
        for i in 0..n {
            let z = -1.0 + (2.0 * i as f64 + 1.0) / n as f64;
            let r = (1.0 - z * z).sqrt();
            for j in 0..2 * n {
                let phi = std::f64::consts::PI * (j as f64 + 0.5) / n as f64;
                let mut residual = vec![r * phi.cos() - mean[0], r * phi.sin() - mean[1], z - mean[2]];
                sum += log_normal_in_place(&mut residual, &lower).exp();
            }
        }
        (sum * (2.0 / n as f64) * (std::f64::consts::PI / n as f64)).ln()
    }

    #[test]
    fn the_contour_integral_agrees_with_quadrature() {
        let cases = [
            (
                vec![0.3, -0.2, 0.5],
                vec![0.2, 0.05, 0.0, 0.05, 0.1, 0.02, 0.0, 0.02, 0.3],
            ),
            (
                vec![0.0, 0.0, 0.0],
                vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            ),
            (
                vec![0.6, 0.0, 0.8],
                vec![0.01, 0.0, 0.0, 0.0, 0.02, 0.0, 0.0, 0.0, 0.01],
            ),
            (
                vec![2.0, 1.0, 0.0],
                vec![0.1, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.2],
            ),
        ];
        for (mean, covariance) in cases {
            let mean = DVector::from_vec(mean);
            let covariance = DMatrix::from_row_slice(3, 3, &covariance);
            let exact = log_sphere_normalizer(&mean, &covariance).unwrap();
            let rough = brute(&mean, &covariance, 600);
            assert!((exact - rough).abs() < 2e-5, "{exact} against {rough}");
        }
    }

    #[test]
    fn an_isotropic_gaussian_has_a_closed_form_on_the_sphere() {
        // d = 3, N(μ e, σ² I): ∫ = 4π sinh(κ)/κ (2πσ²)^(-3/2) exp(−(1 + μ²) / 2σ²), κ = μ/σ².
        for (mu, sigma) in [(1.0, 0.01), (0.5, 0.1), (0.9, 1e-3)] {
            let kappa: f64 = mu / (sigma * sigma);
            let log_sinh = kappa - 2f64.ln() + (-(-2.0 * kappa).exp()).ln_1p();
            let expected = (4.0 * std::f64::consts::PI).ln() + log_sinh
                - kappa.ln()
                - 1.5 * (2.0 * std::f64::consts::PI * sigma * sigma).ln()
                - (1.0 + mu * mu) / (2.0 * sigma * sigma);
            let mean = DVector::from_vec(vec![0.0, mu, 0.0]);
            let found = log_sphere_normalizer(&mean, &(DMatrix::identity(3, 3) * sigma * sigma)).unwrap();
            assert!(
                (found - expected).abs() < 1e-8 * expected.abs().max(1.0),
                "{found} against {expected}"
            );
        }
    }
}
