//! `prehend quality FILE`

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use nalgebra::{Point3, UnitVector3, Vector3};
use prehend::geometry::ContactPoint;
use prehend::quality::{ConeShape, Contact, LengthUnit, Norm, QualityOptions, grasp_quality};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::output::{self, Outcome};

/// How well contacts hold
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  echo '{\"center\":[0,0,0],\"torque_scale\":0.05,\"contacts\":[{\"point\":[0.05,0,0],\"normal\":[-1,0,0],\"mu\":1,\"torsion\":0.002},\
{\"point\":[-0.05,0,0],\"normal\":[1,0,0],\"mu\":1,\"torsion\":0.002}]}' | prehend quality - --json"
)]
pub struct Arguments {
    /// JSON lines: center, torque_scale, contacts, and options; - is standard input. Every length is in "length_unit",
    /// "m" or "mm"
    file: PathBuf,

    /// Also the volume of the grasp wrench space (builds the whole hull)
    #[arg(long)]
    volume: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    center: [f64; 3],
    torque_scale: f64,
    #[serde(default = "eight")]
    cone_edges: usize,
    #[serde(default)]
    norm: NormName,
    contacts: Vec<ContactLine>,
    #[serde(default)]
    length_unit: UnitName,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ContactLine {
    point: [f64; 3],
    normal: [f64; 3],
    mu: f64,
    #[serde(default)]
    torsion: f64,
    #[serde(default, rename = "link")]
    _link: Option<String>,
}

#[derive(Deserialize, Default)]
enum NormName {
    #[default]
    #[serde(rename = "l1", alias = "L1")]
    L1,
    #[serde(rename = "linf", alias = "Linf", alias = "LInf")]
    Linf,
}

#[derive(Deserialize, Default)]
enum UnitName {
    #[default]
    #[serde(rename = "m")]
    Metre,
    #[serde(rename = "mm")]
    Millimetre,
}

fn eight() -> usize {
    8
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        output::each_json_line(json, &self.file, |v| quality(v, self.volume), output::plain)
    }
}

fn quality(value: Value, volume: bool) -> Result<Value> {
    let line: Line = serde_json::from_value(value).context("expected center, torque_scale and contacts")?;
    let contact = |(i, c): (usize, &ContactLine)| {
        let normal = Vector3::from(c.normal);
        match UnitVector3::try_new(normal, 1e-9) {
            Some(unit) if unit.iter().all(|x| x.is_finite()) => {
                let at = ContactPoint {
                    point: Point3::from(c.point),
                    normal: unit,
                };
                Ok(Contact {
                    at,
                    mu: c.mu,
                    torsion: c.torsion,
                })
            }
            _ => bail!(
                "contact {i}: the normal {:?} has no direction; give a unit vector into the object",
                c.normal
            ),
        }
    };
    let contacts = line
        .contacts
        .iter()
        .enumerate()
        .map(contact)
        .collect::<Result<Vec<_>>>()?;
    let options = QualityOptions {
        cone: ConeShape::Edges(line.cone_edges),
        norm: match line.norm {
            NormName::L1 => Norm::L1,
            NormName::Linf => Norm::LInf,
        },
        length_unit: match line.length_unit {
            UnitName::Metre => LengthUnit::Metre,
            UnitName::Millimetre => LengthUnit::Millimetre,
        },
        volume,
        ..QualityOptions::new(Point3::from(line.center), line.torque_scale)
    };
    let quality = grasp_quality(&contacts, &options)?;
    let mut answer = json!({
        "epsilon": quality.epsilon,
        "force_closure": quality.force_closure,
        "origin_distance": quality.origin_distance,
        "rank": quality.rank,
    });
    if volume {
        answer["volume"] = json!(quality.volume);
    }
    Ok(answer)
}
