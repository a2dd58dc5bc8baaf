//! What a continuous node with a set of parents is worth: a mixture of regressions for each configuration, with more
//! components while each is worth its price.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::family_score::{Members, Scorer, StructureScore, mixed};
use crate::cpd::{Sign, Weights, n_mixture_parameters};
use crate::em::{Rows, row_log_densities};
use crate::moments::{CovariancePrior, Mixing, RIDGE, Settings};
use crate::network::{MixtureOrder, MixtureSpec};
use crate::start::{FitOptions, fit_mixture};

/// EM steps after which a further component must have paid half its price, or is given up.
const TRIAL_STEPS: usize = 12;
/// Share of that price.
const TRIAL_SHARE: f64 = 0.5;
/// Rows per free parameter of one component, as in training.
const ROWS_PER_PARAMETER: f64 = 2.0;

/// A continuous node with one set of parents.
pub(super) struct MixtureFamily<'a> {
    pub scorer: &'a Scorer,
    pub y: &'a [Vec<f64>],
    pub parents: Vec<&'a Vec<Vec<f64>>>,
    pub spec: &'a MixtureSpec,
    pub floor: &'a [f64],
    pub stream: u64,
}

/// A mixture of one cell with its unpenalised log-likelihood there.
struct CellFit {
    mixing: Mixing,
    log_likelihood: f64,
    n_parameters: usize,
}

impl MixtureFamily<'_> {
    pub fn score(&self, members: &Members) -> f64 {
        match self.scorer.score {
            StructureScore::Bic => {
                let all: Vec<usize> = (0..members.rows.len()).collect();
                let cells = self.fit(members, &all);
                let log_n = members.log_n();
                cells
                    .iter()
                    .map(|cell| cell.log_likelihood - 0.5 * cell.n_parameters as f64 * log_n)
                    .sum()
            }
            StructureScore::CrossValidated { folds } => (0..folds)
                .map(|fold| {
                    let (held, known): (Vec<usize>, Vec<usize>) =
                        (0..members.rows.len()).partition(|&i| self.scorer.folds[members.rows[i]] == fold);
                    let cells = self.fit(members, &known);
                    (0..cells.len())
                        .map(|cell| {
                            let rows = self.rows(members, &self.of_cell(members, &held, cell));
                            weighted(&rows, &cells[cell].mixing)
                        })
                        .sum::<f64>()
                })
                .sum(),
        }
    }

    fn shared(&self) -> bool {
        self.spec.weights == Weights::Shared
    }

    fn of_cell(&self, members: &Members, among: &[usize], cell: usize) -> Vec<usize> {
        among
            .iter()
            .copied()
            .filter(|&i| self.shared() || members.configurations[i] == cell)
            .collect()
    }

    /// One mixture per configuration, or a single one where components are shared.
    fn fit(&self, members: &Members, among: &[usize]) -> Vec<CellFit> {
        let n_cells = if self.shared() {
            1
        } else {
            members.n_configurations
        };
        let log_n = members.log_n();
        let mut pooled: Option<CellFit> = None;
        (0..n_cells)
            .map(|cell| {
                let rows = self.rows(members, &self.of_cell(members, among, cell));
                if n_cells == 1 || rows.total_weight() >= rows.settings.least_mass() {
                    return self.best(&rows, cell, log_n);
                }
                // Too few rows: one component over all configurations stands in, as in training. It costs as much as
                // one of the cell's own, so that splitting rows thinly never pays.
                let pooled = pooled.get_or_insert_with(|| {
                    let all = self.rows(members, among);
                    self.fit_one(&all, 1, cell, self.scorer.max_steps)
                });
                CellFit {
                    mixing: pooled.mixing.clone(),
                    log_likelihood: weighted(&rows, &pooled.mixing),
                    n_parameters: pooled.n_parameters,
                }
            })
            .collect()
    }

    /// As many components as the score asks for: more while each is worth its price.
    fn best(&self, rows: &Rows, cell: usize, log_n: f64) -> CellFit {
        let carried = (rows.total_weight() / rows.settings.least_mass()) as usize;
        let most = match self.spec.order {
            MixtureOrder::Fixed(k) => {
                return self.fit_one(rows, k.min(carried).max(1), cell, self.scorer.max_steps);
            }
            MixtureOrder::Bic { max, .. } => max.min(self.scorer.max_components),
        };
        let one = n_mixture_parameters(1, rows.settings.d, rows.settings.q) as f64;
        let most = most
            .min((rows.total_weight() / (ROWS_PER_PARAMETER * one)) as usize)
            .min(carried);
        let mut best = self.fit_one(rows, 1, cell, self.scorer.max_steps);
        for k in 2..=most {
            let worth = |fit: &CellFit| fit.log_likelihood - 0.5 * fit.n_parameters as f64 * log_n;
            let trial = self.fit_one(rows, k, cell, TRIAL_STEPS);
            let price = 0.5 * (trial.n_parameters.saturating_sub(best.n_parameters)) as f64 * log_n;
            if trial.log_likelihood - best.log_likelihood < TRIAL_SHARE * price {
                break;
            }
            let fit = self.fit_one(rows, k, cell, self.scorer.max_steps);
            let fit = if worth(&trial) > worth(&fit) { trial } else { fit };
            if worth(&fit) <= worth(&best) {
                break;
            }
            best = fit;
        }
        best
    }

    fn fit_one(&self, rows: &Rows, k: usize, cell: usize, max_steps: usize) -> CellFit {
        let options = FitOptions {
            restarts: self.scorer.restarts,
            max_steps,
            tolerance: 1e-5,
        };
        let mut rng = ChaCha8Rng::seed_from_u64(mixed(self.stream, k, &[cell]));
        let fit = fit_mixture(rows, k, None, options, &mut rng).fit;
        CellFit {
            n_parameters: rows.settings.n_parameters(fit.mixing.k(), rows.ends.len()),
            log_likelihood: fit.log_likelihood,
            mixing: fit.mixing,
        }
    }

    fn rows(&self, members: &Members, cell: &[usize]) -> Rows {
        let d = self.spec.columns.len();
        let q = self
            .parents
            .iter()
            .map(|parent| parent.first().map_or(0, Vec::len))
            .sum::<usize>();
        // Shared components have weights for each configuration, whose rows stand together.
        let mut cell = cell.to_vec();
        let mut ends = vec![cell.len()];
        if self.shared() {
            cell.sort_by_key(|&i| members.configurations[i]);
            ends = (0..members.n_configurations)
                .map(|end| cell.partition_point(|&i| members.configurations[i] <= end))
                .collect();
        }
        let mut z = Vec::with_capacity(cell.len() * (d + 1 + q));
        for &i in &cell {
            let row = members.rows[i];
            z.extend_from_slice(&self.y[row]);
            z.push(1.0);
            for parent in &self.parents {
                z.extend_from_slice(&parent[row]);
            }
        }
        Rows {
            settings: Settings {
                d,
                q,
                weights: if self.shared() {
                    Weights::Shared
                } else {
                    Weights::PerConfiguration
                },
                tied: self.spec.shared_covariance,
                floor: self.floor.to_vec(),
                latent_sign: self.spec.sign == Sign::Latent,
                ridge: vec![RIDGE; 1 + q],
                prior: CovariancePrior::WEAK,
            },
            z,
            weights: cell.iter().map(|&i| members.weights[i]).collect(),
            ends,
            earlier: Vec::new(),
            kept: std::sync::OnceLock::new(),
        }
    }
}

/// Σ w log p of rows.
fn weighted(rows: &Rows, mixing: &Mixing) -> f64 {
    if rows.n() == 0 {
        return 0.0;
    }
    let densities = row_log_densities(rows, mixing);
    densities
        .iter()
        .zip(&rows.weights)
        .map(|(density, weight)| density * weight)
        .sum()
}
