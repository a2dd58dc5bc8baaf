//! A table that is written part by part, so that it may be larger than memory.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use super::parquet_table::{ParquetParts, ROWS_PER_GROUP};
use super::{Frame, csv_table, json_lines};
use crate::Error;
use crate::files::{self, Unfinished};

/// A table that is written part by part. Under its final name it is complete or not there; one that is dropped
/// unfinished leaves nothing behind.
///
/// The file is the same however the rows were cut into parts, and the same as [`Frame::write`] gives.
pub struct TableWriter {
    file: Unfinished,
    out: Out,
    /// Rows that wait until they fill a row group.
    waiting: Frame,
}

enum Out {
    /// Begun with the first rows: their columns are the table's.
    Parquet(Option<ParquetParts<BufWriter<File>>>),
    JsonLines(BufWriter<File>),
    Csv(BufWriter<File>, bool),
}

impl TableWriter {
    /// Begins a table: `.parquet`, `.csv` or `.jsonl`, by the path's extension.
    ///
    /// # Errors
    ///
    /// As [`Frame::write`].
    pub fn create(path: &Path) -> Result<Self, Error> {
        Frame::check_name(path)?;
        let file = Unfinished::create(path)?;
        let out = match files::extension(path).as_deref() {
            Some("parquet" | "pq") => Out::Parquet(None),
            Some("jsonl" | "ndjson") => Out::JsonLines(file.writer()?),
            _ => Out::Csv(file.writer()?, false),
        };
        Ok(Self {
            file,
            out,
            waiting: Frame::new(),
        })
    }

    /// Adds rows; all parts have the columns of the first.
    ///
    /// # Errors
    ///
    /// [`Error::File`] where the disk takes no more.
    pub fn append(&mut self, part: &Frame) -> Result<(), Error> {
        if self.waiting.columns().is_empty() {
            self.waiting = part.clone();
        } else {
            self.waiting.append(part);
        }
        while self.waiting.n_rows() >= ROWS_PER_GROUP {
            let all: Vec<usize> = (0..self.waiting.n_rows()).collect();
            let (full, rest) = all.split_at(ROWS_PER_GROUP);
            let full = self.waiting.select(full);
            self.waiting = self.waiting.select(rest);
            self.put(&full)?;
        }
        Ok(())
    }

    /// Writes what waits, syncs, and gives the file its name.
    ///
    /// # Errors
    ///
    /// As [`TableWriter::append`].
    pub fn finish(mut self) -> Result<(), Error> {
        let rest = std::mem::take(&mut self.waiting);
        self.put(&rest)?;
        let path = self.file.path().to_owned();
        let written = match self.out {
            Out::Parquet(parts) => parts.map_or(Ok(()), |parts| {
                parts
                    .into_inner()
                    .map_err(|e| e.to_string())
                    .and_then(|mut out| out.flush().map_err(|e| e.to_string()))
            }),
            Out::JsonLines(mut out) | Out::Csv(mut out, _) => out.flush().map_err(|e| e.to_string()),
        };
        written.map_err(|reason| Error::file(&path, reason))?;
        self.file.finish()
    }

    fn put(&mut self, frame: &Frame) -> Result<(), Error> {
        let written: Result<(), String> = match &mut self.out {
            Out::Parquet(parts) => {
                if parts.is_none() {
                    let begun = ParquetParts::new(self.file.writer()?, frame);
                    *parts = Some(begun.map_err(|e| Error::file(self.file.path(), e))?);
                }
                parts
                    .as_mut()
                    .map_or(Ok(()), |parts| parts.append(frame).map_err(|e| e.to_string()))
            }
            Out::JsonLines(out) => out
                .write_all(&json_lines::write(frame))
                .map_err(|e| e.to_string()),
            Out::Csv(out, has_header) => {
                let text = csv_table::write(frame)?;
                let skipped = if *has_header {
                    csv_table::header_length(frame)?
                } else {
                    0
                };
                *has_header = true;
                out.write_all(&text[skipped..]).map_err(|e| e.to_string())
            }
        };
        written.map_err(|reason| Error::file(self.file.path(), reason))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Column;

    fn rows(range: std::ops::Range<i64>) -> Frame {
        let mut frame = Frame::new();
        frame.metadata.insert("fingerprint".into(), "f".into());
        frame.push("n", Column::Integer(range.clone().collect()));
        frame.push(
            "x",
            Column::Number(range.clone().map(|i| i as f64 / 7.0).collect()),
        );
        frame.push(
            "t",
            Column::Text(range.map(|i| (i % 3 > 0).then(|| format!("a,{i}"))).collect()),
        );
        frame
    }

    #[test]
    fn a_table_in_parts_has_the_same_bytes_as_one_written_at_once() {
        let folder = tempfile::tempdir().unwrap();
        for extension in ["parquet", "csv", "jsonl"] {
            let (whole, parts) = (folder.path().join("whole"), folder.path().join("parts"));
            let (whole, parts) = (whole.with_extension(extension), parts.with_extension(extension));
            rows(0..25_000).write(&whole).unwrap();
            let mut writer = TableWriter::create(&parts).unwrap();
            for range in [0..1, 1..9_000, 9_000..9_000, 9_000..24_999, 24_999..25_000] {
                writer.append(&rows(range)).unwrap();
            }
            assert!(!parts.exists(), "not before it is finished");
            writer.finish().unwrap();
            assert!(
                files::read(&whole).unwrap() == files::read(&parts).unwrap(),
                "{extension}"
            );
        }
    }

    #[test]
    fn a_table_that_is_not_finished_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.parquet");
        let mut writer = TableWriter::create(&path).unwrap();
        writer.append(&rows(0..20_000)).unwrap();
        drop(writer);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        let mut empty = TableWriter::create(&path).unwrap();
        empty.append(&rows(0..0)).unwrap();
        empty.finish().unwrap();
        assert_eq!(Frame::read(&path).unwrap().n_rows(), 0);
    }
}
