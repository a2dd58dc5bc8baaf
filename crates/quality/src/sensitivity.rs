//! How ε answers to small changes of each contact.

use nalgebra::{Point3, UnitQuaternion, UnitVector3, Vector3};
use prehend_geometry::ContactPoint;

use crate::{ConeShape, Contact, EpsilonSolver, LimitSurface, QualityError, QualityOptions};

/// Step of the differences: this share of the torque scale for points, this angle (rad) for normals, this much for μ.
/// ε is exact to 1e-12, so a slope is good to about 1e-6 of the largest wrench norm.
const STEP: f64 = 1e-6;

/// Edges that stand in for a round cone here: smooth bounds are too loose to take differences of.
const STAND_IN_EDGES: usize = 32;

/// What ε gains per unit of change of one contact, the others, the centre and the torque scale held fixed.
///
/// ε is the least of many smooth functions, so it has kinks (symmetric grasps sit on them): there the slope forwards and
/// the slope backwards differ, each number is their mean, and `kink` says by how much they differ at most.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct ContactSensitivity {
    /// dε / d point, per unit of length, object frame.
    pub point: Vector3<f64>,
    /// dε / d normal, per radian, object frame: a vector across the normal that points where turning the normal gains most.
    pub normal: Vector3<f64>,
    /// dε / dμ; forwards only where μ is 0.
    pub mu: f64,
    /// Largest difference between a slope forwards and the same slope backwards, in the units of the slope; 0 where ε is
    /// smooth (up to about 1e-5 from rounding).
    pub kink: f64,
}

/// [`ContactSensitivity`] of every contact, in their order.
///
/// Without force closure ε is 0 on every side and so are the slopes. Round cones and ellipsoids are looked at through
/// 32 edges and the 20 samples.
///
/// # Errors
///
/// As [`crate::grasp_quality`].
///
/// # Examples
///
/// Three fingers about a ball; a fingertip that slides along the surface changes nothing at first order where the grasp
/// is symmetric, more friction on any finger helps or does nothing:
///
/// ```
/// use nalgebra::{Point3, Vector3};
/// use prehend_quality::{Contact, QualityOptions, epsilon_sensitivity};
///
/// let contacts: Vec<Contact> = (0..4)
///     .map(|i| {
///         let out = [Vector3::new(1.0, 1.0, 1.0), Vector3::new(-1.0, -1.0, 1.0), Vector3::new(-1.0, 1.0, -1.0),
///             Vector3::new(1.0, -1.0, -1.0)][i].normalize();
///         Contact::new(i, Point3::from(0.04 * out), -out, 0.6, 0.0)
///     })
///     .collect::<Result<_, _>>()?;
/// let slopes = epsilon_sensitivity(&contacts, &QualityOptions::new(Point3::origin(), 0.04))?;
/// assert!(slopes.iter().all(|s| s.mu >= -1e-9));
/// # Ok::<(), prehend_quality::QualityError>(())
/// ```
pub fn epsilon_sensitivity(
    contacts: &[Contact],
    options: &QualityOptions,
) -> Result<Vec<ContactSensitivity>, QualityError> {
    let mut exact = *options;
    exact.volume = false;
    if options.cone == ConeShape::Smooth {
        exact.cone = ConeShape::Edges(STAND_IN_EDGES);
    }
    exact.limit_surface = LimitSurface::Samples;
    let mut solver = EpsilonSolver::default();
    let here = solver.epsilon_of(contacts, &exact)?;
    let mut moved = contacts.to_vec();
    let mut slopes = Vec::with_capacity(contacts.len());
    for (i, &contact) in contacts.iter().enumerate() {
        let mut kink = 0.0_f64;
        let mut slope = |step: f64, change: &dyn Fn(f64) -> Contact| -> Result<f64, QualityError> {
            let mut at = |by: f64| {
                moved[i] = change(by);
                solver.epsilon_of(&moved, &exact)
            };
            let forwards = (at(step)? - here) / step;
            let backwards = (here - at(-step)?) / step;
            moved[i] = contact;
            kink = kink.max((forwards - backwards).abs());
            Ok(f64::midpoint(forwards, backwards))
        };
        let length = STEP * options.torque_scale;
        let mut point = Vector3::zeros();
        for k in 0..3 {
            point[k] = slope(length, &|by| {
                let mut there = contact.at.point.coords;
                there[k] += by;
                with_point(contact, Point3::from(there))
            })?;
        }
        let across = Vector3::from_fn(|k, _| if k == contact.at.normal.iamin() { 1.0 } else { 0.0 });
        let first = UnitVector3::new_normalize(contact.at.normal.cross(&across));
        let second = UnitVector3::new_normalize(contact.at.normal.cross(&first));
        let mut normal = Vector3::zeros();
        for (axis, gained) in [(second, first), (first, -second)] {
            // Turning n about `axis` moves it along axis × n.
            debug_assert!((axis.cross(&contact.at.normal) - gained.into_inner()).norm() < 1e-9);
            let along = slope(STEP, &|by| {
                with_normal(contact, UnitQuaternion::from_axis_angle(&axis, by))
            })?;
            normal += gained.into_inner() * along;
        }
        let mu = if contact.mu > STEP {
            slope(STEP, &|by| Contact {
                mu: contact.mu + by,
                ..contact
            })?
        } else {
            moved[i].mu = contact.mu + STEP;
            let there = solver.epsilon_of(&moved, &exact)?;
            moved[i] = contact;
            (there - here) / STEP
        };
        slopes.push(ContactSensitivity {
            point,
            normal,
            mu,
            kink,
        });
    }
    Ok(slopes)
}

fn with_point(contact: Contact, point: Point3<f64>) -> Contact {
    Contact {
        at: ContactPoint { point, ..contact.at },
        ..contact
    }
}

fn with_normal(contact: Contact, turn: UnitQuaternion<f64>) -> Contact {
    Contact {
        at: ContactPoint {
            normal: turn * contact.at.normal,
            ..contact.at
        },
        ..contact
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::GraspWrenchSpace;
    use crate::epsilon;

    /// Five contacts in general position on an ellipsoid.
    fn grasp() -> Vec<Contact> {
        [
            [0.9, 0.1, 0.3],
            [-0.7, 0.5, 0.2],
            [0.1, -0.8, 0.4],
            [-0.2, 0.3, -0.9],
            [0.3, 0.7, 0.5],
        ]
        .iter()
        .enumerate()
        .map(|(i, d)| {
            let out = Vector3::from(*d).normalize();
            let point = Point3::new(0.05 * out.x, 0.04 * out.y, 0.06 * out.z);
            Contact::new(i, point, -out, 0.5 + 0.05 * i as f64, 0.0).unwrap()
        })
        .collect()
    }

    #[test]
    fn slopes_foretell_what_a_small_move_does() {
        let contacts = grasp();
        let options = QualityOptions::new(Point3::origin(), 0.06);
        let value = |c: &[Contact]| epsilon(&GraspWrenchSpace::new(c, &options).unwrap()).unwrap();
        let here = value(&contacts);
        assert!(here > 0.01);
        let slopes = epsilon_sensitivity(&contacts, &options).unwrap();
        for (i, s) in slopes.iter().enumerate() {
            assert!(s.kink < 1e-3, "{s:?}");
            assert!(s.mu > -1e-6 && s.normal.dot(&contacts[i].at.normal).abs() < 1e-9);
            let mut moved = contacts.clone();
            let shift = Vector3::new(2e-6, -1e-6, 3e-6);
            let turn = UnitVector3::new_normalize(Vector3::new(0.2, 0.5, -0.4));
            let turned = UnitQuaternion::from_axis_angle(&turn, 1e-4);
            moved[i] = with_normal(with_point(moved[i], moved[i].at.point + shift), turned);
            moved[i].mu += 1e-4;
            let foretold = s.point.dot(&shift)
                + s.normal
                    .dot(&(moved[i].at.normal.into_inner() - contacts[i].at.normal.into_inner()))
                + s.mu * 1e-4;
            let found = value(&moved) - here;
            assert!(
                (found - foretold).abs() < 2e-7 + 1e-3 * foretold.abs(),
                "{found} {foretold}"
            );
        }
    }

    #[test]
    fn what_does_not_hold_has_no_slope() {
        let one = &grasp()[..1];
        let slopes = epsilon_sensitivity(one, &QualityOptions::new(Point3::origin(), 0.06)).unwrap();
        assert_eq!(slopes[0].point, Vector3::zeros());
        assert_eq!((slopes[0].mu, slopes[0].kink), (0.0, 0.0));
    }
}
