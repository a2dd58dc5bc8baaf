//! Distances that are negative inside.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::Surface;
use crate::collider::{Collider, Core};
use crate::core_distance::segment;

/// A signed distance from the grid: the exact one is off by at most `error`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DistanceEstimate {
    /// Metres, negative inside.
    pub distance: f64,
    /// |distance − exact| is at most this, metres; 0 where the grid had no answer and the exact one was looked up.
    pub error: f64,
}

/// What the grid says of a solid: its signed distance lies between the two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GapBounds {
    /// Lower bound, metres.
    pub low: f64,
    /// Upper bound, metres.
    pub high: f64,
}

/// No search for the deepest point looks at more parts than this.
const MAX_PARTS: usize = 200_000;

impl Surface {
    /// Distance (m) from `p` to the surface, negative inside.
    ///
    /// Exact up to rounding; the sign is that of [`is_inside`](Self::is_inside), which holes do not mislead.
    pub fn signed_distance(&self, p: &Point3<f64>) -> f64 {
        let distance = self.closest_point(p).distance;
        if self.is_inside(p) { -distance } else { distance }
    }

    /// The signed distance from the grid, and how far off it may be.
    ///
    /// Takes some tens of nanoseconds; the first query in a part of space near the surface some tens of microseconds.
    ///
    /// The error is at most √3/2 of [`grid_spacing`](Self::grid_spacing) within twice that spacing of the surface, four
    /// times as much elsewhere near the object, and grows with the distance far from it. Around holes, where the sign
    /// jumps without a surface between, the exact distance is looked up.
    pub fn estimated_distance(&self, p: &Point3<f64>) -> DistanceEstimate {
        if let Some((distance, error)) = self.grid().estimate(p) {
            return DistanceEstimate { distance, error };
        }
        let (low, high) = self.axis_aligned_bounds();
        let nearest = p.coords.sup(&low.coords).inf(&high.coords);
        let beyond = (p.coords - nearest).norm();
        if beyond <= self.grid().spacing() {
            return DistanceEstimate {
                distance: self.signed_distance(p),
                error: 0.0,
            };
        }
        // Far away: no nearer than the bounds, no farther than their farthest corner.
        let farthest = (p.coords - low.coords)
            .abs()
            .sup(&(p.coords - high.coords).abs())
            .norm();
        DistanceEstimate {
            distance: (beyond + farthest) / 2.0,
            error: (farthest - beyond) / 2.0 + farthest * 1e-15,
        }
    }

    /// Distance between fine nodes of the grid, metres.
    pub fn grid_spacing(&self) -> f64 {
        self.grid().spacing()
    }

    /// Memory of the grid, bytes; grows as queries come near more of the surface.
    pub fn grid_bytes(&self) -> usize {
        self.grid().n_bytes()
    }

    /// Signed distance (m) of a placed solid: the least signed distance over its core (a ball's centre, a capsule's axis,
    /// a convex piece itself) less its radius.
    ///
    /// Positive: how far the two are apart. Negative: a ball or capsule would have to shrink by so much, the deepest point
    /// of a convex piece is so far below the surface. Exact up to rounding for balls, and for all solids whose core lies
    /// outside the object; where a core reaches inside, its deepest point is found to within `tolerance` (m, at least a
    /// micrometre), which costs more the smaller it is. The search halves the core into parts and stops at 200,000 of
    /// them, as may happen with a small tolerance where a wide core lies along the middle of a plate: the result is then
    /// the least distance seen, above the true one by an unknown amount. A [`Mesh`](crate::Solid::Mesh) counts with its
    /// corners there.
    pub fn signed_gap(&self, solid: &Collider, surface_from_solid: &Isometry3<f64>, tolerance: f64) -> f64 {
        if let Core::Point = solid.core {
            return self.signed_distance(&surface_from_solid.translation.vector.into()) - solid.radius;
        }
        let apart = self
            .gap(solid, surface_from_solid, f64::INFINITY)
            .map_or(f64::INFINITY, |g| g.distance);
        let any = surface_from_solid * solid.corners[0];
        if apart > -solid.radius && !self.is_inside(&any) {
            return apart;
        }
        self.deepest(solid, surface_from_solid, tolerance.max(1e-6)) - solid.radius
    }

    /// The least signed distance over a core that reaches inside: parts of it are halved until none can be deeper.
    fn deepest(&self, solid: &Collider, surface_from_solid: &Isometry3<f64>, tolerance: f64) -> f64 {
        let at = |p: &Vector3<f64>| self.signed_distance(&(surface_from_solid * Point3::from(*p)));
        let corners = solid.corners.iter().map(|p| at(&p.coords));
        let mut least = corners.fold(f64::INFINITY, f64::min);
        if let Core::Mesh(_) = solid.core {
            return least.min(0.0);
        }
        let planes: Vec<(Vector3<f64>, f64)> = solid
            .faces
            .iter()
            .filter_map(|f| {
                let [a, b, c] = f.map(|i| solid.corners[i as usize]);
                let normal = (b - a).cross(&(c - a)).try_normalize(f64::MIN_POSITIVE)?;
                Some((normal, normal.dot(&a.coords)))
            })
            .collect();
        let beyond = |p: &Vector3<f64>| planes.iter().map(|(n, d)| n.dot(p) - d).fold(0.0, f64::max);
        // Parts (middle, half lengths), worked off in layers so that the order of halving does not matter.
        let mut parts = vec![(solid.core_center, solid.core_half)];
        let mut n_parts = 0;
        while !parts.is_empty() && n_parts < MAX_PARTS {
            n_parts += parts.len();
            let mut open = Vec::new();
            for (middle, half) in parts {
                let radius = half.norm();
                let outside = beyond(&middle);
                if outside > radius {
                    continue;
                }
                let distance = at(&middle);
                if outside <= 1e-12 {
                    least = least.min(distance);
                }
                // No point of the part is deeper than this.
                let bound = distance - radius;
                if bound < least - tolerance {
                    open.push((middle, half, bound));
                }
            }
            parts = Vec::with_capacity(open.len() * 2);
            for (middle, half, bound) in open {
                if bound >= least - tolerance {
                    continue;
                }
                let axis = half.imax();
                let (mut shift, mut smaller) = (Vector3::zeros(), half);
                smaller[axis] /= 2.0;
                shift[axis] = smaller[axis];
                parts.extend([(middle - shift, smaller), (middle + shift, smaller)]);
            }
        }
        least
    }

    /// Bounds of [`signed_gap`](Self::signed_gap) from the grid; no allocation, and no triangle but around holes.
    ///
    /// A ball is off by the grid's error at its centre, a capsule by that and half a fine spacing; other solids are seen
    /// as the balls that cover them and as their corners.
    pub fn gap_bounds(&self, solid: &Collider, surface_from_solid: &Isometry3<f64>) -> GapBounds {
        let mut bounds = GapBounds {
            low: f64::INFINITY,
            high: f64::INFINITY,
        };
        match solid.core {
            Core::Point => bounds.add(self, &surface_from_solid.translation.vector.into(), 0.0),
            Core::Segment(half) => {
                let [a, b] = segment(surface_from_solid, half);
                let n = (2.0 * half / self.grid().spacing()).ceil().clamp(1.0, 256.0);
                let step = (b - a) / n;
                for i in 0..n as usize {
                    bounds.add(self, &(a + step * (i as f64 + 0.5)), step.norm() / 2.0);
                }
            }
            Core::Convex(_) | Core::Mesh(_) => {
                for ball in solid.cover() {
                    let around = self.estimated_distance(&(surface_from_solid * ball.center));
                    bounds.low = bounds.low.min(around.distance - around.error - ball.radius);
                }
                for corner in &solid.corners {
                    let at = self.estimated_distance(&(surface_from_solid * corner));
                    bounds.high = bounds.high.min(at.distance + at.error);
                }
            }
        }
        GapBounds {
            low: bounds.low - solid.radius,
            high: bounds.high - solid.radius,
        }
    }
}

impl GapBounds {
    /// Takes in a point of the core that stands for all others up to `reach` from it.
    fn add(&mut self, surface: &Surface, p: &Point3<f64>, reach: f64) {
        let at = surface.estimated_distance(p);
        self.low = self.low.min(at.distance - at.error - reach);
        self.high = self.high.min(at.distance + at.error);
    }
}
