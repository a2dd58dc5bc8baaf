//! `grasps` and `export`: every filter, every format. The files of a made-up gripper on a box are pinned as text.

mod common;

use std::fs;
use std::path::Path;

use common::{Run, number, prehend, put};
use serde_json::Value;

/// A palm with two jaws that slide apart along y.
const GRIPPER: &str = r#"<robot name="jaws">
  <link name="palm"><collision><origin xyz="0 0 -0.01"/><geometry><box size="0.04 0.12 0.02"/></geometry></collision></link>
  <link name="left"><collision><origin xyz="0 0.005 0.03"/><geometry><box size="0.02 0.01 0.06"/></geometry></collision></link>
  <link name="right"><collision><origin xyz="0 -0.005 0.03"/><geometry><box size="0.02 0.01 0.06"/></geometry></collision></link>
  <joint name="open" type="prismatic"><parent link="palm"/><child link="left"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="0.05" effort="50" velocity="1"/></joint>
  <joint name="open_too" type="prismatic"><parent link="palm"/><child link="right"/><axis xyz="0 -1 0"/>
    <limit lower="0" upper="0.05" effort="50" velocity="1"/><mimic joint="open"/></joint>
</robot>"#;

const GRIPPER_TOML: &str = r#"urdf = "jaws.urdf"
opening_width = 0.1
contact_links = ["palm", "left", "right"]
self_collision_exempt = []
[palm]
link = "palm"
translation = [0.0, 0.0, 0.0]
approach = [0.0, 0.0, 1.0]
closing = [0.0, 1.0, 0.0]
[material]
default = "plastic"
[material.links]
left = "rubber"
right = "rubber"
[[finger]]
name = "left"
joints = ["open"]
links = ["left"]
[[finger]]
name = "right"
joints = ["open_too"]
links = ["right"]
[closing]
open = -1.0
[origin]
open = 0.04
[[eigengrasp]]
name = "spread"
limits = [-0.01, 0.01]
[eigengrasp.direction]
open = 1.0
[[eigengrasp]]
name = "extension"
limits = [-0.01, 0.01]
[eigengrasp.direction]
open = 1.0
"#;

/// A box of 60 × 40 × 100 mm, its middle at the origin.
const BOX: &str = "OFF\n8 6 0\n-0.03 -0.02 -0.05\n0.03 -0.02 -0.05\n0.03 0.02 -0.05\n-0.03 0.02 -0.05\n\
    -0.03 -0.02 0.05\n0.03 -0.02 0.05\n0.03 0.02 0.05\n-0.03 0.02 0.05\n\
    4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n";

/// A folder with gripper, box, and a table of two grasps: jaws square to the box, and a single contact that cannot balance.
fn table(folder: &Path) -> String {
    let hand = folder.join("jaws");
    fs::create_dir(&hand).unwrap();
    put(&hand, "jaws.urdf", GRIPPER);
    put(&hand, "hand.toml", GRIPPER_TOML);
    let mesh = put(folder, "box.off", BOX);
    put(
        folder,
        "box.toml",
        "type = \"box\"\nmass = 0.2\nmetres_per_unit = 1.0\ncenter_of_mass = [0.0, 0.0, 0.0]\n",
    );
    let contact = |link: &str, x: f64, y: f64, z: f64| {
        let normal = [0.0, if y > 0.0 { -1.0 } else { 1.0 }, 0.0];
        serde_json::json!({ "link": link, "point": [x, y, z], "normal": normal, "mu": 1.0, "torsion": 0.002 })
    };
    let mut four = Vec::new();
    for (link, y) in [("left", -0.02), ("right", 0.02)] {
        for x in [-0.01, 0.01] {
            four.push(contact(link, x, y, 0.04));
            four.push(contact(link, x, y, 0.06));
        }
    }
    let row = |number: usize, epsilon: f64, contacts: &[Value]| {
        // The hand comes from above, half a turn about x: its y points along −y of the object.
        let text = serde_json::json!({
            "grasp_id": format!("jaws/box/{number:06}"), "object": "box", "object_type": "box", "hand": "jaws",
            "seed": 1, "try": number, "egpc_1": 0.0, "egpc_2": 1.0, "qeps": epsilon,
            "pose_x": 0.0, "pose_y": 0.0, "pose_z": 0.1, "pose_qw": 0.0, "pose_qx": 1.0, "pose_qy": 0.0, "pose_qz": 0.0,
            "joint_open": 0.02, "joint_open_too": 0.02,
            "contacts": serde_json::to_string(contacts).unwrap(),
            "center_x": 0.0, "center_y": 0.0, "center_z": 0.0, "torque_scale": 0.0625,
            "mesh": mesh, "hand_path": hand,
        });
        text.to_string() + "\n"
    };
    let rows = row(3, 0.25, &four) + &row(5, 0.125, &four[..1]);
    put(folder, "table.jsonl", &rows)
}

fn export(folder: &Path, table: &str, format: &str) -> (Run, Vec<(String, String)>) {
    let out = folder.join(format);
    let run = prehend(
        &[
            "export",
            table,
            "--format",
            format,
            "--out",
            out.to_str().unwrap(),
            "--json",
        ],
        "",
    );
    let mut files: Vec<(String, String)> = fs::read_dir(&out)
        .unwrap()
        .map(|entry| {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            (name, fs::read_to_string(path).unwrap())
        })
        .collect();
    files.sort();
    (run, files)
}

#[test]
fn files_of_all_five_formats_are_what_they_were() {
    let folder = tempfile::tempdir().unwrap();
    let table = table(folder.path());
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/export");
    for format in ["json", "csv", "moveit", "isaac", "mjcf"] {
        let (run, files) = export(folder.path(), &table, format);
        let answer = run.answer();
        assert_eq!(answer["grasps"], 2);
        let expected = if format == "mjcf" { 2 } else { 1 };
        assert_eq!(files.len(), expected, "{format}");
        if format != "csv" {
            assert_eq!(answer["unbalanced"], 1, "{format}");
        }
        for (name, text) in files {
            // Rows name where the folder was.
            let text = text.replace(folder.path().to_str().unwrap(), "FOLDER");
            let kept = golden.join(&name);
            if std::env::var_os("PREHEND_GOLDEN").is_some() {
                fs::write(&kept, &text).unwrap();
            }
            assert_eq!(text, fs::read_to_string(&kept).unwrap_or_default(), "{name}");
        }
    }
}

#[test]
fn a_balanced_squeeze_presses_both_jaws_with_half_the_grip() {
    let folder = tempfile::tempdir().unwrap();
    let table = table(folder.path());
    let (_, files) = export(folder.path(), &table, "json");
    let file: Value = serde_json::from_str(&files[0].1).unwrap();
    let squeeze = &file["grasps"][0]["squeeze"];
    assert_eq!(squeeze["balanced"], true);
    // Eight contacts share 60 N; the free joint pulls for both jaws: 30 N each, at 5000 N/m, as much as its servo can.
    assert!((number(&squeeze["efforts"]["open"]) + 60.0).abs() < 1e-3);
    assert!((number(&squeeze["targets"]["open"]) - 0.008).abs() < 1e-6);
    let forces = squeeze["forces"].as_array().unwrap();
    let along_y: f64 = forces.iter().map(|f| number(&f["force"][1]).abs()).sum();
    assert!(forces.len() == 8 && (along_y - 60.0).abs() < 1e-3);
    // One contact cannot: the closing joint presses with 0.375 of its servo's 60 N.
    let squeeze = &file["grasps"][1]["squeeze"];
    assert_eq!(
        (&squeeze["balanced"], &squeeze["forces"]),
        (&Value::Bool(false), &Value::Null)
    );
    assert!((number(&squeeze["efforts"]["open"]) + 22.5).abs() < 1e-9);
}

/// The grasp numbers that a filter leaves, in order.
fn left(arguments: &[&str]) -> Vec<String> {
    let mut all = vec!["grasps"];
    all.extend(arguments);
    let run = prehend(&all, "");
    assert_eq!(run.status, 0, "{}", run.stderr);
    let ids = run
        .lines()
        .into_iter()
        .map(|line| line["grasp_id"].as_str().unwrap()[9..].to_owned());
    ids.collect()
}

#[test]
fn every_filter_chooses_its_grasps() {
    let folder = tempfile::tempdir().unwrap();
    let table = table(folder.path());
    let t = table.as_str();
    assert_eq!(left(&[t]), ["000003", "000005"]);
    assert_eq!(left(&[t, "--object", "box"]).len(), 2);
    assert_eq!(left(&[t, "--object", "mug"]).len(), 0);
    assert_eq!(left(&[t, "--hand", "jaws"]).len(), 2);
    assert_eq!(left(&[t, "--hand", "claws"]).len(), 0);
    assert_eq!(left(&[t, "--grasp-id", "jaws/box/000005"]), ["000005"]);
    assert_eq!(left(&[t, "--min-epsilon", "0.2"]), ["000003"]);
    assert_eq!(left(&[t, "--max-epsilon", "0.125"]), ["000005"]);
    assert_eq!(left(&[t, "--top", "1"]), ["000003"]);
    assert_eq!(left(&[t, "--max-epsilon", "0.2", "--top", "1"]), ["000005"]);
    assert_eq!(left(&[t, "--limit", "1"]), ["000003"]);
    let csv = prehend(&["grasps", t, "--format", "csv", "--limit", "1"], "");
    assert_eq!(csv.stdout.lines().count(), 2);
    assert!(csv.stdout.starts_with("center_x,"), "{}", csv.stdout);
    let out = folder.path().join("best.parquet");
    let written = prehend(
        &[
            "grasps",
            t,
            "--top",
            "1",
            "--out",
            out.to_str().unwrap(),
            "--json",
        ],
        "",
    );
    assert_eq!(written.answer()["rows"], 1);
    assert_eq!(left(&[out.to_str().unwrap()]), ["000003"]);
}

#[test]
fn tables_of_several_hands_go_out_together() {
    let folder = tempfile::tempdir().unwrap();
    let first = table(folder.path());
    // The same gripper under other names.
    let text = fs::read_to_string(&first).unwrap();
    let other = text
        .replace("jaws", "claws")
        .replace("joint_open", "joint_spread");
    let second = put(folder.path(), "other.jsonl", &other);
    let hand = folder.path().join("claws");
    fs::create_dir(&hand).unwrap();
    put(
        &hand,
        "jaws.urdf",
        &GRIPPER
            .replace("open", "spread")
            .replace("name=\"jaws\"", "name=\"claws\""),
    );
    put(
        &hand,
        "hand.toml",
        &GRIPPER_TOML
            .replace("\nopen = ", "\nspread = ")
            .replace("[\"open", "[\"spread"),
    );
    let out = folder.path().join("both");
    for format in ["json", "csv", "moveit"] {
        let run = prehend(
            &[
                "export",
                &first,
                &second,
                "--format",
                format,
                "--out",
                out.to_str().unwrap(),
                "--json",
            ],
            "",
        );
        let answer = run.answer();
        assert_eq!(
            (&answer["grasps"], answer["files"].as_array().unwrap().len()),
            (&Value::from(4), 2)
        );
    }
    let csv = fs::read_to_string(out.join("claws_box.csv")).unwrap();
    assert!(
        csv.contains("joint_spread") && !csv.contains("joint_open"),
        "{csv}"
    );
    assert_eq!(left(&[&first, &second, "--hand", "claws"]).len(), 2);
}

#[test]
fn labels_choose_grasps_by_task_and_persona() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (table, labels) = (at("t.parquet"), at("l.sqlite"));
    let made = prehend(
        &[
            "synthesize",
            "--hand",
            "hands/schunk_sdh",
            "--object",
            "objects/mug/coffee_mug.ply",
            "--tries",
            "150",
            "--out",
            &table,
            "--json",
        ],
        "",
    );
    assert_eq!(made.status, 0, "{}", made.stderr);
    for persona in ["strict", "lenient"] {
        let run = prehend(
            &[
                "label",
                &table,
                "--tutor",
                "scripted",
                "--persona",
                persona,
                "--out",
                &labels,
                "--json",
            ],
            "",
        );
        assert_eq!(run.status, 0, "{}", run.stderr);
    }
    let all = left(&[&table]).len();
    let suited = |more: &[&str]| left(&[&[table.as_str(), "--labels", &labels], more].concat()).len();
    let (strict, lenient) = (
        suited(&["--task", "hand-over"]),
        suited(&["--task", "hand-over", "--persona", "lenient"]),
    );
    assert!(
        0 < strict && strict <= lenient && lenient <= all,
        "{strict} {lenient} {all}"
    );
    let failed = |more: &[&str]| {
        let run = prehend(
            &[&["grasps", table.as_str(), "--labels", &labels][..], more].concat(),
            "",
        );
        assert_eq!(run.status, 1);
        run.stderr
    };
    assert!(
        failed(&["--task", "juggling"])
            .contains("holds no labels of persona `strict` for task `juggling`; it has hand-over")
    );
    assert!(failed(&["--task", "pouring", "--persona", "nobody"]).contains("none of that persona"));
}

#[test]
fn what_cannot_be_exported_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let table = table(folder.path());
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    let text = fs::read_to_string(&table).unwrap();
    let bad = |name: &str, from: &str, to: &str| put(folder.path(), name, &text.replacen(from, to, 1));
    for (file, more, expected) in [
        (
            table.clone(),
            &["--object", "mug"][..],
            "no grasp is left by the filters",
        ),
        (
            folder.path().join("none.parquet").to_str().unwrap().to_owned(),
            &[],
            "is not there",
        ),
        (
            put(folder.path(), "notes.txt", "?"),
            &[],
            "is no table; use .parquet, .csv or .jsonl",
        ),
        (
            bad("a.jsonl", "\"pose_qx\":1.0", "\"pose_qx\":0.5"),
            &[],
            "is no unit quaternion",
        ),
        (
            bad("b.jsonl", "\"joint_open\":0.02,", ""),
            &[],
            "joint_open is missing",
        ),
        (
            bad(
                "c.jsonl",
                "\\\"link\\\":\\\"left\\\"",
                "\\\"link\\\":\\\"wrist\\\"",
            ),
            &[],
            "has no link `wrist`",
        ),
        (
            bad("d.jsonl", "\\\"mu\\\":1.0", "\\\"mu\\\":-1.0"),
            &[],
            "friction coefficient mu = -1",
        ),
    ] {
        let mut arguments = vec!["export", file.as_str(), "--format", "json", "--out", out];
        arguments.extend(more);
        let run = prehend(&arguments, "");
        assert_eq!(run.status, 1, "{file}: {}", run.stderr);
        assert!(run.stderr.contains(expected), "{file}: {}", run.stderr);
    }
    for arguments in [
        &["export", &table, "--format", "stl", "--out", out][..],
        &["export", &table, "--format", "json"],
        &["export", &table, "--format", "json", "--out", out, "--grip", "-5"],
        &["grasps", &table, "--task", "pouring"],
        &["grasps", &table, "--min-epsilon", "much"],
        &["grasps", &table, "--top", "-1"],
        &["grasps"],
    ] {
        assert_eq!(prehend(arguments, "").status, 2, "{arguments:?}");
    }
}
