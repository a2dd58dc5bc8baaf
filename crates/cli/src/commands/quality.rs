//! `prehend quality FILE`

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use nalgebra::{Point3, UnitVector3, Vector3};
use prehend::geometry::ContactPoint;
use prehend::quality::{
    ConeShape, Contact, EpsilonSolver, GraspWrenchSpace, LengthUnit, LimitSurface, Norm, Quality,
    QualityOptions, TaskWrenches, Uncertainty, WrenchAxes, WrenchMetric, epsilon_distribution,
    epsilon_sensitivity, grasp_quality_with,
};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::output::{self, Outcome};

/// How well contacts hold
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  echo '{\"center\":[0,0,0],\"torque_scale\":0.05,\"contacts\":[{\"point\":[0.05,0,0],\"normal\":[-1,0,0],\"mu\":1,\"torsion\":0.002},\
{\"point\":[-0.05,0,0],\"normal\":[1,0,0],\"mu\":1,\"torsion\":0.002}]}' | prehend quality - --json\n\
All keys and what they mean: docs/epsilon.md"
)]
pub struct Arguments {
    /// JSON lines: center, torque_scale, contacts, and options; - is standard input. Every length is in "length_unit",
    /// "m" or "mm"
    file: PathBuf,

    /// Also the volume of the grasp wrench space (builds the whole hull)
    #[arg(long)]
    volume: bool,

    /// Also how ε changes with each contact's point, normal and friction
    #[arg(long)]
    sensitivity: bool,

    /// Samples for the distribution of ε, for lines with the key "uncertainty"
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..))]
    samples: u32,

    /// Seed of these samples
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    center: [f64; 3],
    torque_scale: f64,
    cone_edges: Option<usize>,
    cone: Option<ConeName>,
    #[serde(default)]
    limit_surface: SurfaceName,
    #[serde(default)]
    norm: NormName,
    contacts: Vec<ContactLine>,
    #[serde(default)]
    length_unit: UnitName,
    gravity: Option<[f64; 3]>,
    axes: Option<Vec<AxisName>>,
    metric_semi_axes: Option<[f64; 6]>,
    task: Option<Task>,
    uncertainty: Option<Uncertainty>,
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

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum ConeName {
    Smooth,
    Edges,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "lowercase")]
enum SurfaceName {
    #[default]
    Samples,
    Ellipsoid,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "lowercase")]
enum AxisName {
    Fx,
    Fy,
    Fz,
    Tx,
    Ty,
    Tz,
}

/// A task's set of disturbances, by name.
#[derive(Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
enum Task {
    Pouring { up: [f64; 3], axis: [f64; 3] },
    Hammering { head: [f64; 3], blow: [f64; 3] },
    HandOver { up: [f64; 3], pull: [f64; 3] },
    Wrenches(Vec<[f64; 6]>),
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        let mut solver = EpsilonSolver::default();
        output::each_json_line(json, &self.file, |v| self.quality(v, &mut solver), output::plain)
    }

    fn quality(&self, value: Value, solver: &mut EpsilonSolver) -> Result<Value> {
        let line: Line =
            serde_json::from_value(value).context("expected center, torque_scale and contacts")?;
        let contacts = line.contacts()?;
        let options = line.options(self.volume)?;
        let quality = grasp_quality_with(&contacts, &options, solver)?;
        let mut answer = answer(&quality);
        if self.volume {
            answer["volume"] = json!(quality.volume);
        }
        let needs_space =
            line.task.is_some() || options.cone == ConeShape::Smooth || has_ellipsoid(&options, &contacts);
        if needs_space {
            let space = GraspWrenchSpace::new(&contacts, &options)?;
            if !space.is_polyhedral() {
                let bounds = solver.bounds(&space)?;
                answer["bounds"] = json!({ "lower": bounds.lower, "upper": bounds.upper });
            }
            if let Some(task) = &line.task {
                let wrenches = task.wrenches(&options)?;
                let scale = wrenches.scale(&space);
                answer["task_scale"] = json!(scale.scale);
                answer["task_limiting_wrench"] = json!(wrenches.wrenches()[scale.limiting].as_slice());
            }
        }
        if self.sensitivity {
            answer["sensitivity"] = epsilon_sensitivity(&contacts, &options)?
                .iter()
                .map(|s| {
                    json!({ "point": s.point.as_slice(), "normal": s.normal.as_slice(), "mu": s.mu, "kink": s.kink })
                })
                .collect();
        }
        if let Some(uncertainty) = &line.uncertainty {
            let samples = self.samples as usize;
            let distribution = epsilon_distribution(&contacts, &options, uncertainty, samples, self.seed)?;
            answer["distribution"] = serde_json::to_value(distribution)?;
        }
        Ok(answer)
    }
}

fn answer(quality: &Quality) -> Value {
    json!({
        "epsilon": quality.epsilon,
        "force_closure": quality.force_closure,
        "origin_distance": quality.origin_distance,
        "rank": quality.rank,
        "limiting_wrench": quality.limiting_wrench.as_slice(),
    })
}

fn has_ellipsoid(options: &QualityOptions, contacts: &[Contact]) -> bool {
    options.limit_surface == LimitSurface::Ellipsoid && contacts.iter().any(|c| c.torsion > 0.0)
}

impl Line {
    fn contacts(&self) -> Result<Vec<Contact>> {
        let contact =
            |(i, c): (usize, &ContactLine)| match UnitVector3::try_new(Vector3::from(c.normal), 1e-9) {
                Some(normal) if normal.iter().all(|x| x.is_finite()) => Ok(Contact {
                    at: ContactPoint {
                        point: Point3::from(c.point),
                        normal,
                    },
                    mu: c.mu,
                    torsion: c.torsion,
                }),
                _ => bail!(
                    "contact {i}: the normal {:?} has no direction; give a unit vector into the object",
                    c.normal
                ),
            };
        self.contacts.iter().enumerate().map(contact).collect()
    }

    fn options(&self, volume: bool) -> Result<QualityOptions> {
        let cone = match (&self.cone, self.cone_edges) {
            (Some(ConeName::Smooth), None) => ConeShape::Smooth,
            (Some(ConeName::Smooth), Some(edges)) => {
                bail!("`cone` is \"smooth\" and `cone_edges` is {edges}; give one of them")
            }
            (_, edges) => ConeShape::Edges(edges.unwrap_or(8)),
        };
        let axes = match &self.axes {
            None => WrenchAxes::ALL,
            Some(names) => {
                let mut counts = [false; 6];
                for name in names {
                    counts[*name as usize] = true;
                }
                WrenchAxes::new(counts)?
            }
        };
        let metric = self
            .metric_semi_axes
            .map(WrenchMetric::from_semi_axes)
            .transpose()?;
        Ok(QualityOptions {
            cone,
            limit_surface: match self.limit_surface {
                SurfaceName::Samples => LimitSurface::Samples,
                SurfaceName::Ellipsoid => LimitSurface::Ellipsoid,
            },
            norm: match self.norm {
                NormName::L1 => Norm::L1,
                NormName::Linf => Norm::LInf,
            },
            length_unit: match self.length_unit {
                UnitName::Metre => LengthUnit::Metre,
                UnitName::Millimetre => LengthUnit::Millimetre,
            },
            gravity: self.gravity.map_or_else(Vector3::zeros, Vector3::from),
            axes,
            metric,
            volume,
            ..QualityOptions::new(Point3::from(self.center), self.torque_scale)
        })
    }
}

impl Task {
    fn wrenches(&self, options: &QualityOptions) -> Result<TaskWrenches> {
        let unit = |name: &str, v: &[f64; 3]| {
            UnitVector3::try_new(Vector3::from(*v), 1e-12)
                .with_context(|| format!("task: `{name}` is {v:?}; expected a direction"))
        };
        Ok(match self {
            Self::Pouring { up, axis } => TaskWrenches::pouring(&unit("up", up)?, &unit("axis", axis)?),
            Self::Hammering { head, blow } => TaskWrenches::hammering(
                &Point3::from(*head),
                &unit("blow", blow)?,
                &options.center,
                options.torque_scale,
            ),
            Self::HandOver { up, pull } => TaskWrenches::handing_over(&unit("up", up)?, &unit("pull", pull)?),
            Self::Wrenches(list) => TaskWrenches::new(list.iter().map(|w| (*w).into()).collect())?,
        })
    }
}
