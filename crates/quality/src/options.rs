//! What else, besides the contacts, decides the quality.

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::{QualityError, WrenchAxes, WrenchMetric};

/// What else, besides the contacts, decides the quality. All lengths are in one unit, told by `length_unit`.
///
/// [`QualityOptions::new`] gives GraspIt!'s conventions; every other field of the struct departs from them on purpose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QualityOptions {
    /// Where torques are taken about, object frame: the centre of mass, or what stands in for it.
    pub center: Point3<f64>,
    /// Torques are divided by this length: the largest distance of a vertex from `center`. Positive and finite.
    pub torque_scale: f64,
    /// Shape of a point contact's friction cone. The paper gives none; 8 edges as in GraspIt!.
    pub cone: ConeShape,
    /// Shape of a soft contact's limit surface; GraspIt!'s 20 samples by default.
    pub limit_surface: LimitSurface,
    /// How the contacts' wrenches add up; L₁ by default.
    pub norm: Norm,
    /// Force added to every wrench (also to the sum's parts with L∞), in units of the normal force, object frame; zero
    /// by default. GraspIt!'s option `useGravity` adds 0.5 × the world's upward direction. It acts at the centre of
    /// mass, where `center` should then be.
    pub gravity: Vector3<f64>,
    /// Which coordinates of a wrench count; all by default.
    pub axes: WrenchAxes,
    /// What wrenches weigh; without one, |f|² + |τ / torque_scale|².
    pub metric: Option<WrenchMetric>,
    /// Unit of points, `center`, `torque_scale` and torsion lengths. Only [`LimitSurface::Samples`] look at it.
    pub length_unit: LengthUnit,
    /// Whether to build the whole hull for its volume; slow (milliseconds to seconds).
    pub volume: bool,
}

impl QualityOptions {
    /// Largest accepted number of cone edges.
    pub const MOST_CONE_EDGES: usize = 1024;

    /// The defaults, GraspIt!'s: 8 edges, 20 samples, L₁, no gravity, all axes alike, metres, no volume.
    pub fn new(center: Point3<f64>, torque_scale: f64) -> Self {
        Self {
            center,
            torque_scale,
            cone: ConeShape::default(),
            limit_surface: LimitSurface::default(),
            norm: Norm::L1,
            gravity: Vector3::zeros(),
            axes: WrenchAxes::ALL,
            metric: None,
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
        if let ConeShape::Edges(cone_edges) = self.cone
            && !(3..=Self::MOST_CONE_EDGES).contains(&cone_edges)
        {
            return Err(QualityError::BadConeEdges {
                cone_edges,
                most: Self::MOST_CONE_EDGES,
            });
        }
        if !self.gravity.iter().all(|c| c.is_finite()) {
            return Err(QualityError::BadGravity {
                gravity: self.gravity.into(),
            });
        }
        Ok(())
    }
}

/// Shape of the cone of forces at a point contact with friction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ConeShape {
    /// The hull of this many straight edges, 3 to [`QualityOptions::MOST_CONE_EDGES`]; ε is then exact.
    Edges(usize),
    /// Coulomb's round cone; ε is then known between two bounds ([`crate::EpsilonSolver::epsilon_within`]).
    Smooth,
}

impl Default for ConeShape {
    fn default() -> Self {
        Self::Edges(8)
    }
}

/// Shape of the limit surface x² + y² + (t/e)² ≤ 1 of tangential force and torsion at a soft contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LimitSurface {
    /// 20 samples of it, GraspIt!'s, taken with e in millimetres.
    #[default]
    Samples,
    /// The whole ellipsoid; ε is then known between two bounds.
    Ellipsoid,
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
            cone: ConeShape::Edges(2),
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
        let bad = QualityOptions {
            gravity: Vector3::new(0.0, f64::INFINITY, 0.0),
            ..good
        };
        assert_eq!(
            bad.check().unwrap_err().to_string(),
            "the gravity force is [0.0, inf, 0.0]; every coordinate must be finite"
        );
    }
}
