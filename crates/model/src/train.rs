//! Training: every node by itself, since with all parents observed the likelihood falls apart into families.
//!
//! A discrete node gets counts with a Dirichlet prior. A continuous node gets, for each configuration of its discrete
//! parents (a *cell*), a mixture of linear regressions on its continuous parents. Where cells of the table are missing,
//! the rows that are complete for a family choose its number of components, and EM over the whole network goes on from
//! there with all rows.

use rayon::prelude::*;
use serde::Serialize;
use serde_json::{Map, json};

use crate::assemble::{assemble, discrete_parents, name_cells};
use crate::cell::{CellReport, CellTask, FittedCell, fit_cells, refit};
use crate::cpd::{Cpd, DiscreteCpd, Sign};
use crate::error::{ModelError, list};
use crate::extra::Extra;
use crate::family::{Cells, Family};
use crate::gaps::{GapReport, fit_gaps, log_table};
use crate::groups::read_groups;
use crate::model::{Model, Node};
use crate::network::{MixtureOrder, Network, NodeKind, NodeSpec};
use crate::statistics::{self, NodeStatistics, Statistics, shares};
use crate::table::Table;
use crate::von_mises_fisher_train::train_directions;

/// Settings of [`Model::fit`]. The paper gives none of them.
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

impl Model {
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
    pub fn fit(network: &Network, table: &Table, options: &TrainOptions) -> Result<Trained, ModelError> {
        learn(network, table, options, None)
    }

    /// The model after more rows, without those that it was trained on: training leaves in the model what it needs to go
    /// on (`statistics` in the file).
    ///
    /// Tables, and nodes with one component, are what training on all rows at once gives, up to rounding. Mixtures keep
    /// their numbers of components; earlier rows stay with the components that they were given to (incremental EM, Neal
    /// and Hinton 1998), while the new rows move and the parameters follow both. Standardisation follows all rows.
    /// The report counts all rows; its `log_likelihood` is that of the new ones.
    ///
    /// # Errors
    ///
    /// The model keeps no statistics (a person wrote it, or another program); as [`Model::fit`].
    ///
    /// # Examples
    ///
    /// ```
    /// use prehend_model::{Model, Network, Table, TrainOptions};
    ///
    /// let network = Network::from_toml("[[node]]\nname = \"width\"\nkind = \"gaussian_mixture\"\nmixture = { components = 1 }\n")?;
    /// let rows = |values: &[f64]| Table::new(values.len()).with_numbers("width", values.to_vec());
    /// let options = TrainOptions::default();
    /// let before = Model::fit(&network, &rows(&[0.03, 0.05, 0.04, 0.06])?, &options)?.model;
    /// let after = before.update(&rows(&[0.08, 0.07])?, &options)?.model;
    /// let at_once = Model::fit(&network, &rows(&[0.03, 0.05, 0.04, 0.06, 0.08, 0.07])?, &options)?.model;
    /// let mean = |model: &Model| model.query(&["width"], &Default::default()).map(|a| a.terms[0].mean[0]);
    /// assert!((mean(&after)? - mean(&at_once)?).abs() < 1e-12);
    /// # Ok::<(), prehend_model::ModelError>(())
    /// ```
    pub fn update(&self, table: &Table, options: &TrainOptions) -> Result<Trained, ModelError> {
        let (statistics, network) = Statistics::of(self)?;
        let options = TrainOptions {
            group: options.group.clone().or_else(|| statistics.group.clone()),
            ..options.clone()
        };
        learn(&network, table, &options, Some(&statistics))
    }
}

fn learn(
    network: &Network,
    table: &Table,
    options: &TrainOptions,
    earlier: Option<&Statistics>,
) -> Result<Trained, ModelError> {
    let weights = check_weights(table, options)?;
    let mut warnings = Vec::new();
    let groups = read_groups(network, table, options.group.as_deref(), &mut warnings)?;
    let (of_row, group_names) = match &groups {
        Some(groups) => (Some(groups.of_row.as_slice()), groups.names.as_slice()),
        None => (None, &[][..]),
    };
    let columns = earlier.map_or_else(Vec::new, |earlier| earlier.columns(network));
    let table_cells = Cells::read(network, table, weights, &columns)?;
    let families: Vec<Family> = (0..network.nodes().len())
        .map(|node| Family::read(network, node, &table_cells, of_row, earlier.is_none()))
        .collect();
    let earlier_cells = earlier.map_or_else(
        || vec![Vec::new(); network.nodes().len()],
        |earlier| earlier.in_units(network, &table_cells.scaling),
    );
    let mut tasks = Vec::new();
    for (i, (node, family)) in network.nodes().iter().zip(&families).enumerate() {
        if let NodeKind::Mixture(spec) = &node.kind {
            if family.rows.is_empty() && earlier.is_none() {
                return Err(ModelError::NoRows {
                    node: node.name.clone(),
                    n_rows: table.n_rows(),
                });
            }
            let together = shares(spec) && family.ends.len() > 1;
            let configurations = if together {
                vec![None]
            } else {
                (0..family.ends.len()).map(Some).collect()
            };
            tasks.extend(configurations.into_iter().map(|cell| CellTask {
                node: i,
                cell,
                spec,
                cells: &table_cells,
                family,
                options: options.clone(),
                grouped: groups.is_some(),
                group_names,
                earlier: &earlier_cells[i],
            }));
        }
    }
    let mut fitted = match earlier {
        None => fit_cells(&tasks),
        Some(_) => tasks.par_iter().map(refit).collect(),
    };
    let mut counts = Vec::with_capacity(families.len());
    for (i, (node, family)) in network.nodes().iter().zip(&families).enumerate() {
        let mut own = count(i, node, family, &table_cells);
        if let Some(earlier) = earlier.and_then(|earlier| earlier.nodes.get(&node.name)) {
            for (own, earlier) in own.iter_mut().flatten().zip(earlier.counts.iter().flatten()) {
                *own += earlier;
            }
        }
        if let NodeKind::Discrete { states, .. } = &node.kind {
            let unseen = (0..states.len()).filter(|&state| own.iter().all(|row| row[state] == 0.0));
            let unseen: Vec<&str> = unseen.map(|state| states[state].as_str()).collect();
            if !unseen.is_empty() {
                warnings.push(format!("`{}`: no row has {}", node.name, list(unseen)));
            }
        }
        counts.push(own);
    }
    let gaps = fit_gaps(network, &table_cells, &tasks, &mut fitted, &mut counts, options);
    if let Some(gaps) = &gaps {
        warnings.extend(gaps.warnings());
    }
    let n_rows = table.n_rows() + earlier.map_or(0, |earlier| earlier.n_rows);
    let n_rows_chosen = earlier.map_or(n_rows, |earlier| earlier.n_rows_chosen);
    if n_rows >= 2 * n_rows_chosen && network.nodes().iter().any(chooses_components) {
        warnings.push(format!(
            "the numbers of components were chosen with {n_rows_chosen} rows and there are {n_rows} now; \
             training anew may find more"
        ));
    }
    let mut statistics = Statistics {
        network: network.to_toml(),
        group: options
            .group
            .clone()
            .or_else(|| network.group().map(String::from)),
        n_rows,
        n_rows_chosen,
        nodes: std::collections::BTreeMap::new(),
    };
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
            let place = cell.place();
            let of_node = |warning: &String| format!("`{}`{place}: {warning}", node.name);
            warnings.extend(fit.warnings.iter().map(of_node));
        }
        let mut kept = NodeStatistics::default();
        let cpd = match &node.kind {
            NodeKind::Discrete { states, prior } => {
                kept.counts.clone_from(&counts[i]);
                Cpd::Discrete(DiscreteCpd {
                    states: states.clone(),
                    parents: discrete_parents(network, node),
                    table: counts[i]
                        .iter()
                        .map(|row| log_table(row, *prior).into_iter().map(f64::exp).collect())
                        .collect(),
                })
            }
            NodeKind::VonMisesFisher(spec) => {
                let before = earlier.and_then(|earlier| earlier.nodes.get(&node.name));
                let before = before.map(|node| node.directions.as_slice());
                let weights = &table_cells.weights;
                let trained = train_directions(network, node, spec, table, weights, options, before)?;
                report.n_rows = trained.n_rows;
                report.cells = trained.cells;
                kept.directions = trained.sums;
                warnings.extend(trained.warnings);
                Cpd::VonMisesFisher(trained.cpd)
            }
            NodeKind::Mixture(spec) => {
                kept = NodeStatistics::of_mixture(i, &table_cells, &tasks, &fitted);
                let parts = cells.iter().map(|cell| &cell.mixing).collect::<Vec<_>>();
                Cpd::Mixture(assemble(network, i, spec, &table_cells.scaling, &parts))
            }
        };
        statistics.nodes.insert(node.name.clone(), kept);
        let mut extra = Map::new();
        extra.insert(
            "training".into(),
            json!({ "n_rows": report.n_rows, "cells": report.cells }),
        );
        nodes.push(Node {
            name: node.name.clone(),
            cpd,
            extra: Extra::new(extra),
        });
        reports.push(report);
    }
    let provenance = json!({
        "program": concat!("prehend-model ", env!("CARGO_PKG_VERSION")),
        "seed": options.seed,
        "n_rows": n_rows,
        "restarts": options.restarts,
        "group": statistics.group,
        "warnings": warnings,
    });
    let extra = [
        ("provenance".to_string(), provenance),
        (statistics::KEY.to_string(), json!(statistics)),
    ];
    let model = Model::new(nodes, Extra::new(Map::from_iter(extra)))?;
    let log_likelihood = model.log_likelihood(table)?.iter().sum();
    let n_parameters = model.n_parameters();
    let report = TrainReport {
        n_rows,
        log_likelihood,
        n_parameters,
        nodes: reports,
        gaps,
        warnings,
    };
    Ok(Trained { model, report })
}

/// Whether the number of components is chosen by the data.
fn chooses_components(node: &NodeSpec) -> bool {
    match &node.kind {
        NodeKind::Discrete { .. } => false,
        NodeKind::Mixture(spec) => matches!(spec.order, MixtureOrder::Bic { .. }),
        NodeKind::VonMisesFisher(spec) => matches!(spec.order, MixtureOrder::Bic { .. }),
    }
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

impl NodeReport {
    /// Components of each configuration.
    pub fn components(&self) -> Vec<usize> {
        self.cells.iter().map(|cell| cell.components).collect()
    }

    /// The report as JSON.
    pub fn to_json(&self) -> String {
        json!(self).to_string()
    }
}

/// Where a latent sign makes the mean of the data meaningless.
pub(crate) fn is_centered(sign: Sign) -> bool {
    sign == Sign::Fixed
}
