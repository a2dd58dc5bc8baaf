//! From a URDF to a [`Hand`], checked.
//!
//! `xml.rs` reads the elements; what they say to each other is checked here.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

use crate::hand::Attachment;
use crate::shape::{Resolve, ShapeReader};
use crate::xml::{RawJoint, RawPose, Robot};
use crate::{Hand, HandError, Joint, JointIdx, JointKind, Link, LinkIdx, Mimic, xml};

impl Hand {
    /// Reads a hand from the text of its URDF. `resolve` takes the name of a mesh file, as the URDF gives it
    /// (`package://` and all), to the file's bytes, or says why it cannot.
    ///
    /// The collision geometry as given is the hand's shape; a mesh that fills its convex hull becomes that hull.
    /// Pictures (`<visual>`) in a format that is not read are left out with a warning. Elements that say nothing of
    /// shape or motion (transmission, gazebo, …) are ignored.
    ///
    /// # Errors
    ///
    /// A [`HandError`] that names the joint, link or file: text that is no URDF, names that are doubled or missing,
    /// a loop, two roots, an axis of length 0, limits that are missing, in the wrong order or not finite, mimic joints
    /// that follow nothing or each other, a shape without size, a collision mesh that is missing or unreadable.
    pub fn from_urdf(urdf: &str, resolve: &Resolve<'_>) -> Result<Self, HandError> {
        let robot = xml::read(urdf)?;
        let links = named(robot.links.iter().map(|l| l.name.as_str()), "link")?;
        named(robot.joints.iter().map(|j| j.name.as_str()), "joint")?;
        if robot.links.is_empty() {
            return Err(HandError::Urdf {
                place: "robot".into(),
                reason: "there is no <link>; expected <robot> with links and joints".into(),
            });
        }
        let (joints, placed) = read_joints(&robot, &links)?;
        let (root, attachments) = hang(&robot, &joints, placed)?;
        let mut shapes = ShapeReader::new(resolve);
        let links = robot
            .links
            .iter()
            .map(|link| shapes.read_link(link))
            .collect::<Result<Vec<Link>, _>>()?;
        Ok(Self {
            name: robot.name.clone(),
            links,
            joints,
            root,
            attachments,
            warnings: shapes.into_warnings(),
            description: None,
        })
    }
}

/// Positions by name, or an error where two elements share one.
fn named<'a>(
    names: impl Iterator<Item = &'a str>,
    what: &'static str,
) -> Result<BTreeMap<&'a str, usize>, HandError> {
    let mut seen = BTreeMap::new();
    for (idx, name) in names.enumerate() {
        if seen.insert(name, idx).is_some() {
            return Err(HandError::DuplicateName {
                what,
                name: name.to_owned(),
            });
        }
    }
    Ok(seen)
}

/// All movable joints, and every joint's attachment in the URDF's order.
fn read_joints(
    robot: &Robot,
    links: &BTreeMap<&str, usize>,
) -> Result<(Vec<Joint>, Vec<Attachment>), HandError> {
    let mut joints = Vec::new();
    let mut attachments = Vec::new();
    for raw in &robot.joints {
        let end = |role: &'static str, link: &str| {
            links
                .get(link)
                .copied()
                .map(LinkIdx)
                .ok_or_else(|| HandError::UnknownLink {
                    joint: raw.name.clone(),
                    role,
                    link: link.to_owned(),
                })
        };
        let (parent, child) = (end("parent", &raw.parent)?, end("child", &raw.child)?);
        let parent_from_joint = pose(&raw.origin, || format!("joint `{}`", raw.name))?;
        let kind = kind(raw)?;
        let joint = kind.map(|_| JointIdx(joints.len()));
        attachments.push(Attachment {
            child,
            parent,
            parent_from_joint,
            joint,
        });
        if let Some(kind) = kind {
            let axis = axis(raw)?;
            let (lower, upper) = limits(raw, kind)?;
            let name = raw.name.clone();
            joints.push(Joint {
                name,
                kind,
                lower,
                upper,
                mimic: None,
                parent,
                child,
                parent_from_joint,
                axis,
            });
        }
    }
    resolve_mimics(robot, &mut joints)?;
    Ok((joints, attachments))
}

fn kind(raw: &RawJoint) -> Result<Option<JointKind>, HandError> {
    match raw.kind.as_str() {
        "fixed" => Ok(None),
        "revolute" => Ok(Some(JointKind::Revolute)),
        "continuous" => Ok(Some(JointKind::Continuous)),
        "prismatic" => Ok(Some(JointKind::Prismatic)),
        found => Err(HandError::JointType {
            joint: raw.name.clone(),
            found: found.to_owned(),
        }),
    }
}

/// A pose from `<origin>`: roll, pitch and yaw turn about the fixed x, y and z axes, in this order.
pub(crate) fn pose(origin: &RawPose, place: impl Fn() -> String) -> Result<Isometry3<f64>, HandError> {
    let ([x, y, z], [roll, pitch, yaw]) = (origin.xyz, origin.rpy);
    for (what, numbers) in [("origin xyz", origin.xyz), ("origin rpy", origin.rpy)] {
        if numbers.iter().any(|n| !n.is_finite()) {
            return Err(HandError::Value {
                place: place(),
                what,
                found: format!("{numbers:?}"),
                expected: "three finite numbers",
            });
        }
    }
    let rotation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    Ok(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
}

fn axis(raw: &RawJoint) -> Result<Unit<Vector3<f64>>, HandError> {
    let axis = Vector3::from(raw.axis);
    // Scaled first, so that lengths that overflow or vanish when squared are no matter.
    let scaled = axis / axis.amax();
    Unit::try_new(scaled, 0.5)
        .filter(|unit| unit.iter().all(|c| c.is_finite()))
        .ok_or_else(|| HandError::Value {
            place: format!("joint `{}`", raw.name),
            what: "axis",
            found: format!("{:?}", raw.axis),
            expected: "three finite numbers, not all 0",
        })
}

/// Lower and upper limit; those of a mimic joint that gives none are set later, from its leader's.
fn limits(raw: &RawJoint, kind: JointKind) -> Result<(f64, f64), HandError> {
    let (lower, upper) = (raw.lower, raw.upper);
    if kind == JointKind::Continuous {
        return Ok((f64::NEG_INFINITY, f64::INFINITY));
    }
    if lower == 0.0 && upper == 0.0 {
        return match raw.mimic {
            Some(_) => Ok((0.0, 0.0)),
            None => Err(HandError::NoLimits {
                joint: raw.name.clone(),
                kind: kind.as_str(),
            }),
        };
    }
    // `lower <= upper` is false for NaN.
    if lower.is_finite() && upper.is_finite() && lower <= upper {
        return Ok((lower, upper));
    }
    Err(HandError::Value {
        place: format!("joint `{}`", raw.name),
        what: "limit",
        found: format!("lower {lower}, upper {upper}"),
        expected: "two finite numbers, lower not above upper",
    })
}

/// Follows every chain of mimic joints to the free joint at its end and multiplies it out.
fn resolve_mimics(robot: &Robot, joints: &mut [Joint]) -> Result<(), HandError> {
    let movable: BTreeMap<String, usize> = joints
        .iter()
        .enumerate()
        .map(|(idx, joint)| (joint.name.clone(), idx))
        .collect();
    let raw: BTreeMap<&str, &RawJoint> = robot.joints.iter().map(|j| (j.name.as_str(), j)).collect();
    for follower in 0..joints.len() {
        let name = joints[follower].name.clone();
        let (mut multiplier, mut offset) = (1.0, 0.0);
        let mut at = name.as_str();
        let mut steps = 0;
        while let Some(mimic) = &raw[at].mimic {
            let (factor, summand) = (mimic.multiplier, mimic.offset);
            if !(factor.is_finite() && summand.is_finite()) {
                return Err(HandError::Value {
                    place: format!("joint `{at}`"),
                    what: "mimic",
                    found: format!("multiplier {factor}, offset {summand}"),
                    expected: "two finite numbers",
                });
            }
            let Some((leader, _)) = movable.get_key_value(&mimic.joint) else {
                let found = if raw.contains_key(mimic.joint.as_str()) {
                    "a fixed joint"
                } else {
                    "not a joint"
                };
                return Err(HandError::MimicUnknown {
                    joint: at.to_owned(),
                    leader: mimic.joint.clone(),
                    found,
                });
            };
            steps += 1;
            if steps > joints.len() {
                return Err(HandError::MimicLoop { joint: name });
            }
            // q = m (m' q' + o') + o
            offset += multiplier * summand;
            multiplier *= factor;
            at = leader;
        }
        if steps > 0 {
            let leader = JointIdx(movable[at]);
            joints[follower].mimic = Some(Mimic {
                joint: leader,
                multiplier,
                offset,
            });
        }
    }
    for follower in 0..joints.len() {
        let joint = &joints[follower];
        if let (Some(mimic), true) = (joint.mimic, joint.lower == 0.0 && joint.upper == 0.0) {
            let leader = &joints[mimic.joint.0];
            let ends = [leader.lower, leader.upper].map(|q| mimic.multiplier * q + mimic.offset);
            let joint = &mut joints[follower];
            (joint.lower, joint.upper) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        }
    }
    Ok(())
}

/// Finds the root and orders the attachments from it outwards.
fn hang(
    robot: &Robot,
    joints: &[Joint],
    mut placed: Vec<Attachment>,
) -> Result<(LinkIdx, Vec<Attachment>), HandError> {
    debug_assert!(placed.iter().filter(|a| a.joint.is_some()).count() == joints.len());
    let link_name = |link: LinkIdx| robot.links[link.0].name.clone();
    let mut leads_to: Vec<Option<usize>> = vec![None; robot.links.len()];
    for (idx, attachment) in placed.iter().enumerate() {
        if let Some(first) = leads_to[attachment.child.0].replace(idx) {
            return Err(HandError::TwoParents {
                link: link_name(attachment.child),
                first: robot.joints[first].name.clone(),
                second: robot.joints[idx].name.clone(),
            });
        }
    }
    let mut roots = (0..robot.links.len())
        .filter(|&l| leads_to[l].is_none())
        .map(LinkIdx);
    let Some(root) = roots.next() else {
        return Err(HandError::Loop {
            link: robot.links[0].name.clone(),
        });
    };
    if let Some(second) = roots.next() {
        return Err(HandError::TwoRoots {
            first: link_name(root),
            second: link_name(second),
        });
    }

    // Breadth first; whatever is never reached hangs on a loop beside the tree.
    let mut ordered: Vec<Attachment> = Vec::with_capacity(placed.len());
    let mut reached = vec![false; robot.links.len()];
    reached[root.0] = true;
    while !placed.is_empty() {
        let (next, rest): (Vec<_>, Vec<_>) = placed.into_iter().partition(|a| reached[a.parent.0]);
        if next.is_empty() {
            return Err(HandError::Loop {
                link: link_name(rest[0].child),
            });
        }
        for attachment in &next {
            reached[attachment.child.0] = true;
        }
        ordered.extend(next);
        placed = rest;
    }
    Ok((root, ordered))
}
