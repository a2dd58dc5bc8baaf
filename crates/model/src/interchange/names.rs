//! Names that another format can hold.

use std::collections::BTreeSet;

use crate::error::ModelError;

/// Replaces every character that `allowed` refuses by `_`, and says so; two names that become one are an error.
pub(super) fn legal_names<'a>(
    format: &str,
    what: &str,
    names: impl Iterator<Item = &'a str>,
    allowed: impl Fn(char) -> bool,
    losses: &mut Vec<String>,
) -> Result<Vec<String>, ModelError> {
    let mut seen = BTreeSet::new();
    let mut out = Vec::new();
    for name in names {
        let mut legal: String = name.chars().map(|c| if allowed(c) { c } else { '_' }).collect();
        if !legal.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
            legal.insert(0, '_');
        }
        if legal != name {
            losses.push(format!("{what} `{name}` is called `{legal}`"));
        }
        if !seen.insert(legal.clone()) {
            return Err(ModelError::Export {
                format: format.into(),
                problem: format!("{what} `{name}` becomes `{legal}`, as another one does; rename one"),
            });
        }
        out.push(legal);
    }
    Ok(out)
}
