//! `prehend free-volume FILE`

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use nalgebra::Point3;
use prehend::geometry::{OrientedBox, Tetrahedron, largest_tetrahedron, union_volume};
use prehend::grasp::free_volume_of_hull;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::output::{self, Outcome};

/// Share of a decomposition that a grasp leaves free
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  echo '{\"palm\":[0,0,0.1],\"contacts\":[[0.05,0,0],[-0.05,0,0],[0,0.05,0]],\"boxes\":[{\"center\":[0,0,0],\
\"axes\":[[1,0,0],[0,1,0],[0,0,1]],\"extents\":[0.1,0.1,0.1]}]}' | prehend free-volume - --json"
)]
pub struct Arguments {
    /// JSON lines: tetrahedron (or palm and contacts) and boxes; - is standard input
    file: PathBuf,

    /// Also `fvol_hull`, of the hull of palm and all contacts, where these are given
    #[arg(long)]
    hull: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    tetrahedron: Option<[[f64; 3]; 4]>,
    palm: Option<[f64; 3]>,
    contacts: Option<Vec<[f64; 3]>>,
    boxes: Vec<OrientedBox>,
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        let mut union = UnionOfBoxes::default();
        output::each_json_line(
            json,
            &self.file,
            |v| free_volume(v, self.hull, &mut union),
            output::plain,
        )
    }
}

/// The volume of the last line's boxes: lines about one object follow each other.
#[derive(Default)]
struct UnionOfBoxes {
    boxes: Vec<OrientedBox>,
    volume: f64,
}

impl UnionOfBoxes {
    fn volume(&mut self, boxes: &[OrientedBox]) -> f64 {
        if self.boxes != boxes {
            self.boxes = boxes.to_vec();
            self.volume = union_volume(boxes);
        }
        self.volume
    }
}

fn free_volume(value: Value, hull: bool, union: &mut UnionOfBoxes) -> Result<Value> {
    let line: Line =
        serde_json::from_value(value).context("expected tetrahedron or palm and contacts, and boxes")?;
    if line.boxes.is_empty() {
        bail!("`boxes` is empty; the free volume of nothing is not defined");
    }
    let (tetrahedron, fvol_hull) = match (line.tetrahedron, line.palm, line.contacts) {
        (Some(corners), None, None) => (Some(Tetrahedron(corners.map(Point3::from))), None),
        (None, Some(palm), Some(contacts)) => {
            let palm = Point3::from(palm);
            let contacts: Vec<Point3<f64>> = contacts.into_iter().map(Point3::from).collect();
            let of_hull = hull.then(|| free_volume_of_hull(&palm, &contacts, &line.boxes));
            (largest_tetrahedron(palm, &contacts), of_hull)
        }
        _ => bail!("expected either `tetrahedron`, or `palm` and `contacts`"),
    };
    if tetrahedron
        .iter()
        .flat_map(|t| t.0)
        .any(|p| p.coords.iter().any(|c| !c.is_finite()))
    {
        bail!("`tetrahedron`: every coordinate must be finite");
    }
    let total: f64 = line.boxes.iter().map(OrientedBox::volume).sum();
    let per_box: Vec<f64> = line
        .boxes
        .iter()
        // Adding 0 turns -0 into 0.
        .map(|b| tetrahedron.map_or(0.0, |t| t.intersection_volume(b)) + 0.0)
        .collect();
    let occupied: f64 = per_box.iter().sum();
    let occupied_once = tetrahedron.map_or(0.0, |t| t.union_volume(&line.boxes));
    let fvol_union = 1.0 - occupied_once / union.volume(&line.boxes);
    let mut answer = json!({
        "tetrahedron": tetrahedron.map_or(0.0, |t| t.volume()),
        "occupied": occupied,
        "per_box": per_box,
        "fvol": (1.0 - occupied / total).clamp(0.0, 1.0),
        "fvol_union": fvol_union.clamp(0.0, 1.0),
    });
    if let Some(fvol_hull) = fvol_hull {
        answer["fvol_hull"] = json!(fvol_hull);
    }
    Ok(answer)
}
