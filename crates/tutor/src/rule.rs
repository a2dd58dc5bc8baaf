//! The rules, their thresholds, and how strictly each tutor takes them.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::{Task, TutorError};

/// One rule of the tutor. The variants stand in the order of their tasks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    /// Hand-over: enough of the surface stays far from the hand.
    SurfaceLeftFree,
    /// Hand-over: somewhere the receiver finds room for a hand that is neither sharp nor inside a vessel.
    PatchForReceiver,
    /// Hand-over: the fingers do not close around a vessel's handle and its wall at once.
    NotHandleAndWall,
    /// Hand-over, receiver-first only: the handle stays free for the receiver.
    HandleLeftFree,
    /// Pouring: no link reaches into the way of the liquid, in the opening or before it.
    OpeningClear,
    /// Pouring: the hand does not come from above the opening.
    ApproachOffOpening,
    /// Pouring: nothing touches the vessel's inside.
    InsideUntouched,
    /// Pouring: the palm is not level with the rim.
    PalmOffRim,
    /// Pouring: a hand from below has room to tilt.
    WristCanTilt,
    /// Tool-use: the contacts are on the handle.
    ContactsOnHandle,
    /// Tool-use: the palm is over the handle.
    PalmOverHandle,
    /// Tool-use: nothing touches the part that does the work.
    FunctionalUntouched,
    /// Tool-use: the hand closes across the tool, not along it.
    ClosesAcross,
    /// Tool-use: the hand does not come over the part that does the work.
    ApproachOffFunctional,
}

impl Rule {
    /// All rules, task by task.
    pub const ALL: [Self; 14] = [
        Self::SurfaceLeftFree,
        Self::PatchForReceiver,
        Self::NotHandleAndWall,
        Self::HandleLeftFree,
        Self::OpeningClear,
        Self::ApproachOffOpening,
        Self::InsideUntouched,
        Self::PalmOffRim,
        Self::WristCanTilt,
        Self::ContactsOnHandle,
        Self::PalmOverHandle,
        Self::FunctionalUntouched,
        Self::ClosesAcross,
        Self::ApproachOffFunctional,
    ];

    /// The task that it speaks about.
    pub fn task(self) -> Task {
        match self as usize {
            0..=3 => Task::HandOver,
            4..=8 => Task::Pouring,
            _ => Task::ToolUse,
        }
    }

    /// The name that files use, for example `opening-clear`.
    pub fn name(self) -> &'static str {
        self.described().0
    }

    /// What its margin measures, in words.
    pub fn margin_in_words(self) -> &'static str {
        self.described().1
    }

    /// The feature of a grasp that comes nearest to saying the same; the tutor never sees it.
    pub fn nearest_feature(self) -> &'static str {
        self.described().2
    }

    fn described(self) -> (&'static str, &'static str, &'static str) {
        match self {
            Self::SurfaceLeftFree => (
                "surface-left-free",
                "share of the surface farther than 30 mm from every link, over what is asked",
                "fvol: the volume, not the surface, that the contacts and the palm leave free",
            ),
            Self::PatchForReceiver => (
                "patch-for-receiver",
                "size of the best connected free patch relative to 60 × 30 mm, less 1",
                "fvol, size: no feature knows where the free part is, or what is sharp",
            ),
            Self::NotHandleAndWall => (
                "not-handle-and-wall",
                "1, less the fingers' contacts on whichever of handle and wall has fewer",
                "upos, cvex: none knows which part a contact is on",
            ),
            Self::HandleLeftFree => (
                "handle-left-free",
                "share of the handle farther than 30 mm from every link, over what is asked",
                "upos: on which side of the object the hand is",
            ),
            Self::OpeningClear => (
                "opening-clear",
                "how far the links keep from the liquid's way, less how far they reach into it (m)",
                "upos, egpc: where the hand is and how open, but not where its fingers end up",
            ),
            Self::ApproachOffOpening => (
                "approach-off-opening",
                "angle between the approach and straight into the opening, over what is asked (rad)",
                "dir: the palm's orientation",
            ),
            Self::InsideUntouched => (
                "inside-untouched",
                "1, or minus the contacts on the inside",
                "fvol: the tetrahedron of a finger inside covers less of the boxes",
            ),
            Self::PalmOffRim => (
                "palm-off-rim",
                "height of the palm over or under the rim as a share of the vessel's, over what is asked",
                "upos: how high the approach line meets the sphere",
            ),
            Self::WristCanTilt => (
                "wrist-can-tilt",
                "angle between the approach and straight out of the opening, over what is asked (rad)",
                "dir: the palm's orientation",
            ),
            Self::ContactsOnHandle => (
                "contacts-on-handle",
                "share of the contacts that are on the handle, over what is asked",
                "upos: how high on the tool the hand is",
            ),
            Self::PalmOverHandle => (
                "palm-over-handle",
                "how much nearer the handle is to the palm than anything else (m)",
                "upos: how high on the tool the hand is",
            ),
            Self::FunctionalUntouched => (
                "functional-untouched",
                "1, or minus the contacts on the functional part",
                "upos, fvol: where the hand is, and what its contacts enclose",
            ),
            Self::ClosesAcross => (
                "closes-across",
                "angle between the closing direction and the tool's axis, over what is asked (rad)",
                "dir: the palm's orientation",
            ),
            Self::ApproachOffFunctional => (
                "approach-off-functional",
                "angle between the approach and the way from functional part to handle, over what is asked (rad)",
                "dir: the palm's orientation",
            ),
        }
    }
}

impl std::fmt::Display for Rule {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// What the rules ask, and how soft each edge is. The defaults are frozen: they were set by looking at the prevalence
/// of labels only, before any model was trained on them.
///
/// A rule with the margin m and the softness τ says yes with probability 1 / (1 + exp(−m/τ)).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Thresholds {
    /// Surface farther than this (m) from every link is free.
    pub free_distance: f64,
    /// Least share of the surface that is free.
    pub free_share: f64,
    /// Least length and width (m) of the receiver's patch.
    pub patch: [f64; 2],
    /// Least share of the handle that is free (receiver-first).
    pub free_handle_share: f64,
    /// The liquid's way goes this far into the opening, in its radii.
    pub opening_depth: f64,
    /// … and this far out of it.
    pub opening_height: f64,
    /// How far (m) a link may reach into the liquid's way from its side.
    pub opening_reach: f64,
    /// Least angle (rad) between the approach and straight into the opening.
    pub opening_angle: f64,
    /// Least distance of the palm from the rim's height, as a share of the vessel's height.
    pub rim_share: f64,
    /// Least angle (rad) between the approach and straight out of the opening.
    pub tilt_angle: f64,
    /// Least share of the contacts on the handle.
    pub handle_share: f64,
    /// Least angle (rad) between the closing direction and the tool's axis.
    pub across_angle: f64,
    /// Least angle (rad) between the approach and the way from functional part to handle.
    pub functional_angle: f64,
    /// Softness τ of margins that are shares of a surface.
    pub soft_share: f64,
    /// Softness of the patch's relative size.
    pub soft_patch: f64,
    /// Softness of lengths, m.
    pub soft_length: f64,
    /// Softness of angles, rad.
    pub soft_angle: f64,
    /// Softness of counts of contacts.
    pub soft_count: f64,
    /// Softness of the palm's height as a share of the vessel's.
    pub soft_height: f64,
    /// Softness of the share of contacts.
    pub soft_contacts: f64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self {
            free_distance: 0.030,
            free_share: 0.45,
            patch: [0.060, 0.030],
            free_handle_share: 0.4,
            opening_depth: 1.0,
            opening_height: 0.75,
            opening_reach: 0.004,
            opening_angle: 45_f64.to_radians(),
            rim_share: 0.10,
            tilt_angle: 30_f64.to_radians(),
            handle_share: 0.9,
            across_angle: 30_f64.to_radians(),
            functional_angle: 45_f64.to_radians(),
            soft_share: 0.04,
            soft_patch: 0.15,
            soft_length: 0.002,
            soft_angle: 5_f64.to_radians(),
            soft_count: 0.2,
            soft_height: 0.02,
            soft_contacts: 0.02,
        }
    }
}

impl Thresholds {
    /// Softness τ of a rule's margin, in the margin's unit.
    pub fn softness(&self, rule: Rule) -> f64 {
        match rule {
            Rule::SurfaceLeftFree | Rule::HandleLeftFree => self.soft_share,
            Rule::PatchForReceiver => self.soft_patch,
            Rule::OpeningClear | Rule::PalmOverHandle => self.soft_length,
            Rule::NotHandleAndWall | Rule::InsideUntouched | Rule::FunctionalUntouched => self.soft_count,
            Rule::ApproachOffOpening
            | Rule::WristCanTilt
            | Rule::ClosesAcross
            | Rule::ApproachOffFunctional => self.soft_angle,
            Rule::PalmOffRim => self.soft_height,
            Rule::ContactsOnHandle => self.soft_contacts,
        }
    }
}

/// Who judges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Persona {
    /// Asks for one softness more of every rule.
    Strict,
    /// Forgives one softness of every rule.
    Lenient,
    /// Takes the rules as they are, and wants the handle of tools and mugs free for the receiver of a hand-over.
    ReceiverFirst,
}

impl Persona {
    /// All personas.
    pub const ALL: [Self; 3] = [Self::Strict, Self::Lenient, Self::ReceiverFirst];

    /// The name that files use: `strict`, `lenient`, `receiver-first`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Strict => "strict",
            Self::Lenient => "lenient",
            Self::ReceiverFirst => "receiver-first",
        }
    }

    /// What is added to every margin, in units of the rule's softness.
    pub(crate) fn leniency(self) -> f64 {
        match self {
            Self::Strict => -1.0,
            Self::Lenient => 1.0,
            Self::ReceiverFirst => 0.0,
        }
    }
}

impl std::fmt::Display for Persona {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Persona {
    type Err = TutorError;

    fn from_str(name: &str) -> Result<Self, TutorError> {
        Self::ALL
            .into_iter()
            .find(|p| p.name() == name)
            .ok_or_else(|| TutorError::Unknown {
                what: "persona",
                found: name.to_owned(),
                expected: "strict, lenient or receiver-first",
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_rule_has_its_own_name_and_stands_under_its_task() {
        let names: std::collections::BTreeSet<&str> = Rule::ALL.iter().map(|r| r.name()).collect();
        assert_eq!(names.len(), Rule::ALL.len());
        assert!(Rule::ALL.iter().enumerate().all(|(i, r)| *r as usize == i));
        assert_eq!(Rule::HandleLeftFree.task(), Task::HandOver);
        assert_eq!(Rule::OpeningClear.task(), Task::Pouring);
        assert_eq!(Rule::WristCanTilt.task(), Task::Pouring);
        assert_eq!(Rule::ContactsOnHandle.task(), Task::ToolUse);
    }

    #[test]
    fn personas_read_back() {
        for persona in Persona::ALL {
            assert_eq!(persona.name().parse(), Ok(persona));
        }
        assert_eq!(
            "kind".parse::<Persona>().unwrap_err().to_string(),
            "`kind` is not a persona; expected strict, lenient or receiver-first"
        );
    }
}
