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
        let found = self.bvh.find_best(
            below,
            |node, _| node_distance(node, p),
            |i, _| {
                let q = closest::on_triangle(p, &self.triangles[i as usize]);
                Some(((q - p).norm(), q))
            },
        );
        found.map(|(i, (d, q))| (d, q, i))
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

fn node_distance(node: &BvhNode, p: &Point3<f64>) -> f64 {
    let (center, half) = parry_bridge::node_bounds(node);
    ((p.coords - Vector3::from(center)).abs() - Vector3::from(half))
        .sup(&Vector3::zeros())
        .norm()
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
