//! `hand init`: from a URDF to a folder that grasps and can be moved.

use std::fs;
use std::path::Path;

use prehend::hand_folder::read_described_hand;
use prehend::hand_init::init;

const SHARED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/hands");
const JAW: &str = "OFF\n8 12 0\n-0.01 0 0\n0.01 0 0\n0.01 0.01 0\n-0.01 0.01 0\n-0.01 0 0.06\n0.01 0 0.06\n0.01 0.01 0.06\n-0.01 0.01 0.06\n\
    3 0 2 1\n3 0 3 2\n3 4 5 6\n3 4 6 7\n3 0 1 5\n3 0 5 4\n3 1 2 6\n3 1 6 5\n3 2 3 7\n3 2 7 6\n3 3 0 4\n3 3 4 7\n";

/// A package with two jaws, whose URDF names its mesh as ROS does.
fn package(root: &Path, shape: &str) -> std::path::PathBuf {
    fs::create_dir_all(root.join("jaws/urdf")).unwrap();
    fs::create_dir_all(root.join("jaws/meshes/visual")).unwrap();
    fs::write(root.join("jaws/meshes/visual/jaw.off"), JAW).unwrap();
    let mesh = |turn: &str| {
        format!(
            r#"<{shape}><origin rpy="0 0 {turn}"/><geometry><mesh filename="package://jaws/meshes/visual/jaw.off"/></geometry></{shape}>"#
        )
    };
    let (left, right) = (mesh("0"), mesh("3.141592653589793"));
    let urdf = format!(
        r#"<robot name="jaws"><link name="plate"><{shape}><geometry><box size="0.04 0.12 0.02"/></geometry></{shape}></link>
        <link name="left">{left}</link><link name="right">{right}</link>
        <joint name="l" type="prismatic"><parent link="plate"/><child link="left"/>
            <origin xyz="0 0 0.011"/><axis xyz="0 1 0"/><limit lower="0" upper="0.05" effort="1" velocity="1"/></joint>
        <joint name="r" type="prismatic"><parent link="plate"/><child link="right"/>
            <origin xyz="0 0 0.011"/><axis xyz="0 -1 0"/><limit lower="0" upper="0.05" effort="1" velocity="1"/>
            <mimic joint="l"/></joint></robot>"#
    );
    let path = root.join("jaws/urdf/jaws.urdf");
    fs::write(&path, urdf).unwrap();
    path
}

#[test]
fn the_folder_written_can_be_moved_and_is_not_overwritten_unasked() {
    let root = tempfile::tempdir().unwrap();
    let urdf = package(&root.path().join("source"), "collision");
    let out = root.path().join("hands/jaws");
    let made = init(&urdf, &out, None, false).unwrap();
    assert_eq!(made.files, ["hand.toml", "jaws.urdf", "meshes/jaw.off"]);
    // Moved, and the source gone.
    fs::remove_dir_all(root.path().join("source")).unwrap();
    let moved = root.path().join("elsewhere");
    fs::rename(&out, &moved).unwrap();
    let hand = read_described_hand(&moved).unwrap();
    assert_eq!(hand.description(), made.hand.description());

    let urdf = moved.join("jaws.urdf");
    let before = fs::read(moved.join("hand.toml")).unwrap();
    let refused = init(&urdf, &moved, None, false).unwrap_err().to_string();
    assert!(
        refused.ends_with("hand.toml: is there already; give another --out, or --force to write a new one"),
        "{refused}"
    );
    // In place, URDF and meshes stay.
    let text = fs::read(&urdf).unwrap();
    let again = init(&urdf, &moved, None, true).unwrap();
    assert_eq!(again.files, ["hand.toml"]);
    assert_eq!(
        (
            fs::read(&urdf).unwrap(),
            fs::read(moved.join("hand.toml")).unwrap()
        ),
        (text, before)
    );
}

#[test]
fn pictures_serve_as_shapes_where_a_urdf_has_no_others() {
    let root = tempfile::tempdir().unwrap();
    let urdf = package(root.path(), "visual");
    let made = init(&urdf, &root.path().join("out"), None, false).unwrap();
    assert!(
        made.notes[0].starts_with("no link has a <collision>"),
        "{:?}",
        made.notes
    );
    let hand = read_described_hand(&root.path().join("out")).unwrap();
    assert!(hand.links().iter().all(|l| l.collision.len() == 1));
}

#[test]
fn a_missing_mesh_is_named_and_nothing_is_written() {
    let root = tempfile::tempdir().unwrap();
    let urdf = package(root.path(), "collision");
    fs::remove_file(root.path().join("jaws/meshes/visual/jaw.off")).unwrap();
    let out = root.path().join("out");
    let error = init(&urdf, &out, None, false).unwrap_err().to_string();
    assert!(
        error.contains("jaws.urdf: link `left`: mesh `package://jaws/meshes/visual/jaw.off` cannot be had: "),
        "{error}"
    );
    assert!(!out.exists());
}

#[test]
fn shared_hands_come_out_whole() {
    if !Path::new(SHARED).exists() {
        eprintln!("skipped: hand folders of other hands needs ../shared/data");
        return;
    }
    let root = tempfile::tempdir().unwrap();
    for urdf in [
        "allegro_hand/allegro_hand_right.urdf",
        "barrett_hand/bhand_model.urdf",
        "panda_gripper/panda_gripper.urdf",
        "schunk_sdh/schunk_sdh.urdf",
    ] {
        let out = root.path().join(urdf.split('/').next().unwrap());
        init(&Path::new(SHARED).join(urdf), &out, None, false).unwrap();
        let hand = read_described_hand(&out).unwrap();
        assert_eq!(hand.warnings(), [] as [&str; 0], "{urdf}");
    }
}
