//! Hands: a folder with `hand.toml` and a URDF, or a URDF alone.

use std::path::{Path, PathBuf};

use prehend_hand::{Hand, urdf_named_in};

use crate::{Error, files};

/// Reads a hand from its folder, or a URDF file alone (then without palm, fingers and eigengrasps).
///
/// # Errors
///
/// [`Error::File`] that names the file and the element in it.
pub fn read_hand(path: &Path) -> Result<Hand, Error> {
    let description = path.join("hand.toml");
    let description = description.is_file().then_some(description);
    let urdf_path = match &description {
        _ if path.is_file() => path.to_owned(),
        Some(file) => match urdf_named_in(&files::read_text(file)?).map_err(|e| Error::file(file, e))? {
            Some(name) => path.join(name),
            None => urdf_of_folder(path)?,
        },
        None => urdf_of_folder(path)?,
    };
    let folder = urdf_path.parent().unwrap_or(Path::new(".")).to_owned();
    let resolve = |name: &str| {
        let file = resource(&folder, name);
        std::fs::read(&file).map_err(|e| format!("{}: {e}", file.display()))
    };
    let hand =
        Hand::from_urdf(&files::read_text(&urdf_path)?, &resolve).map_err(|e| Error::file(&urdf_path, e))?;
    match description {
        Some(file) => hand
            .with_description(&files::read_text(&file)?)
            .map_err(|e| Error::file(&file, e)),
        None => Ok(hand),
    }
}

/// A hand that can grasp: one with a description.
///
/// # Errors
///
/// As [`read_hand`], and where there is no `hand.toml`.
pub fn read_described_hand(path: &Path) -> Result<Hand, Error> {
    let hand = read_hand(path)?;
    if hand.description().is_none() {
        return Err(Error::file(
            path,
            "has no hand.toml, which says where the palm is and how the fingers close; give a folder under hands/ that has one",
        ));
    }
    Ok(hand)
}

/// The hand folders below `folder`, sorted: those that hold a `hand.toml`; or `folder` itself.
///
/// # Errors
///
/// [`Error::File`] where there is none.
pub fn hand_folders(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    if folder.join("hand.toml").is_file() {
        return Ok(vec![folder.to_owned()]);
    }
    let mut found: Vec<PathBuf> = files::list(folder, &["toml"])?
        .into_iter()
        .filter(|p| p.file_name().is_some_and(|n| n == "hand.toml"))
        .filter_map(|p| Some(p.parent()?.to_owned()))
        .collect();
    found.sort();
    if found.is_empty() {
        return Err(Error::file(
            folder,
            "holds no hand: no folder below it has a hand.toml",
        ));
    }
    Ok(found)
}

fn urdf_of_folder(folder: &Path) -> Result<PathBuf, Error> {
    let entries = std::fs::read_dir(folder).map_err(|e| files::unreadable(folder, &e))?;
    let mut urdfs: Vec<PathBuf> = entries
        .filter_map(|e| Some(e.ok()?.path()))
        .filter(|p| files::extension(p).as_deref() == Some("urdf"))
        .collect();
    urdfs.sort();
    match urdfs.len() {
        1 => Ok(urdfs.remove(0)),
        n => Err(Error::file(
            folder,
            format!("holds {n} .urdf files; expected exactly one"),
        )),
    }
}

/// Where a mesh named by a URDF lies: beside the URDF, or for `package://NAME/REST` in the nearest folder above that
/// is or holds `NAME`, else `REST` beside the URDF.
pub(crate) fn resource(folder: &Path, name: &str) -> PathBuf {
    let name = name.strip_prefix("file://").unwrap_or(name);
    let Some(rest) = name.strip_prefix("package://") else {
        return folder.join(name);
    };
    let (package, inner) = rest.split_once('/').unwrap_or((rest, ""));
    let absolute = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    for above in absolute.ancestors() {
        for candidate in [above.join(rest), above.join(inner)] {
            let named =
                candidate.starts_with(above.join(package)) || above.file_name().is_some_and(|n| n == package);
            if named && candidate.is_file() {
                return candidate;
            }
        }
    }
    folder.join(inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_package_is_looked_for_in_the_folders_above() {
        let root = tempfile::tempdir().unwrap();
        let root = root.path().canonicalize().unwrap();
        let urdf = root.join("my_hand/urdf");
        for folder in ["my_hand/urdf", "my_hand/meshes", "other/meshes"] {
            std::fs::create_dir_all(root.join(folder)).unwrap();
        }
        for file in [
            "my_hand/meshes/palm.stl",
            "other/meshes/tip.stl",
            "my_hand/urdf/near.stl",
        ] {
            std::fs::write(root.join(file), "").unwrap();
        }
        for (name, found) in [
            ("near.stl", "my_hand/urdf/near.stl"),
            ("package://my_hand/meshes/palm.stl", "my_hand/meshes/palm.stl"),
            ("package://other/meshes/tip.stl", "other/meshes/tip.stl"),
            // Nobody above is called so: the rest of the name, beside the URDF.
            ("package://elsewhere/near.stl", "my_hand/urdf/near.stl"),
        ] {
            assert_eq!(resource(&urdf, name), root.join(found), "{name}");
        }
        let absolute = root.join("other/meshes/tip.stl");
        assert_eq!(
            resource(&urdf, &format!("file://{}", absolute.display())),
            absolute
        );
    }

    #[test]
    fn a_folder_without_a_hand_or_with_two_urdfs_is_named() {
        let root = tempfile::tempdir().unwrap();
        let none = hand_folders(root.path()).unwrap_err().to_string();
        assert!(
            none.ends_with("holds no hand: no folder below it has a hand.toml"),
            "{none}"
        );
        for file in ["a.urdf", "b.urdf"] {
            std::fs::write(root.path().join(file), "").unwrap();
        }
        let two = read_hand(root.path()).err().unwrap().to_string();
        assert!(
            two.ends_with("holds 2 .urdf files; expected exactly one"),
            "{two}"
        );
    }
}
