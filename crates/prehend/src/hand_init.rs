//! A hand folder from a URDF alone.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

use prehend_hand::{Hand, Proposal, urdf_below};

use crate::hand_folder::{read_hand, resource};
use crate::{Error, files};

/// A folder that was written.
#[derive(Debug, Clone)]
pub struct HandFolder {
    /// The hand, with the description that was written.
    pub hand: Hand,
    /// What was guessed.
    pub proposal: Proposal,
    /// Every file written, relative to the folder.
    pub files: Vec<String>,
    /// What a user should know beside the guesses.
    pub notes: Vec<String>,
}

/// Writes a folder with a commented `hand.toml` that [`Hand::propose_description`] worked out, and beside it the URDF
/// with all meshes that it names, so that the folder can be moved. Where the URDF stands in that folder already, it and
/// its meshes stay as they are.
///
/// Meshes go under `meshes/`, in the folders in which they stood, and the URDF's copy names them there. A URDF without
/// any `<collision>` gets its `<visual>` shapes as such. The hand is what hangs on the link `root`; where none is given
/// and an arm is below the palm, the hand without the arm ([`Hand::base_of_hand`]).
///
/// # Errors
///
/// What [`urdf_below`], [`Hand::from_urdf`] and [`Hand::propose_description`] say, with the file; a folder that has a `hand.toml`
/// already, unless `force` is set; a file that cannot be written.
pub fn init(urdf: &Path, out: &Path, root: Option<&str>, force: bool) -> Result<HandFolder, Error> {
    let toml_path = out.join("hand.toml");
    if toml_path.exists() && !force {
        return Err(Error::file(
            &toml_path,
            "is there already; give another --out, or --force to write a new one",
        ));
    }
    let mut notes = Vec::new();
    let mut text = files::read_text(urdf)?;
    let below = |text: &str, link: &str| urdf_below(text, link).map_err(|e| Error::file(urdf, e));
    if let Some(link) = root {
        text = below(&text, link)?;
    }
    if !has_element(&text, "collision") && has_element(&text, "visual") {
        text = with_visuals_as_collisions(&text);
        notes.push(
            "no link has a <collision>: the copy of the URDF takes the <visual> shapes as such".to_owned(),
        );
    }
    let folder = urdf.parent().unwrap_or(Path::new("."));
    let read: RefCell<BTreeMap<String, (PathBuf, Vec<u8>)>> = RefCell::default();
    let resolve = |name: &str| {
        let file = resource(folder, name);
        let bytes = std::fs::read(&file).map_err(|e| format!("{}: {e}", file.display()))?;
        let file = file.canonicalize().unwrap_or(file);
        read.borrow_mut().insert(name.to_owned(), (file, bytes.clone()));
        Ok(bytes)
    };
    let mut hand = Hand::from_urdf(&text, &resolve).map_err(|e| Error::file(urdf, e))?;
    let base = match root {
        Some(_) => hand.root(),
        None => hand.base_of_hand().map_err(|e| Error::file(urdf, e))?,
    };
    let is_part = root.is_some() || base != hand.root();
    if base != hand.root() {
        let (link, n_joints) = (hand.link(base).name.clone(), hand.joints_to(base).len());
        text = below(&text, &link)?;
        read.borrow_mut().clear();
        hand = Hand::from_urdf(&text, &resolve).map_err(|e| Error::file(urdf, e))?;
        notes.push(format!(
            "the arm ({n_joints} joints) is left out: the hand begins at link `{link}`; to begin elsewhere, give --root LINK"
        ));
    }
    notes.extend(hand.warnings().iter().cloned());
    let proposal = hand.propose_description().map_err(|e| Error::file(urdf, e))?;

    let urdf_name = urdf
        .file_name()
        .ok_or_else(|| Error::file(urdf, "is no file name; give a .urdf"))?;
    let urdf_name = Path::new(urdf_name).with_extension("urdf");
    let urdf_name = urdf_name.to_string_lossy();
    let mut written = Vec::new();
    let in_place = match (urdf.canonicalize(), out.join(&*urdf_name).canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    };
    if in_place {
        if is_part {
            return Err(Error::file(
                urdf,
                "has more than the hand and stands in the folder to be written; give another --out for a copy of the hand alone",
            ));
        }
        if !has_element(&files::read_text(urdf)?, "collision") {
            return Err(Error::file(
                urdf,
                "has no <collision> shapes and stands in the folder to be written; give another --out for a copy that has some",
            ));
        }
        notes.push("the URDF stands in this folder already: it and its meshes stay as they are".to_owned());
    } else {
        let read = read.into_inner();
        let places = places(read.values().map(|(file, _)| file.as_path()));
        for (name, (file, bytes)) in &read {
            let place = &places[file];
            if !written.contains(place) {
                files::write(&out.join(place), bytes)?;
                written.push(place.clone());
                written.extend(copy_materials(file, bytes, &out.join(place), place)?);
            }
            text = renamed(&text, name, place);
        }
        files::write(&out.join(&*urdf_name), text.as_bytes())?;
        written.push(urdf_name.clone().into_owned());
    }
    // Last, so that a folder with a hand.toml is whole.
    let toml = proposal.hand_toml(&hand, &urdf_name);
    let hand = hand
        .with_description(&toml)
        .map_err(|e| Error::file(&toml_path, e))?;
    files::write(&toml_path, toml.as_bytes())?;
    written.push("hand.toml".to_owned());
    written.sort();
    written.dedup();
    // What was written must read as what was read.
    read_hand(out)?;
    Ok(HandFolder {
        hand,
        proposal,
        files: written,
        notes,
    })
}

/// Where each mesh goes: under `meshes/`, with the folders below the one that all share.
fn places<'a>(sources: impl Iterator<Item = &'a Path>) -> BTreeMap<PathBuf, String> {
    let sources: BTreeSet<&Path> = sources.collect();
    let mut shared: Option<PathBuf> = None;
    for source in &sources {
        let folder = source.parent().unwrap_or(Path::new(""));
        shared = Some(match shared {
            None => folder.to_owned(),
            Some(above) => above
                .components()
                .zip(folder.components())
                .take_while(|(a, b)| a == b)
                .map(|(a, _)| a)
                .collect(),
        });
    }
    let shared = shared.unwrap_or_default();
    sources
        .into_iter()
        .map(|source| {
            let below = source.strip_prefix(&shared).unwrap_or(source);
            let parts: Vec<String> = below
                .components()
                .filter_map(|c| match c {
                    Component::Normal(part) => Some(part.to_string_lossy().into_owned()),
                    _ => None,
                })
                .collect();
            (source.to_owned(), format!("meshes/{}", parts.join("/")))
        })
        .collect()
}

/// Copies the material files that an OBJ names, where they stand beside it; other programs look for them.
fn copy_materials(source: &Path, bytes: &[u8], copy: &Path, place: &str) -> Result<Vec<String>, Error> {
    let mut copied = Vec::new();
    if files::extension(source).as_deref() != Some("obj") {
        return Ok(copied);
    }
    for line in bytes.split(|b| *b == b'\n') {
        let Some(name) = std::str::from_utf8(line)
            .ok()
            .and_then(|l| l.strip_prefix("mtllib "))
        else {
            continue;
        };
        let name = name.trim();
        let plain = !name.is_empty()
            && Path::new(name)
                .components()
                .all(|c| matches!(c, Component::Normal(_)));
        let Ok(bytes) = std::fs::read(source.with_file_name(name)) else {
            continue;
        };
        if plain {
            files::write(&copy.with_file_name(name), &bytes)?;
            let folder = place.rsplit_once('/').map_or("", |(folder, _)| folder);
            copied.push(format!("{folder}/{name}"));
        }
    }
    Ok(copied)
}

/// The URDF with one mesh's name replaced wherever it stands in quotes.
fn renamed(urdf: &str, name: &str, place: &str) -> String {
    let escape = |text: &str| {
        text.replace('&', "&amp;")
            .replace('<', "&lt;")
            .replace('"', "&quot;")
            .replace('\'', "&apos;")
    };
    let new = escape(place);
    let mut urdf = urdf.to_owned();
    for old in BTreeSet::from([name.to_owned(), escape(name), name.replace('&', "&amp;")]) {
        for quote in ['"', '\''] {
            urdf = urdf.replace(&format!("{quote}{old}{quote}"), &format!("{quote}{new}{quote}"));
        }
    }
    urdf
}

fn has_element(urdf: &str, name: &str) -> bool {
    urdf.match_indices(&format!("<{name}"))
        .any(|(at, found)| starts_tag(&urdf[at + found.len()..]))
}

/// Whether an element's name ends here.
fn starts_tag(rest: &str) -> bool {
    rest.starts_with(|c: char| c.is_whitespace() || c == '>' || c == '/')
}

/// Every `<visual>` once more as a `<collision>`.
fn with_visuals_as_collisions(urdf: &str) -> String {
    let mut out = String::with_capacity(2 * urdf.len());
    let mut rest = urdf;
    while let Some(start) = rest.find("<visual") {
        let after = &rest[start + "<visual".len()..];
        let closes_at_once = after.find('>').is_some_and(|end| after[..end].ends_with('/'));
        let end = if starts_tag(after) && !closes_at_once {
            after.find("</visual>")
        } else {
            None
        };
        let (copied, inside) = match end {
            Some(end) => (start + "<visual".len() + end + "</visual>".len(), &after[..end]),
            None => (start + "<visual".len(), ""),
        };
        out += &rest[..copied];
        if !inside.is_empty() {
            out += &format!("\n    <collision{inside}</collision>");
        }
        rest = &rest[copied..];
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meshes_keep_the_folders_below_the_one_they_share() {
        let found = places(
            [
                "/a/hand/meshes/visual/tip.obj",
                "/a/hand/meshes/collision/tip.obj",
            ]
            .map(Path::new)
            .into_iter(),
        );
        let found: Vec<&str> = found.values().map(String::as_str).collect();
        assert_eq!(found, ["meshes/collision/tip.obj", "meshes/visual/tip.obj"]);
        let one = places([Path::new("/a/tip.stl")].into_iter());
        assert_eq!(one.values().next().unwrap(), "meshes/tip.stl");
    }

    #[test]
    fn a_mesh_is_renamed_in_either_kind_of_quotes_and_escaped() {
        let urdf = "<mesh filename=\"package://r/a&amp;b.stl\"/><mesh filename='package://r/a&amp;b.stl'/><mesh filename=\"package://r/a&amp;b.stl.dae\"/>";
        assert_eq!(
            renamed(urdf, "package://r/a&b.stl", "meshes/a&b.stl"),
            "<mesh filename=\"meshes/a&amp;b.stl\"/><mesh filename='meshes/a&amp;b.stl'/><mesh filename=\"package://r/a&amp;b.stl.dae\"/>"
        );
    }

    #[test]
    fn pictures_become_shapes_where_there_are_no_others() {
        let urdf = "<link><visual><geometry/></visual></link><visuals/><link><visual/><visual name=\"b\">x</visual></link>";
        assert!(!has_element(urdf, "collision") && has_element(urdf, "visual"));
        assert_eq!(
            with_visuals_as_collisions(urdf),
            "<link><visual><geometry/></visual>\n    <collision><geometry/></collision></link><visuals/><link>\
             <visual/><visual name=\"b\">x</visual>\n    <collision name=\"b\">x</collision></link>"
        );
    }
}
