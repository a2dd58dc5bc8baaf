//! A frame that a body carries with it.

use nalgebra::{Matrix3, Point3, SymmetricEigen, Vector3};

use super::region::{Plane, Region};

/// Second moments that differ by less than this share of the largest belong to a body that is round about an axis.
const ROUND: f64 = 1e-4;

/// Distances that differ by less than this share of the body's size are equal.
const EQUAL: f64 = 1e-9;

/// Steps per size of the body to which its coordinates are rounded, and where between two steps they are cut: not
/// where the coordinates of drawn bodies lie, in the middle or at a third.
const STEPS: f64 = (1_u32 << 30) as f64;
const BETWEEN: f64 = 0.371;

/// A frame of the body's own: principal axes of its surface, centred, with the farthest vertex at distance 1.
///
/// What is decided in it is the same however the body lies, to the last bit: coordinates are rounded to 1e-9 of the
/// body, far above what a motion leaves of rounding. About an axis of symmetry the first of the vertices farthest from
/// it gives the direction.
pub(super) struct BodyFrame {
    origin: Point3<f64>,
    axes: Matrix3<f64>,
    size: f64,
}

impl BodyFrame {
    /// The frame of a whole body; none where all its vertices coincide.
    pub(super) fn of(body: &Region) -> Option<Self> {
        let corners = body.triangles().iter().flatten();
        let used: Vec<Point3<f64>> = corners.map(|&v| body.vertices()[v as usize]).collect();
        let first = *used.first()?;
        let reach = used.iter().map(|p| (p - first).norm()).fold(0.0, f64::max);
        if !(reach > 0.0 && reach.is_finite()) {
            return None;
        }
        let unit: Vec<Vector3<f64>> = used.iter().map(|p| (p - first) / reach).collect();
        let (center, moments) = moments(&unit);
        let relative: Vec<Vector3<f64>> = unit.iter().map(|p| p - center).collect();
        let axes = own_axes(&relative, &moments);
        let size = relative.iter().map(Vector3::norm).fold(0.0, f64::max);
        Some(Self {
            origin: first + center * reach,
            axes,
            size: size * reach,
        })
    }

    /// A point in this frame, rounded.
    pub(super) fn rounded(&self, p: &Point3<f64>) -> Point3<f64> {
        let local = self.axes.tr_mul(&(p - self.origin)) / self.size;
        local.map(|x| (x * STEPS + BETWEEN).floor() / STEPS).into()
    }

    /// The length (m) that is 1 in this frame.
    pub(super) fn size(&self) -> f64 {
        self.size
    }

    /// A direction of this frame where the body is.
    pub(super) fn turned(&self, direction: &Vector3<f64>) -> Vector3<f64> {
        self.axes * direction
    }

    /// A plane of this frame where the body is.
    pub(super) fn placed(&self, plane: &Plane) -> Plane {
        Plane {
            normal: self.turned(&plane.normal),
            origin: self.origin + self.axes * plane.origin.coords * self.size,
        }
    }
}

/// Centre of the surface, and its second moments about it; of the vertices where there is no area.
fn moments(corners: &[Vector3<f64>]) -> (Vector3<f64>, Matrix3<f64>) {
    let area = |t: &[Vector3<f64>]| (t[1] - t[0]).cross(&(t[2] - t[0])).norm();
    let total: f64 = corners.chunks_exact(3).map(area).sum();
    let weight = |t: &[Vector3<f64>]| {
        if total > 0.0 {
            area(t) / total
        } else {
            3.0 / corners.len() as f64
        }
    };
    let center = corners
        .chunks_exact(3)
        .map(|t| (t[0] + t[1] + t[2]) * (weight(t) / 3.0))
        .sum::<Vector3<f64>>();
    let mut moments = Matrix3::zeros();
    for t in corners.chunks_exact(3) {
        let [a, b, c] = [t[0] - center, t[1] - center, t[2] - center];
        let sum = a + b + c;
        let squares = [a, b, c, sum].map(|v| v * v.transpose());
        moments += squares.iter().sum::<Matrix3<f64>>() * (weight(t) / 12.0);
    }
    (center, moments)
}

/// Right-handed axes: the longest spread first where there is one.
fn own_axes(points: &[Vector3<f64>], moments: &Matrix3<f64>) -> Matrix3<f64> {
    let eigen = SymmetricEigen::new(*moments);
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
    let [most, middle, least] = order.map(|k| eigen.eigenvalues[k]);
    let axis = |k: usize| eigen.eigenvectors.column(order[k]).into_owned();
    let is_equal = |a: f64, b: f64| (a - b).abs() <= ROUND * most;
    let first = match (is_equal(most, middle), is_equal(middle, least)) {
        (true, true) => farthest(points, |p| *p),
        (true, false) => axis(2),
        _ => axis(0),
    };
    let first = first.try_normalize(0.0).unwrap_or_else(Vector3::x);
    let first = towards_farthest(points, first);
    let second = if is_equal(most, middle) || is_equal(middle, least) {
        farthest(points, |p| p - first * first.dot(p))
    } else {
        towards_farthest(points, axis(1))
    };
    let second = (second - first * first.dot(&second))
        .try_normalize(0.0)
        .unwrap_or_else(|| first.cross(&Vector3::ith(first.iamin(), 1.0)).normalize());
    Matrix3::from_columns(&[first, second, first.cross(&second)])
}

/// The axis or its opposite: where the first of the vertices farthest along either lies.
fn towards_farthest(points: &[Vector3<f64>], axis: Vector3<f64>) -> Vector3<f64> {
    let along = farthest(points, |p| axis * axis.dot(p));
    if axis.dot(&along) < 0.0 { -axis } else { axis }
}

/// The longest of what is made of the points; the first of equals.
fn farthest(points: &[Vector3<f64>], of: impl Fn(&Vector3<f64>) -> Vector3<f64>) -> Vector3<f64> {
    let mut best = Vector3::zeros();
    let mut most = 0.0;
    for made in points.iter().map(of) {
        if made.norm() > most + EQUAL {
            (best, most) = (made, made.norm());
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;
    use crate::{OrientedBox, TriMesh};

    #[test]
    fn rounded_coordinates_do_not_depend_on_how_the_body_lies() {
        for extents in [[0.1, 0.2, 0.3], [0.2, 0.2, 0.3], [0.3, 0.3, 0.1], [1.0; 3]] {
            let body = OrientedBox::centered(extents).surface();
            let coordinates = |mesh: &TriMesh| -> Vec<Point3<f64>> {
                let frame = BodyFrame::of(&Region::of_mesh(mesh)).unwrap();
                mesh.vertices().iter().map(|p| frame.rounded(p)).collect()
            };
            let expected = coordinates(&body);
            for k in 1..20 {
                let k = f64::from(k);
                let turn = Isometry3::new(Vector3::new(3.0, -k, 0.5), Vector3::new(k, 0.3 * k, 1.0 - k));
                assert_eq!(
                    coordinates(&body.transformed(&turn)),
                    expected,
                    "{extents:?} turned by {k}"
                );
            }
        }
    }

    #[test]
    fn a_point_has_no_frame() {
        assert!(BodyFrame::of(&Region::of_points(&[Point3::origin(); 2])).is_none());
    }
}
