//! Fitting mixtures of von Mises–Fisher distributions: EM in the log domain, components by BIC.
//!
//! The M-step takes the weighted mean x̄ of a component: its direction is x̄/|x̄|, and its concentration solves
//! A_d(κ) = I_{d/2}(κ) / I_{d/2−1}(κ) = |x̄|, by bisection on log κ, as A_d rises from 0 to 1. Both are exact maximizers
//! under the bound on κ, so the likelihood never falls. See Banerjee, Dhillon, Ghosh and Sra (2005).

use nalgebra::DVector;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::bessel::bessel_ratio;
use crate::gaussian::log_sum_exp;
use crate::statistics::DirectionSum;
use crate::von_mises_fisher::{VonMisesFisher, log_mixture, log_normalizer, n_direction_parameters};

/// Concentration below which a component is as good as uniform.
const LEAST_CONCENTRATION: f64 = 1e-6;
/// Halvings of log κ: to the last digit.
const HALVINGS: usize = 70;
/// BIC differences below this are no evidence; the smaller mixture wins.
const NEAR_TIE: f64 = 2.0;

/// Unit vectors of one cell, and what each counts.
pub(crate) struct Directions {
    pub d: usize,
    pub x: Vec<Vec<f64>>,
    pub weights: Vec<f64>,
    /// Of each component, over rows that are no longer here; empty for none.
    pub earlier: Vec<DirectionSum>,
}

/// How directions are fitted.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DirectionOptions {
    pub restarts: usize,
    pub max_steps: usize,
    pub tolerance: f64,
    /// Largest κ.
    pub most: f64,
}

/// A fitted mixture.
#[derive(Debug, Clone)]
pub(crate) struct DirectionFit {
    pub components: Vec<VonMisesFisher>,
    /// Σ w log p.
    pub log_likelihood: f64,
    /// The log-likelihood after each step.
    pub objectives: Vec<f64>,
    pub converged: bool,
}

impl Directions {
    /// Weight of all rows, earlier ones included.
    pub fn total(&self) -> f64 {
        let earlier = self.earlier.iter().map(|part| part.mass);
        self.weights.iter().copied().chain(earlier).sum()
    }

    /// Goes on from the earlier rows with their number of components, or with one.
    pub fn go_on(&self, one: bool, options: DirectionOptions) -> DirectionFit {
        let k = if one { 1 } else { self.earlier.len().max(1) };
        if k == 1 {
            return self.run(vec![vec![1.0]; self.x.len()], 1, options);
        }
        let start = self.maximize(&vec![vec![0.0; k]; self.x.len()], k, options.most);
        self.run(self.expect(&start).0, k, options)
    }

    /// Σ r and Σ r x of each component, earlier rows included.
    pub fn sums(&self, components: &[VonMisesFisher]) -> Vec<DirectionSum> {
        self.gather(&self.expect(components).0, components.len())
    }

    /// −2 log L + parameters · log n.
    pub fn bic(&self, fit: &DirectionFit) -> f64 {
        let p = n_direction_parameters(fit.components.len(), self.d) as f64;
        -2.0 * fit.log_likelihood + p * self.total().max(1.0).ln()
    }

    /// Σ w log p.
    pub fn log_likelihood(&self, components: &[VonMisesFisher]) -> f64 {
        self.x
            .iter()
            .zip(&self.weights)
            .map(|(x, w)| w * log_mixture(components, x))
            .sum()
    }

    /// Fits 1 to `max` components, at most one per 2 d rows, in parallel; all fits, and which has the least BIC (near
    /// ties to fewer).
    pub fn fit_by_bic(&self, max: usize, options: DirectionOptions, seed: u64) -> (Vec<DirectionFit>, usize) {
        let most = max.min((self.total() / (2 * self.d) as f64) as usize).max(1);
        let fits: Vec<DirectionFit> = (1..=most)
            .into_par_iter()
            .map(|k| self.fit(k, options, seed))
            .collect();
        let bics: Vec<f64> = fits.iter().map(|fit| self.bic(fit)).collect();
        let least = bics.iter().copied().fold(f64::INFINITY, f64::min);
        let best = bics.iter().position(|bic| *bic <= least + NEAR_TIE).unwrap_or(0);
        (fits, best)
    }

    /// The best of several starts; components that lose their rows are dropped.
    pub fn fit(&self, k: usize, options: DirectionOptions, seed: u64) -> DirectionFit {
        let mut best: Option<DirectionFit> = None;
        let restarts = if k == 1 { 1 } else { options.restarts.max(1) };
        for restart in 0..restarts {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream((k * 1024 + restart) as u64);
            let fit = self.run(self.cluster(k, &mut rng), k, options);
            if best
                .as_ref()
                .is_none_or(|best| fit.log_likelihood > best.log_likelihood)
            {
                best = Some(fit);
            }
        }
        let Some(mut fit) = best else {
            unreachable!("there is at least one start")
        };
        // A component needs more rows than its mean has coordinates.
        while let Some(lost) = self.lost(&fit) {
            fit.components.remove(lost);
            let total: f64 = fit.components.iter().map(|c| c.weight).sum();
            for component in &mut fit.components {
                component.weight /= total;
            }
            let responsibilities = self.expect(&fit.components).0;
            fit = self.run(responsibilities, fit.components.len(), options);
        }
        fit
    }

    fn lost(&self, fit: &DirectionFit) -> Option<usize> {
        let least = (self.d + 1) as f64 / self.total().max(1.0);
        (0..fit.components.len())
            .filter(|&c| fit.components.len() > 1 && fit.components[c].weight < least)
            .min_by(|&a, &b| fit.components[a].weight.total_cmp(&fit.components[b].weight))
    }

    fn run(&self, start: Vec<Vec<f64>>, k: usize, options: DirectionOptions) -> DirectionFit {
        let enough = options.tolerance * self.total();
        let mut components = self.maximize(&start, k, options.most);
        let (mut responsibilities, mut log_likelihood) = self.expect(&components);
        let mut objectives = vec![log_likelihood];
        let mut converged = components.len() == 1;
        while !converged && objectives.len() <= options.max_steps {
            components = self.maximize(&responsibilities, k, options.most);
            let last = log_likelihood;
            (responsibilities, log_likelihood) = self.expect(&components);
            objectives.push(log_likelihood);
            converged = log_likelihood - last < enough;
        }
        DirectionFit {
            components,
            log_likelihood,
            objectives,
            converged,
        }
    }

    fn expect(&self, components: &[VonMisesFisher]) -> (Vec<Vec<f64>>, f64) {
        let constants: Vec<f64> = components
            .iter()
            .map(|c| c.weight.ln() + log_normalizer(self.d, c.concentration))
            .collect();
        let mut log_likelihood = 0.0;
        let responsibilities = self
            .x
            .iter()
            .zip(&self.weights)
            .map(|(x, weight)| {
                let mut row: Vec<f64> = components
                    .iter()
                    .zip(&constants)
                    .map(|(c, constant)| {
                        let square: f64 = x
                            .iter()
                            .zip(c.direction.iter())
                            .map(|(a, b)| (a - b) * (a - b))
                            .sum();
                        constant - 0.5 * c.concentration * square
                    })
                    .collect();
                let total = log_sum_exp(&row);
                log_likelihood += weight * total;
                for value in &mut row {
                    *value = (*value - total).exp();
                }
                row
            })
            .collect();
        // Earlier rows stay with their components: |x − μ|² = 2 − 2 μ·x.
        for ((part, component), constant) in self.earlier.iter().zip(components).zip(&constants) {
            let along: f64 = component
                .direction
                .iter()
                .zip(&part.sum)
                .map(|(a, b)| a * b)
                .sum();
            log_likelihood += part.mass * constant - component.concentration * (part.mass - along);
        }
        (responsibilities, log_likelihood)
    }

    fn gather(&self, responsibilities: &[Vec<f64>], k: usize) -> Vec<DirectionSum> {
        (0..k)
            .map(|c| {
                let mut part = if k == self.earlier.len() {
                    self.earlier[c].clone()
                } else {
                    DirectionSum::together(self.d, self.earlier.iter().filter(|_| c == 0))
                };
                for ((x, weight), row) in self.x.iter().zip(&self.weights).zip(responsibilities) {
                    let share = weight * row[c];
                    part.mass += share;
                    for (sum, x) in part.sum.iter_mut().zip(x) {
                        *sum += share * x;
                    }
                }
                part
            })
            .collect()
    }

    fn maximize(&self, responsibilities: &[Vec<f64>], k: usize, most: f64) -> Vec<VonMisesFisher> {
        let total = self.total();
        self.gather(responsibilities, k)
            .into_iter()
            .map(|DirectionSum { mass, sum }| {
                let sum = DVector::from_vec(sum);
                let length = sum.norm();
                // No rows, or rows that cancel: uniform, whatever the direction.
                if mass <= 0.0 || length <= 1e-12 * mass {
                    let mut direction = DVector::zeros(self.d);
                    direction[0] = 1.0;
                    return VonMisesFisher {
                        weight: if total > 0.0 { mass / total } else { 1.0 },
                        direction,
                        concentration: 0.0,
                    };
                }
                VonMisesFisher {
                    weight: mass / total,
                    direction: sum / length,
                    concentration: concentration(self.d, length / mass, most),
                }
            })
            .collect()
    }

    /// k-means++ by distance on the sphere and some Lloyd steps, softened.
    fn cluster(&self, k: usize, rng: &mut impl Rng) -> Vec<Vec<f64>> {
        let square = |x: &[f64], c: &[f64]| -> f64 { x.iter().zip(c).map(|(a, b)| (a - b) * (a - b)).sum() };
        let mut centers: Vec<Vec<f64>> = Vec::with_capacity(k);
        let mut far = vec![1.0; self.x.len()];
        while centers.len() < k {
            let shares: Vec<f64> = far.iter().zip(&self.weights).map(|(f, w)| f * w).collect();
            let mut left = rng.random::<f64>() * shares.iter().sum::<f64>();
            let mut chosen = 0;
            for (i, share) in shares.iter().enumerate().filter(|(_, share)| **share > 0.0) {
                chosen = i;
                left -= share;
                if left < 0.0 {
                    break;
                }
            }
            let Some(center) = self.x.get(chosen).cloned() else {
                break;
            };
            for (far, x) in far.iter_mut().zip(&self.x) {
                let here = square(x, &center);
                *far = if centers.is_empty() { here } else { far.min(here) };
            }
            centers.push(center);
        }
        let mut label = vec![0; self.x.len()];
        for _ in 0..8 {
            for (label, x) in label.iter_mut().zip(&self.x) {
                let mut least = f64::INFINITY;
                for (c, center) in centers.iter().enumerate() {
                    let here = square(x, center);
                    if here < least {
                        (least, *label) = (here, c);
                    }
                }
            }
            for (c, center) in centers.iter_mut().enumerate() {
                let mut sum = vec![0.0; self.d];
                for (i, x) in self.x.iter().enumerate().filter(|(i, _)| label[*i] == c) {
                    for (sum, x) in sum.iter_mut().zip(x) {
                        *sum += self.weights[i] * x;
                    }
                }
                let length = sum.iter().map(|v| v * v).sum::<f64>().sqrt();
                if length > 0.0 {
                    *center = sum.into_iter().map(|v| v / length).collect();
                }
            }
        }
        let rest = if k == 1 { 0.0 } else { 0.1 / (k - 1) as f64 };
        let own = if k == 1 { 1.0 } else { 0.9 };
        label
            .into_iter()
            .map(|l| (0..k).map(|c| if c == l { own } else { rest }).collect())
            .collect()
    }
}

/// κ with A_d(κ) = r, between 0 and `most`.
pub(crate) fn concentration(d: usize, r: f64, most: f64) -> f64 {
    let nu = 0.5 * d as f64 - 1.0;
    if bessel_ratio(nu, most) <= r {
        return most;
    }
    if bessel_ratio(nu, LEAST_CONCENTRATION) >= r {
        return 0.0;
    }
    let (mut low, mut high) = (LEAST_CONCENTRATION.ln(), most.ln());
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if bessel_ratio(nu, middle.exp()) < r {
            low = middle;
        } else {
            high = middle;
        }
    }
    (0.5 * (low + high)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::von_mises_fisher::MAX_CONCENTRATION;

    const OPTIONS: DirectionOptions = DirectionOptions {
        restarts: 5,
        max_steps: 300,
        tolerance: 1e-6,
        most: MAX_CONCENTRATION,
    };

    #[test]
    fn the_concentration_comes_back_from_the_mean_length() {
        for d in [2, 3, 4, 10] {
            for kappa in [1e-3, 0.5, 20.0, 33.0, 1e3, 9e5] {
                let r = bessel_ratio(0.5 * f64::from(d) - 1.0, kappa);
                let found = concentration(d as usize, r, MAX_CONCENTRATION);
                assert!((found - kappa).abs() < 1e-8 * kappa, "{d} {kappa}: {found}");
            }
        }
        assert_eq!(concentration(3, 1.0, MAX_CONCENTRATION), MAX_CONCENTRATION);
        assert_eq!(concentration(3, 0.0, MAX_CONCENTRATION), 0.0);
    }

    #[test]
    fn refitting_samples_recovers_the_mixture_and_never_loses_likelihood() {
        let part = |weight, direction: [f64; 3], concentration| VonMisesFisher {
            weight,
            direction: DVector::from_column_slice(&direction).normalize(),
            concentration,
        };
        let truth = [part(0.6, [0.0, 0.0, 1.0], 50.0), part(0.4, [1.0, 0.5, -0.5], 8.0)];
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let x: Vec<Vec<f64>> = (0..1500)
            .map(|i| truth[usize::from(i % 5 >= 3)].sample(&mut rng))
            .collect();
        let rows = Directions {
            d: 3,
            weights: vec![1.0; x.len()],
            x,
            earlier: vec![],
        };
        let (fits, best) = rows.fit_by_bic(4, OPTIONS, 1);
        assert_eq!(fits[best].components.len(), 2);
        for fit in &fits {
            for pair in fit.objectives.windows(2) {
                assert!(pair[1] >= pair[0] - 1e-9 * pair[0].abs());
            }
        }
        for true_part in &truth {
            let near = fits[best]
                .components
                .iter()
                .find(|c| c.direction.dot(&true_part.direction) > 0.99)
                .expect("a component near each true one");
            assert!((near.weight - true_part.weight).abs() < 0.03);
            assert!((near.concentration / true_part.concentration).ln().abs() < 0.2);
        }
    }

    #[test]
    fn equal_and_opposite_rows_do_no_harm() {
        let same = Directions {
            d: 3,
            x: vec![vec![1.0, 0.0, 0.0]; 20],
            weights: vec![1.0; 20],
            earlier: vec![],
        };
        assert_eq!(
            same.fit(1, OPTIONS, 0).components[0].concentration,
            MAX_CONCENTRATION
        );
        let opposite = Directions {
            d: 2,
            x: (0..20)
                .map(|i| vec![if i % 2 == 0 { 1.0 } else { -1.0 }, 0.0])
                .collect(),
            weights: vec![1.0; 20],
            earlier: vec![],
        };
        let one = opposite.fit(1, OPTIONS, 0);
        assert_eq!(one.components[0].concentration, 0.0);
        assert!((one.log_likelihood + 20.0 * std::f64::consts::TAU.ln()).abs() < 1e-9);
        assert_eq!(opposite.fit(2, OPTIONS, 0).components.len(), 2);
    }
}
