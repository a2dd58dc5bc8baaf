//! CSV with a header row; an empty cell is missing.

use super::{Column, Frame};
use crate::Error;

pub(super) fn read(bytes: &[u8]) -> Result<Frame, Error> {
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::Headers)
        .from_reader(bytes);
    let headers = reader.headers().map_err(Error::input)?.clone();
    let mut cells: Vec<Vec<Option<String>>> = vec![Vec::new(); headers.len()];
    for record in reader.records() {
        let record =
            record.map_err(|e| Error::input(format!("{e}; every line needs {} cells", headers.len())))?;
        for (column, cell) in cells.iter_mut().zip(record.iter()) {
            column.push((!cell.is_empty()).then(|| cell.to_owned()));
        }
    }
    let mut frame = Frame::new();
    for (name, column) in headers.iter().zip(cells) {
        frame.push(name, typed(column));
    }
    Ok(frame)
}

/// Numbers where every cell that is there is one, text otherwise.
fn typed(cells: Vec<Option<String>>) -> Column {
    if !cells.is_empty()
        && let Some(v) = cells
            .iter()
            .map(|c| c.as_deref()?.trim().parse().ok())
            .collect::<Option<Vec<i64>>>()
    {
        return Column::Integer(v);
    }
    let number = |c: &Option<String>| c.as_deref().map_or(Some(f64::NAN), |t| t.trim().parse().ok());
    match cells.iter().map(number).collect::<Option<Vec<f64>>>() {
        Some(v) if cells.iter().any(Option::is_some) => Column::Number(v),
        _ => Column::Text(cells),
    }
}

/// How many bytes of [`write`] are the header row.
pub(super) fn header_length(frame: &Frame) -> Result<usize, Error> {
    Ok(write(&frame.select(&[]))?.len())
}

pub(super) fn write(frame: &Frame) -> Result<Vec<u8>, Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer
        .write_record(frame.columns().iter().map(|(n, _)| n))
        .map_err(Error::input)?;
    for row in 0..frame.n_rows() {
        let cells = frame
            .columns()
            .iter()
            .map(|(_, c)| c.text_at(row).unwrap_or_default());
        writer.write_record(cells).map_err(Error::input)?;
    }
    writer.into_inner().map_err(Error::input)
}
