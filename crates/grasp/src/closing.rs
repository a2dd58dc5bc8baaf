//! The fingers close: each joint until a link on it touches, distal joints going on.

use std::cell::{Cell, RefCell};

use nalgebra::{Isometry3, Point3, Vector3};
use prehend_hand::{JointKind, JointPositions};

use crate::GraspObject;
use crate::approach::{LEAST_STEP, LastTriangles};
use crate::first_touch::{CLEARANCE, Motion, NEAR, TOUCH, Touch, Track, first_touch};
use crate::grasp_hand::{GraspHand, LinkSolid};

/// A link that touches is moved by this much (m) to see whether its gap shrinks.
const PROBE: f64 = 5e-5;
/// It counts as pressing where the gap shrinks by more than this share of the motion.
const PRESSING: f64 = 0.02;
/// No joint turns or slides farther than this while closing, whatever its limits.
const MOST_TRAVEL: f64 = std::f64::consts::TAU;
/// The sine of an angle between axes that count as parallel: descriptions round angles.
const PARALLEL: f64 = 1e-5;
/// By so much such axes turn at most while others turn by [`MOST_TRAVEL`].
const DRIFT: f64 = PARALLEL * MOST_TRAVEL;
/// Links whose bounding balls are farther apart than this need no closer look, metres.
const ROUGH: f64 = 0.02;
/// Distances between links are looked for up to this, metres.
const FAR: f64 = 0.05;
/// A pair that touches this often while sliding along is stopped.
const MOST_TOUCHES: u32 = 8;

/// What closing ends in.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Posture {
    pub(crate) joints: JointPositions,
    /// Poses of all solids, object frame.
    pub(crate) solid_poses: Vec<Isometry3<f64>>,
}

/// Closes the hand where it stands.
///
/// All closing joints move together, each at its speed. When a link comes within [`TOUCH`] of the object and moving on
/// would press it in, every free joint from the root to that link stops; joints beyond it go on. A coupled joint stops
/// with the one that drives it. Two links of different fingers that meet stop each other in the same way: they would
/// hold each other, and the rest of the hand can still close. Joints end at their limits. No link ever overlaps the object.
///
/// `Err` where a link overlaps the object, or another link, at the start: the solid's index, or `n_solids` and more for a pair.
pub(crate) fn close_fingers(
    hand: &GraspHand<'_>,
    object: &GraspObject,
    object_from_root: &Isometry3<f64>,
    preshape: &JointPositions,
) -> Result<Posture, usize> {
    let n_solids = hand.solids.len();
    let n_pairs = n_solids + hand.pairs.len();
    let mut closing = Closing::new(hand, object, *object_from_root, preshape);
    let mut tracks = vec![Track::unknown_at(0.0); n_pairs];
    let mut touches = vec![0u32; n_pairs];
    loop {
        let end = closing.end();
        if end <= closing.s0 {
            break;
        }
        let touch = first_touch(&closing, &mut tracks, closing.s0, end)?;
        let old_speeds: Vec<f64> = (0..n_pairs).map(|i| closing.closing_speed(i)).collect();
        closing.move_to(touch.s);
        if let Some(i) = touch.pair {
            touches[i] += 1;
            let stops = touch.pressed || touches[i] > MOST_TOUCHES || closing.presses(i, &touch);
            if stops {
                closing.stop(i);
            }
            tracks[i].grazing = !stops;
        }
        for (i, track) in tracks.iter_mut().enumerate() {
            track.go_on_from(touch.s, old_speeds[i], &closing, i);
        }
    }
    let joints = hand.hand.joint_positions_from_slice(&closing.q0);
    let solid_poses = (0..n_solids).map(|i| closing.pose(i, closing.s0)).collect();
    Ok(Posture { joints, solid_poses })
}

/// Joints that move together from `q0` at `s0`.
struct Closing<'a> {
    hand: &'a GraspHand<'a>,
    object: &'a GraspObject,
    object_from_root: Isometry3<f64>,
    s0: f64,
    q0: Vec<f64>,
    /// Speed of each free joint; 0 once it has stopped.
    rates: Vec<f64>,
    /// Speed bounds of solids against the object, then of pairs of solids.
    speeds: Vec<f64>,
    /// The last pose of each link that was asked for, object frame. Looks often ask for the same s.
    last_poses: RefCell<Vec<LastPose>>,
    /// For each link, whether it stays where it is.
    still: Vec<bool>,
    near: LastTriangles,
    /// For each joint that moves, the direction of its axis if that stays as it is, object frame; else zero.
    axes: Vec<Vector3<f64>>,
    /// For each pair of solids, what the last look at it saw.
    seen_apart: Vec<Cell<SeenApart>>,
}

/// A unit direction (object frame) along which two solids were seen apart, zero for none, and a bound of how fast their
/// gap along it shrinks.
#[derive(Debug, Clone, Copy)]
struct SeenApart {
    direction: Vector3<f64>,
    closing_speed: f64,
}

/// A link's pose at `s`: infinite where the link stays, not a number where none is known.
#[derive(Clone, Copy)]
struct LastPose {
    s: f64,
    pose: Isometry3<f64>,
}

impl<'a> Closing<'a> {
    fn new(
        hand: &'a GraspHand<'a>,
        object: &'a GraspObject,
        object_from_root: Isometry3<f64>,
        preshape: &JointPositions,
    ) -> Self {
        let rates = hand.joints().iter().map(|j| j.speed).collect();
        let q0 = preshape.as_slice().to_vec();
        let mut closing = Self {
            hand,
            object,
            object_from_root,
            s0: 0.0,
            q0,
            rates,
            speeds: Vec::new(),
            last_poses: RefCell::new(Vec::new()),
            still: Vec::new(),
            near: LastTriangles::new(hand.solids.len()),
            axes: Vec::new(),
            seen_apart: vec![
                Cell::new(SeenApart {
                    direction: Vector3::zeros(),
                    closing_speed: f64::INFINITY
                });
                hand.pairs.len()
            ],
        };
        closing.settle();
        closing
    }

    /// Stops joints at their limits, and works out bounds and poses anew.
    fn settle(&mut self) {
        for (joint, node) in self.hand.joints().iter().enumerate() {
            let at_end = self.travel_left(joint) <= 1e-12;
            if node.leader != joint || at_end {
                self.rates[joint] = 0.0;
            }
        }
        let hand = self.hand;
        let unknown = LastPose {
            s: f64::NAN,
            pose: Isometry3::identity(),
        };
        let last_poses = self.last_poses.get_mut();
        last_poses.clear();
        last_poses.resize(hand.n_links(), unknown);
        let moves = |joint: usize| self.rates[hand.joints()[joint].leader] != 0.0;
        self.still = (0..hand.n_links())
            .map(|link| !hand.joints_to(link).any(moves))
            .collect();
        self.speeds.clear();
        let rates = &self.rates;
        let speed = |shares: &Vec<(usize, f64)>| -> f64 {
            shares.iter().map(|(l, share)| rates[*l].abs() * share).sum()
        };
        self.speeds
            .extend(hand.solid_shares.iter().chain(&hand.pair_shares).map(speed));
        self.axes = (0..self.rates.len())
            .map(|joint| self.steady_axis(joint))
            .collect();
    }

    /// How fast a joint moves, itself or with the one that drives it.
    fn rate(&self, joint: usize) -> f64 {
        let node = &self.hand.joints()[joint];
        self.rates[node.leader] * node.multiplier
    }

    /// The direction of a moving joint's axis, where the moving joints before it turn about parallel axes; else zero.
    fn steady_axis(&self, joint: usize) -> Vector3<f64> {
        let hand = self.hand;
        if self.rate(joint) == 0.0 {
            return Vector3::zeros();
        }
        let axis_of = |joint: usize| hand.axis(joint, |link| self.link_pose(link, self.s0));
        let axis = axis_of(joint);
        let turns_it = |other: usize| {
            self.rate(other) != 0.0
                && hand.joints()[other].kind != JointKind::Prismatic
                && axis_of(other).cross(&axis).norm() > PARALLEL
        };
        let child = hand.hand.joints()[joint].child.0;
        if hand.joints_to(child).any(turns_it) {
            Vector3::zeros()
        } else {
            axis
        }
    }

    /// A bound of how fast the gap of two solids along a direction shrinks: a turning joint moves no point along its axis.
    fn speed_along(&self, pair: usize, direction: &Vector3<f64>) -> f64 {
        if *direction == Vector3::zeros() {
            return self.speeds[self.hand.solids.len() + pair];
        }
        let of_joint = |&(joint, reach): &(usize, f64)| {
            let axis = self.axes[joint];
            let share = if axis == Vector3::zeros() {
                1.0
            } else if self.hand.joints()[joint].kind == JointKind::Prismatic {
                axis.dot(direction).abs()
            } else {
                axis.cross(direction).norm()
            };
            self.rate(joint).abs() * reach * (share + DRIFT).min(1.0)
        };
        self.hand.pair_reaches[pair].iter().map(of_joint).sum()
    }

    /// The one axis that every joint which moves the pair turns about, if there is one.
    fn common_axis(&self, pair: usize) -> Option<Vector3<f64>> {
        let mut moving = self.hand.pair_reaches[pair]
            .iter()
            .map(|(joint, _)| *joint)
            .filter(|joint| self.rate(*joint) != 0.0);
        let first = self.axes[moving.next()?];
        let is_same = |joint: usize| {
            self.axes[joint] != Vector3::zeros()
                && self.hand.joints()[joint].kind != JointKind::Prismatic
                && self.axes[joint].cross(&first).norm() <= PARALLEL
        };
        let all = self.hand.pair_reaches[pair]
            .iter()
            .all(|(joint, _)| self.rate(*joint) == 0.0 || is_same(*joint));
        all.then_some(first)
    }

    /// How much longer a joint can move.
    fn travel_left(&self, joint: usize) -> f64 {
        let (node, rate) = (&self.hand.joints()[joint], self.rates[joint]);
        if rate == 0.0 {
            return 0.0;
        }
        let limit = if rate > 0.0 { node.upper } else { node.lower };
        ((limit - self.q0[joint]) / rate)
            .max(0.0)
            .min((MOST_TRAVEL - self.s0 * rate.abs()) / rate.abs())
    }

    /// Where the last moving joint reaches its limit.
    fn end(&self) -> f64 {
        self.s0
            + (0..self.q0.len())
                .map(|j| self.travel_left(j))
                .fold(0.0, f64::max)
    }

    /// The value of a joint, moving or mimicking one that moves.
    fn value(&self, joint: usize, s: f64) -> f64 {
        let node = &self.hand.joints()[joint];
        if node.leader != joint {
            return node.multiplier * self.value(node.leader, s) + node.offset;
        }
        let rate = self.rates[joint];
        if rate == 0.0 {
            return self.q0[joint];
        }
        (self.q0[joint] + rate * (s - self.s0)).clamp(node.lower, node.upper)
    }

    fn pose(&self, solid: usize, s: f64) -> Isometry3<f64> {
        let solid = &self.hand.solids[solid];
        self.link_pose(solid.link.0, s) * solid.link_from_solid
    }

    fn link_pose(&self, link: usize, s: f64) -> Isometry3<f64> {
        let last = self.last_poses.borrow()[link];
        if last.s == s || last.s == f64::INFINITY {
            return last.pose;
        }
        let parent = self.hand.parent(link);
        let object_from_parent = parent.map_or(self.object_from_root, |parent| self.link_pose(parent, s));
        let pose = object_from_parent * self.hand.parent_from(link, |joint| self.value(joint, s));
        let s = if self.still[link] { f64::INFINITY } else { s };
        self.last_poses.borrow_mut()[link] = LastPose { s, pose };
        pose
    }

    fn move_to(&mut self, s: f64) {
        self.q0 = (0..self.q0.len()).map(|j| self.value(j, s)).collect();
        self.s0 = s;
        self.settle();
    }

    /// Whether moving on would bring pair `i` closer.
    fn presses(&self, i: usize, touch: &Touch) -> bool {
        if self.speeds[i] == 0.0 {
            return false;
        }
        let s = touch.s;
        let now = touch.gap.unwrap_or_else(|| self.gap(i, s, NEAR));
        let later = self.gap(i, s + PROBE / self.speeds[i], NEAR);
        later < now - PRESSING * PROBE || later <= CLEARANCE
    }

    /// Stops every joint that changes gap `i`: those to a link, or those that move one of two links and not the other.
    fn stop(&mut self, i: usize) {
        let n_solids = self.hand.solids.len();
        let shares = if i < n_solids {
            &self.hand.solid_shares[i]
        } else {
            &self.hand.pair_shares[i - n_solids]
        };
        for (leader, _) in shares {
            self.rates[*leader] = 0.0;
        }
        self.settle();
    }
}

impl Motion for Closing<'_> {
    fn gap(&self, i: usize, s: f64, cutoff: f64) -> f64 {
        let hand = self.hand;
        match i.checked_sub(hand.solids.len()) {
            None => {
                let solid = &hand.solids[i].collider;
                self.near
                    .gap(i, self.object.surface(), solid, &self.pose(i, s), cutoff)
            }
            Some(pair) => {
                let (a, b) = hand.pairs[pair];
                let a_from_b = self.pose(a, s).inv_mul(&self.pose(b, s));
                let distance =
                    hand.solids[a]
                        .collider
                        .distance_to(&hand.solids[b].collider, &a_from_b, cutoff);
                distance.unwrap_or(cutoff)
            }
        }
    }

    fn look(&self, i: usize, s: f64) -> f64 {
        let hand = self.hand;
        let Some(pair) = i.checked_sub(hand.solids.len()) else {
            let solid = &hand.solids[i].collider;
            return self.near.look(i, self.object.surface(), solid, &self.pose(i, s));
        };
        let (a, b) = hand.pairs[pair];
        let (first, second) = (&hand.solids[a], &hand.solids[b]);
        let center = |solid: &LinkSolid| -> Point3<f64> { self.link_pose(solid.link.0, s) * solid.center };
        let between = center(second) - center(first);
        let radii = first.collider.bounding_ball().radius + second.collider.bounding_ball().radius;
        let seen = |gap: f64, direction: Vector3<f64>| {
            let closing_speed = self.speed_along(pair, &direction);
            self.seen_apart[pair].set(SeenApart {
                direction,
                closing_speed,
            });
            gap
        };
        if between.norm() - radii > ROUGH {
            return seen(between.norm() - radii, between.normalize());
        }
        let pose = self.pose(a, s);
        let a_from_b = pose.inv_mul(&self.pose(b, s));
        let along = |direction: &Vector3<f64>| {
            let in_a = pose.rotation.inverse_transform_vector(direction);
            first.collider.apart_along(&second.collider, &a_from_b, &in_a)
        };
        // Fingers side by side move across what is between them.
        if let Some(axis) = self.common_axis(pair) {
            let axis = if axis.dot(&between) < 0.0 { -axis } else { axis };
            let gap = along(&axis);
            if gap > NEAR {
                return seen(gap, axis);
            }
        }
        let last = self.seen_apart[pair].get().direction;
        if !first.collider.is_quick_to(&second.collider) && last != Vector3::zeros() {
            let gap = along(&last);
            if gap > NEAR {
                return seen(gap, last);
            }
        }
        let found = first
            .collider
            .distance_and_direction(&second.collider, &a_from_b, FAR);
        let (gap, direction) = found.unwrap_or((FAR, None));
        seen(gap, direction.map_or_else(Vector3::zeros, |d| pose.rotation * d))
    }

    fn closing_speed(&self, i: usize) -> f64 {
        match i.checked_sub(self.hand.solids.len()) {
            None => self.speeds[i],
            // Joints stop and never start: what was a bound stays one.
            Some(pair) => self.speeds[i].min(self.seen_apart[pair].get().closing_speed),
        }
    }

    fn speed(&self, i: usize) -> f64 {
        self.speeds[i]
    }

    fn least_step(&self, i: usize) -> f64 {
        match i.checked_sub(self.hand.solids.len()) {
            None => LEAST_STEP,
            Some(pair) => self.hand.pair_least_steps[pair],
        }
    }
}

/// Whether two links of the posture overlap that may not.
pub(crate) fn self_collides(hand: &GraspHand<'_>, joints: &JointPositions) -> bool {
    let poses = hand.all_poses(joints);
    let pose = |i: usize| poses[hand.solids[i].link.0] * hand.solids[i].link_from_solid;
    let placed: Vec<_> = (0..hand.solids.len()).map(pose).collect();
    hand.pairs.iter().any(|&(a, b)| {
        let (first, second) = (&hand.solids[a].collider, &hand.solids[b].collider);
        let d = first.distance_to(second, &placed[a].inv_mul(&placed[b]), TOUCH);
        d.is_some_and(|d| d <= CLEARANCE)
    })
}
