//! What `hand.toml` says of a hand: how it grasps.

use nalgebra::Isometry3;

use crate::{Hand, JointIdx, JointPositions, LinkIdx};

/// How a hand grasps: everything that its URDF does not say.
#[derive(Debug, Clone, PartialEq)]
pub struct Description {
    /// The palm's frame.
    pub palm: PalmFrame,
    /// The fingers, thumb among them, in the file's order.
    pub fingers: Vec<Finger>,
    /// The links that may touch the object, in order of their index.
    pub contact_links: Vec<LinkIdx>,
    /// The joints that close the hand, in order of their index.
    pub closing: Vec<Closing>,
    /// The material of each link, in the order of [`Hand::links`]: `rubber`, `plastic`, ….
    pub materials: Vec<String>,
    /// The two directions in joint space that pre-shapes are made of: first spread, then extension.
    pub eigengrasps: [Eigengrasp; 2],
    /// The posture that amplitudes (0, 0) stand for.
    pub origin: JointPositions,
    /// Width (m) of the widest object that the hand can close around, along the palm frame's x axis.
    pub opening_width: f64,
    /// Pairs of links whose overlap is not a collision, smaller index first, sorted. Links joined by a joint are
    /// always among them.
    pub self_collision_exempt: Vec<(LinkIdx, LinkIdx)>,
    /// Mimic joints whose coupling lets go: closing goes on with them when the joint that drives them has been stopped,
    /// and they may stand where their leaders would not put them. In order of their index.
    pub break_away: Vec<JointIdx>,
}

/// The frame in which a hand approaches: origin on the palm's surface, z out of the palm, x the closing direction
/// from the thumb towards the fingers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PalmFrame {
    /// The link that carries it.
    pub link: LinkIdx,
    /// Its pose in that link's frame.
    pub link_from_palm: Isometry3<f64>,
}

/// A finger.
#[derive(Debug, Clone, PartialEq)]
pub struct Finger {
    /// Its name.
    pub name: String,
    /// Its movable joints, from base to tip.
    pub joints: Vec<JointIdx>,
    /// Its links, from base to tip.
    pub links: Vec<LinkIdx>,
}

/// A joint that closes the hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closing {
    /// A free joint.
    pub joint: JointIdx,
    /// Speed relative to the others, never 0; its sign says in which direction the joint closes.
    pub speed: f64,
}

/// A direction in joint space.
#[derive(Debug, Clone, PartialEq)]
pub struct Eigengrasp {
    /// What it does: `spread` or `extension`.
    pub name: String,
    /// Length 1; one entry per free joint, in the order of [`Hand::free_joints`].
    pub direction: Vec<f64>,
    /// Least amplitude.
    pub lower: f64,
    /// Greatest amplitude.
    pub upper: f64,
}

impl Eigengrasp {
    /// The amplitude that stands for `x`, from −1 (least) to 1 (greatest).
    pub fn amplitude(&self, x: f64) -> f64 {
        f64::midpoint(self.lower, self.upper) + x.clamp(-1.0, 1.0) * (self.upper - self.lower) / 2.0
    }
}

impl Description {
    /// Whether two links may overlap without colliding.
    pub fn is_exempt(&self, a: LinkIdx, b: LinkIdx) -> bool {
        a == b
            || self
                .self_collision_exempt
                .binary_search(&(a.min(b), a.max(b)))
                .is_ok()
    }
}

impl Hand {
    /// The pre-shape of two eigengrasp coordinates in [−1, 1] (`egpc`), first spread (+ wider), second extension
    /// (+ more open).
    ///
    /// ```text
    /// q = origin + a₁ e₁ + a₂ e₂,   aᵢ = lowerᵢ + (egpcᵢ + 1)/2 · (upperᵢ − lowerᵢ)
    /// ```
    ///
    /// with every joint then moved into its limits and all mimic joints following. Coordinates outside [−1, 1] count as
    /// the nearest end.
    ///
    /// # Panics
    ///
    /// Where the hand has no description.
    pub fn preshape(&self, egpc: [f64; 2]) -> JointPositions {
        let description = self.described();
        let mut values = description.origin.0.clone();
        for (eigengrasp, x) in description.eigengrasps.iter().zip(egpc) {
            let amplitude = eigengrasp.amplitude(x);
            for (joint, entry) in self.free_joints().zip(&eigengrasp.direction) {
                values[joint.0] += amplitude * entry;
            }
        }
        self.coupled_positions(&values)
    }

    /// The palm frame's pose in the root link's frame.
    ///
    /// # Panics
    ///
    /// Where the hand has no description.
    pub fn root_from_palm(&self, positions: &JointPositions) -> Isometry3<f64> {
        let palm = &self.described().palm;
        self.link_pose(palm.link, positions) * palm.link_from_palm
    }

    /// The description, for what makes no sense without one.
    fn described(&self) -> &Description {
        self.description
            .as_ref()
            .expect("the hand has a description (`Hand::with_description`)")
    }
}
