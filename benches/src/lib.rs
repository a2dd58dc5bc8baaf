//! Benchmarks of the kernels that the pipeline spends its time in.
//!
//! `cargo bench -p prehend-benches` runs them; `baselines/` keeps dated results as text, `peers/` the scripts that put the
//! same questions to other programs.

pub mod paper_network;
