//! A convex body whose corners know their neighbours: farthest corners by climbing, outlines by walking around.

use nalgebra::{Matrix3, Vector3};

use super::canonical::Candidate;
use crate::planar::{flush_rectangles, planar_hull_into};

/// Corners of an outline closer than this (bodies have a size near 1) are one.
const SAME_CORNER: f64 = 1e-12;

/// An outline that turns the wrong way by more than this (sine) was followed wrongly.
const WRONG_TURN: f64 = 1e-9;

/// How far the direction is turned (rad) in which an outline starts.
const TILT: f64 = 1e-7;

/// Cross products of an outline's edges are rounding below this.
const CROSS_ROUNDING: f64 = 1e-15;

/// A convex body of a size near 1, ready to be measured in many directions.
pub(crate) struct Body {
    pub(crate) points: Vec<Vector3<f64>>,
    /// Neighbours of corner `i` are `neighbours[first[i]..first[i + 1]]`.
    first: Vec<u32>,
    neighbours: Vec<u32>,
}

/// Memory that measuring uses again and again.
#[derive(Default)]
pub(crate) struct Scratch {
    outline: Vec<[f64; 2]>,
    flat: Vec<[f64; 2]>,
    order: Vec<u32>,
    corners: Vec<u32>,
}

impl Body {
    /// `triangles` form a closed surface, outwards.
    pub(crate) fn new(points: Vec<Vector3<f64>>, triangles: &[[u32; 3]]) -> Self {
        // On a closed surface every edge runs once in each direction.
        let directed = || triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let mut first = vec![0_u32; points.len() + 1];
        for [from, _] in directed() {
            first[from as usize + 1] += 1;
        }
        for i in 1..first.len() {
            first[i] += first[i - 1];
        }
        let mut free = first.clone();
        let mut neighbours = vec![0; 3 * triangles.len()];
        for [from, to] in directed() {
            let slot = &mut free[from as usize];
            neighbours[*slot as usize] = to;
            *slot += 1;
        }
        Self {
            points,
            first,
            neighbours,
        }
    }

    pub(super) fn neighbours(&self, corner: u32) -> &[u32] {
        let i = corner as usize;
        &self.neighbours[self.first[i] as usize..self.first[i + 1] as usize]
    }

    /// The corner farthest along `direction`, climbing from a corner that may be near it.
    pub(super) fn farthest(&self, direction: &Vector3<f64>, start: u32) -> u32 {
        let mut at = start;
        let mut height = direction.dot(&self.points[at as usize]);
        loop {
            let mut next = at;
            for &other in self.neighbours(at) {
                let h = direction.dot(&self.points[other as usize]);
                if h > height {
                    (next, height) = (other, h);
                }
            }
            if next == at {
                return at;
            }
            at = next;
        }
    }

    /// The corners farthest along each axis, ahead and behind, climbing from those given; and the three widths.
    pub(super) fn widths(&self, axes: &Matrix3<f64>, extremes: &mut [u32; 6]) -> Vector3<f64> {
        Vector3::from_fn(|k, _| {
            let axis: Vector3<f64> = axes.column(k).into();
            extremes[2 * k] = self.farthest(&axis, extremes[2 * k]);
            extremes[2 * k + 1] = self.farthest(&-axis, extremes[2 * k + 1]);
            let [high, low] = [2 * k, 2 * k + 1].map(|side| self.points[extremes[side] as usize]);
            axis.dot(&(high - low))
        })
    }

    /// Size of the box with these axes, looking at every corner.
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

    /// Visits every box with one axis along `axis` that is flush with an edge of the outline.
    pub(super) fn boxes_about(
        &self,
        axis: &Vector3<f64>,
        scratch: &mut Scratch,
        mut visit: impl FnMut(Candidate),
    ) {
        self.extents_about(axis, scratch, |axes, extents| {
            visit(Candidate {
                axes,
                size: extents.product(),
            });
        });
    }

    /// As [`Body::boxes_about`]: `visit(axes, extents)`, `axis` the first of the axes.
    pub(crate) fn extents_about(
        &self,
        axis: &Vector3<f64>,
        scratch: &mut Scratch,
        mut visit: impl FnMut(Matrix3<f64>, Vector3<f64>),
    ) {
        // Axes are handed on from box to box: without this their rounding would grow.
        let axis = &axis.normalize();
        let (u, v) = perpendicular(axis);
        let ahead = self.farthest(axis, 0);
        let behind = self.farthest(&-axis, 0);
        let depth = axis.dot(&(self.points[ahead as usize] - self.points[behind as usize]));
        if !self.walk_outline(&u, &v, &mut scratch.outline) {
            self.project(&u, &v, scratch);
        }
        flush_rectangles(&scratch.outline, |d, [width, height]| {
            let along = u * d[0] + v * d[1];
            let axes = Matrix3::from_columns(&[*axis, along, axis.cross(&along)]);
            visit(axes, Vector3::new(depth, width, height));
        });
    }

    /// The smallest box with one axis along `axis`; exact.
    pub(super) fn best_about(&self, axis: &Vector3<f64>, scratch: &mut Scratch) -> Candidate {
        let mut best = Candidate {
            axes: Matrix3::identity(),
            size: f64::INFINITY,
        };
        self.boxes_about(axis, scratch, |candidate| {
            if candidate.size < best.size {
                best = candidate;
            }
        });
        best
    }

    /// Follows the outline in the plane of `u` and `v` from corner to neighbouring corner, counter-clockwise.
    ///
    /// False where rounding or edges seen end-on leave the way open; the outline is then incomplete.
    fn walk_outline(&self, u: &Vector3<f64>, v: &Vector3<f64>, outline: &mut Vec<[f64; 2]>) -> bool {
        let seen = |corner: u32| {
            let p = &self.points[corner as usize];
            [u.dot(p), v.dot(p)]
        };
        outline.clear();
        // Of corners equally far along u, the last one on the way around: a true corner of the outline.
        let mut at = self.farthest(&(u + v * TILT), 0);
        let start = seen(at);
        let mut here = start;
        let mut heading = [0.0, 1.0];
        for _ in 0..=self.points.len() {
            let mut best: Option<(u32, [f64; 2])> = None;
            for &other in self.neighbours(at) {
                let there = seen(other);
                let edge = [there[0] - here[0], there[1] - here[1]];
                let ahead = dot(heading, edge);
                let aside = cross(heading, edge);
                if ahead.abs().max(aside.abs()) < SAME_CORNER {
                    continue;
                }
                if aside < -WRONG_TURN {
                    return false;
                }
                // Not back along the line it came.
                if ahead < 0.0 && aside <= -WRONG_TURN * ahead {
                    continue;
                }
                let is_better = best.is_none_or(|(_, known)| {
                    let turn = cross(known, edge);
                    turn < -CROSS_ROUNDING || turn <= CROSS_ROUNDING && dot(edge, edge) > dot(known, known)
                });
                if is_better {
                    best = Some((other, edge));
                }
            }
            let Some((next, edge)) = best else { return false };
            let length = dot(edge, edge).sqrt();
            heading = [edge[0] / length, edge[1] / length];
            outline.push(here);
            at = next;
            here = seen(at);
            if (here[0] - start[0]).abs().max((here[1] - start[1]).abs()) < SAME_CORNER {
                return outline.len() >= 3;
            }
        }
        false
    }

    /// Leaves the outline in the plane of `u` and `v` in the scratch, found from all corners; empty where it is flat.
    fn project(&self, u: &Vector3<f64>, v: &Vector3<f64>, scratch: &mut Scratch) {
        scratch.flat.clear();
        scratch
            .flat
            .extend(self.points.iter().map(|p| [u.dot(p), v.dot(p)]));
        scratch.order.clear();
        scratch.order.extend(0..scratch.flat.len() as u32);
        planar_hull_into(&scratch.flat, &mut scratch.order, &mut scratch.corners);
        scratch.outline.clear();
        for &i in &scratch.corners {
            let p = scratch.flat[i as usize];
            let is_new = |q: &[f64; 2]| (p[0] - q[0]).abs().max((p[1] - q[1]).abs()) > SAME_CORNER;
            // Corners behind one another make edges whose directions are only rounding.
            if scratch.outline.last().is_none_or(is_new) && scratch.outline.first().is_none_or(is_new) {
                scratch.outline.push(p);
            }
        }
        if scratch.outline.len() < 3 {
            scratch.outline.clear();
        }
    }
}

/// Two unit vectors that complete `axis` to a right-handed frame.
pub(crate) fn perpendicular(axis: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let u = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize();
    (u, axis.cross(&u).normalize())
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
