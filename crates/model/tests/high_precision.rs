//! 176 queries of 16 random mixed networks against enumeration in 60 digits (`oracle/high_precision.py`): every kind of
//! evidence, zero weights, states of probability zero, evidence 60 standard deviations out, covariances of condition
//! 1e8, variances of 1e-10, singular hidden nodes. And what has no density.

use prehend_model::{BatchQuery, Cpd, Evidence, Model, ModelError, Observation};
use serde_json::{Value, json};

fn read(json: &str) -> Value {
    serde_json::from_str(json).unwrap()
}

fn evidence_of(model: &Model, json: &Value) -> Result<Evidence, ModelError> {
    Evidence::from_json(model, &json.to_string())
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(entries) => entries.iter().flat_map(numbers).collect(),
        other => vec![other.as_f64().unwrap()],
    }
}

/// 1e-9 of the number, or of 1 where it is smaller.
fn close(found: f64, expected: f64, what: &str) {
    assert!(
        (found - expected).abs() <= 1e-9 * expected.abs().max(1.0),
        "{what}: {found} against {expected}"
    );
}

fn all_close(found: impl IntoIterator<Item = f64>, expected: &Value, what: &str) {
    let found: Vec<f64> = found.into_iter().collect();
    let expected = numbers(expected);
    assert_eq!(found.len(), expected.len(), "{what}");
    for (found, expected) in found.into_iter().zip(expected) {
        close(found, expected, what);
    }
}

#[test]
fn every_kind_of_evidence_gives_what_sixty_digits_give() {
    let oracle: Value = serde_json::from_str(include_str!("oracle/high_precision.json")).unwrap();
    let (mut n_cases, mut n_batch) = (0, 0);
    for entry in oracle.as_array().unwrap() {
        let model = Model::from_json(&entry["model"].to_string()).unwrap();
        for case in entry["cases"].as_array().unwrap() {
            let what = format!(
                "{}: {} given {}",
                entry["kind"], case["targets"], case["evidence"]
            );
            let targets: Vec<&str> = case["targets"]
                .as_array()
                .unwrap()
                .iter()
                .map(|t| t.as_str().unwrap())
                .collect();
            let evidence = evidence_of(&model, &case["evidence"]).unwrap();
            let answer = model
                .query(&targets, &evidence)
                .unwrap_or_else(|e| panic!("{what}: {e}"));
            close(answer.log_evidence, case["log_evidence"].as_f64().unwrap(), &what);
            assert_eq!(answer.error_bound, 0.0, "{what}");
            for (name, expected) in case["posterior"].as_object().into_iter().flatten() {
                all_close(answer.probabilities(name).unwrap(), expected, &what);
            }
            if case.get("mean").is_some() {
                let mixture = answer.joint_mixture();
                all_close(mixture.mean().iter().copied(), &case["mean"], &what);
                all_close(mixture.covariance().iter().copied(), &case["covariance"], &what);
                // A target that was itself observed, if only in part, has no density.
                let is_exact = |t: &&str| case["evidence"].get(*t).is_some_and(|v| !v.is_object());
                let exact = targets
                    .iter()
                    .any(|t| model.node(model.index(t).unwrap()).states().is_empty() && is_exact(t));
                if exact {
                    assert!(
                        mixture.log_densities(&[mixture.mean().as_slice()]).is_none(),
                        "{what}"
                    );
                } else if let Some(at) = case.get("at") {
                    let points: Vec<Vec<f64>> = at.as_array().unwrap().iter().map(numbers).collect();
                    all_close(
                        mixture.log_densities(&points).unwrap(),
                        &case["log_density"],
                        &what,
                    );
                }
            }
            if let Some(joint) = case.get("joint").and_then(Value::as_object) {
                let printed = read(&answer.to_json().unwrap());
                for term in printed["joint"].as_array().unwrap() {
                    let states: Vec<&str> = targets
                        .iter()
                        .filter_map(|t| term["states"][*t].as_str())
                        .collect();
                    if term.get("mean").is_none() {
                        close(
                            term["weight"].as_f64().unwrap(),
                            joint[&states.join(",")].as_f64().unwrap(),
                            &what,
                        );
                    }
                }
            }
            n_batch += usize::from(as_batch(&model, &evidence, case, &what));
            n_cases += 1;
        }
    }
    assert_eq!(n_cases, 176);
    assert!(n_batch >= 12, "{n_batch} of the queries ran compiled");
}

/// Runs a case as a compiled query where its target is one discrete node and its evidence whole values; says whether.
fn as_batch(model: &Model, evidence: &Evidence, case: &Value, what: &str) -> bool {
    let [target] = case["targets"].as_array().unwrap().as_slice() else {
        return false;
    };
    let target = target.as_str().unwrap();
    let mut names = Vec::new();
    let mut row = Vec::new();
    for (idx, observation) in evidence.iter() {
        match observation {
            Observation::State(state) => row.push(*state as f64),
            Observation::Value(value) if value.iter().all(|v| !v.is_nan()) => row.extend(value),
            _ => return false,
        }
        names.push(model.node(idx).name.as_str());
    }
    if matches!(model.node(model.index(target).unwrap()).cpd, Cpd::Mixture(_)) {
        return false;
    }
    let batch = BatchQuery::new(model, target, &names).unwrap();
    let answer = batch.run(&[row]).remove(0).unwrap();
    close(answer.log_evidence, case["log_evidence"].as_f64().unwrap(), what);
    all_close(answer.posterior, &case["posterior"][target], what);
    batch.is_compiled()
}

/// Flat in the second state of `task` only.
const FLAT: &str = r#"{ "format": "prehend-model", "version": 1, "nodes": [
    { "name": "task", "kind": "discrete", "states": ["a", "b"], "table": [[P, Q]] },
    { "name": "x", "kind": "gaussian_mixture", "discrete_parents": ["task"], "components": [
        [{ "weight": 1.0, "mean": [0.0], "covariance": [[1.0]] }],
        [{ "weight": 0.5, "mean": [0.0], "covariance": [[1.0]] }, { "weight": 0.5, "mean": [1.0], "covariance": [[0.0]] }]] },
    { "name": "y", "kind": "gaussian_mixture", "continuous_parents": ["x"], "components": [
        [{ "weight": 1.0, "mean": [0.0], "coefficients": [[2.0]], "covariance": [[0.0]] }]] }] }"#;

#[test]
fn evidence_without_density_names_node_and_component() {
    let model = Model::from_json(&FLAT.replace(['P', 'Q'], "0.5")).unwrap();
    let ask = |json: Value| model.query(&["task"], &evidence_of(&model, &json).unwrap());
    let flat = |node: &str, configuration, component| ModelError::NoDensity {
        node: node.into(),
        configuration,
        component,
    };
    assert_eq!(ask(json!({ "x": 0.5 })).unwrap_err(), flat("x", 1, 1));
    // y is twice x, whatever x is: given x it has no density, and without x only where x has one.
    assert_eq!(
        ask(json!({ "task": "a", "x": 0.5, "y": 1.0 })).unwrap_err(),
        flat("y", 0, 0)
    );
    assert_eq!(ask(json!({ "y": 1.0 })).unwrap_err(), flat("y", 0, 0));
    let through = ask(json!({ "task": "a", "y": 1.0 })).unwrap();
    close(
        through.log_evidence,
        0.5f64.ln() - 0.5 * (4.0 * 2.0 * std::f64::consts::PI).ln() - 0.125,
        "y of a",
    );
    // A prior of zero, or hard evidence against it, keeps the flat component out of the sum.
    assert!(ask(json!({ "task": "a", "x": 0.5 })).is_ok());
    let never = Model::from_json(&FLAT.replace('P', "1").replace('Q', "0")).unwrap();
    let x = evidence_of(&never, &json!({ "x": 0.5 })).unwrap();
    assert_eq!(
        never.query(&["task"], &x).unwrap().probabilities("task").unwrap(),
        [1.0, 0.0]
    );
}
