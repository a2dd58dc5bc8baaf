//! `prehend partial-view learn` and `prehend partial-view estimate`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use nalgebra::Point3;
use prehend::geometry::Shape;
use prehend::object::Placement;
use prehend::partial_view::{PartialCloud, PartialViewModel, Scanner, coverage, scan_all};
use prehend::{Object, ObjectOptions};
use serde_json::{Value, json};

use super::shape_input::{self, ShapeOptions};
use crate::output::{self, Outcome};

/// Size and cvex of an object of which only one side was seen
#[derive(clap::Args)]
pub struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(clap::Subcommand)]
enum Action {
    /// Look at known objects from all sides, and learn what a view hides
    #[command(
        after_help = "Example:\n  prehend partial-view learn --objects objects --out views.json --coverage"
    )]
    Learn(Learn),
    /// What clouds of unknown objects say, as evidence for `prehend query`; --up and --front say how they are turned
    #[command(
        after_help = "Example:\n  prehend partial-view estimate views.json cloud.pcd --viewpoint 0.5,0,0.3 --json"
    )]
    Estimate(Estimate),
}

#[derive(clap::Args)]
struct Learn {
    /// Folders of meshes, at any depth
    #[arg(long, required = true, num_args = 1..)]
    objects: Vec<PathBuf>,

    /// Where the learned file goes
    #[arg(long)]
    out: PathBuf,

    /// Viewpoints an object
    #[arg(long, default_value_t = Scanner::default().n_views)]
    views: usize,

    /// Standard deviation of the camera's depth (m)
    #[arg(long, default_value_t = Scanner::default().noise)]
    noise: f64,

    /// Seed of the noise
    #[arg(long, default_value_t = Scanner::default().seed)]
    seed: u64,

    /// Leave out one object at a time and say how often the intervals held
    #[arg(long)]
    coverage: bool,
}

#[derive(clap::Args)]
struct Estimate {
    /// A file that `learn` wrote
    model: PathBuf,

    /// Clouds: .ply .xyz .pcd (of a mesh, its vertices)
    #[arg(required = true)]
    files: Vec<PathBuf>,

    /// Where the camera stood, in the file's own axes and unit
    #[arg(long, value_parser = triple, default_value = "0,0,0", allow_hyphen_values = true)]
    viewpoint: [f64; 3],

    #[command(flatten)]
    shape: ShapeOptions,
}

fn triple(text: &str) -> Result<[f64; 3], String> {
    let numbers: Vec<f64> = text
        .split(',')
        .filter_map(|n| n.trim().parse().ok())
        .filter(|n: &f64| n.is_finite())
        .collect();
    match (<[f64; 3]>::try_from(numbers), text.split(',').count()) {
        (Ok(triple), 3) => Ok(triple),
        _ => Err(format!("found `{text}`, expected three numbers, as 0,0,1")),
    }
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        match self.action {
            Action::Learn(a) => a.run(json),
            Action::Estimate(a) => a.run(json),
        }
    }
}

impl Learn {
    fn run(self, json: bool) -> Result<Outcome> {
        let scanner = Scanner {
            n_views: self.views,
            noise: self.noise,
            seed: self.seed,
            ..Scanner::default()
        };
        if self.views == 0 || !(self.noise.is_finite() && self.noise >= 0.0) {
            bail!("expected at least one view and a noise of at least 0 m");
        }
        let mut shapes = Vec::new();
        for folder in &self.objects {
            let found = Object::read_folder(folder, ObjectOptions::default())?;
            for error in &found.left_out {
                eprintln!("warning: {error}");
            }
            for object in found.objects {
                shapes.push(prehend::stages::decompose::shape_of(
                    &object.path,
                    ObjectOptions::default(),
                )?);
            }
        }
        let views = scan_all(&shapes, &scanner);
        let model = PartialViewModel::learn(&views)?;
        prehend::files::write(&self.out, model.to_json().as_bytes())?;
        let mut answer = json!({ "objects": shapes.len(), "views": views.len(), "out": self.out });
        if self.coverage {
            answer["coverage"] = serde_json::to_value(coverage(&views)?)?;
        }
        output::answer(json, &answer, text)?;
        Ok(Outcome::Done)
    }
}

fn text(answer: &Value) -> String {
    let mut out = format!(
        "{} views of {} objects → {}\n",
        answer["views"],
        answer["objects"],
        answer["out"].as_str().unwrap_or("")
    );
    let rows = answer["coverage"]["targets"].as_array();
    if rows.is_some() {
        out += "objects left out one at a time; intervals meant to hold 90 %\n";
        out += "          held  worst object  upper/lower  error  error as seen\n";
    }
    for row in rows.into_iter().flatten() {
        let number = |key: &str| row[key].as_f64().unwrap_or(f64::NAN);
        out += &format!(
            "{:8} {:>4.0} % {:>11.0} % {:>12.2} {:>4.1} % {:>12.1} %\n",
            row["name"].as_str().unwrap_or(""),
            number("held") * 100.0,
            number("held_worst_object") * 100.0,
            number("median_ratio"),
            number("error").exp_m1() * 100.0,
            number("error_as_seen").exp_m1() * 100.0,
        );
    }
    out
}

impl Estimate {
    fn run(self, json: bool) -> Result<Outcome> {
        let shown = output::shown(&self.model);
        let model = PartialViewModel::from_json(&prehend::files::read_text(&self.model)?).context(shown)?;
        let run = |file: PathBuf| {
            let cloud = self.cloud(&file)?;
            let estimate = model.estimate(&cloud).with_context(|| output::shown(&file))?;
            Ok(json!({
                "points": cloud.points.len(),
                "evidence": { "size": estimate.size, "cvex": estimate.cvex },
                "interval": prehend::partial_view::TARGETS
                    .iter()
                    .zip(estimate.interval)
                    .map(|(name, ends)| ((*name).to_owned(), json!(ends)))
                    .collect::<serde_json::Map<_, _>>(),
            }))
        };
        output::each(json, "file", shape_input::named(&self.files), run, |v| {
            format!("{}\n", output::plain(v))
        })
    }

    fn cloud(&self, file: &Path) -> Result<PartialCloud> {
        let input = shape_input::read(file, &self.shape)?;
        let placement: Placement =
            serde_json::from_value(input.placement).context("the answer holds its own placement")?;
        let points = match input.shape {
            Shape::Cloud(points) => points,
            Shape::Mesh(mesh) => mesh.vertices().to_vec(),
        };
        Ok(PartialCloud {
            points,
            viewpoint: placement.point(&Point3::from(self.viewpoint)),
        })
    }
}
