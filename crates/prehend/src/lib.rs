//! How do the stages become the experiments?
//!
//! Each stage of the paper — plan, close, measure, label, train, ask, imitate — is a function here that reads files,
//! writes files and reruns alone; [`pipeline`] puts them in order.

pub mod error;
pub mod experiments;
pub mod files;
pub mod frame;
pub mod grasp_table;
pub mod hand_folder;
pub mod labels;
pub mod object;
pub mod pipeline;
pub mod plan;
pub mod progress;
pub mod run_record;
pub mod stages;
pub mod training;

pub use error::Error;
pub use object::{Object, ObjectOptions};
