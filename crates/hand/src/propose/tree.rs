//! Which parts of a hand move as one, and what hangs on what.

use nalgebra::Point3;

use super::anatomy::{Chain, diagonal, far_part, hull_of, not_a_hand};
use crate::{Hand, HandError, JointIdx, JointPositions, LinkIdx};

/// Axes that differ by less than this angle's cosine (15°) count as parallel.
const PARALLEL: f64 = 0.966;
/// What reaches farther (m) than this from where it branches off is an arm or a body, not a finger.
const LONGEST_FINGER: f64 = 0.5;
/// Joints in a row without a branch: up to so many are a finger, more an arm with one jaw.
const FINGER_JOINTS: usize = 3;

/// Groups of links that move as one, as a tree.
pub(super) struct Tree<'a> {
    hand: &'a Hand,
    pub groups: Vec<Vec<LinkIdx>>,
    /// The group that carries each, and the joint between them.
    parents: Vec<Option<(usize, JointIdx)>>,
    /// Whether it or anything that it carries has a shape.
    bears_shape: Vec<bool>,
}

impl<'a> Tree<'a> {
    pub fn new(hand: &'a Hand, points: &[Vec<Point3<f64>>]) -> Self {
        let mut group_of = vec![0; hand.links.len()];
        let mut groups = vec![vec![hand.root()]];
        let mut parents = vec![None];
        for attachment in &hand.attachments {
            let parent = group_of[attachment.parent.0];
            let group = if let Some(joint) = attachment.joint {
                groups.push(Vec::new());
                parents.push(Some((parent, joint)));
                groups.len() - 1
            } else {
                parent
            };
            group_of[attachment.child.0] = group;
            groups[group].push(attachment.child);
        }
        let mut bears_shape: Vec<bool> = groups
            .iter()
            .map(|g| g.iter().any(|l| !points[l.0].is_empty()))
            .collect();
        // Parents come before their children.
        for group in (0..groups.len()).rev() {
            if let (true, Some((parent, _))) = (bears_shape[group], parents[group]) {
                bears_shape[parent] = true;
            }
        }
        Self {
            hand,
            groups,
            parents,
            bears_shape,
        }
    }

    fn children(&self, group: usize) -> impl Iterator<Item = usize> + '_ {
        (0..self.groups.len())
            .filter(move |&g| self.bears_shape[g] && self.parents[g].is_some_and(|(p, _)| p == group))
    }

    /// The first group from the root outwards at which the tree branches into parts of a finger's length. Where it
    /// never branches, the root's, or below the last joint of a longer row.
    pub fn palm_group(&self, points: &[Vec<Point3<f64>>]) -> Result<usize, HandError> {
        let mut at = 0;
        let mut row = vec![0];
        loop {
            let mut children = self.children(at);
            match (children.next(), children.next()) {
                (Some(only), None) => {
                    at = only;
                    row.push(at);
                }
                (Some(_), Some(_)) => break,
                (None, _) if row.len() > FINGER_JOINTS + 1 => return Ok(row[row.len() - 2]),
                (None, _) => return Ok(0),
            }
        }
        let reach = self.reach(at, points);
        if reach <= LONGEST_FINGER {
            return Ok(at);
        }
        let fitting: Vec<usize> = (0..self.groups.len())
            .filter(|&g| self.is_below(g, at) && self.children(g).count() > 1)
            .filter(|&g| self.reach(g, points) <= LONGEST_FINGER)
            .collect();
        // The outermost only: a finger may branch, too.
        let outer: Vec<usize> = fitting
            .iter()
            .copied()
            .filter(|&g| !fitting.iter().any(|&other| self.is_below(g, other)))
            .collect();
        if let [only] = outer[..] {
            return Ok(only);
        }
        let name = |g: usize| format!("`{}`", self.hand.link(self.groups[g][0]).name);
        let hands = match outer.len() {
            0 => "no hand hangs on it either; take the part of the URDF that is one".to_owned(),
            _ => format!(
                "{} hands hang on it: take the one that begins at {}",
                outer.len(),
                outer.iter().map(|&g| name(g)).collect::<Vec<_>>().join(" or ")
            ),
        };
        Err(not_a_hand(&format!(
            "it branches at {} into parts that reach {reach:.1} m, which are no fingers; {hands}",
            name(at)
        )))
    }

    /// How far (m) what hangs on a group reaches from the joints that it hangs on, at most, all joints at 0.
    fn reach(&self, group: usize, points: &[Vec<Point3<f64>>]) -> f64 {
        let zero = vec![0.0; self.hand.joints.len()];
        let poses = self.hand.link_poses(&self.hand.joint_positions_from_slice(&zero));
        let mut reach = 0.0_f64;
        for child in self.children(group) {
            let (base, _) = match self.parents[child] {
                Some((_, joint)) => self.hand.joint_axis(joint, &poses),
                None => continue,
            };
            let carried = (0..self.groups.len()).filter(|&g| g == child || self.is_below(g, child));
            for link in carried.flat_map(|g| &self.groups[g]) {
                let root_from_link = poses.root_from_link(*link);
                let far = points[link.0].iter().map(|p| (root_from_link * p - base).norm());
                reach = far.fold(reach, f64::max);
            }
        }
        reach
    }

    /// Whether a group hangs on another one, directly or through others.
    fn is_below(&self, group: usize, above: usize) -> bool {
        let mut at = self.parents[group];
        while let Some((parent, _)) = at {
            if parent == above {
                return true;
            }
            at = self.parents[parent];
        }
        false
    }

    /// The link of a group that carries most other groups and has a shape; else the one with the largest shape.
    pub fn palm_link(&self, group: usize, points: &[Vec<Point3<f64>>]) -> LinkIdx {
        let carried = |link: LinkIdx| {
            self.children(group)
                .filter(|&g| self.parents[g].is_some_and(|(_, j)| self.hand.joint(j).parent == link))
                .count()
        };
        let carries_some = |link: &LinkIdx| !points[link.0].is_empty() && carried(*link) > 0;
        let links = &self.groups[group];
        links
            .iter()
            .copied()
            .filter(carries_some)
            // The first of equals.
            .max_by_key(|&l| (carried(l), std::cmp::Reverse(l)))
            .or_else(|| {
                links.iter().copied().max_by(|a, b| {
                    diagonal(&points[a.0])
                        .total_cmp(&diagonal(&points[b.0]))
                        .then(b.cmp(a))
                })
            })
            .expect("a group has links")
    }

    /// Groups below `palm` that carry no further one, in the order of their first joint.
    pub fn leaves_below(&self, palm: usize) -> Vec<usize> {
        let mut leaves: Vec<usize> = (0..self.groups.len())
            .filter(|&g| self.bears_shape[g] && self.is_below(g, palm) && self.children(g).next().is_none())
            .collect();
        leaves.sort_by_key(|&g| self.way(palm, g).first().map(|(_, joint)| *joint));
        leaves
    }

    /// Groups and joints from `palm` (left out) to `leaf`.
    fn way(&self, palm: usize, leaf: usize) -> Vec<(usize, JointIdx)> {
        let mut way = Vec::new();
        let mut at = leaf;
        while let Some((parent, joint)) = self.parents[at] {
            if at == palm {
                break;
            }
            way.push((at, joint));
            at = parent;
        }
        way.reverse();
        way
    }

    pub fn chain(
        &self,
        palm: usize,
        leaf: usize,
        points: &[Vec<Point3<f64>>],
        zero: &JointPositions,
    ) -> Option<Chain> {
        let way = self.way(palm, leaf);
        let with_shape = |g: usize| self.groups[g].iter().copied().filter(|l| !points[l.0].is_empty());
        let links: Vec<LinkIdx> = way.iter().flat_map(|(g, _)| with_shape(*g)).collect();
        let tip_link = *links.last()?;
        let poses = self.hand.link_poses(zero);
        let tip_from_root = poses.root_from_link(tip_link).inverse();
        let tip_points = with_shape(leaf)
            .flat_map(|l| {
                let tip_from_link = tip_from_root * poses.root_from_link(l);
                points[l.0].iter().map(move |p| tip_from_link * p)
            })
            .collect::<Vec<_>>();
        let joints: Vec<JointIdx> = way.iter().map(|(_, joint)| *joint).collect();
        let last = *joints.last()?;
        let (base, axis) = self.hand.joint_axis(last, &poses);
        let slides = self.hand.joint(last).kind == crate::JointKind::Prismatic;
        let along = tip_from_root * axis * f64::from(u8::from(slides));
        let tip_points = far_part(tip_points, &(tip_from_root * base), &along);
        Some(Chain {
            flexion: self.flexion(&joints, zero),
            joints,
            links,
            tip: hull_of(&tip_points)?,
            tip_points,
            tip_link,
        })
    }

    fn flexion(&self, joints: &[JointIdx], zero: &JointPositions) -> Vec<JointIdx> {
        let poses = self.hand.link_poses(zero);
        let slides = |j: JointIdx| self.hand.joint(j).kind == crate::JointKind::Prismatic;
        let axis = |j: JointIdx| self.hand.joint_axis(j, &poses).1;
        let mut best: Vec<JointIdx> = Vec::new();
        for &seed in joints {
            let set: Vec<JointIdx> = joints
                .iter()
                .copied()
                .filter(|&j| slides(j) == slides(seed) && axis(j).dot(&axis(seed)).abs() > PARALLEL)
                .collect();
            if set.len() >= best.len() {
                best = set;
            }
        }
        best
    }
}
