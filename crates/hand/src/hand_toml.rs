//! The file format of `hand.toml`, and its checks.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;

use crate::{
    Closing, Description, Eigengrasp, Finger, Hand, HandError, JointIdx, JointPositions, LinkIdx, PalmFrame,
};

/// The name of the URDF that a `hand.toml` belongs to, relative to its folder; `None` where it names none.
///
/// # Errors
///
/// [`HandError::Toml`] where the text is not a hand description.
pub fn urdf_named_in(hand_toml: &str) -> Result<Option<String>, HandError> {
    Ok(parse(hand_toml)?.urdf)
}

impl Hand {
    /// Adds what `hand.toml` says of the hand. All keys but `urdf`, `self_collision_exempt`, `break_away` and
    /// `material.links` are needed; unknown keys are refused.
    ///
    /// ```toml
    /// urdf = "gripper.urdf"                    # beside this file
    /// opening_width = 0.08                     # m, the widest object the hand closes around, along the palm's x
    /// contact_links = ["palm", "left", "right"]             # which links may touch the object
    /// self_collision_exempt = [["left", "right"]]           # pairs that may overlap, beside those a joint joins
    /// break_away = []                          # mimic joints that close on when the joint that drives them is stopped
    ///
    /// [palm]
    /// link = "palm"
    /// translation = [0, 0, 0.05]               # m, in that link's frame: a point on the palm's surface
    /// approach = [0, 0, 1]                     # out of the palm: the palm frame's z
    /// closing = [1, 0, 0]                      # from the thumb towards the fingers: its x, made perpendicular to z
    /// # rpy = [0, 0, 0]                        # in place of the two directions
    ///
    /// [material]
    /// default = "plastic"
    /// links = { left = "rubber", right = "rubber" }
    ///
    /// [[finger]]                               # one for each finger, thumb among them
    /// name = "left"
    /// joints = ["left_joint"]                  # movable joints, from base to tip
    /// links = ["left"]                         # from base to tip
    ///
    /// [closing]                                # free joints: relative speed; the sign says which way closes
    /// left_joint = 1
    ///
    /// [origin]                                 # free joints: the posture of amplitudes (0, 0); not named: 0
    /// left_joint = 0.5
    ///
    /// [[eigengrasp]]                           # two: first spread (+ wider), then extension (+ more open)
    /// name = "spread"
    /// limits = [-1, 1]                         # amplitudes, along a direction of length 1
    /// direction = { left_joint = 1 }           # free joints; scaled to length 1 on reading
    /// ```
    ///
    /// # Errors
    ///
    /// A [`HandError`] that names the key: text that is no TOML, keys that are missing or unknown, names that the
    /// URDF does not have, directions without length, an origin outside the limits, numbers that are not finite.
    pub fn with_description(mut self, hand_toml: &str) -> Result<Self, HandError> {
        let file = parse(hand_toml)?;
        self.description = Some(Reader { hand: &self }.description(&file)?);
        Ok(self)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    urdf: Option<String>,
    opening_width: f64,
    contact_links: Vec<String>,
    #[serde(default)]
    self_collision_exempt: Vec<[String; 2]>,
    #[serde(default)]
    break_away: Vec<String>,
    palm: PalmEntry,
    material: MaterialEntry,
    finger: Vec<FingerEntry>,
    closing: BTreeMap<String, f64>,
    origin: BTreeMap<String, f64>,
    eigengrasp: Vec<EigengraspEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PalmEntry {
    link: String,
    translation: [f64; 3],
    rpy: Option<[f64; 3]>,
    approach: Option<[f64; 3]>,
    closing: Option<[f64; 3]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MaterialEntry {
    default: String,
    #[serde(default)]
    links: BTreeMap<String, String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FingerEntry {
    name: String,
    joints: Vec<String>,
    links: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EigengraspEntry {
    name: String,
    limits: [f64; 2],
    direction: BTreeMap<String, f64>,
}

fn parse(hand_toml: &str) -> Result<File, HandError> {
    toml::from_str(hand_toml).map_err(|error| HandError::Toml {
        reason: error.to_string().trim_end().to_owned(),
    })
}

fn wrong(key: impl Into<String>, found: impl std::fmt::Display, expected: &'static str) -> HandError {
    HandError::Description {
        key: key.into(),
        found: found.to_string(),
        expected,
    }
}

/// Turns the file's names into indices of one hand.
struct Reader<'a> {
    hand: &'a Hand,
}

impl Reader<'_> {
    fn description(&self, file: &File) -> Result<Description, HandError> {
        if !(file.opening_width.is_finite() && file.opening_width > 0.0) {
            return Err(wrong(
                "opening_width",
                file.opening_width,
                "a positive width in metres",
            ));
        }
        let contact_links: BTreeSet<LinkIdx> = self
            .links("contact_links", &file.contact_links)?
            .into_iter()
            .collect();
        if contact_links.is_empty() {
            return Err(wrong(
                "contact_links",
                "no link",
                "at least one link that may touch the object",
            ));
        }
        Ok(Description {
            palm: self.palm(&file.palm)?,
            fingers: self.fingers(&file.finger)?,
            contact_links: contact_links.into_iter().collect(),
            closing: self.closing(&file.closing)?,
            materials: self.materials(&file.material)?,
            origin: self.origin(&file.origin)?,
            eigengrasps: self.eigengrasps(&file.eigengrasp)?,
            opening_width: file.opening_width,
            self_collision_exempt: self.exempt(&file.self_collision_exempt)?,
            break_away: self.break_away(&file.break_away)?,
        })
    }

    fn palm(&self, entry: &PalmEntry) -> Result<PalmFrame, HandError> {
        let link = self.link("palm.link", &entry.link)?;
        finite("palm.translation", &entry.translation)?;
        let rotation = match (entry.rpy, entry.approach, entry.closing) {
            (Some(rpy), None, None) => {
                finite("palm.rpy", &rpy)?;
                UnitQuaternion::from_euler_angles(rpy[0], rpy[1], rpy[2])
            }
            (None, Some(approach), Some(closing)) => {
                let z = direction("palm.approach", approach)?;
                let along = direction("palm.closing", closing)?;
                let across = along - z * z.dot(&along);
                let x = across.try_normalize(1e-6).ok_or_else(|| {
                    wrong(
                        "palm.closing",
                        format!("{closing:?}"),
                        "a direction across `approach`",
                    )
                })?;
                let matrix = Matrix3::from_columns(&[x, z.cross(&x), z]);
                UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix))
            }
            _ => {
                return Err(wrong(
                    "palm",
                    "no orientation, or two",
                    "either `rpy`, or the directions `approach` (out of the palm) and `closing` (thumb to fingers)",
                ));
            }
        };
        let translation = Translation3::from(Vector3::from(entry.translation));
        Ok(PalmFrame {
            link,
            link_from_palm: Isometry3::from_parts(translation, rotation),
        })
    }

    fn fingers(&self, entries: &[FingerEntry]) -> Result<Vec<Finger>, HandError> {
        if entries.is_empty() {
            return Err(wrong("finger", "none", "at least one [[finger]]"));
        }
        let mut fingers: Vec<Finger> = Vec::with_capacity(entries.len());
        for (idx, entry) in entries.iter().enumerate() {
            let key = format!("finger[{idx}]");
            if fingers.iter().any(|f| f.name == entry.name) {
                return Err(wrong(
                    format!("{key}.name"),
                    format!("`{}` again", entry.name),
                    "a name of its own",
                ));
            }
            let joints_key = format!("{key}.joints");
            let joints = entry
                .joints
                .iter()
                .map(|name| self.joint(&joints_key, name))
                .collect::<Result<Vec<JointIdx>, _>>()?;
            let links = self.links(&format!("{key}.links"), &entry.links)?;
            if joints.is_empty() || links.is_empty() {
                return Err(wrong(key, "no joints or no links", "both, from base to tip"));
            }
            let tip = links[links.len() - 1];
            let on_the_way = self.hand.joints_to(tip);
            let mut way = on_the_way.iter();
            if !joints.iter().all(|joint| way.any(|on| on == joint)) {
                let way: Vec<&str> = on_the_way
                    .iter()
                    .map(|&j| self.hand.joint(j).name.as_str())
                    .collect();
                return Err(wrong(
                    joints_key,
                    format!(
                        "{:?}, while the way to `{}` is {way:?}",
                        entry.joints,
                        self.hand.link(tip).name
                    ),
                    "joints on the way to the last link, from base to tip",
                ));
            }
            fingers.push(Finger {
                name: entry.name.clone(),
                joints,
                links,
            });
        }
        Ok(fingers)
    }

    fn closing(&self, entries: &BTreeMap<String, f64>) -> Result<Vec<Closing>, HandError> {
        let mut closing = Vec::new();
        for (name, &speed) in entries {
            let joint = self.free_joint("closing", name)?;
            finite(&format!("closing.{name}"), &[speed])?;
            if speed != 0.0 {
                closing.push(Closing { joint, speed });
            }
        }
        if closing.is_empty() {
            return Err(wrong(
                "closing",
                "no joint with a speed",
                "at least one joint that closes the hand",
            ));
        }
        closing.sort_by_key(|c| c.joint);
        Ok(closing)
    }

    fn materials(&self, entry: &MaterialEntry) -> Result<Vec<String>, HandError> {
        let mut materials = vec![entry.default.clone(); self.hand.links.len()];
        for (name, material) in &entry.links {
            materials[self.link("material.links", name)?.0].clone_from(material);
        }
        Ok(materials)
    }

    fn origin(&self, entries: &BTreeMap<String, f64>) -> Result<JointPositions, HandError> {
        for (name, &value) in entries {
            let joint = self.hand.joint(self.free_joint("origin", name)?);
            if !(joint.lower <= value && value <= joint.upper) {
                let expected = "a position within the joint's limits";
                let found = format!("{value}, limits [{}, {}]", joint.lower, joint.upper);
                return Err(wrong(format!("origin.{name}"), found, expected));
            }
        }
        self.hand.positions(entries)
    }

    fn eigengrasps(&self, entries: &[EigengraspEntry]) -> Result<[Eigengrasp; 2], HandError> {
        let read = |idx: usize, entry: &EigengraspEntry| {
            let key = format!("eigengrasp[{idx}]");
            let [lower, upper] = entry.limits;
            if !(lower.is_finite() && upper.is_finite() && lower < upper) {
                let expected = "two finite amplitudes, the lower first";
                return Err(wrong(
                    format!("{key}.limits"),
                    format!("{:?}", entry.limits),
                    expected,
                ));
            }
            let direction_key = format!("{key}.direction");
            let mut by_joint = vec![0.0; self.hand.joints.len()];
            for (name, &value) in &entry.direction {
                finite(&format!("{direction_key}.{name}"), &[value])?;
                by_joint[self.free_joint(&direction_key, name)?.0] = value;
            }
            let length = by_joint.iter().map(|v| v * v).sum::<f64>().sqrt();
            if !(length.is_finite() && length > 1e-9) {
                return Err(wrong(
                    direction_key,
                    format!("length {length}"),
                    "a direction with some length",
                ));
            }
            let direction = self
                .hand
                .free_joints()
                .map(|joint| by_joint[joint.0] / length)
                .collect();
            Ok(Eigengrasp {
                name: entry.name.clone(),
                direction,
                lower,
                upper,
            })
        };
        let [spread, extension] = entries else {
            return Err(wrong(
                "eigengrasp",
                entries.len(),
                "two: first spread, then extension",
            ));
        };
        Ok([read(0, spread)?, read(1, extension)?])
    }

    fn exempt(&self, entries: &[[String; 2]]) -> Result<Vec<(LinkIdx, LinkIdx)>, HandError> {
        let mut pairs = BTreeSet::new();
        for (idx, pair) in entries.iter().enumerate() {
            let key = format!("self_collision_exempt[{idx}]");
            let (a, b) = (self.link(&key, &pair[0])?, self.link(&key, &pair[1])?);
            pairs.insert((a.min(b), a.max(b)));
        }
        for attachment in &self.hand.attachments {
            let (a, b) = (attachment.parent, attachment.child);
            pairs.insert((a.min(b), a.max(b)));
        }
        Ok(pairs.into_iter().collect())
    }

    fn break_away(&self, names: &[String]) -> Result<Vec<JointIdx>, HandError> {
        let mut joints = BTreeSet::new();
        for name in names {
            let joint = self.joint("break_away", name)?;
            if self.hand.joint(joint).mimic.is_none() {
                return Err(wrong(
                    "break_away",
                    format!("`{name}`, which mimics no other joint"),
                    "mimic joints only: a free joint always closes on by itself",
                ));
            }
            joints.insert(joint);
        }
        Ok(joints.into_iter().collect())
    }

    fn links(&self, key: &str, names: &[String]) -> Result<Vec<LinkIdx>, HandError> {
        names.iter().map(|name| self.link(key, name)).collect()
    }

    fn link(&self, key: &str, name: &str) -> Result<LinkIdx, HandError> {
        let known = || {
            self.hand
                .links
                .iter()
                .map(|l| l.name.as_str())
                .collect::<Vec<_>>()
                .join(", ")
        };
        self.hand
            .link_named(name)
            .ok_or_else(|| unknown(key, name, "link", known()))
    }

    fn joint(&self, key: &str, name: &str) -> Result<JointIdx, HandError> {
        let found = self.hand.joint_named(name);
        found.ok_or_else(|| unknown(key, name, "movable joint", self.hand.joint_names()))
    }

    fn free_joint(&self, key: &str, name: &str) -> Result<JointIdx, HandError> {
        let found = self
            .hand
            .joint_named(name)
            .filter(|&j| self.hand.joint(j).mimic.is_none());
        let known = || {
            self.hand
                .free_joints()
                .map(|j| self.hand.joint(j).name.as_str())
                .collect::<Vec<_>>()
                .join(", ")
        };
        found.ok_or_else(|| unknown(key, name, "free joint", known()))
    }
}

fn unknown(key: &str, name: &str, what: &'static str, known: String) -> HandError {
    HandError::UnknownName {
        key: key.to_owned(),
        name: name.to_owned(),
        what,
        known,
    }
}

fn finite(key: &str, numbers: &[f64]) -> Result<(), HandError> {
    match numbers.iter().find(|n| !n.is_finite()) {
        Some(n) => Err(wrong(key, n, "finite numbers")),
        None => Ok(()),
    }
}

fn direction(key: &str, vector: [f64; 3]) -> Result<Vector3<f64>, HandError> {
    finite(key, &vector)?;
    Vector3::from(vector)
        .try_normalize(1e-9)
        .ok_or_else(|| wrong(key, format!("{vector:?}"), "a non-zero direction"))
}
