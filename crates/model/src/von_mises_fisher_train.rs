//! Training a node of unit vectors: rows from the table, one mixture per configuration.

use crate::cell::{CellReport, OrderScore};
use crate::cpd::NodeIdx;
use crate::error::ModelError;
use crate::evidence::unit_vector;
use crate::network::{MixtureOrder, Network, NodeKind, NodeSpec, VonMisesFisherSpec};
use crate::statistics::DirectionSum;
use crate::table::Table;
use crate::train::TrainOptions;
use crate::von_mises_fisher::{MAX_CONCENTRATION, VonMisesFisherCpd, n_direction_parameters};
use crate::von_mises_fisher_fit::{DirectionOptions, Directions};

/// A trained node.
pub(crate) struct TrainedDirections {
    pub cpd: VonMisesFisherCpd,
    pub cells: Vec<CellReport>,
    pub n_rows: usize,
    /// Of each cell and component.
    pub sums: Vec<Vec<DirectionSum>>,
    pub warnings: Vec<String>,
}

/// Unit vectors of each row, `None` where a coordinate is missing.
pub(crate) fn read_directions(
    spec: &VonMisesFisherSpec,
    node: &str,
    table: &Table,
) -> Result<Vec<Option<Vec<f64>>>, ModelError> {
    let mut rows = vec![Vec::with_capacity(spec.columns.len()); table.n_rows()];
    for column in &spec.columns {
        for (row, value) in rows.iter_mut().zip(table.numbers(column, node)?) {
            row.push(value);
        }
    }
    let read = |(row, value): (usize, Vec<f64>)| {
        if value.iter().any(|v| v.is_nan()) {
            return Ok(None);
        }
        unit_vector(node, &value).map(Some).map_err(|error| match error {
            ModelError::BadValue { found, expected, .. } => ModelError::Cell {
                column: spec.columns.join(", "),
                row,
                found,
                expected,
            },
            other => other,
        })
    };
    rows.into_iter().enumerate().map(read).collect()
}

/// How a node's settings and the training's become those of a fit.
pub(crate) fn direction_options(
    spec: &VonMisesFisherSpec,
    restarts: usize,
    max_steps: usize,
    tolerance: f64,
) -> DirectionOptions {
    DirectionOptions {
        restarts,
        max_steps,
        tolerance,
        most: MAX_CONCENTRATION.min(1.0 / (spec.noise_floor * spec.noise_floor)),
    }
}

/// Fits one node. `earlier` are the sums of rows that are no longer here, with which it goes on.
pub(crate) fn train_directions(
    network: &Network,
    node: &NodeSpec,
    spec: &VonMisesFisherSpec,
    table: &Table,
    weights: &[f64],
    options: &TrainOptions,
    earlier: Option<&[Vec<DirectionSum>]>,
) -> Result<TrainedDirections, ModelError> {
    let values = read_directions(spec, &node.name, table)?;
    let mut configurations = vec![Some(0); table.n_rows()];
    let mut labels: Vec<Vec<(String, String)>> = vec![Vec::new()];
    for &parent in &node.parents {
        let parent = &network.nodes()[parent];
        let NodeKind::Discrete { states, .. } = &parent.kind else {
            continue;
        };
        let cells = table.states(&parent.name, &parent.name, states)?;
        for (configuration, state) in configurations.iter_mut().zip(cells) {
            *configuration = configuration
                .zip(state)
                .map(|(c, state)| c * states.len() + state);
        }
        labels = labels
            .iter()
            .flat_map(|label| {
                states.iter().map(move |state| {
                    let mut longer = label.clone();
                    longer.push((parent.name.clone(), state.clone()));
                    longer
                })
            })
            .collect();
    }
    let d = spec.columns.len();
    let gather = |cell: Option<usize>| {
        let mut rows = Directions {
            d,
            x: Vec::new(),
            weights: Vec::new(),
            earlier: match (earlier, cell) {
                (None, _) => Vec::new(),
                (Some(earlier), Some(cell)) => earlier[cell].clone(),
                (Some(earlier), None) => vec![DirectionSum::together(d, earlier.iter().flatten())],
            },
        };
        for ((value, configuration), weight) in values.iter().zip(&configurations).zip(weights) {
            if let (Some(value), Some(configuration)) = (value, configuration)
                && *weight > 0.0
                && cell.is_none_or(|cell| cell == *configuration)
            {
                rows.x.push(value.clone());
                rows.weights.push(*weight);
            }
        }
        rows
    };
    let all = gather(None);
    if all.x.is_empty() && earlier.is_none() {
        return Err(ModelError::NoRows {
            node: node.name.clone(),
            n_rows: table.n_rows(),
        });
    }
    let fit_options = direction_options(spec, options.restarts, options.max_steps, options.tolerance);
    let mut out = TrainedDirections {
        cpd: VonMisesFisherCpd {
            columns: spec.columns.clone(),
            discrete_parents: node.parents.iter().map(|&parent| NodeIdx(parent)).collect(),
            components: Vec::with_capacity(labels.len()),
        },
        cells: Vec::with_capacity(labels.len()),
        n_rows: all.x.len(),
        sums: Vec::with_capacity(labels.len()),
        warnings: Vec::new(),
    };
    for (cell, configuration) in labels.into_iter().enumerate() {
        let own = gather(Some(cell));
        let n_rows = own.x.len();
        let pooled = own.total() < (d + 1) as f64;
        let rows = if pooled { &all } else { &own };
        // Every cell has a stream of its own, whatever the others do.
        let seed = options.seed ^ (cell as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let (fits, best) = match spec.order {
            _ if earlier.is_some() => (vec![rows.go_on(pooled, fit_options)], 0),
            _ if pooled => (vec![rows.fit(1, fit_options, seed)], 0),
            MixtureOrder::Fixed(k) => {
                let carried = (rows.total() / (d + 1) as f64) as usize;
                (vec![rows.fit(k.min(carried).max(1), fit_options, seed)], 0)
            }
            MixtureOrder::Bic { max, .. } => rows.fit_by_bic(max, fit_options, seed),
        };
        let curve: Vec<OrderScore> = fits
            .iter()
            .enumerate()
            .map(|(i, fit)| OrderScore {
                asked: if fits.len() == 1 {
                    fit.components.len()
                } else {
                    i + 1
                },
                components: fit.components.len(),
                log_likelihood: fit.log_likelihood,
                n_parameters: n_direction_parameters(fit.components.len(), d),
                bic: rows.bic(fit),
                held_out: None,
            })
            .collect();
        let fit = &fits[best];
        let report = CellReport {
            configuration,
            n_rows,
            n_effective: rows.total(),
            constant_in_groups: false,
            components: fit.components.len(),
            curve,
            steps: fit.objectives.len() - 1,
            converged: fit.converged,
            reinitialized: 0,
            dropped: 0,
            pooled,
            objectives: fit.objectives.clone(),
        };
        let place = report.place();
        if pooled {
            out.warnings.push(format!(
                "`{}`{place}: {n_rows} rows are too few; took one component over all configurations",
                node.name
            ));
        }
        if !fit.converged {
            let steps = report.steps;
            out.warnings.push(format!(
                "`{}`{place}: EM ended after {steps} steps without settling",
                node.name
            ));
        }
        out.sums.push(own.sums(if pooled {
            &fit.components[..1]
        } else {
            &fit.components
        }));
        out.cpd.components.push(fit.components.clone());
        out.cells.push(report);
    }
    Ok(out)
}
