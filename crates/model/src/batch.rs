//! One discrete target, one pattern of observed nodes, many rows: P(T | O), P(T | O, A), P(T | O, A, C).
//!
//! What does not depend on the row is worked out once. Given a combination of components, the observed values of a
//! family, or of all that hangs together through hidden nodes, are Gaussian with a mean linear in the row: whitening
//! matrices are kept for each combination, as a tree. Per row, a branch of the tree is left out when an upper bound of
//! all it holds is below the largest term by 45 nats: less than rounding. Rows with gaps, singular components and large
//! hidden blocks take the general path of [`Model::posterior`], with the same result.

use rayon::prelude::*;

use crate::cpd::{Cpd, NodeIdx};
use crate::error::ModelError;
use crate::evidence::{Evidence, Observation};
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
                    Cpd::Mixture(_) | Cpd::VonMisesFisher(_) => table.numbers(&column, &node.name)?,
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
        {
            let mut posterior = vec![0.0; self.model.n_states(self.target)];
            if let Some(log_evidence) = fast.row(row, scratch, &mut posterior) {
                return Ok(RowAnswer {
                    log_evidence,
                    posterior,
                });
            }
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
                Cpd::Mixture(_) | Cpd::VonMisesFisher(_) => Observation::Value(value.to_vec()),
            };
            evidence = evidence.with(self.model, &node.name, observation)?;
        }
        let target = &self.model.node(self.target).name;
        let answer = self.model.posterior(&[target], &evidence)?;
        answer.exact()?;
        let posterior = answer.posterior(target).unwrap_or_default();
        Ok(RowAnswer {
            log_evidence: answer.log_evidence,
            posterior,
        })
    }
}
