//! What follows from evidence in a mixed Bayesian network?
//!
//! A [`Network`] says which nodes there are, which arcs, and how each node is to be trained: `network.toml`. A [`Table`]
//! holds rows. [`train`] makes a [`Model`] of both; a person may also write one by hand: `model.json`. A model answers
//! [`Model::posterior`] for any nodes, given any [`Evidence`] about others, exactly.
//!
//! Discrete nodes have tables. A continuous node is a vector; for each configuration of its discrete parents it has a
//! mixture of Gaussian linear regressions on its continuous parents. Nodes are just names here: nothing in this crate
//! knows what a grasp is. It opens no files: texts and bytes come in, texts and bytes go out.
//!
//! ```
//! use prehend_model::{Evidence, Model};
//!
//! let model = Model::from_json(r#"{ "format": "prehend-model", "version": 1, "nodes": [
//!     { "name": "task", "kind": "discrete", "states": ["pour", "use"], "table": [[0.5, 0.5]] },
//!     { "name": "width", "kind": "gaussian_mixture", "discrete_parents": ["task"], "components": [
//!         [{ "weight": 1.0, "mean": [0.08], "covariance": [[1e-4]] }],
//!         [{ "weight": 1.0, "mean": [0.03], "covariance": [[1e-4]] }]] }] }"#)?;
//! let evidence = Evidence::new().with_value(&model, "width", &[0.07])?;
//! let answer = model.posterior(&["task"], &evidence)?;
//! assert!(answer.posterior("task").unwrap()[0] > 0.99);
//! # Ok::<(), prehend_model::ModelError>(())
//! ```
//!
//! `docs/model-format.md` describes both files, the evidence and the answers.

mod error;

mod network;
mod network_text;
mod table;

mod binary;
mod cpd;
mod interchange;
mod json;
mod model;
mod priors;
mod sample;

mod assemble;
mod cell;
mod cross_validation;
mod em;
mod exponential;
mod family;
mod gap_block;
mod gap_plan;
mod gap_step;
mod gaps;
mod groups;
mod k_means;
mod likelihood;
mod measured;
mod moments;
mod start;
mod statistics;
mod train;

mod structure;

mod answer;
mod draws;
mod ensemble;
mod evidence;
mod mixture;
mod posterior;

mod block;
mod elimination;
mod log_table;

mod batch;
mod explain;
mod most_probable;
mod plan;
mod reader;
mod surprise;
mod tree;

mod double_double;
mod gaussian;
mod root_gaussian;
mod sphere;

mod bessel;
mod direction_answer;
mod von_mises_fisher;
mod von_mises_fisher_fit;
mod von_mises_fisher_train;

pub use answer::{Answer, Target};
pub use batch::{BatchQuery, RowAnswer};
pub use block::Latent;
pub use cell::{CellReport, OrderScore};
pub use cpd::{Component, Cpd, DiscreteCpd, MixtureCpd, NodeIdx, Scaling, Sign, Weights};
pub use direction_answer::DirectionAnswer;
pub use ensemble::{Ensemble, EnsembleAnswer};
pub use error::ModelError;
pub use evidence::{Evidence, Observation};
pub use explain::{Contrast, Counterfactual, Explanation};
pub use gaps::GapReport;
pub use interchange::Export;
pub use mixture::{Mixture, Term};
pub use model::{Model, Node};
pub use most_probable::{MostProbable, ProbableValue};
pub use network::{MixtureOrder, MixtureSpec, Network, NodeKind, NodeSpec, VonMisesFisherSpec};
pub use structure::{
    LearnedArc, LearnedStructure, StructureOptions, StructureRules, StructureScore, learn_structure,
    score_structure,
};
pub use surprise::Surprise;
pub use table::{Column, Table};
pub use train::{NodeReport, TrainOptions, TrainReport, Trained, train};
pub use von_mises_fisher::{VonMisesFisher, VonMisesFisherCpd};
