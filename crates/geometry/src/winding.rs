//! How often a surface winds around a point, without looking at every triangle.
//!
//! Far groups of triangles act like their first two moments (Barill, Dym, Schmidt, Jacobson and Jacobson, *Fast winding
//! numbers for soups and clouds*, 2018). What the series leaves out is bounded, so that the answer to "more than one half?"
//! is the same as that of a sum over all triangles.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::TriMesh;

/// Triangles in nested groups, each with its moments.
#[derive(Debug, Clone)]
pub(crate) struct WindingTree {
    /// In the order of the groups.
    triangles: Vec<[Point3<f64>; 3]>,
    /// Depth first: a group's first part follows it.
    groups: Vec<Group>,
}

/// Triangles `first .. first + n`, and what they look like from afar.
#[derive(Debug, Clone)]
struct Group {
    first: u32,
    n: u32,
    /// The group's second part; 0 for one that has no parts.
    second: u32,
    center: Point3<f64>,
    /// No corner is farther from the centre.
    radius: f64,
    /// ∫ n dA.
    area_vector: Vector3<f64>,
    /// Symmetric part of ∫ (x − center) nᵀ dA.
    first_moment: Matrix3<f64>,
    /// ∫ |x − center|² dA, or more.
    second_moment: f64,
}

/// Groups of so many triangles have no parts.
const N_LEAF: usize = 8;
/// Tighter and tighter bounds are tried: the error (of the winding number times 4π) that one group may make.
const TOLERANCES: [f64; 3] = [0.4, 0.02, 1e-4];
/// Parts are halves, so no tree over 2³² triangles is deeper.
const MAX_DEPTH: usize = 64;

impl WindingTree {
    pub(crate) fn new(mesh: &TriMesh) -> Self {
        Self::of(mesh.corners().collect())
    }

    pub(crate) fn of(mut triangles: Vec<[Point3<f64>; 3]>) -> Self {
        let mut groups = Vec::with_capacity(triangles.len() / 2);
        grow(&mut triangles, 0, &mut groups);
        Self { triangles, groups }
    }

    /// Whether the winding number's absolute value is above one half.
    pub(crate) fn is_inside(&self, p: &Point3<f64>) -> bool {
        for tolerance in TOLERANCES {
            let (winding, error) = self.estimate(p, tolerance);
            if (winding.abs() - 0.5).abs() > error {
                return winding.abs() > 0.5;
            }
        }
        self.winding_number(p).abs() > 0.5
    }

    /// The winding number, from all triangles.
    pub(crate) fn winding_number(&self, p: &Point3<f64>) -> f64 {
        self.triangles.iter().map(|t| solid_angle(t, p)).sum::<f64>() / (4.0 * std::f64::consts::PI)
    }

    /// The winding number and how far off it may be.
    pub(crate) fn estimate(&self, p: &Point3<f64>, tolerance: f64) -> (f64, f64) {
        let mut stack = [0_u32; MAX_DEPTH];
        let mut depth = 1;
        let (mut sum, mut error) = (0.0, 0.0);
        while depth > 0 {
            depth -= 1;
            let idx = stack[depth];
            let group = &self.groups[idx as usize];
            let to_center = group.center - p;
            let d2 = to_center.norm_squared();
            let d = d2.sqrt();
            let clear = d - group.radius;
            // Half the third derivative of 1/r is at most 3 / r⁴ in any directions.
            let bound = 3.0 * group.second_moment / (clear * clear * clear * clear);
            if clear > 0.0 && bound <= tolerance {
                let inverse3 = 1.0 / (d2 * d);
                let along = to_center.dot(&(group.first_moment * to_center));
                sum += inverse3
                    * (group.area_vector.dot(&to_center) + group.first_moment.trace() - 3.0 * along / d2);
                error += bound;
            } else if group.second == 0 || depth + 2 > MAX_DEPTH {
                let first = group.first as usize;
                let triangles = &self.triangles[first..first + group.n as usize];
                sum += triangles.iter().map(|t| solid_angle(t, p)).sum::<f64>();
            } else {
                stack[depth] = group.second;
                stack[depth + 1] = idx + 1;
                depth += 2;
            }
        }
        let sphere = 4.0 * std::f64::consts::PI;
        (sum / sphere, error / sphere + 1e-9)
    }
}

/// Adds the group of these triangles, which start at index `first`, and its parts.
fn grow(triangles: &mut [[Point3<f64>; 3]], first: usize, groups: &mut Vec<Group>) {
    let idx = groups.len();
    groups.push(group(triangles, first));
    if triangles.len() <= N_LEAF {
        return;
    }
    let doubled = |t: &[Point3<f64>; 3]| t[0].coords + t[1].coords + t[2].coords;
    let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    for t in triangles.iter() {
        low = low.inf(&doubled(t));
        high = high.sup(&doubled(t));
    }
    let axis = (high - low).imax();
    let middle = triangles.len() / 2;
    triangles.select_nth_unstable_by(middle, |a, b| doubled(a)[axis].total_cmp(&doubled(b)[axis]));
    let (left, right) = triangles.split_at_mut(middle);
    grow(left, first, groups);
    groups[idx].second = groups.len() as u32;
    grow(right, first + middle, groups);
}

fn group(triangles: &[[Point3<f64>; 3]], first: usize) -> Group {
    // Half the cross product of two edges is the area times the normal.
    let parts = || {
        triangles.iter().map(|[a, b, c]| {
            let vector = (b - a).cross(&(c - a)) / 2.0;
            (vector, vector.norm(), (a.coords + b.coords + c.coords) / 3.0)
        })
    };
    let area: f64 = parts().map(|(_, area, _)| area).sum();
    let weighted: Vector3<f64> = parts().map(|(_, area, middle)| middle * area).sum();
    let center: Point3<f64> = if area > 0.0 {
        (weighted / area).into()
    } else {
        triangles[0][0]
    };
    let farthest = |t: &[Point3<f64>; 3]| t.iter().map(|p| (p - center).norm_squared()).fold(0.0, f64::max);
    let mut moments = Group {
        first: first as u32,
        n: triangles.len() as u32,
        second: 0,
        center,
        radius: triangles.iter().map(farthest).fold(0.0, f64::max).sqrt(),
        area_vector: Vector3::zeros(),
        first_moment: Matrix3::zeros(),
        second_moment: 0.0,
    };
    for ((vector, area, middle), t) in parts().zip(triangles) {
        let arm = middle - center.coords;
        let moment = arm * vector.transpose();
        moments.area_vector += vector;
        moments.first_moment += (moment + moment.transpose()) / 2.0;
        // Over a triangle |x − center|² has the mean of its values at the corners and nine times that at the middle, over 12.
        let corners: f64 = t.iter().map(|p| (p - center).norm_squared()).sum();
        moments.second_moment += area * (corners + 9.0 * arm.norm_squared()) / 12.0;
    }
    moments
}

/// The solid angle of a triangle seen from `p` (van Oosterom and Strackee, 1983); positive from behind.
pub(crate) fn solid_angle(triangle: &[Point3<f64>; 3], p: &Point3<f64>) -> f64 {
    let [a, b, c] = triangle.map(|q| q - p);
    let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
    let y = a.dot(&b.cross(&c));
    let x = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
    2.0 * y.atan2(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// A ball of 40 × 40 facets without those above `height`.
    fn bowl(height: f64) -> TriMesh {
        let at = |i: u32, j: u32| {
            let (tilt, turn) = (
                f64::from(i) / 40.0 * std::f64::consts::PI,
                f64::from(j) / 40.0 * std::f64::consts::TAU,
            );
            Point3::new(tilt.sin() * turn.cos(), tilt.sin() * turn.sin(), tilt.cos())
        };
        let mut vertices = Vec::new();
        for i in 0..40 {
            for j in 0..40 {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                if a.z <= height {
                    vertices.extend([a, b, c, a, c, d]);
                }
            }
        }
        let triangles = (0..vertices.len() as u32 / 3)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect();
        TriMesh::new(vertices, triangles).unwrap()
    }

    #[test]
    fn estimates_are_no_farther_off_than_they_say_and_sides_agree_with_the_sum_over_all_triangles() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for height in [2.0, 0.7, 0.0] {
            let tree = WindingTree::new(&bowl(height));
            for _ in 0..2000 {
                let p = Point3::from(Vector3::from_fn(|_, _| rng.random_range(-1.5..1.5)));
                let exact = tree.winding_number(&p);
                for tolerance in TOLERANCES {
                    let (winding, error) = tree.estimate(&p, tolerance);
                    assert!((winding - exact).abs() <= error, "{p}: {winding} {exact} {error}");
                }
                assert_eq!(tree.is_inside(&p), exact.abs() > 0.5, "{p}: {exact}");
            }
        }
    }

    #[test]
    fn a_closed_ball_winds_once_around_its_inside() {
        let tree = WindingTree::new(&bowl(2.0));
        assert!((tree.winding_number(&Point3::new(0.1, -0.3, 0.4)) - 1.0).abs() < 1e-12);
        assert!(tree.winding_number(&Point3::new(0.1, -0.3, 1.4)).abs() < 1e-12);
    }
}
