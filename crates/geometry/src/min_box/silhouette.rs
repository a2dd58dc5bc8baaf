//! A convex body seen along a direction, and the smallest box with one axis along it.

use nalgebra::{Matrix3, Vector3};

use super::canonical::Candidate;
use crate::planar::{flush_rectangles, planar_hull_into};

/// Up to this many corners all of them are projected; beyond, only those on the outline are.
const SMALL_HULL: usize = 40;

/// Corners of an outline closer than this (bodies have a size near 1) are one.
const SAME_CORNER: f64 = 1e-12;

/// A convex body ready to be measured along many directions.
#[derive(Clone)]
pub(super) struct Silhouette {
    points: Vec<Vector3<f64>>,
    /// Outward normals of the facets, any length.
    normals: Vec<Vector3<f64>>,
    /// Each edge's ends and the two facets that meet in it.
    edges: Vec<[u32; 4]>,
    scratch: Scratch,
}

#[derive(Default, Clone)]
struct Scratch {
    facing: Vec<bool>,
    seen_in: Vec<u32>,
    round: u32,
    on_outline: Vec<u32>,
    flat: Vec<[f64; 2]>,
    order: Vec<u32>,
    corners: Vec<u32>,
    polygon: Vec<[f64; 2]>,
}

impl Silhouette {
    /// `triangles` form a closed surface, outwards.
    pub(super) fn new(points: &[Vector3<f64>], triangles: &[[u32; 3]]) -> Self {
        let normals = triangles
            .iter()
            .map(|t| t.map(|v| points[v as usize]))
            .map(|[a, b, c]| (b - a).cross(&(c - a)));
        let mut halves: Vec<[u32; 3]> = Vec::with_capacity(3 * triangles.len());
        for (facet, &[a, b, c]) in triangles.iter().enumerate() {
            halves.extend([[a, b], [b, c], [c, a]].map(|[p, q]| [p.min(q), p.max(q), facet as u32]));
        }
        halves.sort_unstable();
        let edges = halves
            .chunks_exact(2)
            .map(|pair| [pair[0][0], pair[0][1], pair[0][2], pair[1][2]])
            .collect();
        Self {
            points: points.to_vec(),
            normals: normals.collect(),
            edges,
            scratch: Scratch::default(),
        }
    }

    /// Visits every box with one axis along the unit vector `axis` that is flush with an edge of the outline.
    pub(super) fn boxes_about(&mut self, axis: &Vector3<f64>, mut visit: impl FnMut(Candidate)) {
        // Axes are handed on from box to box: without this their rounding would grow.
        let axis = &axis.normalize();
        let (u, v) = perpendicular(axis);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for p in &self.points {
            let d = axis.dot(p);
            low = low.min(d);
            high = high.max(d);
        }
        self.project(axis, &u, &v);
        flush_rectangles(&self.scratch.polygon, |d, area| {
            let along = u * d[0] + v * d[1];
            let axes = Matrix3::from_columns(&[*axis, along, axis.cross(&along)]);
            visit(Candidate {
                axes,
                size: area * (high - low),
            });
        });
    }

    /// The smallest box with one axis along the unit vector `axis`; exact.
    pub(super) fn best_about(&mut self, axis: &Vector3<f64>) -> Candidate {
        let mut best = Candidate {
            axes: Matrix3::identity(),
            size: f64::INFINITY,
        };
        self.boxes_about(axis, |candidate| {
            if candidate.size < best.size {
                best = candidate;
            }
        });
        best
    }

    /// Size of the box with these axes.
    pub(super) fn size_along(&self, axes: &Matrix3<f64>) -> f64 {
        let inverse = axes.transpose();
        let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        for p in &self.points {
            let local = inverse * p;
            low = low.inf(&local);
            high = high.sup(&local);
        }
        (high - low).product()
    }

    /// Leaves the outline seen along `axis` in the scratch polygon, in coordinates along `u` and `v`.
    fn project(&mut self, axis: &Vector3<f64>, u: &Vector3<f64>, v: &Vector3<f64>) {
        let Self {
            points,
            normals,
            edges,
            scratch,
        } = self;
        scratch.on_outline.clear();
        if points.len() <= SMALL_HULL {
            scratch.on_outline.extend(0..points.len() as u32);
        } else {
            scratch.facing.clear();
            scratch.facing.extend(normals.iter().map(|n| n.dot(axis) > 0.0));
            scratch.seen_in.resize(points.len(), 0);
            scratch.round += 1;
            for &[p, q, f, g] in edges.iter() {
                if scratch.facing[f as usize] != scratch.facing[g as usize] {
                    for end in [p, q] {
                        if std::mem::replace(&mut scratch.seen_in[end as usize], scratch.round)
                            != scratch.round
                        {
                            scratch.on_outline.push(end);
                        }
                    }
                }
            }
        }
        scratch.flat.clear();
        scratch.flat.extend(scratch.on_outline.iter().map(|&i| {
            let p = &points[i as usize];
            [u.dot(p), v.dot(p)]
        }));
        scratch.order.clear();
        scratch.order.extend(0..scratch.flat.len() as u32);
        planar_hull_into(&scratch.flat, &mut scratch.order, &mut scratch.corners);
        scratch.polygon.clear();
        for &i in &scratch.corners {
            let p = scratch.flat[i as usize];
            let is_new = |q: &[f64; 2]| (p[0] - q[0]).abs().max((p[1] - q[1]).abs()) > SAME_CORNER;
            // Corners behind one another make edges whose directions are only rounding.
            if scratch.polygon.last().is_none_or(is_new) && scratch.polygon.first().is_none_or(is_new) {
                scratch.polygon.push(p);
            }
        }
        if scratch.polygon.len() < 3 {
            scratch.polygon.clear();
        }
    }
}

/// Two unit vectors that complete `axis` to a right-handed frame.
pub(super) fn perpendicular(axis: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let u = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize();
    (u, axis.cross(&u).normalize())
}
