//! Which object and grasp best match a demonstration?
//!
//! A demonstrator (the human hand in the paper) shows a grasp; the imitator (a robot's hand) reads the task from it and
//! chooses, among objects and grasps of its own, what serves that task and resembles the demonstration. The two share
//! nothing but the names of the tasks: each has a network of its own.
//!
//! 1. [`recognise`]: t̂ = argmax Pᴴ(T | o, a, c).
//! 2. [`rank_objects`]: candidate objects by Pᴿ(t̂ | o) and their likeness with the shown object.
//! 3. [`rank_grasps`]: candidate grasps by Pᴿ(t̂ | o, a, c) and their likeness with the shown grasp; over all objects at
//!    once it gives the joint choices of Eqs. 3 and 5.
//!
//! [`expected_reward`] is Eq. 2 with any reward and the whole posterior over t̂.
//!
//! # Examples
//!
//! ```
//! use prehend_imitation::expected_reward;
//!
//! // Two tasks, P(t̂ | demonstration) and P(t | candidate); the reward is 1 for the right task.
//! let right = |shown: usize, done: usize| f64::from(u8::from(shown == done));
//! let reward = expected_reward(&[0.9, 0.1], &[0.8, 0.2], right);
//! assert!((reward - 0.74).abs() < 1e-12);
//! ```

mod error;
mod rank;
mod recognise;
mod scales;

pub use error::ImitationError;
pub use rank::{Candidate, Ranked, SQUARED_DISTANCE_FLOOR, Similarity, Weighing, rank_grasps, rank_objects};
pub use recognise::{TaskPosterior, evidence, expected_reward, recognise};
pub use scales::Scales;
