//! Training with missing cells: EM over the whole network, from the fits that the complete rows of each family gave.
//!
//! A row with gaps couples the families that the gaps reach. Its E-step is exact: missing states are enumerated, missing
//! numbers integrated per combination of components (`gap_block.rs`), with what is worked out per pattern of gaps kept
//! (`gap_plan.rs`). Families that no gap reaches keep their own E-step. Missing at random is assumed. Nodes of unit vectors
//! with their own density are fitted to their own rows, and say nothing about missing states.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::cell::{CellTask, FittedCell};
use crate::em::{Acting, acting, expect};
use crate::family::Cells;
use crate::gap_block::{BlockPosterior, sum_block};
use crate::gap_plan::{Entry, GapBlock, GapPlan, entries, pattern};
use crate::gaussian::log_sum_exp;
use crate::moments::{Moment, log_prior, maximize};
use crate::network::{Network, NodeKind};
use crate::train::TrainOptions;

/// Pieces of the E-step; their sums are added in order, so that results do not depend on the number of threads.
const PIECES: usize = 16;
/// Joint states of the missing discrete nodes of one row that are enumerated.
const MAX_ASSIGNMENTS: usize = 4096;

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

/// Expected counts per node and configuration: of states, or moments of components.
#[derive(Clone)]
struct Expected {
    log_likelihood: f64,
    left_out: usize,
    counts: Vec<Vec<Vec<f64>>>,
    moments: Vec<Vec<Vec<Moment>>>,
}

/// The network's parameters as the E-step reads them.
struct Current {
    /// log P(state | configuration) per discrete node.
    tables: Vec<Vec<Vec<f64>>>,
    /// Acting components per continuous node and configuration.
    acting: Vec<Vec<Vec<Acting>>>,
}

struct Joint<'a> {
    network: &'a Network,
    cells: &'a Cells,
    entries: Vec<Vec<Entry>>,
    plans: Vec<GapPlan>,
    /// Row and plan.
    rows: Vec<(usize, usize)>,
    /// Per node and configuration: the fitted cell and the configuration in it.
    place: Vec<Vec<(usize, usize)>>,
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

impl<'a> Joint<'a> {
    fn new(
        network: &'a Network,
        cells: &'a Cells,
        tasks: &[CellTask],
        fitted: &[FittedCell],
    ) -> Option<Self> {
        let mut plans = Vec::new();
        let mut known = BTreeMap::new();
        let mut rows = Vec::new();
        for row in (0..cells.n_rows()).filter(|&row| cells.weights[row] > 0.0) {
            let pattern = pattern(cells, row);
            if pattern.is_empty() {
                continue;
            }
            let plan = *known.entry(pattern).or_insert_with(|| {
                plans.push(GapPlan::new(network, cells, row));
                plans.len() - 1
            });
            rows.push((row, plan));
        }
        if rows.is_empty() {
            return None;
        }
        let mut place: Vec<Vec<(usize, usize)>> = vec![Vec::new(); network.nodes().len()];
        for (i, (task, cell)) in tasks.iter().zip(fitted).enumerate() {
            match task.cell {
                Some(_) => place[task.node].push((i, 0)),
                None => place[task.node].extend((0..cell.rows.ends.len()).map(|inner| (i, inner))),
            }
        }
        Some(Self {
            network,
            cells,
            entries: (0..network.nodes().len())
                .map(|node| entries(network, cells, node))
                .collect(),
            plans,
            rows,
            place,
        })
    }

    fn prior(&self, node: usize) -> f64 {
        match &self.network.nodes()[node].kind {
            NodeKind::Discrete { prior, .. } => *prior,
            NodeKind::Mixture(_) | NodeKind::VonMisesFisher(_) => 0.0,
        }
    }

    fn current(&self, fitted: &[FittedCell], counts: &[Vec<Vec<f64>>]) -> Current {
        let tables = counts
            .iter()
            .enumerate()
            .map(|(node, rows)| rows.iter().map(|row| log_table(row, self.prior(node))).collect())
            .collect();
        let acting = self
            .place
            .iter()
            .map(|places| {
                places
                    .iter()
                    .map(|&(i, inner)| {
                        let cell = &fitted[i];
                        let weights = &cell.mixing.log_weights[inner];
                        acting(&cell.rows.settings, weights, cell.mixing.set(inner))
                    })
                    .collect()
            })
            .collect();
        Current { tables, acting }
    }

    /// log P of the tables' seen counts and their Dirichlet priors.
    fn log_table_prior(&self, current: &Current, seen: &[Vec<Vec<f64>>]) -> f64 {
        let mut sum = 0.0;
        for (node, rows) in current.tables.iter().enumerate() {
            let prior = self.prior(node);
            for (logs, counts) in rows.iter().zip(&seen[node]) {
                for (log, count) in logs.iter().zip(counts) {
                    if count + prior > 0.0 {
                        sum += (count + prior) * log;
                    }
                }
            }
        }
        sum
    }

    fn nothing(&self, current: &Current) -> Expected {
        let moments = current.acting.iter().enumerate().map(|(node, cells)| {
            let m = self.entries[node].len();
            let components =
                |parts: &Vec<Acting>| 1 + parts.iter().map(|part| part.component).max().unwrap_or(0);
            cells
                .iter()
                .map(|parts| vec![Moment::zero(m); components(parts)])
                .collect()
        });
        Expected {
            log_likelihood: 0.0,
            left_out: 0,
            counts: current
                .tables
                .iter()
                .map(|rows| rows.iter().map(|row| vec![0.0; row.len()]).collect())
                .collect(),
            moments: moments.collect(),
        }
    }

    /// The E-step of all rows with gaps.
    fn expect(&self, current: &Current) -> Expected {
        let n = self.rows.len();
        let pieces: Vec<Expected> = (0..PIECES)
            .into_par_iter()
            .map(|piece| {
                let mut out = self.nothing(current);
                for &(row, plan) in &self.rows[piece * n / PIECES..(piece + 1) * n / PIECES] {
                    if self.row(current, &self.plans[plan], row, &mut out).is_none() {
                        out.left_out += 1;
                    }
                }
                out
            })
            .collect();
        let mut sum = self.nothing(current);
        for piece in pieces {
            sum.log_likelihood += piece.log_likelihood;
            sum.left_out += piece.left_out;
            let own = sum.counts.iter_mut().flatten().flatten();
            for (own, more) in own.zip(piece.counts.iter().flatten().flatten()) {
                *own += more;
            }
            let own = sum.moments.iter_mut().flatten().flatten();
            for (own, more) in own.zip(piece.moments.iter().flatten().flatten()) {
                own.add(more);
            }
        }
        sum
    }

    fn configuration(&self, node: usize, states: &[usize]) -> usize {
        let mut configuration = 0;
        for &parent in &self.network.nodes()[node].parents {
            if let NodeKind::Discrete { states: names, .. } = &self.network.nodes()[parent].kind {
                configuration = configuration * names.len() + states[parent];
            }
        }
        configuration
    }

    fn n_states(&self, node: usize) -> usize {
        match &self.network.nodes()[node].kind {
            NodeKind::Discrete { states, .. } => states.len(),
            NodeKind::Mixture(_) | NodeKind::VonMisesFisher(_) => 1,
        }
    }

    fn z(&self, node: usize, row: usize) -> Vec<f64> {
        self.entries[node]
            .iter()
            .map(|entry| match *entry {
                Entry::One => 1.0,
                Entry::Value(node, d) => self.cells.values[node][d][row],
            })
            .collect()
    }

    /// One row; `None` where it has too many combinations.
    fn row(&self, current: &Current, plan: &GapPlan, row: usize, out: &mut Expected) -> Option<()> {
        let mut states: Vec<usize> = self
            .cells
            .states
            .iter()
            .map(|column| column.get(row).copied().flatten().unwrap_or(0))
            .collect();
        let n = plan
            .free
            .iter()
            .try_fold(1usize, |n, &node| n.checked_mul(self.n_states(node)))?;
        if n > MAX_ASSIGNMENTS {
            return None;
        }
        let local_z: Vec<Vec<f64>> = plan.locals.iter().map(|&node| self.z(node, row)).collect();
        let block_z: Vec<Vec<Vec<f64>>> = plan
            .blocks
            .iter()
            .map(|block| {
                block
                    .families
                    .iter()
                    .map(|family| self.z(family.node, row))
                    .collect()
            })
            .collect();
        let mut logs = Vec::with_capacity(n);
        let mut known: Vec<BTreeMap<Vec<usize>, (BlockPosterior, f64)>> =
            plan.blocks.iter().map(|_| BTreeMap::new()).collect();
        for number in 0..n {
            self.assign(plan, number, &mut states);
            let mut log = 0.0;
            for &node in &plan.tables {
                log += current.tables[node][self.configuration(node, &states)][states[node]];
            }
            for (&node, z) in plan.locals.iter().zip(&local_z) {
                let parts = &current.acting[node][self.configuration(node, &states)];
                log += log_sum_exp(&local_logs(parts, z));
            }
            for ((block, z), known) in plan.blocks.iter().zip(&block_z).zip(&mut known) {
                let key = self.block_key(block, &states);
                if !known.contains_key(&key) {
                    let parts = block_parts(current, block, &key);
                    known.insert(key.clone(), (sum_block(block, &parts, z)?, 0.0));
                }
                log += known[&key].0.log_integral;
            }
            logs.push(log);
        }
        let log_evidence = log_sum_exp(&logs);
        if !log_evidence.is_finite() {
            return None;
        }
        let weight = self.cells.weights[row];
        out.log_likelihood += weight * log_evidence;
        for (number, log) in logs.iter().enumerate() {
            let share = weight * (log - log_evidence).exp();
            if share <= 0.0 {
                continue;
            }
            self.assign(plan, number, &mut states);
            for &node in &plan.tables {
                out.counts[node][self.configuration(node, &states)][states[node]] += share;
            }
            for (&node, z) in plan.locals.iter().zip(&local_z) {
                let configuration = self.configuration(node, &states);
                let parts = &current.acting[node][configuration];
                let logs = local_logs(parts, z);
                let total = log_sum_exp(&logs);
                for (part, log) in parts.iter().zip(logs) {
                    let moment = &mut out.moments[node][configuration][part.component];
                    add_known(
                        moment,
                        z,
                        self.cells.values[node].len(),
                        part.sign,
                        share * (log - total).exp(),
                    );
                }
            }
            for (block, known) in plan.blocks.iter().zip(&mut known) {
                if let Some(entry) = known.get_mut(&self.block_key(block, &states)) {
                    entry.1 += share;
                }
            }
        }
        for ((block, z), known) in plan.blocks.iter().zip(&block_z).zip(&known) {
            for (key, (posterior, share)) in known.iter().filter(|(_, (_, share))| *share > 0.0) {
                for (((family, z), configuration), shares) in
                    block.families.iter().zip(z).zip(key).zip(&posterior.shares)
                {
                    let parts = &current.acting[family.node][*configuration];
                    for (part, own) in parts.iter().zip(shares).filter(|(_, own)| own.mass > 0.0) {
                        let moment = &mut out.moments[family.node][*configuration][part.component];
                        moment.mass += share * own.mass;
                        let d = self.cells.values[family.node].len();
                        let h = block.hidden.len();
                        for i in 0..z.len() {
                            for j in 0..z.len() {
                                let sign = if (i < d) == (j < d) { 1.0 } else { part.sign };
                                let value = match (family.place[i], family.place[j]) {
                                    (None, None) => own.mass * z[i] * z[j],
                                    (Some(a), None) => own.first[a] * z[j],
                                    (None, Some(b)) => own.first[b] * z[i],
                                    (Some(a), Some(b)) => own.second[a * h + b],
                                };
                                moment.product[(i, j)] += share * sign * value;
                            }
                        }
                    }
                }
            }
        }
        Some(())
    }

    /// Sets the missing states to the joint state of this number.
    fn assign(&self, plan: &GapPlan, mut number: usize, states: &mut [usize]) {
        for &node in plan.free.iter().rev() {
            states[node] = number % self.n_states(node);
            number /= self.n_states(node);
        }
    }

    fn block_key(&self, block: &GapBlock, states: &[usize]) -> Vec<usize> {
        block
            .families
            .iter()
            .map(|family| self.configuration(family.node, states))
            .collect()
    }
}

fn block_parts<'a>(current: &'a Current, block: &GapBlock, key: &[usize]) -> Vec<&'a [Acting]> {
    block
        .families
        .iter()
        .zip(key)
        .map(|(family, &configuration)| current.acting[family.node][configuration].as_slice())
        .collect()
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

fn local_logs(parts: &[Acting], z: &[f64]) -> Vec<f64> {
    parts
        .iter()
        .map(|part| {
            let mut square = 0.0;
            for i in 0..part.white.nrows() {
                let residual: f64 = (0..z.len()).map(|j| part.white[(i, j)] * z[j]).sum();
                square += residual * residual;
            }
            part.constant - 0.5 * square
        })
        .collect()
}

fn add_known(moment: &mut Moment, z: &[f64], d: usize, sign: f64, share: f64) {
    moment.mass += share;
    for i in 0..z.len() {
        for j in 0..z.len() {
            let sign = if (i < d) == (j < d) { 1.0 } else { sign };
            moment.product[(i, j)] += share * sign * z[i] * z[j];
        }
    }
}
