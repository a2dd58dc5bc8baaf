//! The hand comes in along its palm's z axis until something touches.

use std::cell::Cell;

use nalgebra::{Isometry3, Translation3, Vector3};
use prehend_geometry::{Collider, Surface};
use prehend_hand::JointPositions;

use crate::first_touch::{Motion, NEAR, Track, first_touch};
use crate::grasp_hand::GraspHand;
use crate::{GraspObject, Reason};

/// Near the object, solids move this far between two looks, metres.
pub(crate) const LEAST_STEP: f64 = 5e-4;
/// An exact gap is looked for up to this distance, metres; beyond it, one step this long is as good.
const REACH: f64 = 5e-3;

/// The triangle that was last seen nearest to each solid.
#[derive(Debug, Clone)]
pub(crate) struct LastTriangles(Vec<Cell<Option<usize>>>);

impl LastTriangles {
    pub(crate) fn new(n_solids: usize) -> Self {
        Self(vec![Cell::new(None); n_solids])
    }

    /// The gap of a solid, `cutoff` where it is that or more.
    pub(crate) fn gap(
        &self,
        i: usize,
        surface: &Surface,
        solid: &Collider,
        pose: &Isometry3<f64>,
        cutoff: f64,
    ) -> f64 {
        let gap = surface.gap_from(solid, pose, cutoff, self.0[i].get());
        self.0[i].set(gap.map(|g| g.triangle).or(self.0[i].get()));
        gap.map_or(cutoff, |g| g.distance)
    }

    /// The gap of a solid, or a lower bound of it above [`NEAR`].
    pub(crate) fn look(&self, i: usize, surface: &Surface, solid: &Collider, pose: &Isometry3<f64>) -> f64 {
        let bound = surface.gap_lower_bound(solid, pose);
        if bound > NEAR {
            return bound;
        }
        self.gap(i, surface, solid, pose, bound.max(0.0) + REACH)
    }
}

/// A hand that has come in.
pub(crate) struct Arrived {
    pub(crate) object_from_root: Isometry3<f64>,
    pub(crate) object_from_palm: Isometry3<f64>,
    /// The solid that touched first.
    pub(crate) solid: Option<usize>,
}

/// Moves an open hand along `direction` until something touches, at most `farthest`.
pub(crate) fn arrive(
    hand: &GraspHand<'_>,
    object: &GraspObject,
    preshape: &JointPositions,
    object_from_root: &Isometry3<f64>,
    direction: Vector3<f64>,
    farthest: f64,
) -> Result<Arrived, Reason> {
    let poses = hand.all_poses(preshape);
    let start = hand
        .solids
        .iter()
        .map(|s| object_from_root * poses[s.link.0] * s.link_from_solid)
        .collect();
    let approach = Approach {
        hand,
        object,
        near: LastTriangles::new(hand.solids.len()),
        start,
        direction,
    };
    let arrival = approach.run(farthest).ok_or(Reason::StartCollision)?;
    if arrival.solid.is_some_and(|i| !hand.solids[i].may_touch) {
        return Err(Reason::ForbiddenLink);
    }
    let object_from_root = Translation3::from(direction * arrival.travelled) * object_from_root;
    Ok(Arrived {
        object_from_root,
        object_from_palm: object_from_root * hand.hand.root_from_palm(preshape),
        solid: arrival.solid,
    })
}

/// Slides an open hand along a straight line.
struct Approach<'a> {
    hand: &'a GraspHand<'a>,
    object: &'a GraspObject,
    near: LastTriangles,
    /// Pose of each solid at s = 0, object frame.
    start: Vec<Isometry3<f64>>,
    /// Unit direction, object frame.
    direction: Vector3<f64>,
}

/// Where the approach ends.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Arrival {
    /// Distance travelled, metres.
    travelled: f64,
    /// The solid that touches, if any.
    solid: Option<usize>,
}

impl Approach<'_> {
    /// Travels up to `farthest`; `None` where the hand overlaps the object at the start.
    fn run(&self, farthest: f64) -> Option<Arrival> {
        let mut tracks = vec![Track::unknown_at(0.0); self.hand.solids.len()];
        let touch = first_touch(self, &mut tracks, 0.0, farthest).ok()?;
        Some(Arrival {
            travelled: touch.s,
            solid: touch.pair,
        })
    }

    fn pose(&self, solid: usize, s: f64) -> Isometry3<f64> {
        Translation3::from(self.direction * s) * self.start[solid]
    }
}

impl Motion for Approach<'_> {
    fn gap(&self, i: usize, s: f64, cutoff: f64) -> f64 {
        let solid = &self.hand.solids[i].collider;
        self.near
            .gap(i, self.object.surface(), solid, &self.pose(i, s), cutoff)
    }

    fn look(&self, i: usize, s: f64) -> f64 {
        let solid = &self.hand.solids[i].collider;
        self.near.look(i, self.object.surface(), solid, &self.pose(i, s))
    }

    fn speed(&self, _: usize) -> f64 {
        1.0
    }

    fn closing_speed(&self, _: usize) -> f64 {
        1.0
    }

    fn least_step(&self, _: usize) -> f64 {
        LEAST_STEP
    }
}
