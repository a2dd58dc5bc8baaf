//! `prehend decompose FILE…`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use prehend::geometry::{DecomposeOptions, decompose};
use serde_json::{Value, json};

use super::mesh::box_json;
use super::shape_input::{self, ShapeOptions};
use crate::output::{self, Outcome};

/// Boxes that an object is made of
#[derive(clap::Args)]
#[command(after_help = "Example:\n  prehend decompose objects/hammer/*.ply --gain 0.9 --json")]
pub struct Arguments {
    /// .off .obj .stl .ply meshes
    #[arg(required = true)]
    files: Vec<PathBuf>,

    #[command(flatten)]
    shape: ShapeOptions,

    /// Split while the new total volume over the old is below this; smaller gives fewer boxes
    #[arg(long, default_value_t = 0.94, value_parser = gain)]
    gain: f64,
}

fn gain(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if (0.0..1.0).contains(&v) => Ok(v),
        _ => Err(format!("found `{text}`, expected a number from 0 to below 1")),
    }
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        let run = |file: PathBuf| boxes(&file, &self.shape, self.gain);
        output::each(json, "file", shape_input::named(&self.files), run, text)
    }
}

fn boxes(file: &Path, options: &ShapeOptions, gain: f64) -> Result<Value> {
    let (mesh, placement) = shape_input::read_mesh(file, options)?;
    let options = DecomposeOptions {
        gain,
        ..DecomposeOptions::default()
    };
    let result = decompose(&mesh, &options).with_context(|| file.display().to_string())?;
    let mut answer = json!({
        "root": box_json(&result.root),
        "boxes": result.boxes.iter().map(box_json).collect::<Vec<_>>(),
        "cvex": result.cvex,
    });
    for (key, value) in placement.as_object().into_iter().flatten() {
        answer[key] = value.clone();
    }
    Ok(answer)
}

fn text(answer: &Value) -> String {
    let boxes = answer["boxes"].as_array().map_or(&[][..], Vec::as_slice);
    let mut out = format!(
        "{}: {} boxes, cvex {:.3}\n",
        answer["file"].as_str().unwrap_or(""),
        boxes.len(),
        answer["cvex"].as_f64().unwrap_or(f64::NAN)
    );
    for b in boxes {
        let e: Vec<f64> = b["extents"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(Value::as_f64)
            .collect();
        out += &format!("  {:.0} × {:.0} × {:.0} mm\n", e[0] * 1e3, e[1] * 1e3, e[2] * 1e3);
    }
    out
}
