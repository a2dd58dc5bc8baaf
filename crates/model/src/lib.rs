//! What follows from evidence in a mixed Bayesian network?
//!
//! A network has discrete nodes with tables, and continuous ones, each a vector of numbers: given its parents such a node
//! is a mixture of Gaussian linear regressions on the continuous parents, one mixture for each configuration of the
//! discrete ones. Nodes are just names: nothing in this crate knows what they mean. It opens no files: texts and bytes
//! come in, texts and bytes go out.
//!
//! **A model** comes from a text that a person wrote, or from rows:
//!
//! ```
//! use prehend_model::{Column, Model, Network, Table, TrainOptions};
//!
//! let network = Network::from_toml(r#"
//!     [[node]]
//!     name = "task"
//!     kind = "discrete"
//!     states = ["pour", "use"]
//!
//!     [[node]]
//!     name = "width"
//!     kind = "gaussian_mixture"
//!     parents = ["task"]
//!     mixture = { components = 1 }"#)?;
//! let rows = Table::new(8)
//!     .with("task", Column::Text(["pour", "pour", "pour", "pour", "use", "use", "use", "use"].map(String::from).to_vec()))?
//!     .with_numbers("width", vec![0.08, 0.07, 0.09, 0.08, 0.03, 0.02, 0.03, 0.04])?;
//! let model = Model::fit(&network, &rows, &TrainOptions::default())?.model;
//! # assert_eq!(model.nodes().len(), 2);
//! # Ok::<(), prehend_model::ModelError>(())
//! ```
//!
//! **A question** names targets, and what is known of other nodes: all of a node, some of its dimensions, a measurement
//! with its error, or how likely each state is. The answer is exact, or says how far off it can be at most.
//!
//! ```
//! use prehend_model::{Evidence, Model};
//!
//! let model = Model::from_json(r#"{ "format": "prehend-model", "version": 1, "nodes": [
//!     { "name": "task", "kind": "discrete", "states": ["pour", "use"], "table": [[0.5, 0.5]] },
//!     { "name": "width", "kind": "gaussian_mixture", "discrete_parents": ["task"], "components": [
//!         [{ "weight": 1.0, "mean": [0.08], "covariance": [[1e-4]] }],
//!         [{ "weight": 1.0, "mean": [0.03], "covariance": [[1e-4]] }]] }] }"#)?;
//! let seen = Evidence::new().with_value(&model, "width", &[0.07])?;
//! let task = model.query(&["task"], &seen)?;
//! assert!(task.probabilities("task").unwrap()[0] > 0.99);
//!
//! // The other way round the answer is a mixture: density, moments, modes and samples.
//! let pouring = Evidence::new().with_state(&model, "task", "pour")?;
//! let width = model.query(&["width"], &pouring)?.mixture("width").unwrap();
//! assert!((width.mean()[0] - 0.08).abs() < 1e-12);
//!
//! // Why, and is it like anything known?
//! println!("{}", model.explain("task", &seen)?.words()[0]);
//! println!("{}", model.surprise(&seen)?.words());
//! # Ok::<(), prehend_model::ModelError>(())
//! ```
//!
//! The same question about many rows is compiled once: [`BatchQuery`]. Which arcs there are can be learned too:
//! [`learn_structure`]. Examples that run: `sprinkler`, `old_faithful`, `which_task`. `docs/model-format.md` describes the
//! files, the evidence and the answers; `docs/model.md` says what was measured.

mod error;

mod arcs;
mod network;
mod network_file;
mod network_text;
mod table;

mod binary;
mod cpd;
mod extra;
mod interchange;
mod json;
mod model;
mod model_check;
mod priors;
mod sample;

mod assemble;
mod cell;
mod cross_validation;
mod em;
mod em_block;
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

mod draws;
mod ensemble;
mod evidence;
mod mixture;
mod posterior;
mod query;

mod block;
mod elimination;
mod log_table;

mod batch;
mod explain;
mod lanes;
mod most_probable;
mod plan;
mod surprise;
mod tree;
mod tree_sum;

mod double_double;
mod gaussian;
mod root_gaussian;
mod sphere;

mod bessel;
mod direction_posterior;
mod von_mises_fisher;
mod von_mises_fisher_fit;
mod von_mises_fisher_train;

pub use batch::{BatchQuery, RowPosterior};
pub use block::Latent;
pub use cell::{CellReport, OrderScore};
pub use cpd::{Component, Cpd, DiscreteCpd, MixtureCpd, NodeIdx, Scaling, Sign, Weights};
pub use direction_posterior::DirectionPosterior;
pub use ensemble::{Ensemble, EnsemblePosterior};
pub use error::ModelError;
pub use evidence::{Evidence, Observation};
pub use explain::{Contrast, Counterfactual, Explanation};
pub use extra::Extra;
pub use gaps::GapReport;
pub use interchange::Export;
pub use mixture::{Mixture, Term};
pub use model::{Model, Node};
pub use most_probable::{MostProbable, ProbableValue};
pub use network::{MixtureOrder, MixtureSpec, Network, NodeKind, NodeSpec, VonMisesFisherSpec};
pub use posterior::{Posterior, Target};
pub use structure::{
    LearnedArc, LearnedStructure, StructureOptions, StructureRules, StructureScore, learn_structure,
    score_structure,
};
pub use surprise::Surprise;
pub use table::{Column, Table};
pub use train::{NodeReport, TrainOptions, TrainReport, Trained};
pub use von_mises_fisher::{VonMisesFisher, VonMisesFisherCpd};
