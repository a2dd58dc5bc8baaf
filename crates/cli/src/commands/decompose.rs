//! `prehend decompose FILE…`

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result};
use nalgebra::Isometry3;
use prehend::geometry::{
    DecomposeMethod, DecomposeOptions, Decomposition, Shape, decompose, decompose_points, union_volume,
};
use prehend::report::{Camera, DisplayMesh, Dot, DrawOptions, Scene, View, draw, encode_png};
use rayon::prelude::*;
use serde_json::{Value, json};

use super::mesh::box_json;
use super::shape_input::{self, ShapeOptions};
use crate::output::{self, Outcome, Usage};

/// Pixels along each side of a picture.
const PICTURE: usize = 320;

/// Dots in the picture of a cloud.
const MAX_DOTS: usize = 1500;

/// The object in a picture (sRGB).
const GREY: [u8; 3] = [190, 190, 190];

/// Boxes that an object is made of
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  prehend decompose objects/hammer/*.ply --gain 0.9 --json\n  \
                        prehend decompose objects/mug/coffee_mug.ply --method refined --price 0.05\n  \
                        prehend decompose objects/hammer/claw_hammer.ply --boxes 3 --picture boxes.png"
)]
pub struct Arguments {
    /// .off .obj .stl .ply .gltf .glb .dae meshes, .ply .xyz .pcd clouds
    #[arg(required = true)]
    files: Vec<PathBuf>,

    #[command(flatten)]
    shape: ShapeOptions,

    /// Split while the new total volume over the old is below this; smaller gives fewer boxes
    #[arg(long, default_value_t = 0.94, value_parser = gain)]
    gain: f64,

    /// The paper's fit and split, or boxes refined beyond it
    #[arg(long, value_enum, default_value_t = Method::Paper)]
    method: Method,

    /// What a refined box costs, as a share of the root box's volume: one counts that takes more off the union
    #[arg(long, default_value_t = 0.02, value_parser = price)]
    price: f64,

    /// As many refined boxes as this
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=256), conflicts_with_all = ["method", "price", "gain"])]
    boxes: Option<u32>,

    /// No more boxes than this
    #[arg(long, default_value_t = 32, value_parser = clap::value_parser!(u32).range(1..=256))]
    max_boxes: u32,

    /// Draw the object and its boxes into a .png (one input only)
    #[arg(long)]
    picture: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Method {
    /// Fit and split, as the features use it
    Paper,
    /// Least union of the boxes plus their price
    Refined,
}

fn gain(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if (0.0..1.0).contains(&v) => Ok(v),
        _ => Err(format!("found `{text}`, expected a number from 0 to below 1")),
    }
}

fn price(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if v > 0.0 && v <= 1.0 => Ok(v),
        _ => Err(format!("found `{text}`, expected a number above 0 and at most 1")),
    }
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        if self.picture.is_some() && self.files.len() > 1 {
            return Err(Usage(format!(
                "--picture draws one object; {} are given",
                self.files.len()
            ))
            .into());
        }
        // Files in parallel, answers in order.
        let answers: Vec<Result<Value>> = self.files.par_iter().map(|file| self.boxes_of(file)).collect();
        let names = shape_input::named(&self.files).map(|(name, _)| name);
        output::each(json, "file", names.zip(answers), |answer| answer, text)
    }

    fn boxes_of(&self, file: &Path) -> Result<Value> {
        let input = shape_input::read(file, &self.shape)?;
        let options = self.options();
        let found = match &input.shape {
            Shape::Mesh(mesh) => decompose(mesh, &options),
            Shape::Cloud(points) => decompose_points(points, &options),
        };
        let result = found.with_context(|| output::shown(file))?;
        if let Some(path) = &self.picture {
            prehend::files::write(path, &picture(&input.shape, &result)?)?;
        }
        let mut answer = json!({
            "shape": match input.shape {
                Shape::Mesh(_) => "mesh",
                Shape::Cloud(_) => "cloud",
            },
            "root": box_json(&result.root),
            "boxes": result.boxes.iter().map(box_json).collect::<Vec<_>>(),
            "cvex": result.cvex,
            "union_volume": union_volume(&result.boxes),
            "tree": result.tree,
        });
        for (key, value) in input.placement.as_object().into_iter().flatten() {
            answer[key] = value.clone();
        }
        Ok(answer)
    }

    fn options(&self) -> DecomposeOptions {
        let method = match (self.boxes, self.method) {
            (Some(boxes), _) => DecomposeMethod::Exactly {
                boxes: boxes as usize,
            },
            (None, Method::Refined) => DecomposeMethod::Refined { price: self.price },
            (None, Method::Paper) => DecomposeMethod::FitAndSplit,
        };
        DecomposeOptions {
            method,
            gain: self.gain,
            max_boxes: self.boxes.unwrap_or(self.max_boxes) as usize,
            ..DecomposeOptions::default()
        }
    }
}

/// The object (a cloud as dots), seen obliquely, within its boxes.
fn picture(shape: &Shape, found: &Decomposition) -> Result<Vec<u8>> {
    const COLORS: [[u8; 3]; 6] = [
        [0, 114, 178],
        [213, 94, 0],
        [0, 158, 115],
        [204, 121, 167],
        [230, 159, 0],
        [86, 180, 233],
    ];
    let mut scene = Scene::default();
    match shape {
        Shape::Mesh(mesh) => scene.add(&Arc::new(DisplayMesh::new(mesh)), Isometry3::identity(), GREY),
        Shape::Cloud(points) => {
            // Every so many of the points: more dots than these would hide one another.
            let step = points.len().div_ceil(MAX_DOTS);
            scene.dots.extend(points.iter().step_by(step).map(|&center| Dot {
                center,
                radius: 1.0,
                color: GREY,
            }));
        }
    }
    for (i, solid) in found.boxes.iter().enumerate() {
        scene.add_box(solid, COLORS[i % COLORS.len()]);
    }
    let camera = Camera::fitting(&scene, View::Oblique.camera_from_world(), PICTURE, PICTURE);
    Ok(encode_png(&draw(&scene, &camera, &DrawOptions::square(PICTURE))?))
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
