//! Which try is what: hypotheses in turn, their pre-shapes, and at last places beside them.

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::{Face, GraspObject, Hypothesis};

/// Pre-shapes that the paper gives every hypothesis.
pub const PRESHAPES: usize = 5;
/// Further tries add pre-shapes up to this many per hypothesis; beyond it, each also moves on the face.
pub const MOST_PRESHAPES: usize = 20;
/// How far from a hypothesis such a try may lie, as a share of the face's edges (either way).
pub const OFFSET_SHARE: f64 = 0.25;

/// 1/φ and 1/φ² with φ³ = φ + 1.
const EVEN_STEPS: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_2];

/// One try: a hypothesis and a pre-shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Try {
    /// Its number.
    pub try_idx: usize,
    /// Where the hand comes from; its offset is final.
    pub hypothesis: Hypothesis,
    /// Which pre-shape of the hypothesis.
    pub preshape_idx: usize,
    /// Amplitudes of the pre-shape, each uniform in [−1, 1].
    pub egpc: [f64; 2],
}

/// All tries of an object, numbered. Any try can be had without the ones before it.
///
/// Tries go round: each round visits every hypothesis once, in an order shuffled by the seed, with a fresh pre-shape.
/// So few tries spread over all hypotheses, and the first N tries are the same whatever the budget. Rounds 0 to 4 are
/// the paper's five pre-shapes, rounds up to [`MOST_PRESHAPES`] add more; from then on each try also moves by a random
/// offset of up to [`OFFSET_SHARE`] of the face's edges. What is random depends on (seed, stream, hypothesis, round) only.
#[derive(Debug, Clone)]
pub struct Tries {
    hypotheses: Vec<Hypothesis>,
    order: Vec<usize>,
    seed: u64,
    preshapes: Preshapes,
}

/// How a hypothesis gets its pre-shapes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Preshapes {
    /// Drawn independently, as in the paper.
    #[default]
    Random,
    /// A sequence that fills the square evenly, shifted at random for each hypothesis: multiples of 1/φ and 1/φ², φ the
    /// root of φ³ = φ + 1.
    LowDiscrepancy,
}

impl Tries {
    /// Numbers the tries. `stream` tells objects and hands apart, so that each draws its own numbers.
    pub fn new(hypotheses: Vec<Hypothesis>, seed: u64, stream: &str) -> Self {
        let seed = mixed(stream.bytes().fold(mixed(seed), |h, b| mixed(h ^ u64::from(b))));
        let mut order: Vec<usize> = (0..hypotheses.len()).collect();
        order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
        Self {
            hypotheses,
            order,
            seed,
            preshapes: Preshapes::default(),
        }
    }

    /// The same tries with pre-shapes of this kind.
    #[must_use]
    pub fn with_preshapes(self, preshapes: Preshapes) -> Self {
        Self { preshapes, ..self }
    }

    /// A seed of its own for whatever a try draws later.
    pub(crate) fn seed_of(&self, try_idx: usize) -> u64 {
        mixed(mixed(!self.seed) ^ try_idx as u64)
    }

    /// How many hypotheses there are.
    pub fn n_hypotheses(&self) -> usize {
        self.hypotheses.len()
    }

    /// One try; `None` where there are no hypotheses.
    pub fn get(&self, try_idx: usize, object: &GraspObject) -> Option<Try> {
        let n = self.hypotheses.len();
        if n == 0 {
            return None;
        }
        let (round, hypothesis_idx) = (try_idx / n, self.order[try_idx % n]);
        let mut hypothesis = self.hypotheses[hypothesis_idx];
        let item = mixed(mixed(self.seed ^ hypothesis_idx as u64) ^ round as u64);
        let mut rng = ChaCha8Rng::seed_from_u64(item);
        let mut egpc = [rng.random_range(-1.0..=1.0), rng.random_range(-1.0..=1.0)];
        if self.preshapes == Preshapes::LowDiscrepancy {
            let mut of_hypothesis = ChaCha8Rng::seed_from_u64(mixed(self.seed ^ hypothesis_idx as u64));
            for (amplitude, step) in egpc.iter_mut().zip(EVEN_STEPS) {
                let shift: f64 = of_hypothesis.random_range(0.0..1.0);
                *amplitude = 2.0 * (shift + round as f64 * step).fract() - 1.0;
            }
        }
        if round >= MOST_PRESHAPES {
            let face = Face::of(
                &object.regions()[hypothesis.box_idx].oriented_box,
                hypothesis.face,
            );
            for (offset, length) in hypothesis.offset.iter_mut().zip(face.lengths) {
                let moved = *offset + rng.random_range(-OFFSET_SHARE..=OFFSET_SHARE) * length;
                *offset = moved.clamp(-length / 2.0, length / 2.0);
            }
        }
        Some(Try {
            try_idx,
            hypothesis,
            preshape_idx: round,
            egpc,
        })
    }
}

/// Spreads bits: neighbouring inputs give unrelated seeds (the finaliser of splitmix64).
fn mixed(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hypotheses;
    use crate::testing::boxes_object;

    fn tries(object: &GraspObject, seed: u64, stream: &str) -> Vec<Try> {
        let tries = Tries::new(hypotheses(object, 0.1, 0.08), seed, stream);
        (0..24 * 22).map(|i| tries.get(i, object).unwrap()).collect()
    }

    #[test]
    fn every_round_visits_every_hypothesis_once() {
        let cube = boxes_object(&[([0.0; 3], [0.04; 3])]);
        for (round, chunk) in tries(&cube, 1, "cube").chunks(24).enumerate() {
            let mut seen: Vec<_> = chunk
                .iter()
                .map(|t| (t.hypothesis.face, t.hypothesis.roll))
                .collect();
            seen.sort_unstable();
            seen.dedup();
            assert_eq!(seen.len(), 24);
            assert!(chunk.iter().all(|t| t.preshape_idx == round));
            assert!(chunk.iter().all(|t| t.egpc.iter().all(|a| a.abs() <= 1.0)));
            let moved = chunk.iter().any(|t| t.hypothesis.offset != [0.0; 2]);
            assert_eq!(moved, round >= MOST_PRESHAPES);
        }
    }

    #[test]
    fn seed_and_stream_change_the_draws_and_nothing_else_does() {
        let cube = boxes_object(&[([0.0; 3], [0.04; 3])]);
        let first = tries(&cube, 1, "cube");
        assert_eq!(first, tries(&cube, 1, "cube"));
        for other in [tries(&cube, 2, "cube"), tries(&cube, 1, "cabe")] {
            assert!(first.iter().zip(&other).all(|(a, b)| a.egpc != b.egpc));
        }
    }

    #[test]
    fn even_pre_shapes_fill_the_square_more_evenly_than_random_ones() {
        let cube = boxes_object(&[([0.0; 3], [0.04; 3])]);
        let empty_cells = |preshapes| {
            let tries = Tries::new(hypotheses(&cube, 0.1, 0.08), 1, "cube").with_preshapes(preshapes);
            let mut of_hypothesis = std::collections::BTreeMap::new();
            for t in (0..24 * 16).map(|i| tries.get(i, &cube).unwrap()) {
                let cell = t.egpc.map(|a| ((a + 1.0) * 2.0).min(3.0) as usize);
                let seen = of_hypothesis.entry((t.hypothesis.face, t.hypothesis.roll));
                seen.or_insert_with(std::collections::BTreeSet::new).insert(cell);
            }
            of_hypothesis
                .values()
                .map(|cells| 16 - cells.len())
                .sum::<usize>()
        };
        let (even, random) = (
            empty_cells(Preshapes::LowDiscrepancy),
            empty_cells(Preshapes::Random),
        );
        assert!(2 * even < random, "{even} {random}");
    }

    #[test]
    fn an_object_without_hypotheses_has_no_tries() {
        let boulder = boxes_object(&[([0.0; 3], [1.0; 3])]);
        assert!(
            Tries::new(hypotheses(&boulder, 0.1, 0.08), 0, "")
                .get(0, &boulder)
                .is_none()
        );
    }
}
