//! Hands, also those made by others as they come: read, and posed where another program poses them.

mod common;

use std::collections::BTreeMap;

use common::{HANDS, read_urdf};
use nalgebra::Matrix3x4;
use prehend_geometry::Solid;
use prehend_hand::Hand;

const SHARED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/hands");

/// Whether the shared hands are there; says so where they are not.
fn shared(what: &str) -> bool {
    let there = std::path::Path::new(SHARED).exists();
    if !there {
        eprintln!("skipped: {what} needs ../shared/data");
    }
    there
}

#[test]
fn the_shared_hands_are_read_as_they_are() {
    if !shared("reading foreign hands") {
        return;
    }
    for (path, n_dof, n_joints, n_warnings) in [
        ("allegro_hand/allegro_hand_right.urdf", 16, 16, 0),
        ("barrett_hand/bhand_model.urdf", 8, 8, 0),
        ("panda_gripper/panda_gripper.urdf", 1, 2, 0),
        ("schunk_sdh/schunk_sdh.urdf", 7, 8, 0),
    ] {
        let hand = read_urdf(&format!("{SHARED}/{path}"));
        assert_eq!((hand.n_dof(), hand.joints().len()), (n_dof, n_joints), "{path}");
        assert!(hand.links().iter().any(|l| !l.collision.is_empty()), "{path}");
        assert_eq!(hand.warnings().len(), n_warnings, "{path}: {:?}", hand.warnings());
    }
    let allegro = read_urdf(&format!("{SHARED}/allegro_hand/allegro_hand_right.urdf"));
    let tip = allegro
        .link_named("link_3.0_tip")
        .expect("the hand has fingertips");
    assert!(
        matches!(allegro.link(tip).collision[0].solid, Solid::Hull(_)),
        "its fingertips are convex"
    );
}

/// Numbers from yourdfpy 0.0.60, see `oracle/link_poses.py`.
#[test]
fn every_link_stands_where_another_program_puts_it() {
    #[derive(serde::Deserialize)]
    struct Posture {
        kind: String,
        urdf: String,
        joints: BTreeMap<String, f64>,
        poses: BTreeMap<String, Vec<f64>>,
    }
    let postures: Vec<Posture> =
        serde_json::from_str(include_str!("oracle/link_poses.json")).expect("valid JSON");
    let shared = shared("comparing the poses of foreign hands");
    let mut n_poses = 0;
    for posture in &postures {
        let folder = match posture.kind.as_str() {
            "bundled" => HANDS,
            _ if shared => SHARED,
            _ => continue,
        };
        let hand = read_urdf(&format!("{folder}/{}", posture.urdf));
        n_poses += compare(&hand, &posture.joints, &posture.poses);
    }
    assert!(n_poses >= 3 * (26 + 10), "{n_poses} poses compared");
}

fn compare(hand: &Hand, joints: &BTreeMap<String, f64>, expected: &BTreeMap<String, Vec<f64>>) -> usize {
    let positions = hand.positions(joints).expect("postures are within limits");
    let poses = hand.link_poses(&positions);
    assert_eq!(expected.len(), hand.links().len());
    for (name, rows) in expected {
        let link = hand.link_named(name).unwrap_or_else(|| panic!("no link {name}"));
        let pose = poses.root_from_link(link);
        let matrix = pose.to_homogeneous().fixed_rows::<3>(0).into_owned();
        let error = (matrix - Matrix3x4::from_row_slice(rows)).abs().max();
        assert!(error < 1e-9, "{}, {name}: {error} off", hand.name());
        let alone = hand.link_pose(link, &positions);
        assert!((alone.to_homogeneous() - pose.to_homogeneous()).abs().max() < 1e-12);
    }
    expected.len()
}
