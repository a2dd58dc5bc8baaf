//! The stages of the pipeline, one file each. Every stage reads files, writes files and reruns alone.

pub mod ask;
pub mod decompose;
pub mod imitate;
pub mod label;
pub mod learn;
pub mod report;
pub mod synthesize;
