//! The wrenches that one contact can exert at unit normal force.

use nalgebra::{Point3, Vector3, Vector6};

use crate::options::LimitSurface;
use crate::{ConeShape, Contact, LengthUnit, QualityOptions};

/// A wrench `[fx fy fz τx τy τz]` about the wrench centre, its torque divided by the torque scale.
pub type Wrench = Vector6<f64>;

/// The wrenches of one contact.
///
/// ```text
/// f = n + μ (x t₁ + y t₂)        τ = ((p − center) × f + μ t n) / torque_scale
/// t₁ = n × e_x / |n × e_x|  (n × e_z where n is parallel to e_x)        t₂ = n × t₁
/// ```
///
/// are the image of (x, y, t) under an affine map: the centre, and one axis each.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ContactWrenches {
    center: Wrench,
    axes: [Wrench; 3],
    /// e, the third semi-axis of the limit surface; 0 for a point contact.
    torsion: f64,
    frictionless: bool,
}

/// What the contact's (x, y, t) range over.
pub(crate) enum Shape {
    /// Finitely many wrenches, in their order.
    Listed,
    /// The ball that the axes span about the centre, both already scaled; one axis may be 0.
    Ball { center: Wrench, axes: [Wrench; 3] },
}

impl ContactWrenches {
    pub(crate) fn new(contact: &Contact, options: &QualityOptions) -> Self {
        let Contact { at, mu, torsion } = *contact;
        let n = at.normal.into_inner();
        let (t1, t2) = tangents(&n);
        let arm: Vector3<f64> = at.point - options.center;
        let wrench = |f: Vector3<f64>, free_torque: Vector3<f64>| {
            let torque = (arm.cross(&f) + free_torque) / options.torque_scale;
            Wrench::new(f.x, f.y, f.z, torque.x, torque.y, torque.z)
        };
        let none = Vector3::zeros();
        let mut center = wrench(n, none);
        for k in 0..3 {
            center[k] += options.gravity[k];
        }
        Self {
            center,
            axes: [wrench(mu * t1, none), wrench(mu * t2, none), wrench(none, mu * n)],
            torsion,
            frictionless: mu == 0.0,
        }
    }

    pub(crate) fn shape(&self, options: &QualityOptions) -> Shape {
        let [x, y, t] = self.axes;
        let soft = self.torsion > 0.0;
        let smooth = if soft {
            options.limit_surface == LimitSurface::Ellipsoid
        } else {
            options.cone == ConeShape::Smooth
        };
        if smooth && !self.frictionless {
            Shape::Ball {
                center: self.center,
                axes: [x, y, t * self.torsion],
            }
        } else {
            Shape::Listed
        }
    }

    /// Appends the listed wrenches: the edges of the friction cone, or 20 samples of the limit surface. Without friction
    /// all are one, and listed once.
    pub(crate) fn list(&self, circle: &[[f64; 2]], unit: LengthUnit, wrenches: &mut Vec<Wrench>) {
        self.each(circle, unit, |at| wrenches.push(self.at(at)));
    }

    /// Calls `visit` with the (x, y, t) of each listed wrench.
    ///
    /// A point contact has `(x, y, t) = (cos θ, sin θ, 0)` at the angles of `circle`. A soft one samples the limit
    /// surface x² + y² + (t/e)² = 1 at the latitudes 90, 45, 0, −45, −90° with 1, 5, 8, 5, 1 longitudes: each direction
    /// is scaled onto the ellipsoid, whose third axis is counted in millimetres, whatever the unit of the points.
    pub(crate) fn each(&self, circle: &[[f64; 2]], unit: LengthUnit, mut visit: impl FnMut([f64; 3])) {
        if self.frictionless {
            visit([0.0; 3]);
        } else if self.torsion > 0.0 {
            let mm = match unit {
                LengthUnit::Metre => 1e3,
                LengthUnit::Millimetre => 1.0,
            };
            for [x, y, t] in limit_surface_samples(self.torsion * mm) {
                visit([x, y, t / mm]);
            }
        } else {
            for &[x, y] in circle {
                visit([x, y, 0.0]);
            }
        }
    }

    /// The wrench at (x, y, t).
    pub(crate) fn at(&self, [x, y, t]: [f64; 3]) -> Wrench {
        let [x_axis, y_axis, t_axis] = self.axes;
        let tangential = self.center + x_axis * x + y_axis * y;
        if t == 0.0 {
            tangential
        } else {
            tangential + t_axis * t
        }
    }
}

/// Cosines and sines of the directions of a cone's edges.
pub(crate) fn fill_circle(n_edges: usize, circle: &mut Vec<[f64; 2]>) {
    circle.clear();
    circle.extend((0..n_edges).map(|k| {
        let (sin, cos) = turn(k, n_edges);
        [cos, sin]
    }));
}

/// The largest torque that a contact could write: what rounding errors in torques compare with.
pub(crate) fn torque_bound(contact: &Contact, center: &Point3<f64>, torque_scale: f64) -> f64 {
    let largest_force = (1.0 + contact.mu * contact.mu).sqrt();
    ((contact.at.point - center).norm() * largest_force + contact.mu * contact.torsion) / torque_scale
}

/// Unit vectors that span the contact's plane: t₁ = n × e_x normalised (n × e_z where n ∥ e_x), t₂ = n × t₁.
fn tangents(n: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let helper = if n.x.abs() > 1.0 - 1e-9 {
        Vector3::z()
    } else {
        Vector3::x()
    };
    let t1 = n.cross(&helper).normalize();
    (t1, n.cross(&t1))
}

/// Latitude in eighths of a turn, and how many longitudes it has.
const LATITUDES: [(i32, usize); 5] = [(2, 1), (1, 5), (0, 8), (-1, 5), (-2, 1)];

/// The 20 samples `[x, y, t]` of x² + y² + (t/e)² = 1; `e` positive.
fn limit_surface_samples(e: f64) -> impl Iterator<Item = [f64; 3]> {
    LATITUDES.into_iter().flat_map(move |(latitude, n_longitudes)| {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let (sin_latitude, cos_latitude) = match latitude {
            0 => (0.0, 1.0),
            1 => (half, half),
            -1 => (-half, half),
            _ => (f64::from(latitude.signum()), 0.0),
        };
        // hypot keeps e from the poles' 1/e² overflow: the scale at a pole is e itself.
        let scale = 1.0 / f64::hypot(cos_latitude, sin_latitude / e);
        (0..n_longitudes).map(move |k| {
            let (sin, cos) = turn(k, n_longitudes);
            [
                cos * cos_latitude * scale,
                sin * cos_latitude * scale,
                sin_latitude * scale,
            ]
        })
    })
}

/// Sine and cosine of `k` parts of a turn cut into `n`; exact at quarter turns, so that symmetric cones stay so.
fn turn(k: usize, n: usize) -> (f64, f64) {
    match (4 * k / n, 4 * k % n) {
        (0, 0) => (0.0, 1.0),
        (1, 0) => (1.0, 0.0),
        (2, 0) => (0.0, -1.0),
        (3, 0) => (-1.0, 0.0),
        _ => (std::f64::consts::TAU * k as f64 / n as f64).sin_cos(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wrenches_of(
        normal: Vector3<f64>,
        point: [f64; 3],
        mu: f64,
        torsion: f64,
        unit: LengthUnit,
    ) -> Vec<Wrench> {
        let contact = Contact::new(0, point.into(), normal, mu, torsion).unwrap();
        let options = QualityOptions {
            length_unit: unit,
            ..QualityOptions::new(Point3::origin(), 1.0)
        };
        let (mut circle, mut out) = (Vec::new(), Vec::new());
        fill_circle(8, &mut circle);
        ContactWrenches::new(&contact, &options).list(&circle, unit, &mut out);
        out
    }

    #[test]
    fn the_first_edge_leans_along_n_cross_x() {
        let w = wrenches_of(Vector3::z(), [1.0, 0.0, 0.0], 0.5, 0.0, LengthUnit::Metre);
        assert_eq!(w.len(), 8);
        // z × x = y, so f = (0, 0.5, 1) and x × f = (0, −1, 0.5).
        assert_eq!(w[0], Wrench::new(0.0, 0.5, 1.0, 0.0, -1.0, 0.5));
        // t₂ = z × y = −x.
        assert_eq!(w[2], Wrench::new(-0.5, 0.0, 1.0, 0.0, -1.0, 0.0));
    }

    #[test]
    fn a_normal_along_x_takes_n_cross_z() {
        let w = wrenches_of(Vector3::x(), [0.0; 3], 1.0, 0.0, LengthUnit::Metre);
        assert_eq!(w[0].fixed_rows::<3>(0), Vector3::new(1.0, -1.0, 0.0));
    }

    #[test]
    fn a_soft_contact_has_20_wrenches_on_its_limit_surface() {
        let e = 2.13;
        let w = wrenches_of(Vector3::z(), [0.0; 3], 0.7, e, LengthUnit::Millimetre);
        assert_eq!(w.len(), 20);
        for w in &w {
            let (x, y, t) = (w[0] / 0.7, w[1] / 0.7, w[5] / 0.7);
            assert!((x * x + y * y + (t / e).powi(2) - 1.0).abs() < 1e-12);
            assert_eq!(w[2], 1.0);
        }
        // The pole carries torsion only.
        assert!((w[0] - Wrench::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.7 * e)).amax() < 1e-15);
    }

    #[test]
    fn soft_samples_are_taken_in_millimetres_whatever_the_unit() {
        let metre = wrenches_of(Vector3::z(), [0.0; 3], 0.7, 2.13e-3, LengthUnit::Metre);
        let millimetre = wrenches_of(Vector3::z(), [0.0; 3], 0.7, 2.13, LengthUnit::Millimetre);
        for (m, mm) in metre.iter().zip(&millimetre) {
            assert!((m[5] * 1e3 - mm[5]).abs() < 1e-12 && (m[0] - mm[0]).abs() < 1e-15);
        }
    }

    #[test]
    fn tiny_torsion_lengths_stay_finite() {
        let w = wrenches_of(Vector3::z(), [0.0; 3], 0.7, 1e-320, LengthUnit::Millimetre);
        assert!(w.iter().all(|w| w.iter().all(|c| c.is_finite())));
    }
}
