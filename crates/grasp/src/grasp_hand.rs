//! A hand made ready for closing: its solids, its tree of links, and how fast each can move.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, UnitVector3, Vector3};
use prehend_geometry::{Collider, Solid};
use prehend_hand::{Description, Hand, JointIdx, JointKind, JointPositions, LinkIdx};
use prehend_quality::{Material, friction_coefficient, soft_torsion_default};

use crate::GraspError;

/// Links move towards each other by at least this (m) between two looks, if they are not much thinner …
const LEAST_STEP: f64 = 2e-3;
/// … and by at most this, however thick they are: fingers that are to touch must not sink in unnoticed.
const MOST_LEAST_STEP: f64 = 6e-3;

/// A hand made ready for closing.
#[derive(Debug, Clone)]
pub(crate) struct GraspHand<'a> {
    pub(crate) hand: &'a Hand,
    pub(crate) solids: Vec<LinkSolid>,
    links: Vec<LinkNode>,
    joints: Vec<JointNode>,
    /// For each solid: the free joints that move it, and how far its points move at most per unit of each.
    pub(crate) solid_shares: Vec<Vec<(usize, f64)>>,
    /// For each of `pairs`: the free joints that move one solid against the other, likewise.
    pub(crate) pair_shares: Vec<Vec<(usize, f64)>>,
    /// For each of `pairs`: the joints, driven ones too, that move one solid against the other, and the solid's reach from
    /// each, metres; 1 for a sliding joint.
    pub(crate) pair_reaches: Vec<Vec<(usize, f64)>>,
    /// Pairs of solids that may collide with each other.
    pub(crate) pairs: Vec<(usize, usize)>,
    /// For each of them: how far (m) the two may move towards each other between two looks, less than they are thick.
    pub(crate) pair_least_steps: Vec<f64>,
    /// Size of the palm along its y axis, metres.
    pub(crate) palm_width: f64,
}

/// A solid of a link.
#[derive(Debug, Clone)]
pub(crate) struct LinkSolid {
    pub(crate) link: LinkIdx,
    pub(crate) link_from_solid: Isometry3<f64>,
    pub(crate) collider: Collider,
    /// Middle of its bounding ball, the link's frame.
    pub(crate) center: Point3<f64>,
    pub(crate) may_touch: bool,
    pub(crate) material: Material,
    /// Length (m) that fits into the solid everywhere but near its edges.
    thickness: f64,
}

#[derive(Debug, Clone)]
struct LinkNode {
    parent: Option<usize>,
    /// Pose in the parent's frame without the joint's motion.
    parent_from_link: Isometry3<f64>,
    joint: Option<usize>,
}

#[derive(Debug, Clone)]
pub(crate) struct JointNode {
    pub(crate) kind: JointKind,
    axis: UnitVector3<f64>,
    /// The free joint that drives this one, and its share: itself and 1 unless it mimics.
    pub(crate) leader: usize,
    pub(crate) multiplier: f64,
    pub(crate) offset: f64,
    pub(crate) lower: f64,
    pub(crate) upper: f64,
    /// Speed at which a free joint closes; 0 where it stays.
    pub(crate) speed: f64,
}

impl<'a> GraspHand<'a> {
    pub(crate) fn new(hand: &'a Hand) -> Result<Self, GraspError> {
        let name = || hand.name().to_owned();
        let description = hand
            .description()
            .ok_or_else(|| GraspError::NoDescription { hand: name() })?;
        let joints = joint_nodes(hand, description);
        let links = link_nodes(hand, description);
        let mut solids = Vec::new();
        for (idx, link) in hand.links().iter().enumerate() {
            let found = &description.materials[idx];
            let material = found.parse().map_err(|_| GraspError::UnknownMaterial {
                hand: name(),
                link: link.name.clone(),
                found: found.clone(),
            })?;
            for placed in &link.collision {
                let collider = Collider::new(&placed.solid).map_err(|source| GraspError::Shape {
                    hand: name(),
                    link: link.name.clone(),
                    source: Box::new(source),
                })?;
                solids.push(LinkSolid {
                    link: LinkIdx(idx),
                    link_from_solid: placed.link_from_solid,
                    center: placed.link_from_solid * collider.bounding_ball().center,
                    collider,
                    may_touch: description.contact_links.contains(&LinkIdx(idx)),
                    material,
                    thickness: thickness(&placed.solid),
                });
            }
        }
        if solids.is_empty() {
            return Err(GraspError::NoShape { hand: name() });
        }
        let mut model = Self {
            hand,
            solids,
            links,
            joints,
            solid_shares: Vec::new(),
            pair_shares: Vec::new(),
            pair_reaches: Vec::new(),
            pairs: Vec::new(),
            pair_least_steps: Vec::new(),
            palm_width: 0.0,
        };
        let reaches: Vec<_> = (0..model.solids.len())
            .map(|i| model.reach_of(i, description))
            .collect();
        model.solid_shares = reaches.iter().map(|r| model.by_leader(r.iter())).collect();
        for i in 0..model.solids.len() {
            for j in i + 1..model.solids.len() {
                if !description.is_exempt(model.solids[i].link, model.solids[j].link) {
                    model.pairs.push((i, j));
                    let thinner = model.solids[i].thickness.min(model.solids[j].thickness);
                    model
                        .pair_least_steps
                        .push((thinner / 2.0).clamp(LEAST_STEP, MOST_LEAST_STEP));
                    // Joints below both move them as one.
                    let is_of = |solid: usize, joint: usize| reaches[solid].iter().any(|(k, _)| *k == joint);
                    let of_first = reaches[i].iter().filter(|(joint, _)| !is_of(j, *joint));
                    let of_second = reaches[j].iter().filter(|(joint, _)| !is_of(i, *joint));
                    let of_both: Vec<(usize, f64)> = of_first.chain(of_second).copied().collect();
                    model.pair_shares.push(model.by_leader(of_both.iter()));
                    model.pair_reaches.push(of_both);
                }
            }
        }
        model.palm_width = model.measured_palm_width(description);
        Ok(model)
    }

    pub(crate) fn description(&self) -> &Description {
        self.hand.description().expect("checked when it was made ready")
    }

    pub(crate) fn n_links(&self) -> usize {
        self.links.len()
    }

    pub(crate) fn parent(&self, link: usize) -> Option<usize> {
        self.links[link].parent
    }

    /// The movable joints between a link and the root.
    pub(crate) fn joints_to(&self, link: usize) -> impl Iterator<Item = usize> {
        let way = std::iter::successors(Some(link), |at| self.links[*at].parent);
        way.filter_map(|at| self.links[at].joint)
    }

    /// A link's pose in its parent's frame, from the value of each movable joint.
    pub(crate) fn parent_from(&self, link: usize, value: impl Fn(usize) -> f64) -> Isometry3<f64> {
        let node = &self.links[link];
        let Some(joint_idx) = node.joint else {
            return node.parent_from_link;
        };
        let joint = &self.joints[joint_idx];
        match joint.kind {
            JointKind::Prismatic => {
                node.parent_from_link * Translation3::from(joint.axis.into_inner() * value(joint_idx))
            }
            JointKind::Revolute | JointKind::Continuous => {
                node.parent_from_link * UnitQuaternion::from_axis_angle(&joint.axis, value(joint_idx))
            }
        }
    }

    /// Poses of all links in the root's frame.
    pub(crate) fn all_poses(&self, positions: &JointPositions) -> Vec<Isometry3<f64>> {
        self.hand.link_poses(positions).as_slice().to_vec()
    }

    /// Poses of all solids.
    pub(crate) fn solid_poses(
        &self,
        object_from_root: &Isometry3<f64>,
        joints: &JointPositions,
    ) -> Vec<Isometry3<f64>> {
        let poses = self.all_poses(joints);
        let pose = |s: &LinkSolid| object_from_root * poses[s.link.0] * s.link_from_solid;
        self.solids.iter().map(pose).collect()
    }

    /// Direction of a joint's axis, from the pose of the link that it moves.
    pub(crate) fn axis(&self, joint: usize, pose_of_child: impl Fn(usize) -> Isometry3<f64>) -> Vector3<f64> {
        pose_of_child(self.hand.joints()[joint].child.0) * self.joints[joint].axis.into_inner()
    }

    pub(crate) fn joints(&self) -> &[JointNode] {
        &self.joints
    }

    /// Reaches of joints, added up per free joint that drives them.
    fn by_leader<'b>(&self, reaches: impl Iterator<Item = &'b (usize, f64)>) -> Vec<(usize, f64)> {
        let mut shares: Vec<(usize, f64)> = Vec::new();
        for (joint, reach) in reaches {
            let node = &self.joints[*joint];
            let share = node.multiplier.abs() * reach;
            match shares.iter_mut().find(|(leader, _)| *leader == node.leader) {
                Some((_, sum)) => *sum += share,
                None => shares.push((node.leader, share)),
            }
        }
        shares
    }

    /// Friction and torsion of a solid's contact with an object.
    pub(crate) fn contact_law(&self, solid: usize, object: Material) -> (f64, f64) {
        let own = self.solids[solid].material;
        let soft = own.is_soft() || object.is_soft();
        (
            friction_coefficient(own, object),
            if soft { soft_torsion_default() } else { 0.0 },
        )
    }

    /// How far each joint on the way to a solid can move the solid's points, per unit of the joint.
    ///
    /// A turning joint moves a point by at most its distance from the joint's origin, and that is at most the length of
    /// the chain of joint origins in between: a bound that holds in every posture.
    fn reach_of(&self, solid: usize, description: &Description) -> Vec<(usize, f64)> {
        let solid = &self.solids[solid];
        let ball = solid.collider.bounding_ball();
        let values = description.origin.as_slice();
        let mut length = (solid.link_from_solid * ball.center).coords.norm() + ball.radius;
        let mut found = Vec::new();
        let mut at = Some(solid.link.0);
        while let Some(link) = at {
            let node = &self.links[link];
            let mut step = node.parent_from_link.translation.vector.norm();
            if let Some(joint_idx) = node.joint {
                let joint = &self.joints[joint_idx];
                let slides = joint.kind == JointKind::Prismatic;
                found.push((joint_idx, if slides { 1.0 } else { length }));
                if slides {
                    let farthest = joint
                        .lower
                        .abs()
                        .max(joint.upper.abs())
                        .max(values[joint_idx].abs());
                    step += farthest;
                }
            }
            length += step;
            at = node.parent;
        }
        found.reverse();
        found
    }

    /// Extent of the palm link's solids along the palm frame's y axis; of all solids where the palm has none.
    fn measured_palm_width(&self, description: &Description) -> f64 {
        let palm = &description.palm;
        let poses = self.all_poses(&description.origin);
        let palm_from_root = (poses[palm.link.0] * palm.link_from_palm).inverse();
        let of_palm = self.solids.iter().any(|s| s.link == palm.link);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for solid in self.solids.iter().filter(|s| !of_palm || s.link == palm.link) {
            let palm_from_solid = palm_from_root * poses[solid.link.0] * solid.link_from_solid;
            low = low.min(solid.collider.lowest_along(&Vector3::y(), &palm_from_solid));
            high = high.max(-solid.collider.lowest_along(&-Vector3::y(), &palm_from_solid));
        }
        (high - low).max(1e-3)
    }
}

fn thickness(solid: &Solid) -> f64 {
    match solid {
        Solid::Sphere { radius } | Solid::Capsule { radius, .. } => 2.0 * radius,
        Solid::Cuboid { half_extents } => 2.0 * half_extents.min(),
        Solid::Cylinder { half_length, radius } => 2.0 * half_length.min(*radius),
        // Nobody knows how thin it gets.
        Solid::Hull(_) | Solid::Mesh(_) => 0.0,
    }
}

fn joint_nodes(hand: &Hand, description: &Description) -> Vec<JointNode> {
    let mut nodes: Vec<JointNode> = hand
        .joints()
        .iter()
        .enumerate()
        .map(|(i, joint)| JointNode {
            kind: joint.kind,
            axis: joint.axis,
            leader: joint.mimic.map_or(i, |m| m.joint.0),
            multiplier: joint.mimic.map_or(1.0, |m| m.multiplier),
            offset: joint.mimic.map_or(0.0, |m| m.offset),
            lower: joint.lower,
            upper: joint.upper,
            speed: 0.0,
        })
        .collect();
    for closing in &description.closing {
        nodes[closing.joint.0].speed = closing.speed;
    }
    // A coupling that lets go moves both joints alike until one is stopped: so do two free joints at those speeds.
    for &JointIdx(idx) in &description.break_away {
        let node = &nodes[idx];
        let speed = node.multiplier * nodes[node.leader].speed;
        nodes[idx] = JointNode {
            leader: idx,
            multiplier: 1.0,
            offset: 0.0,
            speed,
            ..node.clone()
        };
    }
    nodes
}

fn link_nodes(hand: &Hand, description: &Description) -> Vec<LinkNode> {
    let poses = hand.link_poses(&description.origin);
    let moved_by = |link: usize| hand.joints().iter().position(|j| j.child.0 == link);
    (0..hand.links().len())
        .map(|link| {
            let parent = hand.parent(LinkIdx(link));
            let joint = moved_by(link);
            let parent_from_link = match (joint, parent) {
                (Some(joint), _) => hand.joints()[joint].parent_from_joint,
                (None, Some(parent)) => {
                    poses.root_from_link(parent).inverse() * poses.root_from_link(LinkIdx(link))
                }
                (None, None) => Isometry3::identity(),
            };
            LinkNode {
                parent: parent.map(|p| p.0),
                parent_from_link,
                joint,
            }
        })
        .collect()
}
