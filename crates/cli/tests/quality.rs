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
        [
            "epsilon",
            "force_closure",
            "limiting_wrench",
            "line",
            "origin_distance",
            "rank"
        ]
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
    let contact = |c: &Value| json!({ "point": [c[0], c[1], c[2]], "normal": [c[3], c[4], c[5]], "mu": c[6], "torsion": c[7] });
    let question = |case: &Value| {
        let mut line = json!({ "metric_semi_axes": case["semi_axes"] });
        for key in [
            "center",
            "torque_scale",
            "cone_edges",
            "norm",
            "length_unit",
            "gravity",
        ] {
            line[key] = case[key].clone();
        }
        line["contacts"] = case["contacts"].as_array().unwrap().iter().map(contact).collect();
        let counts = case["axes"].as_str().unwrap().chars();
        let names = ["fx", "fy", "fz", "tx", "ty", "tz"].iter().zip(counts);
        line["axes"] = names.filter(|(_, c)| *c == 'x').map(|(name, _)| *name).collect();
        if case["task_scale"].is_number() {
            line["task"] = json!({ "wrenches": case["task"] });
        }
        line.to_string()
    };
    let input = cases.iter().map(question).collect::<Vec<_>>().join("\n");
    let run = prehend(&["quality", "-", "--json"], &input);
    assert_eq!(run.status, 0, "{}", run.stderr);
    for (answer, case) in run.lines().iter().zip(cases) {
        assert_close(&answer["epsilon"], number(&case["epsilon"]));
        assert_eq!(answer["rank"], case["rank"], "{}", case["name"]);
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

/// Four fingertips at the corners of a tetrahedron press a ball of one metre.
fn four(further: &Value) -> Value {
    let corners = [[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]];
    let contact = |c: &[i32; 3]| {
        let unit = c.map(|x| f64::from(x) / 3.0_f64.sqrt());
        json!({ "point": unit, "normal": unit.map(|x| -x), "mu": 0.8 })
    };
    let mut line = json!({ "center": [0, 0, 0], "torque_scale": 1.0,
        "contacts": corners.iter().map(contact).collect::<Vec<_>>() });
    for (key, value) in further.as_object().unwrap() {
        line[key] = value.clone();
    }
    line
}

fn ask(further: &Value) -> Value {
    prehend(&["quality", "-", "--json"], &four(further).to_string()).answer()
}

#[test]
fn every_convention_is_a_key() {
    let plain = ask(&json!({}));
    let epsilon = number(&plain["epsilon"]);
    assert!(epsilon > 0.1 && plain["rank"] == json!(6));
    // The limiting wrench has norm 1.
    let worst = plain["limiting_wrench"].as_array().unwrap();
    assert_close(&json!(worst.iter().map(|x| number(x).powi(2)).sum::<f64>()), 1.0);

    // All four may press with 1 each instead of sharing it: more, but not more than four times.
    let linf = number(&ask(&json!({ "norm": "linf" }))["epsilon"]);
    assert!(linf >= epsilon && linf <= 4.0 * epsilon, "{linf} {epsilon}");

    // The round cone holds the one of eight edges.
    let smooth = ask(&json!({ "cone": "smooth" }));
    let (low, high) = (
        number(&smooth["bounds"]["lower"]),
        number(&smooth["bounds"]["upper"]),
    );
    assert!(
        low >= epsilon - 1e-3 && low <= high && high - low < 1e-3,
        "{smooth}"
    );
    assert_close(&smooth["epsilon"], low);

    // An ellipsoid twice as long in every direction fits half as often.
    let twice = ask(&json!({ "metric_semi_axes": [2, 2, 2, 2, 2, 2] }));
    assert_close(&twice["epsilon"], epsilon / 2.0);

    // Forces alone are resisted better than forces and torques.
    let forces = ask(&json!({ "axes": ["fx", "fy", "fz"] }));
    assert!(number(&forces["epsilon"]) >= epsilon);
    assert_eq!(forces["rank"], json!(3));

    let heavy = number(&ask(&json!({ "gravity": [0, 0, -0.5] }))["epsilon"]);
    assert!(heavy < epsilon, "{heavy}");

    // The task's own wrenches: a pull of 1 either way along x is a set that a ball of radius 1 contains.
    let pull = ask(&json!({ "task": { "wrenches": [[1, 0, 0, 0, 0, 0], [-1, 0, 0, 0, 0, 0]] } }));
    assert!(number(&pull["task_scale"]) >= epsilon, "{pull}");
    let poured = ask(&json!({ "task": { "pouring": { "up": [0, 0, 1], "axis": [0, 1, 0] } } }));
    assert!(number(&poured["task_scale"]) > 0.0, "{poured}");
}

#[test]
fn slopes_and_distributions_come_when_asked_for() {
    let line = four(&json!({ "uncertainty": { "friction": 0.2, "contact_normal": 0.1 } })).to_string();
    let flags = ["quality", "-", "--sensitivity", "--samples", "50", "--json"];
    let answer = prehend(&flags, &line).answer();
    let slopes = answer["sensitivity"].as_array().unwrap();
    assert_eq!(slopes.len(), 4);
    assert!(slopes.iter().all(|s| number(&s["mu"]) >= -1e-6), "{answer}");
    let distribution = &answer["distribution"];
    assert_eq!(distribution["samples"], json!(50));
    assert_close(&distribution["probability_of_force_closure"], 1.0);
    assert_eq!(answer, prehend(&flags, &line).answer(), "the seed decides");
}

#[test]
fn a_wrong_key_is_named() {
    let run = prehend(
        &["quality", "-", "--json"],
        &four(&json!({ "cone": "smooth", "cone_edges": 8 })).to_string(),
    );
    let error = run.lines()[0]["error"].as_str().unwrap().to_owned();
    assert!(
        error.contains("line 1") && error.contains("`cone_edges` is 8"),
        "{error}"
    );
    let run = prehend(
        &["quality", "-", "--json"],
        &four(&json!({ "axes": ["fx"] })).to_string(),
    );
    assert!(
        run.lines()[0]["error"]
            .as_str()
            .unwrap()
            .contains("expected 2 to 6"),
        "{:?}",
        run.lines()
    );
}
