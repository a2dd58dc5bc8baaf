//! Numbers from other programs: brute-force enumeration in numpy, mixtures from scikit-learn (`oracle/`).

use prehend_model::{BatchQuery, Cpd, Evidence, Model, ModelError, Network, Table, TrainOptions};
use serde_json::Value;

fn evidence_of(model: &Model, json: &Value) -> Result<Evidence, ModelError> {
    Evidence::from_json(model, &json.to_string())
}

fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|v| {
            if v.is_array() {
                numbers(v)
            } else {
                vec![v.as_f64().unwrap()]
            }
        })
        .collect()
}

fn close(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    for (a, b) in found.iter().zip(expected) {
        assert!(
            (a - b).abs() <= tolerance * b.abs().max(1.0),
            "{what}: {found:?} against {expected:?}"
        );
    }
}

#[test]
fn every_query_agrees_with_enumeration_of_the_joint_mixture() {
    let oracle: Value = serde_json::from_str(include_str!("oracle/inference.json")).unwrap();
    let model = Model::from_json(&oracle["model"].to_string()).unwrap();
    for case in oracle["cases"].as_array().unwrap() {
        let what = format!("{} given {}", case["target"], case["evidence"]);
        let evidence = evidence_of(&model, &case["evidence"]).unwrap();
        let target = case["target"].as_str().unwrap();
        let answer = model
            .query(&[target], &evidence)
            .unwrap_or_else(|e| panic!("{what}: {e}"));
        close(
            &[answer.log_evidence],
            &numbers(&Value::Array(vec![case["log_evidence"].clone()])),
            1e-9,
            &what,
        );
        if let Some(posterior) = case.get("posterior") {
            close(
                &answer.probabilities(target).unwrap(),
                &numbers(posterior),
                1e-9,
                &what,
            );
        } else {
            let mixture = answer.mixture(target).unwrap();
            close(mixture.mean().as_slice(), &numbers(&case["mean"]), 1e-8, &what);
            close(
                mixture.covariance().as_slice(),
                &numbers(&case["covariance"]),
                1e-8,
                &what,
            );
        }
        for (i, point) in case
            .get("at")
            .and_then(Value::as_array)
            .into_iter()
            .flatten()
            .enumerate()
        {
            let density = answer
                .mixture(target)
                .unwrap()
                .log_density(&numbers(point))
                .unwrap();
            close(&[density], &numbers(&case["log_density"])[i..=i], 1e-8, &what);
        }
    }
}

#[test]
fn a_batch_gives_what_single_queries_give() {
    let oracle: Value = serde_json::from_str(include_str!("oracle/inference.json")).unwrap();
    let model = Model::from_json(&oracle["model"].to_string()).unwrap();
    let table = model.sample(60, 11);
    let patterns: [&[&str]; 6] = [
        &["size"],
        &["size", "egpc", "upos", "dir"],
        &["size", "egpc", "upos", "dir", "fvol", "qeps"],
        &["upos", "wet"],
        &["dir"],
        &["qeps", "dir"],
    ];
    for observed in patterns {
        let batch = BatchQuery::new(&model, "task", observed).unwrap();
        assert!(batch.is_compiled(), "{observed:?}");
        let answers = batch.run_table(&table).unwrap();
        let all = Evidence::from_table(&model, &table).unwrap();
        for (answer, mut evidence) in answers.into_iter().zip(all) {
            for node in model.nodes() {
                if !observed.contains(&node.name.as_str()) {
                    evidence = evidence.without(model.index(&node.name).unwrap());
                }
            }
            let answer = answer.unwrap();
            let single = model.query(&["task"], &evidence).unwrap();
            close(
                &[answer.log_evidence],
                &[single.log_evidence],
                1e-9,
                &format!("{observed:?}"),
            );
            close(
                &answer.posterior,
                &single.probabilities("task").unwrap(),
                1e-9,
                &format!("{observed:?}"),
            );
        }
    }
}

#[test]
fn a_fitted_mixture_is_the_one_that_scikit_learn_finds() {
    let oracle: Value = serde_json::from_str(include_str!("oracle/mixture.json")).unwrap();
    let rows = numbers(&oracle["rows"]);
    let column = |d: usize| rows.iter().skip(d).step_by(2).copied().collect::<Vec<f64>>();
    let n = rows.len() / 2;
    let table = Table::new(n)
        .with_numbers("x", column(0))
        .unwrap()
        .with_numbers("y", column(1))
        .unwrap();
    let network = Network::from_toml(
        "[[node]]\nname = \"xy\"\nkind = \"gaussian_mixture\"\ncolumns = [\"x\", \"y\"]\nmixture = { max = 4, choose = \"bic\" }",
    )
    .unwrap();
    let trained = Model::fit(
        &network,
        &table,
        &TrainOptions {
            tolerance: 1e-9,
            ..TrainOptions::default()
        },
    )
    .unwrap();
    let Cpd::Mixture(cpd) = &trained.model.nodes()[0].cpd else {
        panic!("xy is continuous")
    };
    let mut components = cpd.components[0].clone();
    assert_eq!(components.len(), 2);
    let weights = numbers(&oracle["weights"]);
    components.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    let order = if weights[0] > weights[1] { [0, 1] } else { [1, 0] };
    // Our prior is one pseudo-row of a hundredth of a deviation, so agreement stops near 1 / n.
    for (component, &j) in components.iter().zip(&order) {
        close(&[component.weight], &[weights[j]], 5e-3, "weight");
        close(
            component.mean.as_slice(),
            &numbers(&oracle["means"][j]),
            5e-3,
            "mean",
        );
        close(
            component.covariance.as_slice(),
            &numbers(&oracle["covariances"][j]),
            1e-2,
            "covariance",
        );
    }
    let mean = trained.report.log_likelihood / n as f64;
    close(
        &[mean],
        &[oracle["mean_log_likelihood"].as_f64().unwrap()],
        1e-3,
        "log-likelihood",
    );
    // BIC differs by the units alone, so differences agree.
    let curve = &trained.report.nodes[0].cells[0].curve;
    let bic = numbers(&oracle["bic"]);
    assert!(((curve[1].bic - curve[0].bic) - (bic[1] - bic[0])).abs() < 1.0);
}
