//! What else, besides the contacts, decides the quality.

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use crate::QualityError;

/// What else, besides the contacts, decides the quality. All lengths are in one unit, told by `length_unit`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QualityOptions {
    /// Where torques are taken about, object frame: the centre of mass, or what stands in for it.
    pub center: Point3<f64>,
    /// Torques are divided by this length: the largest distance of a vertex from `center`. Positive and finite.
    pub torque_scale: f64,
    /// Edges of a point contact's friction cone, 3 to [`QualityOptions::MOST_CONE_EDGES`]. The paper gives none; 8 as in GraspIt!.
    pub cone_edges: usize,
    /// How the contacts' wrenches add up.
    pub norm: Norm,
    /// Unit of points, `center`, `torque_scale` and torsion lengths. Only soft contacts look at it.
    pub length_unit: LengthUnit,
    /// Whether to build the whole hull for its volume; slow (milliseconds to seconds).
    pub volume: bool,
}

impl QualityOptions {
    /// Largest accepted number of cone edges.
    pub const MOST_CONE_EDGES: usize = 1024;

    /// The defaults: 8 edges, L₁, metres, no volume.
    pub fn new(center: Point3<f64>, torque_scale: f64) -> Self {
        Self {
            center,
            torque_scale,
            cone_edges: 8,
            norm: Norm::L1,
            length_unit: LengthUnit::Metre,
            volume: false,
        }
    }

    pub(crate) fn check(&self) -> Result<(), QualityError> {
        if !self.center.iter().all(|c| c.is_finite()) {
            return Err(QualityError::BadCenter {
                center: self.center.coords.into(),
            });
        }
        if !(self.torque_scale.is_finite() && self.torque_scale > 0.0) {
            return Err(QualityError::BadTorqueScale {
                torque_scale: self.torque_scale,
            });
        }
        if !(3..=Self::MOST_CONE_EDGES).contains(&self.cone_edges) {
            return Err(QualityError::BadConeEdges {
                cone_edges: self.cone_edges,
                most: Self::MOST_CONE_EDGES,
            });
        }
        Ok(())
    }
}

/// How the wrenches of several contacts add up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Norm {
    /// All normal forces together sum to at most 1: the hull of the union of all wrenches.
    #[default]
    L1,
    /// Each normal force is at most 1: the Minkowski sum of the contacts' wrench sets, each with 0 in it.
    LInf,
}

/// Unit of the lengths in a question.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum LengthUnit {
    /// Metres, `"m"`.
    #[default]
    #[serde(rename = "m")]
    Metre,
    /// Millimetres, `"mm"`.
    #[serde(rename = "mm")]
    Millimetre,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_out_of_range_are_errors() {
        let good = QualityOptions::new(Point3::origin(), 0.1);
        assert_eq!(good.check(), Ok(()));
        for torque_scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let bad = QualityOptions { torque_scale, ..good };
            assert!(matches!(bad.check(), Err(QualityError::BadTorqueScale { .. })));
        }
        let bad = QualityOptions {
            cone_edges: 2,
            ..good
        };
        assert_eq!(
            bad.check().unwrap_err().to_string(),
            "a friction cone has 2 edges; expected 3 to 1024"
        );
        let bad = QualityOptions {
            center: Point3::new(f64::NAN, 0.0, 0.0),
            ..good
        };
        assert!(matches!(bad.check(), Err(QualityError::BadCenter { .. })));
    }
}
