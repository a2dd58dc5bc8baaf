//! Forces of the contacts that hold each other in balance: how to squeeze.

use nalgebra::{DMatrix, DVector, Vector3};

use crate::friction_cone::{ContactWrenches, fill_circle};
use crate::nnls::non_negative_least_squares;
use crate::{ConeShape, Contact, QualityError, QualityOptions, Wrench};

/// How much more an unbalanced wrench weighs than a large force.
const BALANCE: f64 = 1e4;
/// How much more the use of friction weighs than normal force: forces stay near the middle of their cones.
const FRICTION: f64 = 2.0;
/// A round cone is taken as one with so many edges.
const EDGES_OF_SMOOTH: usize = 16;

/// The force of one contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactForce {
    /// Force on the object, N, object frame.
    pub force: Vector3<f64>,
    /// Moment on the object about the contact's normal, N·m (N × the unit of lengths); 0 at a point contact.
    pub torsion: f64,
}

/// Forces of all contacts of a grasp.
#[derive(Debug, Clone, PartialEq)]
pub struct InternalForces {
    /// One for each contact, in their order.
    pub forces: Vec<ContactForce>,
    /// What they leave of a wrench on the object: its length (torques divided by the torque scale) over the sum of the
    /// normal forces. 0 in balance; with force closure it is below 1e-6.
    pub imbalance: f64,
}

/// Contact forces inside their friction cones that leave the object in balance, with normal forces that sum to `grip` (N).
///
/// ```text
/// minimise   Σᵢ nᵢ² + 4 Σᵢ (xᵢ² + yᵢ² + (tᵢ/e)²)
/// over       α ≥ 0      nᵢ = Σₑ αᵢₑ      fᵢ = nᵢ n + μ (xᵢ t₁ + yᵢ t₂)      (xᵢ, yᵢ, tᵢ) = Σₑ αᵢₑ (x, y, t)ₑ
/// subject to Σᵢ wrench(fᵢ) = 0      Σᵢ nᵢ = grip
/// ```
///
/// where e runs over the edges of a contact's cone, or over the samples of its limit surface. The load is spread over the
/// contacts, and friction is used no more than balance asks for. Both conditions are weighted (1e4), not exact:
/// contacts that cannot balance give the forces that come nearest, and `imbalance` says how far off they are.
/// `options` gives centre, torque scale and cones; gravity and metric in it do not count.
///
/// # Errors
///
/// [`QualityError::NoContacts`], a contact or option with bad numbers, or [`QualityError::BadGrip`].
///
/// # Source
///
/// Non-negative least squares over the edges of the cones; internal forces after Kerr and Roth, "Analysis of multifingered
/// hands", International Journal of Robotics Research 4 (1986).
///
/// # Examples
///
/// Two fingers press against each other, and the third rests:
///
/// ```
/// use nalgebra::{Point3, Vector3};
/// use prehend_quality::{Contact, QualityOptions, internal_forces};
///
/// let contacts = [
///     Contact::new(0, Point3::new(-0.03, 0.0, 0.0), Vector3::x(), 0.5, 0.0)?,
///     Contact::new(1, Point3::new(0.03, 0.0, 0.0), -Vector3::x(), 0.5, 0.0)?,
///     Contact::new(2, Point3::new(0.0, 0.0, 0.05), -Vector3::z(), 0.1, 0.0)?,
/// ];
/// let squeeze = internal_forces(&contacts, &QualityOptions::new(Point3::origin(), 0.05), 20.0)?;
/// assert!(squeeze.imbalance < 1e-6);
/// assert!((squeeze.forces[0].force - Vector3::new(10.0, 0.0, 0.0)).norm() < 1.5);
/// assert!(squeeze.forces[2].force.norm() < 1.5);
/// # Ok::<(), prehend_quality::QualityError>(())
/// ```
pub fn internal_forces(
    contacts: &[Contact],
    options: &QualityOptions,
    grip: f64,
) -> Result<InternalForces, QualityError> {
    if contacts.is_empty() {
        return Err(QualityError::NoContacts);
    }
    if !(grip.is_finite() && grip > 0.0) {
        return Err(QualityError::BadGrip { grip });
    }
    options.check()?;
    let options = QualityOptions {
        gravity: Vector3::zeros(),
        ..*options
    };
    let n_edges = match options.cone {
        ConeShape::Edges(n) => n,
        ConeShape::Smooth => EDGES_OF_SMOOTH,
    };
    let mut circle = Vec::new();
    fill_circle(n_edges, &mut circle);
    let mut edges: Vec<(usize, [f64; 3], Wrench)> = Vec::new();
    for (contact_idx, contact) in contacts.iter().enumerate() {
        contact.check(contact_idx)?;
        let wrenches = ContactWrenches::new(contact, &options);
        wrenches.each(&circle, options.length_unit, |at| {
            edges.push((contact_idx, at, wrenches.at(at)));
        });
    }
    if let Some((contact_idx, ..)) = edges.iter().find(|(.., w)| !w.iter().all(|c| c.is_finite())) {
        return Err(QualityError::WrenchOverflow {
            contact_idx: *contact_idx,
        });
    }
    let n_rows = 7 + 4 * contacts.len();
    let mut a = DMatrix::zeros(n_rows, edges.len());
    for (column, (contact_idx, at, wrench)) in edges.iter().enumerate() {
        for k in 0..6 {
            a[(k, column)] = BALANCE * wrench[k];
        }
        a[(6, column)] = BALANCE;
        let first = 7 + 4 * contact_idx;
        a[(first, column)] = 1.0;
        let e = contacts[*contact_idx].torsion;
        let used = [at[0], at[1], if e > 0.0 { at[2] / e } else { 0.0 }];
        for k in 0..3 {
            a[(first + 1 + k, column)] = FRICTION * used[k];
        }
    }
    let mut b = DVector::zeros(n_rows);
    b[6] = BALANCE;
    let shares = non_negative_least_squares(&a, &b);
    let total = shares.sum();
    let scale = if total > 0.0 { grip / total } else { 0.0 };
    let mut left = Wrench::zeros();
    let mut forces = vec![
        ContactForce {
            force: Vector3::zeros(),
            torsion: 0.0
        };
        contacts.len()
    ];
    for ((contact_idx, at, wrench), share) in edges.iter().zip(shares.iter()) {
        let newtons = share * scale;
        left += wrench * newtons;
        let of_contact = &mut forces[*contact_idx];
        of_contact.force += wrench.fixed_rows::<3>(0) * newtons;
        of_contact.torsion += contacts[*contact_idx].mu * at[2] * newtons;
    }
    Ok(InternalForces {
        forces,
        imbalance: if total > 0.0 { left.norm() / grip } else { 1.0 },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    fn three_on_a_ball(torsion: f64) -> Vec<Contact> {
        (0..3)
            .map(|i| {
                let angle = std::f64::consts::TAU * f64::from(i) / 3.0;
                let out = Vector3::new(angle.cos(), angle.sin(), 0.0);
                Contact::new(0, Point3::from(0.04 * out), -out, 0.5, torsion).unwrap()
            })
            .collect()
    }

    #[test]
    fn three_fingers_around_a_ball_press_alike_towards_its_middle() {
        for torsion in [0.0, 2e-3] {
            let contacts = three_on_a_ball(torsion);
            let options = QualityOptions::new(Point3::origin(), 0.04);
            let squeeze = internal_forces(&contacts, &options, 30.0).unwrap();
            assert!(squeeze.imbalance < 1e-6, "{}", squeeze.imbalance);
            for (contact, force) in contacts.iter().zip(&squeeze.forces) {
                assert!(
                    (force.force - contact.at.normal.into_inner() * 10.0).norm() < 1e-3,
                    "{force:?}"
                );
                assert!(force.torsion.abs() < 1e-5);
            }
        }
    }

    #[test]
    fn forces_stay_in_their_cones_and_balance_where_the_grasp_is_lopsided() {
        let mut contacts = three_on_a_ball(2e-3);
        contacts.push(
            Contact::new(
                3,
                Point3::new(0.01, 0.02, 0.03),
                Vector3::new(0.2, -0.1, -1.0),
                0.3,
                0.0,
            )
            .unwrap(),
        );
        let options = QualityOptions::new(Point3::new(0.01, -0.01, 0.005), 0.05);
        let squeeze = internal_forces(&contacts, &options, 12.0).unwrap();
        assert!(squeeze.imbalance < 1e-6);
        let mut sum = Vector3::zeros();
        let mut normal_sum = 0.0;
        for (contact, force) in contacts.iter().zip(&squeeze.forces) {
            let normal = force.force.dot(&contact.at.normal);
            let tangential = (force.force - contact.at.normal.into_inner() * normal).norm();
            assert!(normal >= 0.0 && tangential <= contact.mu * normal + 1e-9);
            sum += force.force;
            normal_sum += normal;
        }
        assert!(sum.norm() < 1e-4 && (normal_sum - 12.0).abs() < 1e-9);
    }

    #[test]
    fn contacts_on_one_side_leave_a_wrench_and_say_so() {
        let one = [Contact::new(0, Point3::origin(), Vector3::z(), 0.5, 0.0).unwrap()];
        let squeeze = internal_forces(&one, &QualityOptions::new(Point3::origin(), 0.1), 5.0).unwrap();
        assert!((squeeze.imbalance - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_grip_must_be_a_force() {
        let one = [Contact::new(0, Point3::origin(), Vector3::z(), 0.5, 0.0).unwrap()];
        let options = QualityOptions::new(Point3::origin(), 0.1);
        let error = internal_forces(&one, &options, 0.0).unwrap_err();
        assert_eq!(
            error.to_string(),
            "the grip is 0 N; expected a positive, finite force"
        );
        assert_eq!(internal_forces(&[], &options, 1.0), Err(QualityError::NoContacts));
    }
}
