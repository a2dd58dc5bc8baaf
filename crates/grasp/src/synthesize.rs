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
use crate::refine::refined;
use crate::{
    Face, Features, Grasp, GraspError, GraspObject, LinkContact, Preshapes, Reason, Tries, Try, hypotheses,
    palm_orientation, unified_position,
};

/// Tries between two looks at whether there are enough grasps.
pub const ROUND: usize = 200;
/// Tries whose grasps are held at once where nobody asks.
const LONG_ROUND: usize = 4096;

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
    /// Which boxes hypotheses come from.
    pub boxes: HypothesisBoxes,
    /// How hypotheses get their pre-shapes.
    pub preshapes: Preshapes,
    /// Steps of local search for a larger ε, for each grasp that holds; each costs about a try. None in the paper.
    pub refinement: usize,
}

/// Which boxes hypotheses come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum HypothesisBoxes {
    /// The leaves of the decomposition only.
    Leaves,
    /// The inner nodes of its tree, too: the object as a whole, and parts that a hand takes together.
    #[default]
    Tree,
}

impl Default for SynthesisOptions {
    fn default() -> Self {
        Self {
            tries: 1200,
            enough: None,
            seed: 0,
            stream: String::new(),
            support_plane: None,
            boxes: HypothesisBoxes::default(),
            preshapes: Preshapes::default(),
            refinement: 0,
        }
    }
}

/// What a try is going to be, before anything is closed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Proposal {
    /// Eigengrasp amplitudes.
    pub egpc: [f64; 2],
    /// Where the hand comes from: `upos` of the palm on its approach line.
    pub upos: [f64; 3],
    /// Orientation of the palm frame: w, x, y, z.
    pub dir: [f64; 4],
}

/// How the tries went, without the grasps.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tally {
    /// How many grasps hold.
    pub kept: usize,
    /// How many tries failed, and why.
    pub rejected: BTreeMap<Reason, usize>,
    /// How many tries were looked at; those passed over among them.
    pub tried: usize,
    /// How many hypotheses there are.
    pub n_hypotheses: usize,
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
    let mut grasps = Vec::new();
    let tally = synthesize_each(hand, object, options, None, progress, &mut |grasp| {
        grasps.push(grasp);
        true
    })?;
    Ok(Synthesis {
        grasps,
        rejected: tally.rejected,
        tried: tally.tried,
        n_hypotheses: tally.n_hypotheses,
    })
}

/// Tries that may be passed over for each one that is closed, at most.
const MOST_PASSED_OVER: usize = 100;

/// [`synthesize`] that hands grasps over as they are found, in order of their tries, and keeps none: any number of tries
/// needs the memory of one round.
///
/// Where `wanted` is given, it is asked before a try is closed; those that it does not want are counted as
/// [`Reason::PassedOver`] and others are made in their place, up to a hundred for each. `each` may return false to end
/// the search.
///
/// # Errors
///
/// As [`synthesize`].
pub fn synthesize_each(
    hand: &Hand,
    object: &GraspObject,
    options: &SynthesisOptions,
    wanted: Option<&(dyn Fn(&Proposal) -> bool + Sync)>,
    progress: &(dyn Fn(usize) -> bool + Sync),
    each: &mut dyn FnMut(Grasp) -> bool,
) -> Result<Tally, GraspError> {
    let (model, tries) = prepared(hand, object, options)?;
    let mut tally = Tally {
        n_hypotheses: tries.n_hypotheses(),
        ..Tally::default()
    };
    let n_tries = if tries.n_hypotheses() == 0 {
        0
    } else {
        options.tries
    };
    let most_looked_at = wanted.map_or(n_tries, |_| n_tries.saturating_mul(MOST_PASSED_OVER));
    let round_length = if options.enough.is_some() || wanted.is_some() {
        ROUND
    } else {
        LONG_ROUND
    };
    let (stop, finished) = (AtomicBool::new(false), AtomicUsize::new(0));
    let mut n_closed = 0;
    while n_closed < n_tries
        && tally.tried < most_looked_at
        && options.enough.is_none_or(|enough| tally.kept < enough)
    {
        let length = round_length
            .min(n_tries - n_closed)
            .min(most_looked_at - tally.tried);
        let round = tally.tried..tally.tried + length;
        tally.tried = round.end;
        let outcomes: Vec<Option<Result<Grasp, Reason>>> = round
            .into_par_iter()
            .map_init(EpsilonSolver::default, |solver, try_idx| {
                if stop.load(Ordering::Relaxed) {
                    return None;
                }
                let attempt = tries.get(try_idx, object)?;
                let is_wanted =
                    wanted.is_none_or(|wanted| proposal(&attempt, object).is_some_and(|p| wanted(&p)));
                if !is_wanted {
                    return Some(Err(Reason::PassedOver));
                }
                let outcome = run_and_refine(&model, object, &tries, &attempt, options, solver);
                let n_finished = finished.fetch_add(1, Ordering::Relaxed) + 1;
                if !progress(n_finished) {
                    stop.store(true, Ordering::Relaxed);
                }
                Some(outcome)
            })
            .collect();
        for outcome in outcomes.into_iter().flatten() {
            n_closed += usize::from(outcome != Err(Reason::PassedOver));
            match outcome {
                Ok(grasp) => {
                    tally.kept += 1;
                    if !each(grasp) {
                        stop.store(true, Ordering::Relaxed);
                    }
                }
                Err(reason) => *tally.rejected.entry(reason).or_insert(0) += 1,
            }
        }
        if stop.load(Ordering::Relaxed) {
            return Err(GraspError::Stopped {
                tried: finished.into_inner(),
            });
        }
    }
    Ok(tally)
}

/// What a try is going to be; `None` where the palm starts outside the sphere on which positions are measured.
fn proposal(attempt: &Try, object: &GraspObject) -> Option<Proposal> {
    let object_from_palm = attempt.hypothesis.object_from_palm(object);
    Some(Proposal {
        egpc: attempt.egpc,
        upos: unified_position(&object_from_palm, &object.root().center())?,
        dir: palm_orientation(&object_from_palm.rotation),
    })
}

/// Makes one try, and where it holds looks nearby for a better one.
fn run_and_refine(
    hand: &GraspHand<'_>,
    object: &GraspObject,
    tries: &Tries,
    attempt: &Try,
    options: &SynthesisOptions,
    solver: &mut EpsilonSolver,
) -> Result<Grasp, Reason> {
    let grasp = run_try(hand, object, attempt, options.support_plane, solver)?;
    if options.refinement == 0 {
        return Ok(grasp);
    }
    let seed = tries.seed_of(attempt.try_idx);
    Ok(refined(
        grasp,
        attempt,
        object,
        options.refinement,
        seed,
        |nearby| run_try(hand, object, nearby, options.support_plane, solver).ok(),
    ))
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
    Ok(run_and_refine(
        &model,
        object,
        &tries,
        &attempt,
        options,
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
    let mut found = hypotheses(object, model.description().opening_width, model.palm_width);
    if options.boxes == HypothesisBoxes::Leaves {
        found.retain(|hypothesis| hypothesis.box_idx < object.leaves().len());
    }
    let tries = Tries::new(found, options.seed, &options.stream).with_preshapes(options.preshapes);
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
