//! Rows to learn from or to ask about: named columns of numbers or texts.

use std::collections::BTreeMap;

use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;

use crate::error::{ModelError, list};

/// One column of a [`Table`].
#[derive(Debug, Clone, PartialEq)]
pub enum Column {
    /// Numbers; NaN is a missing cell.
    Numbers(Vec<f64>),
    /// Texts; the empty text is a missing cell.
    Text(Vec<String>),
}

/// Named columns of one length.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    n_rows: usize,
    columns: Vec<(String, Column)>,
}

impl Table {
    /// A table of this many rows and no columns yet.
    pub fn new(n_rows: usize) -> Self {
        Self {
            n_rows,
            columns: Vec::new(),
        }
    }

    /// Columns that are known to fit.
    pub(crate) fn from_columns(n_rows: usize, columns: Vec<(String, Column)>) -> Self {
        Self { n_rows, columns }
    }

    /// The same table with one more column; one of the same name is replaced.
    ///
    /// # Errors
    ///
    /// [`ModelError::Length`] unless it has one cell per row.
    pub fn with(mut self, name: &str, column: Column) -> Result<Self, ModelError> {
        if column.len() != self.n_rows {
            return Err(ModelError::Length {
                what: format!("column `{name}`"),
                found: column.len(),
                expected: self.n_rows,
            });
        }
        self.columns.retain(|(other, _)| other != name);
        self.columns.push((name.into(), column));
        Ok(self)
    }

    /// [`Table::with`] for numbers; NaN is missing.
    ///
    /// # Errors
    ///
    /// [`ModelError::Length`] unless it has one cell per row.
    pub fn with_numbers(self, name: &str, values: Vec<f64>) -> Result<Self, ModelError> {
        self.with(name, Column::Numbers(values))
    }

    /// [`Table::with`] for texts; the empty text is missing.
    ///
    /// # Errors
    ///
    /// [`ModelError::Length`] unless it has one cell per row.
    pub fn with_text(self, name: &str, values: Vec<String>) -> Result<Self, ModelError> {
        self.with(name, Column::Text(values))
    }

    /// Number of rows.
    pub fn n_rows(&self) -> usize {
        self.n_rows
    }

    /// Names of the columns, in the order they came.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().map(|(name, _)| name.as_str())
    }

    /// The column of this name.
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns
            .iter()
            .find(|(other, _)| other == name)
            .map(|(_, column)| column)
    }

    /// The given rows, in the given order; rows may repeat.
    ///
    /// # Panics
    ///
    /// If a row does not exist.
    #[must_use]
    pub fn select(&self, rows: &[usize]) -> Self {
        let columns = self
            .columns
            .iter()
            .map(|(name, column)| {
                let column = match column {
                    Column::Numbers(values) => Column::Numbers(rows.iter().map(|&i| values[i]).collect()),
                    Column::Text(values) => Column::Text(rows.iter().map(|&i| values[i].clone()).collect()),
                };
                (name.clone(), column)
            })
            .collect();
        Self {
            n_rows: rows.len(),
            columns,
        }
    }

    /// Rows such that each value of a column has as many as the rarest one, drawn without replacement and returned in
    /// rising order. Rows where the cell is missing are left out.
    ///
    /// # Errors
    ///
    /// [`ModelError::MissingColumn`].
    pub fn balanced_rows(&self, column: &str, seed: u64) -> Result<Vec<usize>, ModelError> {
        let mut by_value: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        for (row, value) in self.texts(column, "balancing")?.into_iter().enumerate() {
            if let Some(value) = value {
                by_value.entry(value).or_default().push(row);
            }
        }
        let least = by_value.values().map(Vec::len).min().unwrap_or(0);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut rows = Vec::with_capacity(least * by_value.len());
        for mut candidates in by_value.into_values() {
            candidates.shuffle(&mut rng);
            rows.extend_from_slice(&candidates[..least]);
        }
        rows.sort_unstable();
        Ok(rows)
    }

    fn require(&self, column: &str, node: &str) -> Result<&Column, ModelError> {
        self.column(column).ok_or_else(|| ModelError::MissingColumn {
            column: column.into(),
            node: node.into(),
            known: list(self.names()),
        })
    }

    /// Numbers of a column, NaN where missing; texts are read as numbers. `node` is who asks, for messages.
    ///
    /// # Errors
    ///
    /// [`ModelError::MissingColumn`], [`ModelError::Cell`].
    pub fn numbers(&self, column: &str, node: &str) -> Result<Vec<f64>, ModelError> {
        let bad = |row: usize, found: String| ModelError::Cell {
            column: column.into(),
            row,
            found,
            expected: "a finite number, or an empty cell".into(),
        };
        match self.require(column, node)? {
            Column::Numbers(values) => match values.iter().position(|value| value.is_infinite()) {
                Some(row) => Err(bad(row, values[row].to_string())),
                None => Ok(values.clone()),
            },
            Column::Text(values) => values
                .iter()
                .enumerate()
                .map(|(row, text)| match text.trim() {
                    "" => Ok(f64::NAN),
                    text => match text.parse::<f64>() {
                        Ok(value) if !value.is_infinite() => Ok(value),
                        _ => Err(bad(row, format!("`{text}`"))),
                    },
                })
                .collect(),
        }
    }

    /// Cells of a column as texts, `None` where missing; numbers are printed. `node` is who asks, for messages.
    ///
    /// # Errors
    ///
    /// [`ModelError::MissingColumn`].
    pub fn texts(&self, column: &str, node: &str) -> Result<Vec<Option<String>>, ModelError> {
        Ok(match self.require(column, node)? {
            Column::Numbers(values) => values
                .iter()
                .map(|value| (!value.is_nan()).then(|| value.to_string()))
                .collect(),
            Column::Text(values) => values
                .iter()
                .map(|text| (!text.is_empty()).then(|| text.clone()))
                .collect(),
        })
    }

    /// States of a discrete node, `None` where missing: a cell holds the state's name, or its index.
    pub(crate) fn states(
        &self,
        column: &str,
        node: &str,
        states: &[String],
    ) -> Result<Vec<Option<usize>>, ModelError> {
        self.texts(column, node)?
            .into_iter()
            .enumerate()
            .map(|(row, cell)| {
                let Some(text) = cell else { return Ok(None) };
                let by_name = states.iter().position(|state| *state == text);
                let by_index = || {
                    text.parse::<f64>()
                        .ok()
                        .and_then(|value| state_at(value, states.len()))
                };
                by_name
                    .or_else(by_index)
                    .map(Some)
                    .ok_or_else(|| ModelError::Cell {
                        column: column.into(),
                        row,
                        found: format!("`{text}`"),
                        expected: format!("one of {}, or an index", list(states.iter().map(String::as_str))),
                    })
            })
            .collect()
    }
}

/// The state of this index, `None` unless it is a whole number below `n`.
pub(crate) fn state_at(value: f64, n: usize) -> Option<usize> {
    (value >= 0.0 && value.fract() == 0.0 && value < n as f64).then_some(value as usize)
}

impl Column {
    /// Number of cells.
    pub fn len(&self) -> usize {
        match self {
            Self::Numbers(values) => values.len(),
            Self::Text(values) => values.len(),
        }
    }

    /// Whether there are no cells.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(values: &[&str]) -> Vec<String> {
        values.iter().map(|&value| value.into()).collect()
    }

    #[test]
    fn states_are_read_by_name_or_index_and_a_wrong_one_is_named() {
        let states = texts(&["pour", "use"]);
        let table = Table::new(3).with_text("task", texts(&["use", "", "0"])).unwrap();
        assert_eq!(
            table.states("task", "task", &states).unwrap(),
            vec![Some(1), None, Some(0)]
        );
        let table = Table::new(1).with_text("task", texts(&["hammer"])).unwrap();
        let error = table.states("task", "task", &states).unwrap_err();
        assert_eq!(
            error.to_string(),
            "column `task`, row 0: found `hammer`, expected one of `pour`, `use`, or an index"
        );
    }

    #[test]
    fn balancing_takes_as_many_of_each_value_as_of_the_rarest() {
        let table = Table::new(6)
            .with_text("task", texts(&["a", "a", "b", "a", "", "b"]))
            .unwrap();
        let rows = table.balanced_rows("task", 7).unwrap();
        assert_eq!(rows.len(), 4);
        assert!(rows.contains(&2) && rows.contains(&5) && !rows.contains(&4));
        assert_eq!(rows, table.balanced_rows("task", 7).unwrap());
    }
}
