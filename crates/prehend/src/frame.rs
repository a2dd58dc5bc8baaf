//! Tables: named columns of numbers, integers or text, from and to Parquet, CSV and JSON lines.

use std::collections::BTreeMap;
use std::path::Path;

use crate::{Error, files};

mod csv_table;
mod json_lines;
mod parquet_table;
mod table_writer;

pub use table_writer::TableWriter;

/// One column; every column of a frame has as many entries as the frame has rows.
#[derive(Debug, Clone, PartialEq)]
pub enum Column {
    /// Numbers; NaN where a cell is missing.
    Number(Vec<f64>),
    /// Whole numbers, none missing.
    Integer(Vec<i64>),
    /// Text; `None` where a cell is missing.
    Text(Vec<Option<String>>),
}

impl Column {
    /// How many entries there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Number(v) => v.len(),
            Self::Integer(v) => v.len(),
            Self::Text(v) => v.len(),
        }
    }

    /// Whether there are no entries.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn select(&self, rows: &[usize]) -> Self {
        match self {
            Self::Number(v) => Self::Number(rows.iter().map(|&r| v[r]).collect()),
            Self::Integer(v) => Self::Integer(rows.iter().map(|&r| v[r]).collect()),
            Self::Text(v) => Self::Text(rows.iter().map(|&r| v[r].clone()).collect()),
        }
    }

    /// A column of this kind without values.
    fn missing(&self, n: usize) -> Self {
        match self {
            Self::Number(_) | Self::Integer(_) => Self::Number(vec![f64::NAN; n]),
            Self::Text(_) => Self::Text(vec![None; n]),
        }
    }

    fn append(&mut self, other: &Self) {
        match (&mut *self, other) {
            (Self::Number(a), Self::Number(b)) => a.extend(b),
            (Self::Integer(a), Self::Integer(b)) => a.extend(b),
            (Self::Text(a), Self::Text(b)) => a.extend(b.iter().cloned()),
            (Self::Text(a), b) => a.extend((0..b.len()).map(|r| b.text_at(r))),
            (a, Self::Text(b)) => {
                let mut text: Vec<_> = (0..a.len()).map(|r| a.text_at(r)).collect();
                text.extend(b.iter().cloned());
                *a = Self::Text(text);
            }
            (a, b) => {
                *a = Self::Number(
                    (0..a.len())
                        .map(|r| a.number_at(r))
                        .chain((0..b.len()).map(|r| b.number_at(r)))
                        .collect(),
                );
            }
        }
    }

    fn number_at(&self, row: usize) -> f64 {
        match self {
            Self::Number(v) => v[row],
            Self::Integer(v) => v[row] as f64,
            Self::Text(v) => v[row]
                .as_deref()
                .and_then(|t| t.trim().parse().ok())
                .unwrap_or(f64::NAN),
        }
    }

    fn text_at(&self, row: usize) -> Option<String> {
        match self {
            Self::Number(v) => (!v[row].is_nan()).then(|| v[row].to_string()),
            Self::Integer(v) => Some(v[row].to_string()),
            Self::Text(v) => v[row].clone(),
        }
    }
}

/// A table in memory.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Frame {
    columns: Vec<(String, Column)>,
    /// Key–value pairs that travel with a Parquet file, such as the fingerprint of the stage that wrote it.
    pub metadata: BTreeMap<String, String>,
}

impl Frame {
    /// A frame without columns.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a column.
    ///
    /// # Panics
    ///
    /// Where its length differs from the columns before it: that is our own mistake.
    pub fn push(&mut self, name: impl Into<String>, column: Column) {
        assert!(
            self.columns.is_empty() || column.len() == self.n_rows(),
            "columns of one frame have one length"
        );
        self.columns.push((name.into(), column));
    }

    /// Number of rows.
    pub fn n_rows(&self) -> usize {
        self.columns.first().map_or(0, |(_, c)| c.len())
    }

    /// All columns in order.
    pub fn columns(&self) -> &[(String, Column)] {
        &self.columns
    }

    /// One column by name.
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|(n, _)| n == name).map(|(_, c)| c)
    }

    fn required(&self, name: &str) -> Result<&Column, Error> {
        self.column(name).ok_or_else(|| {
            let names: Vec<_> = self.columns.iter().map(|(n, _)| n.as_str()).collect();
            Error::input(format!(
                "the table has no column `{name}`; it has {}",
                names.join(", ")
            ))
        })
    }

    /// A column as numbers; text that is no number becomes NaN.
    ///
    /// # Errors
    ///
    /// Names the column that is missing and those that are there.
    pub fn numbers(&self, name: &str) -> Result<Vec<f64>, Error> {
        let column = self.required(name)?;
        Ok((0..column.len()).map(|r| column.number_at(r)).collect())
    }

    /// A column as text; missing cells become empty.
    ///
    /// # Errors
    ///
    /// Names the column that is missing and those that are there.
    pub fn texts(&self, name: &str) -> Result<Vec<String>, Error> {
        let column = self.required(name)?;
        Ok((0..column.len())
            .map(|r| column.text_at(r).unwrap_or_default())
            .collect())
    }

    /// These rows, in this order; a row may come several times.
    #[must_use]
    pub fn select(&self, rows: &[usize]) -> Self {
        let columns = self
            .columns
            .iter()
            .map(|(n, c)| (n.clone(), c.select(rows)))
            .collect();
        Self {
            columns,
            metadata: self.metadata.clone(),
        }
    }

    /// Appends the rows of another frame. Columns that only one of the two has are dropped: joint columns differ by hand.
    pub fn append(&mut self, other: &Self) {
        if self.columns.is_empty() {
            *self = other.clone();
            return;
        }
        self.columns.retain(|(n, _)| other.column(n).is_some());
        for (name, column) in &mut self.columns {
            if let Some(more) = other.column(name) {
                column.append(more);
            }
        }
    }

    /// Appends the rows of another frame and keeps the columns of both: cells that a row has none for are missing.
    pub fn append_all(&mut self, other: &Self) {
        let (n, more) = (self.n_rows(), other.n_rows());
        for (name, column) in &mut self.columns {
            match other.column(name) {
                Some(theirs) => column.append(theirs),
                None => column.append(&column.missing(more)),
            }
        }
        for (name, column) in &other.columns {
            if self.column(name).is_none() {
                let mut whole = column.missing(n);
                whole.append(column);
                self.columns.push((name.clone(), whole));
            }
        }
    }

    /// The columns that have a value in some row.
    #[must_use]
    pub fn without_empty_columns(&self) -> Self {
        let mut kept = self.clone();
        kept.columns.retain(|(_, column)| match column {
            Column::Number(v) => v.iter().any(|x| !x.is_nan()),
            Column::Integer(v) => !v.is_empty(),
            Column::Text(v) => v.iter().any(Option::is_some),
        });
        kept
    }

    /// Reads a table by its extension: `.parquet`, `.csv`, `.jsonl`; `-` is CSV on standard input.
    ///
    /// # Errors
    ///
    /// [`Error::File`] with the line or column where the file departs from its format.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let bytes = files::read(path)?;
        match files::extension(path).as_deref() {
            Some("parquet" | "pq") => parquet_table::read(bytes),
            Some("jsonl" | "ndjson") => json_lines::read(&bytes),
            Some("csv") | None => csv_table::read(&bytes),
            Some(other) => Err(Error::input(format!(
                "the extension `.{other}` is no table; use .parquet, .csv or .jsonl"
            ))),
        }
        .map_err(|e| Error::file(path, e))
    }

    /// Writes the table by its extension, as [`Frame::read`] reads it.
    ///
    /// # Errors
    ///
    /// [`Error::File`]; a half-written file never stands under its final name.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        Self::check_name(path)?;
        let bytes = match files::extension(path).as_deref() {
            Some("parquet" | "pq") => parquet_table::write(self)?,
            Some("jsonl" | "ndjson") => json_lines::write(self),
            _ => csv_table::write(self)?,
        };
        files::write(path, &bytes)
    }

    /// Whether [`Frame::write`] knows the path's extension, for asking before long work.
    ///
    /// # Errors
    ///
    /// [`Error::File`] where it does not.
    pub fn check_name(path: &Path) -> Result<(), Error> {
        match files::extension(path).as_deref() {
            Some("parquet" | "pq" | "jsonl" | "ndjson" | "csv") => Ok(()),
            _ => Err(Error::file(
                path,
                "is no table's name; end it with .parquet, .csv or .jsonl",
            )),
        }
    }

    /// The table as CSV text.
    ///
    /// # Errors
    ///
    /// Where the writer refuses, which it does not for tables of ours.
    pub fn to_csv(&self) -> Result<Vec<u8>, Error> {
        csv_table::write(self)
    }

    /// A Parquet file's key–value pairs alone, without reading its rows; empty for other formats and unreadable files.
    pub fn read_metadata(path: &Path) -> BTreeMap<String, String> {
        files::read(path)
            .ok()
            .and_then(|bytes| parquet_table::read_metadata(bytes).ok())
            .unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Frame {
        let mut frame = Frame::new();
        frame.push(
            "name",
            Column::Text(vec![Some("a,\"b\"".into()), None, Some("ü".into())]),
        );
        frame.push("x", Column::Number(vec![0.1 + 0.2, f64::NAN, -1e-300]));
        frame.push("n", Column::Integer(vec![1, -2, i64::from(i32::MAX) + 5]));
        frame
    }

    fn same(a: &Frame, b: &Frame) -> bool {
        format!("{:?}", a.columns) == format!("{:?}", b.columns)
    }

    #[test]
    fn parquet_gives_back_every_bit_and_the_metadata() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.parquet");
        let mut frame = sample();
        frame.metadata.insert("fingerprint".into(), "abc".into());
        frame.write(&path).unwrap();
        let back = Frame::read(&path).unwrap();
        assert!(same(&frame, &back), "{back:?}");
        assert_eq!(back.metadata["fingerprint"], "abc");
        assert_eq!(Frame::read_metadata(&path)["fingerprint"], "abc");
    }

    #[test]
    fn csv_and_json_lines_give_back_numbers_and_missing_cells() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["t.csv", "t.jsonl"] {
            let path = folder.path().join(name);
            sample().write(&path).unwrap();
            let back = Frame::read(&path).unwrap();
            assert_eq!(back.texts("name").unwrap(), ["a,\"b\"", "", "ü"], "{name}");
            let x = back.numbers("x").unwrap();
            assert!(x[0] == 0.1 + 0.2 && x[1].is_nan() && x[2] == -1e-300, "{name}");
            assert_eq!(back.numbers("n").unwrap(), [1.0, -2.0, 2147483652.0], "{name}");
        }
    }

    #[test]
    fn a_missing_column_is_named_with_those_that_are_there() {
        let message = sample().numbers("y").unwrap_err().to_string();
        assert_eq!(message, "the table has no column `y`; it has name, x, n");
    }

    #[test]
    fn appending_keeps_what_both_have() {
        let mut a = sample();
        let mut b = Frame::new();
        b.push("n", Column::Integer(vec![7]));
        b.push("x", Column::Number(vec![1.0]));
        a.append(&b);
        assert_eq!(a.n_rows(), 4);
        assert!(a.column("name").is_none());
    }

    #[test]
    fn appending_all_leaves_cells_that_nobody_has_missing() {
        let mut a = sample();
        let mut b = Frame::new();
        b.push("n", Column::Integer(vec![7]));
        b.push("z", Column::Integer(vec![8]));
        let columns = a.columns().len();
        a.append_all(&b);
        assert_eq!((a.n_rows(), a.columns().len()), (4, columns + 1));
        let Some(Column::Text(names)) = a.column("name") else {
            panic!("name is text");
        };
        assert_eq!(names[3], None);
        assert!(a.numbers("x").unwrap()[3].is_nan() && a.numbers("z").unwrap()[0].is_nan());
        assert_eq!(
            (a.numbers("n").unwrap()[3], a.numbers("z").unwrap()[3]),
            (7.0, 8.0)
        );
        // The last row alone has no name and no x.
        assert_eq!(a.select(&[3]).without_empty_columns().columns().len(), 2);
        let mut empty = Frame::new();
        empty.append_all(&a.select(&[0, 1, 2]).without_empty_columns());
        assert_eq!(empty.columns().len(), columns);
    }
}
