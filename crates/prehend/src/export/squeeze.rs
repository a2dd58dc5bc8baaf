//! How a hand squeezes: joint torques that hold each other in balance at the contacts.

use nalgebra::{Point3, Vector3};
use prehend_hand::{Hand, JointKind, JointPositions};
use prehend_quality::{Contact, InternalForces, QualityOptions, internal_forces};

use super::ServoGains;
use crate::Error;
use crate::grasp_table::GraspRecord;

/// The sum of the normal forces of a squeeze (N) where nobody says another: 30 N from either side, a firm hold.
pub const GRIP: f64 = 60.0;
/// Where the best forces leave more than this share of the grip as a wrench, there is no balanced squeeze.
pub const IMBALANCE: f64 = 0.02;
/// Without one, closing joints press with this share of their servo's largest torque or force.
const EQUAL_SHARE: f64 = 0.375;

/// What the joints do to squeeze.
#[derive(Debug, Clone, PartialEq)]
pub struct Squeeze {
    /// Torque (N·m) or force (N) of each joint, in the order of [`Hand::joints`]; of a joint that mimics another, 0.
    pub efforts: Vec<f64>,
    /// Where servos are sent to press like that: position + effort / stiffness, in the same order; may lie beyond limits.
    pub targets: Vec<f64>,
    /// The targets within the joints' limits.
    pub joints: JointPositions,
    /// The contacts' forces; `None` where they cannot balance, and all closing joints press alike instead.
    pub forces: Option<InternalForces>,
    /// The sum of the normal forces, N: as asked for, or less where a servo's limit asks for it. 0 without balance.
    pub grip: f64,
}

/// A squeeze in equilibrium.
///
/// Contact forces f that leave the object in balance ([`internal_forces`]) are what joint torques τ = Jᵀ f hold up:
///
/// ```text
/// τ_j = Σ a_j · ((p_c − o_j) × f_c + m_c n_c)   over contacts c on links that joint j turns (about a_j through o_j)
/// τ_j = Σ a_j · f_c                             over those that it slides (along a_j)
/// target = q + τ / stiffness
/// ```
///
/// The normal forces sum to `grip` (N), so that a wrench up to ε × grip meets resistance without pressing harder.
/// Above, f_c is the force on the object and m_c its torsion about the normal n_c. A joint that mimics another adds multiplier × τ to its
/// leader's. Forces on links that no joint moves are held by the arm. All are scaled down where a servo could not give them.
/// A grasp whose contacts leave more than [`IMBALANCE`] of the grip has no such forces: then every closing joint presses
/// with 0.375 of its servo's largest torque in its closing direction.
///
/// # Errors
///
/// Contacts with numbers that cannot be contacts; a hand without description.
pub fn squeeze(hand: &Hand, grasp: &GraspRecord, gains: &ServoGains, grip: f64) -> Result<Squeeze, Error> {
    let description = hand
        .description()
        .ok_or_else(|| Error::input(format!("the hand {} has no hand.toml", hand.name())))?;
    let contacts = grasp
        .contacts
        .iter()
        .zip(&grasp.contact_records)
        .enumerate()
        .map(|(i, ((_, at), record))| {
            Contact::new(i, at.point, at.normal.into_inner(), record.mu, record.torsion)
        })
        .collect::<Result<Vec<_>, _>>()
        .map_err(|e| Error::input(format!("grasp {}: {e}", grasp.grasp_id)))?;
    let forces = if contacts.is_empty() {
        None
    } else {
        let options = QualityOptions::new(grasp.wrench_center, grasp.torque_scale);
        let found = internal_forces(&contacts, &options, grip)
            .map_err(|e| Error::input(format!("grasp {}: {e}", grasp.grasp_id)))?;
        (found.imbalance <= IMBALANCE).then_some(found)
    };
    let limit = |joint: usize| match hand.joints()[joint].kind {
        JointKind::Prismatic => gains.most_force,
        JointKind::Revolute | JointKind::Continuous => gains.most_torque,
    };
    let (mut efforts, mut reached) = (vec![0.0; hand.joints().len()], 0.0);
    let mut forces = forces;
    if let Some(forces) = &mut forces {
        efforts = efforts_of(hand, grasp, forces);
        let over = (0..efforts.len())
            .map(|j| efforts[j].abs() / limit(j))
            .fold(1.0, f64::max);
        reached = grip / over;
        for effort in &mut efforts {
            *effort = rounded(*effort / over);
        }
        for force in &mut forces.forces {
            force.force = (force.force / over).map(rounded);
            force.torsion = rounded(force.torsion / over);
        }
        forces.imbalance = rounded(forces.imbalance);
    } else {
        for closing in &description.closing {
            let joint = closing.joint.0;
            efforts[joint] = closing.speed.signum() * EQUAL_SHARE * limit(joint);
        }
    }
    let stiffness = |joint: usize| match hand.joints()[joint].kind {
        JointKind::Prismatic => gains.sliding,
        JointKind::Revolute | JointKind::Continuous => gains.turning,
    };
    let targets: Vec<f64> = (0..efforts.len())
        .map(|j| grasp.joints.as_slice()[j] + efforts[j] / stiffness(j))
        .collect();
    Ok(Squeeze {
        joints: hand.joint_positions_from_slice(&targets),
        efforts,
        targets,
        forces,
        grip: reached,
    })
}

/// To a millionth: what is beyond depends on the processor.
fn rounded(x: f64) -> f64 {
    // Adding 0 turns −0 into 0.
    (x * 1e6).round() / 1e6 + 0.0
}

/// τ = Jᵀ f, coupled joints added to their leaders.
fn efforts_of(hand: &Hand, grasp: &GraspRecord, forces: &InternalForces) -> Vec<f64> {
    let poses = hand.link_poses(&grasp.joints);
    let let_go = hand.description().map_or(&[][..], |d| &d.break_away);
    let mut efforts = vec![0.0; hand.joints().len()];
    for ((link, at), force) in grasp.contacts.iter().zip(&forces.forces) {
        for joint in hand.joints_to(*link) {
            let (origin, axis) = hand.joint_axis(joint, &poses);
            let origin: Point3<f64> = grasp.object_from_root * origin;
            let axis: Vector3<f64> = grasp.object_from_root * axis;
            let effort = match hand.joint(joint).kind {
                JointKind::Prismatic => axis.dot(&force.force),
                JointKind::Revolute | JointKind::Continuous => {
                    let moment =
                        (at.point - origin).cross(&force.force) + at.normal.into_inner() * force.torsion;
                    axis.dot(&moment)
                }
            };
            match hand.joint(joint).mimic.filter(|_| !let_go.contains(&joint)) {
                Some(mimic) => efforts[mimic.joint.0] += mimic.multiplier * effort,
                None => efforts[joint.0] += effort,
            }
        }
    }
    efforts
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use nalgebra::{Isometry3, UnitVector3};
    use prehend_geometry::ContactPoint;
    use prehend_quality::ContactForce;

    use super::*;
    use crate::hand_folder::read_described_hand;

    /// A point of every link that moves, where it stands in this posture, object frame.
    fn points(hand: &Hand, object_from_root: &Isometry3<f64>, joints: &JointPositions) -> Vec<Point3<f64>> {
        let poses = hand.link_poses(joints);
        let of_link = |joint: &prehend_hand::Joint| {
            object_from_root * poses.root_from_link(joint.child) * Point3::new(0.01, -0.02, 0.03)
        };
        hand.joints().iter().map(of_link).collect()
    }

    #[test]
    fn efforts_do_the_work_that_forces_do() {
        for name in ["schunk_sdh", "human"] {
            let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
                .join("../../hands")
                .join(name);
            let hand = read_described_hand(&folder).unwrap();
            let object_from_root = Isometry3::new(Vector3::new(0.1, -0.2, 0.3), Vector3::new(0.4, 1.0, -0.5));
            let middle: Vec<f64> = hand
                .joints()
                .iter()
                .map(|j| f64::midpoint(j.lower, j.upper))
                .collect();
            let joints = hand.joint_positions_from_slice(&middle);
            let forces = InternalForces {
                forces: (0..hand.joints().len())
                    .map(|k| ContactForce {
                        force: Vector3::new((k as f64).sin(), (2.0 * k as f64).cos(), 0.3 * k as f64),
                        torsion: 0.0,
                    })
                    .collect(),
                imbalance: 0.0,
            };
            let at = points(&hand, &object_from_root, &joints);
            let contacts = hand.joints().iter().zip(&at).map(|(joint, point)| {
                let normal = UnitVector3::new_unchecked(Vector3::z());
                (
                    joint.child,
                    ContactPoint {
                        point: *point,
                        normal,
                    },
                )
            });
            let grasp = GraspRecord {
                grasp_id: "x".to_owned(),
                object_from_root,
                joints: joints.clone(),
                contacts: contacts.collect(),
                contact_records: Vec::new(),
                epsilon: 0.0,
                wrench_center: Point3::origin(),
                torque_scale: 0.1,
            };
            let efforts = efforts_of(&hand, &grasp, &forces);
            for joint in hand.free_joints() {
                let work = |by: f64| -> f64 {
                    let mut moved = middle.clone();
                    moved[joint.0] += by;
                    let moved = hand.joint_positions_from_slice(&moved);
                    let at = points(&hand, &object_from_root, &moved);
                    at.iter()
                        .zip(&forces.forces)
                        .map(|(p, f)| p.coords.dot(&f.force))
                        .sum()
                };
                let expected = (work(1e-6) - work(-1e-6)) / 2e-6;
                let found = efforts[joint.0];
                assert!(
                    (found - expected).abs() < 1e-6,
                    "{name} {}: {found} {expected}",
                    joint.0
                );
            }
        }
    }
}
