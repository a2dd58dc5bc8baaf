//! Training on tables with gaps, and what configurations may share.

use prehend_model::{Column, Cpd, Model, Network, Table, TrainOptions, Trained, train};

const TRUTH: &str = r#"{ "format": "prehend-model", "version": 1, "nodes": [
  { "name": "task", "kind": "discrete", "states": ["a", "b"], "parents": [], "table": [[0.4, 0.6]] },
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

const NETWORK: &str = r#"
[[node]]
name = "task"
kind = "discrete"
states = ["a", "b"]
[[node]]
name = "size"
kind = "gaussian_mixture"
columns = ["size_x", "size_y"]
parents = ["task"]
mixture = { components = 2 }
[[node]]
name = "grip"
kind = "gaussian_mixture"
parents = ["task", "size"]
mixture = { components = 2 }
"#;

fn fit(network: &str, table: &Table) -> Trained {
    train(
        &Network::from_toml(network).unwrap(),
        table,
        &TrainOptions::default(),
    )
    .unwrap()
}

fn truth() -> Model {
    Model::from_json(TRUTH).unwrap()
}

/// Every fifth cell empty, by a fixed rule that knows nothing of the values.
fn with_gaps(table: &Table) -> Table {
    let mut out = table.clone();
    let names: Vec<String> = table.names().map(String::from).collect();
    for (c, name) in names.iter().enumerate() {
        let gap = |row: usize| ((row * 7919 + c * 104_729) % 211).is_multiple_of(5);
        let column = match table.column(name).unwrap() {
            Column::Numbers(v) => Column::Numbers(
                v.iter()
                    .enumerate()
                    .map(|(i, v)| if gap(i) { f64::NAN } else { *v })
                    .collect(),
            ),
            Column::Text(v) => Column::Text(
                v.iter()
                    .enumerate()
                    .map(|(i, v)| if gap(i) { String::new() } else { v.clone() })
                    .collect(),
            ),
        };
        out = out.with(name, column).unwrap();
    }
    out
}

fn held_out(model: &Model) -> f64 {
    model
        .log_likelihood(&truth().sample(2000, 2))
        .unwrap()
        .iter()
        .sum::<f64>()
        / 2000.0
}

#[test]
fn a_fifth_of_the_cells_missing_costs_little() {
    let table = truth().sample(1500, 1);
    let (whole, gaps) = (fit(NETWORK, &table), fit(NETWORK, &with_gaps(&table)));
    let lost = held_out(&whole.model) - held_out(&gaps.model);
    assert!(lost < 0.05, "gaps cost {lost} nats a row");
    let report = gaps.report.gaps.unwrap();
    assert!(report.n_rows > 700 && report.left_out == 0 && report.converged);
    assert!(whole.report.gaps.is_none());
}

#[test]
fn the_objective_never_falls_with_gaps_and_is_the_likelihood_of_what_is_known() {
    let table = with_gaps(&truth().sample(400, 3));
    let trained = fit(NETWORK, &table);
    let objectives = trained.report.gaps.unwrap().objectives;
    assert!(objectives.len() > 3);
    prehend_testkit::never_falls(&objectives);
    // Another route to the same number: inference row by row. Priors and units are what is left between them.
    let by_rows: f64 = trained.model.log_likelihood(&table).unwrap().iter().sum();
    assert!((by_rows - trained.report.log_likelihood).abs() < 1e-6 * by_rows.abs());
}

#[test]
fn labels_that_are_missing_are_learned_from_and_rows_without_one_whole_family_suffice() {
    // Every row misses its task or one number: no family of `grip` is complete.
    let table = truth().sample(1200, 5);
    let texts = table.texts("task", "test").unwrap();
    let task: Vec<String> = texts
        .iter()
        .enumerate()
        .map(|(i, t)| {
            if i % 3 == 0 {
                String::new()
            } else {
                t.clone().unwrap()
            }
        })
        .collect();
    let mut gaps = table.clone().with_text("task", task).unwrap();
    for (k, name) in [(1, "size_x"), (2, "size_y")] {
        let values = table.numbers(name, "test").unwrap();
        let values = values
            .iter()
            .enumerate()
            .map(|(i, v)| if i % 3 == k { f64::NAN } else { *v });
        gaps = gaps.with_numbers(name, values.collect()).unwrap();
    }
    let trained = fit(&NETWORK.replace("components = 2", "components = 1"), &gaps);
    assert!(
        trained
            .report
            .warnings
            .iter()
            .any(|w| w.contains("gaps filled by the columns' means"))
    );
    let whole = fit(&NETWORK.replace("components = 2", "components = 1"), &table);
    let lost = held_out(&whole.model) - held_out(&trained.model);
    assert!(lost < 0.3, "lost {lost} nats a row");
}

#[test]
fn root_weights_are_the_same_in_all_configurations() {
    let root = NETWORK.replace(
        "mixture = { components = 2 }",
        "mixture = { components = 2, weights = \"root\" }",
    );
    for table in [truth().sample(1000, 8), with_gaps(&truth().sample(1000, 8))] {
        let trained = fit(&root, &table);
        for node in &trained.model.nodes()[1..] {
            let Cpd::Mixture(cpd) = &node.cpd else {
                panic!("continuous")
            };
            for (a, b) in cpd.components[0].iter().zip(&cpd.components[1]) {
                assert_eq!(a.weight, b.weight);
                assert_ne!(a.mean, b.mean);
            }
        }
        for cell in trained.report.nodes.iter().flat_map(|node| &node.cells) {
            prehend_testkit::never_falls(&cell.objectives);
        }
    }
}

#[test]
fn a_shared_covariance_is_one_for_all_components() {
    let shared = NETWORK.replace("components = 2 }", "components = 2 }\ncovariance = \"shared\"");
    let trained = fit(&shared, &truth().sample(1000, 9));
    for node in &trained.model.nodes()[1..] {
        let Cpd::Mixture(cpd) = &node.cpd else {
            panic!("continuous")
        };
        let mut all = cpd.components.iter().flatten();
        let first = &all.next().unwrap().covariance;
        assert!(all.all(|component| component.covariance == *first));
    }
    for cell in trained.report.nodes.iter().flat_map(|node| &node.cells) {
        prehend_testkit::never_falls(&cell.objectives);
    }
}

#[test]
fn the_order_of_rows_does_not_matter_and_a_weight_of_two_is_a_row_twice() {
    let table = truth().sample(300, 11);
    let backwards: Vec<usize> = (0..300).rev().collect();
    let forwards: Vec<usize> = (0..300).collect();
    let one = NETWORK.replace("components = 2", "components = 1");
    let same = |a: &Model, b: &Model| {
        let (a, b) = (held_out(a), held_out(b));
        assert!((a - b).abs() < 1e-9, "{a} and {b}");
    };
    same(
        &fit(&one, &table).model,
        &fit(&one, &table.select(&backwards)).model,
    );
    let twice = table.select(&[&forwards[..], &forwards[..100]].concat());
    let weights: Vec<f64> = (0..300).map(|i| if i < 100 { 2.0 } else { 1.0 }).collect();
    let options = TrainOptions {
        weights: Some(weights),
        ..TrainOptions::default()
    };
    let weighted = train(&Network::from_toml(&one).unwrap(), &table, &options).unwrap();
    let (a, b) = (held_out(&weighted.model), held_out(&fit(&one, &twice).model));
    // Uneven weights count for fewer independent rows, which the priors alone notice.
    assert!((a - b).abs() < 1e-2, "{a} and {b}");
}
