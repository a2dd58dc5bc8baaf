//! Learning goes on with new rows, without the old ones; and what the rows leave open is kept.

use prehend_model::{Cpd, Ensemble, Evidence, Model, ModelError, Network, Table, TrainOptions, Trained};

const TRUTH: &str = r#"{ "format": "prehend-model", "version": 1, "nodes": [
  { "name": "task", "kind": "discrete", "states": ["a", "b"], "table": [[0.4, 0.6]] },
  { "name": "size", "kind": "gaussian_mixture", "columns": ["size_x", "size_y"], "discrete_parents": ["task"], "components": [
      [ {"weight": 1.0, "mean": [100.1, 0.2], "covariance": [[0.01, 0.002], [0.002, 0.02]]} ],
      [ {"weight": 0.3, "mean": [101.0, 0.0], "covariance": [[0.01, 0.0], [0.0, 0.01]]},
        {"weight": 0.7, "mean": [102.0, 1.0], "covariance": [[0.05, 0.01], [0.01, 0.05]]} ] ] },
  { "name": "grip", "kind": "gaussian_mixture", "discrete_parents": ["task"], "continuous_parents": ["size"], "components": [
      [ {"weight": 0.5, "mean": [-300.0], "coefficients": [[3.0, 0.0]], "covariance": [[0.01]]},
        {"weight": 0.5, "mean": [300.0], "coefficients": [[-3.0, 1.0]], "covariance": [[0.01]]} ],
      [ {"weight": 1.0, "mean": [1.0], "coefficients": [[0.5, 0.5]], "covariance": [[0.04]]} ] ] },
  { "name": "way", "kind": "von_mises_fisher_mixture", "columns": ["way_x", "way_y"], "discrete_parents": ["task"], "components": [
      [ {"weight": 1.0, "direction": [1.0, 0.0], "concentration": 4.0} ],
      [ {"weight": 1.0, "direction": [0.0, 1.0], "concentration": 9.0} ] ] } ] }"#;

fn network(components: &str, settings: &str) -> Network {
    Network::from_toml(&format!(
        "[[node]]\nname = \"task\"\nkind = \"discrete\"\nstates = [\"a\", \"b\"]\n\
         [[node]]\nname = \"size\"\nkind = \"gaussian_mixture\"\ncolumns = [\"size_x\", \"size_y\"]\nparents = [\"task\"]\n\
         mixture = {{ {components} }}\n{settings}\n\
         [[node]]\nname = \"grip\"\nkind = \"gaussian_mixture\"\nparents = [\"task\", \"size\"]\nmixture = {{ {components} }}\n{settings}\n\
         [[node]]\nname = \"way\"\nkind = \"von_mises_fisher_mixture\"\ncolumns = [\"way_x\", \"way_y\"]\nparents = [\"task\"]\n\
         mixture = {{ {components} }}\n"
    ))
    .unwrap()
}

fn truth() -> Model {
    Model::from_json(TRUTH).unwrap()
}

fn fit(network: &Network, table: &Table) -> Trained {
    Model::fit(network, table, &TrainOptions::default()).unwrap()
}

/// The rows of a range.
fn part(table: &Table, rows: std::ops::Range<usize>) -> Table {
    table.select(&rows.collect::<Vec<_>>())
}

fn numbers(model: &Model) -> Vec<f64> {
    let mut out = Vec::new();
    for node in model.nodes() {
        match &node.cpd {
            Cpd::Discrete(cpd) => out.extend(cpd.table.iter().flatten()),
            Cpd::Mixture(cpd) => {
                for part in cpd.components.iter().flatten() {
                    out.push(part.weight);
                    out.extend(part.mean.iter().chain(&part.coefficients).chain(&part.covariance));
                }
            }
            Cpd::VonMisesFisher(cpd) => {
                for part in cpd.components.iter().flatten() {
                    out.extend(part.direction.iter().chain([&part.weight, &part.concentration]));
                }
            }
        }
    }
    out
}

fn close(a: &Model, b: &Model, tolerance: f64) {
    let (a, b) = (numbers(a), numbers(b));
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(&b) {
        assert!((a - b).abs() <= tolerance * (1.0 + a.abs()), "{a} and {b}");
    }
}

#[test]
fn with_one_component_updating_is_training_on_all_rows() {
    for settings in ["", "covariance = \"shared\"", "weights = \"shared\""] {
        let network = network("components = 1", settings);
        let all = truth().sample(300, 1);
        let before = fit(&network, &part(&all, 0..80)).model;
        // In two parts, by way of the file.
        let between = before
            .update(&part(&all, 80..200), &TrainOptions::default())
            .unwrap()
            .model;
        let read = Model::from_json(&between.to_json()).unwrap();
        let after = read
            .update(&part(&all, 200..300), &TrainOptions::default())
            .unwrap();
        close(&after.model, &fit(&network, &all).model, 1e-7);
        assert_eq!(after.report.n_rows, 300);
    }
}

#[test]
fn a_mixture_follows_new_rows_and_its_objective_never_falls() {
    let network = network("components = 2", "");
    let all = truth().sample(1500, 2);
    let held_out = truth().sample(2000, 3);
    let mean = |model: &Model| model.log_likelihood(&held_out).unwrap().iter().sum::<f64>() / 2000.0;
    let before = fit(&network, &part(&all, 0..300)).model;
    let after = before
        .update(&part(&all, 300..1500), &TrainOptions::default())
        .unwrap();
    let whole = fit(&network, &all).model;
    assert!(mean(&after.model) > mean(&before));
    assert!(
        mean(&whole) - mean(&after.model) < 0.01,
        "{} and {}",
        mean(&whole),
        mean(&after.model)
    );
    for cell in after.report.nodes.iter().flat_map(|node| &node.cells) {
        prehend_testkit::never_falls(&cell.objectives);
    }
}

#[test]
fn new_rows_may_have_gaps_and_a_cell_that_was_too_thin_comes_into_its_own() {
    let network = network("components = 1", "");
    let all = truth().sample(400, 4);
    let tasks = all.texts("task", "test").unwrap();
    let few: Vec<usize> = (0..400)
        .filter(|&i| tasks[i].as_deref() == Some("a"))
        .take(40)
        .collect();
    let before = fit(&network, &all.select(&few));
    assert!(before.report.warnings.iter().any(|w| w.contains("too few")));
    let rest: Vec<usize> = (0..400).filter(|i| !few.contains(i)).collect();
    let after = before
        .model
        .update(&all.select(&rest), &TrainOptions::default())
        .unwrap();
    close(&after.model, &fit(&network, &all).model, 1e-6);
    let mut size = all.numbers("size_x", "test").unwrap();
    size.iter_mut().step_by(3).for_each(|x| *x = f64::NAN);
    let gaps = all.clone().with_numbers("size_x", size).unwrap();
    let after = after.model.update(&gaps, &TrainOptions::default()).unwrap();
    prehend_testkit::never_falls(&after.report.gaps.unwrap().objectives);
}

#[test]
fn groups_that_come_again_are_not_counted_twice() {
    let one = "group = \"object\"\n[[node]]\nname = \"size_x\"\nkind = \"gaussian_mixture\"\nmixture = { components = 1 }\n";
    let network = Network::from_toml(one).unwrap();
    let sizes = truth().sample(12, 5).numbers("size_x", "test").unwrap();
    let rows = |objects: &[usize]| {
        Table::new(objects.len())
            .with_numbers("size_x", objects.iter().map(|&o| sizes[o]).collect())
            .unwrap()
            .with_text("object", objects.iter().map(|o| format!("object-{o}")).collect())
            .unwrap()
    };
    let first: Vec<usize> = (0..60).map(|i| i % 8).collect();
    let second: Vec<usize> = (0..60).map(|i| 4 + i % 8).collect();
    let before = fit(&network, &rows(&first)).model;
    let after = before.update(&rows(&second), &TrainOptions::default()).unwrap();
    assert_eq!(after.report.nodes[0].cells[0].n_effective, 12.0);
    close(
        &after.model,
        &fit(&network, &rows(&[first, second].concat())).model,
        1e-9,
    );
}

#[test]
fn a_model_without_statistics_says_so() {
    let table = truth().sample(10, 6);
    let message = |model: &Model| {
        let error: ModelError = model.update(&table, &TrainOptions::default()).unwrap_err();
        error.to_string()
    };
    assert!(
        message(&truth()).contains("train it anew"),
        "{}",
        message(&truth())
    );
    let network = network("components = 1", "");
    let mut text = fit(&network, &table).model.to_json();
    let at = text.find("\"counts\"").unwrap();
    text.replace_range(at.., &text[at..].replacen("[[", "[[1.0,", 1));
    let broken = Model::from_json(&text).unwrap();
    assert!(
        message(&broken).contains("does not fit the node `task`"),
        "{}",
        message(&broken)
    );
}

#[test]
fn few_rows_leave_much_open_and_many_leave_little() {
    let network = network("components = 1", "");
    let evidence = |model: &Model| Evidence::new().with_value(model, "size", &[101.2, 0.5]).unwrap();
    let width = |n: usize| {
        let model = fit(&network, &truth().sample(n, 7)).model;
        let ensemble = Ensemble::drawn(&model, 40, 1).unwrap();
        let answer = ensemble.query(&["task"], &evidence(&model)).unwrap();
        let sum: f64 = answer.mean.probabilities("task").unwrap().iter().sum();
        assert!((sum - 1.0).abs() < 1e-9);
        let (low, high) = answer.interval("task", 0.9).unwrap()[0];
        let mean = answer.mean.probabilities("task").unwrap()[0];
        assert!(low <= mean && mean <= high);
        high - low
    };
    assert!(width(30) > 3.0 * width(3000), "{} and {}", width(30), width(3000));
    let model = fit(&network, &truth().sample(50, 8)).model;
    assert_eq!(model.draws(3, 5).unwrap(), model.draws(3, 5).unwrap());
    assert_ne!(model.draws(1, 5).unwrap(), model.draws(1, 6).unwrap());
}

/// A Gaussian with few rows, averaged over draws, is Student's t: mean x̄, scale² s² (1 + 1/n), n − 1 degrees of freedom.
#[test]
fn averaged_over_draws_a_gaussian_is_students_t() {
    let one = "[[node]]\nname = \"x\"\nkind = \"gaussian_mixture\"\nmixture = { components = 1 }\n";
    let values = [0.3, -1.2, 0.9, 2.2, -0.4, 0.1, 1.4, -0.9, 0.6, 0.2];
    let table = Table::new(10).with_numbers("x", values.to_vec()).unwrap();
    let model = fit(&Network::from_toml(one).unwrap(), &table).model;
    let answer = Ensemble::drawn(&model, 20_000, 1)
        .unwrap()
        .query(&["x"], &Evidence::new())
        .unwrap();
    let mixture = answer.mean.mixture("x").unwrap();
    let mean = values.iter().sum::<f64>() / 10.0;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 9.0;
    // The weak prior is one pseudo-row with a hundredth of a deviation: one degree of freedom more.
    let (freedom, scale) = (10.0_f64, (variance * 0.9 * (1.0 + 0.1)).sqrt());
    let t = |x: f64| {
        let z = (x - mean) / scale;
        // Γ(5.5) / (Γ(5) √(10 π)).
        let constant = 52.342_777_784_553_52 / (24.0 * (freedom * std::f64::consts::PI).sqrt());
        (constant / scale).ln() - 0.5 * (freedom + 1.0) * (1.0 + z * z / freedom).ln()
    };
    for x in [-3.0, -1.0, 0.0, 1.0, 4.0] {
        let found = mixture.log_density(&[x]).unwrap();
        assert!((found - t(x)).abs() < 0.06, "{found} and {} at {x}", t(x));
    }
}
