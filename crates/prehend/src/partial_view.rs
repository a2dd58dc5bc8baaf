//! `size` and `cvex` of an object of which only one side was seen.
//!
//! A depth camera shows the near side of an object. How much of it hides behind, and how sure one can be of that, is
//! learned from objects whose meshes are known: [`Scanner::scan`] looks at each of them from many sides with a noisy
//! camera, and [`PartialViewModel::learn`] regresses what the mesh says on what the cloud shows. The answer for a new cloud
//! ([`PartialViewModel::estimate`]) is a mean with a covariance, which a network takes as an uncertain observation, and an
//! interval that was widened until it held as often as it says on objects left out of the regression.
//!
//! ```text
//! log(true / seen) = β · features(cloud, viewpoint) + σ(viewpoint) · e      one regression an axis, and one for cvex
//! interval         = seen · exp(β · features ± q σ),    q: 90 % quantile of |e| over objects left out one at a time
//! ```
//!
//! Quantiles over left-out objects are split-conformal prediction in the jackknife form (Barber, Candès, Ramdas and
//! Tibshirani, "Predictive inference with the jackknife+", 2021), with whole objects in the place of rows, since the
//! views of one object err together.

mod cloud_features;
mod ridge;
mod scanner;

pub use scanner::{PartialCloud, Scanner};

use nalgebra::{Matrix4, Point3, Vector3};
use prehend_geometry::{DecomposeOptions, Decomposition};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::Error;
use cloud_features::{N_FEATURES, cloud_features, spread_features};
use ridge::Ridge;

/// Extents along the object's x, y and z, and cvex.
const N_TARGETS: usize = 4;

/// The names of the targets, as network nodes and columns have them.
pub const TARGETS: [&str; N_TARGETS] = ["size_x", "size_y", "size_z", "cvex"];

/// Share of left-out objects' views that an interval holds.
pub const COVERAGE: f64 = 0.9;

/// Standard deviations (of the logarithm) below this are taken as this: no camera tells a length to 0.2 %.
const LEAST_SPREAD: f64 = 0.002;

/// One look at an object whose mesh is known: what the cloud shows, and what the mesh says.
#[derive(Debug, Clone)]
pub struct View {
    /// Name of the object; views of one object are left out together.
    pub object: String,
    features: [f64; N_FEATURES],
    spread: [f64; 4],
    seen: [f64; N_TARGETS],
    truth: [f64; N_TARGETS],
}

impl View {
    /// A view of the object with this decomposition; `None` where the cloud has too few points to say anything (fewer
    /// than four, or all in one place).
    pub fn new(object: &str, decomposition: &Decomposition, cloud: &PartialCloud) -> Option<Self> {
        let seen = cloud_features(cloud)?;
        let [x, y, z] = prehend_grasp::object_size(&decomposition.root);
        Some(Self {
            object: object.to_owned(),
            spread: spread_features(cloud),
            features: seen.features,
            seen: seen.naive.map(f64::ln),
            truth: [x, y, z, decomposition.cvex].map(f64::ln),
        })
    }
}

/// What one noisy view says about the whole object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Mean and covariance of `size` (m), as evidence of a network.
    pub size: Uncertain,
    /// Mean and covariance of `cvex`, as evidence of a network.
    pub cvex: Uncertain,
    /// For `size_x`, `size_y`, `size_z` and `cvex`: the interval that holds the truth in 90 % of views of objects never
    /// seen before.
    pub interval: [[f64; 2]; N_TARGETS],
}

/// An uncertain observation: `{"mean": […], "covariance": [[…]]}`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Uncertain {
    /// Expected value.
    pub mean: Vec<f64>,
    /// Symmetric, positive definite.
    pub covariance: Vec<Vec<f64>>,
}

/// How to read `size` and `cvex` off partial clouds, learned from known objects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PartialViewModel {
    format: String,
    targets: [Target; N_TARGETS],
    /// Correlation of the four standardised residuals.
    correlation: [[f64; N_TARGETS]; N_TARGETS],
    /// Number of objects and views behind it.
    objects: usize,
    views: usize,
}

/// Regression of one target's logarithm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Target {
    name: String,
    mean: Ridge,
    /// Of ln |residual|: the spread depends on where the camera stands.
    spread: Ridge,
    /// Standard deviation of residual / exp(spread) over left-out objects.
    scale: f64,
    /// The 90 % quantile of |residual| / exp(spread) over left-out objects.
    quantile: f64,
}

const FORMAT: &str = "prehend-partial-view";

impl PartialViewModel {
    /// Learns from views of known objects.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] for fewer than three objects: with one left out, at least two must remain.
    pub fn learn(views: &[View]) -> Result<Self, Error> {
        let objects = objects_of(views);
        if objects.len() < 3 {
            return Err(Error::input(format!(
                "views of {} objects; learning what a view hides needs at least 3",
                objects.len()
            )));
        }
        let left_out: Vec<Vec<[f64; N_TARGETS]>> = objects
            .par_iter()
            .map(|&object| {
                let others: Vec<&View> = views.iter().filter(|v| v.object != object).collect();
                let fits: Vec<(Ridge, Ridge)> = (0..N_TARGETS).map(|k| fit(&others, k)).collect();
                views
                    .iter()
                    .filter(|v| v.object == object)
                    .map(|v| std::array::from_fn(|k| standardised(&fits[k], v, k)))
                    .collect()
            })
            .collect();
        let all: Vec<&View> = views.iter().collect();
        let flat: Vec<[f64; N_TARGETS]> = left_out.iter().flatten().copied().collect();
        let scale: [f64; N_TARGETS] = std::array::from_fn(|k| {
            (flat.iter().map(|r| r[k] * r[k]).sum::<f64>() / flat.len() as f64).sqrt()
        });
        let correlation = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                if i == j {
                    return 1.0;
                }
                let shared = flat.iter().map(|r| r[i] * r[j]).sum::<f64>() / flat.len() as f64;
                // A little shrinkage keeps the matrix positive definite.
                0.98 * shared / (scale[i] * scale[j])
            })
        });
        let targets = std::array::from_fn(|k| {
            let (mean, spread) = fit(&all, k);
            Target {
                name: TARGETS[k].to_owned(),
                mean,
                spread,
                scale: scale[k],
                quantile: quantile_over_objects(&left_out, k),
            }
        });
        Ok(Self {
            format: FORMAT.to_owned(),
            targets,
            correlation,
            objects: objects.len(),
            views: views.len(),
        })
    }

    /// A model from the text that [`PartialViewModel::to_json`] wrote.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] with line and column, or where the text is of another kind of file.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        let model: Self = serde_json::from_str(text).map_err(|e| {
            Error::input(format!(
                "{e}; expected a file that `prehend partial-view learn` wrote"
            ))
        })?;
        if model.format != FORMAT {
            return Err(Error::input(format!(
                "found format `{}`, expected `{FORMAT}`",
                model.format
            )));
        }
        Ok(model)
    }

    /// The model as text, for [`PartialViewModel::from_json`].
    ///
    /// # Panics
    ///
    /// Never: numbers and names have a JSON form.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("numbers and names always have a JSON form")
    }

    /// What a cloud says about the whole object.
    ///
    /// Where ln y is normal with mean μ and covariance Σ, E yᵢ = exp(μᵢ + Σᵢᵢ/2) and
    /// cov(yᵢ, yⱼ) = E yᵢ E yⱼ (exp Σᵢⱼ − 1); these are the moments of the answer.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] where the cloud has fewer than four points apart from one another.
    pub fn estimate(&self, cloud: &PartialCloud) -> Result<Estimate, Error> {
        let seen = cloud_features(cloud).ok_or_else(|| {
            Error::input(format!(
                "found a cloud of {} points, expected at least four that do not fall together",
                cloud.points.len()
            ))
        })?;
        let spread_of = spread_features(cloud);
        let log_mean: [f64; N_TARGETS] =
            std::array::from_fn(|k| seen.naive[k].ln() + self.targets[k].mean.predict(&seen.features));
        let unit: [f64; N_TARGETS] =
            std::array::from_fn(|k| self.targets[k].spread.predict(&spread_of).exp().max(LEAST_SPREAD));
        let log_covariance = Matrix4::from_fn(|i, j| {
            self.correlation[i][j] * unit[i] * self.targets[i].scale * unit[j] * self.targets[j].scale
        });
        let mean: [f64; N_TARGETS] =
            std::array::from_fn(|k| (log_mean[k] + log_covariance[(k, k)] / 2.0).exp());
        let covariance = |i: usize, j: usize| mean[i] * mean[j] * log_covariance[(i, j)].exp_m1();
        let interval = std::array::from_fn(|k| {
            let reach = self.targets[k].quantile * unit[k];
            [(log_mean[k] - reach).exp(), (log_mean[k] + reach).exp()]
        });
        Ok(Estimate {
            size: Uncertain {
                mean: mean[..3].to_vec(),
                covariance: (0..3)
                    .map(|i| (0..3).map(|j| covariance(i, j)).collect())
                    .collect(),
            },
            cvex: Uncertain {
                mean: vec![mean[3]],
                covariance: vec![vec![covariance(3, 3)]],
            },
            interval,
        })
    }
}

/// How well intervals hold on objects that were left out, one at a time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coverage {
    /// Number of objects.
    pub objects: usize,
    /// Number of views.
    pub views: usize,
    /// One entry each for `size_x`, `size_y`, `size_z` and `cvex`.
    pub targets: [TargetCoverage; N_TARGETS],
}

/// How well one feature is told from one view.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TargetCoverage {
    /// The feature.
    pub name: &'static str,
    /// Share of views whose 90 % interval holds the truth, each object counting once.
    pub held: f64,
    /// The least such share of any one object.
    pub held_worst_object: f64,
    /// Median of upper over lower end.
    pub median_ratio: f64,
    /// Median of |ln(estimate / truth)|.
    pub error: f64,
    /// The same of what the cloud itself shows, with nothing learned.
    pub error_as_seen: f64,
}

/// Leaves out each object in turn, learns from the others (quantiles included) and looks at the object's views.
///
/// # Errors
///
/// As [`PartialViewModel::learn`], with one object fewer.
pub fn coverage(views: &[View]) -> Result<Coverage, Error> {
    let objects = objects_of(views);
    let models = objects
        .iter()
        .map(|object| {
            let others: Vec<View> = views.iter().filter(|v| v.object != *object).cloned().collect();
            Ok((*object, PartialViewModel::learn(&others)?))
        })
        .collect::<Result<Vec<_>, Error>>()?;
    let targets = std::array::from_fn(|k| {
        let (mut held, mut ratios, mut errors, mut as_seen) = (vec![], vec![], vec![], vec![]);
        for (object, model) in &models {
            let own: Vec<&View> = views.iter().filter(|v| v.object == *object).collect();
            let mut inside = 0_usize;
            for view in &own {
                let target = &model.targets[k];
                let mean = view.seen[k] + target.mean.predict(&view.features);
                let reach = target.quantile * target.spread.predict(&view.spread).exp().max(LEAST_SPREAD);
                inside += usize::from((view.truth[k] - mean).abs() <= reach);
                ratios.push((2.0 * reach).exp());
                errors.push((view.truth[k] - mean).abs());
                as_seen.push((view.truth[k] - view.seen[k]).abs());
            }
            held.push(inside as f64 / own.len() as f64);
        }
        TargetCoverage {
            name: TARGETS[k],
            held: held.iter().sum::<f64>() / held.len() as f64,
            held_worst_object: held.iter().copied().fold(1.0, f64::min),
            median_ratio: median(&mut ratios),
            error: median(&mut errors),
            error_as_seen: median(&mut as_seen),
        }
    });
    Ok(Coverage {
        objects: objects.len(),
        views: views.len(),
        targets,
    })
}

/// Views of known objects: each mesh scanned from every side of `scanner`, in order.
pub fn scan_all(shapes: &[crate::stages::decompose::Shape], scanner: &Scanner) -> Vec<View> {
    shapes
        .par_iter()
        .map(|shape| {
            let clouds = scanner.scan(&shape.object.name, &shape.object.mesh);
            clouds
                .iter()
                .filter_map(|cloud| View::new(&shape.object.name, &shape.decomposition, cloud))
                .collect::<Vec<_>>()
        })
        .collect::<Vec<_>>()
        .concat()
}

fn objects_of(views: &[View]) -> Vec<&str> {
    let mut names: Vec<&str> = views.iter().map(|v| v.object.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    names
}

/// Regressions of one target and of the logarithm of its error.
fn fit(views: &[&View], k: usize) -> (Ridge, Ridge) {
    let weights = weights_per_object(views);
    let rows = views.iter().map(|v| v.features.to_vec());
    let hidden = views.iter().map(|v| v.truth[k] - v.seen[k]);
    let mean = Ridge::fit_robust(rows, hidden, &weights);
    let errors: Vec<f64> = views
        .iter()
        .map(|v| error_of(&mean, v, k).abs().max(LEAST_SPREAD).ln())
        .collect();
    let spread = Ridge::fit(
        views.iter().map(|v| v.spread.to_vec()),
        errors.into_iter(),
        &weights,
    );
    (mean, spread)
}

/// Every object weighs the same, however many of its views could be used.
fn weights_per_object(views: &[&View]) -> Vec<f64> {
    let mut counts = std::collections::BTreeMap::new();
    for v in views {
        *counts.entry(v.object.as_str()).or_insert(0.0) += 1.0;
    }
    views.iter().map(|v| 1.0 / counts[v.object.as_str()]).collect()
}

fn standardised((mean, spread): &(Ridge, Ridge), view: &View, k: usize) -> f64 {
    error_of(mean, view, k) / spread.predict(&view.spread).exp().max(LEAST_SPREAD)
}

fn error_of(mean: &Ridge, view: &View, k: usize) -> f64 {
    view.truth[k] - view.seen[k] - mean.predict(&view.features)
}

/// The quantile of |e| with each object's views sharing a weight of one, and one more object at infinity, as conformal
/// prediction has it.
fn quantile_over_objects(left_out: &[Vec<[f64; N_TARGETS]>], k: usize) -> f64 {
    let mut weighted: Vec<(f64, f64)> = left_out
        .iter()
        .flat_map(|rows| rows.iter().map(|r| (r[k].abs(), 1.0 / rows.len() as f64)))
        .collect();
    weighted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let wanted = COVERAGE * (left_out.len() + 1) as f64;
    let mut sum = 0.0;
    for (value, weight) in &weighted {
        sum += weight;
        if sum >= wanted {
            return *value;
        }
    }
    // With fewer than nine objects no finite interval holds for sure; the largest error seen is the best there is.
    weighted.last().map_or(f64::INFINITY, |w| w.0)
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The boxes of a cloud: every point becomes a speck of a triangle, so that the same fit and split as for meshes applies.
fn decompose_cloud(points: &[Point3<f64>]) -> Option<Decomposition> {
    /// Half a millimetre is far below a camera's noise.
    const SPECK: f64 = 2.5e-4;
    let corners = [
        Vector3::new(1.0, -1.0, -1.0),
        Vector3::new(-1.0, 1.0, -1.0),
        Vector3::new(-1.0, -1.0, 1.0),
    ];
    let vertices = points
        .iter()
        .flat_map(|p| corners.map(|c| p + c * SPECK))
        .collect();
    let triangles = (0..u32::try_from(points.len()).ok()?)
        .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
        .collect();
    let mesh = prehend_geometry::TriMesh::new(vertices, triangles).ok()?;
    prehend_geometry::decompose(&mesh, &DecomposeOptions::default()).ok()
}
