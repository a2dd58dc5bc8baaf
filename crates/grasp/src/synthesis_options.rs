//! What to look for, and where.

use crate::Preshapes;

/// How many grasps to look for, and where.
#[derive(Debug, Clone, PartialEq)]
pub struct SynthesisOptions {
    /// How many tries to make. The paper's own is five pre-shapes for every hypothesis.
    pub tries: usize,
    /// Stop early once this many grasps hold: easy objects need fewer tries than hard ones. Asked after every
    /// [`crate::ROUND`] tries, so that the answer does not depend on threads.
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
