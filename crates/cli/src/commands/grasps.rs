//! `prehend grasps FILE…`

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use prehend::frame::{Column, Frame};
use prehend::labels::LabelStore;
use serde_json::{Map, Value, json};

use crate::output::{self, Outcome};

/// List, filter and convert grasps
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  prehend grasps out/grasps/human --object coffee_mug --min-epsilon 0.1 --format csv"
)]
pub struct Arguments {
    /// Grasp tables (.parquet, .csv, .jsonl) or folders of them
    #[arg(required = true)]
    files: Vec<PathBuf>,

    #[command(flatten)]
    filter: Filter,

    /// How rows are printed
    #[arg(long, value_enum, default_value = "json")]
    format: Format,

    /// Write the rows to a table (.parquet, .csv, .jsonl) instead of printing them
    #[arg(long)]
    out: Option<PathBuf>,
}

/// Which grasps of the tables are meant.
#[derive(clap::Args)]
pub struct Filter {
    /// Only grasps on this object
    #[arg(long)]
    object: Option<String>,

    /// Only grasps of this hand
    #[arg(long)]
    hand: Option<String>,

    /// Only the grasp with this identifier
    #[arg(long)]
    grasp_id: Option<String>,

    /// Only grasps with at least this epsilon
    #[arg(long)]
    min_epsilon: Option<f64>,

    /// Only grasps with at most this epsilon
    #[arg(long)]
    max_epsilon: Option<f64>,

    /// Only grasps whose label says that they suit this task; needs --labels
    #[arg(long, requires = "labels")]
    task: Option<String>,

    /// The labels that --task asks
    #[arg(long)]
    labels: Option<PathBuf>,

    /// Whose labels
    #[arg(long, default_value = "strict", requires = "labels")]
    persona: String,

    /// Only so many with the largest epsilon, best first
    #[arg(long)]
    top: Option<usize>,

    /// At most this many rows
    #[arg(long)]
    limit: Option<usize>,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Format {
    Json,
    Csv,
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        let (frame, rows) = self.filter.read(&self.files)?;
        let chosen = frame.select(&rows);
        if let Some(out) = &self.out {
            chosen.write(out)?;
            output::answer(
                json,
                &json!({ "rows": rows.len(), "out": out.to_string_lossy() }),
                output::plain,
            )?;
            return Ok(Outcome::Done);
        }
        match self.format {
            Format::Csv if !json => {
                use std::io::Write;
                std::io::stdout().lock().write_all(&chosen.to_csv()?)?;
            }
            _ => {
                for row in 0..chosen.n_rows() {
                    output::line(&row_json(&chosen, row))?;
                }
            }
        }
        Ok(Outcome::Done)
    }
}

impl Filter {
    /// All tables as one, and the rows that are meant.
    pub fn read(&self, files: &[PathBuf]) -> Result<(Frame, Vec<usize>)> {
        let frame = read_tables(files, Frame::append_all)?;
        let rows = self.matching(&frame).with_context(|| listed(files))?;
        Ok((frame, rows))
    }

    /// Grasps that this persona's labels call suited to a task.
    fn suiting(&self, task: &str, labels: &Path) -> Result<BTreeSet<String>> {
        if !labels.is_file() {
            bail!(
                "{}: is not there; write labels with `prehend label`",
                output::shown(labels)
            );
        }
        let answers = LabelStore::open(labels)?.answers(&self.persona, &[])?;
        let known: BTreeSet<&str> = answers.values().flatten().map(|a| a.task.as_str()).collect();
        if !known.contains(task) {
            let known: Vec<&str> = known.into_iter().collect();
            bail!(
                "{}: holds no labels of persona `{}` for task `{task}`; it has {}",
                output::shown(labels),
                self.persona,
                if known.is_empty() {
                    "none of that persona".to_owned()
                } else {
                    known.join(", ")
                }
            );
        }
        let suited = answers
            .into_iter()
            .filter(|(_, answers)| answers.iter().any(|a| a.yes && a.task == task));
        Ok(suited.map(|(grasp, _)| grasp).collect())
    }

    fn matching(&self, frame: &Frame) -> Result<Vec<usize>> {
        let mut rows: Vec<usize> = (0..frame.n_rows()).collect();
        for (column, wanted) in [
            ("object", &self.object),
            ("hand", &self.hand),
            ("grasp_id", &self.grasp_id),
        ] {
            if let Some(wanted) = wanted {
                let values = frame.texts(column)?;
                rows.retain(|&r| values[r] == *wanted);
            }
        }
        if let Some(least) = self.min_epsilon {
            let epsilon = frame.numbers("qeps")?;
            rows.retain(|&r| epsilon[r] >= least);
        }
        if let Some(most) = self.max_epsilon {
            let epsilon = frame.numbers("qeps")?;
            rows.retain(|&r| epsilon[r] <= most);
        }
        if let (Some(task), Some(labels)) = (&self.task, &self.labels) {
            let suits = self.suiting(task, labels)?;
            let ids = frame.texts("grasp_id")?;
            rows.retain(|&r| suits.contains(&ids[r]));
        }
        if let Some(top) = self.top {
            let epsilon = frame.numbers("qeps")?;
            // Stable: of equals, the first.
            rows.sort_by(|&a, &b| epsilon[b].total_cmp(&epsilon[a]));
            rows.truncate(top);
        }
        rows.truncate(self.limit.unwrap_or(usize::MAX));
        Ok(rows)
    }
}

/// Paths as messages name them.
pub fn listed(paths: &[PathBuf]) -> String {
    paths
        .iter()
        .map(|p| output::shown(p))
        .collect::<Vec<_>>()
        .join(", ")
}

/// All tables of these files and folders as one.
pub fn read_tables(paths: &[PathBuf], join: fn(&mut Frame, &Frame)) -> Result<Frame> {
    let mut whole = Frame::new();
    let mut found = 0;
    for path in paths {
        for file in prehend::files::list(path, &["parquet", "csv", "jsonl"])? {
            join(&mut whole, &Frame::read(&file)?);
            found += 1;
        }
    }
    if found == 0 {
        bail!(
            "{}: no tables found; expected .parquet, .csv or .jsonl files, or folders that hold some",
            listed(paths)
        );
    }
    Ok(whole)
}

/// One row as a JSON object; `contacts` becomes an array, missing cells null.
pub fn row_json(frame: &Frame, row: usize) -> Value {
    let cell = |name: &str, column: &Column| match column {
        Column::Number(v) => json!(v[row]),
        Column::Integer(v) => json!(v[row]),
        Column::Text(v) => match &v[row] {
            Some(text) if name == "contacts" => serde_json::from_str(text).unwrap_or_else(|_| json!(text)),
            other => json!(other),
        },
    };
    Value::Object(
        frame
            .columns()
            .iter()
            .map(|(n, c)| (n.clone(), cell(n, c)))
            .collect::<Map<_, _>>(),
    )
}
