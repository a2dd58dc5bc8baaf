//! What a batch query works out once: configurations, families and hidden blocks, and how each reads a row.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use nalgebra::DMatrix;

use crate::block::{self, Known};
use crate::cpd::{Cpd, NodeIdx};
use crate::model::Model;
use crate::reader::LogSum;
use crate::tree::Tree;

/// Most joint states of the discrete nodes.
const MAX_ASSIGNMENTS: usize = 4096;

/// Everything that does not depend on the row.
pub(crate) struct Plan {
    n_target_states: usize,
    /// Joint states of the relevant discrete nodes with a positive probability.
    assignments: Vec<Assignment>,
    /// Observed families and hidden blocks per configuration; shared by assignments.
    factors: Vec<Tree>,
    /// Place in the row of each observed discrete node.
    observed_states: Vec<usize>,
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
    factors: Vec<f64>,
    open: Vec<(f64, f64, usize)>,
    by_state: Vec<LogSum>,
    /// The row and 1.
    x: Vec<f64>,
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
            observed_states: discrete.iter().filter_map(|idx| place[idx.0]).collect(),
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
                        let (steps, _) = block::steps(model, nodes, &states, width + 1, &known);
                        fast.factors.push(Tree::grow(model, &steps, width + 1)?);
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

    /// Writes the target's posterior and gives the log density of the row; `None` where no term is finite: the general
    /// path says why.
    pub fn row(&self, row: &[f64], scratch: &mut Scratch, posterior: &mut [f64]) -> Option<f64> {
        let Scratch {
            factors,
            open,
            by_state,
            x,
        } = scratch;
        x.clear();
        x.extend_from_slice(row);
        x.push(1.0);
        factors.clear();
        factors.resize(self.factors.len(), f64::NAN);
        by_state.clear();
        by_state.resize_with(self.n_target_states, LogSum::default);
        for assignment in &self.assignments {
            let mut fits = assignment.observed.iter().zip(&self.observed_states);
            if fits.any(|(&state, &place)| row[place] != state as f64) {
                continue;
            }
            let mut log_weight = assignment.log_prior;
            for &i in &assignment.factors {
                if factors[i].is_nan() {
                    factors[i] = self.factors[i].log_integral(x, open);
                }
                log_weight += factors[i];
            }
            by_state[assignment.target_state].add(log_weight);
        }
        let mut all = LogSum::default();
        for (slot, sum) in posterior.iter_mut().zip(by_state.iter()) {
            *slot = sum.value();
            all.add(*slot);
        }
        let log_evidence = all.value();
        for slot in posterior {
            *slot = (*slot - log_evidence).exp();
        }
        log_evidence.is_finite().then_some(log_evidence)
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
