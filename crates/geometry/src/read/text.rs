//! What the text formats share: lines with numbers, words with lines, numbers that must be finite.

use std::borrow::Cow;

use nalgebra::Point3;

use crate::GeometryError;

/// How much of an offending word or line an error quotes.
const QUOTE: usize = 40;

/// Bytes as text; names and comments in other encodings than UTF-8 must not keep a mesh from loading.
pub(super) fn decode(bytes: &[u8]) -> Cow<'_, str> {
    String::from_utf8_lossy(bytes)
}

/// Lines with their numbers from 1; each of `\n`, `\r\n` and `\r` ends one.
pub(super) fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut rest = Some(text);
    std::iter::from_fn(move || {
        let text = rest?;
        // No other character has these bytes in it.
        let Some(end) = text.bytes().position(|b| b == b'\n' || b == b'\r') else {
            rest = None;
            return (!text.is_empty()).then_some(text);
        };
        let after = &text[end..];
        rest = Some(after.strip_prefix("\r\n").unwrap_or(&after[1..]));
        Some(&text[..end])
    })
    .enumerate()
    .map(|(index, line)| (index + 1, line))
}

/// Lines without comments (from `#` on) and blank ones.
pub(super) fn records(text: &str) -> impl Iterator<Item = (usize, &str)> {
    lines(text)
        .map(|(number, line)| (number, line.split('#').next().unwrap_or("").trim()))
        .filter(|(_, line)| !line.is_empty())
}

/// Where a text reader stands, for its errors.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub format: &'static str,
    pub line: usize,
}

impl Place {
    /// The error at this place. `found` is quoted, and cut where it is long.
    pub fn error(self, found: &str, expected: impl Into<String>) -> GeometryError {
        error(
            self.format,
            format!("line {}", self.line),
            quoted(found),
            expected,
        )
    }

    /// A word, or an error where the line has no more.
    pub fn word<'a>(self, word: Option<&'a str>, expected: &str) -> Result<&'a str, GeometryError> {
        word.ok_or_else(|| {
            error(
                self.format,
                format!("line {}", self.line),
                "the end of the line".into(),
                expected,
            )
        })
    }

    /// A finite number.
    pub fn number(self, word: &str) -> Result<f64, GeometryError> {
        match word.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(self.error(word, "a finite number")),
        }
    }

    /// Three finite numbers, the next words.
    pub fn point<'a>(self, words: &mut impl Iterator<Item = &'a str>) -> Result<Point3<f64>, GeometryError> {
        let mut point = Point3::origin();
        for axis in 0..3 {
            point[axis] = self.number(self.word(words.next(), "three coordinates")?)?;
        }
        Ok(point)
    }

    /// A count or another whole number that is not negative.
    pub fn count(self, word: &str, expected: &str) -> Result<usize, GeometryError> {
        word.parse().map_err(|_| self.error(word, expected))
    }

    /// An index of one of `n_vertices` vertices, from 0.
    pub fn index(self, word: &str, n_vertices: usize) -> Result<u32, GeometryError> {
        match word.parse::<u32>() {
            Ok(index) if (index as usize) < n_vertices => Ok(index),
            _ => Err(self.error(word, index_range(n_vertices))),
        }
    }
}

/// What an error says in place of an index that is out of range.
pub(super) fn index_range(n_vertices: usize) -> String {
    match n_vertices {
        0 => "no index, since there are no vertices".into(),
        n => format!("a vertex index from 0 to {}", n - 1),
    }
}

/// The error of a file that ends too early.
pub(super) fn truncated(format: &'static str, found: String, expected: impl Into<String>) -> GeometryError {
    error(format, "end of file".into(), found, expected)
}

/// A parse error.
pub(super) fn error(
    format: &'static str,
    place: String,
    found: String,
    expected: impl Into<String>,
) -> GeometryError {
    GeometryError::Parse {
        format,
        place,
        found,
        expected: expected.into(),
    }
}

/// The text in backticks, without control characters, cut after [`QUOTE`] characters.
pub(super) fn quoted(text: &str) -> String {
    let clean = |c: char| if c.is_control() { '\u{fffd}' } else { c };
    let start: String = text.chars().take(QUOTE).map(clean).collect();
    let more = if text.chars().nth(QUOTE).is_some() {
        "…"
    } else {
        ""
    };
    format!("`{start}{more}`")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_line_end_counts_once() {
        let found: Vec<_> = lines("a\nb\r\nc\rd\n\ne").collect();
        assert_eq!(found, [(1, "a"), (2, "b"), (3, "c"), (4, "d"), (5, ""), (6, "e")]);
        assert_eq!(lines("").count(), 0);
        assert_eq!(lines("a\n").count(), 1);
    }

    #[test]
    fn records_have_no_comments() {
        assert_eq!(records("# x\n\n 1 2 # three\n").collect::<Vec<_>>(), [(3, "1 2")]);
    }

    #[test]
    fn long_and_unprintable_words_are_cut_in_messages() {
        assert_eq!(quoted("a\u{0}b"), "`a\u{fffd}b`");
        assert_eq!(quoted(&"x".repeat(50)), format!("`{}…`", "x".repeat(40)));
    }
}
