//! Which tasks would a person say that this grasp affords?
//!
//! A scripted tutor stands in for the person who labels grasps with tasks. It looks at what a person would look at: the
//! object's parts, its surface, and where the hand's links are. Each [`Rule`] measures a margin; a soft edge turns it
//! into a probability; a task suits the grasp with the product of its rules' probabilities, and the label is drawn.
//!
//! ```text
//! surface, parts ──▶ TutorObject ─┐
//! hand ───────────▶ TutorHand ────┼─▶ observe ──margins──▶ judge(persona) ──probabilities──▶ draw ──▶ Labels
//! pose, joints, contacts ─────────┘
//! ```
//!
//! What the tutor never sees are the features that a model learns from: no boxes of a decomposition, no tetrahedron, no
//! free volume, no convexity, no unified position. Otherwise a model would only learn the tutor's own arithmetic. This
//! crate depends on geometry and hand alone, and a test says so; [`Rule::nearest_feature`] says for each rule which
//! feature comes nearest to it.
//!
//! Three [`Persona`]s judge the same grasps; [`cohen_kappa`] says how far they agree, [`Prevalence`] how often each label
//! is given, and [`label_ceiling`] how well any classifier could do on such labels.
//!
//! # Examples
//!
//! ```
//! use prehend_tutor::{Persona, Task, label_ceiling};
//!
//! assert_eq!("hand-over".parse::<Task>()?, Task::HandOver);
//! assert_eq!(Persona::ALL.len(), 3);
//! // A grasp that surely suits two tasks can only be answered with one of them.
//! let ceiling = label_ceiling(&[[1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]).expect("two classes occur");
//! assert_eq!(ceiling.mean_recall, 0.75);
//! # Ok::<(), prehend_tutor::TutorError>(())
//! ```

mod error;
mod parts;
mod rule;
mod task;

mod object;
mod placed_hand;
mod samples;

mod judge;
mod observe;

mod agreement;
mod ceiling;

pub use agreement::{Prevalence, TypeCount, cohen_kappa};
pub use ceiling::{Ceiling, label_ceiling};
pub use error::TutorError;
pub use judge::{Judgement, RuleOutcome, TaskJudgement, judge};
pub use object::TutorObject;
pub use observe::{GraspView, Observation, observe};
pub use parts::{ObjectClass, Opening, Parts};
pub use placed_hand::TutorHand;
pub use rule::{Persona, Rule, Thresholds};
pub use task::{Labels, Task};
