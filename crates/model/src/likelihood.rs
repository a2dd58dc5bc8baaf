//! Log densities of the rows of a table: complete rows in blocks, the others one by one.

use rayon::prelude::*;

use crate::cpd::{Cpd, NodeIdx, Sign};
use crate::error::ModelError;
use crate::evidence::Evidence;
use crate::gaussian::{log_normal_in_place, log_sum_exp};
use crate::model::Model;
use crate::table::Table;

/// Rows that are worked on together.
const BLOCK: usize = 2048;

impl Model {
    /// Log density of what each row tells about the nodes: exact also where cells are missing. A row that tells nothing
    /// gives 0.
    ///
    /// # Errors
    ///
    /// A cell of the wrong kind, or evidence without density.
    pub fn log_likelihood(&self, table: &Table) -> Result<Vec<f64>, ModelError> {
        let columns = Columns::read(self, table)?;
        let n = table.n_rows();
        let blocks: Result<Vec<Vec<f64>>, ModelError> = (0..n.div_ceil(BLOCK))
            .into_par_iter()
            .map(|block| {
                let rows = block * BLOCK..n.min((block + 1) * BLOCK);
                let mut out = Vec::with_capacity(rows.len());
                let mut rest = Vec::new();
                let (mut states, mut value, mut parents) =
                    (vec![0; self.nodes().len()], Vec::new(), Vec::new());
                for row in rows {
                    let log_density = columns.complete(self, row, &mut states, &mut value, &mut parents);
                    if log_density.is_none() {
                        rest.push(row);
                    }
                    out.push(log_density.unwrap_or(f64::NAN));
                }
                let gaps = Evidence::from_table(self, &table.select(&rest))?;
                for (row, evidence) in rest.into_iter().zip(&gaps) {
                    out[row - block * BLOCK] = match self.log_evidence(evidence) {
                        Err(ModelError::ImpossibleEvidence { .. }) => f64::NEG_INFINITY,
                        other => other?,
                    };
                }
                Ok(out)
            })
            .collect();
        Ok(blocks?.concat())
    }
}

/// A table's cells as the model's nodes read them.
struct Columns {
    values: Vec<Vec<Vec<f64>>>,
    states: Vec<Vec<Option<usize>>>,
    /// Whether the table has all columns.
    all: bool,
}

impl Columns {
    fn read(model: &Model, table: &Table) -> Result<Self, ModelError> {
        let mut columns = Self {
            values: Vec::new(),
            states: Vec::new(),
            all: true,
        };
        for node in model.nodes() {
            let (mut values, mut states) = (Vec::new(), Vec::new());
            if node.columns().iter().any(|column| table.column(column).is_none()) {
                columns.all = false;
            } else if let Cpd::Discrete(cpd) = &node.cpd {
                states = table.states(&node.name, &node.name, &cpd.states)?;
            } else {
                for column in node.columns() {
                    values.push(table.numbers(&column, &node.name)?);
                }
            }
            columns.values.push(values);
            columns.states.push(states);
        }
        Ok(columns)
    }

    /// Log density of a row without gaps; `None` for one with gaps, and for one that meets a singular component.
    fn complete(
        &self,
        model: &Model,
        row: usize,
        states: &mut [usize],
        value: &mut Vec<f64>,
        parents: &mut Vec<f64>,
    ) -> Option<f64> {
        let known = self.all
            && self.values.iter().flatten().all(|column| !column[row].is_nan())
            && self
                .states
                .iter()
                .all(|column| column.is_empty() || column[row].is_some());
        if !known {
            return None;
        }
        for (state, column) in states.iter_mut().zip(&self.states) {
            *state = column.get(row).copied().flatten().unwrap_or(0);
        }
        let mut sum = 0.0;
        for (i, node) in model.nodes().iter().enumerate() {
            let configuration = model.configuration(NodeIdx(i), states);
            sum += match &node.cpd {
                Cpd::Discrete(cpd) => cpd.log_density(configuration, states[i]),
                Cpd::VonMisesFisher(_) => return None,
                Cpd::Mixture(cpd) => {
                    value.clear();
                    value.extend(self.values[i].iter().map(|column| column[row]));
                    parents.clear();
                    for parent in &cpd.continuous_parents {
                        parents.extend(self.values[parent.0].iter().map(|column| column[row]));
                    }
                    log_local(model, NodeIdx(i), configuration, value, parents)?
                }
            };
        }
        Some(sum)
    }
}

/// log p(value | configuration, parents), components summed; `None` where one with positive weight is singular.
fn log_local(
    model: &Model,
    idx: NodeIdx,
    configuration: usize,
    value: &[f64],
    parents: &[f64],
) -> Option<f64> {
    let cpd = model.mixture(idx)?;
    let signs: &[f64] = if cpd.sign == Sign::Latent {
        &[1.0, -1.0]
    } else {
        &[1.0]
    };
    let share = -(signs.len() as f64).ln();
    let mut terms = Vec::with_capacity(signs.len() * cpd.components[configuration].len());
    let mut residual = vec![0.0; value.len()];
    for (c, component) in cpd.components[configuration].iter().enumerate() {
        if component.weight == 0.0 {
            continue;
        }
        let lower = model.factor(idx, configuration, c)?;
        let mean = component.mean_at(parents);
        for sign in signs {
            for (out, (x, mean)) in residual.iter_mut().zip(value.iter().zip(&mean)) {
                *out = sign * x - mean;
            }
            terms.push(component.weight.ln() + share + log_normal_in_place(&mut residual, lower));
        }
    }
    Some(log_sum_exp(&terms))
}
