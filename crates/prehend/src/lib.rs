//! How do the stages become the experiments? The library of stages.
