//! Why a demonstration could not be imitated.

use prehend_model::ModelError;

/// Why a demonstration could not be imitated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ImitationError {
    /// A model cannot answer.
    #[error(transparent)]
    Model(#[from] ModelError),

    /// The two models do not speak of the same tasks.
    #[error(
        "the demonstrator knows the tasks {demonstrator}, the imitator {imitator}; train both with the same states of `task`"
    )]
    Tasks {
        /// The demonstrator's.
        demonstrator: String,
        /// The imitator's.
        imitator: String,
    },

    /// There is nothing to choose from.
    #[error("there is no candidate {what} to choose from; give the imitator more grasps")]
    NoCandidates {
        /// `object` or `grasp`.
        what: &'static str,
    },

    /// The imitator's model does not know its training data's units.
    #[error(
        "node `{node}` of the imitator's model does not say by which units its training data were standardised; \
         train it with `prehend train`, or take the units from grasps"
    )]
    Unscaled {
        /// The node.
        node: String,
    },

    /// λ is no weight.
    #[error("lambda is {lambda}; expected a number from 0 (similarity alone) to 1 (task alone)")]
    Lambda {
        /// What was given.
        lambda: f64,
    },
}
