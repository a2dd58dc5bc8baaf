//! Positions of all joints of a hand.

use std::collections::BTreeMap;

use crate::{Hand, HandError, JointIdx};

/// How far beyond a limit a given position may lie: what rounding to six decimals, or to single precision, does.
const LIMIT_SLACK: f64 = 1e-6;

/// One position (rad or m) per movable joint of a hand, in the order of [`Hand::joints`]; mimic joints stand where
/// their leaders put them, except those whose coupling lets go (`break_away`).
#[derive(Debug, Clone, PartialEq)]
pub struct JointPositions(pub(crate) Vec<f64>);

impl JointPositions {
    /// The positions, in the order of [`Hand::joints`].
    pub fn as_slice(&self) -> &[f64] {
        &self.0
    }

    /// One joint's position. Panics where the index comes from another hand.
    pub fn get(&self, joint: JointIdx) -> f64 {
        self.0[joint.0]
    }
}

impl Hand {
    /// A posture from joint names. Joints that are not named stand at 0 (or at the limit nearest to it), mimic joints
    /// follow.
    ///
    /// # Errors
    ///
    /// [`HandError::UnknownJoint`]; [`HandError::OutOfLimits`] for a value that is not finite or lies more than 1e-6
    /// outside; [`HandError::MimicMismatch`] where a mimic joint is given and does not stand where its leader puts
    /// it, unless its coupling lets go (`break_away`).
    pub fn positions(&self, by_name: &BTreeMap<String, f64>) -> Result<JointPositions, HandError> {
        let mut values: Vec<f64> = self
            .joints
            .iter()
            .map(|j| 0.0_f64.clamp(j.lower, j.upper))
            .collect();
        for (name, &value) in by_name {
            let Some(JointIdx(idx)) = self.joint_named(name) else {
                return Err(HandError::UnknownJoint {
                    hand: self.name.clone(),
                    joint: name.clone(),
                    known: self.joint_names(),
                });
            };
            let joint = &self.joints[idx];
            let inside = joint.lower - LIMIT_SLACK <= value && value <= joint.upper + LIMIT_SLACK;
            if !value.is_finite() || (!self.is_follower(idx) && !inside) {
                return Err(HandError::OutOfLimits {
                    joint: name.clone(),
                    value,
                    lower: joint.lower,
                    upper: joint.upper,
                });
            }
            values[idx] = value;
        }
        for (idx, joint) in self.joints.iter().enumerate() {
            if !(self.breaks_away(idx) && by_name.contains_key(&joint.name)) {
                self.follow(idx, &mut values);
            }
        }
        for (joint, &expected) in self.joints.iter().zip(&values) {
            if let (Some(mimic), Some(&value)) = (joint.mimic, by_name.get(&joint.name))
                && (value - expected).abs() > LIMIT_SLACK
            {
                return Err(HandError::MimicMismatch {
                    joint: joint.name.clone(),
                    value,
                    leader: self.joint(mimic.joint).name.clone(),
                    expected,
                });
            }
        }
        Ok(JointPositions(values))
    }

    /// A posture from one value per movable joint, in the order of [`Hand::joints`]: each is moved into its joint's
    /// limits, and mimic joints are put where their leaders demand, whatever stands in their place; those whose
    /// coupling lets go (`break_away`) keep their own value.
    ///
    /// # Panics
    ///
    /// Unless there is exactly one value per movable joint.
    pub fn joint_positions_from_slice(&self, values: &[f64]) -> JointPositions {
        assert_eq!(
            values.len(),
            self.joints.len(),
            "one position per movable joint of `{}`",
            self.name
        );
        let mut placed = self.within_limits(values);
        for idx in (0..placed.len()).filter(|idx| self.is_follower(*idx)) {
            self.follow(idx, &mut placed);
        }
        JointPositions(placed)
    }

    /// The same, with every mimic joint where its leader demands.
    pub(crate) fn coupled_positions(&self, values: &[f64]) -> JointPositions {
        let mut placed = self.within_limits(values);
        for idx in 0..placed.len() {
            self.follow(idx, &mut placed);
        }
        JointPositions(placed)
    }

    /// A posture by name, mimic joints among them: the inverse of [`Hand::positions`].
    pub fn positions_by_name(&self, positions: &JointPositions) -> BTreeMap<String, f64> {
        self.joints
            .iter()
            .zip(&positions.0)
            .map(|(j, &v)| (j.name.clone(), v))
            .collect()
    }

    fn within_limits(&self, values: &[f64]) -> Vec<f64> {
        let joints = values.iter().zip(&self.joints);
        joints.map(|(v, j)| v.clamp(j.lower, j.upper)).collect()
    }

    /// Puts a mimic joint where its leader demands.
    fn follow(&self, idx: usize, values: &mut [f64]) {
        if let Some(mimic) = self.joints[idx].mimic {
            values[idx] = mimic.multiplier * values[mimic.joint.0] + mimic.offset;
        }
    }

    /// Whether a joint always stands where another puts it.
    fn is_follower(&self, idx: usize) -> bool {
        self.joints[idx].mimic.is_some() && !self.breaks_away(idx)
    }

    fn breaks_away(&self, idx: usize) -> bool {
        let description = self.description.as_ref();
        description.is_some_and(|d| d.break_away.binary_search(&JointIdx(idx)).is_ok())
    }

    /// The joints' names, comma separated, for messages.
    pub(crate) fn joint_names(&self) -> String {
        self.joints
            .iter()
            .map(|j| j.name.as_str())
            .collect::<Vec<_>>()
            .join(", ")
    }
}
