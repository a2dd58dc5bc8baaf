//! Why a try gave no grasp.

use serde::{Deserialize, Serialize};

/// Why a try gave no grasp. The counts tell what to change: the pre-shapes, the boxes, the friction, the plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Reason {
    /// It was not closed: whoever asked does not want grasps from there.
    PassedOver,
    /// The pre-shape's links collide with each other.
    SelfCollision,
    /// The hand collides with the object where its approach starts.
    StartCollision,
    /// A link touches the object that, by the hand's description, may not.
    ForbiddenLink,
    /// Part of the hand is below the support plane.
    BelowSupportPlane,
    /// Nothing touches the object after closing.
    NoContact,
    /// A single contact is left, which can hold nothing.
    TooFewContacts,
    /// The palm ends outside the sphere on which its position is measured (`upos`).
    PalmOutsideSphere,
    /// The contacts do not resist every push.
    NotForceClosure,
}

impl Reason {
    /// Every reason, in the order in which a try is checked.
    pub const ALL: [Self; 9] = [
        Self::PassedOver,
        Self::SelfCollision,
        Self::StartCollision,
        Self::ForbiddenLink,
        Self::BelowSupportPlane,
        Self::NoContact,
        Self::TooFewContacts,
        Self::PalmOutsideSphere,
        Self::NotForceClosure,
    ];

    /// Its name in files and messages, for example `start-collision`.
    pub fn name(self) -> &'static str {
        match self {
            Self::PassedOver => "passed-over",
            Self::SelfCollision => "self-collision",
            Self::StartCollision => "start-collision",
            Self::ForbiddenLink => "forbidden-link",
            Self::BelowSupportPlane => "below-support-plane",
            Self::NoContact => "no-contact",
            Self::TooFewContacts => "too-few-contacts",
            Self::PalmOutsideSphere => "palm-outside-sphere",
            Self::NotForceClosure => "not-force-closure",
        }
    }

    /// What to look at where many tries end like this.
    pub fn hint(self) -> &'static str {
        match self {
            Self::PassedOver => {
                "proposals leave out what hardly serves the task: plan without them to see all grasps"
            }
            Self::SelfCollision => {
                "pre-shapes drive links of the hand through each other: narrow the eigengrasps' `limits` in hand.toml, or list \
                 links that always overlap under `self_collision_exempt`"
            }
            Self::StartCollision => {
                "the hand overlaps the object before it closes: a candidate stands too deep, or the object has walls that no \
                 approach gets around"
            }
            Self::ForbiddenLink => {
                "a link touches that is not among `contact_links` of hand.toml: add it there, or give the hand a pre-shape that \
                 keeps it away"
            }
            Self::BelowSupportPlane => {
                "the support plane is in the way: lower it, or lift or turn the object"
            }
            Self::NoContact => {
                "fingers close past the object: check its scale, the hand's `opening_width`, and that `[closing]` names every \
                 joint that bends"
            }
            Self::TooFewContacts => {
                "one contact only: the object is small or slim beside the fingers; try pre-shapes that are less open"
            }
            Self::PalmOutsideSphere => {
                "the palm ends farther than 0.30 m from the object's middle, where its position has no value: check the scale"
            }
            Self::NotForceClosure => {
                "contacts that cannot resist every push: more tries, more friction (`[material]` of hand.toml, `material` of the \
                 object), or more `contact_links`"
            }
        }
    }
}

impl std::fmt::Display for Reason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_and_display_use_the_same_names() {
        for reason in Reason::ALL {
            assert_eq!(serde_json::to_string(&reason).unwrap(), format!("\"{reason}\""));
        }
    }

    #[test]
    fn every_reason_has_a_hint_of_its_own() {
        let hints: std::collections::BTreeSet<_> = Reason::ALL.iter().map(|r| r.hint()).collect();
        assert_eq!(hints.len(), Reason::ALL.len());
        assert!(hints.iter().all(|h| !h.contains("  ")), "one line each");
    }
}
