//! `docs/model.schema.json` says of model files what the reader says.

#[allow(dead_code, reason = "other tests use the rest")]
mod common;

use common::{fit, network, truth};
use jsonschema::Validator;
use prehend_model::{Model, Network, TrainOptions};
use serde_json::{Value, json};

fn schema() -> Validator {
    let text = include_str!("../../../docs/model.schema.json");
    jsonschema::validator_for(&serde_json::from_str(text).unwrap()).unwrap()
}

fn problems(file: &Value) -> Vec<String> {
    schema()
        .iter_errors(file)
        .map(|e| format!("{}: {e}", e.instance_path()))
        .collect()
}

#[test]
fn what_training_writes_obeys_the_schema() {
    let rows = truth().sample(300, 1);
    for mixture in [
        "components = 2",
        "max = 2, choose = \"bic\"",
        "components = 2, weights = \"shared\"",
        "components = 2, weights = \"root\"",
    ] {
        let model = fit(&network(mixture), &rows).model;
        let file: Value = serde_json::from_str(&model.to_json()).unwrap();
        assert_eq!(problems(&file), Vec::<String>::new(), "{mixture}");
    }
}

#[test]
fn written_directions_obey_the_schema() {
    let spec = r#"
        [[node]]
        name = "u"
        kind = "von_mises_fisher_mixture"
        columns = ["x", "y", "z"]
        mixture = { components = 2 }
    "#;
    let known = Model::from_json(
        &json!({ "format": "prehend-model", "version": 1, "nodes": [{
            "name": "u", "kind": "von_mises_fisher_mixture", "columns": ["x", "y", "z"], "components": [[
                { "weight": 0.5, "direction": [0, 0, 1], "concentration": 60 },
                { "weight": 0.5, "direction": [1, 0, 0], "concentration": 20 }]] }] })
        .to_string(),
    )
    .unwrap();
    let network = Network::from_toml(spec).unwrap();
    let learned = Model::fit(&network, &known.sample(200, 1), &TrainOptions::default()).unwrap();
    for model in [known, learned.model] {
        let file: Value = serde_json::from_str(&model.to_json()).unwrap();
        assert_eq!(problems(&file), Vec::<String>::new());
    }
}

#[test]
fn files_that_break_the_schema_are_refused_by_the_reader_too() {
    let sound: Value = serde_json::from_str(&truth().to_json()).unwrap();
    assert!(problems(&sound).is_empty());
    let breaks = [
        ("/format", json!("model")),
        ("/version", json!(2)),
        ("/nodes/0/kind", json!("continuous")),
        ("/nodes/0/states", json!([])),
        ("/nodes/0/states", json!(["a", "a"])),
        ("/nodes/0/table", json!([[1.2, -0.2]])),
        ("/nodes/0/table", json!([["0.4", "0.6"]])),
        ("/nodes/1/components/0", json!([])),
        ("/nodes/1/components/0/0/weight", json!(-1.0)),
        ("/nodes/1/components/0/0/mean", json!("0.1, 0.2")),
        ("/nodes/1/components/0/0/covariance", json!([1.0, 1.0])),
        ("/nodes/2/components/0/0/coefficients", json!([3.0])),
    ];
    for (place, value) in breaks {
        let mut file = sound.clone();
        *file.pointer_mut(place).expect(place) = value.clone();
        assert!(!problems(&file).is_empty(), "the schema takes {value} at {place}");
        let read = Model::from_json(&file.to_string());
        assert!(read.is_err(), "the reader takes {value} at {place}");
    }
}
