//! What a partial cloud shows of size and shape.

use nalgebra::Vector3;
use prehend_geometry::convex_hull;

use super::{PartialCloud, decompose_cloud};

/// Number of features of the mean.
pub(super) const N_FEATURES: usize = 23;

/// A length below this is taken as this (m), so that logarithms stay finite.
const LEAST_EXTENT: f64 = 5e-4;

/// What a cloud shows.
pub(super) struct Seen {
    /// For the regressions.
    pub features: [f64; N_FEATURES],
    /// `size` and `cvex` of the cloud as if it were the whole object.
    pub naive: [f64; 4],
}

/// `None` for fewer than four points, or points that fall together.
pub(super) fn cloud_features(cloud: &PartialCloud) -> Option<Seen> {
    if cloud.points.len() < 4 {
        return None;
    }
    let (low, high) = cloud.points.iter().fold(
        (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)),
        |(l, h), p| (l.inf(&p.coords), h.sup(&p.coords)),
    );
    let straight = (high - low).map(|e| e.max(LEAST_EXTENT).ln());
    if (high - low).max() < LEAST_EXTENT {
        return None;
    }
    let boxes = decompose_cloud(&cloud.points)?;
    let tight = prehend_grasp::object_size(&boxes.root).map(|e| e.max(LEAST_EXTENT).ln());
    let hull = convex_hull(&cloud.points).map_or(0.0, |h| h.volume());
    let fill = (hull / boxes.root.volume()).clamp(1e-3, 1.0).ln();
    let toward = toward_camera(cloud).map(f64::abs);
    let mean = tight.iter().sum::<f64>() / 3.0;
    // Most objects are about as deep as they are wide; how much shorter the hidden direction looks than the open one tells
    // how much of it hides.
    let widest = tight[0].max(tight[1]);
    let lacking = [widest - tight[0], widest - tight[1]];
    let features = [
        straight.x,
        straight.y,
        straight.z,
        tight[0],
        tight[1],
        tight[2],
        boxes.cvex.ln(),
        fill,
        toward.x,
        toward.y,
        toward.z,
        // What faces the camera hides its own depth: the more, the flatter it looks beside its other extents.
        toward.x * (mean - tight[0]),
        toward.y * (mean - tight[1]),
        toward.z * (mean - tight[2]),
        toward.x * toward.x * lacking[0],
        toward.y * toward.y * lacking[1],
        toward.x * toward.x,
        toward.y * toward.y,
        toward.z * toward.z,
        lacking[0],
        lacking[1],
        toward.x * fill,
        toward.y * fill,
    ];
    Some(Seen {
        features,
        naive: [tight[0].exp(), tight[1].exp(), tight[2].exp(), boxes.cvex],
    })
}

/// What the error's size depends on.
pub(super) fn spread_features(cloud: &PartialCloud) -> [f64; 4] {
    let toward = toward_camera(cloud).map(f64::abs);
    [
        toward.x,
        toward.y,
        toward.z,
        (cloud.points.len().max(1) as f64).ln(),
    ]
}

/// Unit vector from the cloud's middle to the camera; zero where the camera is in it.
fn toward_camera(cloud: &PartialCloud) -> Vector3<f64> {
    let n = cloud.points.len().max(1) as f64;
    let middle = cloud.points.iter().fold(Vector3::zeros(), |s, p| s + p.coords) / n;
    (cloud.viewpoint.coords - middle)
        .try_normalize(1e-12)
        .unwrap_or_else(Vector3::zeros)
}
