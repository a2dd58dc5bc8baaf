//! Fingers whose joints are coupled: a rigid coupling stops as one, one that lets go closes on.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Rotation3, Vector3};
use prehend_geometry::{OrientedBox, Solid};
use prehend_grasp::{CloseOptions, Closed, GraspObject, close};
use prehend_hand::Hand;
use prehend_quality::Material;

/// A palm with two fingers along z, 80 mm apart, each of two links; the outer joint turns with the inner one.
fn hand(break_away: &str) -> Hand {
    let finger = |name: &str, x: f64, axis: f64| {
        format!(
            r#"<link name="{name}_inner"><collision><origin xyz="0 0 0.03"/><geometry><box size="0.01 0.02 0.05"/></geometry></collision></link>
<link name="{name}_outer"><collision><origin xyz="0 0 0.0125"/><geometry><box size="0.01 0.02 0.02"/></geometry></collision></link>
<joint name="{name}" type="revolute"><parent link="palm"/><child link="{name}_inner"/><origin xyz="{x} 0 0"/><axis xyz="0 {axis} 0"/>
<limit lower="0" upper="1.5" effort="1" velocity="1"/></joint>
<joint name="{name}_coupled" type="revolute"><parent link="{name}_inner"/><child link="{name}_outer"/><origin xyz="0 0 0.06"/><axis xyz="0 {axis} 0"/>
<limit lower="0" upper="1.5" effort="1" velocity="1"/><mimic joint="{name}" multiplier="0.5"/></joint>"#
        )
    };
    let urdf = format!(
        r#"<robot name="pincer"><link name="palm"><collision><origin xyz="0 0 -0.02"/><geometry><box size="0.1 0.05 0.02"/></geometry></collision></link>
{}{}</robot>"#,
        finger("left", -0.04, 1.0),
        finger("right", 0.04, -1.0)
    );
    let description = format!(
        r#"
opening_width = 0.07
contact_links = ["left_inner", "left_outer", "right_inner", "right_outer"]
break_away = [{break_away}]
palm = {{ link = "palm", translation = [0, 0, -0.01], approach = [0, 0, 1], closing = [1, 0, 0] }}
material = {{ default = "rubber" }}
closing = {{ left = 1, right = 1 }}
origin = {{}}
finger = [
  {{ name = "left", joints = ["left", "left_coupled"], links = ["left_inner", "left_outer"] }},
  {{ name = "right", joints = ["right", "right_coupled"], links = ["right_inner", "right_outer"] }},
]
[[eigengrasp]]
name = "spread"
limits = [-0.1, 0.1]
direction = {{ left = 1 }}
[[eigengrasp]]
name = "extension"
limits = [-0.1, 0.1]
direction = {{ right = -1 }}
"#
    );
    let hand = Hand::from_urdf(&urdf, &|file| Err(file.to_owned())).unwrap();
    hand.with_description(&description).unwrap()
}

/// A block between the fingers that their inner links meet first.
fn closed(hand: &Hand) -> Closed {
    let half = Vector3::new(0.025, 0.02, 0.02);
    let at = Isometry3::translation(0.0, 0.0, 0.035);
    let mesh = Solid::Cuboid { half_extents: half }
        .display_mesh()
        .transformed(&at);
    let region = OrientedBox::new(at.translation.vector.into(), Rotation3::identity(), half * 2.0).unwrap();
    let block = GraspObject::from_boxes(mesh, region, vec![region], &[], None, Material::Plastic).unwrap();
    let open = hand.positions(&BTreeMap::new()).unwrap();
    close(
        hand,
        &block,
        &Isometry3::identity(),
        &open,
        &CloseOptions::default(),
    )
    .unwrap()
}

fn joint(hand: &Hand, closed: &Closed, name: &str) -> f64 {
    closed.joints.get(hand.joint_named(name).unwrap())
}

#[test]
fn a_rigid_coupling_stops_together() {
    let hand = hand("");
    let closed = closed(&hand);
    let touching: Vec<&str> = closed
        .contacts
        .iter()
        .map(|c| hand.link(c.link).name.as_str())
        .collect();
    assert!(touching.iter().all(|l| l.ends_with("inner")), "{touching:?}");
    for side in ["left", "right"] {
        let (inner, outer) = (
            joint(&hand, &closed, side),
            joint(&hand, &closed, &format!("{side}_coupled")),
        );
        assert!(
            inner > 0.1 && (outer - 0.5 * inner).abs() < 1e-12,
            "{side}: {inner} {outer}"
        );
    }
}

#[test]
fn a_coupling_that_lets_go_closes_on_until_its_link_touches() {
    let hand = hand(r#""left_coupled", "right_coupled""#);
    let closed = closed(&hand);
    let touching: Vec<&str> = closed
        .contacts
        .iter()
        .map(|c| hand.link(c.link).name.as_str())
        .collect();
    assert!(
        touching.contains(&"left_outer") && touching.contains(&"right_outer"),
        "{touching:?}"
    );
    for side in ["left", "right"] {
        let (inner, outer) = (
            joint(&hand, &closed, side),
            joint(&hand, &closed, &format!("{side}_coupled")),
        );
        assert!(outer > 0.5 * inner + 0.3, "{side}: {inner} {outer}");
    }
    // The posture stands for itself: read back by name, nothing is put elsewhere.
    let again = hand.positions(&hand.positions_by_name(&closed.joints)).unwrap();
    assert_eq!(again, closed.joints);
    // A pre-shape has its joints coupled, whatever the fingers do later.
    let preshape = hand.preshape([1.0, 0.0]);
    let at = |name: &str| preshape.get(hand.joint_named(name).unwrap());
    assert!((at("left_coupled") - 0.5 * at("left")).abs() < 1e-12);
}
