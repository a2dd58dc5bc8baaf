//! A small mixed network that the tests of learning share.

use prehend_model::{Model, Network, Table, TrainOptions, Trained};

/// Two tasks, a size with one or two clusters, and a grip that regresses on it.
const TRUTH: &str = r#"{ "format": "prehend-model", "version": 1, "nodes": [
  { "name": "task", "kind": "discrete", "states": ["a", "b"], "table": [[0.4, 0.6]] },
  { "name": "size", "kind": "gaussian_mixture", "columns": ["size_x", "size_y"], "discrete_parents": ["task"],
    "continuous_parents": [], "components": [
      [ {"weight": 1.0, "mean": [0.1, 0.2], "coefficients": [[], []], "covariance": [[0.01, 0.002], [0.002, 0.02]]} ],
      [ {"weight": 0.3, "mean": [1.0, 0.0], "coefficients": [[], []], "covariance": [[0.01, 0.0], [0.0, 0.01]]},
        {"weight": 0.7, "mean": [2.0, 1.0], "coefficients": [[], []], "covariance": [[0.05, 0.01], [0.01, 0.05]]} ] ] },
  { "name": "grip", "kind": "gaussian_mixture", "discrete_parents": ["task"], "continuous_parents": ["size"],
    "components": [
      [ {"weight": 0.5, "mean": [0.0], "coefficients": [[3.0, 0.0]], "covariance": [[0.01]]},
        {"weight": 0.5, "mean": [0.0], "coefficients": [[-3.0, 1.0]], "covariance": [[0.01]]} ],
      [ {"weight": 1.0, "mean": [1.0], "coefficients": [[0.5, 0.5]], "covariance": [[0.04]]} ] ] } ] }"#;

/// Its network file; `mixture` is the value of that key.
pub fn network(mixture: &str) -> String {
    format!(
        r#"
[[node]]
name = "task"
kind = "discrete"
states = ["a", "b"]
[[node]]
name = "size"
kind = "gaussian_mixture"
columns = ["size_x", "size_y"]
parents = ["task"]
mixture = {{ {mixture} }}
[[node]]
name = "grip"
kind = "gaussian_mixture"
parents = ["task", "size"]
mixture = {{ {mixture} }}
"#
    )
}

/// The network that rows are drawn from.
pub fn truth() -> Model {
    Model::from_json(TRUTH).unwrap()
}

/// Training with the default settings.
pub fn fit(network: &str, table: &Table) -> Trained {
    Model::fit(
        &Network::from_toml(network).unwrap(),
        table,
        &TrainOptions::default(),
    )
    .unwrap()
}

/// Mean log density of 2,000 rows that no test learns from.
pub fn held_out(model: &Model) -> f64 {
    model
        .log_likelihood(&truth().sample(2000, 2))
        .unwrap()
        .iter()
        .sum::<f64>()
        / 2000.0
}
