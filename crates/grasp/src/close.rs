//! A user's own candidate: closed and measured as ours are.

use nalgebra::{Isometry3, Point3, Vector3};
use prehend_hand::{Hand, JointPositions};
use prehend_quality::EpsilonSolver;

use crate::approach::arrive;
use crate::closing::{Posture, close_fingers, self_collides};
use crate::confirm::{Confirmed, confirmed, deepest};
use crate::contacts::contacts_of;
use crate::grasp_hand::GraspHand;
use crate::measure::{checked_contacts, epsilon_of};
use crate::{FreeVolume, GraspError, GraspObject, LinkContact, Reason, free_volume};

/// How to close a candidate.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CloseOptions {
    /// Move in along the palm's z axis until something touches, before closing; else close where the hand stands.
    pub approach: bool,
    /// No part of the hand may lie below this height (m) in the object's frame.
    pub support_plane: Option<f64>,
}

/// A candidate after closing.
#[derive(Debug, Clone, PartialEq)]
pub struct Closed {
    /// Pose of the root link in the object's frame.
    pub object_from_root: Isometry3<f64>,
    /// The posture.
    pub joints: JointPositions,
    /// Where it touches, in order of the links.
    pub contacts: Vec<LinkContact>,
    /// ε; 0 without force closure.
    pub epsilon: f64,
    /// How much of the object stays free.
    pub free_volume: FreeVolume,
    /// How deep a link reaches into the object, metres, by exact distances: 0 but for a candidate that starts inside.
    pub penetration: f64,
    /// Why it is no grasp; `None` where it is one.
    pub reason: Option<Reason>,
}

/// Closes a hand in the given pose and pre-shape, and measures what comes of it.
///
/// A candidate that is no grasp comes back as far as it got, with the reason. Its palm may end anywhere: positions are
/// not measured here, so [`Reason::PalmOutsideSphere`] never occurs.
///
/// # Errors
///
/// As [`crate::synthesize`]; and [`GraspError::NotFinite`] for a pose with NaN or infinite numbers.
pub fn close(
    hand: &Hand,
    object: &GraspObject,
    object_from_root: &Isometry3<f64>,
    preshape: &JointPositions,
    options: &CloseOptions,
) -> Result<Closed, GraspError> {
    ReadyHand::new(hand)?.close(object, object_from_root, preshape, options)
}

/// A hand made ready for closing many times, from any number of threads.
#[derive(Debug, Clone)]
pub struct ReadyHand<'a>(GraspHand<'a>);

impl<'a> ReadyHand<'a> {
    /// Makes a hand ready.
    ///
    /// # Errors
    ///
    /// A hand without description, shape or known materials.
    pub fn new(hand: &'a Hand) -> Result<Self, GraspError> {
        GraspHand::new(hand).map(Self)
    }

    /// [`close()`] with this hand.
    ///
    /// # Errors
    ///
    /// [`GraspError::NotFinite`] for a pose or a support plane with NaN or infinite numbers.
    pub fn close(
        &self,
        object: &GraspObject,
        object_from_root: &Isometry3<f64>,
        preshape: &JointPositions,
        options: &CloseOptions,
    ) -> Result<Closed, GraspError> {
        closed(&self.0, object, object_from_root, preshape, options)
    }
}

fn closed(
    model: &GraspHand<'_>,
    object: &GraspObject,
    object_from_root: &Isometry3<f64>,
    preshape: &JointPositions,
    options: &CloseOptions,
) -> Result<Closed, GraspError> {
    let hand = model.hand;
    let numbers = object_from_root
        .translation
        .vector
        .iter()
        .chain(object_from_root.rotation.coords.iter());
    if let Some(value) = numbers
        .copied()
        .chain(options.support_plane)
        .find(|x| !x.is_finite())
    {
        return Err(GraspError::NotFinite {
            what: "a number of the pose or the support plane",
            value,
        });
    }
    let mut solver = EpsilonSolver::default();
    let standing = standing(model, object_from_root, preshape);
    if self_collides(model, preshape) {
        return Ok(rejected(
            model,
            object,
            object_from_root,
            standing,
            Reason::SelfCollision,
        ));
    }
    let mut pose = *object_from_root;
    if options.approach {
        let object_from_palm = pose * hand.root_from_palm(preshape);
        let direction = object_from_palm.rotation * Vector3::z();
        let (low, high) = object.surface().axis_aligned_bounds();
        let farthest = (nalgebra::center(&low, &high) - Point3::from(object_from_palm.translation.vector))
            .norm()
            + (high - low).norm();
        match arrive(model, object, preshape, &pose, direction, farthest) {
            Ok(arrived) if arrived.solid.is_some() => pose = arrived.object_from_root,
            Ok(_) => {
                return Ok(rejected(
                    model,
                    object,
                    object_from_root,
                    standing,
                    Reason::NoContact,
                ));
            }
            Err(reason) => return Ok(rejected(model, object, object_from_root, standing, reason)),
        }
    }
    // A candidate may stand with all of a link inside the object, where no surface is near.
    let sunk = deepest(model, object, &standing.solid_poses) > 0.0;
    let closed = || {
        let posture = close_fingers(model, object, &pose, preshape).ok()?;
        match confirmed(model, object, &pose, preshape, &posture) {
            Confirmed::Clear => Some(posture),
            Confirmed::BackedOff(opened) => Some(opened),
            Confirmed::Stuck => None,
        }
    };
    let Some(posture) = (!sunk).then(closed).flatten() else {
        return Ok(rejected(
            model,
            object,
            object_from_root,
            standing,
            Reason::StartCollision,
        ));
    };
    let checked = checked_contacts(model, object, &posture, options.support_plane);
    let (contacts, mut reason) = match checked {
        Ok(contacts) => (contacts, None),
        Err(reason) => (contacts_of(model, object, &posture.solid_poses), Some(reason)),
    };
    let epsilon = epsilon_of(object, &contacts, &mut solver);
    if reason.is_none() && epsilon <= 0.0 {
        reason = Some(Reason::NotForceClosure);
    }
    let palm = Point3::from((pose * hand.root_from_palm(&posture.joints)).translation.vector);
    let points: Vec<_> = contacts.iter().map(|c| c.at.point).collect();
    Ok(Closed {
        object_from_root: pose,
        penetration: deepest(model, object, &posture.solid_poses),
        joints: posture.joints,
        free_volume: free_volume(&palm, &points, object.leaves()),
        contacts,
        epsilon,
        reason,
    })
}

/// The hand where it stands, open.
fn standing(hand: &GraspHand<'_>, object_from_root: &Isometry3<f64>, preshape: &JointPositions) -> Posture {
    Posture {
        joints: preshape.clone(),
        solid_poses: hand.solid_poses(object_from_root, preshape),
    }
}

fn rejected(
    hand: &GraspHand<'_>,
    object: &GraspObject,
    object_from_root: &Isometry3<f64>,
    posture: Posture,
    reason: Reason,
) -> Closed {
    Closed {
        object_from_root: *object_from_root,
        penetration: deepest(hand, object, &posture.solid_poses),
        joints: posture.joints,
        contacts: Vec::new(),
        epsilon: 0.0,
        free_volume: FreeVolume {
            fvol: 1.0,
            fvol_union: 1.0,
        },
        reason: Some(reason),
    }
}
