//! A mesh made ready for distance, contact and inside queries.
//!
//! **Three tiers, cheap to dear**; all may be asked from many threads at once, none allocates but for bricks of the grid that
//! are asked for the first time (some 0.1 ms each, then shared by all clones) and a core that reaches inside:
//!
//! | question | method | answer |
//! |---|---|---|
//! | Is anything near? | [`Surface::gap_lower_bound`] | one place of the grid far away, one a covering ball near by |
//! | How far, about? | [`Surface::estimated_distance`], [`Surface::gap_bounds`] | from the grid, with a bound of the error |
//! | How far, exactly? | [`Surface::gap`] with a cutoff, [`Surface::signed_gap`] | from the triangles |
//!
//! **Closing** moves solids towards a surface: take steps by the lower bound as long as it exceeds the distance at which
//! precision begins to matter (a few millimetres), then by [`Surface::gap`] with a cutoff little above that distance. A small
//! cutoff is what makes an exact answer cheap: `None` costs less than a distance, and whether solids just touch
//! ([`Surface::intersects`]) least. A hull of 60 corners costs about twice as much as a capsule.
//! [`Surface::touching`] and [`Surface::depth`] allocate and are meant for final postures. Keep one [`Surface`] an object, not
//! one a try.

use std::sync::Arc;

use nalgebra::{Point3, UnitVector3, Vector3};

use crate::TriMesh;
use crate::distance_grid::DistanceGrid;
use crate::holes::Holes;
use crate::sides::Sides;
use crate::triangle_tree::TriangleTree;
use crate::winding::WindingTree;

/// The surface of a mesh, made ready for queries: a tree over its triangles and a grid of distances.
///
/// Any triangle soup will do; nothing here needs a closed mesh. Cloning is cheap.
///
/// ```
/// use nalgebra::{Isometry3, Point3};
/// use prehend_geometry::{Collider, Solid, Surface, TriMesh};
///
/// let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(Point3::from).to_vec();
/// let surface = Surface::new(TriMesh::new(corners, vec![[0, 1, 2]])?);
/// let finger = Collider::new(&Solid::Capsule { half_length: 0.2, radius: 0.1 })?;
/// let above = Isometry3::translation(0.2, 0.2, 0.5);
/// let gap = surface.gap(&finger, &above, 1.0).expect("closer than 1 m");
/// assert!((gap.distance - 0.2).abs() < 1e-12);
/// # Ok::<(), prehend_geometry::GeometryError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Surface {
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    mesh: TriMesh,
    grid: DistanceGrid,
}

/// A point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// The point, metres.
    pub point: Point3<f64>,
    /// The triangle that it lies on.
    pub triangle: usize,
    /// Its distance from where the question was asked, metres.
    pub distance: f64,
}

/// Where a ray meets a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the ray, metres.
    pub distance: f64,
    /// The triangle that is met.
    pub triangle: usize,
}

impl Surface {
    /// Makes a mesh ready: some microseconds a triangle. Near the surface, the grid is measured where it is first asked for.
    pub fn new(mesh: TriMesh) -> Self {
        let tree = TriangleTree::new(&mesh);
        let (low, high) = mesh.axis_aligned_bounds();
        let sides = Sides {
            low,
            high,
            holes: Holes::of(&tree.triangles),
            winding: WindingTree::new(&mesh),
        };
        let grid = DistanceGrid::new(tree, sides);
        Self {
            shared: Arc::new(Shared { mesh, grid }),
        }
    }

    /// The mesh.
    pub fn mesh(&self) -> &TriMesh {
        &self.shared.mesh
    }

    /// Lowest and highest coordinates.
    pub fn axis_aligned_bounds(&self) -> (Point3<f64>, Point3<f64>) {
        (self.sides().low, self.sides().high)
    }

    /// The point of the surface that is closest to `p`.
    pub fn closest_point(&self, p: &Point3<f64>) -> SurfacePoint {
        // Coordinates near the end of f64's range make every distance infinite: then any point is as near as another.
        let first = (f64::INFINITY, self.tree().triangle(0)[0], 0);
        let (distance, point, triangle) = self.tree().nearest_point(p, f64::INFINITY).unwrap_or(first);
        SurfacePoint {
            point,
            triangle: triangle as usize,
            distance,
        }
    }

    /// The first triangle that a ray meets within `max`, from either side; `direction` need not be unit (zero: none).
    pub fn cast_ray(&self, origin: &Point3<f64>, direction: &Vector3<f64>, max: f64) -> Option<Hit> {
        let direction = direction.try_normalize(0.0)?;
        let (distance, triangle) = self.tree().cast_ray(origin, &direction, max)?;
        Some(Hit {
            distance,
            triangle: triangle as usize,
        })
    }

    /// How often the surface winds around `p`: 1 inside a closed mesh, 0 outside, in between near holes.
    ///
    /// The solid angles of all triangles over 4π (Jacobson, Kavan and Sorkine-Hornung, *Robust inside-outside
    /// segmentation using generalized winding numbers*, 2013). Costs a pass over all triangles; [`is_inside`](Self::is_inside)
    /// looks at a few.
    pub fn winding_number(&self, p: &Point3<f64>) -> f64 {
        self.sides().winding.winding_number(p)
    }

    /// Whether `p` lies inside: its winding number is above one half (below −½ for a mesh turned inside out).
    ///
    /// The same answer as [`winding_number`](Self::winding_number) gives, from far fewer triangles.
    pub fn is_inside(&self, p: &Point3<f64>) -> bool {
        let (low, high) = self.axis_aligned_bounds();
        let within = (0..3).all(|k| p[k] >= low[k] && p[k] <= high[k]);
        within && self.grid().side(p).unwrap_or_else(|| self.sides().is_inside(p))
    }

    /// A lower bound of the distance from `p` to the surface, from the grid.
    ///
    /// The first query in a part of space near the surface also measures the grid there, which takes longer.
    pub fn distance_lower_bound(&self, p: &Point3<f64>) -> f64 {
        self.shared.grid.lower_bound(p)
    }

    /// The unit normal of a triangle, outward where the mesh is wound outward; `None` for one without area.
    pub fn face_normal(&self, triangle: usize) -> Option<UnitVector3<f64>> {
        let [a, b, c] = self.mesh().triangle(triangle);
        let n = (b - a).cross(&(c - a));
        UnitVector3::try_new(n, f64::MIN_POSITIVE)
    }

    pub(crate) fn grid(&self) -> &DistanceGrid {
        &self.shared.grid
    }

    pub(crate) fn tree(&self) -> &TriangleTree {
        &self.shared.grid.tree
    }

    fn sides(&self) -> &Sides {
        &self.shared.grid.sides
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// The unit cube about the origin; `n_triangles` of its twelve.
    fn cube(n_triangles: usize) -> Surface {
        let solid = crate::Solid::Cuboid {
            half_extents: Vector3::repeat(0.5),
        };
        let mesh = solid.display_mesh();
        Surface::new(
            TriMesh::new(mesh.vertices().to_vec(), mesh.triangles()[..n_triangles].to_vec()).unwrap(),
        )
    }

    #[test]
    fn the_centre_of_a_cube_is_inside_also_when_a_triangle_is_missing() {
        for n in [12, 11] {
            assert!(cube(n).is_inside(&Point3::origin()));
            assert!(!cube(n).is_inside(&Point3::new(0.0, 0.0, 0.7)));
        }
        assert!((cube(12).winding_number(&Point3::new(0.1, -0.3, 0.2)) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_ray_from_the_centre_of_a_cube_leaves_through_its_faces() {
        let cube = cube(12);
        let hit = cube
            .cast_ray(&Point3::new(0.1, 0.2, 0.0), &Vector3::new(0.0, 0.0, 3.0), 1.0)
            .unwrap();
        assert!((hit.distance - 0.5).abs() < 1e-12);
        assert!(cube.face_normal(hit.triangle).unwrap().z > 0.99);
        assert!(cube.cast_ray(&Point3::origin(), &Vector3::z(), 0.4).is_none());
        assert!(cube.cast_ray(&Point3::origin(), &Vector3::zeros(), 4.0).is_none());
    }

    #[test]
    fn the_closest_point_agrees_with_a_search_over_all_triangles() {
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        let mut random = || rng.random_range(-1.0..1.0);
        let vertices: Vec<_> = (0..60)
            .map(|_| Point3::new(random(), random(), random()))
            .collect();
        let triangles: Vec<[u32; 3]> = (0..58).map(|i| [i, i + 1, i + 2]).collect();
        let surface = Surface::new(TriMesh::new(vertices, triangles).unwrap());
        for _ in 0..500 {
            let p = Point3::new(random(), random(), random()) * 2.0;
            let all = surface
                .mesh()
                .corners()
                .map(|t| (crate::closest::on_triangle(&p, &t) - p).norm());
            let least = all.fold(f64::INFINITY, f64::min);
            let found = surface.closest_point(&p);
            assert!((found.distance - least).abs() < 1e-12);
            assert!((found.point - p).norm() - least < 1e-12);
        }
    }
}
