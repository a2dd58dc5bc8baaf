//! Triangles in a tree of bounds: the nearest one to a point, and the first one along a ray.

use nalgebra::{Point3, Vector3};
use parry3d_f64::partitioning::{Bvh, BvhNode};

use crate::{TriMesh, closest, parry_bridge};

/// Triangles and a tree of their bounds.
#[derive(Debug, Clone)]
pub(crate) struct TriangleTree {
    pub(crate) triangles: Vec<[Point3<f64>; 3]>,
    pub(crate) bvh: Bvh,
}

impl TriangleTree {
    pub(crate) fn new(mesh: &TriMesh) -> Self {
        let triangles: Vec<_> = mesh.corners().collect();
        let bvh = parry_bridge::tree(&triangles);
        Self { triangles, bvh }
    }

    pub(crate) fn triangle(&self, triangle_idx: u32) -> &[Point3<f64>; 3] {
        &self.triangles[triangle_idx as usize]
    }

    /// The nearest triangle's point closer than `below`, as (distance, point, triangle).
    pub(crate) fn nearest_point(&self, p: &Point3<f64>, below: f64) -> Option<(f64, Point3<f64>, u32)> {
        // Squared distances are as good to compare, and need no roots.
        let found = self.bvh.find_best(
            (below * below).max(f64::MIN_POSITIVE),
            |node, _| squared_distance(node, p),
            |i, _| {
                let q = closest::on_triangle(p, &self.triangles[i as usize]);
                Some(((q - p).norm_squared(), q))
            },
        );
        found
            .map(|(i, (_, q))| ((q - p).norm(), q, i))
            .filter(|(distance, ..)| *distance < below)
    }

    /// Some triangle with bounds closer to `p` than `below`: the one that a descent towards `p` ends in.
    pub(crate) fn near_triangle(&self, p: &Point3<f64>, below: f64) -> Option<u32> {
        let found = self.bvh.find_best(
            (below * below).max(f64::MIN_POSITIVE),
            |node, _| squared_distance(node, p),
            |_, _| Some(f64::NEG_INFINITY),
        );
        found.map(|(i, _)| i)
    }

    /// Where a ray from `origin` first meets a triangle (either side), as (distance, triangle). `direction` is unit.
    pub(crate) fn cast_ray(
        &self,
        origin: &Point3<f64>,
        direction: &Vector3<f64>,
        max: f64,
    ) -> Option<(f64, u32)> {
        let found = self.bvh.find_best(
            max,
            |node, _| ray_enters(node, origin, direction),
            |i, _| {
                closest::ray_parameter(origin, direction, &self.triangles[i as usize]).filter(|t| *t >= 0.0)
            },
        );
        found.map(|(i, t)| (t, i))
    }
}

fn squared_distance(node: &BvhNode, p: &Point3<f64>) -> f64 {
    let (low, high) = parry_bridge::node_corners(node);
    let beyond = |k: usize| (low[k] - p[k]).max(p[k] - high[k]).max(0.0);
    let [x, y, z] = [beyond(0), beyond(1), beyond(2)];
    x * x + y * y + z * z
}

/// Where a ray enters a node's bounds; infinite where it misses.
fn ray_enters(node: &BvhNode, origin: &Point3<f64>, direction: &Vector3<f64>) -> f64 {
    let (center, half) = parry_bridge::node_bounds(node);
    let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
    for k in 0..3 {
        let offset = center[k] - origin[k];
        if direction[k] == 0.0 {
            if offset.abs() > half[k] {
                return f64::INFINITY;
            }
            continue;
        }
        let (a, b) = (
            (offset - half[k]) / direction[k],
            (offset + half[k]) / direction[k],
        );
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    if enter <= leave { enter } else { f64::INFINITY }
}
