//! Where every link stands in a posture.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::hand::Attachment;
use crate::{Hand, JointIdx, JointKind, JointPositions, LinkIdx};

/// The pose of every link in the root link's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkPoses(Vec<Isometry3<f64>>);

impl LinkPoses {
    /// Pose of a link's frame in the root link's frame. Panics where the index comes from another hand.
    pub fn root_from_link(&self, link: LinkIdx) -> Isometry3<f64> {
        self.0[link.0]
    }

    /// All poses, in the order of [`Hand::links`].
    pub fn as_slice(&self) -> &[Isometry3<f64>] {
        &self.0
    }
}

impl Hand {
    /// Forward kinematics: the pose of every link's frame in the root link's frame.
    ///
    /// From the root outwards, `root_from_child = root_from_parent · parent_from_joint · motion(q)`, where the motion
    /// is the rotation about, or the translation along, the joint's axis.
    pub fn link_poses(&self, positions: &JointPositions) -> LinkPoses {
        let mut poses = vec![Isometry3::identity(); self.links.len()];
        for attachment in &self.attachments {
            poses[attachment.child.0] =
                poses[attachment.parent.0] * self.parent_from_child(attachment, positions);
        }
        LinkPoses(poses)
    }

    /// Pose of one link in the root link's frame; the same as from [`Hand::link_poses`], for one link only.
    pub fn link_pose(&self, link: LinkIdx, positions: &JointPositions) -> Isometry3<f64> {
        let mut child_from_link = Isometry3::identity();
        let mut at = link;
        while let Some(attachment) = self.attachments.iter().find(|a| a.child == at) {
            child_from_link = self.parent_from_child(attachment, positions) * child_from_link;
            at = attachment.parent;
        }
        child_from_link
    }

    /// Axis of a joint in the root link's frame: a point on it (the joint's origin) and its unit direction. Moving
    /// the joint in the positive sense turns about it, or slides along it.
    pub fn joint_axis(&self, joint: JointIdx, poses: &LinkPoses) -> (nalgebra::Point3<f64>, Vector3<f64>) {
        let joint = self.joint(joint);
        let root_from_child = poses.root_from_link(joint.child);
        (
            root_from_child.translation.vector.into(),
            root_from_child * joint.axis.into_inner(),
        )
    }

    fn parent_from_child(&self, attachment: &Attachment, positions: &JointPositions) -> Isometry3<f64> {
        let Some(JointIdx(idx)) = attachment.joint else {
            return attachment.parent_from_joint;
        };
        let joint = &self.joints[idx];
        let position = positions.0[idx];
        match joint.kind {
            JointKind::Revolute | JointKind::Continuous => {
                attachment.parent_from_joint * UnitQuaternion::from_axis_angle(&joint.axis, position)
            }
            JointKind::Prismatic => {
                attachment.parent_from_joint * Translation3::from(joint.axis.into_inner() * position)
            }
        }
    }
}
