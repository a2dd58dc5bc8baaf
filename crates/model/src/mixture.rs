//! A mixture of Gaussians: density, moments, modes, samples.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::gaussian::{LOG_TAU, log_sum_exp, solve_lower, solve_lower_transpose};
use crate::lanes::{LANES, Lanes, LogSums, norm_of_product};
use crate::root_gaussian::{covariance_of, triangular_root};
use crate::sphere::log_sphere_normalizer;

/// Starts of the search for modes: the heaviest components.
const MODE_STARTS: usize = 256;
/// Steps of the search from one start.
const MODE_STEPS: usize = 500;
/// Two modes closer than this many standard deviations are one.
const SAME_MODE: f64 = 1e-4;

/// One weighted piece of an answer: states of the discrete targets, a Gaussian over the continuous ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// Natural logarithm of its share; the shares of an answer sum to 1.
    pub log_weight: f64,
    /// State of each discrete target, in the order asked for.
    pub states: Vec<usize>,
    /// Mean over the continuous targets' dimensions, in the order asked for.
    pub mean: DVector<f64>,
    /// Covariance of the same; zero rows for a target that was observed.
    pub covariance: DMatrix<f64>,
    root: DMatrix<f64>,
}

impl Term {
    pub(crate) fn new(log_weight: f64, states: Vec<usize>, mean: DVector<f64>, root: DMatrix<f64>) -> Self {
        Self {
            log_weight,
            states,
            covariance: covariance_of(&root),
            mean,
            root,
        }
    }

    /// Its Gaussian over the given dimensions, without states.
    pub(crate) fn over(&self, dims: &[usize]) -> Self {
        let (mean, root) = (self.mean.select_rows(dims), self.root.select_rows(dims));
        Self::new(self.log_weight, Vec::new(), mean, root)
    }

    /// root · rootᵀ is the covariance.
    pub(crate) fn root(&self) -> &DMatrix<f64> {
        &self.root
    }
}

/// A mixture of Gaussians.
#[derive(Debug, Clone, PartialEq)]
pub struct Mixture {
    components: Vec<Term>,
    factors: Vec<Option<Factor>>,
}

/// What a density needs of a component, worked out once.
#[derive(Debug, Clone, PartialEq)]
struct Factor {
    /// log weight − ½ d log 2π − log |L|.
    constant: f64,
    /// L⁻¹, row by row, the zeros left out: |L⁻¹ (x − mean)|² is the squared distance.
    white: Vec<f64>,
    lower: DMatrix<f64>,
}

impl Factor {
    fn new(term: &Term) -> Option<Self> {
        let lower = triangular_root(&term.root)?;
        let d = lower.nrows();
        let inverse = solve_lower(&lower, &DMatrix::identity(d, d));
        let log_root: f64 = (0..d).map(|i| lower[(i, i)].ln()).sum();
        Some(Self {
            constant: term.log_weight - 0.5 * d as f64 * LOG_TAU - log_root,
            white: (0..d)
                .flat_map(|i| (0..=i).map(|j| inverse[(i, j)]).collect::<Vec<_>>())
                .collect(),
            lower,
        })
    }

    /// log of weight times density.
    fn log_term(&self, point: &[f64], mean: &[f64], away: &mut [f64]) -> f64 {
        for ((away, x), m) in away.iter_mut().zip(point).zip(mean) {
            *away = x - m;
        }
        let mut square = 0.0;
        let mut row = &self.white[..];
        for i in 0..away.len() {
            let (here, rest) = row.split_at(i + 1);
            let white: f64 = here.iter().zip(away.iter()).map(|(w, a)| w * a).sum();
            square += white * white;
            row = rest;
        }
        self.constant - 0.5 * square
    }
}

impl Mixture {
    pub(crate) fn new(components: Vec<Term>) -> Self {
        let factors = components.iter().map(Factor::new).collect();
        Self { components, factors }
    }

    /// The marginal over some dimensions, in the given order.
    pub(crate) fn over(&self, dims: &[usize]) -> Self {
        Self::new(self.components.iter().map(|term| term.over(dims)).collect())
    }

    /// Its components: weights, means and covariances.
    pub fn components(&self) -> &[Term] {
        &self.components
    }

    /// Dimension.
    pub fn dim(&self) -> usize {
        self.components.first().map_or(0, |term| term.mean.len())
    }

    /// Mean of the whole mixture.
    pub fn mean(&self) -> DVector<f64> {
        let mut mean = DVector::zeros(self.dim());
        for term in &self.components {
            mean += term.log_weight.exp() * &term.mean;
        }
        mean
    }

    /// Covariance of the whole mixture: within the components and between them.
    pub fn covariance(&self) -> DMatrix<f64> {
        let mean = self.mean();
        let mut covariance = DMatrix::zeros(self.dim(), self.dim());
        for term in &self.components {
            let away = &term.mean - &mean;
            covariance += term.log_weight.exp() * (&term.covariance + &away * away.transpose());
        }
        covariance
    }

    /// Natural logarithm of the density at a point; `None` where a component is singular.
    pub fn log_density(&self, point: &[f64]) -> Option<f64> {
        self.log_densities(&[point]).map(|all| all[0])
    }

    /// [`Mixture::log_density`] at many points; `None` where a component is singular.
    pub fn log_densities<P: AsRef<[f64]>>(&self, points: &[P]) -> Option<Vec<f64>> {
        let factors: Vec<&Factor> = self.factors.iter().map(Option::as_ref).collect::<Option<_>>()?;
        let mut out = Vec::with_capacity(points.len());
        for block in points.chunks(LANES) {
            let point = |lane: usize| block[lane.min(block.len() - 1)].as_ref();
            let x: Vec<Lanes> = (0..self.dim())
                .map(|i| std::array::from_fn(|lane| point(lane)[i]))
                .collect();
            // The compiler unrolls what it knows the size of.
            let sums = match self.dim() {
                1 => self.log_sums(1, &factors, &x),
                2 => self.log_sums(2, &factors, &x),
                3 => self.log_sums(3, &factors, &x),
                4 => self.log_sums(4, &factors, &x),
                d => self.log_sums(d, &factors, &x),
            };
            out.extend_from_slice(&sums[..block.len()]);
        }
        Some(out)
    }

    /// Log densities at several points, coordinate by coordinate.
    #[inline(always)]
    #[expect(
        clippy::inline_always,
        reason = "unrolled where the dimension is known when compiling"
    )]
    fn log_sums(&self, d: usize, factors: &[&Factor], x: &[Lanes]) -> Lanes {
        let mut sums = LogSums::default();
        let mut away = vec![[0.0; LANES]; d];
        for (factor, term) in factors.iter().zip(&self.components) {
            for ((away, x), mean) in away.iter_mut().zip(x).zip(term.mean.iter()) {
                for lane in 0..LANES {
                    away[lane] = x[lane] - mean;
                }
            }
            let square = norm_of_product(&factor.white, &away[..d]);
            sums.add(&square.map(|square| factor.constant - 0.5 * square));
        }
        sums.values()
    }

    /// log ∫ density over the unit sphere; `None` where a component is singular. `log_density` minus this is the
    /// logarithm of the density on the sphere.
    pub fn log_sphere_normalizer(&self) -> Option<f64> {
        let mut terms = Vec::with_capacity(self.components.len());
        for (term, factor) in self.components.iter().zip(&self.factors) {
            factor.as_ref()?;
            terms.push(term.log_weight + log_sphere_normalizer(&term.mean, &term.covariance)?);
        }
        Some(log_sum_exp(&terms))
    }

    /// The highest mode; `None` where a component is singular.
    pub fn mode(&self) -> Option<DVector<f64>> {
        self.modes()?.into_iter().next().map(|(mode, _)| mode)
    }

    /// The modes with the natural logarithm of their density, the highest first; `None` where a component is singular.
    ///
    /// From the mean of each component (the heaviest 256) the density is climbed by x ← (Σ rₖ Σₖ⁻¹)⁻¹ Σ rₖ Σₖ⁻¹ mₖ, with
    /// r the responsibilities at x, which never goes down.
    pub fn modes(&self) -> Option<Vec<(DVector<f64>, f64)>> {
        let factors: Vec<&Factor> = self.factors.iter().map(Option::as_ref).collect::<Option<_>>()?;
        let d = self.dim();
        let mut order: Vec<usize> = (0..self.components.len()).collect();
        order.sort_by(|&a, &b| {
            self.components[b]
                .log_weight
                .total_cmp(&self.components[a].log_weight)
        });
        let mut found: Vec<(DVector<f64>, f64)> = Vec::new();
        let deviations: Vec<f64> = self.covariance().diagonal().iter().map(|v| v.sqrt()).collect();
        let apart = |a: &DVector<f64>, b: &DVector<f64>| {
            (0..d).any(|i| (a[i] - b[i]).abs() > SAME_MODE * deviations[i])
        };
        for &start in order.iter().take(MODE_STARTS) {
            let mut x = self.components[start].mean.clone();
            for _ in 0..MODE_STEPS {
                let next = self.climb(&factors, &x);
                let still = (0..d).all(|i| (next[i] - x[i]).abs() <= 1e-10 * deviations[i]);
                x = next;
                if still {
                    break;
                }
            }
            let density = self.log_density(x.as_slice())?;
            if found.iter().all(|(other, _)| apart(other, &x)) {
                found.push((x, density));
            }
        }
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        Some(found)
    }

    fn climb(&self, factors: &[&Factor], x: &DVector<f64>) -> DVector<f64> {
        let d = self.dim();
        let mut away = vec![0.0; d];
        let logs: Vec<f64> = factors
            .iter()
            .zip(&self.components)
            .map(|(factor, term)| factor.log_term(x.as_slice(), term.mean.as_slice(), &mut away))
            .collect();
        let all = log_sum_exp(&logs);
        let mut precision = DMatrix::zeros(d, d);
        let mut pull = DVector::zeros(d);
        for ((factor, term), log) in factors.iter().zip(&self.components).zip(&logs) {
            let share = (log - all).exp();
            if share < f64::EPSILON * 1e-4 {
                continue;
            }
            let identity = DMatrix::identity(d, d);
            let inverse = solve_lower_transpose(&factor.lower, &solve_lower(&factor.lower, &identity));
            pull += share * (&inverse * (&term.mean - x));
            precision += share * inverse;
        }
        match precision.cholesky() {
            Some(factor) => x + factor.solve(&pull),
            None => x.clone(),
        }
    }

    /// Points drawn from the mixture; the same seed gives the same points.
    pub fn sample(&self, n: usize, seed: u64) -> Vec<Vec<f64>> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..n)
            .filter_map(|_| draw(&self.components, &mut rng).map(|(_, point)| point))
            .collect()
    }
}

/// A term by weight, and a point of its Gaussian.
pub(crate) fn draw<'a>(terms: &'a [Term], rng: &mut ChaCha8Rng) -> Option<(&'a Term, Vec<f64>)> {
    let mut left = rng.random::<f64>() * terms.iter().map(|term| term.log_weight.exp()).sum::<f64>();
    let mut chosen = terms.first()?;
    for term in terms {
        let weight = term.log_weight.exp();
        if weight > 0.0 {
            chosen = term;
            left -= weight;
        }
        if left <= 0.0 && weight > 0.0 {
            break;
        }
    }
    let noise = DVector::from_fn(chosen.root.ncols(), |_, _| StandardNormal.sample(rng));
    let point = &chosen.mean + &chosen.root * noise;
    Some((chosen, point.iter().copied().collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair() -> Mixture {
        let term = |weight: f64, at: f64, deviation: f64| {
            let (mean, root) = (
                DVector::from_element(1, at),
                DMatrix::from_element(1, 1, deviation),
            );
            Term::new(weight.ln(), vec![], mean, root)
        };
        Mixture::new(vec![term(0.3, 0.0, 0.5), term(0.7, 3.0, 1.0)])
    }

    #[test]
    fn modes_are_where_the_slope_is_zero() {
        let mixture = pair();
        let modes = mixture.modes().unwrap();
        assert_eq!(modes.len(), 2);
        for (mode, height) in &modes {
            let at = |x: f64| mixture.log_density(&[x]).unwrap();
            assert!(at(mode[0] - 1e-3) < *height && at(mode[0] + 1e-3) < *height);
            assert!((at(mode[0] + 1e-4) - at(mode[0] - 1e-4)).abs() < 1e-9);
        }
        assert!(modes[0].1 > modes[1].1);
    }

    #[test]
    fn samples_have_the_moments_of_the_mixture() {
        let mixture = pair();
        let points = mixture.sample(20_000, 3);
        let mean = points.iter().map(|p| p[0]).sum::<f64>() / 20_000.0;
        let variance = points.iter().map(|p| (p[0] - mean).powi(2)).sum::<f64>() / 20_000.0;
        // Three standard errors of the mean, and of the variance within a factor of the kurtosis.
        let exact = mixture.covariance()[0];
        assert!((mean - mixture.mean()[0]).abs() < 3.0 * (exact / 20_000.0).sqrt());
        assert!((variance / exact - 1.0).abs() < 0.05);
        assert_eq!(points, mixture.sample(20_000, 3));
    }
}
