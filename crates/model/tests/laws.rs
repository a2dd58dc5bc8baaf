//! What holds for every training: rows are a set with weights, states and units are names.

mod common;

use common::{fit, held_out, network, truth};
use prehend_model::{Column, Model, Network, Table, TrainOptions};

fn numbers(table: &Table, name: &str) -> Vec<f64> {
    table.numbers(name, "test").unwrap()
}

fn same(a: &Model, b: &Model, tolerance: f64) {
    let (a, b) = (held_out(a), held_out(b));
    assert!((a - b).abs() < tolerance, "{a} and {b}");
}

/// One component exactly, two as far as EM is carried.
const CASES: [(&str, f64); 2] = [("components = 1", 1e-9), ("components = 2", 2e-3)];

#[test]
fn the_order_of_rows_does_not_matter() {
    let table = truth().sample(600, 11);
    for (mixture, tolerance) in CASES {
        let whole = fit(&network(mixture), &table).model;
        // Backwards, and by a stride that visits every row.
        let backwards: Vec<usize> = (0..600).rev().collect();
        let strides: Vec<usize> = (0..600).map(|i| i * 7 % 600).collect();
        for order in [backwards, strides] {
            same(
                &whole,
                &fit(&network(mixture), &table.select(&order)).model,
                tolerance,
            );
        }
    }
}

#[test]
fn a_weight_of_two_is_a_row_twice() {
    let table = truth().sample(300, 11);
    let rows: Vec<usize> = (0..300).chain(0..100).collect();
    let twice = table.select(&rows);
    for (mixture, _) in CASES {
        let weights = (0..300).map(|i| if i < 100 { 2.0 } else { 1.0 }).collect();
        let options = TrainOptions {
            weights: Some(weights),
            ..TrainOptions::default()
        };
        let weighted = Model::fit(&Network::from_toml(&network(mixture)).unwrap(), &table, &options).unwrap();
        // Uneven weights count for fewer independent rows, which the priors alone notice.
        same(&weighted.model, &fit(&network(mixture), &twice).model, 1e-2);
    }
}

#[test]
fn equal_weights_of_any_size_change_nothing() {
    let table = truth().sample(300, 12);
    let network = network("components = 2");
    let run = |weight: f64| {
        let options = TrainOptions {
            weights: Some(vec![weight; 300]),
            ..TrainOptions::default()
        };
        Model::fit(&Network::from_toml(&network).unwrap(), &table, &options)
            .unwrap()
            .model
    };
    let (one, three) = (run(1.0), run(3.0));
    // The table of the discrete node counts weights, and its prior of one pseudo-row notices.
    for node in [1, 2] {
        let (prehend_model::Cpd::Mixture(a), prehend_model::Cpd::Mixture(b)) =
            (&one.nodes()[node].cpd, &three.nodes()[node].cpd)
        else {
            panic!("continuous")
        };
        for (a, b) in a.components.iter().flatten().zip(b.components.iter().flatten()) {
            assert!((&a.mean - &b.mean).amax() < 1e-9 && (&a.covariance - &b.covariance).amax() < 1e-9);
        }
    }
}

#[test]
fn the_order_of_states_is_a_matter_of_names() {
    let table = truth().sample(600, 13);
    for (mixture, tolerance) in CASES {
        let swapped = network(mixture).replace("[\"a\", \"b\"]", "[\"b\", \"a\"]");
        same(
            &fit(&network(mixture), &table).model,
            &fit(&swapped, &table).model,
            tolerance,
        );
    }
}

#[test]
fn units_are_a_matter_of_names() {
    let table = truth().sample(600, 14);
    for mixture in ["components = 1", "components = 2", "max = 4, choose = \"bic\""] {
        let before = fit(&network(mixture), &table);
        let scaled = |table: &Table| {
            let mut out = table.clone();
            for (name, unit, origin) in [
                ("size_x", 1000.0, 5.0),
                ("size_y", 0.001, -2.0),
                ("grip", 20.0, 100.0),
            ] {
                let column = numbers(table, name).iter().map(|x| unit * x + origin).collect();
                out = out.with(name, Column::Numbers(column)).unwrap();
            }
            out
        };
        let after = fit(&network(mixture), &scaled(&table));
        let rows = truth().sample(500, 15);
        let shift = (1000.0_f64 * 0.001 * 20.0).ln();
        let (a, b) = (
            before.model.log_likelihood(&rows).unwrap(),
            after.model.log_likelihood(&scaled(&rows)).unwrap(),
        );
        for (a, b) in a.iter().zip(&b) {
            assert!((a - b - shift).abs() < 1e-5 * (1.0 + a.abs()), "{a} and {b}");
        }
    }
}

#[test]
fn a_component_that_loses_its_rows_is_started_anew_once_then_dropped_and_told() {
    // Forty rows that lie evenly, and one far away: no component of its own for a single row.
    let mut values: Vec<f64> = (0..40).map(|i| f64::from(i) / 40.0).collect();
    values.push(1000.0);
    let table = Table::new(41).with_numbers("x", values).unwrap();
    let trained = fit(
        "[[node]]\nname = \"x\"\nkind = \"gaussian_mixture\"\nmixture = { components = 2 }\n",
        &table,
    );
    let cell = &trained.report.nodes[0].cells[0];
    assert_eq!((cell.components, cell.reinitialized, cell.dropped), (1, 1, 1));
    assert_eq!(
        trained.report.warnings,
        ["`x`: 1 of 2 components kept their rows; the others were dropped"]
    );
}
