//! Rows to learn from: tables, labelled and balanced as `train` and `learn-structure` share it.

use std::path::PathBuf;

use anyhow::{Result, bail};
use prehend::frame::Frame;
use prehend::labels::LabelStore;
use prehend::model::ModelError;
use prehend::training::{balanced_rows, labelled_copies};

use super::grasps::{listed, read_tables};
use crate::output::Usage;

/// Tables, and how they become rows to learn from.
#[derive(clap::Args)]
pub struct TrainingRows {
    /// Tables (.parquet, .csv, .jsonl) or folders of them
    #[arg(required = true)]
    data: Vec<PathBuf>,

    /// Labels for grasp tables: each grasp enters once for each task that it affords
    #[arg(long)]
    labels: Option<PathBuf>,

    /// Whose labels
    #[arg(long, default_value = "strict", requires = "labels")]
    persona: String,

    /// Balance the rows: each value of this column as often as the rarest
    #[arg(long)]
    pub balance: Option<String>,

    /// Rows of one value of this column are no independent evidence (for example `object`)
    #[arg(long)]
    pub group: Option<String>,

    /// Seed of balancing and of every other random choice
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
}

impl TrainingRows {
    /// All rows, with their labels. `asks_for_task`: there is a node `task` to learn.
    pub fn read(&self, asks_for_task: bool) -> Result<Frame> {
        // Columns that not all tables have are dropped: joints differ by hand.
        let frame = read_tables(&self.data, Frame::append)?;
        if let Some(labels) = &self.labels {
            if !labels.is_file() {
                bail!(Usage(format!("--labels {}: no such file", labels.display())));
            }
            let answers = LabelStore::open(labels)?.answers(&self.persona, &[])?;
            if answers.is_empty() {
                bail!(
                    "{}: holds no labels of persona `{}`",
                    labels.display(),
                    self.persona
                );
            }
            return Ok(labelled_copies(&frame, &answers)?);
        }
        if frame.column("task").is_none() && frame.column("grasp_id").is_some() && asks_for_task {
            bail!(
                "these are grasp tables without a column `task`, which the network's node `task` needs; \
                 give --labels out/labels.sqlite, or make labels with `prehend label`"
            );
        }
        Ok(frame)
    }

    /// The rows that take part, balanced where asked; `why` ends the message where there are none.
    pub fn balanced(&self, frame: Frame, why: &str) -> Result<Frame> {
        let rows = match &self.balance {
            Some(column) => frame.select(&balanced_rows(&frame, column, self.group.as_deref(), self.seed)?),
            None => frame,
        };
        if rows.n_rows() == 0 {
            bail!("there are no rows to learn from{why}");
        }
        Ok(rows)
    }

    /// An error of learning, with the tables' names and rows as a person counts.
    pub fn blame(&self, error: ModelError) -> anyhow::Error {
        let error = match error {
            ModelError::Cell {
                column,
                row,
                found,
                expected,
            } => anyhow::anyhow!(
                "column `{column}`, row {} of those to learn from (counted from 1): found {found}, expected {expected}",
                row + 1
            ),
            other => other.into(),
        };
        error.context(listed(&self.data))
    }
}
