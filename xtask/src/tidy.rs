//! `cargo xtask tidy`: rules of the house that no compiler knows.
//!
//! Each rule gives findings, one line each: the file, the line where there is one, what is wrong and what to do.

mod code;
mod layers;
mod sources;

use crate::objects;
use anyhow::{Context, Result, bail};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Runs every rule, prints the findings, and fails where there are any.
pub fn run(root: &Path) -> Result<()> {
    let findings = findings(root)?;
    for finding in &findings {
        eprintln!("{finding}");
    }
    if !findings.is_empty() {
        bail!("tidy: {} findings", findings.len());
    }
    println!(
        "tidy: layers, file access, bundled objects, leftovers, paths, lints and Cargo.lock are in order"
    );
    Ok(())
}

fn findings(root: &Path) -> Result<Vec<String>> {
    let mut findings = Vec::new();
    for folder in crate_folders(root)? {
        let path = folder.join("Cargo.toml");
        let text =
            fs::read_to_string(&path).with_context(|| format!("{}: cannot be read", path.display()))?;
        findings.extend(layers::check(&shown(root, &path), &text)?);
        let name = layers::name(&text)?;
        for file in rust_files(&folder.join("src"))? {
            let text =
                fs::read_to_string(&file).with_context(|| format!("{}: cannot be read", file.display()))?;
            findings.extend(sources::check(&name, &shown(root, &file), &text));
        }
    }
    let tracked = tracked_files(root)?;
    for name in &tracked {
        if let Ok(text) = fs::read_to_string(root.join(name)) {
            findings.extend(sources::machine_paths(name, &text));
        }
    }
    if !tracked.iter().any(|name| name == "Cargo.lock") {
        findings.push(
            "Cargo.lock: not committed; `git add Cargo.lock`, so that everyone builds the same".to_owned(),
        );
    }
    findings.extend(objects::differences(root)?);
    Ok(findings)
}

/// Examples of all crates: names of their files without extension.
pub fn examples(root: &Path) -> Result<Vec<String>> {
    let mut names = Vec::new();
    for folder in crate_folders(root)? {
        for file in rust_files(&folder.join("examples"))? {
            if let Some(name) = file.file_stem() {
                names.push(name.to_string_lossy().into_owned());
            }
        }
    }
    names.sort();
    Ok(names)
}

fn crate_folders(root: &Path) -> Result<Vec<PathBuf>> {
    let mut folders = vec![root.join("xtask")];
    for entry in fs::read_dir(root.join("crates")).context("crates/: cannot be listed")? {
        let folder = entry?.path();
        if folder.join("Cargo.toml").is_file() {
            folders.push(folder);
        }
    }
    folders.sort();
    Ok(folders)
}

/// All `.rs` files below `folder`, in order; none where there is no folder.
fn rust_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    if folder.is_dir() {
        for entry in fs::read_dir(folder)? {
            let path = entry?.path();
            if path.is_dir() {
                files.extend(rust_files(&path)?);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                files.push(path);
            }
        }
    }
    files.sort();
    Ok(files)
}

/// What git holds, relative to the root.
fn tracked_files(root: &Path) -> Result<Vec<String>> {
    let output = Command::new("git")
        .args(["ls-files", "-z"])
        .current_dir(root)
        .output()
        .context("git cannot be run")?;
    if !output.status.success() {
        bail!(
            "git ls-files: {}; tidy runs in a git checkout",
            String::from_utf8_lossy(&output.stderr).trim()
        );
    }
    let names = String::from_utf8_lossy(&output.stdout);
    Ok(names
        .split('\0')
        .filter(|name| !name.is_empty())
        .map(str::to_owned)
        .collect())
}

fn shown(root: &Path, path: &Path) -> String {
    path.strip_prefix(root).unwrap_or(path).display().to_string()
}
