//! Why the quality of a grasp could not be computed.

/// Why the quality of a grasp could not be computed. A grasp that merely does not hold is a value, never an error.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum QualityError {
    /// There is nothing to measure.
    #[error("the grasp has no contacts; give at least one")]
    NoContacts,

    /// A contact's point has a coordinate that is NaN or infinite.
    #[error("contact {contact_idx} has the point {point:?}; every coordinate must be finite")]
    BadPoint {
        /// Index of the contact, from 0.
        contact_idx: usize,
        /// The offending point.
        point: [f64; 3],
    },

    /// A contact's normal has no direction.
    #[error(
        "contact {contact_idx} has the normal {normal:?}; expected a vector of finite, non-zero length into the object"
    )]
    BadNormal {
        /// Index of the contact, from 0.
        contact_idx: usize,
        /// The offending normal.
        normal: [f64; 3],
    },

    /// A contact's friction coefficient is negative or not finite.
    #[error(
        "contact {contact_idx} has the friction coefficient mu = {mu}; expected a finite number, 0 or more"
    )]
    BadFriction {
        /// Index of the contact, from 0.
        contact_idx: usize,
        /// The offending coefficient.
        mu: f64,
    },

    /// A contact's torsion length is negative or not finite.
    #[error(
        "contact {contact_idx} has the torsion length {torsion}; expected a finite length, 0 for a point contact"
    )]
    BadTorsion {
        /// Index of the contact, from 0.
        contact_idx: usize,
        /// The offending length.
        torsion: f64,
    },

    /// The point that torques are taken about is not finite.
    #[error("the torque center is {center:?}; every coordinate must be finite")]
    BadCenter {
        /// The offending point.
        center: [f64; 3],
    },

    /// Torques are divided by this length, so it must be positive.
    #[error(
        "the torque scale is {torque_scale}; expected a positive, finite length, \
         such as the largest distance of the object's vertices from its center"
    )]
    BadTorqueScale {
        /// The offending length.
        torque_scale: f64,
    },

    /// A friction cone has too few or too many edges.
    #[error("a friction cone has {cone_edges} edges; expected 3 to {most}")]
    BadConeEdges {
        /// How many edges were asked for.
        cone_edges: usize,
        /// How many there may be.
        most: usize,
    },

    /// The force added to every wrench is not finite.
    #[error("the gravity force is {gravity:?}; every coordinate must be finite")]
    BadGravity {
        /// The offending force.
        gravity: [f64; 3],
    },

    /// Too few coordinates of a wrench count for a ball to have a radius.
    #[error("{found} of the wrench's six coordinates counts; expected 2 to 6")]
    TooFewAxes {
        /// How many count.
        found: usize,
    },

    /// A wrench metric is no ellipsoid.
    #[error("the wrench metric is not a finite, symmetric, positive definite 6 x 6 matrix")]
    BadMetric,

    /// A tolerance that no bounds can meet.
    #[error("the tolerance is {tolerance}; expected a positive, finite number")]
    BadTolerance {
        /// The offending tolerance.
        tolerance: f64,
    },

    /// A task asks for nothing.
    #[error("the task has no wrenches; give at least one")]
    NoTaskWrenches,

    /// A task's wrench has no direction.
    #[error("task wrench {wrench_idx} is {wrench:?}; expected a finite wrench other than zero")]
    BadTaskWrench {
        /// Index of the wrench, from 0.
        wrench_idx: usize,
        /// The offending wrench.
        wrench: [f64; 6],
    },

    /// The volume of a smooth wrench space has no exact value here.
    #[error("the volume needs cones with edges and sampled limit surfaces; give `cone` a number of edges")]
    SmoothVolume,

    /// A wrench left the range of floating-point numbers.
    #[error(
        "contact {contact_idx} makes a wrench that is not finite; check its point, mu and the torque scale"
    )]
    WrenchOverflow {
        /// Index of the contact, from 0.
        contact_idx: usize,
    },

    /// The polytope reached its bound on facets first.
    #[error(
        "{what} needs more than {facets} facets of the wrench hull; \
         use fewer contacts or cone edges, or the l1 norm"
    )]
    TooManyFacets {
        /// What was being computed: `epsilon` or `volume`.
        what: &'static str,
        /// The bound.
        facets: usize,
    },

    /// A standard deviation of [`crate::Uncertainty`] is none.
    #[error("uncertainty: `{name}` is {value}; expected a finite standard deviation of at least 0")]
    BadUncertainty {
        /// The field.
        name: &'static str,
        /// The value found.
        value: f64,
    },

    /// A distribution was asked for without samples.
    #[error("0 samples say nothing; ask for at least 1")]
    NoSamples,

    /// Contacts are to press with a force that is none.
    #[error("the grip is {grip} N; expected a positive, finite force")]
    BadGrip {
        /// The force asked for.
        grip: f64,
    },

    /// A name is not one of the materials.
    #[error("`{found}` is not a material; expected glass, metal, plastic, wood, rubber or stone")]
    UnknownMaterial {
        /// The name found.
        found: String,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_name_the_contact_and_what_was_expected() {
        let error = QualityError::BadNormal {
            contact_idx: 3,
            normal: [0.0, 0.0, 0.0],
        };
        assert_eq!(
            error.to_string(),
            "contact 3 has the normal [0.0, 0.0, 0.0]; expected a vector of finite, non-zero length into the object"
        );
        let error = QualityError::BadTorqueScale { torque_scale: 0.0 };
        assert_eq!(
            error.to_string(),
            "the torque scale is 0; expected a positive, finite length, \
             such as the largest distance of the object's vertices from its center"
        );
    }
}
