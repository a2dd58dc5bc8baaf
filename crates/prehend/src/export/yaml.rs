//! YAML for robots: `moveit_msgs/Grasp` and Isaac's grasp files.

use nalgebra::{Isometry3, Vector3};
use prehend_hand::{Hand, JointPositions};
use serde_json::{Map, Value, json};

use super::{ExportedGrasp, STAND_OFF, driven_joints, driven_positions};
use crate::Error;

/// The grasps as a YAML list of `moveit_msgs/Grasp`.
///
/// `grasp_pose` is the root link's pose in the frame `object`, `pre_grasp_approach` and `post_grasp_retreat` lead along
/// the palm's z by [`STAND_OFF`]; `pre_grasp_posture` is the pre-shape, `grasp_posture` two points: touching, then
/// squeezing with `effort` (N·m, or N). `grasp_quality` is ε.
///
/// # Errors
///
/// A number that YAML cannot hold.
pub fn moveit_yaml(hand: &Hand, object: &str, grasps: &[ExportedGrasp]) -> Result<String, Error> {
    let root = hand.link(hand.root()).name.as_str();
    let header = |frame: &str| json!({ "frame_id": frame });
    let names: Vec<&str> = driven_joints(hand).map(|j| hand.joint(j).name.as_str()).collect();
    let none = vec![0.0; hand.joints().len()];
    let postures = |points: &[(&JointPositions, &[f64])]| {
        let points: Vec<Value> = (1..)
            .zip(points)
            .map(|(second, (positions, efforts))| {
                let positions: Vec<f64> = driven_joints(hand).map(|j| positions.get(j)).collect();
                let efforts: Vec<f64> = driven_joints(hand).map(|j| efforts[j.0]).collect();
                json!({
                    "positions": positions,
                    "velocities": [],
                    "accelerations": [],
                    "effort": efforts,
                    "time_from_start": { "sec": second, "nanosec": 0 },
                })
            })
            .collect();
        json!({ "header": header(root), "joint_names": names, "points": points })
    };
    let translation = |direction: Vector3<f64>| {
        json!({
            "direction": { "header": header(object), "vector": xyz(&direction) },
            "desired_distance": STAND_OFF,
            "min_distance": STAND_OFF / 2.0,
        })
    };
    let list: Vec<Value> = grasps
        .iter()
        .map(|grasp| {
            json!({
                "id": grasp.record.grasp_id,
                "pre_grasp_posture": postures(&[(&grasp.preshape, &none)]),
                "grasp_posture": postures(&[
                    (&grasp.record.joints, &none),
                    (&grasp.squeeze.joints, &grasp.squeeze.efforts),
                ]),
                "grasp_pose": { "header": header(object), "pose": pose(&grasp.record.object_from_root) },
                "grasp_quality": grasp.record.epsilon,
                "pre_grasp_approach": translation(grasp.approach),
                "post_grasp_retreat": translation(-grasp.approach),
                "post_place_retreat": translation(-grasp.approach),
                "max_contact_force": 0.0,
                "allowed_touch_objects": [object],
            })
        })
        .collect();
    text(&Value::Array(list))
}

/// The grasps of one object as an `isaac_grasp` file of version 1.0.
///
/// `position` and `orientation` are the root link's in the object's frame; `cspace_position` the joints that touch,
/// `pregrasp_cspace_position` the pre-shape. `confidence` is ε over the largest ε among them: the format wants 0 to 1.
///
/// # Errors
///
/// A number that YAML cannot hold.
pub fn isaac_yaml(hand: &Hand, object: &str, grasps: &[ExportedGrasp]) -> Result<String, Error> {
    let most = grasps.iter().map(|g| g.record.epsilon).fold(0.0, f64::max);
    let by_name: Map<String, Value> = grasps
        .iter()
        .map(|grasp| {
            let (t, q) = (
                grasp.record.object_from_root.translation.vector,
                grasp.record.object_from_root.rotation,
            );
            let confidence = if most > 0.0 {
                grasp.record.epsilon / most
            } else {
                0.0
            };
            let entry = json!({
                "confidence": confidence,
                "position": [t.x, t.y, t.z],
                "orientation": { "w": q.w, "xyz": [q.i, q.j, q.k] },
                "cspace_position": driven_positions(hand, &grasp.record.joints),
                "pregrasp_cspace_position": driven_positions(hand, &grasp.preshape),
            });
            (grasp.record.grasp_id.clone(), entry)
        })
        .collect();
    let file = json!({
        "format": "isaac_grasp",
        "format_version": 1.0,
        "object_frame_link": object,
        "gripper_frame_link": hand.link(hand.root()).name,
        "grasps": by_name,
    });
    text(&file)
}

fn text(value: &Value) -> Result<String, Error> {
    serde_saphyr::to_string(value).map_err(Error::input)
}

fn xyz(v: &Vector3<f64>) -> Value {
    // Adding 0 turns −0 into 0.
    json!({ "x": v.x + 0.0, "y": v.y + 0.0, "z": v.z + 0.0 })
}

fn pose(pose: &Isometry3<f64>) -> Value {
    let q = pose.rotation;
    json!({
        "position": xyz(&pose.translation.vector),
        "orientation": { "x": q.i, "y": q.j, "z": q.k, "w": q.w },
    })
}
