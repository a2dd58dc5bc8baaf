//! Tries, closed and measured: those that hold are grasps.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use nalgebra::{Isometry3, Point3, Translation3, Vector3};
use prehend_hand::{Hand, JointPositions};
use prehend_quality::{Contact, EpsilonSolver, GraspWrenchSpace};
use rayon::prelude::*;

use crate::approach::Approach;
use crate::closing::{Posture, close_fingers, self_collides};
use crate::contacts::{CONTACT_TOLERANCE, contacts_of};
use crate::features::free_volume_with;
use crate::grasp_hand::GraspHand;
use crate::{
    Face, Features, Grasp, GraspError, GraspObject, LinkContact, Reason, Tries, Try, hypotheses,
    palm_orientation, unified_position,
};

/// Tries between two looks at whether there are enough grasps.
pub const ROUND: usize = 200;

/// How many grasps to look for, and where.
#[derive(Debug, Clone, PartialEq)]
pub struct SynthesisOptions {
    /// How many tries to make. The paper's own is five pre-shapes for every hypothesis.
    pub tries: usize,
    /// Stop early once this many grasps hold: easy objects need fewer tries than hard ones. Asked after every
    /// [`ROUND`] tries, so that the answer does not depend on threads.
    pub enough: Option<usize>,
    /// Seed of everything random.
    pub seed: u64,
    /// Names hand and object, so that each pair draws its own numbers.
    pub stream: String,
    /// No part of the hand may lie below this height (m) in the object's frame.
    pub support_plane: Option<f64>,
}

impl Default for SynthesisOptions {
    fn default() -> Self {
        Self {
            tries: 1200,
            enough: None,
            seed: 0,
            stream: String::new(),
            support_plane: None,
        }
    }
}

/// What became of the tries.
#[derive(Debug, Clone, PartialEq)]
pub struct Synthesis {
    /// The force-closure grasps, in order of their tries.
    pub grasps: Vec<Grasp>,
    /// How many tries failed, and why. Together with the grasps they are all tries.
    pub rejected: BTreeMap<Reason, usize>,
    /// How many tries were made: 0 where the object has no face that the hand can close around.
    pub tried: usize,
    /// How many hypotheses there are.
    pub n_hypotheses: usize,
}

/// Looks for force-closure grasps.
///
/// Each try puts the open hand in its pre-shape before a face, moves it in until something touches, closes the fingers,
/// collects the contacts and measures them. Runs on rayon's current thread pool; the result does not depend on its size.
/// `progress` is called with the number of tries finished so far, from any thread; where it returns false the search ends.
///
/// # Errors
///
/// A hand without description, shape or known materials; a support plane that is no number; [`GraspError::Stopped`].
pub fn synthesize(
    hand: &Hand,
    object: &GraspObject,
    options: &SynthesisOptions,
    progress: &(dyn Fn(usize) -> bool + Sync),
) -> Result<Synthesis, GraspError> {
    let (model, tries) = prepared(hand, object, options)?;
    let n_tries = if tries.n_hypotheses() == 0 {
        0
    } else {
        options.tries
    };
    let (stop, finished) = (AtomicBool::new(false), AtomicUsize::new(0));
    let mut grasps = Vec::new();
    let mut rejected = BTreeMap::new();
    let mut tried = 0;
    while tried < n_tries && options.enough.is_none_or(|enough| grasps.len() < enough) {
        let round = tried..n_tries.min(tried + options.enough.map_or(n_tries, |_| ROUND));
        tried = round.end;
        let outcomes: Vec<Option<Result<Grasp, Reason>>> = round
            .into_par_iter()
            .map_init(EpsilonSolver::default, |solver, try_idx| {
                if stop.load(Ordering::Relaxed) {
                    return None;
                }
                let attempt = tries.get(try_idx, object)?;
                let outcome = run_try(&model, object, &attempt, options.support_plane, solver);
                let n_finished = finished.fetch_add(1, Ordering::Relaxed) + 1;
                if !progress(n_finished) {
                    stop.store(true, Ordering::Relaxed);
                }
                Some(outcome)
            })
            .collect();
        if stop.load(Ordering::Relaxed) {
            return Err(GraspError::Stopped {
                tried: finished.into_inner(),
            });
        }
        for outcome in outcomes.into_iter().flatten() {
            match outcome {
                Ok(grasp) => grasps.push(grasp),
                Err(reason) => *rejected.entry(reason).or_insert(0) += 1,
            }
        }
    }
    Ok(Synthesis {
        grasps,
        rejected,
        tried,
        n_hypotheses: tries.n_hypotheses(),
    })
}

/// Makes one try again: the grasp of a row, from its try's number and the options that the table was made with.
///
/// # Errors
///
/// As [`synthesize`]; and [`GraspError::NoSuchTry`] where the object has no hypotheses.
pub fn retry(
    hand: &Hand,
    object: &GraspObject,
    options: &SynthesisOptions,
    try_idx: usize,
) -> Result<Result<Grasp, Reason>, GraspError> {
    let (model, tries) = prepared(hand, object, options)?;
    let attempt = tries
        .get(try_idx, object)
        .ok_or(GraspError::NoSuchTry { try_idx })?;
    Ok(run_try(
        &model,
        object,
        &attempt,
        options.support_plane,
        &mut EpsilonSolver::default(),
    ))
}

fn prepared<'a>(
    hand: &'a Hand,
    object: &GraspObject,
    options: &SynthesisOptions,
) -> Result<(GraspHand<'a>, Tries), GraspError> {
    if let Some(value) = options.support_plane.filter(|z| !z.is_finite()) {
        return Err(GraspError::NotFinite {
            what: "the support plane's height",
            value,
        });
    }
    let model = GraspHand::new(hand)?;
    let found = hypotheses(object, model.description().opening_width, model.palm_width);
    let tries = Tries::new(found, options.seed, &options.stream);
    Ok((model, tries))
}

/// Makes one try.
fn run_try(
    hand: &GraspHand<'_>,
    object: &GraspObject,
    attempt: &Try,
    support_plane: Option<f64>,
    solver: &mut EpsilonSolver,
) -> Result<Grasp, Reason> {
    let preshape = hand.hand.preshape(attempt.egpc);
    if self_collides(hand, &preshape) {
        return Err(Reason::SelfCollision);
    }
    let hypothesis = &attempt.hypothesis;
    let face = Face::of(
        &object.regions()[hypothesis.box_idx].oriented_box,
        hypothesis.face,
    );
    let palm_on_face = hypothesis.object_from_palm(object);
    let palm_from_root = hand.hand.root_from_palm(&preshape).inverse();
    let out = stand_off(hand, &preshape);
    let start = Translation3::from(face.normal * out) * palm_on_face * palm_from_root;
    // To the face, and on to the middle of its box: a body may be slimmer than its box.
    let arrival = arrive(
        hand,
        object,
        &preshape,
        &start,
        -face.normal,
        out + face.depth / 2.0,
    )?;
    let mut failure = None;
    for back in backings(hand, object, &arrival) {
        let object_from_root = Translation3::from(face.normal * back) * arrival.object_from_root;
        let posture =
            close_fingers(hand, object, &object_from_root, &preshape).map_err(|_| Reason::StartCollision);
        let grasp = posture.and_then(|posture| {
            let closed = Closed {
                object_from_root,
                posture,
            };
            measured(hand, object, attempt, &closed, support_plane, solver)
        });
        match grasp {
            Ok(grasp) => return Ok(grasp),
            // The reason that counts is the first one's.
            Err(reason) => {
                failure = failure.or(Some(reason));
                if reason == Reason::NoContact {
                    break;
                }
            }
        }
    }
    Err(failure.unwrap_or(Reason::NoContact))
}

/// A hand that has been closed.
pub(crate) struct Closed {
    pub(crate) object_from_root: Isometry3<f64>,
    pub(crate) posture: Posture,
}

/// A hand that has come in.
pub(crate) struct Arrived {
    pub(crate) object_from_root: Isometry3<f64>,
    pub(crate) object_from_palm: Isometry3<f64>,
    /// The solid that touched first.
    pub(crate) solid: Option<usize>,
}

/// Moves an open hand along `direction` until something touches, at most `farthest`.
pub(crate) fn arrive(
    hand: &GraspHand<'_>,
    object: &GraspObject,
    preshape: &JointPositions,
    object_from_root: &Isometry3<f64>,
    direction: Vector3<f64>,
    farthest: f64,
) -> Result<Arrived, Reason> {
    let poses = hand.all_poses(preshape);
    let start = hand
        .solids
        .iter()
        .map(|s| object_from_root * poses[s.link.0] * s.link_from_solid)
        .collect();
    let approach = Approach {
        hand,
        object,
        start,
        direction,
    };
    let arrival = approach.run(farthest).ok_or(Reason::StartCollision)?;
    if arrival.solid.is_some_and(|i| !hand.solids[i].may_touch) {
        return Err(Reason::ForbiddenLink);
    }
    let object_from_root = Translation3::from(direction * arrival.travelled) * object_from_root;
    Ok(Arrived {
        object_from_root,
        object_from_palm: object_from_root * hand.hand.root_from_palm(preshape),
        solid: arrival.solid,
    })
}

/// A palm this near to the object has arrived, metres; farther away, a finger stood in its way.
const NEAR_PALM: f64 = 0.030;
/// Such a hand backs off in steps of this length, metres, up to [`MOST_STEPS_BACK`] times, and closes again.
const STEP_BACK: f64 = 0.010;
const MOST_STEPS_BACK: u32 = 3;

/// Distances to try to close at: where the hand arrived, and a few steps back where a finger stopped it far away.
fn backings(hand: &GraspHand<'_>, object: &GraspObject, arrival: &Arrived) -> Vec<f64> {
    let palm = hand.description().palm.link;
    let by_finger = arrival.solid.is_some_and(|i| hand.solids[i].link != palm);
    let origin = Point3::from(arrival.object_from_palm.translation.vector);
    let far = by_finger && object.surface().closest_point(&origin).distance > NEAR_PALM;
    let n_steps = if far { MOST_STEPS_BACK } else { 0 };
    (0..=n_steps).map(|k| f64::from(k) * STEP_BACK).collect()
}

/// How far the palm must be from a face so that no part of the hand reaches it, and 50 mm more.
fn stand_off(hand: &GraspHand<'_>, preshape: &JointPositions) -> f64 {
    let poses = hand.all_poses(preshape);
    let palm_from_root = hand.hand.root_from_palm(preshape).inverse();
    let reach = hand.solids.iter().map(|s| {
        let palm_from_solid = palm_from_root * poses[s.link.0] * s.link_from_solid;
        -s.collider.lowest_along(&-Vector3::z(), &palm_from_solid)
    });
    reach.fold(0.0, f64::max) + 0.05
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

/// The features and ε of a closed hand.
fn measured(
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
