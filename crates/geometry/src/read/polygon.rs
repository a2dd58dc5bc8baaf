//! Polygons cut into triangles: convex ones as a fan around their first corner, others ear by ear.

use nalgebra::{Point3, Vector3};
use robust::{Coord, orient2d};

use crate::{GeometryError, TriMesh};

/// A corner counts as turning inward where the sine of its turn is below this: rounding of a straight edge is not.
const STRAIGHT: f64 = 1e-9;

/// Polygons of more corners than this stay fans: ear clipping takes quadratic time and more.
const MOST_CORNERS: usize = 4096;

/// Faces as triangles, in the file's order. A polygon of n corners gives n − 2.
#[derive(Default)]
pub(super) struct Faces {
    triangles: Vec<[u32; 3]>,
    /// First triangle and number of triangles of each polygon of four corners or more: a file may name vertices before
    /// it gives them, so whether a fan will do is seen at the end.
    fans: Vec<(usize, usize)>,
}

impl Faces {
    pub fn with_capacity(n_triangles: usize) -> Self {
        Self {
            triangles: Vec::with_capacity(n_triangles),
            fans: Vec::new(),
        }
    }

    /// Adds a polygon; fewer than three corners give nothing.
    pub fn push(&mut self, polygon: &[u32]) {
        if polygon.len() > 3 {
            self.fans.push((self.triangles.len(), polygon.len() - 2));
        }
        let edges = polygon.windows(2).skip(1);
        self.triangles
            .extend(edges.map(|edge| [polygon[0], edge[0], edge[1]]));
    }

    #[cfg(any(feature = "gltf", feature = "dae"))]
    pub fn push_triangle(&mut self, triangle: [u32; 3]) {
        self.triangles.push(triangle);
    }

    /// Adds a strip: every corner from the third on makes a triangle with the two before, every second one turned.
    pub fn push_strip(&mut self, strip: &[u32]) {
        let triangles = strip.windows(3).enumerate();
        self.triangles.extend(triangles.map(|(nth, t)| match nth % 2 {
            0 => [t[0], t[1], t[2]],
            _ => [t[1], t[0], t[2]],
        }));
    }

    #[cfg(any(feature = "gltf", feature = "dae"))]
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// The mesh, after the fans of polygons that are not convex have given way to triangles inside them.
    pub fn into_mesh(mut self, vertices: Vec<Point3<f64>>) -> Result<TriMesh, GeometryError> {
        for (first, n) in self.fans {
            let fan = &mut self.triangles[first..first + n];
            let polygon: Vec<u32> = fan[0][..2]
                .iter()
                .copied()
                .chain(fan.iter().map(|t| t[2]))
                .collect();
            let corners: Option<Vec<_>> = polygon
                .iter()
                .map(|&v| vertices.get(v as usize).copied())
                .collect();
            if let Some(cut) = corners.and_then(|corners| cut(&corners)) {
                for (triangle, ear) in fan.iter_mut().zip(cut) {
                    *triangle = ear.map(|corner| polygon[corner]);
                }
            }
        }
        TriMesh::new(vertices, self.triangles)
    }
}

/// The triangles of a polygon, as indices of corners; `None` where the fan around the first corner will do.
fn cut(corners: &[Point3<f64>]) -> Option<Vec<[usize; 3]>> {
    let n = corners.len();
    let first = corners[0];
    let edge = |i: usize| corners[(i + 1) % n] - corners[i];
    // Newell: the sum of the fan's area vectors is the polygon's, whatever its shape.
    let normal: Vector3<f64> = (1..n - 1)
        .map(|i| (corners[i] - first).cross(&(corners[i + 1] - first)))
        .sum();
    let normal = normal
        .try_normalize(0.0)
        .filter(|n| n.iter().all(|c| c.is_finite()))?;
    let turns_inward = |i: usize| {
        let (before, after) = (edge((i + n - 1) % n), edge(i));
        before.cross(&after).dot(&normal) < -STRAIGHT * before.norm() * after.norm()
    };
    if n > MOST_CORNERS || !(0..n).any(turns_inward) {
        return None;
    }
    let x = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
    let y = normal.cross(&x);
    let flat: Vec<Coord<f64>> = corners
        .iter()
        .map(|p| p - first)
        .map(|p| Coord {
            x: p.dot(&x),
            y: p.dot(&y),
        })
        .collect();
    clip_ears(&flat)
}

/// Ear clipping of a counter-clockwise polygon; `None` where it crosses itself and no ear is left.
fn clip_ears(corners: &[Coord<f64>]) -> Option<Vec<[usize; 3]>> {
    let mut left: Vec<usize> = (0..corners.len()).collect();
    let mut triangles = Vec::with_capacity(corners.len() - 2);
    let (mut at, mut misses) = (0, 0);
    while left.len() > 3 {
        let n = left.len();
        let ear = [left[(at + n - 1) % n], left[at % n], left[(at + 1) % n]];
        if is_ear(corners, &left, ear) {
            triangles.push(ear);
            left.remove(at % n);
            // The neighbour that follows may have become an ear; going on there spreads the triangles evenly.
            (at, misses) = (at % n % left.len(), 0);
        } else if misses < n {
            (at, misses) = ((at + 1) % n, misses + 1);
        } else {
            return None;
        }
    }
    triangles.push([left[0], left[1], left[2]]);
    Some(triangles)
}

/// Whether a corner juts out and no other corner lies in the triangle that it makes with its neighbours.
fn is_ear(corners: &[Coord<f64>], left: &[usize], ear: [usize; 3]) -> bool {
    let [a, b, c] = ear.map(|corner| corners[corner]);
    if orient2d(a, b, c) <= 0.0 {
        return false;
    }
    left.iter().filter(|corner| !ear.contains(corner)).all(|&corner| {
        let p = corners[corner];
        // A corner at the same place as one of the ear's, as a slit has, is not in the way.
        p == a
            || p == b
            || p == c
            || [(a, b), (b, c), (c, a)]
                .iter()
                .any(|&(from, to)| orient2d(from, to, p) < 0.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface_area;

    fn mesh(corners: &[[f64; 3]]) -> TriMesh {
        let mut faces = Faces::default();
        faces.push(&(0..corners.len() as u32).collect::<Vec<_>>());
        faces
            .into_mesh(corners.iter().copied().map(Point3::from).collect())
            .unwrap()
    }

    #[test]
    fn convex_polygons_stay_fans() {
        let square = mesh(&[[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]);
        assert_eq!(square.triangles(), [[0, 1, 2], [0, 2, 3]]);
        // A corner on a straight edge does not make it concave.
        let house = mesh(&[
            [0., 0., 0.],
            [0.1, 0., 0.],
            [0.3, 0., 0.],
            [0.3, 0.3, 0.],
            [0., 0.3, 0.],
        ]);
        assert_eq!(house.triangles()[0], [0, 1, 2]);
    }

    #[test]
    fn a_dart_is_cut_along_its_inner_diagonal() {
        let dart = [[0., 0., 1.], [4., 0., 1.], [1., 1., 1.], [0., 4., 1.]];
        for first in 0..4 {
            let mut corners = dart;
            corners.rotate_left(first);
            assert!((surface_area(&mesh(&corners)) - 4.0).abs() < 1e-12, "{first}");
            corners.reverse();
            assert!((surface_area(&mesh(&corners)) - 4.0).abs() < 1e-12, "{first}");
        }
    }

    /// The sum of areas equals the area of the outline only if no triangle overlaps another or leaves it.
    #[test]
    fn a_comb_and_a_spiral_keep_their_area() {
        let mut comb = vec![[0.0, 0.0, 0.0], [20.0, 0.0, 0.0]];
        comb.extend((0..20).rev().flat_map(|i| {
            let x = f64::from(i);
            [[x + 0.9, 5.0, 0.0], [x + 0.5, 1.0, 0.0]]
        }));
        let shoelace = |corners: &[[f64; 3]]| {
            let n = corners.len();
            (0..n)
                .map(|i| {
                    let (p, q) = (corners[i], corners[(i + 1) % n]);
                    (p[0] * q[1] - q[0] * p[1]) / 2.0
                })
                .sum::<f64>()
        };
        let turn = |i: usize, radius: f64| {
            let angle = i as f64 * 0.2;
            [radius * angle * angle.cos(), radius * angle * angle.sin(), 0.0]
        };
        let spiral: Vec<_> = (10..100)
            .map(|i| turn(i, 1.1))
            .chain((10..100).rev().map(|i| turn(i, 1.0)))
            .collect();
        for outline in [comb, spiral] {
            let turned = nalgebra::Rotation3::from_euler_angles(0.4, 1.1, -2.0);
            let corners: Vec<[f64; 3]> = outline
                .iter()
                .map(|p| (turned * Point3::from(*p)).coords.into())
                .collect();
            let expected = shoelace(&outline).abs();
            assert!((surface_area(&mesh(&corners)) - expected).abs() < 1e-9 * expected);
        }
    }

    #[test]
    fn outlines_that_cross_themselves_or_have_no_area_stay_fans() {
        let star: Vec<[f64; 3]> = (0..5)
            .map(|i| f64::from(i * 2) * std::f64::consts::TAU / 5.0)
            .map(|angle| [angle.cos(), angle.sin(), 0.0])
            .collect();
        assert_eq!(mesh(&star).n_triangles(), 3);
        assert_eq!(mesh(&[[1., 2., 3.]; 5]).n_triangles(), 3);
        assert_eq!(
            mesh(&[[0., 0., 0.], [1., 1., 0.], [1., 0., 0.], [0., 1., 0.]]).n_triangles(),
            2
        );
        assert_eq!(
            mesh(&[[0., 0., 0.], [1e200, 0., 0.], [0., 1e200, 0.], [1e200, 1e200, 0.]]).n_triangles(),
            2
        );
    }
}
