//! What `hand.toml` could say of a hand, worked out from its shape and kinematics.
//!
//! ```text
//! tree ──▶ palm, fingers ──▶ closing directions, sides that oppose ──▶ palm frame ──▶ pre-shapes ──▶ opening width
//! ```

use std::collections::BTreeSet;

use crate::{Closing, Description, Finger, Hand, HandError, JointIdx, LinkIdx};

mod anatomy;
mod closing;
mod frame;
mod opening;
mod overlap;
mod preshapes;
mod text;
mod tree;
mod wrap;

use anatomy::{Anatomy, not_a_hand};
use closing::{LEAST_OPPOSITION, Motion};
use overlap::LinkSolids;
use preshapes::{FEWEST, Preshapes, Spread};
use wrap::Wraps;

/// A description of a hand that nobody wrote, and how each part of it was come by.
#[derive(Debug, Clone, PartialEq)]
pub struct Proposal {
    /// The description.
    pub description: Description,
    /// What was guessed, in the order of `hand.toml`.
    pub guesses: Vec<Guess>,
    /// Pairs of links that may overlap, and why; those that a joint joins are left out.
    pub exempt: Vec<(LinkIdx, LinkIdx, &'static str)>,
}

/// Something in `hand.toml` that was guessed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Guess {
    /// The key of `hand.toml`.
    pub key: &'static str,
    /// What was found.
    pub found: String,
    /// How it was come by.
    pub because: String,
    /// How sure it is.
    pub confidence: Confidence,
}

/// How sure a guess is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Confidence {
    /// Look at it before relying on it.
    Low,
    /// Probably right.
    Medium,
    /// Follows from the URDF.
    High,
}

impl Confidence {
    /// `low`, `medium` or `high`.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Low => "low",
            Self::Medium => "medium",
            Self::High => "high",
        }
    }

    fn of_margin(margin: f64) -> Self {
        match margin {
            m if m > 0.25 => Self::High,
            m if m > 0.08 => Self::Medium,
            _ => Self::Low,
        }
    }
}

impl Hand {
    /// Works out how the hand grasps: palm, fingers, closing directions, the palm's frame, pre-shapes, opening width,
    /// and which links may touch or overlap.
    ///
    /// - The palm is where the tree of moving parts first branches; a finger is a way from there to a part that carries
    ///   no further one. Shorter ways that the same joints drive are linkages.
    /// - A finger's largest set of parallel axes flexes it; its other joints keep the pre-shape. All flexing joints close
    ///   in the directions that bring fingers nearest each other and the palm, on the whole way from one limit to the
    ///   other.
    /// - Fingers are split into two sides so that fingers of different sides approach each other most; the smaller side
    ///   is the thumb's.
    /// - The palm's z is the one of its own axes, across the axes of flexion, along which the fingers can close around the
    ///   most of 24 cylinders of different sizes and heights on the palm; x is the line on which they close.
    /// - Pre-shapes: where the fingers closed around a cylinder they open again a little; the first principal direction of
    ///   these postures is the extension. The spread fans the fingertips out with the joints
    ///   that do not close, as far as the sides still oppose; without such joints it is the second principal direction.
    ///   Both are limited to where pre-shapes do not collide with themselves.
    /// - Pairs of links are exempt from self-collision where they move as one, are neighbours, or overlap in each of 200
    ///   postures that fill the joints' ranges evenly.
    ///
    /// A description that the hand has is not looked at.
    ///
    /// # Errors
    ///
    /// [`HandError::NotAHand`] where no link has a shape, no joint moves one, or closing brings nothing together.
    pub fn propose_description(&self) -> Result<Proposal, HandError> {
        let anatomy = Anatomy::new(self)?;
        let motion = Motion::new(&anatomy);
        if motion.opposition <= LEAST_OPPOSITION {
            return Err(not_a_hand(
                "moving its joints brings no finger nearer to another one or to the palm; check joint limits and axes",
            ));
        }
        let (frame, wraps) = frame::palm_frame(&anatomy, &motion);
        let mut preshapes = Preshapes::new(&anatomy, &motion, &wraps);
        let solids = LinkSolids::new(&anatomy);
        let exempt = solids.exempt();
        let mut pairs: BTreeSet<(LinkIdx, LinkIdx)> = exempt.iter().map(|e| e.pair).collect();
        for attachment in &self.attachments {
            let (a, b) = (attachment.parent, attachment.child);
            pairs.insert((a.min(b), a.max(b)));
        }
        let description = |preshapes: &Preshapes, opening_width: f64| Description {
            palm: frame.palm,
            fingers: fingers(&anatomy, &motion),
            contact_links: anatomy.contact_links(),
            closing: (0..self.joints.len())
                .filter(|&j| motion.direction[j] != 0.0)
                .map(|j| Closing {
                    joint: JointIdx(j),
                    speed: motion.direction[j],
                })
                .collect(),
            materials: materials(&anatomy),
            eigengrasps: preshapes.eigengrasps.clone(),
            origin: self.joint_positions_from_slice(&preshapes.origin),
            opening_width,
            self_collision_exempt: pairs.iter().copied().collect(),
            // A URDF's mimic joints are rigid.
            break_away: Vec::new(),
        };
        let mut described = self.clone();
        described.description = Some(description(&preshapes, 0.1));
        preshapes.keep_free(&described, &solids, &pairs);
        described.description = Some(description(&preshapes, 0.1));
        let width = opening::opening_width(&anatomy, &described, &motion.thumb_side).max(wraps.widest_held);
        let width_known = width > 1e-3;
        // A hand whose sides never stand apart on the palm's x still needs a width.
        let width = if width_known {
            width
        } else {
            motion.gaps.iter().copied().fold(1e-3, f64::max)
        };
        let description = description(&preshapes, (width * 1e4).round() / 1e4);
        let guesses = guesses(
            &anatomy,
            &motion,
            frame.margin,
            &wraps,
            &preshapes,
            &description,
            width_known,
        );
        Ok(Proposal {
            description,
            guesses,
            exempt: exempt
                .into_iter()
                .map(|e| (e.pair.0, e.pair.1, e.because))
                .collect(),
        })
    }
}

fn fingers(anatomy: &Anatomy<'_>, motion: &Motion) -> Vec<Finger> {
    let n_thumbs = motion.thumb_side.iter().filter(|t| **t).count();
    let is_gripper = anatomy.fingers.len() == 2 * n_thumbs;
    let (mut thumbs, mut others) = (0, 0);
    anatomy
        .fingers
        .iter()
        .zip(&motion.thumb_side)
        .map(|(chain, thumb)| {
            let name = if *thumb && !is_gripper {
                thumbs += 1;
                if n_thumbs == 1 {
                    "thumb".to_owned()
                } else {
                    format!("thumb_{thumbs}")
                }
            } else {
                others += 1;
                format!("finger_{others}")
            };
            Finger {
                name,
                joints: chain.joints.clone(),
                links: chain.links.clone(),
            }
        })
        .collect()
}

/// Fingertips are rubber, the rest plastic: a URDF says nothing of it.
fn materials(anatomy: &Anatomy<'_>) -> Vec<String> {
    let mut materials = vec!["plastic".to_owned(); anatomy.hand.links.len()];
    for finger in &anatomy.fingers {
        let moved_by = anatomy.hand.joints_to(finger.tip_link);
        for link in &finger.links {
            if anatomy.hand.joints_to(*link) == moved_by {
                "rubber".clone_into(&mut materials[link.0]);
            }
        }
    }
    materials
}

fn guesses(
    anatomy: &Anatomy<'_>,
    motion: &Motion,
    frame_margin: f64,
    wraps: &Wraps,
    preshapes: &Preshapes,
    description: &Description,
    width_known: bool,
) -> Vec<Guess> {
    let hand = anatomy.hand;
    let link = |l: &LinkIdx| hand.link(*l).name.as_str();
    let joint = |j: &JointIdx| hand.joint(*j).name.as_str();
    let mut guesses = Vec::new();
    let mut guess = |key, found: String, because: &str, confidence| {
        guesses.push(Guess {
            key,
            found,
            because: because.to_owned(),
            confidence,
        });
    };
    let chains: Vec<String> = description
        .fingers
        .iter()
        .map(|f| {
            format!(
                "{} ({})",
                f.name,
                f.joints.iter().map(joint).collect::<Vec<_>>().join(", ")
            )
        })
        .collect();
    let linkages = match anatomy.n_linkages {
        0 => String::new(),
        n => format!("; {n} shorter chains that the same joints drive are linkages"),
    };
    guess(
        "finger",
        chains.join(", "),
        &format!("chains of joints from the palm to links that carry no further ones{linkages}"),
        if anatomy.fingers.len() > 1 {
            Confidence::High
        } else {
            Confidence::Low
        },
    );
    let closing: Vec<String> = description
        .closing
        .iter()
        .map(|c| format!("{}{}", if c.speed < 0.0 { "-" } else { "+" }, joint(&c.joint)))
        .collect();
    guess(
        "closing",
        closing.join(" "),
        &format!(
            "parallel axes flex a finger; these directions bring fingers nearest each other and the palm, {:.0} % more than the next best",
            100.0 * motion.margin
        ),
        Confidence::of_margin(motion.margin),
    );
    let z = description.palm.link_from_palm.rotation * nalgebra::Vector3::z();
    let x = description.palm.link_from_palm.rotation * nalgebra::Vector3::x();
    guess(
        "palm",
        format!(
            "`{}`, approach [{:.2}, {:.2}, {:.2}], closing [{:.2}, {:.2}, {:.2}]",
            link(&description.palm.link),
            z.x,
            z.y,
            z.z,
            x.x,
            x.y,
            x.z
        ),
        &format!(
            "the largest link at which the chains branch; approached like this, the fingers hold {} of {} cylinders on it",
            wraps.n_held, wraps.n_cylinders
        ),
        Confidence::of_margin(frame_margin),
    );
    let width = format!("{} m", description.opening_width);
    if width_known {
        guess(
            "opening_width",
            width,
            "the widest cylinder across the palm that both sides reach around, over all pre-shapes, or that closing held",
            Confidence::Medium.min(Confidence::of_margin(frame_margin)),
        );
    } else {
        guess(
            "opening_width",
            width,
            "the sides never stand apart along the palm's x, so it is the widest gap between fingertips",
            Confidence::Low,
        );
    }
    let extension = match preshapes.n_cylinders {
        n if n >= FEWEST => format!(
            "the first principal direction ({:.0} % of the variance) of {n} postures from which the hand closes around cylinders",
            100.0 * preshapes.explained
        ),
        _ => "the straight way from open to closed: the fingers reach around no cylinder on the palm"
            .to_owned(),
    };
    let sure = if preshapes.n_cylinders >= 8 {
        Confidence::Medium
    } else {
        Confidence::Low
    };
    guess("eigengrasp extension", amplitudes(preshapes, 1), &extension, sure);
    let (spread, sure) = match preshapes.spread {
        Spread::Joints => (
            "the joints that do not close, each the way that fans the fingertips out, as far as the sides still oppose",
            Confidence::Medium,
        ),
        Spread::SecondDirection => (
            "no joint spreads the fingers, so it is the second principal direction of those postures",
            Confidence::Low,
        ),
        Spread::SameDirection => (
            "the hand moves in one direction only, which both eigengrasps share",
            Confidence::Low,
        ),
    };
    guess("eigengrasp spread", amplitudes(preshapes, 0), spread, sure);
    guess(
        "material",
        "fingertips rubber, the rest plastic".to_owned(),
        "a URDF says nothing of materials",
        Confidence::Low,
    );
    guesses
}

fn amplitudes(preshapes: &Preshapes, k: usize) -> String {
    let e = &preshapes.eigengrasps[k];
    format!("amplitudes {:.3} to {:.3}", e.lower, e.upper)
}
