//! Flat Parquet tables, as pandas, polars and DuckDB write them with their defaults.

use std::collections::BTreeMap;
use std::io::Write;
use std::sync::Arc;

use parquet::basic::{Compression, ConvertedType, LogicalType, Repetition, Type as Physical, ZstdLevel};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnDescriptor, Type};

use super::{Column, Frame};
use crate::Error;

/// Rows in one row group: small enough that neither reader nor writer needs much memory.
pub(super) const ROWS_PER_GROUP: usize = 10_000;

pub(super) fn write(frame: &Frame) -> Result<Vec<u8>, Error> {
    let written = ParquetParts::new(Vec::new(), frame).and_then(|mut parts| {
        parts.append(frame)?;
        parts.into_inner()
    });
    written.map_err(|e| Error::input(format!("the table could not be written: {e}")))
}

/// A table that is written part by part; all parts have the columns of the first.
pub(super) struct ParquetParts<W: Write + Send> {
    writer: SerializedFileWriter<W>,
}

impl<W: Write + Send> ParquetParts<W> {
    /// Begins a table with the columns and metadata of `first`; its rows are yet to be appended.
    pub(super) fn new(out: W, first: &Frame) -> parquet::errors::Result<Self> {
        let fields = first.columns().iter().map(|(name, column)| {
            let (physical, logical, repetition) = match column {
                Column::Number(_) => (Physical::DOUBLE, None, Repetition::REQUIRED),
                Column::Integer(_) => (Physical::INT64, None, Repetition::REQUIRED),
                Column::Text(_) => (
                    Physical::BYTE_ARRAY,
                    Some(LogicalType::String),
                    Repetition::OPTIONAL,
                ),
            };
            Type::primitive_type_builder(name, physical)
                .with_repetition(repetition)
                .with_logical_type(logical)
                .build()
                .map(Arc::new)
        });
        let schema = Type::group_type_builder("schema")
            .with_fields(fields.collect::<Result<_, _>>()?)
            .build()?;
        let pairs = first
            .metadata
            .iter()
            .map(|(k, v)| KeyValue::new(k.clone(), v.clone()))
            .collect();
        let properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::try_new(3)?))
            .set_key_value_metadata(Some(pairs))
            .build();
        let writer = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties))?;
        Ok(Self { writer })
    }

    pub(super) fn append(&mut self, frame: &Frame) -> parquet::errors::Result<()> {
        let mut start = 0;
        while start < frame.n_rows() {
            let rows = start..(start + ROWS_PER_GROUP).min(frame.n_rows());
            let mut group = self.writer.next_row_group()?;
            for (_, column) in frame.columns() {
                let Some(mut out) = group.next_column()? else {
                    break;
                };
                match column {
                    Column::Number(v) => {
                        out.typed::<DoubleType>()
                            .write_batch(&v[rows.clone()], None, None)?
                    }
                    Column::Integer(v) => {
                        out.typed::<Int64Type>()
                            .write_batch(&v[rows.clone()], None, None)?
                    }
                    Column::Text(v) => {
                        let levels: Vec<i16> =
                            v[rows.clone()].iter().map(|t| i16::from(t.is_some())).collect();
                        let values: Vec<ByteArray> = v[rows.clone()]
                            .iter()
                            .flatten()
                            .map(|t| t.as_str().into())
                            .collect();
                        out.typed::<ByteArrayType>()
                            .write_batch(&values, Some(&levels), None)?
                    }
                };
                out.close()?;
            }
            group.close()?;
            start = rows.end;
        }
        Ok(())
    }

    pub(super) fn into_inner(self) -> parquet::errors::Result<W> {
        self.writer.into_inner()
    }
}

pub(super) fn read_metadata(bytes: Vec<u8>) -> Result<BTreeMap<String, String>, Error> {
    let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).map_err(Error::input)?;
    Ok(metadata(&reader))
}

fn metadata(reader: &SerializedFileReader<bytes::Bytes>) -> BTreeMap<String, String> {
    let pairs = reader.metadata().file_metadata().key_value_metadata();
    pairs
        .into_iter()
        .flatten()
        .filter_map(|p| Some((p.key.clone(), p.value.clone()?)))
        .collect()
}

pub(super) fn read(bytes: Vec<u8>) -> Result<Frame, Error> {
    read_table(bytes).map_err(|e| Error::input(format!("{e}; expected a Parquet file")))
}

fn read_table(bytes: Vec<u8>) -> parquet::errors::Result<Frame> {
    let reader = SerializedFileReader::new(bytes::Bytes::from(bytes))?;
    let schema = reader.metadata().file_metadata().schema_descr_ptr();
    let mut columns: Vec<Option<Column>> = vec![None; schema.num_columns()];
    for group_idx in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group_idx)?;
        let n_rows = group.metadata().num_rows().max(0) as usize;
        for (idx, column) in columns.iter_mut().enumerate() {
            let descriptor = schema.column(idx);
            // Lists and structs are not of a grasp table; they are passed over.
            if descriptor.max_rep_level() > 0 || descriptor.path().parts().len() != 1 {
                continue;
            }
            let Some(part) = read_column(group.get_column_reader(idx)?, &descriptor, n_rows)? else {
                continue;
            };
            match column {
                Some(whole) => whole.append(&part),
                None => *column = Some(part),
            }
        }
    }
    let mut frame = Frame {
        metadata: metadata(&reader),
        ..Frame::new()
    };
    for (idx, column) in columns.into_iter().enumerate() {
        let descriptor = schema.column(idx);
        let empty = || empty_column(&descriptor);
        if let Some(column) = column.or_else(|| (reader.num_row_groups() == 0).then(empty)) {
            frame.push(descriptor.name(), column);
        }
    }
    Ok(frame)
}

fn empty_column(descriptor: &ColumnDescriptor) -> Column {
    match descriptor.physical_type() {
        Physical::BYTE_ARRAY => Column::Text(Vec::new()),
        Physical::INT64 => Column::Integer(Vec::new()),
        _ => Column::Number(Vec::new()),
    }
}

fn read_column(
    reader: ColumnReader,
    descriptor: &ColumnDescriptor,
    n_rows: usize,
) -> parquet::errors::Result<Option<Column>> {
    let unsigned = matches!(
        descriptor.converted_type(),
        ConvertedType::UINT_32 | ConvertedType::UINT_64
    );
    let numbers =
        |v: Vec<Option<f64>>| Column::Number(v.into_iter().map(|x| x.unwrap_or(f64::NAN)).collect());
    let integers = |v: Vec<Option<i64>>| match v.iter().copied().collect::<Option<Vec<_>>>() {
        Some(whole) => Column::Integer(whole),
        None => Column::Number(v.into_iter().map(|x| x.map_or(f64::NAN, |x| x as f64)).collect()),
    };
    Ok(Some(match reader {
        ColumnReader::DoubleColumnReader(r) => numbers(cells(r, descriptor, n_rows, |x| *x)?),
        ColumnReader::FloatColumnReader(r) => numbers(cells(r, descriptor, n_rows, |x| f64::from(*x))?),
        ColumnReader::Int32ColumnReader(r) if unsigned => {
            integers(cells(r, descriptor, n_rows, |x| i64::from(x.cast_unsigned()))?)
        }
        ColumnReader::Int32ColumnReader(r) => integers(cells(r, descriptor, n_rows, |x| i64::from(*x))?),
        ColumnReader::Int64ColumnReader(r) => integers(cells(r, descriptor, n_rows, |x| *x)?),
        ColumnReader::BoolColumnReader(r) => integers(cells(r, descriptor, n_rows, |x| i64::from(*x))?),
        ColumnReader::ByteArrayColumnReader(r) => Column::Text(cells(r, descriptor, n_rows, |x| {
            String::from_utf8_lossy(x.data()).into_owned()
        })?),
        ColumnReader::Int96ColumnReader(_) | ColumnReader::FixedLenByteArrayColumnReader(_) => {
            return Ok(None);
        }
    }))
}

/// Every row's cell, `None` where the definition level says that it is null.
fn cells<T: DataType, V>(
    mut reader: ColumnReaderImpl<T>,
    descriptor: &ColumnDescriptor,
    n_rows: usize,
    value: impl Fn(&T::T) -> V,
) -> parquet::errors::Result<Vec<Option<V>>> {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    let mut read = 0;
    while read < n_rows {
        let (records, _, _) = reader.read_records(n_rows - read, Some(&mut levels), None, &mut values)?;
        if records == 0 {
            break;
        }
        read += records;
    }
    if descriptor.max_def_level() == 0 {
        return Ok(values.iter().map(|v| Some(value(v))).collect());
    }
    let mut values = values.iter();
    let present = |level: &i16| *level == descriptor.max_def_level();
    Ok(levels
        .iter()
        .map(|level| {
            if present(level) {
                values.next().map(&value)
            } else {
                None
            }
        })
        .collect())
}
