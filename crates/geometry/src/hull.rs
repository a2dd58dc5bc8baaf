//! The convex hull of points in space.

mod quickhull;

use nalgebra::{Point3, Vector3};

use crate::GeometryError;
use crate::planar::planar_hull;
use quickhull::{Simplex, initial_simplex, quickhull, redundant_corners};

/// How far outside the hull an input point may lie, relative to half the longest side of the points' bounds.
///
/// Points of one flat face, turned or read from text, are coplanar only up to rounding. Well above that rounding and
/// well below the accuracy of any mesh, this keeps such faces from growing vertices.
pub(crate) const HULL_TOLERANCE: f64 = 1e-10;

/// The convex hull of a set of points: its corners, and triangles that face outwards.
///
/// Flat input gives a hull of lower rank and volume 0: a plane polygon with both of its sides (rank 2), a segment
/// (rank 1, no triangles) or a single point (rank 0, no triangles).
#[derive(Debug, Clone, PartialEq)]
pub struct ConvexHull {
    points: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    rank: usize,
}

impl ConvexHull {
    /// The corners: a subset of the input points, in the order of the input (around the polygon for rank 2).
    pub fn points(&self) -> &[Point3<f64>] {
        &self.points
    }

    /// Corners of each triangle, counter-clockwise seen from outside. Coplanar neighbours are not merged.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Dimension of the hull: 3 for a solid, 2 for a polygon, 1 for a segment, 0 for a point.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Volume, m³; 0 below rank 3.
    pub fn volume(&self) -> f64 {
        if self.rank < 3 {
            return 0.0;
        }
        let apex = self.points[0];
        let six_times: f64 = self
            .triangles
            .iter()
            .map(|t| t.map(|v| self.points[v as usize] - apex))
            .map(|[a, b, c]| a.cross(&b).dot(&c))
            .sum();
        six_times / 6.0
    }
}

/// The convex hull of `points` (any unit; the hull is in the same).
///
/// Every input point lies inside it or at most 1e-10 of the input's size outside. The result does not depend on
/// chance, but which of several coplanar or nearly coplanar points become corners depends on the order of the input.
///
/// # Errors
///
/// [`GeometryError::Empty`] for no points, [`GeometryError::NotFinite`] for a coordinate that is NaN or infinite.
///
/// # Source
///
/// Barber, Dobkin, Huhdanpaa, "The Quickhull algorithm for convex hulls" (1996), with exact orientation tests
/// (Shewchuk 1997) where that algorithm merges facets, so that the surface stays closed on coplanar input.
///
/// # Examples
///
/// ```
/// use nalgebra::Point3;
/// use prehend_geometry::convex_hull;
///
/// let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.1, 0.1, 0.1]];
/// let hull = convex_hull(&corners.map(Point3::from))?;
/// assert_eq!(hull.points().len(), 4);
/// assert!((hull.volume() - 1.0 / 6.0).abs() < 1e-15);
/// # Ok::<(), prehend_geometry::GeometryError>(())
/// ```
pub fn convex_hull(points: &[Point3<f64>]) -> Result<ConvexHull, GeometryError> {
    check_points(points)?;
    Ok(hull_within(points, HULL_TOLERANCE))
}

/// Fails where there is no point, or one that is not finite.
pub(crate) fn check_points(points: &[Point3<f64>]) -> Result<(), GeometryError> {
    for (vertex, p) in points.iter().enumerate() {
        if let Some(&value) = p.coords.iter().find(|c| !c.is_finite()) {
            return Err(GeometryError::NotFinite { vertex, value });
        }
    }
    if points.is_empty() {
        Err(GeometryError::Empty { what: "points" })
    } else {
        Ok(())
    }
}

/// [`convex_hull`] of checked points with another tolerance: a larger one gives a simpler hull a little inside.
pub(crate) fn hull_within(points: &[Point3<f64>], tolerance: f64) -> ConvexHull {
    let unit = to_unit_cube(points);
    let (indices, triangles, rank) = match initial_simplex(&unit) {
        Simplex::Solid(corners) => {
            let triangles = quickhull(&unit, corners, tolerance);
            let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
            used.sort_unstable();
            used.dedup();
            without_redundant(&unit, used, triangles, tolerance)
        }
        Simplex::Flat([a, b, c]) => {
            let (u, v) = plane_basis(&unit, a, b, c);
            let flat: Vec<[f64; 2]> = unit.iter().map(|p| [p.dot(&u), p.dot(&v)]).collect();
            let polygon = planar_hull(&flat);
            let fan = polygon.windows(2).skip(1).map(|w| [polygon[0], w[0], w[1]]);
            let triangles = fan.flat_map(|t| [t, [t[0], t[2], t[1]]]).collect();
            (polygon, triangles, 2)
        }
        Simplex::Segment(ends) => (ends.to_vec(), Vec::new(), 1),
        Simplex::Point(p) => (vec![p], Vec::new(), 0),
    };
    let mut new_index = vec![0_u32; points.len()];
    for (new, &old) in indices.iter().enumerate() {
        new_index[old as usize] = new as u32;
    }
    ConvexHull {
        points: indices.iter().map(|&i| points[i as usize]).collect(),
        triangles: triangles
            .iter()
            .map(|t| t.map(|v| new_index[v as usize]))
            .collect(),
        rank,
    }
}

/// The hull's corners and triangles once corners inside its faces and edges are left out; and its rank.
fn without_redundant(
    unit: &[Vector3<f64>],
    mut used: Vec<u32>,
    mut triangles: Vec<[u32; 3]>,
    tolerance: f64,
) -> (Vec<u32>, Vec<[u32; 3]>, usize) {
    loop {
        let redundant = redundant_corners(unit, &triangles);
        if redundant.is_empty() {
            return (used, triangles, 3);
        }
        let kept: Vec<u32> = used
            .iter()
            .copied()
            .filter(|i| redundant.binary_search(i).is_err())
            .collect();
        let corners: Vec<Vector3<f64>> = kept.iter().map(|&i| unit[i as usize]).collect();
        let Simplex::Solid(simplex) = initial_simplex(&corners) else {
            return (used, triangles, 3);
        };
        triangles = quickhull(&corners, simplex, tolerance)
            .iter()
            .map(|t| t.map(|i| kept[i as usize]))
            .collect();
        used = triangles.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
    }
}

/// The points moved and scaled so that their bounds are centred and their longest side runs from −1 to 1.
fn to_unit_cube(points: &[Point3<f64>]) -> Vec<Vector3<f64>> {
    let mut low = points[0].coords;
    let mut high = low;
    for p in points {
        low = low.inf(&p.coords);
        high = high.sup(&p.coords);
    }
    // Halved before they are combined: the sum of two finite numbers may overflow.
    let center = low / 2.0 + high / 2.0;
    let half = (high / 2.0 - low / 2.0).max();
    if half == 0.0 {
        return vec![Vector3::zeros(); points.len()];
    }
    points.iter().map(|p| (p.coords - center) / half).collect()
}

/// Two orthonormal directions in the plane of three points.
fn plane_basis(points: &[Vector3<f64>], a: u32, b: u32, c: u32) -> (Vector3<f64>, Vector3<f64>) {
    let u = (points[b as usize] - points[a as usize]).normalize();
    let w = points[c as usize] - points[a as usize];
    (u, (w - u * u.dot(&w)).normalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(n: [usize; 3]) -> Vec<Point3<f64>> {
        let mut points = Vec::new();
        for i in 0..n[0] {
            for j in 0..n[1] {
                for k in 0..n[2] {
                    points.push(Point3::new(i as f64, j as f64, k as f64));
                }
            }
        }
        points
    }

    fn assert_closed(hull: &ConvexHull) {
        let mut edges: Vec<[u32; 2]> = hull
            .triangles()
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .collect();
        let mut reversed: Vec<[u32; 2]> = edges.iter().map(|&[a, b]| [b, a]).collect();
        edges.sort_unstable();
        reversed.sort_unstable();
        assert_eq!(edges, reversed);
    }

    #[test]
    fn the_hull_of_a_grid_is_its_box() {
        let hull = convex_hull(&grid([5, 4, 3])).unwrap();
        assert_eq!(hull.rank(), 3);
        assert_eq!(hull.points().len(), 8);
        assert_eq!(hull.triangles().len(), 12);
        assert!((hull.volume() - 24.0).abs() < 1e-12);
        assert_closed(&hull);
    }

    #[test]
    fn a_turned_grid_has_the_same_volume_and_a_closed_hull() {
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, -1.1, 2.0);
        let turned: Vec<_> = grid([9, 9, 9]).iter().map(|p| turn * p).collect();
        let hull = convex_hull(&turned).unwrap();
        assert!((hull.volume() - 512.0).abs() < 1e-9);
        assert_closed(&hull);
    }

    #[test]
    fn flat_straight_and_single_points_give_hulls_of_lower_rank() {
        let square = convex_hull(&grid([3, 3, 1])).unwrap();
        // Rounding may keep a point on an edge.
        assert_eq!((square.rank(), square.volume()), (2, 0.0));
        assert!((4..=8).contains(&square.points().len()));
        assert_closed(&square);
        let segment = convex_hull(&grid([1, 7, 1])).unwrap();
        assert_eq!((segment.rank(), segment.points().len()), (1, 2));
        let point = convex_hull(&[Point3::new(1.0, 2.0, 3.0); 5]).unwrap();
        assert_eq!((point.rank(), point.points().len(), point.volume()), (0, 1, 0.0));
    }

    #[test]
    fn no_points_and_bad_numbers_are_errors() {
        assert_eq!(convex_hull(&[]), Err(GeometryError::Empty { what: "points" }));
        let bad = [Point3::origin(), Point3::new(0.0, f64::INFINITY, 0.0)];
        assert_eq!(
            convex_hull(&bad),
            Err(GeometryError::NotFinite {
                vertex: 1,
                value: f64::INFINITY
            })
        );
    }

    #[test]
    fn huge_and_tiny_coordinates_do_not_overflow() {
        for scale in [1e-300, 1e300] {
            let points: Vec<_> = grid([2, 2, 2]).iter().map(|p| p * scale).collect();
            assert_eq!(convex_hull(&points).unwrap().triangles().len(), 12);
        }
        let corners = [
            [f64::MAX, 0.0, 0.0],
            [-f64::MAX, 0.0, 0.0],
            [0.0, f64::MAX, 0.0],
            [0.0, 0.0, f64::MAX],
        ];
        assert_eq!(convex_hull(&corners.map(Point3::from)).unwrap().rank(), 3);
    }
}
