//! `prehend mesh FILE…`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use prehend::geometry::{
    OrientedBox, Shape, convex_hull, enclosed_volume, inspect, minimum_volume_box, repair,
};
use rayon::prelude::*;
use serde_json::{Value, json};

use super::shape_input::{self, ShapeOptions};
use crate::output::{self, Outcome};

/// How many files are read before the first of them is answered: enough for any machine's threads.
const AT_ONCE: usize = 64;

/// Facts about meshes and clouds
#[derive(clap::Args)]
#[command(after_help = "Example:\n  prehend mesh objects/mug/*.ply --json")]
pub struct Arguments {
    /// .off .obj .stl .ply .gltf .glb .dae meshes, .ply .xyz .pcd clouds
    #[arg(required = true)]
    files: Vec<PathBuf>,

    #[command(flatten)]
    shape: ShapeOptions,
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        // A few files at once, each part answered in the order of the arguments before the next one begins.
        let text = |v: &Value| format!("{}\n", output::plain(v));
        let mut outcome = Outcome::Done;
        for part in self.files.chunks(AT_ONCE) {
            let answers: Vec<_> = part.par_iter().map(|file| facts(file, &self.shape)).collect();
            let named = shape_input::named(part).map(|(name, _)| name).zip(answers);
            if output::each(json, "file", named, |answer| answer, text)? == Outcome::SomeFailed {
                outcome = Outcome::SomeFailed;
            }
        }
        Ok(outcome)
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
    // What stands in an object's place has been mended already.
    let mended = mesh.map(|m| match input.repairs {
        Some(repairs) => (m.clone(), repairs),
        None => repair(m.clone()),
    });
    let report = mended.as_ref().map(|(mesh, _)| inspect(mesh));
    let volume = mended.as_ref().map(|(mesh, _)| enclosed_volume(mesh));
    let mut answer = json!({
        "vertices": input.n_vertices,
        "triangles": input.n_triangles,
        "watertight": report.as_ref().is_some_and(|r| r.watertight),
        "volume": volume.map_or(0.0, |v| v.volume),
        "volume_method": volume.map(|v| v.method),
        "needs_closed_surface": { "volume": true, "hull_volume": false, "bounding_box": false },
        "components": report.as_ref().map_or(0, |r| r.n_components),
        "boundary_edges": report.as_ref().map_or(0, |r| r.boundary_edges),
        "non_manifold_edges": report.as_ref().map_or(0, |r| r.non_manifold_edges),
        "holes": report.as_ref().map_or(&[][..], |r| &r.holes),
        "repairs": mended.as_ref().map(|(_, repairs)| repairs),
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
