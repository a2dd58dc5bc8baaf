//! Where do shapes meet, and how much do they share?
//!
//! Shapes come in as bytes ([`read_shape`]: OFF, OBJ, STL, PLY, clouds as PLY, XYZ, PCD, and with the features `gltf` and
//! `dae` glTF, GLB and COLLADA; [`read_shape_with`] where they name further files), are looked over
//! ([`inspect`]) and mended where that needs no guess ([`repair`]), and then answer questions:
//!
//! - *How much is there?* [`mass_properties`], [`surface_area`], [`surface_centroid`].
//! - *What encloses it?* [`convex_hull`], [`minimum_volume_box`]: B₀ of the paper; [`decompose`]: the boxes B₁ … Bₙ.
//! - *What do two bodies share?* [`Tetrahedron::intersection_volume`] with a box, and [`Tetrahedron::union_volume`] and
//!   [`union_volume`], which count what several boxes share once: the free volume of a grasp rests on these.
//! - *Where is the surface?* [`Surface`]: closest points, rays, inside or outside; [`Collider`] for solids against it.
//!
//! Lengths are metres once a file's unit has been applied ([`TriMesh::scaled`]), angles radians, numbers `f64`. The crate
//! knows nothing of forces or robots and never opens a file. No input makes it panic: what cannot be answered is a
//! [`GeometryError`] that says where, what was found and what was expected.
//!
//! # Example
//!
//! How much of a cube does a tetrahedron from one of its corners take?
//!
//! ```
//! use prehend_geometry::{MeshFormat, Tetrahedron, mass_properties, minimum_volume_box, read_mesh, repair};
//! # use nalgebra::Vector3;
//!
//! let text = "OFF 8 6\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n\
//!     4 0 3 2 1\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n4 4 5 6 7\n";
//! let (cube, repairs) = repair(read_mesh(text.as_bytes(), MeshFormat::Off)?);
//! assert_eq!(repairs, Default::default());
//! assert!((mass_properties(&cube).volume - 1.0).abs() < 1e-12);
//!
//! let root = minimum_volume_box(cube.vertices())?.floored(0.001);
//! let corner = cube.vertices()[0];
//! let enclosure = Tetrahedron([
//!     corner, corner + Vector3::x(), corner + Vector3::y(), corner + Vector3::z(),
//! ]);
//! assert!((enclosure.intersection_volume(&root) - 1.0 / 6.0).abs() < 1e-9);
//! # Ok::<(), prehend_geometry::GeometryError>(())
//! ```

mod between_solids;
mod box_record;
mod clip;
mod closest;
mod collider;
mod contact_point;
mod core_distance;
mod decompose;
mod depth;
mod distance_grid;
mod enclosed_volume;
mod enclosure;
mod error;
mod gap;
mod grid_build;
mod holes;
mod hull;
mod inspect;
mod mass_properties;
mod mesh;
mod min_box;
mod oriented_box;
mod parry_bridge;
mod planar;
mod read;
mod repair;
mod separating_planes;
mod shared_volume;
mod sides;
mod signed_distance;
mod simplex;
mod solid;
mod solid_shape;
mod surface;
mod tetrahedron;
mod topology;
mod triangle_tree;
mod twofold;
mod winding;
mod write_ply;

pub use box_record::BoxRecord;
pub use collider::{Ball, Collider};
pub use contact_point::ContactPoint;
pub use decompose::{
    DecomposeMethod, DecomposeOptions, Decomposition, TreeNode, decompose, decompose_points,
};
pub use enclosed_volume::{EnclosedVolume, VolumeMethod, enclosed_volume};
pub use enclosure::largest_tetrahedron;
pub use error::GeometryError;
pub use gap::Gap;
pub use hull::{ConvexHull, convex_hull};
pub use inspect::{Hole, MeshReport, inspect};
pub use mass_properties::{MassProperties, mass_properties, signed_volume, surface_area, surface_centroid};
pub use mesh::TriMesh;
pub use min_box::{MinimumBox, minimum_volume_box};
pub use oriented_box::OrientedBox;
pub use planar::planar_hull;
pub use read::{FileShape, MeshFormat, Resolve, Shape, Stated, read_mesh, read_shape, read_shape_with};
pub use repair::{Repairs, repair};
pub use shared_volume::union_volume;
pub use signed_distance::{DistanceEstimate, GapBounds};
pub use solid::{PlacedSolid, Solid};
pub use surface::{Hit, Surface, SurfacePoint};
pub use tetrahedron::Tetrahedron;
pub use write_ply::write_ply;
