//! Where do shapes meet, and how much do they share?

mod between_solids;
mod closest;
mod collider;
mod contact_point;
mod depth;
mod distance_grid;
mod enclosure;
mod error;
mod gap;
mod inspect;
mod mass_properties;
mod mesh;
mod oriented_box;
mod parry_bridge;
mod read;
mod repair;
mod shared_volume;
mod simplex;
mod solid;
mod solid_shape;
mod surface;
mod tetrahedron;
mod topology;
mod triangle_tree;
mod twofold;
mod write_ply;

pub use collider::{Ball, Collider};
pub use contact_point::ContactPoint;
pub use enclosure::largest_tetrahedron;
pub use error::GeometryError;
pub use gap::Gap;
pub use inspect::{MeshReport, inspect};
pub use mass_properties::{MassProperties, mass_properties, signed_volume, surface_area, surface_centroid};
pub use mesh::TriMesh;
pub use oriented_box::OrientedBox;
pub use read::{MeshFormat, Shape, read_mesh, read_shape};
pub use repair::{Repairs, repair};
pub use shared_volume::union_volume;
pub use solid::{PlacedSolid, Solid};
pub use surface::{Hit, Surface, SurfacePoint};
pub use tetrahedron::Tetrahedron;

mod hull;
mod planar;
pub use hull::{ConvexHull, convex_hull};
pub use planar::planar_hull;

mod min_box;
pub use min_box::{MinimumBox, minimum_volume_box};
pub use write_ply::write_ply;
