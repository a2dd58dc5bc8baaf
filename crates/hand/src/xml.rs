//! Reading a URDF's XML, with errors that name the element.

use urdf_rs::Robot;

use crate::HandError;

/// Nesting that no URDF comes near; deeper text would exhaust the reader's stack.
const MAX_DEPTH: usize = 64;

/// Parses the text. Where that fails, finds the first element that cannot be read and names it.
pub(crate) fn read(urdf: &str) -> Result<Robot, HandError> {
    check_nesting(urdf)?;
    match urdf_rs::read_from_string(urdf) {
        Ok(robot) if urdf.contains("<robot") => Ok(robot),
        Ok(_) => Err(HandError::Urdf {
            place: "document".into(),
            reason: "the outermost element is not <robot>; expected a URDF".into(),
        }),
        Err(error) => Err(locate(urdf).unwrap_or_else(|| HandError::Urdf {
            place: "document".into(),
            reason: format!("{error}; check that the file is complete and well-formed XML"),
        })),
    }
}

/// Reads every `<link>` and `<joint>` alone, and names the first that fails.
fn locate(urdf: &str) -> Option<HandError> {
    for element in elements(urdf) {
        let text = &urdf[element.start..element.end];
        let reason = if element.closed {
            let alone = urdf_rs::read_from_string(&format!("<robot name=\"part\">{text}</robot>"));
            alone
                .err()
                .map(|error| error.to_string().trim_start_matches("custom: ").to_owned())
        } else {
            Some("the element is not closed; check that the file is complete".to_owned())
        };
        if let Some(reason) = reason {
            let name = text.split_once("name=").and_then(|(_, rest)| {
                let quote = rest.chars().next().filter(|c| *c == '"' || *c == '\'')?;
                rest[1..].split(quote).next()
            });
            let line = urdf[..element.start].matches('\n').count() + 1;
            let place = format!("{} `{}` (line {line})", element.what, name.unwrap_or("?"));
            return Some(HandError::Urdf { place, reason });
        }
    }
    None
}

/// A link or a joint in the text: bytes `start..end`.
struct Element {
    what: &'static str,
    start: usize,
    end: usize,
    closed: bool,
}

/// Where tags begin, comments left out.
fn tags(urdf: &str) -> impl Iterator<Item = usize> + '_ {
    let mut at = 0;
    std::iter::from_fn(move || {
        loop {
            let start = at + urdf[at..].find('<')?;
            let comment = urdf[start..].starts_with("<!--");
            at = if comment {
                start + urdf[start..].find("-->")?
            } else {
                start + 1
            };
            if !comment {
                return Some(start);
            }
        }
    })
}

/// The outermost links and joints.
fn elements(urdf: &str) -> Vec<Element> {
    let mut found: Vec<Element> = Vec::new();
    for start in tags(urdf) {
        let rest = &urdf[start..];
        if found.last().is_some_and(|last| start < last.end) {
            continue;
        }
        for (what, open, close) in [("link", "<link", "</link>"), ("joint", "<joint", "</joint>")] {
            let named = rest
                .strip_prefix(open)
                .is_some_and(|r| r.starts_with([' ', '\t', '\r', '\n', '>', '/']));
            if !named {
                continue;
            }
            let end = match rest.find('>') {
                Some(tag_end) if rest[..tag_end].ends_with('/') => Some(tag_end + 1),
                _ => rest.find(close).map(|end| end + close.len()),
            };
            let closed = end.is_some();
            found.push(Element {
                what,
                start,
                end: start + end.unwrap_or(rest.len()),
                closed,
            });
        }
    }
    found
}

/// Refuses text that nests deeper than [`MAX_DEPTH`].
fn check_nesting(urdf: &str) -> Result<(), HandError> {
    let mut depth = 0_usize;
    for start in tags(urdf) {
        let rest = &urdf[start..];
        if rest.starts_with("</") {
            depth = depth.saturating_sub(1);
        } else if !rest.starts_with("<!") && !rest.starts_with("<?") {
            let tag = rest.split('>').next().unwrap_or(rest);
            depth += usize::from(!tag.ends_with('/'));
        }
        if depth > MAX_DEPTH {
            let line = urdf[..start].matches('\n').count() + 1;
            return Err(HandError::Urdf {
                place: format!("line {line}"),
                reason: format!("elements nest deeper than {MAX_DEPTH}; expected a URDF"),
            });
        }
    }
    Ok(())
}
