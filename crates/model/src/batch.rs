//! One discrete target, one pattern of observed nodes, many rows: P(T | O), P(T | O, A), P(T | O, A, C).
//!
//! What does not depend on the row is worked out once: factors and normalizers of each combination of components, as a
//! tree. Rows are then worked on eight at a time; a branch of the tree is left out when an upper bound of all it holds is
//! below the largest term by 45 nats: less than rounding. Rows with gaps, singular components and large hidden blocks
//! take the general path of [`Model::query`], with the same result.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::cpd::{Cpd, NodeIdx};
use crate::error::ModelError;
use crate::evidence::{Evidence, Observation};
use crate::lanes::LANES;
use crate::model::Model;
use crate::plan::{Plan, Scratch};
use crate::table::Table;

/// A compiled query of one discrete node.
pub struct BatchQuery<'a> {
    model: &'a Model,
    target: NodeIdx,
    observed: Vec<NodeIdx>,
    columns: Vec<String>,
    fast: Option<Plan>,
}

/// What one row says about the target.
#[derive(Debug, Clone, PartialEq)]
pub struct RowPosterior {
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
    /// Unknown nodes; a continuous target, for which [`Model::query`] is the way.
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
        let fast = Plan::compile(model, target_idx, &nodes);
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
    /// Per row, as [`Model::query`]; a row of the wrong length.
    pub fn run(&self, rows: &[Vec<f64>]) -> Vec<Result<RowPosterior, ModelError>> {
        let Some(plan) = &self.fast else {
            return rows.par_iter().map(|row| self.general(row)).collect();
        };
        let mut by_states: BTreeMap<Vec<usize>, Vec<usize>> = BTreeMap::new();
        let mut out: Vec<Option<Result<RowPosterior, ModelError>>> = vec![None; rows.len()];
        for (i, row) in rows.iter().enumerate() {
            if row.len() == self.columns.len()
                && let Some(states) = plan.states(row)
            {
                by_states.entry(states).or_default().push(i);
            }
        }
        let blocks: Vec<(&[usize], &[usize])> = by_states
            .iter()
            .flat_map(|(states, numbers)| numbers.chunks(LANES).map(|block| (&states[..], block)))
            .collect();
        let answers: Vec<Vec<Option<RowPosterior>>> = blocks
            .par_iter()
            .with_min_len(8)
            .map_init(Scratch::default, |scratch, (states, numbers)| {
                let block: Vec<&[f64]> = numbers.iter().map(|&i| &rows[i][..]).collect();
                plan.rows(&block, states, scratch)
            })
            .collect();
        for ((_, numbers), answers) in blocks.iter().zip(answers) {
            for (&i, answer) in numbers.iter().zip(answers) {
                out[i] = answer.map(Ok);
            }
        }
        out.into_par_iter()
            .zip(rows)
            .map(|(answer, row)| answer.unwrap_or_else(|| self.general(row)))
            .collect()
    }

    /// [`BatchQuery::run`] for the rows of a table.
    ///
    /// # Errors
    ///
    /// A missing column or a cell of the wrong kind.
    pub fn run_table(&self, table: &Table) -> Result<Vec<Result<RowPosterior, ModelError>>, ModelError> {
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
                    Cpd::Mixture(_) | Cpd::VonMisesFisher(_) => table.numbers(&column, &node.name)?,
                };
                for (row, cell) in rows.iter_mut().zip(cells) {
                    row.push(cell);
                }
            }
        }
        Ok(self.run(&rows))
    }

    fn general(&self, row: &[f64]) -> Result<RowPosterior, ModelError> {
        if row.len() != self.columns.len() {
            return Err(ModelError::Length {
                what: "a row of the batch".into(),
                found: row.len(),
                expected: self.columns.len(),
            });
        }
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
                Cpd::Mixture(_) | Cpd::VonMisesFisher(_) => Observation::Value(value.to_vec()),
            };
            evidence = evidence.with(self.model, &node.name, observation)?;
        }
        let target = &self.model.node(self.target).name;
        let answer = self.model.query(&[target], &evidence)?;
        answer.exact()?;
        let posterior = answer.probabilities(target).unwrap_or_default();
        Ok(RowPosterior {
            log_evidence: answer.log_evidence,
            posterior,
        })
    }
}
