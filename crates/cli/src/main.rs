//! The binary `prehend`: how a person calls the library of stages.

use std::process::ExitCode;

use clap::Parser;

mod bars;
mod commands;
mod output;

/// Learns what a task asks of a robot's grasp, and answers questions about it in any direction.
#[derive(Parser)]
#[command(name = "prehend", version, max_term_width = 110)]
struct Cli {
    #[command(subcommand)]
    command: commands::Command,

    /// Answer with JSON on standard output, and nothing else there
    #[arg(long, global = true)]
    json: bool,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    tracing_subscriber::fmt()
        .with_writer(std::io::stderr)
        .with_target(false)
        .without_time()
        .with_max_level(tracing::Level::WARN)
        .init();
    match cli.command.run(cli.json) {
        Ok(output::Outcome::Done) => ExitCode::SUCCESS,
        Ok(output::Outcome::SomeFailed) => ExitCode::from(1),
        Err(error) => {
            // A reader that closed the pipe early, like `head`, is no failure of ours.
            let closed = error
                .chain()
                .filter_map(|e| e.downcast_ref::<std::io::Error>())
                .any(|e| e.kind() == std::io::ErrorKind::BrokenPipe);
            if closed {
                return ExitCode::SUCCESS;
            }
            eprintln!("error: {error:#}");
            if error.downcast_ref::<output::Usage>().is_some() {
                ExitCode::from(2)
            } else {
                ExitCode::from(1)
            }
        }
    }
}
