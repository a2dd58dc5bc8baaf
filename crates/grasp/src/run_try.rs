//! One try, from its pre-shape to a grasp or a reason.

use nalgebra::{Point3, Translation3, Vector3};
use prehend_hand::JointPositions;
use prehend_quality::EpsilonSolver;

use crate::approach::{Arrived, arrive};
use crate::closing::{close_fingers, self_collides};
use crate::confirm::{Confirmed, confirmed};
use crate::grasp_hand::GraspHand;
use crate::measure::{Closed, measured};
use crate::refine::refined;
use crate::{Face, Grasp, GraspObject, Reason, SynthesisOptions, Tries, Try};

/// Makes one try, and where it holds looks nearby for a better one.
pub(crate) fn run_and_refine(
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
            let mut closed = Closed {
                object_from_root,
                posture,
            };
            let grasp = measured(hand, object, attempt, &closed, support_plane, solver)?;
            match confirmed(hand, object, &object_from_root, &preshape, &closed.posture) {
                Confirmed::Clear => Ok(grasp),
                Confirmed::BackedOff(posture) => {
                    closed.posture = posture;
                    measured(hand, object, attempt, &closed, support_plane, solver)
                }
                Confirmed::Stuck => Err(Reason::StartCollision),
            }
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
