//! Exact posteriors by elimination.
//!
//! 1. Nodes that are neither asked about, nor observed, nor ancestors of such nodes, sum to 1 and are left out.
//! 2. The states of the unobserved discrete nodes are enumerated.
//! 3. A continuous node that is observed together with all its continuous parents contributes one number per
//!    configuration: its components are summed on the spot.
//! 4. Continuous nodes that are hidden, wholly or in part, and the children that they reach, form blocks. In a block the
//!    components are enumerated, parents first, and a Gaussian over the hidden values is carried along in moment form:
//!    a hidden node is appended, an observation conditions. Moment form accepts singular covariances.
//!
//! Everything is in the log domain; no sampling, no approximation. Hidden blocks that share no arc are summed apart.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector};

use crate::answer::{Answer, Target, Term};
use crate::cpd::{Cpd, NodeIdx, Sign};
use crate::error::{ModelError, list};
use crate::evidence::{Evidence, Observation};
use crate::gaussian::{Gaussian, log_normal_in_place, log_sum_exp};
use crate::model::Model;

/// Combinations of states and components that one query may sum: some seconds of work.
const MAX_TERMS: f64 = 2e7;

impl Model {
    /// The posterior of one or several nodes given evidence, jointly.
    ///
    /// # Errors
    ///
    /// Unknown or repeated targets, [`ModelError::NoDensity`] where the evidence meets a singular component,
    /// [`ModelError::ImpossibleEvidence`], [`ModelError::TooManyTerms`].
    ///
    /// # Source
    ///
    /// Eq. 1 and section IV; conditional Gaussians as in Lauritzen (1992).
    pub fn posterior(&self, targets: &[&str], evidence: &Evidence) -> Result<Answer, ModelError> {
        let mut asked = Vec::with_capacity(targets.len());
        for target in targets {
            let idx = self.index(target)?;
            if asked.contains(&idx) {
                return Err(ModelError::BadValue {
                    node: (*target).into(),
                    found: "the same target twice".into(),
                    expected: "each target once".into(),
                });
            }
            asked.push(idx);
        }
        Elimination::new(self, &asked, evidence)?.run()
    }

    /// Natural logarithm of the density (and probability) of the evidence.
    ///
    /// # Errors
    ///
    /// As [`Model::posterior`].
    pub fn log_evidence(&self, evidence: &Evidence) -> Result<f64, ModelError> {
        Ok(self.posterior(&[], evidence)?.log_evidence)
    }
}

/// How a relevant continuous node enters.
enum Role {
    /// Its value and its continuous parents' are known.
    Local { value: Vec<f64>, parents: Vec<f64> },
    /// It belongs to a block.
    Block,
}

/// Hidden continuous nodes and the observed children they reach, parents first.
struct Block {
    nodes: Vec<NodeIdx>,
    /// Unobserved discrete parents of the nodes: the result depends on these only.
    scope: Vec<NodeIdx>,
    /// Hidden targets in it.
    targets: Vec<NodeIdx>,
}

/// What a block contributes for one assignment of its scope: log weights and, for targets, Gaussians over them.
type BlockTerms = Vec<(f64, Gaussian)>;

struct Elimination<'a> {
    model: &'a Model,
    evidence: &'a Evidence,
    targets: Vec<NodeIdx>,
    /// Unobserved relevant discrete nodes, parents first.
    free: Vec<NodeIdx>,
    /// All relevant discrete nodes.
    discrete: Vec<NodeIdx>,
    roles: BTreeMap<NodeIdx, Role>,
    blocks: Vec<Block>,
}

impl<'a> Elimination<'a> {
    fn new(model: &'a Model, targets: &[NodeIdx], evidence: &'a Evidence) -> Result<Self, ModelError> {
        let mut relevant: BTreeSet<NodeIdx> = targets.iter().copied().collect();
        relevant.extend(evidence.iter().map(|(idx, _)| idx));
        for &idx in model.order().iter().rev() {
            if relevant.contains(&idx) {
                relevant.extend(model.node(idx).parents());
            }
        }
        let ordered: Vec<NodeIdx> = model
            .order()
            .iter()
            .copied()
            .filter(|idx| relevant.contains(idx))
            .collect();
        let is_discrete = |idx: NodeIdx| matches!(model.node(idx).cpd, Cpd::Discrete(_));
        let discrete: Vec<NodeIdx> = ordered.iter().copied().filter(|&idx| is_discrete(idx)).collect();
        let free = discrete
            .iter()
            .copied()
            .filter(|&idx| !matches!(evidence.get(idx), Some(Observation::State(_))))
            .collect();
        let mut roles = BTreeMap::new();
        for &idx in ordered.iter().filter(|&&idx| !is_discrete(idx)) {
            let own = full_value(evidence, idx);
            let parents: Option<Vec<&[f64]>> = model
                .node(idx)
                .continuous_parents()
                .iter()
                .map(|&p| full_value(evidence, p))
                .collect();
            roles.insert(
                idx,
                match (own, parents) {
                    (Some(value), Some(parents)) => Role::Local {
                        value: value.to_vec(),
                        parents: parents.concat(),
                    },
                    _ => Role::Block,
                },
            );
        }
        let mut elimination = Self {
            model,
            evidence,
            targets: targets.to_vec(),
            free,
            discrete,
            roles,
            blocks: Vec::new(),
        };
        elimination.blocks = elimination.find_blocks(&ordered);
        elimination.check_size()?;
        Ok(elimination)
    }

    /// Joins block nodes along arcs that leave a hidden node.
    fn find_blocks(&self, ordered: &[NodeIdx]) -> Vec<Block> {
        let members: Vec<NodeIdx> = ordered
            .iter()
            .copied()
            .filter(|idx| matches!(self.roles.get(idx), Some(Role::Block)))
            .collect();
        let mut label: BTreeMap<NodeIdx, NodeIdx> = members.iter().map(|&idx| (idx, idx)).collect();
        for &idx in &members {
            for parent in self.hidden_parents(idx) {
                let (from, to) = (label[&parent], label[&idx]);
                for value in label.values_mut().filter(|value| **value == to) {
                    *value = from;
                }
            }
        }
        let names: BTreeSet<NodeIdx> = label.values().copied().collect();
        names
            .into_iter()
            .map(|name| {
                let nodes: Vec<NodeIdx> = members.iter().copied().filter(|idx| label[idx] == name).collect();
                let scope: BTreeSet<NodeIdx> = nodes
                    .iter()
                    .flat_map(|&idx| self.model.node(idx).discrete_parents().iter().copied())
                    .filter(|parent| self.free.contains(parent))
                    .collect();
                let hidden = |idx: &NodeIdx| full_value(self.evidence, *idx).is_none();
                let targets = self
                    .targets
                    .iter()
                    .copied()
                    .filter(|idx| nodes.contains(idx) && hidden(idx))
                    .collect();
                Block {
                    nodes,
                    scope: scope.into_iter().collect(),
                    targets,
                }
            })
            .collect()
    }

    fn hidden_parents(&self, idx: NodeIdx) -> Vec<NodeIdx> {
        let parents = self.model.node(idx).continuous_parents();
        parents
            .iter()
            .copied()
            .filter(|&parent| full_value(self.evidence, parent).is_none())
            .collect()
    }

    fn check_size(&self) -> Result<(), ModelError> {
        let states: f64 = self
            .free
            .iter()
            .map(|&idx| self.model.n_states(idx) as f64)
            .product();
        let mut joint = 1.0;
        let mut apart = 0.0;
        for block in &self.blocks {
            let terms: f64 = block.nodes.iter().map(|&idx| self.most_terms(idx)).product();
            let scope: f64 = block
                .scope
                .iter()
                .map(|&idx| self.model.n_states(idx) as f64)
                .product();
            apart += terms * scope;
            if !block.targets.is_empty() {
                joint *= terms;
            }
        }
        let n_terms = apart.max(states * joint);
        if n_terms > MAX_TERMS {
            return Err(ModelError::TooManyTerms {
                n_terms,
                limit: MAX_TERMS,
            });
        }
        Ok(())
    }

    /// Components, times two for a latent sign, in the largest configuration.
    fn most_terms(&self, idx: NodeIdx) -> f64 {
        self.model.mixture(idx).map_or(1.0, |cpd| {
            let most = cpd.components.iter().map(Vec::len).max().unwrap_or(0);
            most as f64 * if cpd.sign == Sign::Latent { 2.0 } else { 1.0 }
        })
    }

    fn run(&self) -> Result<Answer, ModelError> {
        let mut states = vec![0; self.model.nodes().len()];
        for &idx in &self.discrete {
            if let Some(Observation::State(state)) = self.evidence.get(idx) {
                states[idx.0] = *state;
            }
        }
        let mut caches = Caches {
            local: BTreeMap::new(),
            blocks: self.blocks.iter().map(|_| BTreeMap::new()).collect(),
        };
        let mut terms = Vec::new();
        self.enumerate(0, &mut states, &mut caches, &mut terms)?;
        self.collect(terms)
    }

    /// Depth first over the states of the free discrete nodes.
    fn enumerate(
        &self,
        depth: usize,
        states: &mut Vec<usize>,
        caches: &mut Caches,
        out: &mut Vec<Term>,
    ) -> Result<(), ModelError> {
        if let Some(&idx) = self.free.get(depth) {
            for state in 0..self.model.n_states(idx) {
                states[idx.0] = state;
                let likelihood = self.log_likelihood_of_state(idx, state);
                if likelihood > f64::NEG_INFINITY && self.log_table(idx, states) > f64::NEG_INFINITY {
                    self.enumerate(depth + 1, states, caches, out)?;
                }
            }
            return Ok(());
        }
        let mut log_weight = 0.0;
        for &idx in &self.discrete {
            log_weight += self.log_table(idx, states) + self.log_likelihood_of_state(idx, states[idx.0]);
        }
        for (&idx, role) in &self.roles {
            if log_weight == f64::NEG_INFINITY {
                return Ok(());
            }
            if let Role::Local { value, parents } = role {
                log_weight += self.local(idx, states, value, parents, caches)?;
            }
        }
        if log_weight == f64::NEG_INFINITY {
            return Ok(());
        }
        let mut joint: BlockTerms = vec![(log_weight, Gaussian::empty())];
        for (block, cache) in self.blocks.iter().zip(&mut caches.blocks) {
            let key: Vec<usize> = block.scope.iter().map(|idx| states[idx.0]).collect();
            if !cache.contains_key(&key) {
                cache.insert(key.clone(), self.block_terms(block, states)?);
            }
            let terms = &cache[&key];
            joint = joint
                .iter()
                .flat_map(|(a, left)| {
                    terms
                        .iter()
                        .map(move |(b, right)| (a + b, side_by_side(left, right)))
                })
                .collect();
        }
        let target_states: Vec<usize> = self
            .targets
            .iter()
            .filter(|&&idx| self.model.n_states(idx) > 0)
            .map(|idx| states[idx.0])
            .collect();
        if self.blocks.iter().all(|block| block.targets.is_empty()) {
            let logs: Vec<f64> = joint.iter().map(|(log_weight, _)| *log_weight).collect();
            joint = vec![(log_sum_exp(&logs), Gaussian::empty())];
        }
        for (log_weight, gaussian) in joint {
            if log_weight > f64::NEG_INFINITY {
                out.push(Term {
                    log_weight,
                    states: target_states.clone(),
                    ..Term::from(gaussian)
                });
            }
        }
        Ok(())
    }

    fn log_table(&self, idx: NodeIdx, states: &[usize]) -> f64 {
        match &self.model.node(idx).cpd {
            Cpd::Discrete(cpd) => cpd.log_density(self.model.configuration(idx, states), states[idx.0]),
            Cpd::Mixture(_) => 0.0,
        }
    }

    fn log_likelihood_of_state(&self, idx: NodeIdx, state: usize) -> f64 {
        match self.evidence.get(idx) {
            Some(Observation::Likelihood(likelihood)) => likelihood[state].ln(),
            _ => 0.0,
        }
    }

    /// log p(value | parents) of an observed family, remembered per configuration.
    fn local(
        &self,
        idx: NodeIdx,
        states: &[usize],
        value: &[f64],
        parents: &[f64],
        caches: &mut Caches,
    ) -> Result<f64, ModelError> {
        let configuration = self.model.configuration(idx, states);
        if let Some(&known) = caches.local.get(&(idx, configuration)) {
            return Ok(known);
        }
        let log_density = self.model.log_local(idx, configuration, value, parents)?;
        caches.local.insert((idx, configuration), log_density);
        Ok(log_density)
    }

    fn block_terms(&self, block: &Block, states: &[usize]) -> Result<BlockTerms, ModelError> {
        let mut out = Vec::new();
        let carried = Carried {
            gaussian: Gaussian::empty(),
            offsets: BTreeMap::new(),
            log_weight: 0.0,
        };
        self.descend(block, 0, states, &carried, &mut out)?;
        if block.targets.is_empty() {
            let logs: Vec<f64> = out.iter().map(|(log_weight, _)| *log_weight).collect();
            out = vec![(log_sum_exp(&logs), Gaussian::empty())];
        }
        Ok(out)
    }

    /// Depth first over the components of the block's nodes.
    fn descend(
        &self,
        block: &Block,
        depth: usize,
        states: &[usize],
        carried: &Carried,
        out: &mut BlockTerms,
    ) -> Result<(), ModelError> {
        let Some(&idx) = block.nodes.get(depth) else {
            let dims: Vec<usize> = block
                .targets
                .iter()
                .flat_map(|idx| {
                    let offset = carried.offsets[idx];
                    offset..offset + self.model.mixture(*idx).map_or(0, crate::cpd::MixtureCpd::dim)
                })
                .collect();
            out.push((carried.log_weight, carried.gaussian.marginal(&dims)));
            return Ok(());
        };
        let Some(cpd) = self.model.mixture(idx) else {
            return Ok(());
        };
        let configuration = self.model.configuration(idx, states);
        let signs: &[f64] = if cpd.sign == Sign::Latent {
            &[1.0, -1.0]
        } else {
            &[1.0]
        };
        let share = -(signs.len() as f64).ln();
        let hidden = carried.gaussian.mean.len();
        for (k, component) in cpd.components[configuration].iter().enumerate() {
            if component.weight == 0.0 {
                continue;
            }
            let mut offset = component.mean.clone();
            let mut coefficients = DMatrix::zeros(cpd.dim(), hidden);
            let mut column = 0;
            for &parent in &cpd.continuous_parents {
                let width = self.model.mixture(parent).map_or(0, crate::cpd::MixtureCpd::dim);
                let part = component.coefficients.columns(column, width);
                match full_value(self.evidence, parent) {
                    Some(value) => offset += part * DVector::from_column_slice(value),
                    None => coefficients
                        .columns_mut(carried.offsets[&parent], width)
                        .copy_from(&part),
                }
                column += width;
            }
            for &sign in signs {
                let log_weight = carried.log_weight + component.weight.ln() + share;
                let next = self
                    .enter(
                        idx,
                        carried,
                        &(sign * &offset),
                        &(sign * &coefficients),
                        &component.covariance,
                    )
                    .ok_or_else(|| ModelError::NoDensity {
                        node: self.model.node(idx).name.clone(),
                        configuration,
                        component: k,
                    })?;
                let next = Carried {
                    log_weight: log_weight + next.log_weight,
                    ..next
                };
                self.descend(block, depth + 1, states, &next, out)?;
            }
        }
        Ok(())
    }

    /// Appends a hidden node, or conditions on an observed one; `log_weight` of the result is the density alone.
    fn enter(
        &self,
        idx: NodeIdx,
        carried: &Carried,
        offset: &DVector<f64>,
        coefficients: &DMatrix<f64>,
        noise: &DMatrix<f64>,
    ) -> Option<Carried> {
        if let Some(value) = full_value(self.evidence, idx) {
            let value = DVector::from_column_slice(value);
            let (log_weight, gaussian) = carried.gaussian.condition(offset, coefficients, noise, &value)?;
            return Some(Carried {
                gaussian,
                offsets: carried.offsets.clone(),
                log_weight,
            });
        }
        let start = carried.gaussian.mean.len();
        let mut gaussian = carried.gaussian.append(offset, coefficients, noise);
        let mut offsets = carried.offsets.clone();
        offsets.insert(idx, start);
        let total = gaussian.mean.len();
        let mut log_weight = 0.0;
        let seen: Option<(Vec<usize>, Vec<f64>, DMatrix<f64>)> = match self.evidence.get(idx) {
            Some(Observation::Value(value)) => {
                let dims: Vec<usize> = (0..value.len()).filter(|&i| !value[i].is_nan()).collect();
                let seen = dims.iter().map(|&i| value[i]).collect();
                let noise = DMatrix::zeros(dims.len(), dims.len());
                (!dims.is_empty()).then_some((dims, seen, noise))
            }
            Some(Observation::Uncertain { mean, covariance }) => {
                Some(((0..mean.len()).collect(), mean.clone(), covariance.clone()))
            }
            _ => None,
        };
        if let Some((dims, value, noise)) = seen {
            let pick = DMatrix::from_fn(dims.len(), total, |i, j| f64::from(start + dims[i] == j));
            let value = DVector::from_vec(value);
            let zero = DVector::zeros(dims.len());
            (log_weight, gaussian) = gaussian.condition(&zero, &pick, &noise, &value)?;
            if let Some(Observation::Value(exact)) = self.evidence.get(idx) {
                for &i in &dims {
                    gaussian.mean[start + i] = exact[i];
                }
            }
        }
        Some(Carried {
            gaussian,
            offsets,
            log_weight,
        })
    }

    /// Normalizes, and puts the targets' dimensions into the order asked for.
    fn collect(&self, mut terms: Vec<Term>) -> Result<Answer, ModelError> {
        let logs: Vec<f64> = terms.iter().map(|term| term.log_weight).collect();
        let log_evidence = log_sum_exp(&logs);
        if !log_evidence.is_finite() {
            let observed = self
                .evidence
                .iter()
                .map(|(idx, _)| self.model.node(idx).name.as_str());
            return Err(ModelError::ImpossibleEvidence {
                hint: format!("check the states and zero weights of {}", list(observed)),
            });
        }
        let mut targets = Vec::with_capacity(self.targets.len());
        let mut order = Vec::new();
        let mut n_hidden = 0;
        let hidden_offset: BTreeMap<NodeIdx, usize> = self
            .blocks
            .iter()
            .flat_map(|block| &block.targets)
            .map(|&idx| {
                let start = n_hidden;
                n_hidden += self.model.mixture(idx).map_or(0, crate::cpd::MixtureCpd::dim);
                (idx, start)
            })
            .collect();
        for &idx in &self.targets {
            let node = self.model.node(idx);
            match &node.cpd {
                Cpd::Discrete(cpd) => {
                    targets.push(Target::Discrete {
                        name: node.name.clone(),
                        states: cpd.states.clone(),
                    });
                }
                Cpd::Mixture(cpd) => {
                    for d in 0..cpd.dim() {
                        order.push(match hidden_offset.get(&idx) {
                            Some(start) => Place::Hidden(start + d),
                            None => Place::Known(full_value(self.evidence, idx).map_or(f64::NAN, |v| v[d])),
                        });
                    }
                    let name = node.name.clone();
                    targets.push(Target::Continuous {
                        name,
                        columns: cpd.columns.clone(),
                        sphere: cpd.sphere,
                    });
                }
            }
        }
        for term in &mut terms {
            term.log_weight -= log_evidence;
            let (mean, covariance) = (&term.mean, &term.covariance);
            let at = |place: &Place| match place {
                Place::Hidden(i) => mean[*i],
                Place::Known(value) => *value,
            };
            let new_mean = DVector::from_iterator(order.len(), order.iter().map(at));
            let new_covariance =
                DMatrix::from_fn(order.len(), order.len(), |i, j| match (&order[i], &order[j]) {
                    (Place::Hidden(i), Place::Hidden(j)) => covariance[(*i, *j)],
                    _ => 0.0,
                });
            (term.mean, term.covariance) = (new_mean, new_covariance);
        }
        Ok(Answer::new(log_evidence, targets, terms))
    }
}

impl Model {
    /// log p(value | configuration, parents), components summed, with the stored factors.
    pub(crate) fn log_local(
        &self,
        idx: NodeIdx,
        configuration: usize,
        value: &[f64],
        parents: &[f64],
    ) -> Result<f64, ModelError> {
        let Some(cpd) = self.mixture(idx) else {
            return Ok(0.0);
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
                terms.push(component.weight.ln() - (signs.len() as f64).ln() + log_density);
            }
        }
        Ok(log_sum_exp(&terms))
    }
}

enum Place {
    Hidden(usize),
    Known(f64),
}

struct Caches {
    local: BTreeMap<(NodeIdx, usize), f64>,
    blocks: Vec<BTreeMap<Vec<usize>, BlockTerms>>,
}

struct Carried {
    gaussian: Gaussian,
    /// First dimension of each hidden node.
    offsets: BTreeMap<NodeIdx, usize>,
    log_weight: f64,
}

/// The value of a node all of whose dimensions were observed exactly.
fn full_value(evidence: &Evidence, idx: NodeIdx) -> Option<&[f64]> {
    match evidence.get(idx) {
        Some(Observation::Value(value)) if value.iter().all(|v| !v.is_nan()) => Some(value),
        _ => None,
    }
}

fn side_by_side(a: &Gaussian, b: &Gaussian) -> Gaussian {
    let (n, m) = (a.mean.len(), b.mean.len());
    let mut mean = DVector::zeros(n + m);
    mean.rows_mut(0, n).copy_from(&a.mean);
    mean.rows_mut(n, m).copy_from(&b.mean);
    let mut covariance = DMatrix::zeros(n + m, n + m);
    covariance.view_mut((0, 0), (n, n)).copy_from(&a.covariance);
    covariance.view_mut((n, n), (m, m)).copy_from(&b.covariance);
    Gaussian { mean, covariance }
}
