//! `mesh`, `decompose` and `free-volume` on bodies with closed forms.

use std::fmt::Write;

use serde_json::json;

mod common;

use common::{CUBE, assert_close, keys, number, prehend, put};

#[test]
fn a_cube_of_two_metres_holds_eight_cubic_metres() {
    let folder = tempfile::tempdir().unwrap();
    let cube = put(folder.path(), "cube.off", CUBE);
    let answer = prehend(&["mesh", &cube, "--json"], "").answer();
    assert_eq!(answer["file"], json!(cube));
    assert_eq!(answer["vertices"], json!(8));
    assert_eq!(answer["triangles"], json!(12));
    assert_eq!(answer["watertight"], json!(true));
    assert_close(&answer["volume"], 8.0);
    assert_close(&answer["hull_volume"], 8.0);
    let bounding = &answer["bounding_box"];
    assert_eq!(keys(bounding), ["axes", "center", "extents", "volume"]);
    assert_close(&bounding["volume"], 8.0);
    for k in 0..3 {
        assert_close(&bounding["extents"][k], 2.0);
        assert_close(&bounding["center"][k], 1.0);
    }
}

#[test]
fn scale_counts_thrice_in_a_volume() {
    let folder = tempfile::tempdir().unwrap();
    let cube = put(folder.path(), "cube.off", CUBE);
    let answer = prehend(&["mesh", "--scale", "0.5", &cube, "--json"], "").answer();
    assert_close(&answer["volume"], 1.0);
    assert_close(&answer["scale"], 0.5);
}

#[test]
fn the_toml_beside_a_mesh_counts_unless_it_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let cube = put(folder.path(), "slab.off", CUBE);
    put(
        folder.path(),
        "slab.toml",
        "metres_per_unit = 0.05\nup = [1, 0, 0]\nfront = [0, 1, 0]\n",
    );
    let answer = prehend(&["mesh", &cube, "--json"], "").answer();
    assert_close(&answer["volume"], 1e-3);
    assert_eq!(answer["scale"], json!(0.05));
    assert_eq!(answer["up"], json!([1.0, 0.0, 0.0]));
    assert_eq!(answer["front"], json!([0.0, 1.0, 0.0]));
    let scaled = prehend(&["mesh", &cube, "--scale", "1", "--json"], "").answer();
    assert_close(&scaled["volume"], 8.0);
    assert_eq!(
        scaled["up"],
        json!([1.0, 0.0, 0.0]),
        "only the scale is overridden"
    );
    let as_is = prehend(&["mesh", &cube, "--as-is", "--json"], "").answer();
    assert_close(&as_is["volume"], 8.0);
    assert_eq!(as_is["up"], json!([0.0, 0.0, 1.0]));
}

#[test]
fn a_mug_of_two_hundred_units_is_in_millimetres_unless_a_flag_says_otherwise() {
    let folder = tempfile::tempdir().unwrap();
    let corner = |(k, line): (usize, &str)| match k {
        2..10 => line.replace('2', "200"),
        _ => line.to_owned(),
    };
    let large: Vec<String> = CUBE.lines().enumerate().map(corner).collect();
    let large = large.join("\n");
    let mug = put(folder.path(), "mug.off", &large);
    let guessed = prehend(&["mesh", &mug, "--json"], "").answer();
    assert_eq!(guessed["scale_from"], json!("guessed"));
    assert_close(&guessed["volume"], 8e-3);
    let told = prehend(&["mesh", "--units", "cm", &mug, "--json"], "").answer();
    assert_eq!(told["scale_from"], json!("flag"));
    assert_close(&told["volume"], 8.0);
    let as_is = prehend(&["mesh", "--as-is", &mug, "--json"], "").answer();
    assert_eq!(as_is["scale_from"], json!("assumed"));
    assert_close(&as_is["volume"], 8e6);
}

#[test]
fn up_and_front_by_flag_turn_a_body() {
    let folder = tempfile::tempdir().unwrap();
    let cube = put(folder.path(), "cube.off", CUBE);
    let answer = prehend(&["mesh", "--up", "y", "--front", "-x", &cube, "--json"], "").answer();
    assert_eq!(answer["up_from"], json!("flag"));
    assert_eq!(answer["front_from"], json!("flag"));
    for (k, middle) in [-1.0, 1.0, 1.0].into_iter().enumerate() {
        assert_close(&answer["bounding_box"]["center"][k], middle);
    }
}

#[test]
fn a_cloud_has_a_hull_but_no_volume() {
    let folder = tempfile::tempdir().unwrap();
    let points = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
    let pcd = format!(
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 4\nHEIGHT 1\n\
         VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 4\nDATA ascii\n{points}"
    );
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nend_header\n{points}"
    );
    let files = [
        put(folder.path(), "c.xyz", points),
        put(folder.path(), "c.pcd", &pcd),
        put(folder.path(), "c.ply", &ply),
    ];
    let run = prehend(&["mesh", &files[0], &files[1], &files[2], "--json"], "");
    assert_eq!(run.status, 0, "{}", run.stderr);
    for (answer, file) in run.lines().iter().zip(&files) {
        assert_eq!(answer["file"], json!(file));
        assert_eq!(answer["triangles"], json!(0));
        assert_eq!(answer["watertight"], json!(false));
        assert_close(&answer["hull_volume"], 1.0 / 6.0);
        assert_close(&answer["volume"], 0.0);
    }
}

#[test]
fn a_mesh_comes_through_standard_input_where_its_format_is_told() {
    let answer = prehend(&["mesh", "-", "--format", "off", "--json"], CUBE).answer();
    assert_close(&answer["volume"], 8.0);
    let run = prehend(&["mesh", "-", "--json"], CUBE);
    assert_eq!(run.status, 1);
    let error = run.lines()[0]["error"].as_str().unwrap().to_owned();
    assert!(error.contains("--format"), "{error}");
}

#[test]
fn a_cube_is_one_box_and_an_l_is_two() {
    let folder = tempfile::tempdir().unwrap();
    let cube = put(folder.path(), "cube.off", CUBE);
    let l = put(
        folder.path(),
        "l.off",
        &prism(&[[0, 0], [4, 0], [4, 1], [1, 1], [1, 4], [0, 4]]),
    );
    let run = prehend(&["decompose", &cube, &l, "--json"], "");
    assert_eq!(run.status, 0, "{}", run.stderr);
    let lines = run.lines();
    assert_eq!(lines[0]["boxes"].as_array().unwrap().len(), 1);
    assert_close(&lines[0]["cvex"], 1.0);
    let boxes = lines[1]["boxes"].as_array().unwrap();
    assert_eq!(boxes.len(), 2, "{}", lines[1]);
    let total: f64 = boxes.iter().map(|b| number(&b["volume"])).sum();
    assert_close(&lines[1]["cvex"], number(&lines[1]["root"]["volume"]) / total);
    assert_eq!(keys(&lines[1]["root"]), ["axes", "center", "extents", "volume"]);
    let few = prehend(&["decompose", &l, "--gain", "0.1", "--json"], "").answer();
    assert_eq!(
        few["boxes"].as_array().unwrap().len(),
        1,
        "a small gain splits less"
    );
    let asked = prehend(&["decompose", &l, "--boxes", "2", "--json"], "").answer();
    // The best two boxes share the corner of the L: their union, not their sum, is what `--boxes` makes small.
    assert_eq!(asked["boxes"].as_array().unwrap().len(), 2);
    assert!(number(&asked["union_volume"]) <= total * 1.001, "{asked}");
    assert_eq!(asked["tree"].as_array().unwrap().len(), 3);
    let picture = folder.path().join("l.png");
    let refined = [
        "decompose",
        &l,
        "--method",
        "refined",
        "--picture",
        picture.to_str().unwrap(),
        "--json",
    ];
    assert_eq!(
        prehend(&refined, "").answer()["boxes"].as_array().unwrap().len(),
        2
    );
    assert!(std::fs::read(&picture).unwrap().starts_with(b"\x89PNG"));
    let both = prehend(&["decompose", &l, &cube, "--picture", "x.png"], "");
    assert_eq!(both.status, 2);
    assert!(
        both.stderr.contains("--picture draws one object; 2 are given"),
        "{}",
        both.stderr
    );
}

#[test]
fn the_boxes_of_a_cloud_hold_its_points_and_the_answer_says_what_it_worked_on() {
    let folder = tempfile::tempdir().unwrap();
    // Points 0.1 apart on two bars that form an L.
    let mut points = String::new();
    for i in 0..=40 {
        for j in 0..=10 {
            for k in 0..=10 {
                let _ = writeln!(
                    points,
                    "{} {} {}",
                    f64::from(i) / 10.0,
                    f64::from(j) / 10.0,
                    f64::from(k) / 10.0
                );
                let _ = writeln!(
                    points,
                    "{} {} {}",
                    f64::from(j) / 10.0,
                    f64::from(i) / 10.0,
                    f64::from(k) / 10.0
                );
            }
        }
    }
    let cloud = put(folder.path(), "l.xyz", &points);
    let mesh = put(
        folder.path(),
        "l.off",
        &prism(&[[0, 0], [4, 0], [4, 1], [1, 1], [1, 4], [0, 4]]),
    );
    let lines = prehend(&["decompose", &cloud, &mesh, "--json"], "").lines();
    assert_eq!(
        (&lines[0]["shape"], &lines[1]["shape"]),
        (&json!("cloud"), &json!("mesh"))
    );
    assert_eq!(lines[0]["boxes"].as_array().unwrap().len(), 2, "{}", lines[0]);
    // A cut between two layers of points leaves the gap of 0.1 to neither side.
    let ratio = number(&lines[0]["cvex"]) / number(&lines[1]["cvex"]);
    assert!((0.999..1.04).contains(&ratio), "{ratio}");
    let picture = folder.path().join("cloud.png");
    let drawn = [
        "decompose",
        &cloud,
        "--picture",
        picture.to_str().unwrap(),
        "--boxes",
        "2",
        "--json",
    ];
    assert_eq!(prehend(&drawn, "").answer()["boxes"].as_array().unwrap().len(), 2);
    assert!(std::fs::read(&picture).unwrap().starts_with(b"\x89PNG"));
}

#[test]
fn a_corner_tetrahedron_leaves_five_sixths_of_a_unit_cube() {
    let cube = r#"[{"center":[0.5,0.5,0.5],"axes":[[1,0,0],[0,1,0],[0,0,1]],"extents":[1,1,1]}]"#;
    let doubled = format!("[{0},{0}]", &cube[1..cube.len() - 1]);
    let input = format!(
        "{{\"tetrahedron\":[[0,0,0],[1,0,0],[0,1,0],[0,0,1]],\"boxes\":{cube}}}\n\
         {{\"palm\":[0,0,0],\"contacts\":[[1,0,0],[0,1,0],[0,0,1]],\"boxes\":{cube}}}\n\n\
         {{\"palm\":[0,0,0],\"contacts\":[[1,0,0],[0,1,0]],\"boxes\":{cube}}}\n\
         {{\"tetrahedron\":[[0,0,0],[1,0,0],[0,1,0],[0,0,1]],\"boxes\":{doubled}}}\n\
         {{\"boxes\":[]}}\n"
    );
    let run = prehend(&["free-volume", "-", "--hull", "--json"], &input);
    assert_eq!(run.status, 1, "the last line fails");
    let lines = run.lines();
    for answer in &lines[..2] {
        assert_close(&answer["tetrahedron"], 1.0 / 6.0);
        assert_close(&answer["occupied"], 1.0 / 6.0);
        assert_close(&answer["per_box"][0], 1.0 / 6.0);
        assert_close(&answer["fvol"], 5.0 / 6.0);
        assert_close(&answer["fvol_union"], 5.0 / 6.0);
    }
    assert_close(&lines[1]["fvol_hull"], 5.0 / 6.0);
    assert_eq!(lines[0].get("fvol_hull"), None, "no contacts to span a hull");
    assert_close(&lines[2]["fvol"], 1.0);
    assert_close(&lines[2]["fvol_hull"], 1.0);
    assert_eq!(
        lines[2]["line"],
        json!(4),
        "empty lines are counted and have no answer"
    );
    assert_close(&lines[3]["occupied"], 2.0 / 6.0);
    assert_close(&lines[3]["fvol"], 5.0 / 6.0);
    assert_close(&lines[3]["fvol_union"], 5.0 / 6.0);
    assert_eq!(keys(&lines[4]), ["error", "line"]);
}

/// The prism of height 1 over a simple polygon that is star-shaped about its first corner, counter-clockwise, as OFF.
fn prism(polygon: &[[i32; 2]]) -> String {
    let n = polygon.len();
    let mut text = format!("OFF\n{} {} 0\n", 2 * n, 4 * n - 4);
    for z in 0..2 {
        for [x, y] in polygon {
            writeln!(text, "{x} {y} {z}").unwrap();
        }
    }
    for i in 1..n - 1 {
        writeln!(text, "3 0 {} {i}\n3 {n} {} {}", i + 1, n + i, n + i + 1).unwrap();
    }
    for i in 0..n {
        let j = (i + 1) % n;
        writeln!(text, "3 {i} {j} {}\n3 {i} {} {}", n + j, n + j, n + i).unwrap();
    }
    text
}
