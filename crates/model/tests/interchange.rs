//! BIF, XMLBIF, NET: what is written reads back, what other programs write is read, and faults have a line.

use prehend_model::{Evidence, Export, Model, ModelError};
use serde_json::{Value, json};

fn evidence_of(model: &Model, json: &Value) -> Result<Evidence, ModelError> {
    Evidence::from_json(model, &json.to_string())
}

const MIXED: &str = r#"{ "format": "prehend-model", "version": 1, "nodes": [
    { "name": "rain", "kind": "discrete", "states": ["no", "yes"], "table": [[0.8, 0.2]] },
    { "name": "task", "kind": "discrete", "states": ["hand-over", "pouring"], "parents": ["rain"],
      "table": [[0.3333333333333333, 0.6666666666666667], [0.1, 0.9]] },
    { "name": "size", "kind": "gaussian_mixture", "columns": ["size_x", "size_y"], "discrete_parents": ["task"], "components": [
        [{ "weight": 1.0, "mean": [0.1, -0.2], "covariance": [[1.0, 0.3], [0.3, 0.5]] }],
        [{ "weight": 0.25, "mean": [1.0, 2.0], "covariance": [[0.2, 0.2], [0.2, 0.2]] },
         { "weight": 0.75, "mean": [-1.0, 0.5], "covariance": [[0.5, -0.1], [-0.1, 2.0]] }]] },
    { "name": "grip", "kind": "gaussian_mixture", "discrete_parents": ["rain"], "continuous_parents": ["size"], "components": [
        [{ "weight": 1.0, "mean": [0.3], "coefficients": [[0.7, -1.5]], "covariance": [[0.04]] }],
        [{ "weight": 1.0, "mean": [-0.3], "coefficients": [[0.0, 2.0]], "covariance": [[1e-7]] }]] },
    { "name": "dir", "kind": "gaussian_mixture", "columns": ["dir_w", "dir_x"], "sign": "latent", "sphere": true, "components": [
        [{ "weight": 1.0, "mean": [0.6, 0.8], "covariance": [[0.01, 0.0], [0.0, 0.02]] }]] }] }"#;

fn mixed() -> Model {
    Model::from_json(MIXED).unwrap()
}

fn discrete_part() -> Model {
    let mut file: Value = serde_json::from_str(MIXED).unwrap();
    file["nodes"].as_array_mut().unwrap().truncate(2);
    Model::from_json(&file.to_string()).unwrap()
}

#[test]
fn the_discrete_part_survives_bif_and_xmlbif_bit_for_bit() {
    let lost = |export: &Export| {
        export
            .losses
            .iter()
            .filter(|loss| loss.contains("left out"))
            .count()
    };
    let bif = mixed().to_bif().unwrap();
    assert_eq!(lost(&bif), 3);
    assert_eq!(Model::from_bif(&bif.text).unwrap(), discrete_part());
    let xml = mixed().to_xmlbif().unwrap();
    assert_eq!(lost(&xml), 3);
    assert_eq!(Model::from_xmlbif(&xml.text).unwrap(), discrete_part());
    assert!(discrete_part().to_bif().unwrap().losses.is_empty());
}

#[test]
fn a_mixed_model_answers_the_same_after_net() {
    let model = mixed();
    let export = model.to_net().unwrap();
    assert_eq!(
        export.losses,
        [
            "the components of `size` are the states of a new node `size_component`",
            "`size` is split into the scalar nodes size_x, size_y",
            "the components of `dir` are the states of a new node `dir_component`",
            "`dir` is split into the scalar nodes dir_w, dir_x",
            "`dir`: its scaling, and whether its values are unit vectors, are left out",
        ]
    );
    let scalar = Model::from_net(&export.text).unwrap();
    for (ours, theirs) in [
        (
            json!({ "size": [0.3, 0.1], "grip": 0.5 }),
            json!({ "size_x": 0.3, "size_y": 0.1, "grip": 0.5 }),
        ),
        (
            json!({ "size": [null, 0.1], "dir": [0.5, 0.9] }),
            json!({ "size_y": 0.1, "dir_w": 0.5, "dir_x": 0.9 }),
        ),
        (json!({ "grip": 4.0 }), json!({ "grip": 4.0 })),
    ] {
        // Where the second component of pouring is flat, the whole vector has no density.
        let Ok(ours) = model.query(&["task", "rain"], &evidence_of(&model, &ours).unwrap()) else {
            assert!(
                scalar
                    .query(&["task"], &evidence_of(&scalar, &theirs).unwrap())
                    .is_err()
            );
            continue;
        };
        let theirs = scalar
            .query(&["task", "rain"], &evidence_of(&scalar, &theirs).unwrap())
            .unwrap();
        assert!((ours.log_evidence - theirs.log_evidence).abs() < 1e-10);
        for node in ["task", "rain"] {
            for (a, b) in ours
                .probabilities(node)
                .unwrap()
                .iter()
                .zip(theirs.probabilities(node).unwrap())
            {
                assert!((a - b).abs() < 1e-12);
            }
        }
    }
    // A model of scalars comes back as it was, with nothing to tell.
    let again = scalar.to_net().unwrap();
    assert!(again.losses.is_empty());
    assert_eq!(
        again.text,
        Model::from_net(&again.text).unwrap().to_net().unwrap().text
    );
    assert_eq!(Model::from_net(&again.text).unwrap(), scalar);
}

#[test]
fn files_of_bnlearn_style_are_read() {
    let text = "network unknown {\n}\n// a comment\nvariable \"wet grass\" {\n  type discrete [ 2 ] { no, yes };\n  property position = (1, 2) ;\n}\n\
        variable rain {\n  type discrete[2] { no yes };\n}\nprobability ( rain ) {\n  table 0.8, 0.2;\n}\n\
        probability ( \"wet grass\" | rain ) {\n  (no) 0.9, 0.1;\n  default 0.333, 0.666;\n}\n";
    let model = Model::from_bif(text).unwrap();
    let wet = Evidence::new().with_state(&model, "wet grass", "yes").unwrap();
    let rain = model
        .query(&["rain"], &wet)
        .unwrap()
        .probabilities("rain")
        .unwrap()[1];
    let yes = 0.2 * 0.666 / 0.999;
    assert!((rain - yes / (yes + 0.08)).abs() < 1e-12);
    // A whole table: the child varies slowest.
    let whole = text.replace(
        "  (no) 0.9, 0.1;\n  default 0.333, 0.666;\n",
        "  table 0.9, 0.4, 0.1, 0.6;\n",
    );
    let model = Model::from_bif(&whole).unwrap();
    let rain = Evidence::new().with_state(&model, "rain", "yes").unwrap();
    let wet = model.query(&["wet grass"], &rain).unwrap();
    assert!((wet.probabilities("wet grass").unwrap()[1] - 0.6).abs() < 1e-12);
}

#[test]
fn a_fault_has_its_line() {
    let bif = mixed().to_bif().unwrap().text;
    let message = |from: &str, to: &str| {
        assert!(bif.contains(from));
        Model::from_bif(&bif.replacen(from, to, 1))
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        message("[ 2 ]", "[ 3 ]"),
        "BIF file, line 4: found 2 states of `rain`, expected 3, as announced"
    );
    assert_eq!(
        message("0.8, 0.2", "0.8, x"),
        "BIF file, line 10: found `x`, expected a probability"
    );
    assert_eq!(
        message("(yes)", "(maybe)"),
        "BIF file, line 14: found `maybe`, expected a state of `rain`: `no`, `yes`"
    );
    assert_eq!(
        message("  (yes) 0.1, 0.9;\n", ""),
        "BIF file, line 12: found no probabilities of `task` in configuration 1, expected one row for each \
         configuration of the parents, or `default`"
    );
    assert!(message("0.8, 0.2", "0.8, 0.9").contains("expected numbers of at least 0 that sum to 1"));
    let net = mixed().to_net().unwrap().text;
    let message = |from: &str, to: &str| {
        assert!(net.contains(from), "{net}");
        Model::from_net(&net.replacen(from, to, 1))
            .unwrap_err()
            .to_string()
    };
    assert!(message("normal", "gamma").ends_with("found `gamma`, expected `normal`"));
    assert!(message("continuous node", "decision").contains("decisions and utilities are not read"));
    assert!(message("0.8 0.2", "0.8").contains("found 1 entries in the data of `rain`, expected 2"));
    let xml = mixed().to_xmlbif().unwrap().text;
    let error = Model::from_xmlbif(&xml.replacen("</NAME>", "", 1))
        .unwrap_err()
        .to_string();
    assert!(error.starts_with("XMLBIF file, line"), "{error}");
    let error = Model::from_xmlbif(&xml.replacen("0.8 0.2", "0.8", 1))
        .unwrap_err()
        .to_string();
    assert_eq!(
        error,
        "XMLBIF file, line 15: found 1 probabilities of `rain`, expected 1 rows of 2"
    );
}

#[test]
fn what_cannot_be_written_says_so() {
    let mut file: Value = serde_json::from_str(MIXED).unwrap();
    let nodes = file["nodes"].as_array_mut().unwrap();
    *nodes = vec![nodes[4].clone()];
    let continuous = Model::from_json(&file.to_string()).unwrap();
    assert_eq!(
        continuous.to_bif().unwrap_err(),
        ModelError::Export {
            format: "BIF".into(),
            problem: "no node is discrete; .net holds continuous nodes too".into()
        }
    );
    let two = Model::from_json(
        r#"{ "format": "prehend-model", "version": 1, "nodes": [
        { "name": "a b", "kind": "discrete", "states": ["x"], "table": [[1.0]] },
        { "name": "a_b", "kind": "discrete", "states": ["x"], "table": [[1.0]] }] }"#,
    )
    .unwrap();
    assert_eq!(
        two.to_bif().unwrap_err().to_string(),
        "the model cannot be written as BIF: node `a_b` becomes `a_b`, as another one does; rename one"
    );
    assert!(mixed().to_dot().text.contains("\"rain\" -> \"task\";"));
}

#[test]
fn files_of_pgmpy_and_pyagrum_are_read_and_they_read_ours() {
    // `oracle/foreign.py` wrote these with both programs, and has both read what stands in `ours.*`.
    let expected: Value = serde_json::from_str(include_str!("oracle/foreign/expected.json")).unwrap();
    let files = [
        (
            "pgmpy.bif",
            Model::from_bif(include_str!("oracle/foreign/pgmpy.bif")),
        ),
        (
            "pgmpy.xmlbif",
            Model::from_xmlbif(include_str!("oracle/foreign/pgmpy.xmlbif")),
        ),
        (
            "pgmpy.net",
            Model::from_net(include_str!("oracle/foreign/pgmpy.net")),
        ),
        (
            "pyagrum.bif",
            Model::from_bif(include_str!("oracle/foreign/pyagrum.bif")),
        ),
        (
            "pyagrum.bifxml",
            Model::from_xmlbif(include_str!("oracle/foreign/pyagrum.bifxml")),
        ),
        (
            "pyagrum.net",
            Model::from_net(include_str!("oracle/foreign/pyagrum.net")),
        ),
    ];
    for (file, model) in files {
        let model = model.unwrap_or_else(|e| panic!("{file}: {e}"));
        let seen = evidence_of(&model, &json!({ "wet": "soaked", "sprinkler": "off" })).unwrap();
        let season = model
            .query(&["season"], &seen)
            .unwrap()
            .probabilities("season")
            .unwrap();
        for (found, expected) in season
            .iter()
            .zip(expected["season_given_soaked_and_off"].as_array().unwrap())
        {
            // Programs print so many digits.
            assert!(
                (found - expected.as_f64().unwrap()).abs() < 1e-6,
                "{file}: {season:?}"
            );
        }
    }
    let ours = discrete_part();
    assert_eq!(
        ours.to_bif().unwrap().text,
        include_str!("oracle/foreign/ours.bif")
    );
    assert_eq!(
        ours.to_xmlbif().unwrap().text,
        include_str!("oracle/foreign/ours.xmlbif")
    );
    assert_eq!(
        ours.to_net().unwrap().text,
        include_str!("oracle/foreign/ours.net")
    );
    assert_eq!(expected["ours_read_by"].as_array().unwrap().len(), 6);
}
