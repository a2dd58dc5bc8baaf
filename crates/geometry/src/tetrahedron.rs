//! Tetrahedra.

use nalgebra::Point3;

/// Four corners, in metres; any order, may be flat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tetrahedron(pub [Point3<f64>; 4]);

impl Tetrahedron {
    /// Volume, m³; never negative, 0 for a flat one.
    pub fn volume(&self) -> f64 {
        let [a, b, c, d] = self.0;
        (b - a).cross(&(c - a)).dot(&(d - a)).abs() / 6.0
    }
}
