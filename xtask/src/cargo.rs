//! Calls of cargo.

use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Cargo in the workspace's folder, without incremental files (they double the size of `target` and nothing here edits).
pub fn cargo(root: &Path) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root).env("CARGO_INCREMENTAL", "0");
    command
}

/// Whether `cargo nextest` is there.
pub fn has_nextest(root: &Path) -> bool {
    cargo(root)
        .args(["nextest", "--version"])
        .output()
        .is_ok_and(|output| output.status.success())
}

/// The folder that cargo builds into.
pub fn target_folder(root: &Path) -> Result<PathBuf> {
    let output = cargo(root)
        .args(["metadata", "--format-version=1", "--no-deps", "--locked"])
        .output()
        .context("cargo cannot be run")?;
    if !output.status.success() {
        bail!(
            "cargo metadata: {}",
            String::from_utf8_lossy(&output.stderr).trim()
        );
    }
    let metadata: serde_json::Value =
        serde_json::from_slice(&output.stdout).context("cargo metadata wrote no JSON")?;
    let folder = metadata["target_directory"]
        .as_str()
        .context("cargo metadata names no target_directory")?;
    Ok(PathBuf::from(folder))
}

/// `cargo xtask pipeline`: the binary's `pipeline` in release with the same arguments; gives its exit status.
pub fn pipeline(root: &Path, args: &[String]) -> Result<u8> {
    let status = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args(["run", "--quiet", "--release", "--locked", "--manifest-path"])
        .arg(root.join("Cargo.toml"))
        .args(["--package", "prehend-cli", "--bin", "prehend", "--", "pipeline"])
        .args(args)
        .status()
        .context("cargo cannot be run")?;
    Ok(status
        .code()
        .and_then(|code| u8::try_from(code).ok())
        .unwrap_or(1))
}

/// `cargo xtask golden`: runs the tests with the request to write their golden files, and shows what changed.
pub fn golden(root: &Path, filter: &[String]) -> Result<()> {
    let status = cargo(root)
        .args(["test", "--workspace", "--locked", "--no-fail-fast", "--tests"])
        .args(filter)
        .env("PREHEND_GOLDEN", "write")
        .status()
        .context("cargo cannot be run")?;
    if !status.success() {
        bail!("tests failed while golden files were written; see above");
    }
    Command::new("git")
        .args(["--no-pager", "diff", "--stat", "--", "*golden*"])
        .current_dir(root)
        .status()
        .context("git cannot be run")?;
    println!("golden files are written; review the diff and say in the commit why it changed");
    Ok(())
}
