//! The last word on a posture: exact gaps of all links, and a way back for one that is not clear.
//!
//! Closing looks often enough that no link ends inside an object that is thicker than its steps. Surfaces with holes,
//! walls like paper and hands that start inside an object are what this is for.

use nalgebra::Isometry3;
use prehend_geometry::{Collider, Surface};
use prehend_hand::JointPositions;

use crate::GraspObject;
use crate::closing::{Posture, self_collides};
use crate::first_touch::{CLEARANCE, TOUCH};
use crate::grasp_hand::GraspHand;

/// Depths are exact to this, metres.
const DEPTH_TOLERANCE: f64 = 1e-4;
/// Winding number of what is inside for certain.
const INSIDE: f64 = 0.9;
/// At most so many links are backed off, one after the other.
const MOST_REPAIRS: usize = 8;
/// Halvings of the way back.
const N_HALVINGS: usize = 40;

/// What became of a posture.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Confirmed {
    /// No link overlaps the object.
    Clear,
    /// Some did, and were opened until they touch.
    BackedOff(Posture),
    /// Opening the fingers does not help.
    Stuck,
}

/// Looks at every link of a closed hand once more, and opens those that overlap the object.
pub(crate) fn confirmed(
    hand: &GraspHand<'_>,
    object: &GraspObject,
    object_from_root: &Isometry3<f64>,
    preshape: &JointPositions,
    posture: &Posture,
) -> Confirmed {
    let surface = object.surface();
    let overlapping = |poses: &[Isometry3<f64>]| {
        (0..poses.len()).find(|i| !is_clear(surface, &hand.solids[*i].collider, &poses[*i]))
    };
    let Some(mut solid) = overlapping(&posture.solid_poses) else {
        return Confirmed::Clear;
    };
    let mut joints = posture.joints.clone();
    for _ in 0..MOST_REPAIRS {
        let opened = |share: f64| {
            let mut values = joints.as_slice().to_vec();
            for &(joint, _) in &hand.solid_shares[solid] {
                values[joint] += (preshape.as_slice()[joint] - values[joint]) * share;
            }
            hand.hand.joint_positions_from_slice(&values)
        };
        let pose = |joints: &JointPositions| {
            let at = &hand.solids[solid];
            object_from_root * hand.all_poses(joints)[at.link.0] * at.link_from_solid
        };
        let collider = &hand.solids[solid].collider;
        if !is_clear(surface, collider, &pose(&opened(1.0))) {
            return Confirmed::Stuck;
        }
        let (mut closed, mut open) = (0.0, 1.0);
        for _ in 0..N_HALVINGS {
            let middle = f64::midpoint(closed, open);
            let pose = pose(&opened(middle));
            if !is_clear(surface, collider, &pose) {
                closed = middle;
                continue;
            }
            open = middle;
            if surface.gap(collider, &pose, TOUCH).is_some() {
                break;
            }
        }
        joints = opened(open);
        let solid_poses = hand.solid_poses(object_from_root, &joints);
        match overlapping(&solid_poses) {
            Some(next) => solid = next,
            None if self_collides(hand, &joints) => return Confirmed::Stuck,
            None => return Confirmed::BackedOff(Posture { joints, solid_poses }),
        }
    }
    Confirmed::Stuck
}

/// Whether a solid is apart from the surface, and not wholly inside it.
fn is_clear(surface: &Surface, solid: &Collider, pose: &Isometry3<f64>) -> bool {
    let middle = pose * solid.bounding_ball().center;
    let is_apart = surface.gap_lower_bound(solid, pose) > CLEARANCE
        || surface.gap(solid, pose, CLEARANCE / 2.0).is_none();
    // What an open sheet is bent around counts as half inside: there a link may be.
    let is_inside = || surface.is_inside(&middle) && surface.winding_number(&middle).abs() > INSIDE;
    is_apart && !is_inside()
}

/// The deepest (m) that any link reaches into the object: 0 where, by exact gaps, none overlaps it.
///
/// Else more than 0, and exact to 0.1 mm for links that are balls, capsules or convex; of a mesh its corners count.
pub(crate) fn deepest(hand: &GraspHand<'_>, object: &GraspObject, solid_poses: &[Isometry3<f64>]) -> f64 {
    let surface = object.surface();
    let depth = |(solid, pose): (&Collider, &Isometry3<f64>)| {
        if is_clear(surface, solid, pose) {
            return 0.0;
        }
        let below_surface = -surface.signed_gap(solid, pose, DEPTH_TOLERANCE);
        below_surface.max(surface.depth(solid, pose)).max(CLEARANCE)
    };
    let colliders = hand.solids.iter().map(|s| &s.collider);
    colliders.zip(solid_poses).map(depth).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use prehend_hand::Hand;

    use super::*;
    use crate::closing::close_fingers;
    use crate::testing::boxes_object;

    fn schunk() -> Hand {
        let urdf = include_str!("../../../hands/schunk_sdh/schunk_sdh.urdf");
        let hand = Hand::from_urdf(urdf, &|file| Err(file.to_owned())).unwrap();
        hand.with_description(include_str!("../../../hands/schunk_sdh/hand.toml"))
            .unwrap()
    }

    /// The hand around a bar along y, 0.12 m in front of its root.
    fn closed(hand: &GraspHand<'_>) -> (GraspObject, Isometry3<f64>, JointPositions, Posture) {
        let bar = boxes_object(&[([0.0, 0.0, 0.0], [0.04, 0.2, 0.04])]);
        let object_from_root = Isometry3::translation(0.0, 0.0, -0.15);
        let preshape = hand.hand.preshape([0.0, 0.0]);
        let posture = close_fingers(hand, &bar, &object_from_root, &preshape).unwrap();
        (bar, object_from_root, preshape, posture)
    }

    #[test]
    fn what_closing_ends_in_is_clear_and_a_finger_that_is_pushed_in_is_brought_back_to_touch() {
        let hand = schunk();
        let model = GraspHand::new(&hand).unwrap();
        let (bar, object_from_root, preshape, posture) = closed(&model);
        let verdict = confirmed(&model, &bar, &object_from_root, &preshape, &posture);
        assert_eq!(verdict, Confirmed::Clear);
        assert_eq!(deepest(&model, &bar, &posture.solid_poses), 0.0);
        let mut values = posture.joints.as_slice().to_vec();
        for (joint, node) in model.joints().iter().enumerate() {
            values[joint] += 0.03 * node.speed;
        }
        let joints = hand.joint_positions_from_slice(&values);
        let solid_poses = model.solid_poses(&object_from_root, &joints);
        let pushed = Posture { joints, solid_poses };
        let depth = deepest(&model, &bar, &pushed.solid_poses);
        assert!(depth > 5e-4 && depth < 0.01, "{depth}");
        let Confirmed::BackedOff(back) = confirmed(&model, &bar, &object_from_root, &preshape, &pushed)
        else {
            panic!("fingers can open");
        };
        assert_eq!(deepest(&model, &bar, &back.solid_poses), 0.0);
        let touches = |i: usize| {
            let gap = bar
                .surface()
                .gap(&model.solids[i].collider, &back.solid_poses[i], TOUCH);
            gap.is_some()
        };
        assert!((0..model.solids.len()).any(touches));
    }

    #[test]
    fn a_palm_inside_the_object_is_stuck_as_deep_as_it_is() {
        let hand = schunk();
        let model = GraspHand::new(&hand).unwrap();
        let block = boxes_object(&[([0.0; 3], [0.6, 0.6, 0.6])]);
        let inside = Isometry3::identity();
        let preshape = hand.preshape([0.0, 0.0]);
        let solid_poses = model.solid_poses(&inside, &preshape);
        let depth = deepest(&model, &block, &solid_poses);
        assert!(depth > 0.29 && depth < 0.3 + 1e-9, "{depth}");
        let posture = Posture {
            joints: preshape.clone(),
            solid_poses,
        };
        let verdict = confirmed(&model, &block, &inside, &preshape, &posture);
        assert_eq!(verdict, Confirmed::Stuck);
    }
}
