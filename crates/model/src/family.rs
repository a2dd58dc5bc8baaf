//! The table in standardised units, and which of its rows have all that a node's fit needs.

use serde::{Deserialize, Serialize};

use crate::cpd::Scaling;
use crate::error::ModelError;
use crate::network::{MixtureSpec, Network, NodeKind};
use crate::table::Table;
use crate::train::is_centered;

/// All nodes' cells, standardised, with gaps.
pub(crate) struct Cells {
    /// Weight of each row.
    pub weights: Vec<f64>,
    /// Per continuous node and dimension the value of each row, NaN where missing.
    pub values: Vec<Vec<Vec<f64>>>,
    /// Per discrete node the state of each row.
    pub states: Vec<Vec<Option<usize>>>,
    /// Per continuous node the units.
    pub scaling: Vec<Scaling>,
    /// Per continuous node what the units come from, earlier rows included.
    pub sums: Vec<Vec<ColumnSums>>,
}

/// What is known of a column's cells: how much they weigh, their mean, and Σ w (x − mean)².
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct ColumnSums {
    weight: f64,
    mean: f64,
    square: f64,
}

impl ColumnSums {
    fn of(column: &[f64], weights: &[f64]) -> Self {
        let seen = || column.iter().zip(weights).filter(|(value, _)| !value.is_nan());
        let weight: f64 = seen().map(|(_, w)| w).sum();
        if weight <= 0.0 {
            return Self::default();
        }
        let mean = seen().map(|(x, w)| w * x).sum::<f64>() / weight;
        Self {
            weight,
            mean,
            square: seen().map(|(x, w)| w * (x - mean) * (x - mean)).sum(),
        }
    }

    /// Both together.
    fn joined(self, other: Self) -> Self {
        let weight = self.weight + other.weight;
        if other.weight <= 0.0 || self.weight <= 0.0 {
            return if other.weight > 0.0 { other } else { self };
        }
        let away = other.mean - self.mean;
        Self {
            weight,
            mean: self.mean + away * other.weight / weight,
            square: self.square + other.square + away * away * self.weight * other.weight / weight,
        }
    }
}

impl Cells {
    /// Reads a table. `earlier` are the sums of rows that are no longer here, per continuous node; empty for none.
    pub fn read(
        network: &Network,
        table: &Table,
        weights: Vec<f64>,
        earlier: &[Vec<ColumnSums>],
    ) -> Result<Self, ModelError> {
        let mut cells = Self {
            weights,
            values: Vec::new(),
            states: Vec::new(),
            scaling: Vec::new(),
            sums: Vec::new(),
        };
        for (i, node) in network.nodes().iter().enumerate() {
            let mut sums = Vec::new();
            let mut values = Vec::new();
            let mut states = Vec::new();
            let mut scaling = Scaling {
                mean: Vec::new(),
                standard_deviation: Vec::new(),
            };
            match &node.kind {
                NodeKind::Discrete { states: names, .. } => {
                    states = table.states(&node.name, &node.name, names)?;
                }
                // Such a node reads its own rows.
                NodeKind::VonMisesFisher(_) => {}
                NodeKind::Mixture(spec) => {
                    for (d, column) in spec.columns.iter().enumerate() {
                        let column = table.numbers(column, &node.name)?;
                        let own = ColumnSums::of(&column, &cells.weights);
                        let before = earlier.get(i).and_then(|sums| sums.get(d));
                        let both = before.map_or(own, |before| before.joined(own));
                        if both.weight <= 0.0 {
                            return Err(ModelError::NoRows {
                                node: node.name.clone(),
                                n_rows: table.n_rows(),
                            });
                        }
                        sums.push(both);
                        values.push(column);
                    }
                    scaling = units(&sums, spec);
                    standardise(&mut values, &scaling);
                }
            }
            cells.values.push(values);
            cells.states.push(states);
            cells.scaling.push(scaling);
            cells.sums.push(sums);
        }
        Ok(cells)
    }

    pub fn n_rows(&self) -> usize {
        self.weights.len()
    }

    /// Whether a node has no gap in a row.
    pub fn is_known(&self, node: usize, row: usize) -> bool {
        if self.states[node].is_empty() {
            self.values[node].iter().all(|column| !column[row].is_nan())
        } else {
            self.states[node][row].is_some()
        }
    }

    /// Row of the table or of the components; `None` where a discrete parent is missing.
    pub fn configuration(&self, network: &Network, node: usize, row: usize) -> Option<usize> {
        let mut configuration = 0;
        for &parent in &network.nodes()[node].parents {
            if let NodeKind::Discrete { states, .. } = &network.nodes()[parent].kind {
                configuration = configuration * states.len() + self.states[parent][row]?;
            }
        }
        Some(configuration)
    }
}

/// Rows that have every column of a node and of its parents.
pub(crate) struct Family {
    /// Rows of the table with a positive weight, sorted by configuration.
    pub rows: Vec<usize>,
    /// End of each configuration's rows.
    pub ends: Vec<usize>,
    /// Group of each row, where known.
    pub groups: Option<Vec<usize>>,
    /// How many rows are complete.
    pub n_complete: usize,
    /// Whether too few rows were complete, so that rows with gaps are among them.
    pub with_gaps: bool,
    /// Continuous parents.
    pub parents: Vec<usize>,
}

impl Family {
    /// `fill` takes rows with gaps where hardly one is complete.
    pub fn read(network: &Network, node: usize, cells: &Cells, groups: Option<&[usize]>, fill: bool) -> Self {
        let spec = &network.nodes()[node];
        let is_discrete = |i: usize| matches!(network.nodes()[i].kind, NodeKind::Discrete { .. });
        let n_configurations = n_configurations(network, &spec.parents);
        let parents: Vec<usize> = spec
            .parents
            .iter()
            .copied()
            .filter(|&i| !is_discrete(i))
            .collect();
        let usable = |row: &usize, complete: bool| {
            let mut family = parents.iter().chain([&node]);
            cells.weights[*row] > 0.0
                && (if complete || is_discrete(node) {
                    family.all(|&i| cells.is_known(i, *row))
                } else {
                    cells.values[node].iter().any(|column| !column[*row].is_nan())
                })
        };
        let sort = |complete: bool| {
            let mut of: Vec<Vec<usize>> = vec![Vec::new(); n_configurations];
            for row in (0..cells.n_rows()).filter(|row| usable(row, complete)) {
                if let Some(configuration) = cells.configuration(network, node, row) {
                    of[configuration].push(row);
                }
            }
            of
        };
        let mut of = sort(true);
        let q: usize = parents.iter().map(|&i| cells.values[i].len()).sum();
        let least = cells.values[node].len() + q + 2;
        let n_complete: usize = of.iter().map(Vec::len).sum();
        let mut with_gaps = false;
        if fill && !is_discrete(node) && n_complete < least {
            of = sort(false);
            with_gaps = of.iter().map(Vec::len).sum::<usize>() > n_complete;
        }
        let rows: Vec<usize> = of.concat();
        let mut end = 0;
        let ends = of
            .iter()
            .map(|rows| {
                end += rows.len();
                end
            })
            .collect();
        Self {
            groups: groups.map(|groups| rows.iter().map(|&row| groups[row]).collect()),
            rows,
            ends,
            n_complete,
            with_gaps,
            parents,
        }
    }

    /// Positions in `rows` of a configuration; `None` stands for all.
    pub fn members(&self, configuration: Option<usize>) -> std::ops::Range<usize> {
        match configuration {
            None => 0..self.rows.len(),
            Some(0) => 0..self.ends[0],
            Some(i) => self.ends[i - 1]..self.ends[i],
        }
    }
}

/// Joint states of the discrete ones among the parents.
pub(crate) fn n_configurations(network: &Network, parents: &[usize]) -> usize {
    let states = parents.iter().map(|&parent| match &network.nodes()[parent].kind {
        NodeKind::Discrete { states, .. } => states.len(),
        NodeKind::Mixture(_) | NodeKind::VonMisesFisher(_) => 1,
    });
    states.product()
}

/// Mean and standard deviation of each column. Nodes with a latent sign keep their origin and share one unit; a constant
/// column takes its noise floor, or a thousandth of its value, as unit.
pub(crate) fn units(sums: &[ColumnSums], spec: &MixtureSpec) -> Scaling {
    let mut scaling = Scaling {
        mean: Vec::new(),
        standard_deviation: Vec::new(),
    };
    for (sums, floor) in sums.iter().zip(&spec.noise_floor) {
        let variance = sums.square / sums.weight;
        let (mean, deviation) = if is_centered(spec.sign) {
            (sums.mean, variance.sqrt())
        } else {
            (0.0, (variance + sums.mean * sums.mean).sqrt())
        };
        let least = floor.max(1e-9 * mean.abs());
        let unit = if deviation > least {
            deviation
        } else if *floor > 0.0 {
            *floor
        } else {
            (1e-3 * mean.abs()).max(1e-9)
        };
        scaling.mean.push(mean);
        scaling.standard_deviation.push(unit);
    }
    if !is_centered(spec.sign) {
        let own = &mut scaling.standard_deviation;
        let common = (own.iter().map(|s| s * s).sum::<f64>() / own.len() as f64).sqrt();
        own.fill(common);
    }
    scaling
}

fn standardise(columns: &mut [Vec<f64>], scaling: &Scaling) {
    let units = scaling.mean.iter().zip(&scaling.standard_deviation);
    for (column, (mean, unit)) in columns.iter_mut().zip(units) {
        for value in column {
            *value = (*value - mean) / unit;
        }
    }
}
