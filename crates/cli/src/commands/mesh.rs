//! `prehend mesh FILE…`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use prehend::geometry::{
    OrientedBox, Shape, convex_hull, inspect, minimum_volume_box, repair, signed_volume,
};
use serde_json::{Value, json};

use super::shape_input::{self, ShapeOptions};
use crate::output::{self, Outcome};

/// Facts about meshes and clouds
#[derive(clap::Args)]
#[command(after_help = "Example:\n  prehend mesh objects/mug/*.ply --json")]
pub struct Arguments {
    /// .off .obj .stl .ply meshes, .ply .xyz .pcd clouds
    #[arg(required = true)]
    files: Vec<PathBuf>,

    #[command(flatten)]
    shape: ShapeOptions,
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        output::each(
            json,
            "file",
            shape_input::named(&self.files),
            |file| facts(&file, &self.shape),
            |v| format!("{}\n", output::plain(v)),
        )
    }
}

fn facts(file: &Path, options: &ShapeOptions) -> Result<Value> {
    let input = shape_input::read(file, options)?;
    let (points, mesh) = match &input.shape {
        Shape::Mesh(mesh) => (mesh.vertices(), Some(mesh)),
        Shape::Cloud(points) => (points.as_slice(), None),
    };
    // A flat cloud has no hull volume; that is a fact, not a failure.
    let hull_volume = convex_hull(points).map_or(0.0, |hull| hull.volume());
    let bounding_box = minimum_volume_box(points).with_context(|| output::shown(file))?;
    let welded = mesh.map(|m| repair(m.clone()).0);
    let report = welded.as_ref().map(inspect);
    let mut answer = json!({
        "vertices": input.n_vertices,
        "triangles": input.n_triangles,
        "watertight": report.as_ref().is_some_and(|r| r.watertight),
        "volume": welded.as_ref().map_or(0.0, signed_volume).abs(),
        "hull_volume": hull_volume,
        "bounding_box": {
            "center": bounding_box.center.coords.as_slice(),
            "axes": axes(&bounding_box.axes),
            "extents": bounding_box.extents.as_slice(),
            "volume": bounding_box.volume(),
        },
    });
    for (key, value) in input.placement.as_object().into_iter().flatten() {
        answer[key] = value.clone();
    }
    Ok(answer)
}

/// Three unit rows.
pub fn axes(rotation: &nalgebra::Rotation3<f64>) -> Value {
    json!(
        (0..3)
            .map(|k| rotation.matrix().column(k).as_slice().to_vec())
            .collect::<Vec<_>>()
    )
}

/// A box as answers give it.
pub fn box_json(region: &OrientedBox) -> Value {
    json!({
        "center": region.center().coords.as_slice(),
        "axes": axes(region.axes()),
        "extents": region.extents().as_slice(),
        "volume": region.volume(),
    })
}
