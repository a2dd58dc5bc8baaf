//! Training on tables with gaps, and what configurations may share.

mod common;

use common::{fit, held_out, network, truth};
use prehend_model::{Column, Cpd, Table};

fn two() -> String {
    network("components = 2")
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

#[test]
fn a_fifth_of_the_cells_missing_costs_little() {
    let table = truth().sample(1500, 1);
    let (whole, gaps) = (fit(&two(), &table), fit(&two(), &with_gaps(&table)));
    let lost = held_out(&whole.model) - held_out(&gaps.model);
    assert!(lost < 0.05, "gaps cost {lost} nats a row");
    let report = gaps.report.gaps.unwrap();
    assert!(report.n_rows > 700 && report.left_out == 0 && report.converged);
    assert!(whole.report.gaps.is_none());
}

#[test]
fn the_objective_never_falls_with_gaps_and_is_the_likelihood_of_what_is_known() {
    let table = with_gaps(&truth().sample(400, 3));
    let trained = fit(&two(), &table);
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
    let trained = fit(&two().replace("components = 2", "components = 1"), &gaps);
    assert!(
        trained
            .report
            .warnings
            .iter()
            .any(|w| w.contains("gaps filled by the columns' means"))
    );
    let whole = fit(&two().replace("components = 2", "components = 1"), &table);
    let lost = held_out(&whole.model) - held_out(&trained.model);
    assert!(lost < 0.3, "lost {lost} nats a row");
}

#[test]
fn root_weights_are_the_same_in_all_configurations() {
    let root = two().replace(
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
    let shared = two().replace("components = 2 }", "components = 2 }\ncovariance = \"shared\"");
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
