//! Grasps as rows of a table, and back. From its row any grasp can be rebuilt exactly.

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, UnitVector3, Vector3};
use prehend_geometry::ContactPoint;
use prehend_grasp::{Grasp, GraspObject, LinkContact};
use prehend_hand::{Hand, JointPositions, LinkIdx};
use serde::{Deserialize, Serialize};

use crate::frame::{Column, Frame};
use crate::{Error, Object};

/// Columns of the network's continuous nodes.
pub const FEATURE_COLUMNS: [&str; 17] = [
    "size_x",
    "size_y",
    "size_z",
    "cvex",
    "egpc_1",
    "egpc_2",
    "upos_x",
    "upos_y",
    "upos_z",
    "dir_w",
    "dir_x",
    "dir_y",
    "dir_z",
    "fvol",
    "qeps",
    "fvol_union",
    "try",
];

const POSE_COLUMNS: [&str; 7] = [
    "pose_x", "pose_y", "pose_z", "pose_qw", "pose_qx", "pose_qy", "pose_qz",
];

/// A contact as it stands in the `contacts` column and in JSON answers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContactRecord {
    /// Name of the link that touches.
    pub link: String,
    /// Where, object frame, m.
    pub point: [f64; 3],
    /// Unit normal into the object.
    pub normal: [f64; 3],
    /// Friction coefficient.
    pub mu: f64,
    /// Torsion length of a soft contact, m; 0 for a point contact.
    pub torsion: f64,
}

impl ContactRecord {
    /// The record of a contact.
    pub fn new(hand: &Hand, contact: &LinkContact) -> Self {
        Self {
            link: hand.links()[contact.link.0].name.clone(),
            point: contact.at.point.coords.into(),
            normal: contact.at.normal.into_inner().into(),
            mu: contact.mu,
            torsion: contact.torsion,
        }
    }

    fn link_and_point(&self, hand: &Hand) -> Result<(LinkIdx, ContactPoint), Error> {
        let idx = hand
            .links()
            .iter()
            .position(|l| l.name == self.link)
            .ok_or_else(|| {
                Error::input(format!(
                    "column `contacts`: the hand {} has no link `{}`",
                    hand.name(),
                    self.link
                ))
            })?;
        let normal = UnitVector3::new_unchecked(Vector3::from(self.normal));
        Ok((
            LinkIdx(idx),
            ContactPoint {
                point: Point3::from(self.point),
                normal,
            },
        ))
    }
}

/// What identifies the grasps of one table.
#[derive(Debug, Clone)]
pub struct TableContext<'a> {
    /// The hand.
    pub hand: &'a Hand,
    /// Its folder as given.
    pub hand_path: &'a str,
    /// The object.
    pub object: &'a Object,
    /// The object as the planner sees it.
    pub grasp_object: &'a GraspObject,
    /// Seed of the run.
    pub seed: u64,
}

/// The identifier of a grasp: hand, object and number of the try that gave it.
pub fn grasp_id(hand: &str, object: &str, try_idx: usize) -> String {
    format!("{hand}/{object}/{try_idx:06}")
}

/// The table of one hand's grasps on one object.
pub fn to_frame(context: &TableContext, grasps: &[Grasp]) -> Frame {
    let TableContext { hand, object, .. } = context;
    let n = grasps.len();
    let text = |value: &str| Column::Text(vec![Some(value.to_owned()); n]);
    let number = |f: &dyn Fn(&Grasp) -> f64| Column::Number(grasps.iter().map(f).collect());
    let integer = |f: &dyn Fn(&Grasp) -> usize| Column::Integer(grasps.iter().map(|g| f(g) as i64).collect());
    let mut frame = Frame::new();
    let ids = grasps
        .iter()
        .map(|g| Some(grasp_id(hand.name(), &object.name, g.try_idx)))
        .collect();
    frame.push("grasp_id", Column::Text(ids));
    frame.push("object", text(&object.name));
    frame.push("object_type", text(&object.kind));
    frame.push("hand", text(hand.name()));
    frame.push("seed", Column::Integer(vec![context.seed.cast_signed(); n]));
    frame.push("try", integer(&|g| g.try_idx));
    frame.push("box", integer(&|g| g.box_idx));
    frame.push("face", integer(&|g| g.face));
    frame.push("roll", integer(&|g| g.roll));
    frame.push("preshape", integer(&|g| g.preshape_idx));
    frame.push("offset_1", number(&|g| g.offset[0]));
    frame.push("offset_2", number(&|g| g.offset[1]));
    for (k, axis) in ["x", "y", "z"].iter().enumerate() {
        frame.push(format!("size_{axis}"), number(&|g| g.features.size[k]));
    }
    frame.push("cvex", number(&|g| g.features.cvex));
    for k in 0..2 {
        frame.push(format!("egpc_{}", k + 1), number(&|g| g.features.egpc[k]));
    }
    for (k, axis) in ["x", "y", "z"].iter().enumerate() {
        frame.push(format!("upos_{axis}"), number(&|g| g.features.upos[k]));
    }
    for (k, axis) in ["w", "x", "y", "z"].iter().enumerate() {
        frame.push(format!("dir_{axis}"), number(&|g| g.features.dir[k]));
    }
    frame.push("fvol", number(&|g| g.features.fvol));
    frame.push("qeps", number(&|g| g.features.qeps));
    frame.push("fvol_union", number(&|g| g.features.fvol_union));
    for (k, name) in POSE_COLUMNS.iter().enumerate() {
        frame.push(*name, number(&|g| pose_as_array(&g.object_from_root)[k]));
    }
    for (k, joint) in hand.joints().iter().enumerate() {
        frame.push(
            format!("joint_{}", joint.name),
            number(&|g| g.joints.as_slice()[k]),
        );
    }
    let contacts = grasps.iter().map(|g| {
        let records: Vec<_> = g.contacts.iter().map(|c| ContactRecord::new(hand, c)).collect();
        serde_json::to_string(&records).ok()
    });
    frame.push("contacts", Column::Text(contacts.collect()));
    let center = context.grasp_object.wrench_center();
    for (k, axis) in ["x", "y", "z"].iter().enumerate() {
        frame.push(format!("center_{axis}"), Column::Number(vec![center[k]; n]));
    }
    frame.push(
        "torque_scale",
        Column::Number(vec![context.grasp_object.torque_scale(); n]),
    );
    frame.push("mesh", text(&object.path.to_string_lossy()));
    frame.push("hand_path", text(context.hand_path));
    frame
}

fn pose_as_array(pose: &Isometry3<f64>) -> [f64; 7] {
    let (t, q) = (pose.translation.vector, pose.rotation);
    [t.x, t.y, t.z, q.w, q.i, q.j, q.k]
}

/// A row of a grasp table: enough to stand the hand at the object again.
#[derive(Debug, Clone)]
pub struct GraspRecord {
    /// The grasp's identifier.
    pub grasp_id: String,
    /// Root link's pose in the object frame.
    pub object_from_root: Isometry3<f64>,
    /// Posture.
    pub joints: JointPositions,
    /// Contacts by link.
    pub contacts: Vec<(LinkIdx, ContactPoint)>,
    /// The `contacts` column as it stands.
    pub contact_records: Vec<ContactRecord>,
    /// ε of the grasp.
    pub epsilon: f64,
    /// The point that torques are taken about, object frame, m.
    pub wrench_center: Point3<f64>,
    /// The length that they are divided by, m.
    pub torque_scale: f64,
}

/// The grasps of a table that belong to `hand`.
///
/// # Errors
///
/// Names the column, row and value that cannot be a grasp of this hand.
pub fn records(frame: &Frame, hand: &Hand) -> Result<Vec<GraspRecord>, Error> {
    let ids = frame.texts("grasp_id")?;
    let pose: Vec<Vec<f64>> = POSE_COLUMNS
        .iter()
        .map(|c| frame.numbers(c))
        .collect::<Result<_, _>>()?;
    let joints: Vec<Vec<f64>> = hand
        .joints()
        .iter()
        .map(|j| frame.numbers(&format!("joint_{}", j.name)))
        .collect::<Result<_, _>>()?;
    let contacts = frame.texts("contacts")?;
    let epsilon = frame.numbers("qeps")?;
    let center = [
        frame.numbers("center_x")?,
        frame.numbers("center_y")?,
        frame.numbers("center_z")?,
    ];
    let torque_scale = frame.numbers("torque_scale")?;
    (0..frame.n_rows())
        .map(|row| {
            let at = |k: usize| pose[k][row];
            let rotation = Quaternion::new(at(3), at(4), at(5), at(6));
            if !((rotation.norm() - 1.0).abs() < 1e-6 && (0..3).all(|k| at(k).is_finite())) {
                return Err(Error::input(format!(
                    "row {}: pose_qw … pose_qz = {rotation:?} is no unit quaternion, or a pose column is missing a value",
                    row + 1
                )));
            }
            let posture: Vec<f64> = joints.iter().map(|j| j[row]).collect();
            if let Some(idx) = posture.iter().position(|p| !p.is_finite()) {
                let joint = &hand.joints()[idx].name;
                return Err(Error::input(format!("row {}: joint_{joint} is missing; every joint needs a number", row + 1)));
            }
            let contact_records: Vec<ContactRecord> = serde_json::from_str(&contacts[row])
                .map_err(|e| Error::input(format!("row {}, column `contacts`: {e}", row + 1)))?;
            Ok(GraspRecord {
                grasp_id: ids[row].clone(),
                object_from_root: Isometry3::from_parts(
                    Translation3::new(at(0), at(1), at(2)),
                    UnitQuaternion::new_unchecked(rotation),
                ),
                joints: hand.joint_positions_from_slice(&posture),
                contacts: contact_records.iter().map(|c| c.link_and_point(hand)).collect::<Result<_, _>>()?,
                contact_records,
                epsilon: epsilon[row],
                wrench_center: Point3::from([0, 1, 2].map(|k: usize| center[k][row])),
                torque_scale: torque_scale[row],
            })
        })
        .collect()
}
