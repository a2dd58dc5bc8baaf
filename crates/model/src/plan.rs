//! What a batch query works out once: configurations, families and hidden blocks, and how each reads a row.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use nalgebra::DMatrix;

use crate::batch::RowPosterior;
use crate::block::{self, Known};
use crate::cpd::{Cpd, NodeIdx};
use crate::evidence::unit_vector;
use crate::lanes::{LANES, Lanes, LogSums};
use crate::model::Model;
use crate::table::state_at;
use crate::tree::Tree;
use crate::tree_sum::Open;

/// Most joint states of the discrete nodes.
const MAX_ASSIGNMENTS: usize = 4096;

/// Everything that does not depend on the row.
pub(crate) struct Plan {
    n_target_states: usize,
    /// Joint states of the relevant discrete nodes with a positive probability.
    assignments: Vec<Assignment>,
    /// Observed families and hidden blocks per configuration; shared by assignments.
    factors: Vec<Tree>,
    /// Place in the row of each observed discrete node, and its number of states.
    observed_states: Vec<(usize, usize)>,
    /// Place in the row of each observed direction, and its dimension.
    directions: Vec<(usize, usize)>,
}

struct Assignment {
    log_prior: f64,
    target_state: usize,
    /// State of each observed discrete node.
    observed: Vec<usize>,
    factors: Vec<usize>,
}

/// Buffers of one thread.
#[derive(Default)]
pub(crate) struct Scratch {
    factors: Vec<Option<Lanes>>,
    open: Open,
    by_state: Vec<LogSums>,
    /// The rows and 1, column by column.
    x: Vec<Lanes>,
}

impl Plan {
    /// `None` where the general path has to do.
    pub fn compile(model: &Model, target: NodeIdx, observed: &[NodeIdx]) -> Option<Self> {
        let mut relevant = vec![false; model.nodes().len()];
        relevant[target.0] = true;
        for idx in observed {
            relevant[idx.0] = true;
        }
        for &idx in model.order().iter().rev() {
            if relevant[idx.0] {
                for parent in model.node(idx).parents() {
                    relevant[parent.0] = true;
                }
            }
        }
        let ordered: Vec<NodeIdx> = model
            .order()
            .iter()
            .copied()
            .filter(|idx| relevant[idx.0])
            .collect();
        let (discrete, continuous): (Vec<NodeIdx>, Vec<NodeIdx>) =
            ordered.iter().copied().partition(|&idx| model.n_states(idx) > 0);
        let mut place = vec![None; model.nodes().len()];
        let mut width = 0;
        for &idx in observed {
            place[idx.0] = Some(width);
            width += model.node(idx).columns().len();
        }
        let known = |idx: NodeIdx| match place[idx.0] {
            Some(start) => {
                let d = model.node(idx).columns().len();
                Known::Whole(DMatrix::from_fn(d, width + 1, |i, j| f64::from(start + i == j)))
            }
            None => Known::Nothing,
        };
        let is_hidden = |idx: &NodeIdx| place[idx.0].is_none();
        let blocks = blocks(model, &continuous, is_hidden);
        let n: usize = discrete
            .iter()
            .map(|&idx| model.n_states(idx))
            .try_fold(1usize, usize::checked_mul)?;
        if n > MAX_ASSIGNMENTS {
            return None;
        }
        let mut fast = Self {
            n_target_states: model.n_states(target),
            assignments: Vec::with_capacity(n),
            factors: Vec::new(),
            observed_states: discrete
                .iter()
                .filter_map(|&idx| place[idx.0].map(|start| (start, model.n_states(idx))))
                .collect(),
            directions: continuous
                .iter()
                .filter(|&&idx| matches!(model.node(idx).cpd, Cpd::VonMisesFisher(_)))
                .filter_map(|&idx| place[idx.0].map(|start| (start, model.node(idx).columns().len())))
                .collect(),
        };
        let mut known_factors = BTreeMap::new();
        let mut states = vec![0; model.nodes().len()];
        for number in 0..n {
            let mut left = number;
            for &idx in discrete.iter().rev() {
                states[idx.0] = left % model.n_states(idx);
                left /= model.n_states(idx);
            }
            let mut log_prior = 0.0;
            for &idx in &discrete {
                if let Cpd::Discrete(cpd) = &model.node(idx).cpd {
                    log_prior += cpd.log_density(model.configuration(idx, &states), states[idx.0]);
                }
            }
            if log_prior == f64::NEG_INFINITY {
                continue;
            }
            let mut factors = Vec::with_capacity(blocks.len());
            for nodes in &blocks {
                let configurations = nodes.iter().map(|&idx| model.configuration(idx, &states));
                let key: (NodeIdx, Vec<usize>) = (nodes[0], configurations.collect());
                let number = match known_factors.entry(key) {
                    Entry::Occupied(known) => *known.get(),
                    Entry::Vacant(vacant) => {
                        let factor = if let (Cpd::VonMisesFisher(cpd), Some(start)) =
                            (&model.node(nodes[0]).cpd, place[nodes[0].0])
                        {
                            let configuration = model.configuration(nodes[0], &states);
                            Tree::of_directions(&cpd.components[configuration], start, width)
                        } else {
                            let (steps, _) = block::steps(model, nodes, &states, width + 1, &known);
                            Tree::grow(&steps)?
                        };
                        fast.factors.push(factor);
                        *vacant.insert(fast.factors.len() - 1)
                    }
                };
                factors.push(number);
            }
            fast.assignments.push(Assignment {
                log_prior,
                target_state: states[target.0],
                observed: discrete
                    .iter()
                    .filter(|idx| !is_hidden(idx))
                    .map(|idx| states[idx.0])
                    .collect(),
                factors,
            });
        }
        Some(fast)
    }

    /// The states of the observed discrete nodes; `None` for a row that has gaps or no legal values: the general path says
    /// which.
    pub fn states(&self, row: &[f64]) -> Option<Vec<usize>> {
        let legal = row.iter().all(|value| value.is_finite())
            && self
                .directions
                .iter()
                .all(|&(start, d)| unit_vector("", &row[start..start + d]).is_ok());
        let states = self.observed_states.iter();
        legal.then(|| states.map(|&(place, n)| state_at(row[place], n)).collect())?
    }

    /// What up to [`LANES`] rows say, all with the same states of the observed discrete nodes; `None` for a row where no
    /// term is finite: the general path says why.
    pub fn rows(
        &self,
        rows: &[&[f64]],
        states: &[usize],
        scratch: &mut Scratch,
    ) -> Vec<Option<RowPosterior>> {
        let Scratch {
            factors,
            open,
            by_state,
            x,
        } = scratch;
        let width = rows.first().map_or(0, |row| row.len());
        x.clear();
        x.extend((0..width).map(|j| std::array::from_fn(|lane| rows[lane.min(rows.len() - 1)][j])));
        x.push([1.0; LANES]);
        for &(start, d) in &self.directions {
            for lane in 0..LANES {
                let length = x[start..start + d]
                    .iter()
                    .map(|v| v[lane] * v[lane])
                    .sum::<f64>()
                    .sqrt();
                for v in &mut x[start..start + d] {
                    v[lane] /= length;
                }
            }
        }
        factors.clear();
        factors.resize(self.factors.len(), None);
        by_state.clear();
        by_state.resize_with(self.n_target_states, LogSums::default);
        for assignment in self.assignments.iter().filter(|a| a.observed == states) {
            let mut log_weight = [assignment.log_prior; LANES];
            for &i in &assignment.factors {
                let factor = factors[i].get_or_insert_with(|| self.factors[i].log_sums(x, open));
                for lane in 0..LANES {
                    log_weight[lane] += factor[lane];
                }
            }
            by_state[assignment.target_state].add(&log_weight);
        }
        let by_state: Vec<Lanes> = by_state.iter().map(LogSums::values).collect();
        let mut all = LogSums::default();
        for state in &by_state {
            all.add(state);
        }
        let log_evidence = all.values();
        (0..rows.len())
            .map(|lane| {
                let posterior = by_state
                    .iter()
                    .map(|state| (state[lane] - log_evidence[lane]).exp());
                log_evidence[lane].is_finite().then(|| RowPosterior {
                    log_evidence: log_evidence[lane],
                    posterior: posterior.collect(),
                })
            })
            .collect()
    }
}

/// Continuous nodes in groups: an observed node with observed parents stands alone, hidden ones and those that read
/// them stand together where arcs join them. Parents come first.
fn blocks(model: &Model, continuous: &[NodeIdx], is_hidden: impl Fn(&NodeIdx) -> bool) -> Vec<Vec<NodeIdx>> {
    let mut label: Vec<usize> = (0..model.nodes().len()).collect();
    for &idx in continuous {
        for parent in model
            .node(idx)
            .continuous_parents()
            .iter()
            .filter(|p| is_hidden(p))
        {
            let (from, to) = (label[parent.0], label[idx.0]);
            for value in label.iter_mut().filter(|value| **value == to) {
                *value = from;
            }
        }
    }
    let mut groups: BTreeMap<usize, Vec<NodeIdx>> = BTreeMap::new();
    for &idx in continuous {
        groups.entry(label[idx.0]).or_default().push(idx);
    }
    groups.into_values().collect()
}
