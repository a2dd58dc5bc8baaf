//! Why a try gave no grasp.

use serde::{Deserialize, Serialize};

/// Why a try gave no grasp. The counts tell what to change: the pre-shapes, the boxes, the friction, the plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Reason {
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
    pub const ALL: [Self; 8] = [
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
}
