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
    /// By the extensions: .bin and .json without loss; .bif, .xmlbif (.xml), .net, and to .dot, with a list of losses
    #[command(
        after_help = "Examples:\n  prehend model convert out/models/human/paper.bin paper.json\n  prehend model convert alarm.bif alarm.json\n  prehend model convert paper.json paper.net"
    )]
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
        let losses = write(&to, &model)?;
        let answer = json!({
            "from": from.to_string_lossy(), "to": to.to_string_lossy(), "nodes": model.nodes().len(), "losses": losses,
        });
        output::answer(json, &answer, output::plain)?;
        Ok(Outcome::Done)
    }
}

/// The extensions that a model can be read from.
const READABLE: &str = ".bin, .json, .bif, .xmlbif (.xml) or .net";

/// Reads a model by its extension.
pub fn read_model(path: &Path) -> Result<Model> {
    let bytes = prehend::files::read(path)?;
    let name = || path.display().to_string();
    let extension = prehend::files::extension(path);
    if extension.as_deref() == Some("bin") {
        return Model::from_bytes(&bytes).with_context(name);
    }
    let text = || String::from_utf8(bytes).with_context(name);
    match extension.as_deref() {
        Some("json") | None => Model::from_json(&text()?),
        Some("bif") => Model::from_bif(&text()?),
        Some("xmlbif" | "xml") => Model::from_xmlbif(&text()?),
        Some("net") => Model::from_net(&text()?),
        Some(other) => bail!(
            "{}: the extension `.{other}` is no model; use {READABLE}",
            path.display()
        ),
    }
    .with_context(name)
}

/// Writes a model by its extension; what the format cannot hold comes back.
fn write(path: &Path, model: &Model) -> Result<Vec<String>> {
    let name = || path.display().to_string();
    let export = match prehend::files::extension(path).as_deref() {
        Some("bin") => {
            prehend::files::write(path, &model.to_bytes())?;
            return Ok(Vec::new());
        }
        Some("json") => {
            prehend::files::write(path, model.to_json().as_bytes())?;
            return Ok(Vec::new());
        }
        Some("bif") => model.to_bif().with_context(name)?,
        Some("xmlbif" | "xml") => model.to_xmlbif().with_context(name)?,
        Some("net") => model.to_net().with_context(name)?,
        Some("dot") => model.to_dot(),
        other => bail!(
            "{}: a model cannot be written as `.{}`; use {READABLE}, or .dot",
            path.display(),
            other.unwrap_or("")
        ),
    };
    prehend::files::write(path, export.text.as_bytes())?;
    Ok(export.losses)
}
