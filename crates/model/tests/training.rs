//! Training: recovery, monotone EM, the guard against a component per object, and rows that do not fit.

mod common;

use common::{fit, held_out, network, truth};
use prehend_model::{Evidence, Model, Network, Table, TrainOptions, Trained};

/// Up to five components, by BIC.
fn by_bic() -> String {
    network("max = 5, choose = \"bic\"")
}

fn trained(table: &Table) -> Trained {
    fit(&by_bic(), table)
}

#[test]
fn samples_give_back_the_model_they_came_from() {
    let truth = truth();
    let table = truth.sample(4000, 1);
    let Trained { model, report } = trained(&table);
    let components: Vec<Vec<usize>> = report
        .nodes
        .iter()
        .map(prehend_model::NodeReport::components)
        .collect();
    assert_eq!(components, [vec![], vec![1, 2], vec![2, 1]]);
    let lost = held_out(&truth) - held_out(&model);
    assert!(lost.abs() < 0.02, "the trained model loses {lost} nats a row");
    assert!(report.warnings.is_empty(), "{:?}", report.warnings);
}

#[test]
fn the_objective_never_falls_during_em() {
    let table = truth().sample(500, 3);
    let report = trained(&table).report;
    let mut n_steps = 0;
    for cell in report.nodes.iter().flat_map(|node| &node.cells) {
        for pair in cell.objectives.windows(2) {
            assert!(
                pair[1] >= pair[0] - 1e-9 * pair[0].abs(),
                "{} after {}",
                pair[1],
                pair[0]
            );
            n_steps += 1;
        }
    }
    assert!(n_steps > 10);
}

#[test]
fn the_same_seed_gives_the_same_bytes_for_any_number_of_threads() {
    let table = truth().sample(600, 4);
    let run = |n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .build()
            .unwrap();
        pool.install(|| trained(&table).model.to_json())
    };
    assert_eq!(run(1), run(3));
}

/// Twelve objects with one size each and fifty grasps on each of them.
fn repeated() -> Table {
    let sizes = truth().sample(12, 5);
    let rows: Vec<usize> = (0..600).map(|row| row / 50).collect();
    let grips = truth().sample(600, 6);
    let prehend_model::Column::Numbers(grip) = grips.column("grip").unwrap().clone() else {
        panic!("numbers")
    };
    let object: Vec<String> = rows.iter().map(|object| format!("object-{object}")).collect();
    let table = sizes.select(&rows).with_numbers("grip", grip).unwrap();
    let task: Vec<String> = (0..600)
        .map(|row| if row % 2 == 0 { "a".into() } else { "b".into() })
        .collect();
    table
        .with_text("task", task)
        .unwrap()
        .with_text("object", object)
        .unwrap()
}

#[test]
fn a_node_that_is_constant_within_objects_gets_no_component_per_object() {
    let network = Network::from_toml(&format!("group = \"object\"\n{}", by_bic())).unwrap();
    let report = Model::fit(&network, &repeated(), &TrainOptions::default())
        .unwrap()
        .report;
    let size = &report.nodes[1];
    for cell in &size.cells {
        assert!(cell.constant_in_groups);
        assert_eq!(cell.n_effective, 12.0);
        assert!(
            cell.components <= 2,
            "{} components for 12 objects",
            cell.components
        );
    }
    assert!(!report.nodes[2].cells[0].constant_in_groups);
    // Without the group every object gets its own.
    let blind = trained(&repeated()).report;
    assert!(blind.nodes[1].cells[0].components > 3);
    assert!(blind.warnings.iter().any(|warning| warning.contains("group")));
}

#[test]
fn cross_validation_over_objects_never_takes_more_components_than_bic() {
    let guarded = by_bic().replace("\"bic\"", "\"bic+cv\"");
    let network = Network::from_toml(&format!("group = \"object\"\n{guarded}")).unwrap();
    let report = Model::fit(&network, &repeated(), &TrainOptions::default())
        .unwrap()
        .report;
    let alone = Network::from_toml(&format!("group = \"object\"\n{}", by_bic())).unwrap();
    let by_bic = Model::fit(&alone, &repeated(), &TrainOptions::default())
        .unwrap()
        .report;
    for (node, free) in report.nodes.iter().zip(&by_bic.nodes) {
        for (few, many) in node.components().iter().zip(free.components()) {
            assert!(*few <= many);
        }
    }
}

#[test]
fn gaps_a_constant_column_one_row_and_a_task_that_never_occurs_are_survived() {
    let nan = f64::NAN;
    let table = Table::new(5)
        .with_text("task", ["a", "a", "a", "", "a"].map(String::from).to_vec())
        .unwrap()
        .with_numbers("size_x", vec![0.1, 0.2, 0.3, 0.4, nan])
        .unwrap()
        .with_numbers("size_y", vec![1.0; 5])
        .unwrap()
        .with_numbers("grip", vec![0.0, 0.1, 0.4, 0.2, 0.3])
        .unwrap();
    let Trained { model, report } = trained(&table);
    assert_eq!(report.nodes[1].n_rows, 3);
    assert!(
        report.warnings.iter().any(|w| w == "`task`: no row has `b`"),
        "{:?}",
        report.warnings
    );
    assert!(
        report
            .warnings
            .iter()
            .any(|w| w.starts_with("`size` given task=b: 0 rows are too few"))
    );
    let evidence = Evidence::new().with_value(&model, "size", &[0.2, 1.0]).unwrap();
    let answer = model.query(&["task"], &evidence).unwrap();
    assert!((answer.probabilities("task").unwrap().iter().sum::<f64>() - 1.0).abs() < 1e-12);
    let one = trained(&table.select(&[0]));
    assert_eq!(one.report.nodes[2].n_rows, 1);
    let none = Model::fit(
        &Network::from_toml(&by_bic()).unwrap(),
        &table.select(&[]),
        &TrainOptions::default(),
    );
    assert_eq!(
        none.unwrap_err().to_string(),
        "`size`: none of the 0 rows has all its columns; fill in some or remove the node"
    );
}

#[test]
fn a_missing_column_is_named() {
    let table = Table::new(1).with_numbers("size_x", vec![0.0]).unwrap();
    let error = Model::fit(
        &Network::from_toml(&by_bic()).unwrap(),
        &table,
        &TrainOptions::default(),
    )
    .unwrap_err();
    assert_eq!(
        error.to_string(),
        "the table has no column `task`, which `task` needs; its columns are `size_x`"
    );
}

#[test]
fn shared_components_differ_in_weights_only() {
    let shared = by_bic().replace(
        "parents = [\"task\"]\n",
        "parents = [\"task\"]\nweights = \"shared\"\n",
    );
    let table = truth().sample(2000, 8);
    let trained = Model::fit(
        &Network::from_toml(&shared).unwrap(),
        &table,
        &TrainOptions::default(),
    )
    .unwrap();
    let prehend_model::Cpd::Mixture(size) = &trained.model.nodes()[1].cpd else {
        panic!("size is continuous")
    };
    assert_eq!(size.components[0].len(), size.components[1].len());
    for (a, b) in size.components[0].iter().zip(&size.components[1]) {
        assert_eq!(a.mean, b.mean);
        assert_ne!(a.weight, b.weight);
    }
    assert!(size.components[0].len() >= 3);
}
