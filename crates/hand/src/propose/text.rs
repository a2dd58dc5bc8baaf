//! The text of a proposed `hand.toml`.

use std::fmt::Write;

use nalgebra::Vector3;

use super::Proposal;
use crate::{Hand, JointIdx, LinkIdx};

impl Proposal {
    /// A commented `hand.toml` for `hand`, whose URDF stands beside it under this name. [`Hand::with_description`]
    /// reads it back.
    pub fn hand_toml(&self, hand: &Hand, urdf: &str) -> String {
        let mut out = String::new();
        // Writing to a string cannot fail.
        let _ = self.write(&mut out, hand, urdf);
        out
    }

    fn write(&self, out: &mut String, hand: &Hand, urdf: &str) -> std::fmt::Result {
        let d = &self.description;
        writeln!(
            out,
            "# How {} grasps: guessed from its URDF. Check what is marked as low; lengths in metres, angles in radians.",
            one_line(hand.name())
        )?;
        writeln!(out, "\nurdf = {}", quoted(urdf))?;
        self.comment(out, "opening_width")?;
        writeln!(out, "opening_width = {}", number(d.opening_width))?;
        writeln!(
            out,
            "\n# Links that may touch the object: the palm and all that it carries."
        )?;
        writeln!(out, "contact_links = [")?;
        for link in &d.contact_links {
            writeln!(out, "    {},", quoted(name(hand, *link)))?;
        }
        writeln!(out, "]")?;
        writeln!(
            out,
            "\n# Pairs of links whose overlap is no collision, beside those that a joint joins."
        )?;
        writeln!(out, "self_collision_exempt = [")?;
        for (a, b, because) in &self.exempt {
            writeln!(
                out,
                "    [{}, {}], # {because}",
                quoted(name(hand, *a)),
                quoted(name(hand, *b))
            )?;
        }
        writeln!(out, "]")?;

        self.comment(out, "palm")?;
        writeln!(
            out,
            "# Its frame: origin on its surface, z out of it (`approach`), x from the thumb's side to the other (`closing`)."
        )?;
        let palm = &d.palm.link_from_palm;
        writeln!(out, "[palm]\nlink = {}", quoted(name(hand, d.palm.link)))?;
        writeln!(out, "translation = {}", vector(&palm.translation.vector))?;
        writeln!(out, "approach = {}", vector(&(palm.rotation * Vector3::z())))?;
        writeln!(out, "closing = {}", vector(&(palm.rotation * Vector3::x())))?;

        self.comment(out, "material")?;
        writeln!(
            out,
            "# One of glass, metal, plastic, wood, rubber, stone. Rubber makes soft contacts."
        )?;
        writeln!(out, "[material]\ndefault = \"plastic\"\n[material.links]")?;
        for (link, material) in d.materials.iter().enumerate() {
            if material != "plastic" {
                writeln!(
                    out,
                    "{} = {}",
                    quoted(name(hand, LinkIdx(link))),
                    quoted(material)
                )?;
            }
        }

        self.comment(out, "finger")?;
        writeln!(out, "# Joints and links from base to tip.")?;
        for finger in &d.fingers {
            writeln!(out, "[[finger]]\nname = {}", quoted(&finger.name))?;
            let joints: Vec<String> = finger
                .joints
                .iter()
                .map(|j| quoted(&hand.joint(*j).name))
                .collect();
            let links: Vec<String> = finger.links.iter().map(|l| quoted(name(hand, *l))).collect();
            writeln!(
                out,
                "joints = [{}]\nlinks = [{}]\n",
                joints.join(", "),
                links.join(", ")
            )?;
        }

        self.comment(out, "closing")?;
        writeln!(
            out,
            "# Relative speeds; negative ones close towards the lower limit. Joints at 0 keep the pre-shape."
        )?;
        writeln!(out, "[closing]")?;
        for joint in hand.free_joints() {
            let speed = d
                .closing
                .iter()
                .find(|c| c.joint == joint)
                .map_or(0.0, |c| c.speed);
            writeln!(out, "{} = {}", quoted(&hand.joint(joint).name), number(speed))?;
        }

        writeln!(out, "\n# The posture that amplitudes (0, 0) stand for.\n[origin]")?;
        for joint in hand.free_joints() {
            let value = within(hand, joint, d.origin.get(joint));
            writeln!(out, "{} = {value}", quoted(&hand.joint(joint).name))?;
        }

        writeln!(
            out,
            "\n# Two directions in joint space; a pre-shape is origin + a1 e1 + a2 e2, clamped to the joints' limits. Directions are\n\
             # scaled to length 1 on reading, amplitudes stay within `limits`."
        )?;
        for (eigengrasp, key) in d
            .eigengrasps
            .iter()
            .zip(["eigengrasp spread", "eigengrasp extension"])
        {
            self.comment(out, key)?;
            writeln!(out, "[[eigengrasp]]\nname = {}", quoted(&eigengrasp.name))?;
            writeln!(
                out,
                "limits = [{}, {}]\n[eigengrasp.direction]",
                number(eigengrasp.lower),
                number(eigengrasp.upper)
            )?;
            for (joint, value) in hand.free_joints().zip(&eigengrasp.direction) {
                if value.abs() > 1e-6 {
                    writeln!(out, "{} = {}", quoted(&hand.joint(joint).name), number(*value))?;
                }
            }
        }
        Ok(())
    }

    /// How a key was come by, as a comment.
    fn comment(&self, out: &mut String, key: &str) -> std::fmt::Result {
        writeln!(out)?;
        for guess in self.guesses.iter().filter(|g| g.key == key) {
            let text = format!("Confidence {}: {}.", guess.confidence.as_str(), guess.because);
            for line in wrapped(&text) {
                writeln!(out, "# {line}")?;
            }
        }
        Ok(())
    }
}

fn name(hand: &Hand, link: LinkIdx) -> &str {
    &hand.link(link).name
}

/// A string as TOML writes it; as a key it also serves names with dots.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => out += &format!("\\u{:04X}", u32::from(c)),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

/// Text that may stand in a comment.
fn one_line(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect()
}

/// Six decimals are a micrometre, or a fifth of an arc second.
fn rounded(value: f64) -> f64 {
    let rounded = (value * 1e6).round() / 1e6;
    // Adding 0 turns -0 into 0.
    rounded + 0.0
}

fn number(value: f64) -> String {
    format!("{:?}", rounded(value))
}

fn vector(v: &Vector3<f64>) -> String {
    format!("[{}, {}, {}]", number(v.x), number(v.y), number(v.z))
}

/// A joint's value, rounded but never out of its limits.
fn within(hand: &Hand, joint: JointIdx, value: f64) -> String {
    let joint = hand.joint(joint);
    let value = rounded(value);
    format!("{:?}", value.clamp(joint.lower, joint.upper))
}

/// Lines of at most 110 characters.
fn wrapped(text: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let line = lines.last_mut().expect("never empty");
        if !line.is_empty() && line.len() + word.len() > 108 {
            lines.push(word.to_owned());
        } else {
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
    }
    lines
}
