//! The E-step over the rows with gaps: what each row says of every table and component that its gaps reach.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::cell::{CellTask, FittedCell};
use crate::em::{Acting, acting};
use crate::family::Cells;
use crate::gap_block::{BlockPosterior, sum_block};
use crate::gap_plan::{Entry, GapBlock, GapPlan, entries, pattern};
use crate::gaps::log_table;
use crate::gaussian::log_sum_exp;
use crate::moments::Moment;
use crate::network::{Network, NodeKind};

/// Pieces of the E-step; their sums are added in order, so that results do not depend on the number of threads.
const PIECES: usize = 16;
/// Joint states of the missing discrete nodes of one row that are enumerated.
const MAX_ASSIGNMENTS: usize = 4096;

/// Expected counts per node and configuration: of states, or moments of components.
#[derive(Clone)]
pub(crate) struct Expected {
    pub log_likelihood: f64,
    pub left_out: usize,
    pub counts: Vec<Vec<Vec<f64>>>,
    pub moments: Vec<Vec<Vec<Moment>>>,
}

/// The network's parameters as the E-step reads them.
pub(crate) struct Current {
    /// log P(state | configuration) per discrete node.
    tables: Vec<Vec<Vec<f64>>>,
    /// Acting components per continuous node and configuration.
    acting: Vec<Vec<Vec<Acting>>>,
}

/// The rows with gaps, their patterns, and where each family was fitted.
pub(crate) struct Joint<'a> {
    network: &'a Network,
    cells: &'a Cells,
    entries: Vec<Vec<Entry>>,
    pub plans: Vec<GapPlan>,
    /// Row and plan.
    pub rows: Vec<(usize, usize)>,
    /// Per node and configuration: the fitted cell and the configuration in it.
    pub place: Vec<Vec<(usize, usize)>>,
}

impl<'a> Joint<'a> {
    pub fn new(
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

    pub fn current(&self, fitted: &[FittedCell], counts: &[Vec<Vec<f64>>]) -> Current {
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
    pub fn log_table_prior(&self, current: &Current, seen: &[Vec<Vec<f64>>]) -> f64 {
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
    pub fn expect(&self, current: &Current) -> Expected {
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
