//! What a closed hand holds: its contacts, ε and features.

use nalgebra::{Isometry3, Point3, Vector3};
use prehend_quality::{Contact, EpsilonSolver, GraspWrenchSpace};

use crate::closing::Posture;
use crate::contacts::{CONTACT_TOLERANCE, contacts_of};
use crate::features::free_volume_with;
use crate::grasp_hand::GraspHand;
use crate::{Features, Grasp, GraspObject, LinkContact, Reason, Try, palm_orientation, unified_position};

/// A hand that has been closed.
pub(crate) struct Closed {
    pub(crate) object_from_root: Isometry3<f64>,
    pub(crate) posture: Posture,
}

/// The features and ε of a closed hand.
pub(crate) fn measured(
    hand: &GraspHand<'_>,
    object: &GraspObject,
    attempt: &Try,
    closed: &Closed,
    support_plane: Option<f64>,
    solver: &mut EpsilonSolver,
) -> Result<Grasp, Reason> {
    let contacts = checked_contacts(hand, object, &closed.posture, support_plane)?;
    let object_from_palm = closed.object_from_root * hand.hand.root_from_palm(&closed.posture.joints);
    let upos =
        unified_position(&object_from_palm, &object.root().center()).ok_or(Reason::PalmOutsideSphere)?;
    let qeps = epsilon_of(object, &contacts, solver);
    if qeps <= 0.0 {
        return Err(Reason::NotForceClosure);
    }
    let points: Vec<Point3<f64>> = contacts.iter().map(|c| c.at.point).collect();
    let (sum, union) = object.box_volumes();
    let palm = Point3::from(object_from_palm.translation.vector);
    let free = free_volume_with(&palm, &points, object.leaves(), sum, union);
    let Try {
        try_idx,
        hypothesis,
        preshape_idx,
        egpc,
    } = *attempt;
    Ok(Grasp {
        try_idx,
        box_idx: hypothesis.box_idx,
        face: hypothesis.face,
        roll: hypothesis.roll,
        preshape_idx,
        offset: hypothesis.offset,
        object_from_root: closed.object_from_root,
        joints: closed.posture.joints.clone(),
        contacts,
        features: Features {
            size: object.size(),
            cvex: object.cvex(),
            egpc,
            upos,
            dir: palm_orientation(&object_from_palm.rotation),
            fvol: free.fvol,
            fvol_union: free.fvol_union,
            qeps,
        },
    })
}
/// Contacts of a closed hand, where it may stand like this.
pub(crate) fn checked_contacts(
    hand: &GraspHand<'_>,
    object: &GraspObject,
    posture: &Posture,
    support_plane: Option<f64>,
) -> Result<Vec<LinkContact>, Reason> {
    for (solid, pose) in hand.solids.iter().zip(&posture.solid_poses) {
        if !solid.may_touch
            && object.surface().gap_lower_bound(&solid.collider, pose) < CONTACT_TOLERANCE
            && object
                .surface()
                .gap(&solid.collider, pose, CONTACT_TOLERANCE)
                .is_some()
        {
            return Err(Reason::ForbiddenLink);
        }
        if support_plane.is_some_and(|z| solid.collider.lowest_along(&Vector3::z(), pose) < z) {
            return Err(Reason::BelowSupportPlane);
        }
    }
    let contacts = contacts_of(hand, object, &posture.solid_poses);
    match contacts.len() {
        0 => Err(Reason::NoContact),
        1 => Err(Reason::TooFewContacts),
        _ => Ok(contacts),
    }
}

/// ε of contacts; 0 where they do not hold, for whatever reason.
pub(crate) fn epsilon_of(object: &GraspObject, contacts: &[LinkContact], solver: &mut EpsilonSolver) -> f64 {
    let contacts: Vec<Contact> = contacts
        .iter()
        .map(|c| Contact {
            at: c.at,
            mu: c.mu,
            torsion: c.torsion,
        })
        .collect();
    GraspWrenchSpace::new(&contacts, &object.quality_options())
        .and_then(|space| solver.epsilon(&space))
        .unwrap_or(0.0)
}
