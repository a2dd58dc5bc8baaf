//! Tries, closed and measured: those that hold are grasps.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use prehend_hand::Hand;
use prehend_quality::EpsilonSolver;
use rayon::prelude::*;

use crate::grasp_hand::GraspHand;
use crate::run_try::run_and_refine;
use crate::{
    Grasp, GraspError, GraspObject, HypothesisBoxes, Reason, SynthesisOptions, Tries, Try, hypotheses,
    palm_orientation, unified_position,
};

/// Tries between two looks at whether there are enough grasps.
pub const ROUND: usize = 200;
/// Tries whose grasps are held at once where nobody asks.
const LONG_ROUND: usize = 4096;

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
