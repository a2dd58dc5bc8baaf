//! What a command prints: JSON for programs, short text for people.

use std::io::Write;
use std::path::Path;

use anyhow::{Context, Result};
use rayon::prelude::*;
use serde_json::{Map, Value, json};

/// How a command ended when it did not stop with an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Everything asked for is done.
    Done,
    /// Some inputs failed; each said so in its place.
    SomeFailed,
}

/// The arguments fit together badly; ends with status 2.
#[derive(Debug)]
pub struct Usage(pub String);

impl std::fmt::Display for Usage {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Usage {}

/// Prints one JSON value as a line.
pub fn line(value: &Value) -> Result<()> {
    writeln!(std::io::stdout().lock(), "{value}")?;
    Ok(())
}

/// Prints JSON with `--json`, else what `text` makes of it.
pub fn answer(json: bool, value: &Value, text: impl FnOnce(&Value) -> String) -> Result<()> {
    if json {
        line(value)
    } else {
        writeln!(std::io::stdout().lock(), "{}", text(value).trim_end())?;
        Ok(())
    }
}

/// Runs a command over many inputs: one answer each, in order; an input that fails gives `{key, "error"}` in its place.
pub fn each<I>(
    json: bool,
    key: &str,
    inputs: impl IntoIterator<Item = (Value, I)>,
    mut run: impl FnMut(I) -> Result<Value>,
    text: impl Fn(&Value) -> String,
) -> Result<Outcome> {
    let mut outcome = Outcome::Done;
    for (name, input) in inputs {
        let mut object = Map::new();
        object.insert(key.to_owned(), name.clone());
        match run(input) {
            Ok(Value::Object(fields)) => object.extend(fields),
            Ok(other) => {
                object.insert("value".into(), other);
            }
            Err(error) => {
                outcome = Outcome::SomeFailed;
                object.insert("error".into(), json!(format!("{error:#}")));
                if !json {
                    eprintln!("error: {error:#}");
                    continue;
                }
            }
        }
        answer(json, &Value::Object(object), &text)?;
    }
    Ok(outcome)
}

/// Runs a command over the lines of a JSON-lines input (`-` is standard input): one answer each, with `line` counted
/// from 1; empty lines have no answer. Errors say file and line.
pub fn each_json_line(
    json: bool,
    path: &Path,
    mut run: impl FnMut(Value) -> Result<Value>,
    text: impl Fn(&Value) -> String,
) -> Result<Outcome> {
    let input = prehend::files::read_text(path)?;
    let lines = (1..).zip(input.lines()).filter(|(_, l)| !l.trim().is_empty());
    let run = |(number, line): (usize, &str)| {
        json_object(line)
            .and_then(&mut run)
            .with_context(|| format!("{}, line {number}", shown(path)))
    };
    each(json, "line", lines.map(|(i, l)| (json!(i), (i, l))), run, text)
}

/// [`each_json_line`] with lines answered side by side; answers still come in order.
pub fn each_json_line_in_parallel(
    json: bool,
    path: &Path,
    run: impl Fn(Value) -> Result<Value> + Sync,
    text: impl Fn(&Value) -> String,
) -> Result<Outcome> {
    let input = prehend::files::read_text(path)?;
    let lines: Vec<(usize, &str)> = (1..)
        .zip(input.lines())
        .filter(|(_, l)| !l.trim().is_empty())
        .collect();
    let mut outcome = Outcome::Done;
    for part in lines.chunks(LINES_AT_ONCE) {
        let answers: Vec<(Value, Result<Value>)> = part
            .par_iter()
            .map(|&(number, line)| {
                let answer = json_object(line).and_then(&run);
                (
                    json!(number),
                    answer.with_context(|| format!("{}, line {number}", shown(path))),
                )
            })
            .collect();
        if each(json, "line", answers, |answer| answer, &text)? == Outcome::SomeFailed {
            outcome = Outcome::SomeFailed;
        }
    }
    Ok(outcome)
}

/// Lines that are answered before the first of them is printed.
const LINES_AT_ONCE: usize = 64;

fn json_object(line: &str) -> Result<Value> {
    let value: Value = serde_json::from_str(line).map_err(|e| {
        // The parser sees one line alone, so its own line number would mislead.
        let said = e.to_string();
        let what = said
            .split_once(" at line ")
            .map_or(said.as_str(), |(what, _)| what);
        anyhow::anyhow!("column {}: {what}; expected one JSON object a line", e.column())
    })?;
    if !value.is_object() {
        anyhow::bail!("found {value}, expected a JSON object");
    }
    Ok(value)
}

/// A path as messages name it.
pub fn shown(path: &Path) -> String {
    if path == Path::new("-") {
        "standard input".to_owned()
    } else {
        path.display().to_string()
    }
}

/// `key: value` lines of a JSON object, arrays and objects compact: the plain form of an answer.
pub fn plain(value: &Value) -> String {
    let Value::Object(fields) = value else {
        return value.to_string();
    };
    let width = fields.keys().map(String::len).max().unwrap_or(0);
    let cell = |v: &Value| match v {
        Value::String(s) => s.clone(),
        other => other.to_string(),
    };
    fields
        .iter()
        .map(|(k, v)| format!("{k:width$}  {}\n", cell(v)))
        .collect()
}
