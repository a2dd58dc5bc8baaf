//! `prehend model convert A B`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use prehend::model::Model;
use serde_json::json;

use crate::output::{self, Outcome};

/// Convert models
#[derive(clap::Args)]
pub struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(clap::Subcommand)]
enum Action {
    /// .bin to .json or back, without loss
    #[command(after_help = "Example:\n  prehend model convert out/models/human/paper.bin paper.json")]
    Convert {
        /// The model to read
        from: PathBuf,
        /// The model to write
        to: PathBuf,
    },
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        let Action::Convert { from, to } = self.action;
        let model = read_model(&from)?;
        write(&to, &model)?;
        let answer = json!({ "from": from.to_string_lossy(), "to": to.to_string_lossy(), "nodes": model.nodes().len() });
        output::answer(json, &answer, output::plain)?;
        Ok(Outcome::Done)
    }
}

/// Reads a model by its extension: .bin or .json.
pub fn read_model(path: &Path) -> Result<Model> {
    let bytes = prehend::files::read(path)?;
    let name = || path.display().to_string();
    match prehend::files::extension(path).as_deref() {
        Some("bin") => Model::from_bytes(&bytes).with_context(name),
        Some("json") | None => {
            let text = String::from_utf8(bytes).with_context(name)?;
            Model::from_json(&text).with_context(name)
        }
        Some(other) => bail!(
            "{}: the extension `.{other}` is no model; use .bin or .json",
            path.display()
        ),
    }
}

fn write(path: &Path, model: &Model) -> Result<()> {
    let bytes = match prehend::files::extension(path).as_deref() {
        Some("bin") => model.to_bytes(),
        Some("json") => model.to_json().into_bytes(),
        other => bail!(
            "{}: a model cannot be written as `.{}` yet; use .bin or .json",
            path.display(),
            other.unwrap_or("")
        ),
    };
    Ok(prehend::files::write(path, &bytes)?)
}
