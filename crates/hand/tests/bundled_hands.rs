//! The bundled hands are what their READMEs say: frames, directions of the eigengrasps, opening width.

mod common;

use std::collections::BTreeMap;

use common::bundled;
use nalgebra::{Isometry3, Point3, Vector3};
use prehend_geometry::{Collider, PlacedSolid, Solid};
use prehend_hand::{Hand, JointPositions, LinkIdx, LinkPoses};

const BUNDLED: [&str; 2] = ["human", "schunk_sdh"];

fn origin_of(hand: &Hand, link: &str, positions: &JointPositions) -> Point3<f64> {
    let link = hand.link_named(link).unwrap_or_else(|| panic!("no link {link}"));
    hand.link_poses(positions)
        .root_from_link(link)
        .translation
        .vector
        .into()
}

fn assert_at(hand: &Hand, link: &str, positions: &JointPositions, expected_mm: [f64; 3], tolerance_mm: f64) {
    let at = 1000.0 * origin_of(hand, link, positions).coords;
    let off = (at - Vector3::from(expected_mm)).norm();
    assert!(
        off < tolerance_mm,
        "{link} is at {at:?} mm, {off} mm off {expected_mm:?}"
    );
}

/// From notes on the published kinematic table, computed there by other code, three decimals of a millimetre.
#[test]
fn the_human_hand_reproduces_its_table_at_zero() {
    let hand = bundled("human");
    assert_eq!(hand.n_dof(), 20);
    let zero = hand.positions(&BTreeMap::new()).unwrap();
    assert_at(&hand, "index_tip", &zero, [-238.16, 11.205, 36.416], 0.002);
    assert_at(&hand, "middle_tip", &zero, [-252.052, 11.205, 8.404], 0.002);
    assert_at(&hand, "ring_tip", &zero, [-237.572, 5.602, -19.608], 0.002);
    assert_at(&hand, "little_tip", &zero, [-208.628, -8.404, -42.018], 0.002);
    // The thumb's base rotation is known to four digits only.
    assert_at(&hand, "thumb_distal", &zero, [-128.672, -47.423, 54.0], 0.02);
}

/// The same source, at the origin of its six-vector eigengrasp set: fingers and thumb bent.
#[test]
fn the_human_hand_reproduces_its_table_when_bent() {
    let hand = bundled("human");
    #[rustfmt::skip]
    let values = [
        0.19197, 0.47323, 0.67992, 0.27881, 0.0, 0.49347, 0.82186, 0.25013, -0.2005, 0.5056, 0.72864, 0.39479,
        -0.29755, 0.42906, 0.35904, 0.19415, 0.10917, -0.74088, 0.73897, 0.046224,
    ];
    let bent = hand.joint_positions_from_slice(&values);
    assert_at(&hand, "index_tip", &bent, [-193.011, -60.605, 46.707], 0.002);
    assert_at(&hand, "middle_tip", &bent, [-194.337, -69.863, 8.404], 0.002);
    assert_at(&hand, "ring_tip", &bent, [-186.968, -64.505, -28.003], 0.002);
    assert_at(&hand, "little_tip", &bent, [-186.979, -55.07, -58.124], 0.002);
    assert_at(&hand, "thumb_distal", &bent, [-95.26, -78.945, 45.717], 0.02);
}

#[test]
fn the_schunk_hand_reproduces_its_table() {
    let hand = bundled("schunk_sdh");
    assert_eq!(hand.n_dof(), 7);
    assert_eq!(hand.joints().len(), 8);
    let zero = hand.positions(&BTreeMap::new()).unwrap();
    assert_at(&hand, "finger_1_distal", &zero, [19.05, 33.0, 177.5], 1e-3);
    assert_at(&hand, "finger_2_distal", &zero, [19.05, -33.0, 177.5], 1e-3);
    assert_at(&hand, "thumb_distal", &zero, [-38.11, 0.0, 177.5], 1e-3);
    let origin = &hand.description().unwrap().origin;
    assert_at(&hand, "finger_1_distal", origin, [62.298, 76.648, 151.883], 1e-3);
    assert_at(&hand, "finger_2_distal", origin, [62.298, -76.648, 151.883], 1e-3);
    assert_at(&hand, "thumb_distal", origin, [-99.556, 0.0, 151.883], 1e-3);
}

#[test]
fn every_posture_of_a_preshape_is_within_its_limits() {
    for name in BUNDLED {
        let hand = bundled(name);
        for egpc in grid(5) {
            let positions = hand.preshape(egpc);
            for (joint, q) in hand.joints().iter().zip(positions.as_slice()) {
                assert!(
                    joint.lower <= *q && *q <= joint.upper,
                    "{name} {egpc:?}: {} at {q}",
                    joint.name
                );
            }
            let by_name = hand.positions_by_name(&positions);
            assert_eq!(hand.positions(&by_name).unwrap(), positions);
        }
    }
}

#[test]
fn the_first_eigengrasp_spreads_and_the_second_opens() {
    for name in BUNDLED {
        let hand = bundled(name);
        let description = hand.description().unwrap();
        assert_eq!(description.eigengrasps[0].name, "spread");
        assert_eq!(description.eigengrasps[1].name, "extension");
        // Around the middle, where no joint has reached its limit.
        let (fan_narrow, _) = fan_and_opening(&hand, [-0.2, 0.0]);
        let (fan_wide, _) = fan_and_opening(&hand, [0.2, 0.0]);
        assert!(
            fan_wide > fan_narrow + 0.01,
            "{name}: the fan goes from {fan_narrow} to {fan_wide} m"
        );
        // Where the hand is open; further closed, fingers pass the thumb, and distance says nothing.
        let (_, closed) = fan_and_opening(&hand, [0.0, 0.3]);
        let (_, open) = fan_and_opening(&hand, [0.0, 0.7]);
        assert!(
            open > closed + 0.01,
            "{name}: the opening goes from {closed} to {open} m"
        );
        for e in &description.eigengrasps {
            assert_eq!(e.direction.len(), hand.n_dof());
            assert!((e.direction.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn closing_moves_fingers_and_thumb_towards_each_other_or_the_palm() {
    for name in BUNDLED {
        let hand = bundled(name);
        let open = hand.preshape([0.0, 0.5]);
        let closed = close(&hand, &open, 0.7);
        let (_, wide) = opening(&hand, &open);
        let (_, narrow) = opening(&hand, &closed);
        assert!(narrow < wide - 0.02, "{name}: from {wide} to {narrow} m");
    }
}

/// The number in `hand.toml` is the measured one, to half a centimetre.
///
/// A cylinder of radius r lies on the palm, across its x. Thumb and fingers hold it where their last links stand 2r
/// apart, and reach at least to the height r (1 − sin φ) where the surface leans back by the friction angle φ; soft
/// fingertips have μ = 1, so φ = 45°.
#[test]
fn the_opening_width_agrees_with_the_geometry() {
    let lowest_hold = 1.0 - std::f64::consts::FRAC_PI_4.sin();
    for name in BUNDLED {
        let hand = bundled(name);
        let mut widest = 0.0_f64;
        for egpc in grid(11) {
            let preshape = hand.preshape(egpc);
            for step in 0..20 {
                let (reach, gap) = opening(&hand, &close(&hand, &preshape, 0.1 * f64::from(step)));
                widest = widest.max(gap.min(2.0 * reach / lowest_hold));
            }
        }
        let stated = hand.description().unwrap().opening_width;
        assert!(
            (widest - stated).abs() < 0.005,
            "{name}: hand.toml says {stated} m, the geometry {widest} m"
        );
    }
}

/// The pairs that are exempt from self-collision overlap by construction; the others are free in the open hand.
#[test]
fn links_that_may_overlap_do_and_others_are_apart_at_zero() {
    for name in BUNDLED {
        let hand = bundled(name);
        let description = hand.description().unwrap();
        let colliders: Vec<Vec<(Collider, Isometry3<f64>)>> = hand
            .links()
            .iter()
            .map(|link| {
                let solids = link.collision.iter();
                solids
                    .map(|s| (Collider::new(&s.solid).unwrap(), s.link_from_solid))
                    .collect()
            })
            .collect();
        for egpc in grid(5) {
            let poses = hand.link_poses(&hand.preshape(egpc));
            for &(a, b) in &description.self_collision_exempt {
                if colliders[a.0].is_empty() || colliders[b.0].is_empty() {
                    continue;
                }
                let gap = link_gap(&colliders, &poses, a, b);
                assert!(
                    gap < 0.003,
                    "{name}: {} and {} are {gap} m apart",
                    hand.link(a).name,
                    hand.link(b).name
                );
            }
        }
        let poses = hand.link_poses(&hand.positions(&BTreeMap::new()).unwrap());
        for a in (0..hand.links().len()).map(LinkIdx) {
            for b in (a.0 + 1..hand.links().len()).map(LinkIdx) {
                if !description.is_exempt(a, b) {
                    let gap = link_gap(&colliders, &poses, a, b);
                    assert!(
                        gap > 0.001,
                        "{name}: {} and {} overlap",
                        hand.link(a).name,
                        hand.link(b).name
                    );
                }
            }
        }
    }
}

/// Distance between two links' solids, up to a metre.
fn link_gap(colliders: &[Vec<(Collider, Isometry3<f64>)>], poses: &LinkPoses, a: LinkIdx, b: LinkIdx) -> f64 {
    let mut least = 1.0_f64;
    for (solid, link_from_solid) in &colliders[a.0] {
        for (other, link_from_other) in &colliders[b.0] {
            let solid_from_root = (poses.root_from_link(a) * link_from_solid).inverse();
            let placed = solid_from_root * poses.root_from_link(b) * link_from_other;
            least = least.min(solid.distance_to(other, &placed, least).unwrap_or(least));
        }
    }
    least
}

/// egpc on a regular grid over [−1, 1]².
fn grid(n: i32) -> impl Iterator<Item = [f64; 2]> {
    let at = move |k: i32| 2.0 * f64::from(k) / f64::from(n - 1) - 1.0;
    (0..n).flat_map(move |a| (0..n).map(move |b| [at(a), at(b)]))
}

fn close(hand: &Hand, from: &JointPositions, by: f64) -> JointPositions {
    let mut values = from.as_slice().to_vec();
    for closing in &hand.description().unwrap().closing {
        values[closing.joint.0] += closing.speed * by;
    }
    hand.joint_positions_from_slice(&values)
}

/// Tips of the fingers that oppose, and of the thumb (the finger on the negative side of the palm's x), palm frame.
fn tips(hand: &Hand, positions: &JointPositions) -> (Vec<Point3<f64>>, Point3<f64>) {
    let palm_from_root = hand.root_from_palm(positions).inverse();
    let poses = hand.link_poses(positions);
    let mut fingers = Vec::new();
    let mut thumb = Point3::origin();
    for finger in &hand.description().unwrap().fingers {
        let last = *finger.links.last().unwrap();
        let tip = palm_from_root * poses.root_from_link(last) * far_end(hand, last);
        if finger.name == "thumb" {
            thumb = tip;
        } else {
            fingers.push(tip);
        }
    }
    (fingers, thumb)
}

/// Sum of the distances from fingertip to fingertip, and mean distance from the thumb's tip to them.
fn fan_and_opening(hand: &Hand, egpc: [f64; 2]) -> (f64, f64) {
    let (fingers, thumb) = tips(hand, &hand.preshape(egpc));
    let fan = fingers.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
    let opening = fingers.iter().map(|f| (f - thumb).norm()).sum::<f64>() / fingers.len() as f64;
    (fan, opening)
}

/// How high above the palm the lower of thumb and (mean) fingers reaches, and how wide the gap between their last
/// links is along the palm's x. A cylinder of diameter d that lies on the palm is held behind its widest line where
/// the reach is at least d/2 and the gap at least d.
fn opening(hand: &Hand, positions: &JointPositions) -> (f64, f64) {
    let palm_from_root = hand.root_from_palm(positions).inverse();
    let poses = hand.link_poses(positions);
    let (mut inner, mut reach, mut n) = (0.0, 0.0, 0.0);
    let (mut thumb_inner, mut thumb_reach) = (0.0, 0.0);
    for finger in &hand.description().unwrap().fingers {
        let last = *finger.links.last().unwrap();
        let corners: Vec<Point3<f64>> = hand
            .link(last)
            .collision
            .iter()
            .flat_map(extreme_points)
            .collect();
        let corners = corners
            .iter()
            .map(|p| palm_from_root * poses.root_from_link(last) * p);
        let (mut low, mut high, mut top) = (f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY);
        for p in corners {
            (low, high, top) = (low.min(p.x), high.max(p.x), top.max(p.z));
        }
        if finger.name == "thumb" {
            (thumb_inner, thumb_reach) = (high, top);
        } else {
            (inner, reach, n) = (inner + low, reach + top, n + 1.0);
        }
    }
    (thumb_reach.min(reach / n), inner / n - thumb_inner)
}

/// The point of a link's core that lies farthest from its joint.
fn far_end(hand: &Hand, link: LinkIdx) -> Point3<f64> {
    let points = hand.link(link).collision.iter().flat_map(|placed| {
        let half = match placed.solid {
            Solid::Capsule { half_length, .. } | Solid::Cylinder { half_length, .. } => half_length,
            Solid::Cuboid { half_extents } => half_extents.z,
            _ => 0.0,
        };
        [-half, half].map(|z| placed.link_from_solid * Point3::new(0.0, 0.0, z))
    });
    points
        .max_by(|a, b| a.coords.norm().total_cmp(&b.coords.norm()))
        .expect("the link has a shape")
}

/// Points on a solid's surface, in its link's frame.
fn extreme_points(placed: &PlacedSolid) -> Vec<Point3<f64>> {
    let points: Vec<Point3<f64>> = match placed.solid {
        Solid::Capsule { half_length, radius } => [-half_length, half_length]
            .into_iter()
            .flat_map(|z| sphere_points().map(move |d| Point3::new(0.0, 0.0, z) + radius * d))
            .collect(),
        Solid::Cuboid { half_extents } => (0..8)
            .map(|corner| {
                Point3::from(Vector3::from_fn(|k, _| {
                    half_extents[k] * (f64::from(corner >> k & 1) * 2.0 - 1.0)
                }))
            })
            .collect(),
        _ => Vec::new(),
    };
    points.iter().map(|p| placed.link_from_solid * p).collect()
}

fn sphere_points() -> impl Iterator<Item = Vector3<f64>> {
    let turn = std::f64::consts::TAU / 24.0;
    (0..24).flat_map(move |a| {
        (0..13).map(move |b| {
            let (azimuth, height) = (
                f64::from(a) * turn,
                f64::from(b) * turn - std::f64::consts::FRAC_PI_2,
            );
            Vector3::new(
                height.cos() * azimuth.cos(),
                height.cos() * azimuth.sin(),
                height.sin(),
            )
        })
    })
}
