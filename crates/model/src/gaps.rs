//! Training with missing cells: EM over the whole network, from the fits that the complete rows of each family gave.
//!
//! A row with gaps couples the families that the gaps reach. Its E-step is exact: missing states are enumerated, missing
//! numbers integrated per combination of components (`gap_step.rs`, `gap_block.rs`), with what is worked out per pattern
//! of gaps kept (`gap_plan.rs`). Families that no gap reaches keep their own E-step. Missing at random is assumed. Nodes of unit vectors
//! with their own density are fitted to their own rows, and say nothing about missing states.

use rayon::prelude::*;

use crate::cell::{CellTask, FittedCell};
use crate::em::expect;
use crate::family::Cells;
use crate::gap_step::Joint;
use crate::moments::{Moment, log_prior, maximize};
use crate::network::Network;
use crate::train::TrainOptions;

/// How training on rows with gaps went.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct GapReport {
    /// Rows with at least one missing cell.
    pub n_rows: usize,
    /// Different patterns of missing cells.
    pub n_patterns: usize,
    /// Rows whose gaps have more combinations than are summed; they were left out of this part.
    pub left_out: usize,
    /// EM steps over the whole network.
    pub steps: usize,
    /// Whether EM ended by itself.
    pub converged: bool,
    /// Penalised log-likelihood in standardised units after each step. It never falls, unless rows count less in nodes
    /// that are constant within groups.
    #[serde(skip)]
    pub objectives: Vec<f64>,
}

impl GapReport {
    /// What a person should know of it.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let mut out = Vec::new();
        if self.left_out > 0 {
            out.push(format!(
                "{} of {} rows with gaps have too many combinations; only their complete families were learned from",
                self.left_out, self.n_rows
            ));
        }
        if !self.converged {
            out.push(format!(
                "EM over the rows with gaps ended after {} steps without settling",
                self.steps
            ));
        }
        out
    }
}

/// Carries EM on over all rows. `counts` are those of complete discrete families, and become expected counts.
pub(crate) fn fit_gaps(
    network: &Network,
    cells: &Cells,
    tasks: &[CellTask],
    fitted: &mut [FittedCell],
    counts: &mut Vec<Vec<Vec<f64>>>,
    options: &TrainOptions,
) -> Option<GapReport> {
    let joint = Joint::new(network, cells, tasks, fitted)?;
    let exact = fitted
        .iter()
        .all(|cell| (cell.scale - 1.0).abs() < 1e-9 && !cell.report.pooled);
    let total: f64 = joint.rows.iter().map(|&(row, _)| cells.weights[row]).sum();
    let enough = options.tolerance * total;
    let seen = counts.clone();
    let mut report = GapReport {
        n_rows: joint.rows.len(),
        n_patterns: joint.plans.len(),
        left_out: 0,
        steps: 0,
        converged: false,
        objectives: Vec::new(),
    };
    loop {
        let current = joint.current(fitted, counts);
        let found = joint.expect(&current);
        let mut objective = found.log_likelihood + joint.log_table_prior(&current, &seen);
        let complete: Vec<(f64, Vec<Vec<Moment>>)> = fitted
            .par_iter()
            .map(|cell| expect(&cell.rows, &cell.mixing))
            .collect();
        report.left_out = found.left_out;
        for (cell, (log_likelihood, moments)) in fitted.iter_mut().zip(complete) {
            objective += log_likelihood + log_prior(&cell.rows.settings, &cell.mixing);
            cell.moments = moments;
        }
        let before = report.objectives.last().copied();
        report.objectives.push(objective);
        debug_assert!(
            !exact || before.is_none_or(|before| objective >= before - 1e-7 * (before.abs() + total)),
            "joint EM fell from {before:?} to {objective}"
        );
        let settled = before.is_some_and(|before| objective - before < enough);
        for (node, places) in joint.place.iter().enumerate() {
            for (configuration, &(i, inner)) in places.iter().enumerate() {
                let cell = &mut fitted[i];
                for (own, more) in cell.moments[inner]
                    .iter_mut()
                    .zip(&found.moments[node][configuration])
                {
                    own.mass += cell.scale * more.mass;
                    own.product += cell.scale * &more.product;
                }
            }
        }
        if settled || report.steps >= options.max_steps {
            report.converged = settled;
            break;
        }
        // A pooled cell stands in for a configuration with too few rows, and stays as it is.
        for cell in fitted.iter_mut().filter(|cell| !cell.report.pooled) {
            cell.mixing = maximize(&cell.rows.settings, &cell.moments);
        }
        counts.clone_from(&seen);
        for (own, more) in counts
            .iter_mut()
            .flatten()
            .flatten()
            .zip(found.counts.iter().flatten().flatten())
        {
            *own += more;
        }
        report.steps += 1;
    }
    Some(report)
}

/// log ((count + prior) / total) of each state; uniform where nothing is known.
pub(crate) fn log_table(counts: &[f64], prior: f64) -> Vec<f64> {
    let total: f64 = counts.iter().map(|count| count + prior).sum();
    counts
        .iter()
        .map(|count| {
            if total > 0.0 {
                ((count + prior) / total).ln()
            } else {
                -(counts.len() as f64).ln()
            }
        })
        .collect()
}
