//! One JSON object a line, all with the same keys.

use serde_json::{Map, Value, json};

use super::{Column, Frame};
use crate::Error;

pub(super) fn read(bytes: &[u8]) -> Result<Frame, Error> {
    let mut names: Vec<String> = Vec::new();
    let mut rows: Vec<Map<String, Value>> = Vec::new();
    for (line, text) in bytes.split(|&b| b == b'\n').enumerate() {
        if text.iter().all(u8::is_ascii_whitespace) {
            continue;
        }
        let row: Map<String, Value> = serde_json::from_slice(text)
            .map_err(|e| Error::input(format!("line {}: {e}; expected one JSON object a line", line + 1)))?;
        for name in row.keys() {
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
        rows.push(row);
    }
    let mut frame = Frame::new();
    for name in names {
        let cells: Vec<&Value> = rows
            .iter()
            .map(|r| r.get(&name).unwrap_or(&Value::Null))
            .collect();
        let column = if let Some(v) = cells.iter().map(|c| c.as_i64()).collect::<Option<Vec<_>>>() {
            Column::Integer(v)
        } else if cells.iter().all(|c| c.is_number() || c.is_null()) {
            Column::Number(cells.iter().map(|c| c.as_f64().unwrap_or(f64::NAN)).collect())
        } else {
            let text = |c: &&Value| match c {
                Value::Null => None,
                Value::String(s) => Some(s.clone()),
                other => Some(other.to_string()),
            };
            Column::Text(cells.iter().map(text).collect())
        };
        frame.push(name, column);
    }
    Ok(frame)
}

pub(super) fn write(frame: &Frame) -> Vec<u8> {
    let mut out = Vec::new();
    for row in 0..frame.n_rows() {
        out.extend(row_as_json(frame, row).to_string().into_bytes());
        out.push(b'\n');
    }
    out
}

fn row_as_json(frame: &Frame, row: usize) -> Value {
    let cell = |c: &Column| match c {
        Column::Number(v) => json!(v[row]),
        Column::Integer(v) => json!(v[row]),
        Column::Text(v) => json!(v[row]),
    };
    Value::Object(
        frame
            .columns()
            .iter()
            .map(|(n, c)| (n.clone(), cell(c)))
            .collect(),
    )
}
