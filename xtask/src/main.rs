//! Chores of the workspace.
//!
//! `check` is what continuous integration runs. `pipeline` calls the binary `prehend`; this package itself knows none of
//! the workspace's crates, so that a chore never waits for them to build.

mod cargo;
mod check;
mod objects;
mod tidy;

use anyhow::{Context, Result};
use clap::{Parser, Subcommand};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Chores of the workspace.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run every stage on the bundled hands and objects and write the report (`prehend pipeline` in release)
    #[command(disable_help_flag = true)]
    Pipeline {
        /// Arguments of `prehend pipeline`, such as --quick, --objects DIR, --out DIR, --seed N
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        args: Vec<String>,
    },
    /// Check format, lints, tests, doc tests, examples, docs and tidiness
    Check,
    /// Check the rules that no compiler knows: layers, file access, leftovers, bundled objects
    Tidy,
    /// Write the bundled objects again
    Objects {
        /// Only say which files differ from what the generator makes
        #[arg(long)]
        check: bool,
    },
    /// Write the golden files again, to be reviewed as a diff
    Golden {
        /// Only tests whose names contain this
        filter: Vec<String>,
    },
}

fn main() -> ExitCode {
    match run(Cli::parse().command) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(command: Command) -> Result<ExitCode> {
    let root = root()?;
    match command {
        Command::Pipeline { args } => return Ok(ExitCode::from(cargo::pipeline(&root, &args)?)),
        Command::Check => check::run(&root)?,
        Command::Tidy => tidy::run(&root)?,
        Command::Objects { check } => objects::run(&root, check)?,
        Command::Golden { filter } => cargo::golden(&root, &filter)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// The workspace's folder.
fn root() -> Result<PathBuf> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent()
        .map(Path::to_path_buf)
        .context("xtask stands in the workspace's folder")
}
