//! Reading a URDF's XML, with errors that name the element.

use urdf_rs::Robot;

use crate::HandError;

/// Nesting that no URDF comes near; deeper text would exhaust the reader's stack.
const MAX_DEPTH: usize = 64;

/// Parses the text. Where that fails, finds the first element that cannot be read and names it.
pub(crate) fn read(urdf: &str) -> Result<Robot, HandError> {
    let tags = tags(urdf)?;
    check_nesting(&tags)?;
    match urdf_rs::read_from_string(urdf) {
        Ok(robot) if tags.iter().any(|tag| tag.is("<robot")) => Ok(robot),
        Ok(_) => Err(HandError::Urdf {
            place: "document".into(),
            reason: "the outermost element is not <robot>; expected a URDF".into(),
        }),
        Err(error) => Err(locate(urdf, &tags).unwrap_or_else(|| HandError::Urdf {
            place: "document".into(),
            reason: format!("{error}; check that the file is complete and well-formed XML"),
        })),
    }
}

/// A tag, from `<` to `>`, and where it stands.
struct Tag<'a> {
    text: &'a str,
    start: usize,
    line: usize,
}

impl Tag<'_> {
    fn end(&self) -> usize {
        self.start + self.text.len()
    }

    /// Whether the tag begins so and its name ends there.
    fn is(&self, open: &str) -> bool {
        let rest = self.text.strip_prefix(open);
        rest.is_some_and(|rest| rest.starts_with([' ', '\t', '\r', '\n', '>', '/']))
    }

    fn closes_itself(&self) -> bool {
        self.text.ends_with("/>")
    }
}

/// All tags outside comments. Quoted text inside a tag may hold `<` and `>`.
fn tags(urdf: &str) -> Result<Vec<Tag<'_>>, HandError> {
    let mut found = Vec::new();
    let (mut at, mut line) = (0, 1);
    while let Some(offset) = urdf[at..].find('<') {
        let start = at + offset;
        line += urdf[at..start].matches('\n').count();
        let rest = &urdf[start..];
        let comment = rest.starts_with("<!--");
        let length = if comment {
            rest.find("-->").map(|end| end + 3)
        } else {
            tag_length(rest)
        };
        let Some(length) = length else {
            let what = if comment { "a comment" } else { "a tag" };
            return Err(HandError::Urdf {
                place: format!("line {line}"),
                reason: format!("{what} is not closed; check that the file is complete"),
            });
        };
        if !comment {
            found.push(Tag {
                text: &rest[..length],
                start,
                line,
            });
        }
        line += rest[..length].matches('\n').count();
        at = start + length;
    }
    Ok(found)
}

/// Length up to and with the first `>` that is not quoted.
fn tag_length(rest: &str) -> Option<usize> {
    let mut quote = None;
    for (idx, byte) in rest.bytes().enumerate() {
        match (quote, byte) {
            (None, b'>') => return Some(idx + 1),
            (None, b'"' | b'\'') => quote = Some(byte),
            (Some(open), _) if open == byte => quote = None,
            _ => {}
        }
    }
    None
}

/// Reads every `<link>` and `<joint>` alone, and names the first that fails.
fn locate(urdf: &str, tags: &[Tag<'_>]) -> Option<HandError> {
    let mut done = 0;
    for tag in tags.iter().filter(|tag| tag.is("<link") || tag.is("<joint")) {
        if tag.start < done {
            continue;
        }
        let (what, close) = if tag.is("<link") {
            ("link", "</link>")
        } else {
            ("joint", "</joint>")
        };
        let end = if tag.closes_itself() {
            Some(tag.end())
        } else {
            urdf[tag.start..]
                .find(close)
                .map(|end| tag.start + end + close.len())
        };
        let reason = match end {
            Some(end) => {
                let alone = format!("<robot name=\"part\">{}</robot>", &urdf[tag.start..end]);
                let error = urdf_rs::read_from_string(&alone).err();
                error.map(|error| error.to_string().trim_start_matches("custom: ").to_owned())
            }
            None => Some("the element is not closed; check that the file is complete".to_owned()),
        };
        if let Some(reason) = reason {
            let name = tag.text.split_once("name=").and_then(|(_, rest)| {
                let quote = rest.chars().next().filter(|c| *c == '"' || *c == '\'')?;
                rest[1..].split(quote).next()
            });
            let place = format!("{what} `{}` (line {})", name.unwrap_or("?"), tag.line);
            return Some(HandError::Urdf { place, reason });
        }
        done = end.unwrap_or(urdf.len());
    }
    None
}

/// Refuses text that nests deeper than [`MAX_DEPTH`].
fn check_nesting(tags: &[Tag<'_>]) -> Result<(), HandError> {
    let mut depth = 0_usize;
    for tag in tags {
        if tag.text.starts_with("</") {
            depth = depth.saturating_sub(1);
        } else if !tag.closes_itself() && !tag.text.starts_with("<!") && !tag.text.starts_with("<?") {
            depth += 1;
        }
        if depth > MAX_DEPTH {
            return Err(HandError::Urdf {
                place: format!("line {}", tag.line),
                reason: format!("elements nest deeper than {MAX_DEPTH}; expected a URDF"),
            });
        }
    }
    Ok(())
}
