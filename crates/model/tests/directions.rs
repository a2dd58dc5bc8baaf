//! Unit vectors: densities on the sphere against scipy, latent signs, and von Mises–Fisher nodes in a network.

use prehend_model::{Cpd, Evidence, Model, Network, StructureOptions, TrainOptions, learn_structure};
use serde_json::{Value, json};

fn read(json: &str) -> Value {
    serde_json::from_str(json).unwrap()
}

fn oracle() -> Value {
    serde_json::from_str(include_str!("oracle/directions.json")).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v.as_f64().unwrap())
        .collect()
}

/// `task` decides where `upos` lies.
const MODEL: &str = r#"{ "format": "prehend-model", "version": 1, "nodes": [
    { "name": "task", "kind": "discrete", "states": ["pour", "use"], "table": [[0.4, 0.6]] },
    { "name": "upos", "kind": "von_mises_fisher_mixture", "columns": ["x", "y", "z"], "discrete_parents": ["task"],
      "components": [
        [{ "weight": 0.7, "direction": [0, 0, 1], "concentration": 60 },
         { "weight": 0.3, "direction": [0, 1, 0], "concentration": 25 }],
        [{ "weight": 1.0, "direction": [1, 0, 0], "concentration": 12 }]] },
    { "name": "width", "kind": "gaussian_mixture", "discrete_parents": ["task"], "components": [
        [{ "weight": 1.0, "mean": [0.1], "covariance": [[0.01]] }],
        [{ "weight": 1.0, "mean": [0.2], "covariance": [[0.01]] }]] } ] }"#;

fn model() -> Model {
    Model::from_json(MODEL).unwrap()
}

const NETWORK: &str = r#"
    [[node]]
    name = "task"
    kind = "discrete"
    states = ["pour", "use"]
    [[node]]
    name = "upos"
    kind = "von_mises_fisher_mixture"
    columns = ["x", "y", "z"]
    parents = ["task"]
    mixture = { max = 4 }
    [[node]]
    name = "width"
    kind = "gaussian_mixture"
    parents = ["task"]
    mixture = { max = 2 }
"#;

#[test]
fn densities_agree_with_scipy() {
    for case in oracle()["von_mises_fisher"].as_array().unwrap() {
        let direction = numbers(&case["direction"]);
        let columns: Vec<String> = (0..direction.len()).map(|i| format!("c{i}")).collect();
        let node = json!({ "format": "prehend-model", "version": 1, "nodes": [{
            "name": "u", "kind": "von_mises_fisher_mixture", "columns": columns,
            "components": [[{ "weight": 1.0, "direction": direction, "concentration": case["concentration"] }]] }] });
        let model = Model::from_json(&node.to_string()).unwrap();
        let evidence = Evidence::new()
            .with_value(&model, "u", &numbers(&case["x"]))
            .unwrap();
        let expected = case["log_density"].as_f64().unwrap();
        let found = model.log_evidence(&evidence).unwrap();
        assert!(
            (found - expected).abs() < 1e-9 * expected.abs().max(1.0),
            "{found} against {expected}"
        );
    }
}

#[test]
fn a_gaussian_mixture_on_the_sphere_agrees_with_quadrature_also_with_a_latent_sign() {
    let case = &oracle()["gaussian_on_sphere"];
    let component = |k: usize| json!({ "weight": case["weight"][k], "mean": case["mean"][k], "covariance": case["covariance"][k] });
    for sign in ["fixed", "latent"] {
        let node = json!({ "format": "prehend-model", "version": 1, "nodes": [{
            "name": "u", "kind": "gaussian_mixture", "columns": ["x", "y", "z"], "sphere": true, "sign": sign,
            "components": [[component(0), component(1)]] }] });
        let model = Model::from_json(&node.to_string()).unwrap();
        let at: Vec<Vec<f64>> = case["at"].as_array().unwrap().iter().map(numbers).collect();
        let answer = model.query(&["u"], &Evidence::new()).unwrap();
        let answer = read(&answer.to_json_at(&at).unwrap());
        for (found, expected) in numbers(&answer["log_density_sphere"])
            .iter()
            .zip(numbers(&case[sign]))
        {
            assert!(
                (found - expected).abs() < 1e-8,
                "{sign}: {found} against {expected}"
            );
        }
        if sign == "latent" {
            // q and −q are the same orientation: in the posterior, as evidence, and among samples.
            let minus: Vec<Vec<f64>> = at.iter().map(|x| x.iter().map(|v| -v).collect()).collect();
            let other = model.query(&["u"], &Evidence::new()).unwrap();
            let other = read(&other.to_json_at(&minus).unwrap());
            let pairs = numbers(&answer["log_density_sphere"])
                .into_iter()
                .zip(numbers(&other["log_density_sphere"]));
            assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-12));
            let log = |x: &[f64]| {
                let evidence = Evidence::new().with_value(&model, "u", x).unwrap();
                model.log_evidence(&evidence).unwrap()
            };
            assert!((log(&at[0]) - log(&minus[0])).abs() < 1e-12);
            let rows = model.sample(4000, 3);
            let mean = rows.numbers("z", "u").unwrap().iter().sum::<f64>() / 4000.0;
            assert!(mean.abs() < 0.05, "{mean}");
        }
    }
}

#[test]
fn the_posterior_of_a_direction_weighs_its_mixtures() {
    let model = model();
    let evidence = Evidence::new().with_value(&model, "width", &[0.12]).unwrap();
    let task = model
        .query(&["task"], &evidence)
        .unwrap()
        .probabilities("task")
        .unwrap();
    let answer = model.query_direction("upos", &evidence).unwrap();
    let weights: Vec<f64> = answer.components.iter().map(|c| c.weight).collect();
    assert!((weights[0] - 0.7 * task[0]).abs() < 1e-12);
    assert!((weights[2] - task[1]).abs() < 1e-12);
    assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    // p(upos | width) p(width) = Σ_task p(task) p(width | task) p(upos | task).
    let point = [0.0, 0.6, 0.8];
    let both = evidence.clone().with_value(&model, "upos", &point).unwrap();
    let joint = model.log_evidence(&both).unwrap();
    let factored = answer.log_density(&point).unwrap() + answer.log_evidence;
    assert!((joint - factored).abs() < 1e-12);
    // As evidence it tells of the task.
    let seen = Evidence::new()
        .with_value(&model, "upos", &[0.0, 0.0, 1.0])
        .unwrap();
    let posterior = model
        .query(&["task"], &seen)
        .unwrap()
        .probabilities("task")
        .unwrap();
    assert!(posterior[0] > 0.99);
    let json = read(&answer.to_json_at(&[point.to_vec()]).unwrap());
    assert_eq!(json["components"].as_array().unwrap().len(), 3);
    assert!(json["log_density_sphere"][0].is_number());
}

#[test]
fn training_recovers_a_model_and_files_hold_it() {
    let table = model().sample(1500, 2);
    let network = Network::from_toml(NETWORK).unwrap();
    assert_eq!(Network::from_toml(&network.to_toml()).unwrap(), network);
    let trained = Model::fit(&network, &table, &TrainOptions::default()).unwrap();
    assert_eq!(trained.report.nodes[1].components(), [2, 1]);
    let held_out = model().sample(1000, 77);
    let mean = |model: &Model| model.log_likelihood(&held_out).unwrap().iter().sum::<f64>() / 1000.0;
    let (truth, found) = (mean(&model()), mean(&trained.model));
    assert!(found > truth - 0.03, "{found} against {truth}");
    let text = trained.model.to_json();
    let again = Model::from_json(&text).unwrap();
    assert_eq!(again.to_json(), text);
    assert_eq!(
        Model::from_bytes(&trained.model.to_bytes()).unwrap().to_json(),
        text
    );
    let Cpd::VonMisesFisher(cpd) = &again.nodes()[1].cpd else {
        panic!("upos is a direction")
    };
    assert_eq!(cpd.n_parameters(), 2 * 3 + 1 + 3);
    assert_eq!(trained.report.n_parameters, 1 + cpd.n_parameters() + 4);
}

#[test]
fn the_arc_to_a_direction_is_found() {
    let text = NETWORK.replace("parents = [\"task\"]\n", "");
    let options = StructureOptions {
        restarts: 0,
        orders: false,
        ..StructureOptions::default()
    };
    let learned = learn_structure(
        &Network::from_toml(&text).unwrap(),
        &model().sample(400, 5),
        &options,
    )
    .unwrap();
    assert!(
        learned
            .arcs
            .iter()
            .any(|arc| arc.from == "task" && arc.to == "upos"),
        "{:?}",
        learned.arcs
    );
}

#[test]
fn what_cannot_be_combined_says_what_to_do() {
    let child = |kind: &str, extra: &str| {
        format!(
            "[[node]]\nname = \"u\"\nkind = \"von_mises_fisher_mixture\"\ncolumns = [\"x\", \"y\"]\n\
             [[node]]\nname = \"c\"\nkind = \"{kind}\"\nparents = [\"u\"]\n{extra}"
        )
    };
    let problem = |text: &str| Network::from_toml(text).unwrap_err().to_string();
    assert_eq!(
        problem(&child("gaussian_mixture", "")),
        "`c`: `parents` is `u`, a von_mises_fisher_mixture; expected discrete nodes and gaussian mixtures; \
         make it a gaussian_mixture with `sphere = true`"
    );
    assert!(
        problem(&child("discrete", "states = [\"a\"]"))
            .starts_with("`c` is discrete and has the continuous parent `u`")
    );
    assert!(
        problem("[[node]]\nname = \"u\"\nkind = \"von_mises_fisher_mixture\"\ncolumns = [\"x\"]\n")
            .starts_with("`u`: `columns` is 1 columns")
    );
    let model = model();
    let error = model.query(&["upos"], &Evidence::new()).unwrap_err().to_string();
    assert!(
        error.contains("asked about alone, by `query_direction`"),
        "{error}"
    );
    let error = Evidence::new()
        .with_value(&model, "upos", &[1.0, 1.0, 0.0])
        .unwrap_err()
        .to_string();
    assert!(error.contains("divide it by its length"), "{error}");
    let error = Evidence::new()
        .with_value(&model, "upos", &[1.0, f64::NAN, 0.0])
        .unwrap_err()
        .to_string();
    assert!(error.contains("a whole unit vector"), "{error}");
    let wrong = MODEL.replace("\"direction\": [0, 1, 0]", "\"direction\": [0, 2, 0]");
    let error = Model::from_json(&wrong).unwrap_err().to_string();
    assert!(error.contains("expected a unit vector of 3 numbers"), "{error}");
    let error = model.to_net().unwrap_err().to_string();
    assert!(
        error.contains("is a von_mises_fisher_mixture, which it cannot hold"),
        "{error}"
    );
}
