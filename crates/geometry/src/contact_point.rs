//! Where two bodies touch.

use nalgebra::{Point3, UnitVector3};
use serde::{Deserialize, Serialize};

/// A point (m) and the unit normal into the object, both in the object frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ContactPoint {
    /// Where the bodies touch, on the object's surface.
    pub point: Point3<f64>,
    /// Unit normal, into the object.
    pub normal: UnitVector3<f64>,
}
