//! Where the links touch.

use nalgebra::{Isometry3, UnitVector3};
use prehend_geometry::{ContactPoint, Gap, Surface};

use crate::grasp_hand::GraspHand;
use crate::patch::{Candidate, MERGE_DISTANCE, SOFT_MERGE_DISTANCE, reduced};
use crate::{GraspObject, LinkContact};

/// Features of link and object closer than this touch, metres.
pub const CONTACT_TOLERANCE: f64 = 2e-4;

/// All contacts of a posture, in order of the links.
///
/// Every pair of features (vertex and face, edge and edge) of link and object closer than [`CONTACT_TOLERANCE`] is a
/// candidate: its point lies on the object, its normal is the direction of separation, from link to object. In the
/// middle of a face that is the face's normal; on an edge or a vertex it lies between the normals of the faces around,
/// so that facets of a round body do not matter. Candidates of a link with about one normal are a patch, of which the
/// corners stay ([`reduced`]).
pub(crate) fn contacts_of(
    hand: &GraspHand<'_>,
    object: &GraspObject,
    solid_poses: &[Isometry3<f64>],
) -> Vec<LinkContact> {
    let mut contacts = Vec::new();
    let mut first = 0;
    while first < hand.solids.len() {
        let link = hand.solids[first].link;
        let n_of_link = hand.solids[first..].iter().take_while(|s| s.link == link).count();
        let mut candidates = Vec::new();
        for i in first..first + n_of_link {
            let collider = &hand.solids[i].collider;
            if object.surface().gap_lower_bound(collider, &solid_poses[i]) < CONTACT_TOLERANCE {
                let pairs = object
                    .surface()
                    .touching(collider, &solid_poses[i], CONTACT_TOLERANCE);
                candidates.extend(pairs.iter().filter_map(|gap| candidate(object.surface(), gap)));
            }
        }
        let (mu, torsion) = hand.contact_law(first, object.material());
        let apart = if torsion > 0.0 {
            SOFT_MERGE_DISTANCE
        } else {
            MERGE_DISTANCE
        };
        contacts.extend(reduced(&candidates, apart).into_iter().map(|at| LinkContact {
            link,
            at,
            mu,
            torsion,
        }));
        first += n_of_link;
    }
    contacts
}

fn candidate(surface: &Surface, gap: &Gap) -> Option<Candidate> {
    let towards_object = gap.on_surface - gap.on_solid;
    // Features that coincide have no direction of separation; the face's normal has to do.
    let normal = UnitVector3::try_new(towards_object, 1e-9)
        .or_else(|| surface.face_normal(gap.triangle).map(|n| -n))?;
    let at = ContactPoint {
        point: gap.on_surface,
        normal,
    };
    let weight = (CONTACT_TOLERANCE - gap.distance).clamp(0.0, CONTACT_TOLERANCE);
    Some(Candidate { at, weight })
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion, Vector3};
    use prehend_geometry::{Collider, Solid};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn contacts(surface: &Surface, solid: &Collider, pose: &Isometry3<f64>) -> Vec<ContactPoint> {
        let pairs = surface.touching(solid, pose, CONTACT_TOLERANCE);
        let candidates: Vec<_> = pairs.iter().filter_map(|gap| candidate(surface, gap)).collect();
        reduced(&candidates, MERGE_DISTANCE)
    }

    /// Solids that lie on top of an upright post (0.05 m high, 0.03 m in radius) or against its round wall, 0.05 mm away.
    fn lying_and_leaning() -> Vec<(Solid, Isometry3<f64>, usize)> {
        let pad = Solid::Cuboid {
            half_extents: Vector3::new(0.01, 0.008, 0.004),
        };
        let finger = Solid::Capsule {
            half_length: 0.015,
            radius: 0.008,
        };
        let ball = Solid::Sphere { radius: 0.01 };
        let upright = UnitQuaternion::identity();
        let lying = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2);
        let leaning = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.1);
        let at = |x: f64, y: f64, z: f64, turn: UnitQuaternion<f64>| {
            Isometry3::from_parts(Translation3::new(x, y, z), turn)
        };
        let gap = 5e-5;
        vec![
            (pad.clone(), at(0.002, 0.001, 0.054 + gap, leaning), 4),
            (finger.clone(), at(0.001, 0.003, 0.058 + gap, leaning * lying), 2),
            (ball.clone(), at(0.003, 0.004, 0.06 + gap, upright), 1),
            // Half of the pad stands over the rim.
            (pad, at(0.03, 0.0, 0.054 + gap, upright), 4),
            (finger, at(0.038 + gap, 0.0, 0.0, upright), 2),
            (ball, at(0.04 + gap, 0.0, 0.01, upright), 1),
        ]
    }

    #[test]
    fn corners_of_a_face_ends_of_a_line_and_a_point_stay_when_the_pose_changes_a_little() {
        let post = Solid::Cylinder {
            half_length: 0.05,
            radius: 0.03,
        };
        let surface = Surface::new(post.display_mesh());
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for (solid, pose, n_contacts) in lying_and_leaning() {
            let collider = Collider::new(&solid).unwrap();
            let before = contacts(&surface, &collider, &pose);
            assert_eq!(before.len(), n_contacts, "{solid:?}: {before:?}");
            for _ in 0..20 {
                let mut tiny = || Vector3::from_fn(|_, _| rng.random_range(-1e-7..1e-7));
                let shift = Translation3::from(tiny());
                // Turned about the solid's middle by up to 1e-5 rad: its ends move by less than a micrometre.
                let turn = UnitQuaternion::from_scaled_axis(tiny() * 100.0);
                let moved = Isometry3::from_parts(shift * pose.translation, turn * pose.rotation);
                let after = contacts(&surface, &collider, &moved);
                assert_eq!(after.len(), n_contacts, "{solid:?}: {after:?}");
                for contact in &before {
                    let same = |other: &ContactPoint| {
                        (other.point - contact.point).norm() < 1e-5
                            && other.normal.dot(&contact.normal) > 1.0 - 1e-6
                    };
                    assert!(after.iter().any(same), "{solid:?}: {before:?} {after:?}");
                }
            }
        }
    }
}
