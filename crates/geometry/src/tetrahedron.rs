//! Tetrahedra.

use nalgebra::Point3;

use crate::twofold::{Twofold, determinant};

/// Four corners, in metres; any order, may be flat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tetrahedron(pub [Point3<f64>; 4]);

impl Tetrahedron {
    /// Volume, m³; never negative, 0 for a flat one.
    ///
    /// Exact to the last digit or two even for needles, whose edges are all but parallel.
    pub fn volume(&self) -> f64 {
        let [a, b, c, d] = self.0;
        let edge = |p: Point3<f64>| [0, 1, 2].map(|k| Twofold::difference(p[k], a[k]));
        determinant([edge(b), edge(c), edge(d)]).value().abs() / 6.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_corner_has_a_sixth() {
        let corner = Tetrahedron([[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(Point3::from));
        assert_eq!(corner.volume(), 1.0 / 6.0);
    }

    #[test]
    fn a_needle_keeps_its_digits() {
        // Powers of two: every coordinate is exact, and so is the volume w² / 6 of the sheared corner.
        let w = 2.0_f64.powi(-20);
        let needle =
            Tetrahedron([[0., 0., 0.], [1., 1., 1.], [1., 1. + w, 1.], [1., 1., 1. + w]].map(Point3::from));
        assert_eq!(needle.volume(), w * w / 6.0);
    }

    #[test]
    fn points_in_a_plane_have_none() {
        let flat = Tetrahedron([[0., 0., 7.], [1., 0., 7.], [0., 1., 7.], [5., 3., 7.]].map(Point3::from));
        assert_eq!(flat.volume(), 0.0);
    }
}
