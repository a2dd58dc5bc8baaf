//! One node's columns and its parents', complete rows only, with their units.

use crate::cpd::Scaling;
use crate::error::ModelError;
use crate::network::{MixtureSpec, Network, NodeKind, NodeSpec};
use crate::table::Table;
use crate::train::is_centered;

/// Rows that have every column of a node and of its parents.
pub(crate) struct Family {
    /// Rows of the table that are complete and have a positive weight.
    pub rows: Vec<usize>,
    pub weights: Vec<f64>,
    /// Group of each row, where known.
    pub groups: Option<Vec<usize>>,
    /// Configuration of the discrete parents, per row.
    pub configurations: Vec<usize>,
    pub n_configurations: usize,
    /// State of a discrete node, per row.
    pub states: Vec<usize>,
    /// Standardised own values of a continuous node, per row.
    pub y: Vec<Vec<f64>>,
    /// Standardised values of the continuous parents, per row.
    pub p: Vec<Vec<f64>>,
    pub scaling: Scaling,
    pub parent_scaling: Scaling,
}

impl Family {
    pub fn read(
        network: &Network,
        node: &NodeSpec,
        table: &Table,
        weights: &[f64],
        groups: Option<&[usize]>,
    ) -> Result<Self, ModelError> {
        let n = table.n_rows();
        let mut complete: Vec<bool> = weights.iter().map(|w| *w > 0.0).collect();
        let mut configurations = vec![0; n];
        let mut n_configurations = 1;
        let mut p: Vec<Vec<f64>> = vec![Vec::new(); n];
        let mut parent_specs = Vec::new();
        for &parent in &node.parents {
            let parent = &network.nodes()[parent];
            match &parent.kind {
                NodeKind::Discrete { states, .. } => {
                    n_configurations *= states.len();
                    for (row, state) in table
                        .states(&parent.name, &parent.name, states)?
                        .into_iter()
                        .enumerate()
                    {
                        complete[row] &= state.is_some();
                        configurations[row] = configurations[row] * states.len() + state.unwrap_or(0);
                    }
                }
                // A network has no arcs from such a node.
                NodeKind::VonMisesFisher(_) => {}
                NodeKind::Mixture(spec) => {
                    parent_specs.push(spec);
                    append(&mut p, &mut complete, table, &parent.name, spec)?;
                }
            }
        }
        let mut states = vec![0; n];
        let mut y: Vec<Vec<f64>> = vec![Vec::new(); n];
        match &node.kind {
            NodeKind::Discrete { states: names, .. } => {
                for (row, state) in table
                    .states(&node.name, &node.name, names)?
                    .into_iter()
                    .enumerate()
                {
                    complete[row] &= state.is_some();
                    states[row] = state.unwrap_or(0);
                }
            }
            // Such a node reads its own rows.
            NodeKind::VonMisesFisher(_) => {}
            NodeKind::Mixture(spec) => append(&mut y, &mut complete, table, &node.name, spec)?,
        }
        let rows: Vec<usize> = (0..n).filter(|&row| complete[row]).collect();
        let is_discrete = matches!(node.kind, NodeKind::Discrete { .. });
        if rows.is_empty() && !is_discrete {
            return Err(ModelError::NoRows {
                node: node.name.clone(),
                n_rows: n,
            });
        }
        let pick = |values: Vec<Vec<f64>>| -> Vec<Vec<f64>> {
            let mut values: Vec<Option<Vec<f64>>> = values.into_iter().map(Some).collect();
            rows.iter().filter_map(|&row| values[row].take()).collect()
        };
        let (mut y, mut p) = (pick(y), pick(p));
        let weights: Vec<f64> = rows.iter().map(|&row| weights[row]).collect();
        let scaling = match &node.kind {
            NodeKind::Mixture(spec) => standardise(&mut y, &weights, &[spec]),
            NodeKind::Discrete { .. } | NodeKind::VonMisesFisher(_) => Scaling {
                mean: vec![],
                standard_deviation: vec![],
            },
        };
        let parent_scaling = standardise(&mut p, &weights, &parent_specs);
        Ok(Self {
            weights,
            groups: groups.map(|groups| rows.iter().map(|&row| groups[row]).collect()),
            configurations: rows.iter().map(|&row| configurations[row]).collect(),
            n_configurations,
            states: rows.iter().map(|&row| states[row]).collect(),
            y,
            p,
            scaling,
            parent_scaling,
            rows,
        })
    }
}

/// Appends a node's columns to each row.
fn append(
    values: &mut [Vec<f64>],
    complete: &mut [bool],
    table: &Table,
    node: &str,
    spec: &MixtureSpec,
) -> Result<(), ModelError> {
    for column in &spec.columns {
        for (row, value) in table.numbers(column, node)?.into_iter().enumerate() {
            complete[row] &= !value.is_nan();
            values[row].push(value);
        }
    }
    Ok(())
}

/// Subtracts each column's mean and divides by its standard deviation. Nodes with a latent sign keep their origin and
/// share one unit; a constant column takes its noise floor, or a thousandth of its value, as unit.
fn standardise(values: &mut [Vec<f64>], weights: &[f64], specs: &[&MixtureSpec]) -> Scaling {
    let total: f64 = weights.iter().sum();
    let mut scaling = Scaling {
        mean: Vec::new(),
        standard_deviation: Vec::new(),
    };
    for spec in specs {
        let start = scaling.mean.len();
        for (d, floor) in spec.noise_floor.iter().enumerate() {
            let column = start + d;
            let weighted = |f: &dyn Fn(f64) -> f64| -> f64 {
                values
                    .iter()
                    .zip(weights)
                    .map(|(row, w)| w * f(row[column]))
                    .sum::<f64>()
                    / total
            };
            let mean = if is_centered(spec.sign) {
                weighted(&|x| x)
            } else {
                0.0
            };
            let deviation = weighted(&|x| (x - mean) * (x - mean)).sqrt();
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
            let own = &mut scaling.standard_deviation[start..];
            let common = (own.iter().map(|s| s * s).sum::<f64>() / own.len() as f64).sqrt();
            own.fill(common);
        }
    }
    for row in values {
        for (value, (mean, unit)) in row
            .iter_mut()
            .zip(scaling.mean.iter().zip(&scaling.standard_deviation))
        {
            *value = (*value - mean) / unit;
        }
    }
    scaling
}
