//! From standardised fits to the distributions and reports of a model.

use crate::cell::{CellReport, FittedCell};
use crate::cpd::{Component, MixtureCpd, NodeIdx, Scaling};
use crate::family::n_configurations;
use crate::moments::Mixing;
use crate::network::{MixtureSpec, Network, NodeKind, NodeSpec};

/// The cells' reports with the states of the parents in them.
pub(crate) fn name_cells(network: &Network, node: &NodeSpec, cells: &[&FittedCell]) -> Vec<CellReport> {
    let parents: Vec<(&str, &[String])> = node
        .parents
        .iter()
        .filter_map(|&parent| match &network.nodes()[parent].kind {
            NodeKind::Discrete { states, .. } => {
                Some((network.nodes()[parent].name.as_str(), states.as_slice()))
            }
            NodeKind::Mixture(_) | NodeKind::VonMisesFisher(_) => None,
        })
        .collect();
    cells
        .iter()
        .map(|cell| {
            let mut report = cell.report.clone();
            if let Some(mut row) = cell.cell {
                for (name, states) in parents.iter().rev() {
                    report
                        .configuration
                        .insert(0, ((*name).into(), states[row % states.len()].clone()));
                    row /= states.len();
                }
            }
            report
        })
        .collect()
}

pub(crate) fn discrete_parents(network: &Network, node: &NodeSpec) -> Vec<NodeIdx> {
    let is_discrete = |&&parent: &&usize| matches!(network.nodes()[parent].kind, NodeKind::Discrete { .. });
    node.parents
        .iter()
        .filter(is_discrete)
        .map(|&parent| NodeIdx(parent))
        .collect()
}

/// Turns standardised regressions back into the columns' units: one fit for each configuration, or one for all.
pub(crate) fn assemble(
    network: &Network,
    position: usize,
    spec: &MixtureSpec,
    scaling: &[Scaling],
    fits: &[&Mixing],
) -> MixtureCpd {
    let node = &network.nodes()[position];
    let unit = &scaling[position];
    let parents = node.parents.iter().map(|&parent| &scaling[parent]);
    let parent_mean: Vec<f64> = parents.clone().flat_map(|unit| unit.mean.clone()).collect();
    let parent_unit: Vec<f64> = parents.flat_map(|unit| unit.standard_deviation.clone()).collect();
    let (d, q) = (spec.columns.len(), parent_mean.len());
    let n = n_configurations(network, &node.parents);
    let mut components = Vec::with_capacity(n);
    for configuration in 0..n {
        // Configurations that share something come from one fit.
        let (fit, row) = match fits {
            [all] => (*all, configuration),
            each => (each[configuration], 0),
        };
        let weights: Vec<f64> = fit.log_weights[row]
            .iter()
            .map(|log_weight| log_weight.exp())
            .collect();
        let total: f64 = weights.iter().sum();
        let parts = fit.set(row).iter().zip(weights).map(|(part, weight)| {
            let coefficients = nalgebra::DMatrix::from_fn(d, q, |i, j| {
                part.slopes[(i, j + 1)] * unit.standard_deviation[i] / parent_unit[j]
            });
            let mean = nalgebra::DVector::from_fn(d, |i, _| {
                let pulled: f64 = (0..q).map(|j| coefficients[(i, j)] * parent_mean[j]).sum();
                unit.mean[i] + unit.standard_deviation[i] * part.slopes[(i, 0)] - pulled
            });
            let covariance = nalgebra::DMatrix::from_fn(d, d, |i, j| {
                part.covariance[(i, j)] * unit.standard_deviation[i] * unit.standard_deviation[j]
            });
            Component {
                weight: weight / total,
                mean,
                coefficients,
                covariance,
            }
        });
        components.push(parts.collect());
    }
    MixtureCpd {
        columns: spec.columns.clone(),
        discrete_parents: discrete_parents(network, node),
        continuous_parents: node
            .parents
            .iter()
            .filter(|&&parent| matches!(network.nodes()[parent].kind, NodeKind::Mixture(_)))
            .map(|&parent| NodeIdx(parent))
            .collect(),
        components,
        weights: spec.weights,
        sign: spec.sign,
        sphere: spec.sphere,
        scaling: Some(unit.clone()),
    }
}
