//! A hand: its links, its joints, and what `hand.toml` says of it.

use nalgebra::{Isometry3, UnitVector3};
use prehend_geometry::PlacedSolid;

use crate::Description;

/// A hand: a tree of links joined by joints, and optionally a [`Description`] of how it grasps.
///
/// Built by [`Hand::from_urdf`], so that the tree has one root and no loop, names are unique, axes have length 1,
/// limits are ordered, and every mimic joint follows a free one.
#[derive(Debug, Clone, PartialEq)]
pub struct Hand {
    pub(crate) name: String,
    pub(crate) links: Vec<Link>,
    pub(crate) joints: Vec<Joint>,
    pub(crate) root: LinkIdx,
    /// For every link but the root, parents before children: how it hangs on its parent.
    pub(crate) attachments: Vec<Attachment>,
    pub(crate) warnings: Vec<String>,
    pub(crate) description: Option<Description>,
}

/// Position of a link in [`Hand::links`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
pub struct LinkIdx(pub usize);

/// Position of a movable joint in [`Hand::joints`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
pub struct JointIdx(pub usize);

/// A rigid part of the hand.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Its name in the URDF.
    pub name: String,
    /// The solids that touch and collide, in the link's frame. May be empty.
    pub collision: Vec<PlacedSolid>,
    /// The solids to draw. May be empty, or lack parts that could not be read ([`Hand::warnings`]).
    pub visual: Vec<PlacedSolid>,
    /// Mass (kg) where the URDF gives one.
    pub mass: Option<f64>,
}

/// What a movable joint does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about its axis, between limits (rad).
    Revolute,
    /// Turns about its axis, without limits.
    Continuous,
    /// Slides along its axis, between limits (m).
    Prismatic,
}

impl JointKind {
    /// The URDF's word for it.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Revolute => "revolute",
            Self::Continuous => "continuous",
            Self::Prismatic => "prismatic",
        }
    }
}

/// A movable joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Its name in the URDF.
    pub name: String,
    /// What it does.
    pub kind: JointKind,
    /// Least position (rad or m); −∞ for a continuous joint.
    pub lower: f64,
    /// Greatest position (rad or m); +∞ for a continuous joint.
    pub upper: f64,
    /// The free joint that it follows, if any.
    pub mimic: Option<Mimic>,
    /// The link that carries it.
    pub parent: LinkIdx,
    /// The link that it moves; its frame is the joint's frame after the motion.
    pub child: LinkIdx,
    /// The child link's frame at position 0, in the parent link's frame.
    pub parent_from_joint: Isometry3<f64>,
    /// The axis in the joint's frame (and, since the motion leaves it where it is, in the child link's).
    pub axis: UnitVector3<f64>,
}

/// How a joint follows another: position = `multiplier` · position of `joint` + `offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mimic {
    /// The joint that is followed. Always a free one: chains of mimic joints are resolved on load.
    pub joint: JointIdx,
    /// Factor.
    pub multiplier: f64,
    /// Summand (rad or m).
    pub offset: f64,
}

/// How a link hangs on its parent.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Attachment {
    pub child: LinkIdx,
    pub parent: LinkIdx,
    pub parent_from_joint: Isometry3<f64>,
    /// The movable joint between them; `None` where it is fixed.
    pub joint: Option<JointIdx>,
}

impl Hand {
    /// The robot's name in the URDF.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// All links, in the URDF's order.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// One link. Panics where the index comes from another hand.
    pub fn link(&self, link: LinkIdx) -> &Link {
        &self.links[link.0]
    }

    /// The link of that name.
    pub fn link_named(&self, name: &str) -> Option<LinkIdx> {
        self.links.iter().position(|l| l.name == name).map(LinkIdx)
    }

    /// The movable joints, mimic ones among them, in the URDF's order.
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// One joint. Panics where the index comes from another hand.
    pub fn joint(&self, joint: JointIdx) -> &Joint {
        &self.joints[joint.0]
    }

    /// The movable joint of that name.
    pub fn joint_named(&self, name: &str) -> Option<JointIdx> {
        self.joints.iter().position(|j| j.name == name).map(JointIdx)
    }

    /// The joints that move freely (do not mimic), in the URDF's order: the order of an eigengrasp's entries.
    pub fn free_joints(&self) -> impl Iterator<Item = JointIdx> + '_ {
        (0..self.joints.len())
            .filter(|&j| self.joints[j].mimic.is_none())
            .map(JointIdx)
    }

    /// How many joints move freely.
    pub fn n_dof(&self) -> usize {
        self.free_joints().count()
    }

    /// The link that has no parent; all poses are in its frame.
    pub fn root(&self) -> LinkIdx {
        self.root
    }

    /// The link that carries this one; `None` for the root.
    pub fn parent(&self, link: LinkIdx) -> Option<LinkIdx> {
        self.attachments
            .iter()
            .find(|a| a.child == link)
            .map(|a| a.parent)
    }

    /// The movable joints between the root and this link, from the root outwards (mimic ones among them).
    pub fn joints_to(&self, link: LinkIdx) -> Vec<JointIdx> {
        let mut joints = Vec::new();
        let mut at = link;
        while let Some(attachment) = self.attachments.iter().find(|a| a.child == at) {
            joints.extend(attachment.joint);
            at = attachment.parent;
        }
        joints.reverse();
        joints
    }

    /// What was left out on reading, for example pictures of links in a format that is not read.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// What `hand.toml` says; `None` until [`Hand::with_description`].
    pub fn description(&self) -> Option<&Description> {
        self.description.as_ref()
    }
}
