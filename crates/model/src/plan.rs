//! What a batch query works out once: configurations, families and hidden blocks, and how each reads a row.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use nalgebra::{DMatrix, DVector};

use crate::batch::RowAnswer;
use crate::cpd::{Component, Cpd, MixtureCpd, NodeIdx, Sign};
use crate::gaussian::{Gaussian, LOG_TAU, cholesky, log_sum_exp, solve_lower, solve_lower_transpose};
use crate::hidden_block::{Child, Dense, HiddenBlock, MAX_HIDDEN, Part, Prior};
use crate::model::Model;

/// Most joint states of the discrete nodes.
const MAX_ASSIGNMENTS: usize = 4096;
/// Most combinations of components of the hidden nodes of one block.
const MAX_COMBINATIONS: usize = 65_536;

/// Everything that does not depend on the row.
pub(crate) struct Plan {
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
/// Buffers of one thread.
#[derive(Default)]
pub(crate) struct Scratch {
    locals: Vec<f64>,
    blocks: Vec<f64>,
    terms: Vec<f64>,
    bases: Vec<Vec<Vec<f64>>>,
    peaks: Vec<Vec<f64>>,
}
impl Plan {
    /// `None` where the general path has to do.
    pub fn compile(model: &Model, target: NodeIdx, observed: &[NodeIdx]) -> Option<Self> {
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
    pub fn row(&self, row: &[f64], scratch: &mut Scratch) -> Option<RowAnswer> {
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
