//! `quality` against closed forms and the hulls of another program.

use serde_json::{Value, json};

mod common;

use common::{assert_close, keys, number, prehend};

/// Two fingertips that press a ball of one metre along x.
fn pinch(torsion: f64) -> Value {
    json!({ "center": [0, 0, 0], "torque_scale": 1.0, "contacts": [
        { "point": [1, 0, 0], "normal": [-1, 0, 0], "mu": 1.0, "torsion": torsion },
        { "point": [-1, 0, 0], "normal": [1, 0, 0], "mu": 1.0, "torsion": torsion } ] })
}

#[test]
fn two_hard_fingers_leave_the_turn_about_their_line_free() {
    let answer = prehend(&["quality", "-", "--json"], &pinch(0.0).to_string()).answer();
    assert_eq!(
        keys(&answer),
        ["epsilon", "force_closure", "line", "origin_distance", "rank"]
    );
    assert_eq!(answer["epsilon"], json!(0.0));
    assert_eq!(answer["force_closure"], json!(false));
    assert_eq!(answer["rank"], json!(5));
    assert_close(&answer["origin_distance"], 0.0);
}

#[test]
fn one_finger_alone_pushes_the_origin_out() {
    let line = json!({ "center": [0, 0, 0], "torque_scale": 1.0,
        "contacts": [{ "point": [1, 0, 0], "normal": [-1, 0, 0], "mu": 0.5 }] });
    let answer = prehend(&["quality", "-", "--json"], &line.to_string()).answer();
    assert_close(&answer["origin_distance"], 1.0);
    assert_eq!(answer["force_closure"], json!(false));
}

#[test]
fn millimetres_and_metres_say_the_same_of_the_same_grasp() {
    let metres = pinch(0.0021);
    let mut millimetres = pinch(2.1);
    millimetres["length_unit"] = json!("mm");
    millimetres["torque_scale"] = json!(1000.0);
    millimetres["contacts"][0]["point"] = json!([1000, 0, 0]);
    millimetres["contacts"][1]["point"] = json!([-1000, 0, 0]);
    let run = prehend(&["quality", "-", "--json"], &format!("{metres}\n{millimetres}\n"));
    let lines = run.lines();
    assert_eq!(lines[0]["force_closure"], json!(true));
    assert_close(&lines[1]["epsilon"], number(&lines[0]["epsilon"]));
}

#[test]
fn a_flag_asks_for_the_volume() {
    let answer = prehend(&["quality", "-", "--volume", "--json"], &pinch(0.5).to_string()).answer();
    assert!(number(&answer["volume"]) > 0.0);
}

#[test]
fn the_hulls_of_another_program_agree() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../quality/tests/oracle/hulls.json");
    let oracle: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    let cases = oracle["cases"].as_array().unwrap();
    let question = |case: &Value| {
        let mut line = serde_json::Map::new();
        for key in [
            "center",
            "torque_scale",
            "cone_edges",
            "norm",
            "length_unit",
            "contacts",
        ] {
            line.insert(key.into(), case[key].clone());
        }
        Value::Object(line).to_string()
    };
    let input = cases.iter().map(question).collect::<Vec<_>>().join("\n");
    let run = prehend(&["quality", "-", "--json"], &input);
    assert_eq!(run.status, 0, "{}", run.stderr);
    for (answer, case) in run.lines().iter().zip(cases) {
        assert_close(&answer["epsilon"], number(&case["epsilon"]));
    }
}

#[test]
fn a_line_that_fails_says_why_in_its_place() {
    let good = pinch(0.1).to_string();
    let mut no_scale = pinch(0.1);
    no_scale.as_object_mut().unwrap().remove("torque_scale");
    let mut no_normal = pinch(0.1);
    no_normal["contacts"][1]["normal"] = json!([0, 0, 0]);
    let mut unit = pinch(0.1);
    unit["length_unit"] = json!("inch");
    let input = format!("{good}\nnonsense\n{no_scale}\n{no_normal}\n{unit}\n{good}\n");
    let run = prehend(&["quality", "-", "--json"], &input);
    assert_eq!(run.status, 1);
    let lines = run.lines();
    let numbers: Vec<_> = lines.iter().map(|l| l["line"].clone()).collect();
    assert_eq!(numbers, [1, 2, 3, 4, 5, 6]);
    for (i, said) in [
        (
            1,
            "standard input, line 2: column 2: expected ident; expected one JSON object a line",
        ),
        (2, "missing field `torque_scale`"),
        (3, "contact 1: the normal [0.0, 0.0, 0.0] has no direction"),
        (4, "unknown variant `inch`, expected `m` or `mm`"),
    ] {
        let error = lines[i]["error"].as_str().unwrap();
        assert!(error.contains(said), "{error}");
    }
    assert_eq!(lines[5]["epsilon"], lines[0]["epsilon"]);
}
