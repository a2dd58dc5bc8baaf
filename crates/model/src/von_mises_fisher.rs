//! Mixtures of von Mises–Fisher distributions: directions around directions.
//!
//! ```text
//! p(x) = Σₖ πₖ C_d(κₖ) exp(κₖ μₖ·x)      C_d(κ) = κ^ν / ((2π)^(d/2) I_ν(κ)),  ν = d/2 − 1
//! ```
//!
//! x is a unit vector of ℝᵈ and the density is one on the sphere (surface measure): κ = 0 is uniform, and large κ is a
//! Gaussian of variance 1/κ in each of the d − 1 directions along the sphere.

use nalgebra::DVector;
use rand::{Rng, RngExt};
use rand_distr::{Beta, Distribution, StandardNormal};

use crate::bessel::log_bessel_scaled;
use crate::cpd::{NodeIdx, draw};
use crate::gaussian::{LOG_TAU, log_sum_exp};

/// Most concentration that a fit gives and a model file may have: a spread of a thousandth of a radian.
pub(crate) const MAX_CONCENTRATION: f64 = 1e6;

/// A mixture of von Mises–Fisher distributions for each configuration of the discrete parents.
#[derive(Debug, Clone, PartialEq)]
pub struct VonMisesFisherCpd {
    /// Column of each coordinate, at least two.
    pub columns: Vec<String>,
    /// Discrete parents; their configurations number the rows of `components`, the last parent varying fastest.
    pub discrete_parents: Vec<NodeIdx>,
    /// One row per configuration; the weights of a row sum to 1.
    pub components: Vec<Vec<VonMisesFisher>>,
}

/// One von Mises–Fisher distribution with its share of a mixture.
#[derive(Debug, Clone, PartialEq)]
pub struct VonMisesFisher {
    /// Probability of the component, 0 allowed.
    pub weight: f64,
    /// Mean direction μ, a unit vector.
    pub direction: DVector<f64>,
    /// Concentration κ, 0 to a million.
    pub concentration: f64,
}

impl VonMisesFisherCpd {
    /// Dimension of the space that the unit vectors live in.
    pub fn dim(&self) -> usize {
        self.columns.len()
    }

    /// log weight · density of each component with positive weight.
    pub(crate) fn log_terms(&self, configuration: usize, x: &[f64]) -> Vec<f64> {
        log_terms(&self.components[configuration], x)
    }

    /// log p(x | configuration) on the sphere, of a unit vector x.
    pub fn log_density(&self, configuration: usize, x: &[f64]) -> f64 {
        log_mixture(&self.components[configuration], x)
    }

    /// A unit vector drawn given a configuration.
    pub fn sample(&self, configuration: usize, rng: &mut impl Rng) -> Vec<f64> {
        let row = &self.components[configuration];
        row[draw(row.iter().map(|c| c.weight), rng)].sample(rng)
    }

    /// Free parameters: K d + K − 1 for each configuration (d − 1 angles and a concentration each).
    pub fn n_parameters(&self) -> usize {
        self.components
            .iter()
            .map(|row| n_direction_parameters(row.len(), self.dim()))
            .sum()
    }
}

/// K d + K − 1.
pub(crate) fn n_direction_parameters(k: usize, d: usize) -> usize {
    k * d + k.saturating_sub(1)
}

/// log Σ weight · density.
pub(crate) fn log_mixture(components: &[VonMisesFisher], x: &[f64]) -> f64 {
    log_sum_exp(&log_terms(components, x))
}

fn log_terms(components: &[VonMisesFisher], x: &[f64]) -> Vec<f64> {
    components
        .iter()
        .filter(|component| component.weight > 0.0)
        .map(|component| component.weight.ln() + component.log_density(x))
        .collect()
}

impl VonMisesFisher {
    /// log density of a unit vector, without the weight.
    pub fn log_density(&self, x: &[f64]) -> f64 {
        // κ (μ·x − 1) = −κ |x − μ|² / 2 keeps its digits where both vectors nearly agree.
        let square: f64 = x
            .iter()
            .zip(self.direction.iter())
            .map(|(a, b)| (a - b) * (a - b))
            .sum();
        log_normalizer(x.len(), self.concentration) - 0.5 * self.concentration * square
    }

    /// A unit vector. The share along the mean direction is drawn by rejection.
    ///
    /// # Source
    ///
    /// Wood, "Simulation of the von Mises Fisher distribution", Communications in Statistics 23 (1994).
    pub fn sample(&self, rng: &mut impl Rng) -> Vec<f64> {
        let d = self.direction.len();
        let m = (d - 1) as f64;
        let kappa = self.concentration;
        let b = m / (2.0 * kappa + (4.0 * kappa * kappa + m * m).sqrt());
        let x0 = (1.0 - b) / (1.0 + b);
        let least = kappa * x0 + m * (4.0 * b / ((1.0 + b) * (1.0 + b))).ln();
        // Both parameters are positive, so that the distribution exists.
        let Ok(beta) = Beta::new(0.5 * m, 0.5 * m) else {
            return self.direction.iter().copied().collect();
        };
        let along = loop {
            let z: f64 = beta.sample(rng);
            let w = (1.0 - (1.0 + b) * z) / (1.0 - (1.0 - b) * z);
            if kappa * w + m * (1.0 - x0 * w).ln() - least >= rng.random::<f64>().ln() {
                break w;
            }
        };
        let side = loop {
            let noise = DVector::<f64>::from_fn(d, |_, _| StandardNormal.sample(rng));
            let side = &noise - noise.dot(&self.direction) * &self.direction;
            if side.norm() > 1e-6 * noise.norm() {
                break side.normalize();
            }
        };
        let across = ((1.0 - along) * (1.0 + along)).max(0.0).sqrt();
        (along * &self.direction + across * side)
            .normalize()
            .iter()
            .copied()
            .collect()
    }
}

/// log C_d(κ) + κ: the log density at the mean direction.
pub(crate) fn log_normalizer(d: usize, kappa: f64) -> f64 {
    let half = 0.5 * d as f64;
    if kappa == 0.0 {
        // One over the sphere's surface, 2 π^(d/2) / Γ(d/2).
        return crate::bessel::log_gamma(half) - std::f64::consts::LN_2 - half * std::f64::consts::PI.ln();
    }
    let nu = half - 1.0;
    nu * kappa.ln() - half * LOG_TAU - log_bessel_scaled(nu, kappa)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::bessel::bessel_ratio;

    fn around(direction: &[f64], concentration: f64) -> VonMisesFisher {
        VonMisesFisher {
            weight: 1.0,
            direction: DVector::from_column_slice(direction).normalize(),
            concentration,
        }
    }

    #[test]
    fn the_density_integrates_to_one_on_circle_and_sphere() {
        for kappa in [0.0, 1e-4, 0.7, 12.0, 400.0] {
            let n = 4000;
            let circle = around(&[0.6, 0.8], kappa);
            let sum: f64 = (0..n)
                .map(|i| {
                    let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
                    circle.log_density(&[angle.cos(), angle.sin()]).exp()
                })
                .sum();
            assert!(
                (sum * std::f64::consts::TAU / f64::from(n) - 1.0).abs() < 1e-9,
                "{kappa}"
            );
            // Rings about the mean direction: ∫ 2π f(cos θ) d cos θ, midpoint rule.
            let sphere = around(&[0.0, 0.0, 1.0], kappa);
            let n = 200_000;
            let sum: f64 = (0..n)
                .map(|i| {
                    let z = -1.0 + (2.0 * f64::from(i) + 1.0) / f64::from(n);
                    sphere.log_density(&[(1.0 - z * z).sqrt(), 0.0, z]).exp()
                })
                .sum();
            assert!(
                (sum * 2.0 * std::f64::consts::TAU / f64::from(n) - 1.0).abs() < 1e-5,
                "{kappa}"
            );
        }
    }

    #[test]
    fn samples_are_unit_vectors_with_the_right_mean() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for (d, kappa) in [(2, 0.0), (2, 5.0), (3, 0.5), (3, 1e6), (4, 30.0), (8, 100.0)] {
            let mut direction = vec![0.0; d];
            (direction[0], direction[d - 1]) = (0.6, -0.8);
            let component = around(&direction, kappa);
            let n = 4000;
            let mut mean = DVector::<f64>::zeros(d);
            for _ in 0..n {
                let x = component.sample(&mut rng);
                assert!((x.iter().map(|v| v * v).sum::<f64>() - 1.0).abs() < 1e-12);
                mean += DVector::from_vec(x) / f64::from(n);
            }
            let expected = bessel_ratio(0.5 * d as f64 - 1.0, kappa);
            let along = mean.dot(&component.direction);
            assert!(
                (along - expected).abs()
                    < 0.04 * (1.0 - expected).min(1.0) + 1e-12 + 0.03 * f64::from(kappa < 2.0),
                "{d} {kappa}: {along} against {expected}"
            );
        }
    }
}
