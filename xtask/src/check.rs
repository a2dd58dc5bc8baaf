//! `cargo xtask check`: what continuous integration runs, no more and no less.

mod tally;

use crate::cargo::{cargo, has_nextest, target_folder};
use crate::tidy;
use anyhow::{Context, Result, bail};
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};
use tally::Tally;

/// What one step came to.
struct Outcome {
    name: &'static str,
    time: Duration,
    /// Empty where the step passed, otherwise why it failed.
    failure: Option<String>,
}

/// Runs all steps, also after one that fails, and ends with the time of each, the skipped tests with their reasons,
/// and the line `N passed, N failed, N skipped`. Fails where any step does.
pub fn run(root: &Path) -> Result<()> {
    type Step = (&'static str, fn(&Path, &mut Tally) -> Result<()>);
    let steps: [Step; 7] = [
        ("format", format),
        ("clippy", clippy),
        ("tests", tests),
        ("doc tests", doc_tests),
        ("examples", examples),
        ("docs", docs),
        ("tidy", |root, _| tidy::run(root)),
    ];
    let mut tally = Tally::default();
    let mut outcomes = Vec::new();
    for (name, step) in steps {
        eprintln!("── {name}");
        let start = now();
        let failed_before = tally.failed;
        let failure = step(root, &mut tally).err().map(|error| format!("{error:#}"));
        if let Some(failure) = &failure {
            eprintln!("{name}: {failure}");
            tally.failed += usize::from(tally.failed == failed_before);
        } else {
            tally.passed += usize::from(!["tests", "doc tests", "examples"].contains(&name));
        }
        outcomes.push(Outcome {
            name,
            time: start.elapsed(),
            failure,
        });
    }
    println!();
    for Outcome { name, time, failure } in &outcomes {
        let word = if failure.is_some() { "FAILED" } else { "ok" };
        println!("{name:<10} {:>7.1} s  {word}", time.as_secs_f64());
    }
    for (reason, n) in &tally.skipped {
        println!("skipped {n}: {reason}");
    }
    println!(
        "{} passed, {} failed, {} skipped",
        tally.passed,
        tally.failed,
        tally.n_skipped()
    );
    let failed: Vec<&str> = outcomes
        .iter()
        .filter(|o| o.failure.is_some())
        .map(|o| o.name)
        .collect();
    if !failed.is_empty() {
        bail!("check failed in: {}", failed.join(", "));
    }
    Ok(())
}

#[expect(
    clippy::disallowed_methods,
    reason = "how long a step took is what the person wants to know"
)]
fn now() -> Instant {
    Instant::now()
}

fn format(root: &Path, _: &mut Tally) -> Result<()> {
    succeed(
        cargo(root).args(["fmt", "--all", "--check"]),
        "run `cargo fmt --all`",
    )
}

fn clippy(root: &Path, _: &mut Tally) -> Result<()> {
    let mut command = cargo(root);
    command.args([
        "clippy",
        "--workspace",
        "--all-targets",
        "--locked",
        "--",
        "-D",
        "warnings",
    ]);
    succeed(&mut command, "see its messages above")
}

/// Unit and integration tests. Passing tests' output is asked for too, since what a test skipped stands there.
fn tests(root: &Path, tally: &mut Tally) -> Result<()> {
    let mut command = cargo(root);
    if has_nextest(root) {
        command.args([
            "nextest",
            "run",
            "--workspace",
            "--locked",
            "--no-fail-fast",
            "--no-tests=pass",
            "--color=never",
        ]);
        command.args([
            "--status-level=fail",
            "--final-status-level=none",
            "--success-output=immediate",
        ]);
    } else {
        command.args([
            "test",
            "--workspace",
            "--locked",
            "--no-fail-fast",
            "--lib",
            "--bins",
            "--tests",
        ]);
        command.args(["--", "--show-output"]);
    }
    counted(&mut command, tally)
}

fn doc_tests(root: &Path, tally: &mut Tally) -> Result<()> {
    counted(
        cargo(root).args(["test", "--doc", "--workspace", "--locked", "--no-fail-fast"]),
        tally,
    )
}

/// Builds all examples at once (so that nothing is built again with other features) and runs each.
fn examples(root: &Path, tally: &mut Tally) -> Result<()> {
    succeed(
        cargo(root).args(["build", "--workspace", "--examples", "--locked"]),
        "see its messages above",
    )?;
    let folder = target_folder(root)?.join("debug").join("examples");
    let mut failed = Vec::new();
    for name in tidy::examples(root)? {
        let output = Command::new(folder.join(&name))
            .current_dir(root)
            .stdin(Stdio::null())
            .output()
            .with_context(|| format!("example {name}: cannot be run"))?;
        tally.read_skips(&String::from_utf8_lossy(&output.stderr));
        if output.status.success() {
            tally.passed += 1;
        } else {
            tally.failed += 1;
            eprintln!(
                "example {name}: {}\n{}",
                output.status,
                String::from_utf8_lossy(&output.stderr)
            );
            failed.push(name);
        }
    }
    if failed.is_empty() {
        Ok(())
    } else {
        bail!("examples that did not exit with 0: {}", failed.join(", "))
    }
}

fn docs(root: &Path, _: &mut Tally) -> Result<()> {
    let mut command = cargo(root);
    command
        .args(["doc", "--no-deps", "--workspace", "--locked"])
        .env("RUSTDOCFLAGS", "-D warnings");
    succeed(&mut command, "see its messages above")
}

/// Runs a command whose output goes straight to the terminal.
fn succeed(command: &mut Command, advice: &str) -> Result<()> {
    let status = command.status().context("cargo cannot be run")?;
    if status.success() {
        Ok(())
    } else {
        bail!("{status}; {advice}")
    }
}

/// Runs tests and counts them from their output. Lines about building and failing are shown as they come; all of it is
/// shown where something failed.
fn counted(command: &mut Command, tally: &mut Tally) -> Result<()> {
    let mut child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .context("cargo cannot be run")?;
    let (sender, lines) = mpsc::channel();
    let readers = [child.stdout.take().map(boxed), child.stderr.take().map(boxed)].map(|stream| {
        let sender = sender.clone();
        thread::spawn(move || {
            let Some(stream) = stream else { return };
            for line in BufReader::new(stream).split(b'\n').map_while(Result::ok) {
                if sender.send(String::from_utf8_lossy(&line).into_owned()).is_err() {
                    return;
                }
            }
        })
    });
    drop(sender);
    let mut text = String::new();
    for line in lines {
        if ["Compiling", "Finished", "FAIL", "SLOW", "error"]
            .iter()
            .any(|word| line.trim_start().starts_with(word))
        {
            eprintln!("{line}");
        }
        text.push_str(&line);
        text.push('\n');
    }
    for reader in readers {
        let _ = reader.join();
    }
    let status = child.wait().context("cargo cannot be waited for")?;
    tally.read_results(&text);
    tally.read_skips(&text);
    if status.success() {
        return Ok(());
    }
    eprintln!("{text}");
    bail!("{status}; the output stands above")
}

fn boxed(stream: impl Read + Send + 'static) -> Box<dyn Read + Send> {
    Box::new(stream)
}
