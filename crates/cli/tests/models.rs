//! `query`, `train`, `model convert` and `learn-structure` on models and tables written by hand.

use std::f64::consts::PI;
use std::fmt::Write;

use serde_json::json;

mod common;

use common::{assert_close, keys, number, prehend, put};

/// The example of the model format: pouring has a mixture of two.
const MODEL: &str = r#"{ "format": "prehend-model", "version": 1,
  "nodes": [
    { "name": "task", "kind": "discrete", "states": ["hand-over", "pouring"], "parents": [], "table": [[0.4, 0.6]] },
    { "name": "size", "kind": "gaussian_mixture", "columns": ["size_x", "size_y"],
      "discrete_parents": ["task"], "continuous_parents": [],
      "components": [
        [ { "weight": 1.0, "mean": [0.1, 0.2], "coefficients": [[], []], "covariance": [[1.0, 0.0], [0.0, 1.0]] } ],
        [ { "weight": 0.3, "mean": [0.0, 0.0], "coefficients": [[], []], "covariance": [[1.0, 0.0], [0.0, 1.0]] },
          { "weight": 0.7, "mean": [2.0, 1.0], "coefficients": [[], []], "covariance": [[0.5, 0.1], [0.1, 0.5]] } ] ] } ] }"#;

/// Densities of `size` at the origin given hand-over and pouring. The second component of pouring has determinant 0.24
/// and Mahalanobis distance 8.75 there.
fn densities_at_origin() -> [f64; 2] {
    let unit = 1.0 / (2.0 * PI);
    let far = (-8.75_f64 / 2.0).exp() / (2.0 * PI * 0.24_f64.sqrt());
    [unit * (-0.025_f64).exp(), 0.3 * unit + 0.7 * far]
}

#[test]
fn a_posterior_is_prior_times_likelihood() {
    let folder = tempfile::tempdir().unwrap();
    let model = put(folder.path(), "m.json", MODEL);
    let [over, pouring] = densities_at_origin();
    let evidence = 0.4 * over + 0.6 * pouring;
    let arguments = [
        "query",
        &model,
        "--target",
        "task",
        "--evidence",
        r#"{"size":[0,0]}"#,
        "--json",
    ];
    let answer = prehend(&arguments, "").answer();
    assert_eq!(keys(&answer), ["log_evidence", "posterior"]);
    assert_close(&answer["log_evidence"], evidence.ln());
    assert_close(&answer["posterior"]["hand-over"], 0.4 * over / evidence);

    let uniform = prehend(&[&arguments[..], &["--prior", "uniform"]].concat(), "").answer();
    assert_close(&uniform["posterior"]["hand-over"], over / (over + pouring));
    let told = prehend(
        &[
            &arguments[..],
            &["--prior", r#"{"task":{"pouring":3,"hand-over":1}}"#],
        ]
        .concat(),
        "",
    );
    assert_close(
        &told.answer()["posterior"]["hand-over"],
        over / (over + 3.0 * pouring),
    );
    let explained = prehend(&[&arguments[..], &["--explain", "--mpe"]].concat(), "").answer();
    assert_eq!(explained["mpe"]["states"]["task"], json!("hand-over"));
    let against = &explained["explanation"]["against"]["pouring"];
    assert_close(&against["contributions"]["size"], (over / pouring).ln());
    assert_close(&against["prior"], (0.4_f64 / 0.6).ln());
}

#[test]
fn a_continuous_answer_is_a_mixture_with_densities_where_asked() {
    let folder = tempfile::tempdir().unwrap();
    let model = put(folder.path(), "m.json", MODEL);
    let arguments = [
        "query",
        &model,
        "--target",
        "size",
        "--evidence",
        r#"{"task":"pouring"}"#,
        "--at",
        "[[0,0]]",
        "--json",
    ];
    let answer = prehend(&arguments, "").answer();
    assert_eq!(
        keys(&answer),
        ["components", "covariance", "log_density", "log_evidence", "mean"]
    );
    assert_close(&answer["mean"][0], 1.4);
    assert_close(&answer["mean"][1], 0.7);
    // Within 0.3 · 1 + 0.7 · 0.5, between 0.3 · 0.7 · 2².
    assert_close(&answer["covariance"][0][0], 0.65 + 0.84);
    assert_close(&answer["log_density"][0], densities_at_origin()[1].ln());
    assert_close(&answer["log_evidence"], 0.6_f64.ln());
    let joint = prehend(&["query", &model, "--target", "task,size", "--json"], "").answer();
    assert_close(&joint["targets"]["size"]["mean"][0], 0.4 * 0.1 + 0.6 * 1.4);
}

#[test]
fn many_questions_are_answered_in_order_and_a_bad_one_in_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let model = put(folder.path(), "m.json", MODEL);
    let [over, pouring] = densities_at_origin();
    let posterior = 0.4 * over / (0.4 * over + 0.6 * pouring);

    let table = put(
        folder.path(),
        "e.csv",
        "size_x,size_y,other\n0,0,a\n,,b\nfoo,0,c\n0,0,d\n",
    );
    let run = prehend(
        &[
            "query",
            &model,
            "--target",
            "task",
            "--evidence-file",
            &table,
            "--json",
        ],
        "",
    );
    assert_eq!(run.status, 1);
    let lines = run.lines();
    assert_close(&lines[0]["posterior"]["hand-over"], posterior);
    assert_close(&lines[1]["posterior"]["hand-over"], 0.4);
    let error = lines[2]["error"].as_str().unwrap();
    assert!(error.contains("row 3: column `size_x`: found `foo`"), "{error}");
    assert_eq!(lines[2]["line"], json!(3));
    assert_close(&lines[3]["posterior"]["hand-over"], posterior);

    let questions = "{\"evidence\":{\"size\":[0,0]},\"target\":\"task\"}\n{\"evidence\":{\"weight\":1},\"target\":\"task\"}\n\
                     {\"target\":\"size\",\"at\":[[0,0],[1,1]]}\n";
    let run = prehend(&["query", &model, "--queries", "-", "--json"], questions);
    assert_eq!(run.status, 1);
    let lines = run.lines();
    assert_close(&lines[0]["posterior"]["hand-over"], posterior);
    assert!(
        lines[1]["error"]
            .as_str()
            .unwrap()
            .contains("no node `weight`; its nodes are `task`, `size`")
    );
    assert_eq!(lines[2]["log_density"].as_array().unwrap().len(), 2);
}

#[test]
fn a_line_is_learned_and_its_model_survives_the_way_to_binary_and_back() {
    let folder = tempfile::tempdir().unwrap();
    let network = put(
        folder.path(),
        "line.toml",
        "[[node]]\nname = \"kind\"\nkind = \"discrete\"\nstates = [\"x\", \"y\"]\n\
         [[node]]\nname = \"a\"\nkind = \"gaussian_mixture\"\nparents = [\"kind\"]\nmixture = { components = 1 }\n\
         [[node]]\nname = \"b\"\nkind = \"gaussian_mixture\"\nparents = [\"a\"]\nmixture = { components = 1 }\n",
    );
    // b = 2 a + 1 ± 0.1, the deviation with sum and slope zero over each four rows.
    let mut table = String::from("kind,a,b,object\n");
    for i in 0..80 {
        let a = f64::from(i / 4) * 0.1;
        let b = 2.0 * a + 1.0 + if i % 2 == 0 { 0.1 } else { -0.1 };
        let kind = if i % 4 < 2 { "x" } else { "y" };
        writeln!(table, "{kind},{a},{b},o{}", i / 40).unwrap();
    }
    let out = folder.path().join("models");
    let out = out.to_str().unwrap();
    let arguments = ["train", "-", "--network", &network, "--out", out, "--json"];
    let answer = prehend(&arguments, &table).answer();
    assert_eq!(answer["rows"], json!(80));
    assert!(answer["holdout_log_likelihood"].is_null());
    for node in ["a", "b"] {
        for key in ["components", "bic", "steps"] {
            assert!(answer["nodes"][node][key].is_array(), "{node} {key}");
        }
    }
    assert_eq!(answer["nodes"]["b"]["components"], json!([1]));
    assert_eq!(answer["nodes"]["a"]["components"], json!([1, 1]));

    let model = format!("{out}/line.json");
    let asked = prehend(
        &[
            "query",
            &model,
            "--target",
            "b",
            "--evidence",
            r#"{"a":1.5}"#,
            "--json",
        ],
        "",
    )
    .answer();
    assert!((number(&asked["mean"][0]) - 4.0).abs() < 1e-3, "{asked}");
    assert!(
        (number(&asked["covariance"][0][0]) - 0.01).abs() < 1e-3,
        "{asked}"
    );

    let (binary, back) = (format!("{out}/other.bin"), format!("{out}/back.json"));
    prehend(&["model", "convert", &model, &binary, "--json"], "").answer();
    prehend(&["model", "convert", &binary, &back, "--json"], "").answer();
    assert_eq!(std::fs::read(&model).unwrap(), std::fs::read(&back).unwrap());

    let held = prehend(&[&arguments[..], &["--holdout", "o1"]].concat(), &table).answer();
    assert_eq!((&held["rows"], &held["holdout_rows"]), (&json!(40), &json!(40)));
    assert!(held["holdout_log_likelihood"].is_number());
}

#[test]
fn a_model_goes_on_with_new_rows_and_says_what_they_leave_open() {
    let folder = tempfile::tempdir().unwrap();
    let network = put(
        folder.path(),
        "line.toml",
        "[[node]]\nname = \"kind\"\nkind = \"discrete\"\nstates = [\"x\", \"y\"]\n\
         [[node]]\nname = \"a\"\nkind = \"gaussian_mixture\"\nparents = [\"kind\"]\nmixture = { components = 1 }\n",
    );
    let rows = |range: std::ops::Range<i32>| {
        let mut table = String::from("kind,a\n");
        for i in range {
            let kind = if i % 2 == 0 { "x" } else { "y" };
            writeln!(table, "{kind},{}", f64::from(i % 7) + f64::from(i % 2)).unwrap();
        }
        table
    };
    let out = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (part, all) = (out("part"), out("all"));
    let learn = |rows: String, out: &str| {
        prehend(
            &["train", "-", "--network", &network, "--out", out, "--json"],
            &rows,
        )
        .answer()
    };
    learn(rows(0..30), &part);
    learn(rows(0..60), &all);
    let model = format!("{part}/line.bin");
    let arguments = ["train", "-", "--update", &model, "--out", &part, "--json"];
    let answer = prehend(&arguments, &rows(30..60)).answer();
    assert_eq!(
        (&answer["rows"], &answer["rows_in_all"]),
        (&json!(30), &json!(60))
    );
    assert_eq!(answer["nodes"]["a"]["n_effective"], json!([30.0, 30.0]));
    let ask = |model: &str, more: &[&str]| {
        let question = [
            "query",
            model,
            "--target",
            "kind",
            "--evidence",
            r#"{"a":3.5}"#,
            "--json",
        ];
        prehend(&[&question[..], more].concat(), "").answer()
    };
    let (after, at_once) = (ask(&model, &[]), ask(&format!("{all}/line.bin"), &[]));
    let of = |answer: &serde_json::Value| number(&answer["posterior"]["x"]);
    assert!((of(&after) - of(&at_once)).abs() < 1e-9, "{after} and {at_once}");
    let drawn = ask(&model, &["--draws", "20"]);
    let interval = &drawn["interval"]["kind"]["x"];
    assert!(
        number(&interval[0]) < of(&drawn) && of(&drawn) < number(&interval[1]),
        "{drawn}"
    );
}

#[test]
fn arcs_are_learned_written_and_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let mut rows = String::from("task,width,height,object\n");
    for i in 0..240 {
        let width = f64::from(i % 2) + 0.01 * f64::from(i % 17);
        let height = 2.0 * width + 0.02 * f64::from((i * 7) % 13);
        let task = if i % 2 == 0 { "pour" } else { "use" };
        let _ = writeln!(rows, "{task},{width},{height},o{}", i % 12);
    }
    let data = put(folder.path(), "rows.csv", &rows);
    let nodes = "[[node]]\nname = \"task\"\nkind = \"discrete\"\nstates = [\"pour\", \"use\"]\n\
                 [[node]]\nname = \"width\"\nkind = \"gaussian_mixture\"\n[[node]]\nname = \"height\"\nkind = \"gaussian_mixture\"\n\
                 [structure]\ntiers = [[\"task\"], [\"width\"], [\"height\"]]\n";
    let network = put(folder.path(), "nodes.toml", nodes);
    let place = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let (learned, svg, dot) = (place("learned.toml"), place("learned.svg"), place("learned.dot"));
    let arguments = [
        "learn-structure",
        &data,
        "--network",
        &network,
        "--bootstrap",
        "5",
        "--out",
        &learned,
        "--picture",
        &svg,
        "--json",
    ];
    let answer = prehend(&arguments, "").answer();
    let arcs: Vec<(&str, &str)> = answer["arcs"]
        .as_array()
        .unwrap()
        .iter()
        .map(|arc| (arc["from"].as_str().unwrap(), arc["to"].as_str().unwrap()))
        .collect();
    assert!(
        arcs.contains(&("task", "width")) && arcs.contains(&("width", "height")),
        "{arcs:?}"
    );
    assert!(answer["score"].as_f64() > answer["given_score"].as_f64());
    assert!(answer["arcs"][0]["confidence"].as_f64().is_some_and(|c| c > 0.0));
    assert!(std::fs::read_to_string(&svg).unwrap().contains(">width<"));
    let out = place("models");
    let trained = prehend(
        &["train", &data, "--network", &learned, "--out", &out, "--json"],
        "",
    )
    .answer();
    assert_eq!(number(&trained["rows"]), 240.0);
    prehend(
        &[
            "learn-structure",
            &data,
            "--network",
            &network,
            "--picture",
            &dot,
            "--json",
        ],
        "",
    )
    .answer();
    assert!(
        std::fs::read_to_string(&dot)
            .unwrap()
            .contains("\"task\" -> \"width\"")
    );
    let wrong = prehend(
        &[
            "learn-structure",
            &data,
            "--network",
            &network,
            "--picture",
            "x.png",
        ],
        "",
    );
    assert_eq!(wrong.status, 2);
    assert!(
        wrong
            .stderr
            .contains("expected a file name that ends in .svg or .dot"),
        "{}",
        wrong.stderr
    );
}
