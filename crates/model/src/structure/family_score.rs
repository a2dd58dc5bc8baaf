//! What one family is worth: a node's distribution given a set of parents, fitted and weighed against its parameters.
//!
//! ```text
//! BIC    Σ w log p(node | parents) − ½ n_parameters log N
//! CV     Σ w log p(node | parents) over held-out folds
//! ```
//!
//! p is the CPD that training would fit: a table, or for each configuration of the discrete parents a mixture of linear
//! regressions on the continuous ones, with as many components as the score asks for. The score of a network is the sum
//! over its families.

use super::mixture_score::MixtureFamily;
use crate::error::ModelError;
use crate::family::Cells;
use crate::network::{MixtureOrder, MixtureSpec, Network, NodeKind, VonMisesFisherSpec};
use crate::table::Table;
use crate::von_mises_fisher::n_direction_parameters;
use crate::von_mises_fisher_fit::Directions;
use crate::von_mises_fisher_train::{direction_options, read_directions};

/// Least pseudo-count of a state under cross-validation, where a state of probability 0 would end every comparison.
const LEAST_PRIOR: f64 = 0.01;

/// Which score a search maximises.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StructureScore {
    /// Log-likelihood − ½ parameters · log rows.
    Bic,
    /// Log density of held-out rows; groups are held out whole where a column names them.
    CrossValidated {
        /// Parts that the rows are cut into, at least 2.
        folds: usize,
    },
}

/// All nodes' values in complete rows, and how to score.
pub(crate) struct Scorer {
    nodes: Vec<NodeData>,
    pub(super) score: StructureScore,
    /// Fold of each row.
    pub(super) folds: Vec<usize>,
    seed: u64,
    pub(super) restarts: usize,
    pub(super) max_steps: usize,
    pub(super) max_components: usize,
}

/// How often each row counts.
#[derive(Debug, Clone)]
pub(crate) struct Sample(pub Vec<f64>);

/// Effort of the fits inside a search.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FitEffort {
    pub seed: u64,
    pub restarts: usize,
    pub max_steps: usize,
    pub max_components: usize,
}

struct NodeData {
    values: Values,
    /// What one row counts as: less than 1 where the node is constant within groups.
    share: f64,
}

enum Values {
    Discrete {
        states: Vec<usize>,
        n_states: usize,
        prior: f64,
    },
    Continuous {
        /// Standardised, one entry per row.
        y: Vec<Vec<f64>>,
        spec: MixtureSpec,
        floor: Vec<f64>,
        /// Σ log of the columns' units: the density's change from standardised units to the columns' own.
        log_unit: f64,
    },
    Direction {
        /// Unit vectors, one per row.
        x: Vec<Vec<f64>>,
        spec: VonMisesFisherSpec,
    },
}

impl Scorer {
    /// Reads a table whose rows are complete. `groups` numbers the rows that belong together.
    pub fn read(
        network: &Network,
        table: &Table,
        groups: Option<&[usize]>,
        score: StructureScore,
        effort: FitEffort,
    ) -> Result<Self, ModelError> {
        let n = table.n_rows();
        let cells = Cells::read(network, table, vec![1.0; n], &[])?;
        let mut nodes = Vec::with_capacity(network.nodes().len());
        for (i, node) in network.nodes().iter().enumerate() {
            let mut share = 1.0;
            let values = match &node.kind {
                NodeKind::Discrete { states, prior } => Values::Discrete {
                    // Rows are complete.
                    states: cells.states[i].iter().map(|state| state.unwrap_or(0)).collect(),
                    n_states: states.len(),
                    prior: *prior,
                },
                NodeKind::VonMisesFisher(spec) => {
                    // Rows are complete.
                    let x: Vec<Vec<f64>> = read_directions(spec, &node.name, table)?
                        .into_iter()
                        .flatten()
                        .collect();
                    if let Some(groups) = groups {
                        share = share_of_constant(&x, groups);
                    }
                    Values::Direction {
                        x,
                        spec: spec.clone(),
                    }
                }
                NodeKind::Mixture(spec) => {
                    let y: Vec<Vec<f64>> = (0..n)
                        .map(|row| cells.values[i].iter().map(|column| column[row]).collect())
                        .collect();
                    if let Some(groups) = groups {
                        share = share_of_constant(&y, groups);
                    }
                    let unit = &cells.scaling[i].standard_deviation;
                    Values::Continuous {
                        floor: spec.noise_floor.iter().zip(unit).map(|(f, s)| f / s).collect(),
                        log_unit: unit.iter().map(|s| s.ln()).sum(),
                        y,
                        spec: spec.clone(),
                    }
                }
            };
            nodes.push(NodeData { values, share });
        }
        let folds = match score {
            StructureScore::Bic => Vec::new(),
            StructureScore::CrossValidated { folds } => (0..n)
                .map(|row| fold_of(groups.map_or(row, |groups| groups[row]), folds, effort.seed))
                .collect(),
        };
        Ok(Self {
            nodes,
            score,
            folds,
            seed: effort.seed,
            restarts: effort.restarts,
            max_steps: effort.max_steps,
            max_components: effort.max_components,
        })
    }

    /// The score of a family, in nats, in the columns' own units.
    pub fn score(&self, sample: &Sample, node: usize, parents: &[usize]) -> f64 {
        let rows: Vec<usize> = (0..sample.0.len()).filter(|&row| sample.0[row] > 0.0).collect();
        let share = self.nodes[node].share;
        let weights: Vec<f64> = rows.iter().map(|&row| sample.0[row] * share).collect();
        let (configurations, n_configurations) = self.configurations(&rows, parents);
        let continuous: Vec<&Vec<Vec<f64>>> = parents
            .iter()
            .filter_map(|&parent| match &self.nodes[parent].values {
                Values::Continuous { y, .. } => Some(y),
                Values::Discrete { .. } | Values::Direction { .. } => None,
            })
            .collect();
        let members = Members {
            rows,
            weights,
            configurations,
            n_configurations,
        };
        match &self.nodes[node].values {
            Values::Discrete {
                states,
                n_states,
                prior,
            } => self.score_table(&members, states, *n_states, *prior),
            Values::Direction { x, spec } => self.score_directions(&members, x, spec, node, parents),
            Values::Continuous {
                y,
                spec,
                floor,
                log_unit,
            } => {
                let mixture = MixtureFamily {
                    scorer: self,
                    y,
                    parents: continuous,
                    spec,
                    floor,
                    stream: mixed(self.seed, node, parents),
                };
                let total: f64 = members.weights.iter().sum();
                mixture.score(&members) - total * log_unit
            }
        }
    }

    /// Configuration of the discrete ones among the parents, per row, and how many there are.
    fn configurations(&self, rows: &[usize], parents: &[usize]) -> (Vec<usize>, usize) {
        let mut configurations = vec![0; rows.len()];
        let mut n = 1;
        for &parent in parents {
            if let Values::Discrete { states, n_states, .. } = &self.nodes[parent].values {
                n *= n_states;
                for (configuration, &row) in configurations.iter_mut().zip(rows) {
                    *configuration = *configuration * n_states + states[row];
                }
            }
        }
        (configurations, n)
    }

    fn score_table(&self, members: &Members, states: &[usize], n_states: usize, prior: f64) -> f64 {
        let count = |keep: &dyn Fn(usize) -> bool| {
            let mut counts = vec![0.0; members.n_configurations * n_states];
            for (i, &row) in members.rows.iter().enumerate().filter(|(_, row)| keep(**row)) {
                counts[members.configurations[i] * n_states + states[row]] += members.weights[i];
            }
            counts
        };
        match self.score {
            StructureScore::Bic => {
                let counts = count(&|_| true);
                let mut sum = 0.0;
                for row in counts.chunks(n_states) {
                    let total: f64 = row.iter().sum();
                    sum += row
                        .iter()
                        .filter(|count| **count > 0.0)
                        .map(|count| count * (count / total).ln())
                        .sum::<f64>();
                }
                sum - 0.5 * (members.n_configurations * (n_states - 1)) as f64 * members.log_n()
            }
            StructureScore::CrossValidated { folds } => (0..folds)
                .map(|fold| {
                    let prior = prior.max(LEAST_PRIOR);
                    let known = count(&|row| self.folds[row] != fold);
                    let held = count(&|row| self.folds[row] == fold);
                    known
                        .chunks(n_states)
                        .zip(held.chunks(n_states))
                        .map(|(known, held)| {
                            let total: f64 = known.iter().sum::<f64>() + prior * n_states as f64;
                            known
                                .iter()
                                .zip(held)
                                .map(|(k, h)| h * ((k + prior) / total).ln())
                                .sum::<f64>()
                        })
                        .sum::<f64>()
                })
                .sum(),
        }
    }
}

impl Scorer {
    /// Directions: a mixture per configuration, on the sphere.
    fn score_directions(
        &self,
        members: &Members,
        x: &[Vec<f64>],
        spec: &VonMisesFisherSpec,
        node: usize,
        parents: &[usize],
    ) -> f64 {
        let d = spec.columns.len();
        let options = direction_options(spec, self.restarts, self.max_steps, 1e-5);
        let log_n = members.log_n();
        let gather = |keep: &dyn Fn(usize) -> bool| {
            let kept: Vec<usize> = (0..members.rows.len()).filter(|&i| keep(i)).collect();
            Directions {
                d,
                x: kept.iter().map(|&i| x[members.rows[i]].clone()).collect(),
                weights: kept.iter().map(|&i| members.weights[i]).collect(),
                earlier: Vec::new(),
            }
        };
        // Rows learned from, rows scored, and what a parameter costs.
        let part = |known: &dyn Fn(usize) -> bool, scored: &dyn Fn(usize) -> bool, cost: f64| -> f64 {
            (0..members.n_configurations)
                .map(|cell| {
                    let own = |i: usize| members.configurations[i] == cell;
                    let mut rows = gather(&|i| own(i) && known(i));
                    let pooled = members.n_configurations > 1 && rows.total() < (d + 1) as f64;
                    if pooled {
                        rows = gather(known);
                    }
                    let seed = mixed(mixed(self.seed, node, parents), cell, &[]);
                    let fit = match spec.order {
                        _ if pooled => rows.fit(1, options, seed),
                        MixtureOrder::Fixed(k) => rows.fit(
                            k.min((rows.total() / (d + 1) as f64) as usize).max(1),
                            options,
                            seed,
                        ),
                        MixtureOrder::Bic { max, .. } => {
                            let (mut fits, best) =
                                rows.fit_by_bic(max.min(self.max_components), options, seed);
                            fits.swap_remove(best)
                        }
                    };
                    let price = cost * n_direction_parameters(fit.components.len(), d) as f64;
                    gather(&|i| own(i) && scored(i)).log_likelihood(&fit.components) - price
                })
                .sum()
        };
        match self.score {
            StructureScore::Bic => part(&|_| true, &|_| true, 0.5 * log_n),
            StructureScore::CrossValidated { folds } => (0..folds)
                .map(|fold| {
                    let held = |i: usize| self.folds[members.rows[i]] == fold;
                    part(&|i| !held(i), &held, 0.0)
                })
                .sum(),
        }
    }
}

/// Rows of the sample with what they count, and the configuration of the discrete parents.
pub(super) struct Members {
    pub rows: Vec<usize>,
    pub weights: Vec<f64>,
    pub configurations: Vec<usize>,
    pub n_configurations: usize,
}

impl Members {
    pub fn log_n(&self) -> f64 {
        self.weights.iter().sum::<f64>().max(1.0).ln()
    }
}

/// Groups per row where every group has one value and some group several rows; otherwise 1.
fn share_of_constant(values: &[Vec<f64>], groups: &[usize]) -> f64 {
    let mut first = std::collections::BTreeMap::new();
    for (value, group) in values.iter().zip(groups) {
        let known: &Vec<f64> = first.entry(*group).or_insert(value);
        // In standardised units: what a text file's sixth digit may change.
        if known.iter().zip(value).any(|(a, b)| (a - b).abs() > 1e-5) {
            return 1.0;
        }
    }
    first.len() as f64 / values.len().max(1) as f64
}

/// A seed that follows from several numbers.
pub(super) fn mixed(seed: u64, first: usize, more: &[usize]) -> u64 {
    more.iter().chain([&first]).fold(seed, |mixed, &part| {
        (mixed ^ (part as u64 + 1))
            .wrapping_mul(0x9E37_79B9_7F4A_7C15)
            .rotate_left(29)
    })
}

fn fold_of(unit: usize, folds: usize, seed: u64) -> usize {
    (mixed(seed, unit, &[]) >> 11) as usize % folds
}
