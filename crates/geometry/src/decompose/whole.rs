//! A whole body, which knows its inside.

use std::sync::OnceLock;

use nalgebra::Point3;

use super::region::Region;
use crate::winding::WindingTree;

/// A body before it is cut.
pub(super) struct Whole {
    pub(super) region: Region,
    /// No vertex is farther than this from the first along any axis.
    pub(super) reach: f64,
    winding: OnceLock<WindingTree>,
}

impl Whole {
    pub(super) fn new(region: Region) -> Self {
        let vertices = region.vertices();
        let from_first = vertices.iter().map(|p| (p - vertices[0]).amax());
        Self {
            reach: from_first.fold(0.0, f64::max),
            winding: OnceLock::new(),
            region,
        }
    }

    /// Whether the surface winds around a point more than half: for a closed surface, whether the point is inside.
    ///
    /// Holes and loose parts disturb this only in proportion to their size (Jacobson, Kavan, Sorkine-Hornung 2013).
    pub(super) fn holds(&self, p: &Point3<f64>) -> bool {
        let tree = self.winding.get_or_init(|| {
            let triangles = self.region.triangles().iter();
            WindingTree::of(
                triangles
                    .map(|t| t.map(|v| self.region.vertices()[v as usize]))
                    .collect(),
            )
        });
        tree.is_inside(p)
    }
}
