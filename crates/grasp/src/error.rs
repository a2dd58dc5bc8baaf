//! Why no grasp could be looked for at all.

/// Why no grasp could be looked for at all. A try that fails is no error but a [`crate::Reason`].
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GraspError {
    /// Without a description nobody knows where the palm is and which joints close.
    #[error(
        "hand `{hand}` has no description; add a `hand.toml` that names its palm, fingers and closing joints"
    )]
    NoDescription {
        /// The hand.
        hand: String,
    },

    /// A link's material is not in the friction table.
    #[error(
        "hand `{hand}`, link `{link}`: found the material `{found}`, expected one of {}",
        known_materials()
    )]
    UnknownMaterial {
        /// The hand.
        hand: String,
        /// The link.
        link: String,
        /// What its description says.
        found: String,
    },

    /// No link of the hand has a shape.
    #[error("hand `{hand}` has no link with collision geometry; nothing of it can touch an object")]
    NoShape {
        /// The hand.
        hand: String,
    },

    /// A link's shape cannot be used.
    #[error("hand `{hand}`, link `{link}`: {source}")]
    Shape {
        /// The hand.
        hand: String,
        /// The link.
        link: String,
        /// What is wrong with the shape.
        source: Box<prehend_geometry::GeometryError>,
    },

    /// The object has no boxes.
    #[error("the object has no boxes to start from; decompose it first")]
    NoBoxes,

    /// All vertices lie in the point that torques are taken about.
    #[error(
        "all vertices of the object lie at its wrench centre {center:?}; torques need a length to be divided by"
    )]
    NoExtent {
        /// The wrench centre.
        center: [f64; 3],
    },

    /// The plane, a coordinate or a posture is not a number.
    #[error("{what} is {value}; expected a finite number")]
    NotFinite {
        /// What it is.
        what: &'static str,
        /// What was found.
        value: f64,
    },

    /// There is nothing to try.
    #[error(
        "there is no try {try_idx}: no face of the object fits the hand's opening; try a hand that opens wider"
    )]
    NoSuchTry {
        /// The number asked for.
        try_idx: usize,
    },

    /// The progress callback asked to stop.
    #[error("stopped after {tried} tries, as asked")]
    Stopped {
        /// How many tries were finished, at least.
        tried: usize,
    },
}

fn known_materials() -> String {
    let names: Vec<_> = prehend_quality::Material::ALL.iter().map(|m| m.name()).collect();
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_name_the_thing_what_was_found_and_what_was_expected() {
        let error = GraspError::UnknownMaterial {
            hand: "claw".into(),
            link: "tip".into(),
            found: "cheese".into(),
        };
        assert_eq!(
            error.to_string(),
            "hand `claw`, link `tip`: found the material `cheese`, expected one of glass, metal, plastic, wood, rubber, stone"
        );
    }
}
