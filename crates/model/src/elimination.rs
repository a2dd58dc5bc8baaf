//! What a query needs of the model: which nodes matter, which are summed where, and the tables that this leaves.
//!
//! 1. Nodes that are neither asked about, nor observed, nor ancestors of such nodes, sum to 1 and are left out.
//! 2. A continuous node that is observed together with all its continuous parents gives one number per configuration
//!    of its discrete parents: its components are summed on the spot.
//! 3. Continuous nodes that are hidden, wholly or in part, and the children that they reach, form blocks. A block gives
//!    one number per configuration of the discrete parents of its nodes, or, where a target is in it, Gaussians.

use std::collections::BTreeSet;

use nalgebra::DMatrix;

use crate::block::{self, BlockSum, Known, Latent};
use crate::cpd::{Cpd, MixtureCpd, NodeIdx, Sign};
use crate::double_double::covariance_root;
use crate::error::ModelError;
use crate::evidence::{Evidence, Observation};
use crate::gaussian::{log_add, log_normal_in_place};
use crate::log_table::LogTable;
use crate::model::Model;

/// Combinations of components that one query sums one by one: a few seconds of work.
const MAX_EXACT: f64 = 2e6;
/// Combinations kept at each step where there are more, all configurations together.
const KEPT: f64 = 1e6;

/// A query, taken apart.
pub(crate) struct Elimination<'a> {
    pub model: &'a Model,
    pub evidence: &'a Evidence,
    pub targets: Vec<NodeIdx>,
    /// State of each observed discrete node; 0 for the others.
    pub states: Vec<usize>,
    /// Unobserved relevant discrete nodes, parents first.
    free: Vec<NodeIdx>,
    discrete: Vec<NodeIdx>,
    locals: Vec<NodeIdx>,
    pub blocks: Vec<Block>,
    pub latent: Latent,
    /// Most combinations that a block keeps at each step, where all would be too many.
    pub width: Option<usize>,
}

/// Hidden continuous nodes and the observed children they reach, parents first.
pub(crate) struct Block {
    pub nodes: Vec<NodeIdx>,
    /// Unobserved discrete parents of the nodes: the result depends on these only.
    pub scope: Vec<NodeIdx>,
    /// Hidden targets in it.
    pub targets: Vec<NodeIdx>,
}

/// The tables whose product over the free nodes is the density of the evidence.
pub(crate) struct Tables {
    pub exact: Vec<LogTable>,
    /// The same with bounds of what was left out; none where nothing was.
    pub upper: Option<Vec<LogTable>>,
    /// Entries without density: table, entry and reason.
    flat: Vec<(usize, usize, ModelError)>,
}

impl<'a> Elimination<'a> {
    pub fn new(model: &'a Model, targets: &[NodeIdx], evidence: &'a Evidence, latent: Latent) -> Self {
        let mut relevant: BTreeSet<NodeIdx> = targets.iter().copied().collect();
        relevant.extend(evidence.iter().map(|(idx, _)| idx));
        for &idx in model.order().iter().rev() {
            if relevant.contains(&idx) {
                relevant.extend(model.node(idx).parents());
            }
        }
        let mut states = vec![0; model.nodes().len()];
        let (mut free, mut discrete) = (Vec::new(), Vec::new());
        let (mut locals, mut members) = (Vec::new(), Vec::new());
        for &idx in model.order().iter().filter(|idx| relevant.contains(idx)) {
            if model.n_states(idx) > 0 {
                discrete.push(idx);
                match evidence.get(idx) {
                    Some(Observation::State(state)) => states[idx.0] = *state,
                    _ => free.push(idx),
                }
            } else {
                let parents = model.node(idx).continuous_parents();
                let known = |&idx: &NodeIdx| full_value(evidence, idx).is_some();
                if known(&idx) && parents.iter().all(known) {
                    locals.push(idx);
                } else {
                    members.push(idx);
                }
            }
        }
        let mut out = Self {
            model,
            evidence,
            targets: targets.to_vec(),
            states,
            free,
            discrete,
            locals,
            blocks: Vec::new(),
            latent,
            width: None,
        };
        out.blocks = out.find_blocks(&members);
        out.width = out.width();
        out
    }

    /// Joins nodes along arcs that leave a hidden node.
    fn find_blocks(&self, members: &[NodeIdx]) -> Vec<Block> {
        let hidden = |idx: &NodeIdx| full_value(self.evidence, *idx).is_none();
        let mut label: Vec<usize> = (0..self.states.len()).collect();
        for &idx in members {
            for parent in self
                .model
                .node(idx)
                .continuous_parents()
                .iter()
                .filter(|p| hidden(p))
            {
                let (from, to) = (label[parent.0], label[idx.0]);
                for value in label.iter_mut().filter(|value| **value == to) {
                    *value = from;
                }
            }
        }
        let names: BTreeSet<usize> = members.iter().map(|idx| label[idx.0]).collect();
        names
            .into_iter()
            .map(|name| {
                let belongs = |idx: &NodeIdx| label[idx.0] == name;
                let nodes: Vec<NodeIdx> = members.iter().copied().filter(belongs).collect();
                let parents = nodes
                    .iter()
                    .flat_map(|&idx| self.model.node(idx).discrete_parents());
                let scope: BTreeSet<NodeIdx> = parents
                    .copied()
                    .filter(|parent| self.free.contains(parent))
                    .collect();
                let asked = self.targets.iter().copied();
                let targets = asked.filter(|idx| nodes.contains(idx) && hidden(idx)).collect();
                Block {
                    nodes,
                    scope: scope.into_iter().collect(),
                    targets,
                }
            })
            .collect()
    }

    /// How many combinations to keep at each step; none where all are few enough.
    fn width(&self) -> Option<usize> {
        let mut terms = 0.0;
        let mut configurations: f64 = 1.0;
        for block in &self.blocks {
            let scope: f64 = block.scope.iter().map(|&idx| self.size(idx) as f64).product();
            terms += scope
                * block
                    .nodes
                    .iter()
                    .map(|&idx| self.most_terms(idx))
                    .product::<f64>();
            configurations = configurations.max(scope);
        }
        (terms > MAX_EXACT).then(|| (KEPT / (8.0 * configurations)).clamp(500.0, 8000.0) as usize)
    }

    /// Components, times two for a latent sign, in the largest configuration.
    fn most_terms(&self, idx: NodeIdx) -> f64 {
        self.model.mixture(idx).map_or(1.0, |cpd| {
            let most = cpd.components.iter().map(Vec::len).max().unwrap_or(0);
            most as f64 * if cpd.sign == Sign::Latent { 2.0 } else { 1.0 }
        })
    }

    pub fn size(&self, idx: NodeIdx) -> usize {
        self.model.n_states(idx)
    }

    pub fn free(&self) -> &[NodeIdx] {
        &self.free
    }

    fn only_free(&self, nodes: impl Iterator<Item = NodeIdx>) -> (Vec<NodeIdx>, Vec<usize>) {
        let scope: Vec<NodeIdx> = nodes.filter(|idx| self.free.contains(idx)).collect();
        let sizes = scope.iter().map(|&idx| self.size(idx)).collect();
        (scope, sizes)
    }

    /// Observed continuous nodes whose continuous parents are observed too.
    pub fn locals(&self) -> &[NodeIdx] {
        &self.locals
    }

    /// Every factor; those of blocks with targets only where `whole`.
    pub fn tables(&self, whole: bool) -> Result<Tables, ModelError> {
        let mut states = self.states.clone();
        let mut tables = Vec::new();
        let mut flat = Vec::new();
        for &idx in &self.discrete {
            let node = self.model.node(idx);
            let (scope, sizes) = self.only_free(node.discrete_parents().iter().copied().chain([idx]));
            let likelihood = match self.evidence.get(idx) {
                Some(Observation::Likelihood(likelihood)) => Some(likelihood),
                _ => None,
            };
            tables.push(LogTable::fill(scope, sizes, &mut states, |states| {
                let state = states[idx.0];
                let soft = likelihood.map_or(0.0, |likelihood| likelihood[state].ln());
                Ok(soft + self.log_table(idx, states))
            })?);
        }
        for &idx in &self.locals {
            let parents = self.model.node(idx).discrete_parents();
            let (scope, sizes) = self.only_free(parents.iter().copied());
            let (mut entry, table) = (0, tables.len());
            tables.push(LogTable::fill(scope, sizes, &mut states, |states| {
                entry += 1;
                let configuration = self.model.configuration(idx, states);
                or_flat(self.log_local(idx, configuration), |error| {
                    flat.push((table, entry - 1, error));
                })
            })?);
        }
        let mut lost = Vec::new();
        for block in self
            .blocks
            .iter()
            .filter(|block| whole || block.targets.is_empty())
        {
            let (scope, sizes) = self.only_free(block.scope.iter().copied());
            let (mut entry, table) = (0, tables.len());
            tables.push(LogTable::fill(scope, sizes, &mut states, |states| {
                entry += 1;
                let sum = self.block_sum(block, states, false).map(|sum| {
                    if sum.lost > f64::NEG_INFINITY {
                        lost.push((table, entry - 1, sum.lost));
                    }
                    sum.total
                });
                or_flat(sum, |error| flat.push((table, entry - 1, error)))
            })?);
        }
        let upper = (!lost.is_empty()).then(|| {
            let mut upper = tables.clone();
            for (table, entry, lost) in lost {
                let value = &mut upper[table].logs[entry];
                *value = log_add(*value, lost);
            }
            upper
        });
        Ok(Tables {
            exact: tables,
            upper,
            flat,
        })
    }

    fn log_table(&self, idx: NodeIdx, states: &[usize]) -> f64 {
        match &self.model.node(idx).cpd {
            Cpd::Discrete(cpd) => cpd.log_density(self.model.configuration(idx, states), states[idx.0]),
            Cpd::Mixture(_) | Cpd::VonMisesFisher(_) => 0.0,
        }
    }

    /// log p(value | configuration, parents) of an observed family, components joined.
    fn log_local(&self, idx: NodeIdx, configuration: usize) -> Result<f64, ModelError> {
        let logs: Vec<f64> = self
            .terms(idx, configuration)?
            .into_iter()
            .map(|(_, log)| log)
            .collect();
        Ok(self.latent.join(&logs))
    }

    /// Components of an observed family with the logarithms of weight and density, all discrete nodes observed.
    pub fn log_local_components(&self, idx: NodeIdx) -> Result<Vec<(usize, f64)>, ModelError> {
        self.terms(idx, self.model.configuration(idx, &self.states))
    }

    fn terms(&self, idx: NodeIdx, configuration: usize) -> Result<Vec<(usize, f64)>, ModelError> {
        let value = full_value(self.evidence, idx).unwrap_or_default();
        let parents: Vec<f64> = self
            .model
            .node(idx)
            .continuous_parents()
            .iter()
            .flat_map(|&parent| full_value(self.evidence, parent).unwrap_or_default())
            .copied()
            .collect();
        if let Cpd::VonMisesFisher(cpd) = &self.model.node(idx).cpd {
            let row = cpd.components[configuration].iter().enumerate();
            let numbers = row
                .filter(|(_, component)| component.weight > 0.0)
                .map(|(k, _)| k);
            return Ok(numbers.zip(cpd.log_terms(configuration, value)).collect());
        }
        self.model.log_components(idx, configuration, value, &parents)
    }

    /// What a block contributes for the given states; the pieces where asked for.
    pub fn block_sum(&self, block: &Block, states: &[usize], keep: bool) -> Result<BlockSum, ModelError> {
        let known = |idx: NodeIdx| match self.evidence.get(idx) {
            Some(Observation::Value(value)) => {
                let dims: Vec<usize> = (0..value.len()).filter(|&i| !value[i].is_nan()).collect();
                if dims.is_empty() {
                    return Known::Nothing;
                }
                let column = DMatrix::from_iterator(dims.len(), 1, dims.iter().map(|&i| value[i]));
                if dims.len() == value.len() {
                    return Known::Whole(column);
                }
                Known::Part {
                    error: DMatrix::zeros(dims.len(), 0),
                    dims,
                    value: column,
                }
            }
            Some(Observation::Uncertain { mean, covariance }) => Known::Part {
                dims: (0..mean.len()).collect(),
                value: DMatrix::from_column_slice(mean.len(), 1, mean),
                error: covariance_root(covariance).lower,
            },
            _ => Known::Nothing,
        };
        let (steps, starts) = block::steps(self.model, &block.nodes, states, 1, &known);
        let dims: Vec<usize> = block
            .targets
            .iter()
            .flat_map(|&idx| {
                let start = starts[idx.0].unwrap_or(0);
                start..start + self.model.mixture(idx).map_or(0, MixtureCpd::dim)
            })
            .collect();
        let keep = keep.then_some(&dims[..]);
        block::sum(self.model, &steps, self.latent, keep, self.width)
    }

    /// The first entry without density that takes part in the result.
    pub fn culprit(&self, tables: &Tables) -> Result<ModelError, ModelError> {
        for (table, entry, error) in &tables.flat {
            let mut marked = tables.exact.clone();
            for (other, entry, _) in &tables.flat {
                marked[*other].logs[*entry] = 0.0;
            }
            // Only what passes through this entry counts.
            for (k, log) in marked[*table].logs.iter_mut().enumerate() {
                if k != *entry {
                    *log = f64::NEG_INFINITY;
                }
            }
            let sum = LogTable::joined(marked, &[], &|idx| self.size(idx), Latent::Maximised)?;
            if sum.logs[0] > f64::NEG_INFINITY {
                return Ok(error.clone());
            }
        }
        Ok(self.impossible())
    }

    pub fn impossible(&self) -> ModelError {
        let observed = self.evidence.iter();
        let names = observed.map(|(idx, _)| self.model.node(idx).name.as_str());
        ModelError::ImpossibleEvidence {
            hint: format!(
                "check the states and zero weights of {}",
                crate::error::list(names)
            ),
        }
    }
}

impl Model {
    /// Component, with its sign, and log of its weight and density at an observed value.
    pub(crate) fn log_components(
        &self,
        idx: NodeIdx,
        configuration: usize,
        value: &[f64],
        parents: &[f64],
    ) -> Result<Vec<(usize, f64)>, ModelError> {
        let Some(cpd) = self.mixture(idx) else {
            return Ok(Vec::new());
        };
        let mut terms = Vec::with_capacity(2 * cpd.components[configuration].len());
        for (k, component) in cpd.components[configuration].iter().enumerate() {
            if component.weight == 0.0 {
                continue;
            }
            let lower = self
                .factor(idx, configuration, k)
                .ok_or_else(|| ModelError::NoDensity {
                    node: self.node(idx).name.clone(),
                    configuration,
                    component: k,
                })?;
            let mean = component.mean_at(parents);
            let signs: &[f64] = if cpd.sign == Sign::Latent {
                &[1.0, -1.0]
            } else {
                &[1.0]
            };
            for sign in signs {
                let mut residual: Vec<f64> =
                    value.iter().zip(&mean).map(|(x, mean)| sign * x - mean).collect();
                let log_density = log_normal_in_place(&mut residual, lower);
                terms.push((k, component.weight.ln() - (signs.len() as f64).ln() + log_density));
            }
        }
        Ok(terms)
    }
}

/// The value of a node all of whose dimensions were observed exactly.
pub(crate) fn full_value(evidence: &Evidence, idx: NodeIdx) -> Option<&[f64]> {
    match evidence.get(idx) {
        Some(Observation::Value(value)) if value.iter().all(|v| !v.is_nan()) => Some(value),
        _ => None,
    }
}

/// NaN instead of [`ModelError::NoDensity`], which is told aside.
fn or_flat(result: Result<f64, ModelError>, tell: impl FnOnce(ModelError)) -> Result<f64, ModelError> {
    match result {
        Err(error @ ModelError::NoDensity { .. }) => {
            tell(error);
            Ok(f64::NAN)
        }
        other => other,
    }
}
