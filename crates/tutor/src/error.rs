//! Why a grasp could not be judged.

/// Why a grasp could not be judged. A grasp that suits no task is a value, never an error.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TutorError {
    /// The tutor has to know where the palm looks.
    #[error("the hand `{hand}` has no description; the tutor needs its palm frame, from `hand.toml`")]
    NoDescription {
        /// Name of the hand.
        hand: String,
    },

    /// There is no surface to judge by.
    #[error("the object's surface has an area of {area} m²; expected a positive, finite area")]
    NoSurface {
        /// The area found.
        area: f64,
    },

    /// The opening is not a disc.
    #[error(
        "the opening has the radius {radius} m and the normal {normal:?}; \
         expected a positive radius and a unit normal that points out of the vessel"
    )]
    BadOpening {
        /// The radius found.
        radius: f64,
        /// The normal found.
        normal: [f64; 3],
    },

    /// A link's shape cannot be used.
    #[error("link `{link}` has a shape that the tutor cannot place: {reason}")]
    BadLink {
        /// Name of the link.
        link: String,
        /// What is wrong with it.
        reason: String,
    },

    /// A name is not one of those that it could be.
    #[error("`{found}` is not a {what}; expected {expected}")]
    Unknown {
        /// What was looked for: `persona` or `task`.
        what: &'static str,
        /// The name found.
        found: String,
        /// The names there are.
        expected: &'static str,
    },
}
