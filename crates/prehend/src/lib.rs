//! How do the stages become the experiments?
//!
//! Each stage of the paper — plan, close, measure, label, train, ask, imitate — is a function here that reads files,
//! writes files and reruns alone; [`pipeline`] puts them in order.

pub mod error;
pub mod experiments;
pub mod export;
pub mod files;
pub mod frame;
pub mod grasp_table;
pub mod hand_folder;
pub mod hand_init;
pub mod labels;
pub mod object;
pub mod partial_view;
pub mod pipeline;
pub mod plan;
pub mod progress;
pub mod run_record;
pub mod stages;
pub mod training;

/// The crates below, so that a program needs only this one.
pub use prehend_geometry as geometry;
pub use prehend_grasp as grasp;
pub use prehend_hand as hand;
pub use prehend_imitation as imitation;
pub use prehend_model as model;
pub use prehend_quality as quality;
pub use prehend_report as report;
pub use prehend_tutor as tutor;

pub use error::Error;
pub use object::{Object, ObjectOptions};
