//! A grasp that holds, moved a little until it holds better.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::{Face, Grasp, GraspObject, Try};

/// The first steps: along the face (m) and of the amplitudes.
const FIRST_STEPS: [f64; 4] = [0.008, 0.008, 0.2, 0.2];
/// A better place makes further steps longer by this, a worse one shorter.
const LONGER: f64 = 1.5;
const SHORTER: f64 = 0.8;

/// The best of a grasp and `n_steps` tries around the best so far, in place on the face and pre-shape.
///
/// A random search that asks for no derivative: ε has none where contacts come and go. `again` makes a try; what does
/// not hold is no step.
pub(crate) fn refined(
    grasp: Grasp,
    attempt: &Try,
    object: &GraspObject,
    n_steps: usize,
    seed: u64,
    mut again: impl FnMut(&Try) -> Option<Grasp>,
) -> Grasp {
    let hypothesis = &attempt.hypothesis;
    let face = Face::of(
        &object.regions()[hypothesis.box_idx].oriented_box,
        hypothesis.face,
    );
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut best, mut at, mut scale) = (grasp, *attempt, 1.0);
    for _ in 0..n_steps {
        let mut nearby = at;
        let mut step = |k: usize| scale * FIRST_STEPS[k] * rng.random_range(-1.0..=1.0);
        for k in 0..2 {
            let end = face.lengths[k] / 2.0;
            nearby.hypothesis.offset[k] = (at.hypothesis.offset[k] + step(k)).clamp(-end, end);
            nearby.egpc[k] = (at.egpc[k] + step(k + 2)).clamp(-1.0, 1.0);
        }
        match again(&nearby).filter(|found| found.features.qeps > best.features.qeps) {
            Some(found) => {
                (best, at) = (found, nearby);
                scale *= LONGER;
            }
            None => scale *= SHORTER,
        }
    }
    best
}
