//! The bundled objects: parametric drawings of the paper's six types, written again by `cargo xtask objects`.
//!
//! A drawing is woven from rings of vertices ([`shell`]): vessels are turned on a [`lathe`], tools are sections carried
//! along a path ([`sweep`]), and where a handle meets a body the body leaves a [`shell::Hole`] whose edge is the
//! handle's first ring. So every surface is closed, manifold and outward by construction, and nothing has to be
//! united or simplified afterwards; `checks.rs` measures that, and the thickness of the walls, for each model.

mod bottle;
#[cfg(test)]
mod checks;
mod curve;
mod ear;
mod glass;
mod hammer;
mod knife;
mod lathe;
mod mass;
mod model;
mod mug;
mod screwdriver;
mod shell;
mod sweep;
mod vessel;
mod write;

use anyhow::{Context, Result, bail};
use model::{Drawing, Model};
use std::fs;
use std::path::Path;

/// Every bundled object, type by type.
pub fn all() -> Vec<Model> {
    [
        bottle::all(),
        glass::all(),
        mug::all(),
        knife::all(),
        hammer::all(),
        screwdriver::all(),
    ]
    .into_iter()
    .flatten()
    .map(Drawing::finish)
    .collect()
}

/// Files of all objects: path below `objects/` and content.
pub fn files() -> Result<Vec<(String, Vec<u8>)>> {
    let mut files = Vec::new();
    for model in all() {
        let stem = format!("{}/{}", model.kind, model.name);
        files.push((format!("{stem}.ply"), write::ply(&model)?));
        files.push((format!("{stem}.toml"), write::toml(&model).into_bytes()));
    }
    Ok(files)
}

/// `cargo xtask objects`: writes all files, or with `check` only says which differ.
pub fn run(root: &Path, check: bool) -> Result<()> {
    if check {
        let findings = differences(root)?;
        for finding in &findings {
            eprintln!("{finding}");
        }
        if !findings.is_empty() {
            bail!(
                "{} of the bundled objects' files are not what the generator makes",
                findings.len()
            );
        }
        println!("objects/ is what the generator makes");
        return Ok(());
    }
    for (name, bytes) in files()? {
        let path = root.join("objects").join(&name);
        let folder = path.parent().context("an object's file has a folder")?;
        fs::create_dir_all(folder).with_context(|| format!("{}: cannot be made", folder.display()))?;
        fs::write(&path, bytes).with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    for model in all() {
        let size = model::PartBox::around(&model.shell.points, 0.0)
            .extents
            .map(|v| (v * 1e3).round());
        println!(
            "{:<12} {:<22} {:>5} triangles  {:>3} x {:>3} x {:>3} mm  {:.3} kg",
            model.kind,
            model.name,
            model.shell.triangles.len(),
            size[0],
            size[1],
            size[2],
            model.mass
        );
    }
    Ok(())
}

/// One line for each file below `objects/` that is missing, differs, or is made by no drawing.
pub fn differences(root: &Path) -> Result<Vec<String>> {
    let mut findings = Vec::new();
    let mut known = Vec::new();
    for (name, bytes) in files()? {
        let path = root.join("objects").join(&name);
        match fs::read(&path) {
            Ok(found) if found == bytes => {}
            Ok(_) => findings.push(format!(
                "objects/{name}: differs from the generator; run `cargo xtask objects`"
            )),
            Err(error) => findings.push(format!("objects/{name}: {error}; run `cargo xtask objects`")),
        }
        known.push(path);
    }
    let folders = fs::read_dir(root.join("objects")).context("objects/: cannot be listed")?;
    for folder in folders {
        let folder = folder?.path();
        if !folder.is_dir() {
            continue;
        }
        for file in fs::read_dir(&folder)? {
            let file = file?.path();
            if !known.contains(&file) {
                let shown = file.strip_prefix(root).unwrap_or(&file).display().to_string();
                findings.push(format!(
                    "{shown}: made by no drawing in xtask/src/objects; remove it or draw it"
                ));
            }
        }
    }
    findings.sort();
    Ok(findings)
}
