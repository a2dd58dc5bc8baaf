//! A small box around points, found quickly: how cuts are judged before the smallest boxes are fitted.

use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

use crate::OrientedBox;
use crate::hull::hull_within;
use crate::min_box::body::{Body as ConvexBody, Scratch, perpendicular};
use crate::min_box::search::largest_normals;

/// How far inside the hull of the points the simplified hull may lie that directions are tried on; lengths are still
/// those of all points.
const SIMPLIFIED: f64 = 2e-3;
/// Directions besides the given ones: normals of large facets, and spread evenly.
const N_FACETS: usize = 8;
const N_LATTICE: usize = 6;
/// Boxes that are measured again about their own axes.
const N_STARTS: usize = 2;
const MAX_ROUNDS: usize = 5;
/// A box along the given axes is taken where no other is smaller by this share.
const PREFERENCE: f64 = 1e-3;

/// Points with their simplified hull, ready to be boxed.
pub(super) struct Cloud {
    points: Vec<Point3<f64>>,
    hull: ConvexBody,
    /// Whether the hull has triangles; else it is a segment or a point.
    has_faces: bool,
    facets: Vec<Vector3<f64>>,
}

impl Cloud {
    /// `points` must not be empty.
    pub(super) fn new(points: Vec<Point3<f64>>) -> Self {
        let hull = hull_within(&points, SIMPLIFIED);
        let area_vectors = hull
            .triangles()
            .iter()
            .map(|t| t.map(|v| hull.points()[v as usize]))
            .map(|[a, b, c]| (b - a).cross(&(c - a)));
        let corners = hull.points().iter().map(|p| p.coords).collect();
        Self {
            facets: largest_normals(area_vectors, N_FACETS),
            hull: ConvexBody::new(corners, hull.triangles()),
            has_faces: hull.rank() >= 2,
            points,
        }
    }

    /// Corners of the simplified hull.
    pub(super) fn corners(&self) -> Vec<Point3<f64>> {
        self.hull.points.iter().map(|&p| p.into()).collect()
    }

    /// The smaller of the boxes with one axis along one of `axes`; no extent is below `min_extent`.
    pub(super) fn rough_volume(&self, axes: &[Vector3<f64>], min_extent: f64) -> f64 {
        let mut scratch = Scratch::default();
        axes.iter()
            .map(|axis| self.best_about(axis, min_extent, &mut scratch).1)
            .fold(f64::INFINITY, f64::min)
    }

    /// A box around the points, usually less than a hundredth above the smallest; along `axes` where that costs next
    /// to nothing.
    pub(super) fn fit(&self, axes: &[Vector3<f64>; 3], min_extent: f64) -> OrientedBox {
        let given = Matrix3::from_columns(axes);
        let along_given = (given, self.volume_along(&given, min_extent));
        let mut scratch = Scratch::default();
        let mut found: Vec<(Matrix3<f64>, f64)> = axes
            .iter()
            .chain(&self.facets)
            .copied()
            .chain(lattice())
            .map(|d| self.best_about(&d, min_extent, &mut scratch))
            .collect();
        let about_given = found[..3]
            .iter()
            .copied()
            .reduce(|a, b| if b.1 < a.1 { b } else { a });
        found.sort_by(|a, b| a.1.total_cmp(&b.1));
        let mut best = found[0];
        for start in found.iter().take(N_STARTS) {
            let settled = self.settle(*start, min_extent, &mut scratch);
            if settled.1 < best.1 {
                best = settled;
            }
        }
        for preferred in about_given.into_iter().chain([along_given]) {
            if preferred.1 <= best.1 * (1.0 + PREFERENCE) {
                best = preferred;
            }
        }
        self.around(&best.0, min_extent)
    }

    fn settle(
        &self,
        start: (Matrix3<f64>, f64),
        min_extent: f64,
        scratch: &mut Scratch,
    ) -> (Matrix3<f64>, f64) {
        let mut best = start;
        for _ in 0..MAX_ROUNDS {
            let (axes, before) = best;
            for k in 0..3 {
                let found = self.best_about(&axes.column(k).into(), min_extent, scratch);
                if found.1 < best.1 {
                    best = found;
                }
            }
            if best.1 >= before * (1.0 - 1e-4) {
                break;
            }
        }
        best
    }

    /// The smallest box of the simplified hull with one axis along a unit vector: flush with an edge of the outline.
    fn best_about(&self, axis: &Vector3<f64>, min_extent: f64, scratch: &mut Scratch) -> (Matrix3<f64>, f64) {
        let mut best = (Matrix3::identity(), f64::INFINITY);
        let mut consider = |axes: Matrix3<f64>, extents: Vector3<f64>| {
            let volume = extents.map(|e| e.max(min_extent)).product();
            if volume < best.1 {
                best = (axes, volume);
            }
        };
        if self.has_faces {
            self.hull.extents_about(axis, scratch, &mut consider);
        }
        if best.1.is_finite() {
            return best;
        }
        // A segment, or a polygon seen edge-on: along the line through the corners that are seen farthest apart.
        let (u, v) = perpendicular(axis);
        let seen = |p: &Vector3<f64>| u * u.dot(p) + v * v.dot(p);
        let far = |from: &Vector3<f64>| {
            let distance = |p: &&Vector3<f64>| seen(&(*p - from)).norm_squared();
            let farthest = |a, b| if distance(&b) > distance(&a) { b } else { a };
            self.hull.points.iter().reduce(farthest)
        };
        let ends = far(&self.hull.points[0]).and_then(|p| Some((p, far(p)?)));
        let along = ends
            .and_then(|(p, q)| seen(&(q - p)).try_normalize(1e-12))
            .unwrap_or(u);
        let axes = Matrix3::from_columns(&[*axis, along, axis.cross(&along)]);
        (axes, self.volume_along(&axes, min_extent))
    }

    fn volume_along(&self, axes: &Matrix3<f64>, min_extent: f64) -> f64 {
        (0..3)
            .map(|k| span(self.hull.points.iter().map(|p| axes.column(k).dot(p))))
            .map(|(low, high)| (high - low).max(min_extent))
            .product()
    }

    /// The box around all points with these axes.
    fn around(&self, axes: &Matrix3<f64>, min_extent: f64) -> OrientedBox {
        let spans = [0, 1, 2].map(|k| span(self.points.iter().map(|p| axes.column(k).dot(&p.coords))));
        let center = Vector3::from(spans.map(|(low, high)| f64::midpoint(low, high)));
        let extents = Vector3::from(spans.map(|(low, high)| (high - low).max(min_extent)));
        OrientedBox::new(
            (axes * center).into(),
            Rotation3::from_matrix_unchecked(*axes),
            extents,
        )
        .expect("the smallest extent is positive and the points are finite")
    }
}

fn span(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
        (low.min(x), high.max(x))
    })
}

fn lattice() -> impl Iterator<Item = Vector3<f64>> {
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..N_LATTICE).map(move |i| {
        let z = (i as f64 + 0.5) / N_LATTICE as f64;
        let (sin, cos) = (golden_angle * i as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vector3::new(r * cos, r * sin, z)
    })
}
