//! `hand`, `synthesize`, `close` and `label` on the bundled hand and object, and on a hand of two bars.

use serde_json::json;

mod common;

use common::{assert_close, keys, number, prehend, put};

const SCHUNK: &str = "hands/schunk_sdh";
const MUG: &str = "objects/mug/coffee_mug.ply";

/// A finger that turns about z at (1, 0, 0), and a slide along y that follows it at half speed.
const TWO_BARS: &str = r#"<robot name="two_bars">
  <link name="base"/><link name="bar"/><link name="slide"/>
  <joint name="turn" type="revolute"><parent link="base"/><child link="bar"/><origin xyz="1 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="follow" type="prismatic"><parent link="bar"/><child link="slide"/><origin xyz="1 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/><mimic joint="turn" multiplier="0.5" offset="0.1"/></joint>
</robot>"#;

#[test]
fn a_bundled_hand_says_its_joints_fingers_and_eigengrasps() {
    let answer = prehend(&["hand", SCHUNK, "--json"], "").answer();
    assert_eq!(answer["dof"], json!(7));
    assert_eq!(answer["fingers"].as_array().unwrap().len(), 3);
    assert_eq!(answer["eigengrasps"].as_array().unwrap().len(), 2);
    for joint in answer["joints"].as_array().unwrap() {
        assert_eq!(keys(joint), ["lower", "mimic", "name", "type", "upper"]);
    }
    assert!(answer["poses"].is_null(), "no posture, no poses");
}

#[test]
fn a_quarter_turn_moves_the_slide_beside_the_bar() {
    let folder = tempfile::tempdir().unwrap();
    let urdf = put(folder.path(), "two_bars.urdf", TWO_BARS);
    let quarter = std::f64::consts::FRAC_PI_2;
    let posture = json!({ "turn": quarter }).to_string();
    let answer = prehend(&["hand", &urdf, "--posture", &posture, "--json"], "").answer();
    assert_eq!(answer["dof"], json!(1));
    assert_eq!(answer["joints"][1]["mimic"]["joint"], json!("turn"));
    let slide = &answer["poses"]["slide"];
    assert_eq!(keys(slide), ["quaternion_wxyz", "translation"]);
    // (1, 0, 0) + Rz(90°) · (1, π/4 + 0.1, 0)
    for (k, expected) in [1.0 - (quarter / 2.0 + 0.1), 1.0, 0.0].into_iter().enumerate() {
        assert_close(&slide["translation"][k], expected);
    }
    for (k, expected) in [0.5_f64.sqrt(), 0.0, 0.0, 0.5_f64.sqrt()].into_iter().enumerate() {
        assert_close(&slide["quaternion_wxyz"][k], expected);
    }
}

#[test]
fn postures_are_answered_line_by_line() {
    let folder = tempfile::tempdir().unwrap();
    let urdf = put(folder.path(), "two_bars.urdf", TWO_BARS);
    let input = "{}\n{\"turn\":3}\n{\"elbow\":0}\n[1]\n{\"turn\":1}\n";
    let run = prehend(&["hand", &urdf, "--postures", "-", "--json"], input);
    assert_eq!(run.status, 1);
    let lines = run.lines();
    assert_close(&lines[0]["poses"]["slide"]["translation"][1], 0.1);
    let error = |i: usize| lines[i]["error"].as_str().unwrap();
    assert!(
        error(1).contains("`turn`") && error(1).contains('2'),
        "{}",
        error(1)
    );
    assert!(
        error(2).contains("`elbow`") && error(2).contains("turn"),
        "{}",
        error(2)
    );
    assert!(error(3).starts_with("standard input, line 4: "), "{}", error(3));
    assert!(lines[4]["poses"].is_object());
}

#[test]
fn hands_of_others_are_read_as_they_are() {
    let hands = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/hands");
    if !std::path::Path::new(hands).is_dir() {
        eprintln!("skipped: hands of others need ../shared/data");
        return;
    }
    for (file, dof) in [
        ("allegro_hand/allegro_hand_right.urdf", 16),
        ("barrett_hand/bhand_model.urdf", 8),
        ("panda_gripper/panda_gripper.urdf", 1),
        ("schunk_sdh/schunk_sdh.urdf", 7),
    ] {
        let answer = prehend(
            &["hand", &format!("{hands}/{file}"), "--posture", "{}", "--json"],
            "",
        )
        .answer();
        assert_eq!(answer["dof"], json!(dof), "{file}");
        assert!(answer["poses"].is_object(), "{file}");
    }
}

#[test]
fn synthesis_accounts_for_every_try_and_gives_the_same_table_twice() {
    let folder = tempfile::tempdir().unwrap();
    let table = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let run = |out: &str| {
        let arguments = [
            "synthesize",
            "--hand",
            SCHUNK,
            "--object",
            MUG,
            "--tries",
            "60",
            "--seed",
            "3",
        ];
        prehend(&[&arguments[..], &["--out", out, "--json"]].concat(), "").answer()
    };
    let (first, second) = (table("a.jsonl"), table("b.jsonl"));
    let answer = run(&first);
    run(&second);
    let rejected: f64 = answer["rejected"].as_object().unwrap().values().map(number).sum();
    assert_close(&answer["tried"], 60.0);
    assert_close(&answer["kept"], 60.0 - rejected);
    assert!(number(&answer["kept"]) > 0.0);
    assert_eq!(std::fs::read(&first).unwrap(), std::fs::read(&second).unwrap());

    let rows = prehend(&["grasps", &first, "--json"], "").lines();
    assert_close(&answer["kept"], rows.len() as f64);
    for row in &rows {
        assert!(number(&row["qeps"]) > 0.0);
        let direction: f64 = ["dir_w", "dir_x", "dir_y", "dir_z"]
            .iter()
            .map(|k| number(&row[*k]).powi(2))
            .sum();
        assert!((direction - 1.0).abs() < 1e-9);
    }
    let few = prehend(&["grasps", &first, "--limit", "2", "--json"], "").lines();
    assert_eq!(few, rows[..2]);

    let labels = table("labels.sqlite");
    let counts = prehend(
        &["label", &first, "--tutor", "scripted", "--out", &labels, "--json"],
        "",
    )
    .answer();
    assert_eq!(counts["grasps"]["mug"], answer["kept"]);
    assert_eq!(keys(&counts["tasks"]), ["hand-over", "pouring", "tool-use"]);
}

#[test]
fn a_grasp_of_the_table_closes_again_where_it_stood() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("g.jsonl");
    let table = table.to_str().unwrap();
    let arguments = [
        "synthesize",
        "--hand",
        SCHUNK,
        "--object",
        MUG,
        "--tries",
        "60",
        "--out",
        table,
        "--json",
    ];
    prehend(&arguments, "").answer();
    let row = prehend(&["grasps", table, "--limit", "1", "--json"], "").answer();
    let joints: serde_json::Map<_, _> = row
        .as_object()
        .unwrap()
        .iter()
        .filter_map(|(k, v)| Some((k.strip_prefix("joint_")?.to_owned(), v.clone())))
        .collect();
    let candidate = json!({
        "pose": {
            "translation": [row["pose_x"], row["pose_y"], row["pose_z"]],
            "quaternion_wxyz": [row["pose_qw"], row["pose_qx"], row["pose_qy"], row["pose_qz"]],
        },
        "joints": joints,
        "approach": false,
    });
    let input =
        format!("{candidate}\n{{\"pose\":{{\"translation\":[0,0,0],\"quaternion_wxyz\":[0,2,0,0]}}}}\n");
    let run = prehend(
        &["close", "--hand", SCHUNK, "--object", MUG, "-", "--json"],
        &input,
    );
    let lines = run.lines();
    assert_eq!(run.status, 1);
    let expected = [
        "contacts",
        "epsilon",
        "fvol",
        "fvol_union",
        "joints",
        "line",
        "penetration",
        "pose",
        "reason",
    ];
    assert_eq!(keys(&lines[0]), expected);
    assert!(number(&lines[0]["epsilon"]) > 0.0, "{}", lines[0]);
    assert!(
        lines[1]["error"].as_str().unwrap().contains("length 2"),
        "{}",
        lines[1]
    );
}
