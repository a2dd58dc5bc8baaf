//! What a model keeps of the rows that it was trained on, so that learning can go on without them: the key `statistics`
//! of `model.json`.
//!
//! Counts of discrete nodes, expected moments of components (in the units of the node's `scaling`), and what the units
//! come from. They are sufficient: with one component per cell, training on them and new rows is training on all rows.

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::cell::{CellTask, FittedCell};
use crate::cpd::{Scaling, Weights};
use crate::error::ModelError;
use crate::family::{Cells, ColumnSums, n_configurations, units};
use crate::measured::Measured;
use crate::model::Model;
use crate::moments::{CovariancePrior, Moment};
use crate::network::{MixtureSpec, Network, NodeKind};

/// Key of the model file.
pub(crate) const KEY: &str = "statistics";

/// What all nodes keep.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Statistics {
    /// The network file.
    pub network: String,
    /// Column of rows that belong together.
    pub group: Option<String>,
    /// Rows learned from.
    pub n_rows: usize,
    /// Rows when the numbers of components were chosen.
    pub n_rows_chosen: usize,
    pub nodes: BTreeMap<String, NodeStatistics>,
}

/// What one node keeps: a discrete one counts, a mixture columns and cells, one of unit vectors directions.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct NodeStatistics {
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub counts: Vec<Vec<f64>>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub columns: Vec<ColumnSums>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cells: Vec<CellStatistics>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub directions: Vec<Vec<DirectionSum>>,
}

/// One fit: a configuration of the discrete parents, or all where they share something.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct CellStatistics {
    measured: Measured,
    prior: CovariancePrior,
    ridge: Vec<f64>,
    /// Of each configuration and component.
    moments: Vec<Vec<PackedMoment>>,
}

/// Σ r, and Σ r z zᵀ as the rows of its upper triangle; weights as given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct PackedMoment {
    mass: f64,
    product: Vec<f64>,
}

/// Σ r and Σ r x of a component of unit vectors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct DirectionSum {
    pub mass: f64,
    pub sum: Vec<f64>,
}

/// A cell's statistics in the units of today.
#[derive(Debug, Clone)]
pub(crate) struct EarlierCell {
    pub measured: Measured,
    pub prior: CovariancePrior,
    pub ridge: Vec<f64>,
    /// Weights as given.
    pub moments: Vec<Vec<Moment>>,
}

impl EarlierCell {
    /// What a fit starts from: the cell of its configuration, all that share something, or all cells as one component.
    pub fn of(cells: &[Self], configuration: Option<usize>, by_configuration: bool) -> Option<Self> {
        match configuration {
            Some(i) => cells.get(i).cloned(),
            None if by_configuration && !cells.is_empty() => Some(Self::together(cells)),
            None => cells.first().cloned(),
        }
    }

    fn together(cells: &[Self]) -> Self {
        let mut all = cells.iter().flat_map(|cell| cell.moments.iter().flatten());
        let mut sum = all.next().cloned().unwrap_or(Moment::zero(0));
        for moment in all {
            sum.add(moment);
        }
        let measured = cells
            .iter()
            .fold(Measured::default(), |sum, cell| sum.joined(&cell.measured));
        Self {
            measured,
            prior: CovariancePrior::WEAK,
            ridge: vec![crate::moments::RIDGE; cells[0].ridge.len()],
            moments: vec![vec![sum]],
        }
    }

    /// The moments with every row counting so much.
    pub fn scaled(self, scale: f64) -> Vec<Vec<Moment>> {
        let mut moments = self.moments;
        for moment in moments.iter_mut().flatten() {
            moment.mass *= scale;
            moment.product *= scale;
        }
        moments
    }
}

impl DirectionSum {
    /// The sum of all.
    pub fn together<'a>(d: usize, parts: impl Iterator<Item = &'a Self>) -> Self {
        let mut out = Self {
            mass: 0.0,
            sum: vec![0.0; d],
        };
        for part in parts {
            out.mass += part.mass;
            for (sum, more) in out.sum.iter_mut().zip(&part.sum) {
                *sum += more;
            }
        }
        out
    }
}

impl CellStatistics {
    pub fn of(fitted: &FittedCell) -> Self {
        let scale = if fitted.own_moments.is_some() {
            fitted.measured.scale()
        } else {
            fitted.scale
        };
        let settings = &fitted.rows.settings;
        let moments = fitted.own_moments.as_ref().unwrap_or(&fitted.moments);
        Self {
            measured: fitted.measured.clone(),
            prior: settings.prior,
            ridge: settings.ridge.clone(),
            moments: moments
                .iter()
                .map(|cell| {
                    cell.iter()
                        .map(|moment| PackedMoment::of(moment, scale))
                        .collect()
                })
                .collect(),
        }
    }
}

impl PackedMoment {
    fn of(moment: &Moment, scale: f64) -> Self {
        let m = moment.product.nrows();
        let upper = (0..m).flat_map(|i| (i..m).map(move |j| (i, j)));
        Self {
            mass: moment.mass / scale,
            product: upper.map(|at| moment.product[at] / scale).collect(),
        }
    }

    fn unpack(&self, m: usize) -> Option<Moment> {
        if self.product.len() != m * (m + 1) / 2 {
            return None;
        }
        let mut product = DMatrix::zeros(m, m);
        let upper = (0..m).flat_map(|i| (i..m).map(move |j| (i, j)));
        for ((i, j), value) in upper.zip(&self.product) {
            product[(i, j)] = *value;
            product[(j, i)] = *value;
        }
        Some(Moment {
            mass: self.mass,
            product,
        })
    }
}

impl Statistics {
    /// What a model carries, with its network.
    pub fn of(model: &Model) -> Result<(Self, Network), ModelError> {
        let bad = |problem: String| ModelError::ModelFile {
            place: format!("`{KEY}`"),
            problem,
        };
        let value: &Value = model.extra().keys().get(KEY).ok_or_else(|| {
            bad("is missing, so this model does not say what it was trained on; train it anew".into())
        })?;
        let statistics: Self = serde_json::from_value(value.clone()).map_err(|e| bad(e.to_string()))?;
        let network = Network::from_toml(&statistics.network)?;
        for node in network.nodes() {
            let own = statistics.nodes.get(&node.name);
            if !own.is_some_and(|own| own.fits(&network, &node.kind, &node.parents)) {
                return Err(bad(format!(
                    "does not fit the node `{}`; train it anew",
                    node.name
                )));
            }
        }
        Ok((statistics, network))
    }

    /// Per node of the network what its columns' units come from.
    pub fn columns(&self, network: &Network) -> Vec<Vec<ColumnSums>> {
        let own = |name: &String| {
            self.nodes
                .get(name)
                .map_or_else(Vec::new, |node| node.columns.clone())
        };
        network.nodes().iter().map(|node| own(&node.name)).collect()
    }

    /// Per node of the network its cells, in the units of `now`.
    pub fn in_units(&self, network: &Network, now: &[Scaling]) -> Vec<Vec<EarlierCell>> {
        let before = self.units(network);
        let of_node = |i: usize| {
            let (d, change) = change(network, i, &before, now);
            let m = change.nrows();
            let cells = self.nodes.get(&network.nodes()[i].name).into_iter();
            cells
                .flat_map(|node| &node.cells)
                .map(|cell| EarlierCell {
                    measured: cell.measured.clone(),
                    prior: cell.prior,
                    ridge: cell.ridge.clone(),
                    moments: cell
                        .moments
                        .iter()
                        .map(|row| {
                            let moments = row.iter().filter_map(|packed| packed.unpack(m));
                            moments
                                .map(|moment| Moment {
                                    mass: moment.mass,
                                    product: &change * moment.product * change.transpose(),
                                })
                                .collect()
                        })
                        .collect(),
                })
                .filter(|_| d > 0)
                .collect()
        };
        (0..network.nodes().len()).map(of_node).collect()
    }

    /// Units in which the moments are.
    pub fn units(&self, network: &Network) -> Vec<Scaling> {
        let columns = self.columns(network);
        let each = network.nodes().iter().zip(&columns);
        each.map(|(node, sums)| match &node.kind {
            NodeKind::Mixture(spec) => units(sums, spec),
            NodeKind::Discrete { .. } | NodeKind::VonMisesFisher(_) => Scaling {
                mean: Vec::new(),
                standard_deviation: Vec::new(),
            },
        })
        .collect()
    }
}

impl NodeStatistics {
    /// What a trained mixture keeps.
    pub fn of_mixture(node: usize, cells: &Cells, tasks: &[CellTask], fitted: &[FittedCell]) -> Self {
        Self {
            columns: cells.sums[node].clone(),
            cells: tasks
                .iter()
                .zip(fitted)
                .filter(|(task, _)| task.node == node)
                .map(|(_, fitted)| CellStatistics::of(fitted))
                .collect(),
            ..Self::default()
        }
    }

    fn fits(&self, network: &Network, kind: &NodeKind, parents: &[usize]) -> bool {
        let n = n_configurations(network, parents);
        match kind {
            NodeKind::Discrete { states, .. } => {
                let legal = |count: &f64| count.is_finite() && *count >= 0.0;
                let row = |row: &Vec<f64>| row.len() == states.len() && row.iter().all(legal);
                self.counts.len() == n && self.counts.iter().all(row)
            }
            NodeKind::VonMisesFisher(spec) => {
                let legal = |part: &DirectionSum| {
                    part.sum.len() == spec.columns.len()
                        && part.mass >= 0.0
                        && part.sum.iter().chain([&part.mass]).all(|v| v.is_finite())
                };
                let row = |row: &Vec<DirectionSum>| !row.is_empty() && row.iter().all(legal);
                self.directions.len() == n && self.directions.iter().all(row)
            }
            NodeKind::Mixture(spec) => self.fits_mixture(network, spec, parents, n),
        }
    }

    fn fits_mixture(&self, network: &Network, spec: &MixtureSpec, parents: &[usize], n: usize) -> bool {
        let d = spec.columns.len();
        let regressors = parents.iter().map(|&p| &network.nodes()[p]);
        let regressors = regressors.filter(|parent| !parent.is_discrete());
        let q: usize = regressors.map(|parent| parent.columns().len()).sum();
        let m = d + 1 + q;
        let together = shares(spec) && n > 1;
        let (n_cells, n_rows) = if together { (1, n) } else { (n, 1) };
        let cell = |cell: &CellStatistics| {
            let k = cell.moments.first().map_or(0, Vec::len);
            let numbers = cell.moments.iter().flatten();
            let mut numbers = numbers.flat_map(|moment| moment.product.iter().chain([&moment.mass]));
            k > 0
                && cell.moments.len() == n_rows
                && cell.moments.iter().all(|row| row.len() == k)
                && cell
                    .moments
                    .iter()
                    .flatten()
                    .all(|moment| moment.unpack(m).is_some())
                && numbers.all(|v| v.is_finite())
                && cell.moments.iter().flatten().all(|moment| moment.mass >= 0.0)
                && cell.ridge.len() == 1 + q
                && cell.ridge.iter().all(|v| v.is_finite() && *v >= 0.0)
        };
        self.columns.len() == d && self.cells.len() == n_cells && self.cells.iter().all(cell)
    }
}

/// Whether the configurations of a node's discrete parents are fitted together.
pub(crate) fn shares(spec: &MixtureSpec) -> bool {
    spec.weights != Weights::PerConfiguration || spec.shared_covariance
}

/// A node's dimension, and what turns its z = (y, 1, p) from one set of units to another.
fn change(network: &Network, node: usize, before: &[Scaling], now: &[Scaling]) -> (usize, DMatrix<f64>) {
    let d = before[node].mean.len();
    let family = std::iter::once(&node).chain(&network.nodes()[node].parents);
    let of = |units: &[Scaling]| -> (Vec<f64>, Vec<f64>) {
        let each = family.clone().map(|&i| &units[i]);
        (
            each.clone().flat_map(|unit| unit.mean.clone()).collect(),
            each.flat_map(|unit| unit.standard_deviation.clone()).collect(),
        )
    };
    let ((mean_before, unit_before), (mean_now, unit_now)) = (of(before), of(now));
    let m = mean_before.len() + 1;
    let mut out = DMatrix::identity(m, m);
    for i in 0..mean_before.len() {
        // The 1 stands between y and p.
        let at = if i < d { i } else { i + 1 };
        out[(at, at)] = unit_before[i] / unit_now[i];
        out[(at, d)] = (mean_before[i] - mean_now[i]) / unit_now[i];
    }
    (d, out)
}
