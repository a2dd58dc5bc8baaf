//! The part of a tetrahedron inside a cube, in one pass over its four faces.
//!
//! A body's volume is what lies under its upper faces less what lies under its lower ones. Inside the cube |x| ≤ 1 that
//! is, over each face's shadow on the floor, its height cut off at floor and ceiling:
//!
//! ```text
//! vol = Σ_f ± ∫ (clamp(z_f(x, y), floor, ceiling) − floor) dx dy     over shadow(f) ∩ [−1, 1]²
//!
//!  ceiling ┌────────┐        the face ╱ counts its full column where it is above the ceiling,
//!          │   ╱    │╲       nothing where it is below the floor; upright faces have no shadow.
//!          │ ╱▒▒▒▒▒▒│ ╲
//!    floor └╱▒▒▒▒▒▒▒┘
//! ```
//!
//! No caps and no order of corners are needed, and every term is a continuous function of the corners: faces that lie in
//! a face of the cube need no rule of which side owns them.

use nalgebra::Vector3;

/// Coordinates in which the box is the cube |x| ≤ 1.
pub(crate) type Corners = [Vector3<f64>; 4];

/// Corners of the four faces, counter-clockwise seen from outside where corners 0 1 2 3 are right-handed.
pub(crate) const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// Volume of the part of a right-handed tetrahedron inside the cube |x| ≤ 1.
pub(crate) fn inside_cube(corners: &Corners, low: &Vector3<f64>, high: &Vector3<f64>) -> f64 {
    // Heights are counted from the lowest corner where that is inside, so that small bodies have small terms.
    let (floor, ceiling) = (low.z.max(-1.0), high.z.min(1.0));
    let mut polygons = [Polygon::EMPTY; 2];
    let mut sum = 0.0;
    for [i, j, k] in FACES {
        sum += under_face(
            [corners[i], corners[j], corners[k]],
            floor,
            ceiling,
            &mut polygons,
        );
    }
    sum
}

/// A convex polygon; three cuts of six add at most one corner each.
#[derive(Clone, Copy)]
struct Polygon {
    n: usize,
    corners: [[f64; 3]; CAPACITY],
}

/// A power of two, so that masked indices need no check; a triangle cut six times has at most nine corners.
const CAPACITY: usize = 16;

impl Polygon {
    const EMPTY: Self = Self {
        n: 0,
        corners: [[0.0; 3]; CAPACITY],
    };

    #[inline]
    fn at(&self, i: usize) -> [f64; 3] {
        self.corners[i % CAPACITY]
    }

    #[inline]
    fn push(&mut self, p: [f64; 3]) {
        self.corners[self.n % CAPACITY] = p;
        self.n += 1;
    }

    /// Twice the area of the shadow, signed, and the same times three times the mean height above the floor.
    #[inline]
    fn shadow(&self, floor: f64) -> (f64, f64) {
        let mut area = 0.0;
        let mut moment = 0.0;
        if self.n < 3 {
            return (0.0, 0.0);
        }
        let first = self.at(0);
        let mut previous = self.at(1);
        for i in 2..self.n {
            let p = self.at(i);
            let twice =
                (previous[0] - first[0]) * (p[1] - first[1]) - (previous[1] - first[1]) * (p[0] - first[0]);
            area += twice;
            moment += twice * ((first[2] - floor) + (previous[2] - floor) + (p[2] - floor));
            previous = p;
        }
        (area, moment)
    }
}

/// The signed volume between a face and the floor, inside the cube. The polygons are room to work in.
#[inline]
fn under_face(face: [Vector3<f64>; 3], floor: f64, ceiling: f64, polygons: &mut [Polygon; 2]) -> f64 {
    let [a, b, c] = face;
    let (low, high) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
    if high.z <= floor || high.x <= -1.0 || high.y <= -1.0 || low.x >= 1.0 || low.y >= 1.0 {
        return 0.0;
    }
    let [mut current, mut next] = polygons.each_mut();
    current.n = 3;
    current.corners[0] = a.into();
    current.corners[1] = b.into();
    current.corners[2] = c.into();
    for (crosses, axis, sign, limit) in [
        (low.z < floor, 2, -1.0, -floor),
        (low.x < -1.0, 0, -1.0, 1.0),
        (high.x > 1.0, 0, 1.0, 1.0),
        (low.y < -1.0, 1, -1.0, 1.0),
        (high.y > 1.0, 1, 1.0, 1.0),
    ] {
        if crosses {
            cut(current, axis, sign, limit, next, None);
            if next.n == 0 {
                return 0.0;
            }
            std::mem::swap(&mut current, &mut next);
        }
    }
    if high.z <= ceiling {
        return current.shadow(floor).1 / 6.0;
    }
    let mut above = Polygon::EMPTY;
    cut(current, 2, 1.0, ceiling, next, Some(&mut above));
    next.shadow(floor).1 / 6.0 + above.shadow(floor).0 * (ceiling - floor) / 2.0
}

/// Cuts a polygon at `sign · x[axis] = limit`; what lies below goes to `kept`, the rest to `beyond`.
#[inline]
fn cut(
    polygon: &Polygon,
    axis: usize,
    sign: f64,
    limit: f64,
    kept: &mut Polygon,
    mut beyond: Option<&mut Polygon>,
) {
    kept.n = 0;
    let mut previous = polygon.at(polygon.n - 1);
    let mut depth_before = limit - sign * previous[axis];
    for i in 0..polygon.n {
        let p = polygon.at(i);
        let depth = limit - sign * p[axis];
        if (depth > 0.0) != (depth_before > 0.0) {
            let t = depth_before / (depth_before - depth);
            let mut q: [f64; 3] = std::array::from_fn(|k| previous[k] + (p[k] - previous[k]) * t);
            q[axis] = sign * limit;
            kept.push(q);
            if let Some(beyond) = beyond.as_mut() {
                beyond.push(q);
            }
        }
        if depth > 0.0 {
            kept.push(p);
        } else if let Some(beyond) = beyond.as_mut() {
            beyond.push(p);
        }
        (previous, depth_before) = (p, depth);
    }
}
