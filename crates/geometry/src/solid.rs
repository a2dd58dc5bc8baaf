//! The solids that a link or an obstacle is made of.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Vector3};

use crate::TriMesh;

/// A solid in its own frame, metres.
#[derive(Debug, Clone, PartialEq)]
pub enum Solid {
    /// A ball about the origin.
    Sphere {
        /// Radius.
        radius: f64,
    },
    /// A ball swept from `(0, 0, −half_length)` to `(0, 0, half_length)`.
    Capsule {
        /// Half the length of the core segment, without the caps.
        half_length: f64,
        /// Radius.
        radius: f64,
    },
    /// A box about the origin, axis aligned.
    Cuboid {
        /// Half lengths.
        half_extents: Vector3<f64>,
    },
    /// A cylinder about the z axis.
    Cylinder {
        /// Half the height.
        half_length: f64,
        /// Radius.
        radius: f64,
    },
    /// The convex hull of these points.
    Hull(Arc<Vec<Point3<f64>>>),
    /// The surface of a mesh (not its inside).
    Mesh(Arc<TriMesh>),
}

/// A solid and where it stands in its link's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacedSolid {
    /// The shape.
    pub solid: Solid,
    /// `link_from_solid`.
    pub link_from_solid: Isometry3<f64>,
}
