//! What ran, with what, and how long it took.

use maud::{Markup, html};

use crate::charts::{Bar, bars};
use crate::page::Sheet;
use crate::palette::ACCENT;

/// One run of the pipeline.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RunSection {
    /// Version of the program.
    pub version: String,
    /// Seed of all random streams.
    pub seed: u64,
    /// The command as given.
    pub command: String,
    /// The stages in the order in which they ran.
    pub stages: Vec<Stage>,
    /// What else a reader needs for running it again: threads, hands, folders.
    pub notes: Vec<String>,
}

/// One stage.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Stage {
    /// Its name.
    pub name: String,
    /// Seconds of wall time; `None` where an earlier run's result was taken over.
    pub seconds: Option<f64>,
    /// What it made: `25 objects, 131 boxes`.
    pub detail: String,
}

pub(crate) fn render(run: &RunSection, out: &mut Sheet) -> Markup {
    let total: f64 = run.stages.iter().filter_map(|s| s.seconds).sum();
    let timed: Vec<Bar> = run
        .stages
        .iter()
        .filter_map(|s| {
            Some(Bar {
                label: s.name.clone(),
                value: s.seconds?,
                color: ACCENT,
            })
        })
        .collect();
    let chart = (timed.len() > 1).then(|| {
        let alt = format!(
            "Bars: wall time of {} stages, {total:.0} seconds in all.",
            timed.len()
        );
        bars("stage-times", &alt, "seconds", &timed)
    });
    html! {
        p { "Version " (run.version) ", seed " (run.seed) @if !run.command.is_empty() { ", started as " code { (run.command) } } "." }
        @for note in &run.notes { p { (note) } }
        div.pair {
            div.wide { table {
                thead { tr { th { "Stage" } th.n { "Seconds" } th { "Result" } } }
                tbody {
                    @for stage in &run.stages {
                        tr {
                            td { (stage.name) }
                            td.n { @match stage.seconds { Some(s) => (format!("{s:.1}")), None => span.muted { "kept" } } }
                            td { (stage.detail) }
                        }
                    }
                    tr.total { td { "In all" } td.n { (format!("{total:.1}")) } td {} }
                }
            } }
            @if let Some(chart) = &chart {
                (out.figure(chart, &html! {
                    "Wall time of each stage of this run, in seconds. Stages taken over from an earlier run are left out."
                }))
            }
        }
    }
}
