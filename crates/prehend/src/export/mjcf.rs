//! A grasp as a scene for MuJoCo.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use nalgebra::{Isometry3, Point3};
use prehend_geometry::{Solid, mass_properties};
use prehend_hand::{Hand, JointIdx, JointKind, JointPositions, LinkIdx};
use prehend_quality::{Material, friction_coefficient, soft_torsion_default};
use quick_xml::Writer;
use quick_xml::events::{BytesEnd, BytesStart, Event};

use super::pieces::{Pieces, corners};
use super::{ExportedGrasp, driven_joints};
use crate::{Error, Object};

/// Mass (kg) of a link whose URDF gives none.
const LINK_MASS: f64 = 0.05;
/// Radius of gyration (m) that links get: small, so that a servo holds them; the hand's dynamics are not what is looked at.
const GYRATION: f64 = 0.02;
/// Density (kg/m³) of an object that says no mass: filled containers and light plastics alike are near it.
const DENSITY: f64 = 500.0;

/// The position servos of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoGains {
    /// Stiffness of turning joints, N·m/rad.
    pub turning: f64,
    /// Largest torque, N·m.
    pub most_torque: f64,
    /// Stiffness of sliding joints, N/m.
    pub sliding: f64,
    /// Largest force, N.
    pub most_force: f64,
}

impl Default for ServoGains {
    /// 1 N at a fingertip 70 mm off turns its joint by 14 mrad; sliding jaws give way by 0.2 mm per N.
    fn default() -> Self {
        Self {
            turning: 5.0,
            most_torque: 2.0,
            sliding: 5000.0,
            most_force: 60.0,
        }
    }
}

/// One grasp as MJCF: the hand in its final posture with position servos on its joints, its root fixed in the
/// world (the object's frame); the object free, as convex pieces. Touch is by explicit pairs of links and pieces only,
/// with the friction of their materials; a soft contact's torsion length times μ is MuJoCo's torsional friction. A joint
/// whose coupling lets go has a servo of its own.
///
/// Where the object's file states its centre of mass, it is there, with the inertia of a uniform solid; else the pieces
/// are uniform.
///
/// The keyframe `grasp` puts the hand into its posture and sends the servos to the squeeze.
///
/// # Errors
///
/// A material that is not known; XML that cannot be written.
pub fn mjcf_scene(
    hand: &Hand,
    object: &Object,
    pieces: &Pieces,
    grasp: &ExportedGrasp,
    gains: ServoGains,
) -> Result<String, Error> {
    let description = hand
        .description()
        .ok_or_else(|| Error::input(format!("the hand {} has no hand.toml", hand.name())))?;
    let mut scene = Scene::new(hand);
    scene.open("mujoco", &[("model", grasp.record.grasp_id.clone())]);
    scene.empty(
        "compiler",
        &[("angle", "radian".into()), ("autolimits", "true".into())],
    );
    scene.empty(
        "option",
        &[
            ("timestep", "0.001".into()),
            ("integrator", "implicitfast".into()),
            ("cone", "elliptic".into()),
            ("impratio", "10".into()),
            ("gravity", "0 0 0".into()),
        ],
    );
    // Only the pairs below touch.
    scene.open("default", &[]);
    scene.empty("geom", &[("contype", "0".into()), ("conaffinity", "0".into())]);
    scene.close("default");

    scene.open("asset", &[]);
    for (k, (points, _)) in pieces.pieces.iter().enumerate() {
        scene.mesh(&format!("piece_{k}"), points);
    }
    for (link, part) in hand.links().iter().enumerate() {
        for (k, placed) in part.collision.iter().enumerate() {
            if let Some(points) = hull_points(&placed.solid) {
                scene.mesh(&format!("link_{link}_{k}"), &points);
            }
        }
    }
    scene.close("asset");

    scene.open("worldbody", &[]);
    scene.object(object, pieces);
    scene.link(hand.root(), Some(&grasp.record.object_from_root), None)?;
    scene.close("worldbody");

    scene.open("contact", &[]);
    for link in &description.contact_links {
        let material: Material = description.materials[link.0]
            .parse()
            .map_err(|_| Error::input(format!("unknown material `{}`", description.materials[link.0])))?;
        let mu = friction_coefficient(material, object.material);
        let soft = material.is_soft() || object.material.is_soft();
        let torsion = if soft { mu * soft_torsion_default() } else { 0.0 };
        for solid in 0..hand.link(*link).collision.len() {
            for piece in 0..pieces.pieces.len() {
                scene.empty(
                    "pair",
                    &[
                        ("geom1", format!("link_{}_{solid}", link.0)),
                        ("geom2", format!("piece_{piece}")),
                        ("condim", if soft { "4" } else { "3" }.into()),
                        ("friction", format!("{mu} {mu} {torsion} 0.0001 0.0001")),
                    ],
                );
            }
        }
    }
    scene.close("contact");

    let driven: Vec<String> = driven_joints(hand).map(|j| hand.joint(j).name.clone()).collect();
    scene.open("equality", &[]);
    for joint in hand.joints() {
        if let Some(mimic) = joint.mimic.filter(|_| !driven.contains(&joint.name)) {
            scene.empty(
                "joint",
                &[
                    ("joint1", joint.name.clone()),
                    ("joint2", hand.joint(mimic.joint).name.clone()),
                    ("polycoef", format!("{} {} 0 0 0", mimic.offset, mimic.multiplier)),
                ],
            );
        }
    }
    scene.close("equality");

    scene.open("actuator", &[]);
    for joint in driven_joints(hand) {
        let slides = hand.joint(joint).kind == JointKind::Prismatic;
        let (stiffness, most) = if slides {
            (gains.sliding, gains.most_force)
        } else {
            (gains.turning, gains.most_torque)
        };
        scene.empty(
            "position",
            &[
                ("name", hand.joint(joint).name.clone()),
                ("joint", hand.joint(joint).name.clone()),
                ("kp", stiffness.to_string()),
                ("forcerange", format!("-{most} {most}")),
            ],
        );
    }
    scene.close("actuator");

    let positions = |order: &mut dyn Iterator<Item = JointIdx>, of: &JointPositions| {
        order.map(|j| of.get(j).to_string()).collect::<Vec<_>>().join(" ")
    };
    let qpos = positions(&mut scene.joint_order.clone().into_iter(), &grasp.record.joints);
    let targets: Vec<String> = driven_joints(hand)
        .map(|j| grasp.squeeze.targets[j.0].to_string())
        .collect();
    scene.open("keyframe", &[]);
    scene.empty(
        "key",
        &[
            ("name", "grasp".into()),
            ("qpos", format!("0 0 0 1 0 0 0 {qpos}")),
            ("ctrl", targets.join(" ")),
        ],
    );
    scene.close("keyframe");
    scene.close("mujoco");
    scene.finish()
}

/// Points whose hull is the solid, for solids that MuJoCo has no word for.
fn hull_points(solid: &Solid) -> Option<Vec<Point3<f64>>> {
    match solid {
        Solid::Hull(points) => Some(points.to_vec()),
        Solid::Mesh(mesh) => {
            let hull = prehend_geometry::convex_hull(mesh.vertices()).ok();
            Some(hull.map_or_else(|| mesh.vertices().to_vec(), |h| corners(&h)))
        }
        _ => None,
    }
}

/// XML under way.
struct Scene<'a> {
    hand: &'a Hand,
    writer: Writer<Vec<u8>>,
    children: BTreeMap<LinkIdx, Vec<LinkIdx>>,
    /// Joints in the order in which MuJoCo numbers them: depth first.
    joint_order: Vec<JointIdx>,
}

impl<'a> Scene<'a> {
    fn new(hand: &'a Hand) -> Self {
        let mut children: BTreeMap<LinkIdx, Vec<LinkIdx>> = BTreeMap::new();
        for link in (0..hand.links().len()).map(LinkIdx) {
            if let Some(parent) = hand.parent(link) {
                children.entry(parent).or_default().push(link);
            }
        }
        Self {
            hand,
            writer: Writer::new_with_indent(Vec::new(), b' ', 1),
            children,
            joint_order: Vec::new(),
        }
    }

    fn finish(self) -> Result<String, Error> {
        String::from_utf8(self.writer.into_inner()).map_err(Error::input)
    }

    fn write(&mut self, event: Event<'_>) {
        // A vector takes every byte.
        let _ = self.writer.write_event(event);
    }

    fn start(name: &str, attributes: &[(&str, String)]) -> BytesStart<'static> {
        let mut start = BytesStart::new(name.to_owned());
        for (key, value) in attributes {
            start.push_attribute((*key, value.as_str()));
        }
        start
    }

    fn open(&mut self, name: &str, attributes: &[(&str, String)]) {
        let start = Self::start(name, attributes);
        self.write(Event::Start(start));
    }

    fn empty(&mut self, name: &str, attributes: &[(&str, String)]) {
        let start = Self::start(name, attributes);
        self.write(Event::Empty(start));
    }

    fn close(&mut self, name: &str) {
        self.write(Event::End(BytesEnd::new(name.to_owned())));
    }

    fn mesh(&mut self, name: &str, points: &[Point3<f64>]) {
        let mut vertex = String::new();
        for p in points {
            let _ = write!(vertex, "{} {} {} ", p.x, p.y, p.z);
        }
        self.empty(
            "mesh",
            &[
                ("name", name.to_owned()),
                ("vertex", vertex.trim_end().to_owned()),
            ],
        );
    }

    fn object(&mut self, object: &Object, pieces: &Pieces) {
        let total: f64 = pieces.pieces.iter().map(|(_, volume)| volume).sum();
        let mass = object
            .mass
            .unwrap_or(DENSITY * total / (1.0 + pieces.volume_deviation));
        self.open("body", &[("name", "object".into())]);
        self.empty("freejoint", &[("name", "object".into())]);
        let uniform = mass_properties(&object.mesh);
        // Where the object's file says where its mass is, the pieces do not.
        if let Some(center) = object.center_of_mass.filter(|_| uniform.volume > 0.0) {
            let inertia = uniform.inertia * (mass / uniform.volume);
            let [xx, yy, zz] = [inertia.m11, inertia.m22, inertia.m33];
            let [xy, xz, yz] = [inertia.m12, inertia.m13, inertia.m23];
            self.empty(
                "inertial",
                &[
                    ("pos", format!("{} {} {}", center.x, center.y, center.z)),
                    ("mass", mass.to_string()),
                    (
                        "fullinertia",
                        format!("{xx:e} {yy:e} {zz:e} {xy:e} {xz:e} {yz:e}"),
                    ),
                ],
            );
        }
        for (k, (_, volume)) in pieces.pieces.iter().enumerate() {
            self.empty(
                "geom",
                &[
                    ("name", format!("piece_{k}")),
                    ("type", "mesh".into()),
                    ("mesh", format!("piece_{k}")),
                    ("mass", (mass * volume / total).to_string()),
                    ("rgba", "0.8 0.6 0.3 1".into()),
                ],
            );
        }
        self.close("body");
    }

    /// A link with all that hangs on it.
    fn link(
        &mut self,
        link: LinkIdx,
        world_from_root: Option<&Isometry3<f64>>,
        zero: Option<&prehend_hand::LinkPoses>,
    ) -> Result<(), Error> {
        let hand = self.hand;
        let own_zero;
        let zero = if let Some(zero) = zero {
            zero
        } else {
            // Poses at position 0 of every joint, whatever the limits: what MJCF's bodies are placed by.
            own_zero = at_zero(hand);
            &own_zero
        };
        let part = hand.link(link);
        let placed = match (world_from_root, hand.parent(link)) {
            (Some(pose), _) => *pose,
            (None, Some(parent)) => match hand.joints().iter().find(|j| j.child == link) {
                Some(joint) => joint.parent_from_joint,
                None => zero.root_from_link(parent).inv_mul(&zero.root_from_link(link)),
            },
            (None, None) => Isometry3::identity(),
        };
        let mut attributes = vec![
            ("name", format!("hand/{}", part.name)),
            ("gravcomp", "1".to_owned()),
        ];
        attributes.extend(pose_attributes(&placed));
        self.open("body", &attributes);
        let mass = part.mass.unwrap_or(LINK_MASS);
        let inertia = (mass * GYRATION * GYRATION).max(1e-6);
        self.empty(
            "inertial",
            &[
                ("pos", "0 0 0".into()),
                ("mass", mass.to_string()),
                ("diaginertia", format!("{inertia} {inertia} {inertia}")),
            ],
        );
        if let Some(idx) = hand.joints().iter().position(|j| j.child == link) {
            let joint = &hand.joints()[idx];
            self.joint_order.push(JointIdx(idx));
            let slides = joint.kind == JointKind::Prismatic;
            let axis = joint.axis;
            let mut attributes = vec![
                ("name", joint.name.clone()),
                ("type", if slides { "slide" } else { "hinge" }.to_owned()),
                ("axis", format!("{} {} {}", axis.x, axis.y, axis.z)),
                ("damping", if slides { "100" } else { "0.1" }.to_owned()),
                ("armature", if slides { "0.1" } else { "0.001" }.to_owned()),
            ];
            if joint.kind != JointKind::Continuous && joint.upper > joint.lower {
                attributes.push(("range", format!("{} {}", joint.lower, joint.upper)));
            }
            self.empty("joint", &attributes);
        }
        for (k, placed) in part.collision.iter().enumerate() {
            let name = format!("link_{}_{k}", link.0);
            let mut attributes = vec![("name", name.clone())];
            attributes.extend(pose_attributes(&placed.link_from_solid));
            let mut shape = |kind: &str, size: String| {
                attributes.push(("type", kind.to_owned()));
                attributes.push(("size", size));
            };
            match &placed.solid {
                Solid::Sphere { radius } => shape("sphere", radius.to_string()),
                Solid::Capsule { half_length, radius } => shape("capsule", format!("{radius} {half_length}")),
                Solid::Cylinder { half_length, radius } => {
                    shape("cylinder", format!("{radius} {half_length}"));
                }
                Solid::Cuboid { half_extents: h } => shape("box", format!("{} {} {}", h.x, h.y, h.z)),
                Solid::Hull(_) | Solid::Mesh(_) => {
                    attributes.push(("type", "mesh".into()));
                    attributes.push(("mesh", name));
                }
            }
            self.empty("geom", &attributes);
        }
        for child in self.children.get(&link).cloned().unwrap_or_default() {
            self.link(child, None, Some(zero))?;
        }
        self.close("body");
        Ok(())
    }
}

fn at_zero(hand: &Hand) -> prehend_hand::LinkPoses {
    // Links that fixed joints hold together stand the same way in every posture.
    hand.link_poses(&hand.joint_positions_from_slice(&vec![0.0; hand.joints().len()]))
}

fn pose_attributes(pose: &Isometry3<f64>) -> [(&'static str, String); 2] {
    let (t, q) = (pose.translation.vector, pose.rotation);
    [
        ("pos", format!("{} {} {}", t.x, t.y, t.z)),
        ("quat", format!("{} {} {} {}", q.w, q.i, q.j, q.k)),
    ]
}
