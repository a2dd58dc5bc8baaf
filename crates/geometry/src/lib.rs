//! Where do shapes meet, and how much do they share?

mod contact_point;
mod error;
mod mesh;
mod oriented_box;
mod solid;
mod tetrahedron;

pub use contact_point::ContactPoint;
pub use error::GeometryError;
pub use mesh::TriMesh;
pub use oriented_box::OrientedBox;
pub use solid::{PlacedSolid, Solid};
pub use tetrahedron::Tetrahedron;
