//! Laws of answers, the formats, and errors that help.

use prehend_model::{Evidence, Latent, Model, ModelError, Observation};
use serde_json::{Value, json};

fn read(json: &str) -> Value {
    serde_json::from_str(json).unwrap()
}

fn evidence_of(model: &Model, json: &Value) -> Result<Evidence, ModelError> {
    Evidence::from_json(model, &json.to_string())
}

/// The example of docs/model-format.md.
const EXAMPLE: &str = r#"{ "format": "prehend-model", "version": 1,
  "nodes": [
    { "name": "task", "kind": "discrete", "states": ["hand-over", "pouring"], "parents": [], "table": [[0.4, 0.6]] },
    { "name": "size", "kind": "gaussian_mixture", "columns": ["size_x", "size_y"],
      "discrete_parents": ["task"], "continuous_parents": [],
      "components": [
        [ { "weight": 1.0, "mean": [0.1, 0.2], "coefficients": [[], []], "covariance": [[1.0, 0.0], [0.0, 1.0]] } ],
        [ { "weight": 0.3, "mean": [0.0, 0.0], "coefficients": [[], []], "covariance": [[1.0, 0.0], [0.0, 1.0]] },
          { "weight": 0.7, "mean": [2.0, 1.0], "coefficients": [[], []], "covariance": [[0.5, 0.1], [0.1, 0.5]] } ] ] } ] }"#;

fn example() -> Model {
    Model::from_json(EXAMPLE).unwrap()
}

fn oracle_model() -> Model {
    let oracle: Value = serde_json::from_str(include_str!("oracle/inference.json")).unwrap();
    Model::from_json(&oracle["model"].to_string()).unwrap()
}

fn normal(x: [f64; 2], mean: [f64; 2], covariance: [[f64; 2]; 2]) -> f64 {
    let [[a, b], [_, d]] = covariance;
    let det = a * d - b * b;
    let (u, v) = (x[0] - mean[0], x[1] - mean[1]);
    (-0.5 * (d * u * u - 2.0 * b * u * v + a * v * v) / det).exp() / (2.0 * std::f64::consts::PI * det.sqrt())
}

#[test]
fn a_hand_written_model_answers_as_bayes_rule_says() {
    let model = example();
    let x = [1.0, 0.5];
    let unit = [[1.0, 0.0], [0.0, 1.0]];
    let hand_over = 0.4 * normal(x, [0.1, 0.2], unit);
    let pouring =
        0.6 * (0.3 * normal(x, [0.0, 0.0], unit) + 0.7 * normal(x, [2.0, 1.0], [[0.5, 0.1], [0.1, 0.5]]));
    let evidence = evidence_of(&model, &json!({ "size": x })).unwrap();
    let answer = read(&model.query(&["task"], &evidence).unwrap().to_json().unwrap());
    let p = answer["posterior"]["pouring"].as_f64().unwrap();
    assert!((p - pouring / (pouring + hand_over)).abs() < 1e-12);
    assert!((answer["log_evidence"].as_f64().unwrap() - (pouring + hand_over).ln()).abs() < 1e-12);
    let sizes = model.query(
        &["size"],
        &evidence_of(&model, &json!({ "task": "pouring" })).unwrap(),
    );
    let sizes = read(&sizes.unwrap().to_json_at(&[x.to_vec()]).unwrap());
    assert_eq!(sizes["components"].as_array().unwrap().len(), 2);
    assert!((sizes["mean"][0].as_f64().unwrap() - 1.4).abs() < 1e-12);
    assert!((sizes["log_density"][0].as_f64().unwrap() - (pouring / 0.6).ln()).abs() < 1e-12);
}

#[test]
fn the_sprinkler_is_explained_away() {
    let sprinkler = Model::from_json(
        r#"{ "format": "prehend-model", "version": 1, "nodes": [
        { "name": "wet", "kind": "discrete", "states": ["no", "yes"], "parents": ["sprinkler", "rain"],
          "table": [[1.0, 0.0], [0.2, 0.8], [0.1, 0.9], [0.01, 0.99]] },
        { "name": "rain", "kind": "discrete", "states": ["no", "yes"], "parents": [], "table": [[0.8, 0.2]] },
        { "name": "sprinkler", "kind": "discrete", "states": ["off", "on"], "parents": ["rain"],
          "table": [[0.6, 0.4], [0.99, 0.01]] } ] }"#,
    )
    .unwrap();
    let wet = Evidence::new().with_state(&sprinkler, "wet", "yes").unwrap();
    let rain = sprinkler
        .query(&["rain"], &wet)
        .unwrap()
        .probabilities("rain")
        .unwrap()[1];
    // 0.2 (0.01 · 0.99 + 0.99 · 0.8) / (that + 0.8 · 0.4 · 0.9): the textbook's 35.77 %.
    assert!((rain - 0.16038 / 0.44838).abs() < 1e-12);
    let both = sprinkler.query(&["rain", "sprinkler"], &wet).unwrap();
    let both = read(&both.to_json().unwrap());
    assert_eq!(both["joint"].as_array().unwrap().len(), 3);
    let story = sprinkler.most_probable(&wet, Latent::Summed).unwrap();
    assert_eq!(
        story.states,
        [("rain".into(), "no".into()), ("sprinkler".into(), "on".into())]
    );
}

#[test]
fn the_order_of_evidence_does_not_matter() {
    let model = oracle_model();
    let there = Evidence::new().with_value(&model, "size", &[0.1, 0.2]).unwrap();
    let there = there.with_value(&model, "egpc", &[0.3, f64::NAN]).unwrap();
    let back = Evidence::new()
        .with_value(&model, "egpc", &[0.3, f64::NAN])
        .unwrap();
    let back = back.with_value(&model, "size", &[0.1, 0.2]).unwrap();
    assert_eq!(
        model.query(&["task"], &there).unwrap(),
        model.query(&["task"], &back).unwrap()
    );
}

#[test]
fn densities_integrate_to_one() {
    let model = oracle_model();
    let evidence = evidence_of(&model, &json!({ "task": "pouring", "size": [0.3, null] })).unwrap();
    for (name, step) in [("qeps", 0.01), ("fvol", 0.01)] {
        let mixture = model.query(&[name], &evidence).unwrap().mixture(name).unwrap();
        prehend_testkit::integrates_to_one_on_line(|x| mixture.log_density(&[x]).unwrap(), -20.0, 20.0, step);
    }
    let upos = model
        .query(&["upos"], &evidence)
        .unwrap()
        .mixture("upos")
        .unwrap();
    let normalizer = upos.log_sphere_normalizer().unwrap();
    prehend_testkit::integrates_to_one_on_sphere(|x| upos.log_density(&x).unwrap() - normalizer, 200);
}

#[test]
fn evidence_sixty_deviations_out_still_has_an_answer() {
    let model = oracle_model();
    let evidence = evidence_of(
        &model,
        &json!({ "upos": [60.0, 0.0, -60.0], "size": [50.0, 1.0] }),
    )
    .unwrap();
    let answer = model.query(&["task"], &evidence).unwrap();
    assert!(answer.log_evidence < -1000.0 && answer.log_evidence.is_finite());
    assert!((answer.probabilities("task").unwrap().iter().sum::<f64>() - 1.0).abs() < 1e-12);
}

#[test]
fn a_flat_component_is_legal_until_the_evidence_needs_its_density() {
    let flat = EXAMPLE.replace("[[0.5, 0.1], [0.1, 0.5]]", "[[0.5, 0.5], [0.5, 0.5]]");
    let model = Model::from_json(&flat).unwrap();
    assert!(model.query(&["size"], &Evidence::new()).is_ok());
    let error = model.query(
        &["task"],
        &Evidence::new().with_value(&model, "size", &[0.0, 0.0]).unwrap(),
    );
    let expected = ModelError::NoDensity {
        node: "size".into(),
        configuration: 1,
        component: 1,
    };
    assert_eq!(error.unwrap_err(), expected);
    // One dimension of it has a density, and so has a noisy measurement.
    assert!(
        model
            .query(
                &["task"],
                &evidence_of(&model, &json!({ "size": [0.0, null] })).unwrap()
            )
            .is_ok()
    );
    let noisy = json!({ "size": { "mean": [0.0, 0.0], "covariance": [[0.1, 0.0], [0.0, 0.1]] } });
    assert!(
        model
            .query(&["task"], &evidence_of(&model, &noisy).unwrap())
            .is_ok()
    );
}

#[test]
fn contributions_add_up_to_the_posterior_odds() {
    let model = oracle_model();
    let evidence = evidence_of(&model, &json!({ "size": [0.3, -0.2], "upos": [0.2, -0.5, 0.3] })).unwrap();
    let explanation = model.explain("task", &evidence).unwrap();
    let posterior = model
        .query(&["task"], &evidence)
        .unwrap()
        .probabilities("task")
        .unwrap();
    let states = ["hand-over", "pouring", "tool-use"];
    let p = |state: &str| posterior[states.iter().position(|s| *s == state).unwrap()];
    assert_eq!(explanation.against.len(), 2);
    for contrast in &explanation.against {
        let sum: f64 = contrast.prior + contrast.contributions.iter().map(|(_, nats)| nats).sum::<f64>();
        assert!((sum - (p(&explanation.state) / p(&contrast.other)).ln()).abs() < 1e-9);
        assert_eq!(
            contrast
                .contributions
                .iter()
                .map(|(node, _)| node.as_str())
                .collect::<Vec<_>>(),
            ["size", "upos"]
        );
    }
}

#[test]
fn a_prior_can_be_replaced() {
    let model = example();
    let certain = model
        .with_priors_json(r#"{ "task": { "pouring": 2.0 } }"#)
        .unwrap();
    let answer = certain.query(&["task"], &Evidence::new()).unwrap();
    assert_eq!(answer.probabilities("task").unwrap(), [0.0, 1.0]);
    let uniform = model.with_uniform_priors();
    assert_eq!(
        uniform
            .query(&["task"], &Evidence::new())
            .unwrap()
            .probabilities("task")
            .unwrap(),
        [0.5, 0.5]
    );
}

#[test]
fn json_and_bytes_lose_nothing() {
    for mut model in [example(), oracle_model()] {
        let provenance = json!({ "seed": 7, "third": 1.0 / 3.0 }).to_string();
        model = model.with_extra("provenance", &provenance).unwrap();
        assert_eq!(model.extra().get("provenance"), Some(provenance));
        assert!(model.clone().with_extra("provenance", "{").is_err());
        let text = model.to_json();
        assert_eq!(Model::from_json(&text).unwrap(), model);
        let bytes = model.to_bytes();
        let again = Model::from_bytes(&bytes).unwrap();
        assert_eq!(again, model);
        assert_eq!(again.to_json(), text);
        assert_eq!(Model::from_json(&text).unwrap().to_bytes(), bytes);
    }
}

#[test]
fn a_damaged_binary_model_is_refused() {
    let bytes = example().to_bytes();
    let message = |bytes: &[u8]| Model::from_bytes(bytes).unwrap_err().to_string();
    assert!(message(b"hello").contains("expected the header PREHENDM"));
    assert!(message(&bytes[..bytes.len() - 1]).contains("the file is cut off"));
    let mut flipped = bytes.clone();
    let last = flipped.len() - 1;
    flipped[last] ^= 1;
    assert!(message(&flipped).contains("the file is damaged"));
}

#[test]
fn a_wrong_model_file_says_where() {
    let message = |from: &str, to: &str| {
        let text = EXAMPLE.replace(from, to);
        assert_ne!(text, EXAMPLE);
        Model::from_json(&text).unwrap_err().to_string()
    };
    assert_eq!(
        message("\"prehend-model\"", "\"bif\""),
        "model file, `format`: found \"bif\", expected \"prehend-model\""
    );
    assert_eq!(
        message("[[0.4, 0.6]]", "[[0.4, 0.7]]"),
        "`task`: table row 0 is [0.4, 0.7] (sum 1.1); expected 2 probabilities that sum to 1"
    );
    assert!(
        message("[[0.5, 0.1], [0.1, 0.5]]", "[[0.5, 0.9], [0.9, 0.5]]")
            .starts_with("`size`: configuration 1, component 1: `covariance` has the negative eigenvalue")
    );
    assert_eq!(
        message("\"mean\": [2.0, 1.0]", "\"mean\": [2.0]"),
        "`size`: configuration 1, component 1: `mean` has 1 entries; expected 2, one per column"
    );
    assert!(message("\"weight\": 0.7,", "").starts_with("model file, node `size`: missing field `weight`"));
    assert!(
        message("[\"task\"]", "[\"tusk\"]")
            .starts_with("`size` names the parent `tusk`, which is not a node")
    );
}

#[test]
fn wrong_evidence_says_what_would_do() {
    let model = example();
    let message = |json: Value| evidence_of(&model, &json).unwrap_err().to_string();
    assert_eq!(
        message(json!({ "colour": 1 })),
        "the model has no node `colour`; its nodes are `task`, `size`"
    );
    assert_eq!(
        message(json!({ "task": "juggling" })),
        "`task`: found \"juggling\", expected one of `hand-over`, `pouring`, or an index from 0 to 1"
    );
    assert!(message(json!({ "size": [1.0] })).contains("expected 2 finite numbers or nulls"));
    assert!(message(json!({ "size": "big" })).contains("expected an array of 2 numbers or nulls"));
    let twice = model.query(&["task", "task"], &Evidence::new()).unwrap_err();
    assert_eq!(
        twice.to_string(),
        "`task`: found the same target twice, expected each target once"
    );
    let none = Evidence::new().with(&model, "task", Observation::Likelihood(vec![0.0, 0.0]));
    assert!(none.is_err());
}

#[test]
fn shared_weights_are_checked_and_kept() {
    let root = EXAMPLE.replace(
        "\"discrete_parents\": [\"task\"],",
        "\"discrete_parents\": [\"task\"], \"weights\": \"root\",",
    );
    let message = Model::from_json(&root).unwrap_err().to_string();
    assert_eq!(
        message,
        "`size`: configuration 1, component 0: the row has 2 components, row 0 has 1; `weights` asks for as many"
    );
    let one = r#"{ "weight": 1.0, "mean": [0.1, 0.2], "coefficients": [[], []], "covariance": [[1.0, 0.0], [0.0, 1.0]] }"#;
    let two = r#"{ "weight": 0.3, "mean": [9.0, 0.2], "covariance": [[1.0, 0.0], [0.0, 1.0]] },
        { "weight": 0.7, "mean": [0.1, 0.2], "covariance": [[1.0, 0.0], [0.0, 1.0]] }"#;
    let tied = root.replace(one, two);
    let model = Model::from_json(&tied).unwrap();
    // Two rows of two 2-d Gaussians with 5 numbers each, one weight, one probability of the task.
    assert_eq!(model.n_parameters(), 4 * 5 + 1 + 1);
    assert_eq!(Model::from_json(&model.to_json()).unwrap(), model);
    assert_eq!(Model::from_bytes(&model.to_bytes()).unwrap(), model);
    let message = Model::from_json(&tied.replace("root", "shared"))
        .unwrap_err()
        .to_string();
    assert_eq!(
        message,
        "`size`: configuration 1, component 0: differs from configuration 0, though `weights` is \"shared\""
    );
}

#[test]
fn an_explanation_has_words_and_a_counterfactual() {
    let model = example();
    let evidence = evidence_of(&model, &json!({ "size": [2.0, 1.0] })).unwrap();
    let words = model.explain("task", &evidence).unwrap().words();
    assert_eq!(words.len(), 1);
    assert!(
        words[0].starts_with("`pouring` is ") && words[0].contains("size speaks for it (+"),
        "{words:?}"
    );
    let changes = evidence_of(&model, &json!({ "size": [0.1, 0.2] })).unwrap();
    let other = model.counterfactual("task", &evidence, &changes).unwrap();
    let then = model
        .query(&["task"], &changes)
        .unwrap()
        .probabilities("task")
        .unwrap();
    assert_eq!(other.states.iter().map(|s| s.2).collect::<Vec<_>>(), then);
    assert!(
        other.words()[0].starts_with("had `size` been [0.1, 0.2], `"),
        "{:?}",
        other.words()
    );
}

#[test]
fn what_no_row_of_the_model_looks_like_is_a_surprise() {
    let model = oracle_model();
    let score = |json: Value| model.surprise(&evidence_of(&model, &json).unwrap()).unwrap();
    let strange = score(json!({ "size": [30.0, -30.0], "fvol": 0.2 }));
    assert_eq!(strange.tail, 1.0 / 1000.0);
    assert!(
        strange.words().contains("the model knows nothing like it"),
        "{}",
        strange.words()
    );
    assert!(
        strange.words().ends_with("odd by itself: `size`"),
        "{}",
        strange.words()
    );
    // Rows of the model itself score uniformly: their mean is a half within three standard errors.
    let rows = Evidence::from_table(&model, &model.sample(20, 5)).unwrap();
    let tails: Vec<f64> = rows
        .into_iter()
        .map(|row| {
            let hidden = ["egpc", "upos", "dir", "rigid"].map(|name| model.index(name).unwrap());
            model
                .surprise(&hidden.into_iter().fold(row, Evidence::without))
                .unwrap()
                .tail
        })
        .collect();
    let mean = tails.iter().sum::<f64>() / 20.0;
    assert!((mean - 0.5).abs() < 3.0 * (1.0f64 / 12.0 / 20.0).sqrt(), "{mean}");
}

#[test]
fn the_likeliest_components_may_tell_another_story() {
    // Two narrow halves of "two" are together likelier than the one component of "one", each alone is not.
    let model = Model::from_json(
        r#"{ "format": "prehend-model", "version": 1, "nodes": [
        { "name": "kind", "kind": "discrete", "states": ["one", "two"], "table": [[0.45, 0.55]] },
        { "name": "x", "kind": "gaussian_mixture", "discrete_parents": ["kind"], "components": [
            [{ "weight": 1.0, "mean": [0.0], "covariance": [[1.0]] }],
            [{ "weight": 0.5, "mean": [0.1], "covariance": [[1.0]] }, { "weight": 0.5, "mean": [-0.1], "covariance": [[1.0]] }]] },
        { "name": "y", "kind": "gaussian_mixture", "continuous_parents": ["x"], "components": [
            [{ "weight": 1.0, "mean": [1.0], "coefficients": [[2.0]], "covariance": [[0.5]] }]] }] }"#,
    )
    .unwrap();
    let seen = evidence_of(&model, &json!({ "x": 0.05 })).unwrap();
    let summed = model.most_probable(&seen, Latent::Summed).unwrap();
    let maximised = model.most_probable(&seen, Latent::Maximised).unwrap();
    assert_eq!(summed.states, [("kind".into(), "two".into())]);
    assert_eq!(maximised.states, [("kind".into(), "one".into())]);
    assert_eq!(maximised.components, [("x".into(), 0), ("y".into(), 0)]);
    assert!((maximised.values[0].mean[0] - 1.1).abs() < 1e-12);
    // log P(one, component | x): 0.45 N(0.05; 0, 1) over the evidence.
    let one = 0.45 * (-0.5f64 * 0.0025).exp() / (2.0 * std::f64::consts::PI).sqrt();
    assert!((maximised.log_probability - (one.ln() - maximised.log_evidence)).abs() < 1e-12);
}

#[test]
fn a_long_chain_of_discrete_nodes_is_no_matter_of_its_joint_states() {
    // 60 nodes of 3 states: 4e28 joint states.
    let mut nodes = vec![
        json!({ "name": "n0", "kind": "discrete", "states": ["a", "b", "c"], "table": [[0.2, 0.3, 0.5]] }),
    ];
    for i in 1..60 {
        nodes.push(json!({ "name": format!("n{i}"), "kind": "discrete", "states": ["a", "b", "c"], "parents": [format!("n{}", i - 1)],
            "table": [[0.8, 0.1, 0.1], [0.2, 0.6, 0.2], [0.1, 0.2, 0.7]] }));
    }
    let model =
        Model::from_json(&json!({ "format": "prehend-model", "version": 1, "nodes": nodes }).to_string())
            .unwrap();
    let end = Evidence::new().with_state(&model, "n59", "b").unwrap();
    let start = model.query(&["n0", "n30"], &end).unwrap();
    assert!((start.probabilities("n0").unwrap().iter().sum::<f64>() - 1.0).abs() < 1e-12);
    // By hand: what 30 steps from the start make of the prior, times what 29 steps back make of the evidence.
    let step = [[0.8, 0.1, 0.1], [0.2, 0.6, 0.2], [0.1, 0.2, 0.7]];
    let (mut forward, mut backward) = ([0.2, 0.3, 0.5], [0.0, 1.0, 0.0]);
    for _ in 0..30 {
        forward = [0, 1, 2].map(|j| (0..3).map(|i| forward[i] * step[i][j]).sum());
    }
    for _ in 0..29 {
        backward = step.map(|row| (0..3).map(|j| row[j] * backward[j]).sum());
    }
    let total: f64 = (0..3).map(|i| forward[i] * backward[i]).sum();
    let middle = start.probabilities("n30").unwrap();
    assert!(
        (0..3).all(|i| (middle[i] - forward[i] * backward[i] / total).abs() < 1e-12),
        "{middle:?}"
    );
    assert_eq!(
        model.most_probable(&end, Latent::Summed).unwrap().states.len(),
        59
    );
}
