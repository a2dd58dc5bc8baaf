//! One discrete target, one pattern of observed nodes, many rows: P(T | O), P(T | O, A), P(T | O, A, C).
//!
//! What does not depend on the row is worked out once. Per row and configuration, an observed family is one log-sum-exp.
//! Hidden continuous nodes z are eliminated in information form: every component of a family that reads z adds a fixed
//! precision and a vector linear in the row, so that one combination of components costs an h × h solve. Combinations
//! are walked depth first, and a branch is left when an upper bound of all it holds is below the largest term by
//! [`NEGLIGIBLE`] nats: less than rounding. Rows with gaps, singular components and large hidden blocks take the general
//! path of [`Model::posterior`], with the same result.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::cpd::{Component, Cpd, MixtureCpd, NodeIdx, Sign};
use crate::error::ModelError;
use crate::evidence::{Evidence, Observation};
use crate::gaussian::{Gaussian, LOG_TAU, cholesky, log_sum_exp, solve_lower, solve_lower_transpose};
use crate::model::Model;
use crate::table::Table;

/// Terms this far below the largest one are left out, in nats: e⁻⁴⁵ = 3e-20, and a block has fewer than 1e7 terms, so
/// at most 3e-13 of the result goes missing.
const NEGLIGIBLE: f64 = 45.0;
/// Most hidden dimensions in information form.
const MAX_HIDDEN: usize = 8;
/// Most joint states of the discrete nodes.
const MAX_ASSIGNMENTS: usize = 4096;
/// Most combinations of components of the hidden nodes of one block.
const MAX_COMBINATIONS: usize = 65_536;

/// A compiled query of one discrete node.
pub struct BatchQuery<'a> {
    model: &'a Model,
    target: NodeIdx,
    observed: Vec<NodeIdx>,
    columns: Vec<String>,
    fast: Option<Fast>,
}

/// What one row says about the target.
#[derive(Debug, Clone, PartialEq)]
pub struct RowAnswer {
    /// Natural logarithm of the density of the row's evidence.
    pub log_evidence: f64,
    /// Probability of each state of the target.
    pub posterior: Vec<f64>,
}

impl<'a> BatchQuery<'a> {
    /// Prepares P(target | observed).
    ///
    /// # Errors
    ///
    /// Unknown nodes; a continuous target, for which [`Model::posterior`] is the way.
    pub fn new(model: &'a Model, target: &str, observed: &[&str]) -> Result<Self, ModelError> {
        let target_idx = model.index(target)?;
        if model.n_states(target_idx) == 0 {
            return Err(ModelError::BadValue {
                node: target.into(),
                found: "a continuous target of a batch".into(),
                expected: "a discrete node".into(),
            });
        }
        let mut nodes = Vec::with_capacity(observed.len());
        for name in observed {
            let idx = model.index(name)?;
            if !nodes.contains(&idx) {
                nodes.push(idx);
            }
        }
        let columns = nodes.iter().flat_map(|&idx| model.node(idx).columns()).collect();
        let fast = Fast::compile(model, target_idx, &nodes);
        Ok(Self {
            model,
            target: target_idx,
            observed: nodes,
            columns,
            fast,
        })
    }

    /// Columns of a row: those of the observed nodes, in the order asked for.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Whether rows without gaps take the fast path.
    pub fn is_compiled(&self) -> bool {
        self.fast.is_some()
    }

    /// Answers rows of [`BatchQuery::columns`]: numbers, and the state's index for a discrete node; NaN is a gap. All
    /// threads of rayon's pool take part; the result does not depend on how many there are.
    ///
    /// # Errors
    ///
    /// Per row, as [`Model::posterior`]; a row of the wrong length.
    pub fn run(&self, rows: &[Vec<f64>]) -> Vec<Result<RowAnswer, ModelError>> {
        rows.par_iter()
            .with_min_len(64)
            .map_init(Scratch::default, |scratch, row| self.row(row, scratch))
            .collect()
    }

    /// [`BatchQuery::run`] for the rows of a table.
    ///
    /// # Errors
    ///
    /// A missing column or a cell of the wrong kind.
    pub fn run_table(&self, table: &Table) -> Result<Vec<Result<RowAnswer, ModelError>>, ModelError> {
        let mut rows = vec![Vec::with_capacity(self.columns.len()); table.n_rows()];
        for &idx in &self.observed {
            let node = self.model.node(idx);
            for column in node.columns() {
                let cells: Vec<f64> = match &node.cpd {
                    Cpd::Discrete(cpd) => table
                        .states(&column, &node.name, &cpd.states)?
                        .into_iter()
                        .map(|state| state.map_or(f64::NAN, |state| state as f64))
                        .collect(),
                    Cpd::Mixture(_) => table.numbers(&column, &node.name)?,
                };
                for (row, cell) in rows.iter_mut().zip(cells) {
                    row.push(cell);
                }
            }
        }
        Ok(self.run(&rows))
    }

    fn row(&self, row: &[f64], scratch: &mut Scratch) -> Result<RowAnswer, ModelError> {
        if row.len() != self.columns.len() {
            return Err(ModelError::Length {
                what: "a row of the batch".into(),
                found: row.len(),
                expected: self.columns.len(),
            });
        }
        if let Some(fast) = &self.fast
            && row.iter().all(|value| value.is_finite())
            && let Some(answer) = fast.row(row, scratch)
        {
            return Ok(answer);
        }
        self.general(row)
    }

    fn general(&self, row: &[f64]) -> Result<RowAnswer, ModelError> {
        let mut evidence = Evidence::new();
        let mut start = 0;
        for &idx in &self.observed {
            let node = self.model.node(idx);
            let value = &row[start..start + node.columns().len()];
            start += value.len();
            if value.iter().all(|v| v.is_nan()) {
                continue;
            }
            let observation = match &node.cpd {
                Cpd::Discrete(cpd) => {
                    let state = crate::table::state_at(value[0], cpd.states.len());
                    Observation::State(state.ok_or_else(|| ModelError::BadValue {
                        node: node.name.clone(),
                        found: value[0].to_string(),
                        expected: format!("a state's index below {}", cpd.states.len()),
                    })?)
                }
                Cpd::Mixture(_) => Observation::Value(value.to_vec()),
            };
            evidence = evidence.with(self.model, &node.name, observation)?;
        }
        let target = &self.model.node(self.target).name;
        let answer = self.model.posterior(&[target], &evidence)?;
        let posterior = answer.posterior(target).unwrap_or_default();
        Ok(RowAnswer {
            log_evidence: answer.log_evidence,
            posterior,
        })
    }
}

/// Everything that does not depend on the row.
struct Fast {
    n_target_states: usize,
    /// Joint states of the relevant discrete nodes with a positive probability.
    assignments: Vec<Assignment>,
    /// Observed families per configuration; shared by assignments.
    locals: Vec<Vec<Part>>,
    blocks: Vec<HiddenBlock>,
    /// Place in the row of each observed discrete node.
    observed_states: Vec<usize>,
}

struct Assignment {
    log_prior: f64,
    target_state: usize,
    /// State of each observed discrete node.
    observed: Vec<usize>,
    locals: Vec<usize>,
    blocks: Vec<usize>,
}

/// A component that reads the row only: log weight − ½ |R [row, 1]|².
struct Part {
    constant: f64,
    /// d × (row + 1), white.
    reader: Dense,
}

/// One configuration of the nodes of a hidden block.
struct HiddenBlock {
    h: usize,
    combinations: Vec<Prior>,
    /// Per observed child: its components.
    children: Vec<Vec<Child>>,
}

/// Gaussian over z of one combination of the hidden nodes' components.
struct Prior {
    log_weight: f64,
    /// h × (row + 1): the mean.
    mean: Dense,
    /// h × h, row by row.
    precision: Vec<f64>,
    half_log_determinant: f64,
}

/// A component of an observed child: log weight − ½ |R [row, 1] − G z|².
struct Child {
    constant: f64,
    reader: Dense,
    /// d × h.
    pull: Dense,
    /// GᵀG, h × h.
    precision: Vec<f64>,
    /// What no z explains: the projection of R beside the columns of G.
    beside: Dense,
}

/// A matrix, row by row, with the columns that are all zero left out of the products.
struct Dense {
    rows: usize,
    used: Vec<usize>,
    values: Vec<f64>,
}

#[derive(Default)]
struct Scratch {
    locals: Vec<f64>,
    blocks: Vec<f64>,
    terms: Vec<f64>,
    bases: Vec<Vec<Vec<f64>>>,
    peaks: Vec<Vec<f64>>,
}

impl Dense {
    fn new(matrix: &DMatrix<f64>) -> Self {
        let used: Vec<usize> = (0..matrix.ncols())
            .filter(|&j| matrix.column(j).iter().any(|value| *value != 0.0))
            .collect();
        let values = matrix
            .row_iter()
            .flat_map(|row| used.iter().map(|&j| row[j]).collect::<Vec<_>>())
            .collect();
        Self {
            rows: matrix.nrows(),
            used,
            values,
        }
    }

    /// One entry of the product with [row, 1].
    fn entry(&self, i: usize, row: &[f64]) -> f64 {
        let width = self.used.len();
        let mut sum = 0.0;
        for (value, &j) in self.values[i * width..(i + 1) * width].iter().zip(&self.used) {
            sum += value * row.get(j).copied().unwrap_or(1.0);
        }
        sum
    }

    fn norm_squared(&self, row: &[f64]) -> f64 {
        (0..self.rows).map(|i| self.entry(i, row).powi(2)).sum()
    }
}

impl Fast {
    /// `None` where the general path has to do.
    fn compile(model: &Model, target: NodeIdx, observed: &[NodeIdx]) -> Option<Self> {
        let mut relevant = vec![false; model.nodes().len()];
        relevant[target.0] = true;
        for idx in observed {
            relevant[idx.0] = true;
        }
        for &idx in model.order().iter().rev() {
            if relevant[idx.0] {
                for parent in model.node(idx).parents() {
                    relevant[parent.0] = true;
                }
            }
        }
        let ordered: Vec<NodeIdx> = model
            .order()
            .iter()
            .copied()
            .filter(|idx| relevant[idx.0])
            .collect();
        let (discrete, continuous): (Vec<NodeIdx>, Vec<NodeIdx>) =
            ordered.iter().copied().partition(|&idx| model.n_states(idx) > 0);
        let mut place = vec![None; model.nodes().len()];
        let mut width = 0;
        for &idx in observed {
            place[idx.0] = Some(width);
            width += model.node(idx).columns().len();
        }
        let layout = Layout { model, place, width };
        let is_hidden = |idx: &NodeIdx| layout.place[idx.0].is_none();
        let reads_hidden = |idx: &NodeIdx| model.node(*idx).continuous_parents().iter().any(is_hidden);
        // All hidden nodes form one block here; the general path tells them apart.
        let hidden: Vec<NodeIdx> = continuous.iter().copied().filter(is_hidden).collect();
        let children: Vec<NodeIdx> = continuous
            .iter()
            .copied()
            .filter(|idx| !is_hidden(idx) && reads_hidden(idx))
            .collect();
        let local: Vec<NodeIdx> = continuous
            .iter()
            .copied()
            .filter(|idx| !is_hidden(idx) && !reads_hidden(idx))
            .collect();
        let n: usize = discrete
            .iter()
            .map(|&idx| model.n_states(idx))
            .try_fold(1usize, usize::checked_mul)?;
        if n > MAX_ASSIGNMENTS {
            return None;
        }
        let mut fast = Self {
            n_target_states: model.n_states(target),
            assignments: Vec::with_capacity(n),
            locals: Vec::new(),
            blocks: Vec::new(),
            observed_states: discrete.iter().filter_map(|idx| layout.place[idx.0]).collect(),
        };
        let mut known_locals = BTreeMap::new();
        let mut known_blocks = BTreeMap::new();
        let mut states = vec![0; model.nodes().len()];
        for number in 0..n {
            let mut left = number;
            for &idx in discrete.iter().rev() {
                states[idx.0] = left % model.n_states(idx);
                left /= model.n_states(idx);
            }
            let mut log_prior = 0.0;
            for &idx in &discrete {
                if let Cpd::Discrete(cpd) = &model.node(idx).cpd {
                    log_prior += cpd.log_density(model.configuration(idx, &states), states[idx.0]);
                }
            }
            if log_prior == f64::NEG_INFINITY {
                continue;
            }
            let mut locals = Vec::with_capacity(local.len());
            for &idx in &local {
                let key = (idx, model.configuration(idx, &states));
                if let Entry::Vacant(vacant) = known_locals.entry(key) {
                    vacant.insert(fast.locals.len());
                    fast.locals.push(layout.parts(idx, key.1)?);
                }
                locals.push(known_locals[&key]);
            }
            let mut blocks = Vec::new();
            if !hidden.is_empty() {
                let key: Vec<usize> = hidden
                    .iter()
                    .chain(&children)
                    .map(|&idx| model.configuration(idx, &states))
                    .collect();
                if let Entry::Vacant(vacant) = known_blocks.entry(key.clone()) {
                    vacant.insert(fast.blocks.len());
                    fast.blocks.push(layout.block(&hidden, &children, &states)?);
                }
                blocks.push(known_blocks[&key]);
            }
            fast.assignments.push(Assignment {
                log_prior,
                target_state: states[target.0],
                observed: discrete
                    .iter()
                    .filter(|idx| !is_hidden(idx))
                    .map(|idx| states[idx.0])
                    .collect(),
                locals,
                blocks,
            });
        }
        Some(fast)
    }

    /// `None` where no term is finite: the general path says why.
    fn row(&self, row: &[f64], scratch: &mut Scratch) -> Option<RowAnswer> {
        let Scratch {
            locals,
            blocks,
            terms,
            bases,
            peaks,
        } = scratch;
        locals.clear();
        locals.resize(self.locals.len(), f64::NAN);
        blocks.clear();
        blocks.resize(self.blocks.len(), f64::NAN);
        let mut by_state = vec![Vec::with_capacity(1); self.n_target_states];
        for assignment in &self.assignments {
            let fits = assignment.observed.iter().zip(&self.observed_states);
            if fits
                .into_iter()
                .any(|(&state, &place)| row[place] != state as f64)
            {
                continue;
            }
            let mut log_weight = assignment.log_prior;
            for &i in &assignment.locals {
                if locals[i].is_nan() {
                    terms.clear();
                    terms.extend(
                        self.locals[i]
                            .iter()
                            .map(|part| part.constant - 0.5 * part.reader.norm_squared(row)),
                    );
                    locals[i] = log_sum_exp(terms);
                }
                log_weight += locals[i];
            }
            for &i in &assignment.blocks {
                if blocks[i].is_nan() {
                    blocks[i] = self.blocks[i].log_integral(row, terms, bases, peaks);
                }
                log_weight += blocks[i];
            }
            by_state[assignment.target_state].push(log_weight);
        }
        let logs: Vec<f64> = by_state.iter().map(|logs| log_sum_exp(logs)).collect();
        let log_evidence = log_sum_exp(&logs);
        log_evidence.is_finite().then(|| RowAnswer {
            log_evidence,
            posterior: logs.iter().map(|log| (log - log_evidence).exp()).collect(),
        })
    }
}

impl HiddenBlock {
    /// log ∫ p(z) Π p(child | z) dz, all components summed.
    fn log_integral(
        &self,
        row: &[f64],
        terms: &mut Vec<f64>,
        bases: &mut Vec<Vec<Vec<f64>>>,
        peaks: &mut Vec<Vec<f64>>,
    ) -> f64 {
        bases.clear();
        peaks.clear();
        for child in &self.children {
            bases.push(
                child
                    .iter()
                    .map(|c| (0..c.reader.rows).map(|i| c.reader.entry(i, row)).collect())
                    .collect(),
            );
            peaks.push(
                child
                    .iter()
                    .map(|c| c.constant - 0.5 * c.beside.norm_squared(row))
                    .collect(),
            );
        }
        let mut rest = vec![0.0; self.children.len() + 1];
        for j in (0..self.children.len()).rev() {
            rest[j] = rest[j + 1] + log_sum_exp(&peaks[j]);
        }
        let orders: Vec<Vec<usize>> = peaks
            .iter()
            .map(|peaks| {
                let mut order: Vec<usize> = (0..peaks.len()).collect();
                order.sort_by(|&a, &b| peaks[b].total_cmp(&peaks[a]));
                order
            })
            .collect();
        terms.clear();
        let mut walk = Walk {
            block: self,
            bases,
            peaks,
            rest: &rest,
            orders: &orders,
            terms,
            largest: f64::NEG_INFINITY,
        };
        for prior in &self.combinations {
            let mut mean = [0.0; MAX_HIDDEN];
            for (i, mean) in mean.iter_mut().enumerate().take(self.h) {
                *mean = prior.mean.entry(i, row);
            }
            let mut precision = [0.0; MAX_HIDDEN * MAX_HIDDEN];
            precision[..self.h * self.h].copy_from_slice(&prior.precision);
            let state = State {
                constant: prior.log_weight + prior.half_log_determinant,
                precision,
                vector: [0.0; MAX_HIDDEN],
            };
            walk.visit(0, &state, prior.log_weight, &mean);
        }
        log_sum_exp(walk.terms)
    }
}

/// A quadratic in e = z − mean: constant + vectorᵀ e − ½ eᵀ precision e.
struct State {
    constant: f64,
    precision: [f64; MAX_HIDDEN * MAX_HIDDEN],
    vector: [f64; MAX_HIDDEN],
}

struct Walk<'a> {
    block: &'a HiddenBlock,
    bases: &'a [Vec<Vec<f64>>],
    peaks: &'a [Vec<f64>],
    rest: &'a [f64],
    orders: &'a [Vec<usize>],
    terms: &'a mut Vec<f64>,
    largest: f64,
}

impl Walk<'_> {
    /// `value` is the logarithm of the integral of `state`.
    fn visit(&mut self, depth: usize, state: &State, value: f64, mean: &[f64; MAX_HIDDEN]) {
        if depth == self.block.children.len() {
            self.largest = self.largest.max(value);
            self.terms.push(value);
            return;
        }
        let h = self.block.h;
        for &c in &self.orders[depth] {
            if value + self.peaks[depth][c] + self.rest[depth + 1] < self.largest - NEGLIGIBLE {
                // Later components have lower peaks still.
                break;
            }
            let child = &self.block.children[depth][c];
            let mut next = State {
                constant: state.constant + child.constant,
                ..*state
            };
            for (i, base) in self.bases[depth][c].iter().enumerate() {
                let pull = &child.pull.values[i * h..(i + 1) * h];
                let mut residual = *base;
                for (g, m) in pull.iter().zip(mean) {
                    residual -= g * m;
                }
                next.constant -= 0.5 * residual * residual;
                for (sum, g) in next.vector.iter_mut().zip(pull) {
                    *sum += g * residual;
                }
            }
            for (sum, g) in next.precision[..h * h].iter_mut().zip(&child.precision) {
                *sum += g;
            }
            let value = next.log_integral(h);
            if value + self.rest[depth + 1] >= self.largest - NEGLIGIBLE {
                self.visit(depth + 1, &next, value, mean);
            }
        }
    }
}

impl State {
    /// constant + ½ vᵀ Λ⁻¹ v − ½ log|Λ|: the (2π)^(h/2) cancels against the prior's.
    fn log_integral(&self, h: usize) -> f64 {
        let mut lower = [0.0; MAX_HIDDEN * MAX_HIDDEN];
        let mut white = [0.0; MAX_HIDDEN];
        let mut value = self.constant;
        let mut pivots = 1.0;
        for i in 0..h {
            for j in 0..=i {
                let mut sum = self.precision[i * h + j];
                for k in 0..j {
                    sum -= lower[i * h + k] * lower[j * h + k];
                }
                lower[i * h + j] = if i == j {
                    sum.sqrt()
                } else {
                    sum / lower[j * h + j]
                };
            }
            let mut sum = self.vector[i];
            for k in 0..i {
                sum -= lower[i * h + k] * white[k];
            }
            white[i] = sum / lower[i * h + i];
            value += 0.5 * white[i] * white[i];
            pivots *= lower[i * h + i];
        }
        value - pivots.ln()
    }
}

struct Layout<'a> {
    model: &'a Model,
    place: Vec<Option<usize>>,
    width: usize,
}

/// A component as it acts on the row and on z: x ~ N(own [row, 1] + hidden z, noise).
struct Acting {
    log_weight: f64,
    own: DMatrix<f64>,
    hidden: DMatrix<f64>,
    noise: DMatrix<f64>,
}

impl Layout<'_> {
    fn mixture(&self, idx: NodeIdx) -> Option<&MixtureCpd> {
        self.model.mixture(idx)
    }

    /// Components with positive weight, both signs where latent. `offsets` is where hidden nodes start in z.
    fn acting(
        &self,
        idx: NodeIdx,
        configuration: usize,
        offsets: &[Option<usize>],
        h: usize,
    ) -> Option<Vec<Acting>> {
        let cpd = self.mixture(idx)?;
        let signs: &[f64] = if cpd.sign == Sign::Latent {
            &[1.0, -1.0]
        } else {
            &[1.0]
        };
        let mut out = Vec::new();
        for component in cpd.components[configuration].iter().filter(|c| c.weight > 0.0) {
            let (own, hidden) = self.split(cpd, component, offsets, h)?;
            for &sign in signs {
                out.push(Acting {
                    log_weight: component.weight.ln() - (signs.len() as f64).ln(),
                    own: sign * &own,
                    hidden: sign * &hidden,
                    noise: component.covariance.clone(),
                });
            }
        }
        Some(out)
    }

    fn split(
        &self,
        cpd: &MixtureCpd,
        component: &Component,
        offsets: &[Option<usize>],
        h: usize,
    ) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
        let d = cpd.dim();
        let mut own = DMatrix::zeros(d, self.width + 1);
        own.column_mut(self.width).copy_from(&component.mean);
        let mut hidden = DMatrix::zeros(d, h);
        let mut column = 0;
        for &parent in &cpd.continuous_parents {
            let width = self.mixture(parent)?.dim();
            let part = component.coefficients.columns(column, width);
            match self.place[parent.0] {
                Some(place) => own.columns_mut(place, width).copy_from(&part),
                None => hidden.columns_mut(offsets[parent.0]?, width).copy_from(&part),
            }
            column += width;
        }
        Some((own, hidden))
    }

    /// x − own [row, 1], white, and its constant. `None` where singular.
    fn reader(&self, idx: NodeIdx, acting: &Acting) -> Option<(f64, DMatrix<f64>, DMatrix<f64>)> {
        let lower = cholesky(&acting.noise)?;
        let d = lower.nrows();
        let mut away = -acting.own.clone();
        for i in 0..d {
            away[(i, self.place[idx.0]? + i)] += 1.0;
        }
        let log_root: f64 = (0..d).map(|i| lower[(i, i)].ln()).sum();
        let constant = acting.log_weight - 0.5 * d as f64 * LOG_TAU - log_root;
        Some((constant, solve_lower(&lower, &away), lower))
    }

    fn parts(&self, idx: NodeIdx, configuration: usize) -> Option<Vec<Part>> {
        let acting = self.acting(idx, configuration, &[], 0)?;
        acting
            .iter()
            .map(|acting| {
                let (constant, reader, _) = self.reader(idx, acting)?;
                Some(Part {
                    constant,
                    reader: Dense::new(&reader),
                })
            })
            .collect()
    }

    fn block(&self, hidden: &[NodeIdx], children: &[NodeIdx], states: &[usize]) -> Option<HiddenBlock> {
        let mut offsets = vec![None; self.model.nodes().len()];
        let mut h = 0;
        for &idx in hidden {
            offsets[idx.0] = Some(h);
            h += self.mixture(idx)?.dim();
        }
        if h > MAX_HIDDEN {
            return None;
        }
        let start = (0.0, DMatrix::zeros(0, self.width + 1), Gaussian::empty());
        let mut joint: Vec<(f64, DMatrix<f64>, Gaussian)> = vec![start];
        for &idx in hidden {
            let acting = self.acting(idx, self.model.configuration(idx, states), &offsets, h)?;
            if joint.len() * acting.len() > MAX_COMBINATIONS {
                return None;
            }
            let mut longer = Vec::with_capacity(joint.len() * acting.len());
            for (log_weight, mean, gaussian) in &joint {
                for a in &acting {
                    let known = mean.nrows();
                    let coefficients = a.hidden.columns(0, known).into_owned();
                    let own = &a.own + &coefficients * mean;
                    let mut both = DMatrix::zeros(known + own.nrows(), self.width + 1);
                    both.rows_mut(0, known).copy_from(mean);
                    both.rows_mut(known, own.nrows()).copy_from(&own);
                    let zero = DVector::zeros(own.nrows());
                    longer.push((
                        log_weight + a.log_weight,
                        both,
                        gaussian.append(&zero, &coefficients, &a.noise),
                    ));
                }
            }
            joint = longer;
        }
        let combinations = joint
            .into_iter()
            .map(|(log_weight, mean, gaussian)| {
                let lower = cholesky(&gaussian.covariance)?;
                let identity = DMatrix::identity(h, h);
                let precision = solve_lower_transpose(&lower, &solve_lower(&lower, &identity));
                let half_log_determinant = -(0..h).map(|i| lower[(i, i)].ln()).sum::<f64>();
                Some(Prior {
                    log_weight,
                    mean: Dense::new(&mean),
                    precision: precision.transpose().iter().copied().collect(),
                    half_log_determinant,
                })
            })
            .collect::<Option<Vec<Prior>>>()?;
        let children = children
            .iter()
            .map(|&idx| {
                let acting = self.acting(idx, self.model.configuration(idx, states), &offsets, h)?;
                acting.iter().map(|acting| self.child(idx, acting, h)).collect()
            })
            .collect::<Option<Vec<Vec<Child>>>>()?;
        Some(HiddenBlock {
            h,
            combinations,
            children,
        })
    }

    fn child(&self, idx: NodeIdx, acting: &Acting, h: usize) -> Option<Child> {
        let (constant, reader, lower) = self.reader(idx, acting)?;
        let pull = solve_lower(&lower, &acting.hidden);
        let precision = pull.transpose() * &pull;
        // Orthonormal columns that span G, by Gram-Schmidt; what is left of R is what no z explains.
        let mut basis: Vec<DVector<f64>> = Vec::new();
        for column in pull.column_iter() {
            let mut left = column.into_owned();
            for _ in 0..2 {
                for other in &basis {
                    let along = other.dot(&left);
                    left -= along * other;
                }
            }
            if left.norm() > 1e-12 * column.norm() && left.norm() > 0.0 {
                basis.push(left.normalize());
            }
        }
        let mut beside = reader.clone();
        for other in &basis {
            let along = other.transpose() * &beside;
            beside -= other * along;
        }
        let dense_pull = Dense {
            rows: pull.nrows(),
            used: (0..h).collect(),
            values: pull.transpose().iter().copied().collect(),
        };
        Some(Child {
            constant,
            reader: Dense::new(&reader),
            pull: dense_pull,
            precision: precision.iter().copied().collect(),
            beside: Dense::new(&beside),
        })
    }
}
