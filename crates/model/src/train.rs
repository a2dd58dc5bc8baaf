//! Training: every node by itself, since with all parents observed the likelihood falls apart into families.
//!
//! A discrete node gets counts with a Dirichlet prior. A continuous node gets, for each configuration of its discrete
//! parents (a *cell*), a mixture of linear regressions on its continuous parents. Where cells of the table are missing,
//! the rows that are complete for a family choose its number of components, and EM over the whole network goes on from
//! there with all rows.

use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::cell::{CellReport, CellTask, FittedCell, fit_cells};
use crate::cpd::{Component, Cpd, DiscreteCpd, MixtureCpd, NodeIdx, Scaling, Sign, Weights};
use crate::error::{ModelError, list};
use crate::family::{Cells, Family};
use crate::gaps::{GapReport, fit_gaps, log_table};
use crate::model::{Model, Node};
use crate::network::{MixtureSpec, Network, NodeKind, NodeSpec};
use crate::table::Table;
use crate::von_mises_fisher_train::train_directions;

/// Settings of [`train`]. The paper gives none of them.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainOptions {
    /// Every random choice follows from it.
    pub seed: u64,
    /// Starts of EM for each mixture; the best is carried on.
    pub restarts: usize,
    /// Most EM steps.
    pub max_steps: usize,
    /// EM ends when the objective gains less than this per row.
    pub tolerance: f64,
    /// Column of rows that belong together; `None` takes the network's `group`.
    pub group: Option<String>,
    /// One weight of at least 0 per row; `None` counts every row once.
    pub weights: Option<Vec<f64>>,
}

impl Default for TrainOptions {
    fn default() -> Self {
        Self {
            seed: 0,
            restarts: 5,
            max_steps: 200,
            tolerance: 1e-5,
            group: None,
            weights: None,
        }
    }
}

/// A trained model, and how training went.
#[derive(Debug, Clone)]
pub struct Trained {
    /// The model.
    pub model: Model,
    /// How training went, node by node.
    pub report: TrainReport,
}

/// How training went.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrainReport {
    /// Rows of the table.
    pub n_rows: usize,
    /// Σ over rows of the log density of what is known of the row, nats.
    pub log_likelihood: f64,
    /// Free parameters of the model.
    pub n_parameters: usize,
    /// One entry per node, in the network's order.
    pub nodes: Vec<NodeReport>,
    /// EM over the rows with missing cells; `None` where there are none.
    pub gaps: Option<GapReport>,
    /// What a person should know.
    pub warnings: Vec<String>,
}

/// How one node was trained.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NodeReport {
    /// The node.
    pub name: String,
    /// Rows that had all columns of the family.
    pub n_rows: usize,
    /// One entry per configuration of the discrete parents; empty for a discrete node.
    pub cells: Vec<CellReport>,
}

/// Fits all nodes of a network to a table.
///
/// # Errors
///
/// A column is missing or has a cell of the wrong kind; a node has no complete row; weights do not fit the rows.
/// A configuration with too few rows is no error: it takes the fit over all configurations, with a warning.
///
/// # Source
///
/// Section IV-B (EM and BIC per node); the guard against one component per object is ours.
pub fn train(network: &Network, table: &Table, options: &TrainOptions) -> Result<Trained, ModelError> {
    let weights = check_weights(table, options)?;
    let mut warnings = Vec::new();
    let groups = read_groups(network, table, options.group.as_deref(), &mut warnings)?;
    let table_cells = Cells::read(network, table, weights)?;
    let families: Vec<Family> = (0..network.nodes().len())
        .map(|node| Family::read(network, node, &table_cells, groups.as_deref()))
        .collect();
    let mut tasks = Vec::new();
    for (i, (node, family)) in network.nodes().iter().zip(&families).enumerate() {
        if let NodeKind::Mixture(spec) = &node.kind {
            if family.rows.is_empty() {
                return Err(ModelError::NoRows {
                    node: node.name.clone(),
                    n_rows: table.n_rows(),
                });
            }
            tasks.extend(cell_tasks(
                i,
                spec,
                &table_cells,
                family,
                options,
                groups.is_some(),
            ));
        }
    }
    let mut fitted = fit_cells(&tasks);
    let mut counts: Vec<Vec<Vec<f64>>> = network
        .nodes()
        .iter()
        .zip(&families)
        .enumerate()
        .map(|(i, (node, family))| count(i, node, family, &table_cells))
        .collect();
    for (node, counts) in network.nodes().iter().zip(&counts) {
        if let NodeKind::Discrete { states, .. } = &node.kind {
            let unseen = (0..states.len()).filter(|&state| counts.iter().all(|row| row[state] == 0.0));
            let unseen: Vec<&str> = unseen.map(|state| states[state].as_str()).collect();
            if !unseen.is_empty() {
                warnings.push(format!("`{}`: no row has {}", node.name, list(unseen)));
            }
        }
    }
    let gaps = fit_gaps(network, &table_cells, &tasks, &mut fitted, &mut counts, options);
    if let Some(gaps) = &gaps {
        if gaps.left_out > 0 {
            warnings.push(format!(
                "{} of {} rows with gaps have too many combinations; only their complete families were learned from",
                gaps.left_out, gaps.n_rows
            ));
        }
        if !gaps.converged {
            warnings.push(format!(
                "EM over the rows with gaps ended after {} steps without settling",
                gaps.steps
            ));
        }
    }
    let mut nodes = Vec::with_capacity(families.len());
    let mut reports = Vec::with_capacity(families.len());
    for (i, (node, family)) in network.nodes().iter().zip(&families).enumerate() {
        let cells: Vec<&FittedCell> = tasks
            .iter()
            .zip(&fitted)
            .filter(|(task, _)| task.node == i)
            .map(|(_, cell)| cell)
            .collect();
        let mut report = NodeReport {
            name: node.name.clone(),
            n_rows: family.n_complete,
            cells: name_cells(network, node, &cells),
        };
        for (cell, fit) in report.cells.iter().zip(&cells) {
            let place = if cell.configuration.is_empty() {
                String::new()
            } else {
                cell.label()
            };
            warnings.extend(
                fit.warnings
                    .iter()
                    .map(|warning| format!("`{}`{place}: {warning}", node.name)),
            );
        }
        let cpd = match &node.kind {
            NodeKind::Discrete { states, prior } => Cpd::Discrete(DiscreteCpd {
                states: states.clone(),
                parents: discrete_parents(network, node),
                table: counts[i]
                    .iter()
                    .map(|row| log_table(row, *prior).into_iter().map(f64::exp).collect())
                    .collect(),
            }),
            NodeKind::VonMisesFisher(spec) => {
                let weights = &table_cells.weights;
                let trained = train_directions(network, node, spec, table, weights, options)?;
                report.n_rows = trained.n_rows;
                report.cells = trained.cells;
                warnings.extend(trained.warnings);
                Cpd::VonMisesFisher(trained.cpd)
            }
            NodeKind::Mixture(spec) => Cpd::Mixture(assemble(network, i, spec, &table_cells, family, &cells)),
        };
        let mut extra = Map::new();
        extra.insert(
            "training".into(),
            json!({ "n_rows": report.n_rows, "cells": report.cells }),
        );
        nodes.push(Node {
            name: node.name.clone(),
            cpd,
            extra,
        });
        reports.push(report);
    }
    let provenance = json!({
        "program": concat!("prehend-model ", env!("CARGO_PKG_VERSION")),
        "seed": options.seed,
        "n_rows": table.n_rows(),
        "restarts": options.restarts,
        "group": options.group.as_deref().or(network.group()),
        "warnings": warnings,
    });
    let model = Model::new(nodes, Map::from_iter([("provenance".to_string(), provenance)]))?;
    let log_likelihood = model.log_likelihood(table)?.iter().sum();
    let n_parameters = model.n_parameters();
    let report = TrainReport {
        n_rows: table.n_rows(),
        log_likelihood,
        n_parameters,
        nodes: reports,
        gaps,
        warnings,
    };
    Ok(Trained { model, report })
}

fn check_weights(table: &Table, options: &TrainOptions) -> Result<Vec<f64>, ModelError> {
    let weights = options
        .weights
        .clone()
        .unwrap_or_else(|| vec![1.0; table.n_rows()]);
    if weights.len() != table.n_rows() {
        return Err(ModelError::Length {
            what: "the row weights".into(),
            found: weights.len(),
            expected: table.n_rows(),
        });
    }
    match weights.iter().position(|w| !(*w >= 0.0 && w.is_finite())) {
        None => Ok(weights),
        Some(row) => Err(ModelError::Cell {
            column: "weights".into(),
            row,
            found: weights[row].to_string(),
            expected: "a finite weight of at least 0".into(),
        }),
    }
}

/// A number for each row, equal where the rows belong together. Rows without a group stand alone.
pub(crate) fn read_groups(
    network: &Network,
    table: &Table,
    group: Option<&str>,
    warnings: &mut Vec<String>,
) -> Result<Option<Vec<usize>>, ModelError> {
    let column = match (group, network.group()) {
        (Some(column), _) => column,
        (None, Some(column)) => {
            if table.column(column).is_none() {
                warnings.push(format!(
                    "the network's group column `{column}` is not in the table; values that repeat within a group \
                     count as if each row had measured them anew"
                ));
                return Ok(None);
            }
            column
        }
        (None, None) => return Ok(None),
    };
    let mut known = std::collections::BTreeMap::new();
    let cells = table.texts(column, "grouping")?;
    let mut next = 0;
    Ok(Some(
        cells
            .into_iter()
            .map(|cell| {
                let group = match cell {
                    Some(text) => *known.entry(text).or_insert(next),
                    None => next,
                };
                next = next.max(group + 1);
                group
            })
            .collect(),
    ))
}

/// One task per configuration, or a single one where the components are shared.
fn cell_tasks<'a>(
    node: usize,
    spec: &'a MixtureSpec,
    cells: &'a Cells,
    family: &'a Family,
    options: &TrainOptions,
    grouped: bool,
) -> Vec<CellTask<'a>> {
    let together = spec.weights != Weights::PerConfiguration || spec.shared_covariance;
    let configurations: Vec<Option<usize>> = if together && family.ends.len() > 1 {
        vec![None]
    } else {
        (0..family.ends.len()).map(Some).collect()
    };
    configurations
        .into_iter()
        .map(|cell| CellTask {
            node,
            cell,
            spec,
            cells,
            family,
            options: options.clone(),
            grouped,
        })
        .collect()
}

/// The cells' reports with the states of the parents in them.
fn name_cells(network: &Network, node: &NodeSpec, cells: &[&FittedCell]) -> Vec<CellReport> {
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

fn discrete_parents(network: &Network, node: &NodeSpec) -> Vec<NodeIdx> {
    let is_discrete = |&&parent: &&usize| matches!(network.nodes()[parent].kind, NodeKind::Discrete { .. });
    node.parents
        .iter()
        .filter(is_discrete)
        .map(|&parent| NodeIdx(parent))
        .collect()
}

/// Weight of each state under each configuration, over the rows where both are known; nothing for a continuous node.
fn count(position: usize, node: &NodeSpec, family: &Family, cells: &Cells) -> Vec<Vec<f64>> {
    let NodeKind::Discrete { states, .. } = &node.kind else {
        return Vec::new();
    };
    let mut counts = vec![vec![0.0; states.len()]; family.ends.len()];
    for (configuration, counts) in counts.iter_mut().enumerate() {
        for &row in &family.rows[family.members(Some(configuration))] {
            if let Some(state) = cells.states[position][row] {
                counts[state] += cells.weights[row];
            }
        }
    }
    counts
}

/// Turns standardised regressions back into the columns' units.
fn assemble(
    network: &Network,
    position: usize,
    spec: &MixtureSpec,
    table_cells: &Cells,
    family: &Family,
    cells: &[&FittedCell],
) -> MixtureCpd {
    let node = &network.nodes()[position];
    let unit = &table_cells.scaling[position];
    let parent_unit = table_cells.parent_scaling(network, position);
    let (d, q) = (spec.columns.len(), parent_unit.mean.len());
    let mut components = Vec::with_capacity(family.ends.len());
    for configuration in 0..family.ends.len() {
        // Configurations that share something come from one cell.
        let (cell, row) = match cells {
            [all] => (*all, configuration),
            each => (each[configuration], 0),
        };
        let weights: Vec<f64> = cell.mixing.log_weights[row]
            .iter()
            .map(|log_weight| log_weight.exp())
            .collect();
        let total: f64 = weights.iter().sum();
        let parts = cell.mixing.set(row).iter().zip(weights).map(|(part, weight)| {
            let coefficients = nalgebra::DMatrix::from_fn(d, q, |i, j| {
                part.slopes[(i, j + 1)] * unit.standard_deviation[i] / parent_unit.standard_deviation[j]
            });
            let mean = nalgebra::DVector::from_fn(d, |i, _| {
                let pulled: f64 = (0..q).map(|j| coefficients[(i, j)] * parent_unit.mean[j]).sum();
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
        scaling: Some(Scaling {
            mean: unit.mean.clone(),
            standard_deviation: unit.standard_deviation.clone(),
        }),
    }
}

impl NodeReport {
    /// Components of each configuration.
    pub fn components(&self) -> Vec<usize> {
        self.cells.iter().map(|cell| cell.components).collect()
    }

    /// The report as JSON.
    pub fn to_json(&self) -> Value {
        json!(self)
    }
}

/// Where a latent sign makes the mean of the data meaningless.
pub(crate) fn is_centered(sign: Sign) -> bool {
    sign == Sign::Fixed
}
