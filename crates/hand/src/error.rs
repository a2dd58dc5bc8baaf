//! Why a hand could not be read, described or posed.

/// Why a hand could not be read, described or posed.
///
/// Messages name the element (joint, link, file or key), what was found, what was expected, and what to try.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum HandError {
    /// The text is not a URDF.
    #[error("URDF, {place}: {reason}")]
    Urdf {
        /// The element, with its line where known, for example ``joint `index_mcp` (line 12)``.
        place: String,
        /// What is wrong there.
        reason: String,
    },

    /// Two links or two joints share a name.
    #[error("two {what}s are named `{name}`; rename one of them")]
    DuplicateName {
        /// `link` or `joint`.
        what: &'static str,
        /// The shared name.
        name: String,
    },

    /// A joint names a link that does not exist.
    #[error("joint `{joint}`: its {role} link `{link}` does not exist; define the link or correct the name")]
    UnknownLink {
        /// The joint.
        joint: String,
        /// `parent` or `child`.
        role: &'static str,
        /// The link that it names.
        link: String,
    },

    /// A link hangs on two joints.
    #[error(
        "link `{link}` is the child of both joint `{first}` and joint `{second}`; a hand is a tree, \
         so model a closed chain with a mimic joint"
    )]
    TwoParents {
        /// The link.
        link: String,
        /// One joint that leads to it.
        first: String,
        /// The other.
        second: String,
    },

    /// Joints lead in a circle.
    #[error("the joints form a loop through link `{link}`; a hand is a tree with one root link")]
    Loop {
        /// A link on the loop.
        link: String,
    },

    /// More than one link has no parent.
    #[error("links `{first}` and `{second}` both have no parent joint; a hand is one tree, so join them")]
    TwoRoots {
        /// A link without parent.
        first: String,
        /// Another one.
        second: String,
    },

    /// A joint type that a hand's posture cannot describe by one number.
    #[error(
        "joint `{joint}` is of type {found}; expected revolute, continuous, prismatic or fixed \
         (use several single-axis joints instead)"
    )]
    JointType {
        /// The joint.
        joint: String,
        /// Its type.
        found: String,
    },

    /// A number in the URDF is NaN or infinite, or has no meaning where it stands.
    #[error("{place}: {what} is {found}; expected {expected}")]
    Value {
        /// The element, for example ``link `palm` ``.
        place: String,
        /// Which of its values.
        what: &'static str,
        /// What stands there.
        found: String,
        /// What may stand there.
        expected: &'static str,
    },

    /// A joint that needs limits has none.
    #[error(
        "joint `{joint}` ({kind}) has no range: its limits are missing or both 0; \
         add <limit lower=\"…\" upper=\"…\"/> or make it continuous or fixed"
    )]
    NoLimits {
        /// The joint.
        joint: String,
        /// `revolute` or `prismatic`.
        kind: &'static str,
    },

    /// A joint mimics one that does not exist or does not move.
    #[error("joint `{joint}` mimics `{leader}`, which is {found}; expected the name of a movable joint")]
    MimicUnknown {
        /// The mimic joint.
        joint: String,
        /// What it names.
        leader: String,
        /// `not a joint` or `a fixed joint`.
        found: &'static str,
    },

    /// Mimic joints follow each other in a circle.
    #[error(
        "joint `{joint}` mimics itself, directly or through others; let one joint of the circle move freely"
    )]
    MimicLoop {
        /// A joint on the circle.
        joint: String,
    },

    /// A mesh file was not found by the resolver.
    #[error("link `{link}`: mesh `{file}` cannot be had: {reason}")]
    MeshMissing {
        /// The link.
        link: String,
        /// The file's name as the URDF gives it.
        file: String,
        /// What the resolver said.
        reason: String,
    },

    /// A mesh file is of a format that is not read, or broken.
    #[error("link `{link}`: mesh `{file}` cannot be read: {reason}")]
    MeshUnreadable {
        /// The link.
        link: String,
        /// The file's name as the URDF gives it.
        file: String,
        /// What is wrong, and what to try.
        reason: String,
    },

    /// How the hand grasps cannot be worked out from its URDF.
    #[error("how this closes cannot be worked out: {reason}")]
    NotAHand {
        /// What is missing.
        reason: String,
    },

    /// A posture names a joint that the hand does not have.
    #[error("`{joint}` is not a movable joint of `{hand}`; it has {known}")]
    UnknownJoint {
        /// The hand's name.
        hand: String,
        /// The name given.
        joint: String,
        /// The joints there are, comma separated.
        known: String,
    },

    /// A posture puts a joint outside its limits, or gives a value that is no number.
    #[error("joint `{joint}` is set to {value}, outside its limits [{lower}, {upper}]")]
    OutOfLimits {
        /// The joint.
        joint: String,
        /// The value given, rad or m.
        value: f64,
        /// Lower limit.
        lower: f64,
        /// Upper limit.
        upper: f64,
    },

    /// A posture sets a mimic joint to something else than its leader demands.
    #[error(
        "joint `{joint}` is set to {value}, but it mimics `{leader}`, which puts it at {expected}; leave it out"
    )]
    MimicMismatch {
        /// The mimic joint.
        joint: String,
        /// The value given.
        value: f64,
        /// The joint that it follows.
        leader: String,
        /// Where it stands.
        expected: f64,
    },

    /// `hand.toml` is not TOML, lacks a key, or has one that means nothing.
    #[error("hand.toml: {reason}")]
    Toml {
        /// The parser's words, with line and column.
        reason: String,
    },

    /// `hand.toml` names a link or joint that the URDF does not have.
    #[error("hand.toml, {key}: `{name}` is not a {what} of the URDF; it has {known}")]
    UnknownName {
        /// The key, for example `finger[2].links`.
        key: String,
        /// The name found.
        name: String,
        /// `link`, `movable joint` or `free joint`.
        what: &'static str,
        /// The names there are, comma separated.
        known: String,
    },

    /// A value in `hand.toml` does not fit.
    #[error("hand.toml, {key}: found {found}; expected {expected}")]
    Description {
        /// The key, for example `palm.approach`.
        key: String,
        /// What stands there.
        found: String,
        /// What may stand there.
        expected: &'static str,
    },
}
