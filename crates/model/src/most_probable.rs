//! The single likeliest story: states of the discrete nodes, and the continuous nodes given them.

use serde_json::{Map, Value, json};

use crate::block::Latent;
use crate::cpd::{Cpd, NodeIdx};
use crate::elimination::{Elimination, full_value};
use crate::error::ModelError;
use crate::evidence::{Evidence, Observation};
use crate::json::rows;
use crate::log_table::LogTable;
use crate::model::Model;
use crate::root_gaussian::covariance_of;

/// The likeliest joint state of the unobserved discrete nodes, and the continuous nodes given it.
#[derive(Debug, Clone, PartialEq)]
pub struct MostProbable {
    /// Natural logarithm of the posterior probability of these states.
    pub log_probability: f64,
    /// Natural logarithm of the density of the evidence.
    pub log_evidence: f64,
    /// Unobserved discrete nodes with their states.
    pub states: Vec<(String, String)>,
    /// The component of each continuous node, where components were maximised; from 0.
    pub components: Vec<(String, usize)>,
    /// Unobserved (or partly observed) continuous nodes given those states and the evidence.
    pub values: Vec<ProbableValue>,
}

/// A continuous node in the likeliest story.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbableValue {
    /// The node.
    pub node: String,
    /// Its conditional mean.
    pub mean: Vec<f64>,
    /// The mean of the conditional component where the density is highest; `None` where a component is singular.
    pub mode: Option<Vec<f64>>,
    /// Its conditional covariance.
    pub covariance: Vec<Vec<f64>>,
}

impl Model {
    /// The likeliest joint state of the unobserved discrete nodes, hidden numbers summed out, and mixture components
    /// summed or maximised as `latent` says; then, given it, every continuous node that is not wholly observed: its
    /// mean and mode by itself (summed), or its Gaussian under the likeliest components (maximised).
    ///
    /// # Errors
    ///
    /// As [`Model::query`]; [`ModelError::Pruned`] where combinations of components are too many to be sure.
    pub fn most_probable(&self, evidence: &Evidence, latent: Latent) -> Result<MostProbable, ModelError> {
        let all = (0..self.nodes().len()).map(NodeIdx);
        let is_open = |idx: &NodeIdx| match (&self.node(*idx).cpd, evidence.get(*idx)) {
            // Directions are not Gaussian: they are left out, and asked about by themselves.
            (Cpd::Discrete(_), Some(Observation::State(_))) | (Cpd::VonMisesFisher(_), _) => false,
            (Cpd::Mixture(_), _) => full_value(evidence, *idx).is_none(),
            _ => true,
        };
        let (discrete, continuous): (Vec<NodeIdx>, Vec<NodeIdx>) =
            all.filter(is_open).partition(|&idx| self.n_states(idx) > 0);
        // Components of nodes that nothing observed depends on have a say only where they are maximised.
        let asked = match latent {
            Latent::Summed => discrete.clone(),
            Latent::Maximised => [&discrete[..], &continuous].concat(),
        };
        let query = Elimination::new(self, &asked, evidence, latent);
        let (log_joint, chosen) = likeliest_states(&query)?;
        let mut given = evidence.clone();
        let mut states = Vec::with_capacity(discrete.len());
        for &idx in &discrete {
            let (node, state) = (self.node(idx), chosen[idx.0]);
            states.push((node.name.clone(), node.states()[state].clone()));
            given = given.with(self, &node.name, Observation::State(state))?;
        }
        let log_evidence = self.log_evidence(evidence)?;
        let mut out = MostProbable {
            log_probability: log_joint - log_evidence,
            log_evidence,
            states,
            components: Vec::new(),
            values: Vec::new(),
        };
        match latent {
            Latent::Summed => {
                for &idx in &continuous {
                    out.values.extend(self.value_by_itself(idx, &given)?);
                }
            }
            Latent::Maximised => self.values_by_component(&continuous, &given, &mut out)?,
        }
        Ok(out)
    }

    fn value_by_itself(&self, idx: NodeIdx, given: &Evidence) -> Result<Option<ProbableValue>, ModelError> {
        let node = self.node(idx).name.clone();
        let answer = self.query(&[&node], given)?;
        answer.exact()?;
        Ok(answer.mixture(&node).map(|mixture| ProbableValue {
            mean: mixture.mean().iter().copied().collect(),
            mode: mixture.mode().map(|mode| mode.iter().copied().collect()),
            covariance: rows(&mixture.covariance()),
            node,
        }))
    }

    /// The likeliest components of all continuous nodes, every discrete node given.
    fn values_by_component(
        &self,
        continuous: &[NodeIdx],
        given: &Evidence,
        out: &mut MostProbable,
    ) -> Result<(), ModelError> {
        let query = Elimination::new(self, continuous, given, Latent::Maximised);
        for &idx in query.locals() {
            let mut best: Option<(usize, f64)> = None;
            for (k, log) in query.log_local_components(idx)? {
                if best.is_none_or(|(_, most)| log > most) {
                    best = Some((k, log));
                }
            }
            out.components
                .extend(best.map(|(k, _)| (self.node(idx).name.clone(), k)));
        }
        for block in &query.blocks {
            let sum = query.block_sum(block, &query.states, true)?;
            if sum.lost >= sum.total {
                return Err(ModelError::Pruned { error_bound: 1.0 });
            }
            let Some(piece) = sum
                .pieces
                .iter()
                .reduce(|a, b| if b.log_weight > a.log_weight { b } else { a })
            else {
                continue;
            };
            for (idx, k) in block.nodes.iter().zip(&piece.components) {
                out.components.push((self.node(*idx).name.clone(), *k));
            }
            let mut start = 0;
            for &idx in &block.targets {
                let d = self.node(idx).columns().len();
                let dims: Vec<usize> = (start..start + d).collect();
                start += d;
                let mean: Vec<f64> = dims.iter().map(|&i| piece.gaussian.mean[i]).collect();
                out.values.push(ProbableValue {
                    node: self.node(idx).name.clone(),
                    mode: Some(mean.clone()),
                    mean,
                    covariance: rows(&covariance_of(&piece.gaussian.root.select_rows(&dims))),
                });
            }
        }
        Ok(())
    }
}

/// log of the largest product of the tables, and the state of every node there.
fn likeliest_states(query: &Elimination) -> Result<(f64, Vec<usize>), ModelError> {
    let sizes = |idx: NodeIdx| query.size(idx);
    let tables = query.tables(true)?;
    let best = |tables: &[LogTable], keep: &[NodeIdx]| {
        LogTable::joined(tables.to_vec(), keep, &sizes, Latent::Maximised)
    };
    let most = best(&tables.exact, &[])?.logs[0];
    if most.is_nan() {
        return Err(query.culprit(&tables)?);
    }
    if most == f64::NEG_INFINITY {
        return Err(query.impossible());
    }
    if let Some(upper) = &tables.upper {
        let bound = best(upper, &[])?.logs[0];
        // More than rounding above: another state might be likelier.
        if bound > most + 1e-9 {
            return Err(ModelError::Pruned {
                error_bound: -(most - bound).exp_m1(),
            });
        }
    }
    let mut fixed = tables.exact;
    let mut states = query.states.clone();
    for &idx in query.free() {
        let by_state = best(&fixed, &[idx])?.logs;
        let state =
            (0..by_state.len()).fold(0, |best, i| if by_state[i] > by_state[best] { i } else { best });
        states[idx.0] = state;
        let only = |i: usize| if i == state { 0.0 } else { f64::NEG_INFINITY };
        fixed.push(LogTable {
            scope: vec![idx],
            sizes: vec![by_state.len()],
            logs: (0..by_state.len()).map(only).collect(),
        });
    }
    Ok((most, states))
}

impl MostProbable {
    /// `{"log_probability", "log_evidence", "states": {NODE: state}, "components": {NODE: k}, "values": {NODE: {"mean", "mode", "covariance"}}}`.
    pub fn to_json(&self) -> String {
        let states: Map<String, Value> = self
            .states
            .iter()
            .map(|(node, state)| (node.clone(), json!(state)))
            .collect();
        let values: Map<String, Value> = self
            .values
            .iter()
            .map(|value| {
                let entry = json!({ "mean": value.mean, "mode": value.mode, "covariance": value.covariance });
                (value.node.clone(), entry)
            })
            .collect();
        let components: Map<String, Value> = self
            .components
            .iter()
            .map(|(node, k)| (node.clone(), json!(k)))
            .collect();
        json!({
            "log_probability": self.log_probability,
            "log_evidence": self.log_evidence,
            "states": states,
            "components": components,
            "values": values,
        })
        .to_string()
    }
}
