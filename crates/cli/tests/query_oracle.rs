//! `prehend query` on 16 random mixed networks: 176 questions with every kind of evidence, against enumeration in 60 digits
//! (`crates/model/tests/oracle/high_precision.py`). And evidence that has no density.

use std::fmt::Write;

use serde_json::{Value, json};

mod common;

use common::{assert_close, number, prehend, put};

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().map_or_else(
        || vec![number(value)],
        |entries| entries.iter().flat_map(numbers).collect(),
    )
}

fn all_close(found: &Value, expected: &[f64]) {
    let found = numbers(found);
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.into_iter().zip(expected) {
        assert_close(&json!(found), *expected);
    }
}

/// Whether the density of the targets can be asked for: none of the continuous ones was itself observed exactly.
fn has_density(case: &Value) -> bool {
    let targets = case["targets"].as_array().unwrap();
    let exact = |name: &Value| {
        let seen = &case["evidence"][name.as_str().unwrap()];
        seen.is_number() || seen.is_array()
    };
    case.get("at").is_some() && !targets.iter().any(exact)
}

#[test]
fn the_command_gives_what_sixty_digits_give() {
    let folder = tempfile::tempdir().unwrap();
    let oracle: Value =
        serde_json::from_str(include_str!("../../model/tests/oracle/high_precision.json")).unwrap();
    let mut n_cases = 0;
    for entry in oracle.as_array().unwrap() {
        let model = put(folder.path(), "m.json", &entry["model"].to_string());
        let cases = entry["cases"].as_array().unwrap();
        let mut questions = String::new();
        for case in cases {
            let at = if has_density(case) {
                case["at"].clone()
            } else {
                json!([])
            };
            let question = json!({ "evidence": case["evidence"], "target": case["targets"], "at": at });
            writeln!(questions, "{question}").unwrap();
        }
        let run = prehend(&["query", &model, "--queries", "-", "--json"], &questions);
        assert_eq!(run.status, 0, "{}", run.stdout);
        for (answer, case) in run.lines().iter().zip(cases) {
            n_cases += 1;
            assert_close(&answer["log_evidence"], number(&case["log_evidence"]));
            assert!(answer.get("error_bound").is_none());
            let targets = case["targets"].as_array().unwrap();
            let marginal = |name: &str| match targets.len() {
                1 => answer,
                _ => &answer["targets"][name],
            };
            for (name, expected) in case["posterior"].as_object().into_iter().flatten() {
                for (i, p) in numbers(expected).into_iter().enumerate() {
                    assert_close(&marginal(name)["posterior"][format!("s{i}")], p);
                }
            }
            // The oracle joins the continuous targets, in the order asked for; the answer has each by itself.
            let mean = case.get("mean").map(numbers).unwrap_or_default();
            let mut start = 0;
            for name in targets
                .iter()
                .filter_map(Value::as_str)
                .filter(|name| name.starts_with('c'))
            {
                let found = &marginal(name)["mean"];
                let end = start + found.as_array().unwrap().len();
                all_close(found, &mean[start..end]);
                let rows = case["covariance"].as_array().unwrap()[start..end].iter();
                let own: Vec<f64> = rows.flat_map(|row| numbers(row)[start..end].to_vec()).collect();
                all_close(&marginal(name)["covariance"], &own);
                start = end;
            }
            if has_density(case) {
                all_close(&answer["log_density"], &numbers(&case["log_density"]));
            }
        }
    }
    assert_eq!(n_cases, 176);
}

#[test]
fn evidence_without_density_names_node_and_component() {
    let folder = tempfile::tempdir().unwrap();
    let flat = r#"{ "format": "prehend-model", "version": 1, "nodes": [
        { "name": "task", "kind": "discrete", "states": ["a", "b"], "table": [[0.5, 0.5]] },
        { "name": "x", "kind": "gaussian_mixture", "discrete_parents": ["task"], "components": [
            [{ "weight": 1.0, "mean": [0.0], "covariance": [[1.0]] }],
            [{ "weight": 0.5, "mean": [0.0], "covariance": [[1.0]] },
             { "weight": 0.5, "mean": [1.0], "covariance": [[0.0]] }]] }] }"#;
    let model = put(folder.path(), "m.json", flat);
    let run = prehend(
        &["query", &model, "--target", "task", "--evidence", r#"{"x":0.5}"#],
        "",
    );
    assert_ne!(run.status, 0);
    assert!(
        run.stderr.contains("`x`") && run.stderr.contains("component 1"),
        "{}",
        run.stderr
    );
    // Sixty standard deviations out, where only one state has a density.
    let far = prehend(
        &[
            "query",
            &model,
            "--target",
            "task",
            "--evidence",
            r#"{"x":60,"task":"a"}"#,
            "--json",
        ],
        "",
    );
    assert_close(&far.answer()["posterior"]["a"], 1.0);
}
