//! The sections of the page: what each needs, and how it reads.

pub(crate) mod account;
pub(crate) mod experiment_a;
pub(crate) mod experiment_b;
pub(crate) mod experiment_c;
pub(crate) mod labels;
pub(crate) mod objects;
pub(crate) mod run;
pub(crate) mod summary;
pub(crate) mod training;
pub(crate) mod tries;
