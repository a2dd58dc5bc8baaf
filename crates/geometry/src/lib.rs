//! Where do shapes meet, and how much do they share?

mod contact_point;
mod enclosure;
mod error;
mod mass_properties;
mod mesh;
mod oriented_box;
mod shared_volume;
mod simplex;
mod solid;
mod tetrahedron;

pub use contact_point::ContactPoint;
pub use enclosure::largest_tetrahedron;
pub use error::GeometryError;
pub use mass_properties::{MassProperties, mass_properties, signed_volume, surface_area, surface_centroid};
pub use mesh::TriMesh;
pub use oriented_box::OrientedBox;
pub use shared_volume::union_volume;
pub use solid::{PlacedSolid, Solid};
pub use tetrahedron::Tetrahedron;
