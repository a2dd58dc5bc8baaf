//! A part of a surface, cut exactly.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Point3, Vector3};

use super::simplify::simplified;
use super::whole::Whole;
use crate::TriMesh;

/// A plane through a point; the unit normal points above.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    pub(super) normal: Vector3<f64>,
    pub(super) origin: Point3<f64>,
}

impl Plane {
    fn height(&self, p: &Point3<f64>) -> f64 {
        self.normal.dot(&(p - self.origin))
    }
}

/// Some triangles of a surface, or what planes left of them, and the corners that the planes have inside the solid.
///
/// Every vertex belongs to a triangle. The corners of the part of a solid between planes are vertices of its surface,
/// places where planes cut its edges or two of them its faces, and points inside the solid where three planes meet:
/// with these the hull of a part contains its part of the inside.
#[derive(Clone)]
pub(super) struct Region {
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    /// The planes that cut it out, each with the side that was kept (1 above, −1 below).
    planes: Vec<(Plane, f64)>,
    inner: Vec<Point3<f64>>,
}

/// A vertex this close to the plane, relative to the largest distance from it, lies in it: no slivers by rounding.
const ON_PLANE: f64 = 1e-12;

impl Region {
    /// The triangles of a mesh.
    pub(super) fn of_mesh(mesh: &TriMesh) -> Self {
        let mut builder = Builder::new(mesh.vertices().len());
        for triangle in mesh.triangles() {
            let corners = triangle.map(|v| builder.keep(v, &mesh.vertices()[v as usize]));
            builder.region.triangles.push(corners);
        }
        builder.region
    }

    /// Points without a surface: each of them is a triangle that has shrunk to it.
    pub(super) fn of_points(points: &[Point3<f64>]) -> Self {
        Self {
            vertices: points.to_vec(),
            triangles: (0..points.len() as u32).map(|i| [i; 3]).collect(),
            planes: Vec::new(),
            inner: Vec::new(),
        }
    }

    /// The same, uncut, with about so many triangles at most.
    pub(super) fn simplified(&self, n_triangles: usize) -> Self {
        let (vertices, triangles) = simplified(&self.vertices, &self.triangles, n_triangles);
        Self {
            vertices,
            triangles,
            planes: Vec::new(),
            inner: Vec::new(),
        }
    }

    /// The same, uncut, with every vertex as `placed` has it.
    pub(super) fn moved(&self, placed: impl Fn(&Point3<f64>) -> Point3<f64>) -> Self {
        Self {
            vertices: self.vertices.iter().map(placed).collect(),
            triangles: self.triangles.clone(),
            planes: Vec::new(),
            inner: Vec::new(),
        }
    }

    /// Several regions as one, for boxes and images; it forgets the planes, so cut the regions themselves.
    pub(super) fn joined(regions: &[&Self]) -> Self {
        let mut joined = Self {
            vertices: Vec::new(),
            triangles: Vec::new(),
            planes: Vec::new(),
            inner: Vec::new(),
        };
        for region in regions {
            let first = joined.vertices.len() as u32;
            joined.vertices.extend(&region.vertices);
            joined.inner.extend(&region.inner);
            joined
                .triangles
                .extend(region.triangles.iter().map(|t| t.map(|v| v + first)));
        }
        joined
    }

    pub(super) fn vertices(&self) -> &[Point3<f64>] {
        &self.vertices
    }

    pub(super) fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// What a box must hold: the vertices and the corners inside.
    pub(super) fn points(&self) -> Vec<Point3<f64>> {
        self.vertices.iter().chain(&self.inner).copied().collect()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// The points of either side of a plane, without the parts' triangles and new corners inside.
    pub(super) fn points_beside(&self, plane: &Plane) -> [Vec<Point3<f64>>; 2] {
        let height = self.heights(plane);
        let mut sides = [Vec::new(), Vec::new()];
        for (p, h) in self.vertices.iter().zip(&height) {
            if *h <= 0.0 {
                sides[0].push(*p);
            }
            if *h >= 0.0 {
                sides[1].push(*p);
            }
        }
        for p in &self.inner {
            sides[usize::from(plane.height(p) > 0.0)].push(*p);
        }
        for &[a, b, c] in &self.triangles {
            for [from, to] in [[a, b], [b, c], [c, a]] {
                let (low, high) = (height[from as usize], height[to as usize]);
                if low * high < 0.0 {
                    let p = crossing(
                        [&self.vertices[from as usize], &self.vertices[to as usize]],
                        [low, high],
                    );
                    for side in &mut sides {
                        side.push(p);
                    }
                }
            }
        }
        sides
    }

    fn heights(&self, plane: &Plane) -> Vec<f64> {
        let mut heights: Vec<f64> = self.vertices.iter().map(|p| plane.height(p)).collect();
        let snap = ON_PLANE * heights.iter().fold(0.0_f64, |most, h| most.max(h.abs()));
        for h in &mut heights {
            if h.abs() <= snap {
                *h = 0.0;
            }
        }
        heights
    }

    /// The parts below and above a plane; triangles across it are clipped. `whole` is the body that this is part of.
    pub(super) fn cut(&self, plane: &Plane, whole: &Whole) -> [Self; 2] {
        let height = self.heights(plane);
        let n = self.vertices.len();
        let mut sides = [Builder::new(n), Builder::new(n)];
        for triangle in &self.triangles {
            let heights = triangle.map(|v| height[v as usize]);
            if heights.iter().all(|&h| h <= 0.0) {
                self.keep_whole(*triangle, &mut sides[0]);
            } else if heights.iter().all(|&h| h >= 0.0) {
                self.keep_whole(*triangle, &mut sides[1]);
            } else {
                for (side, sign) in sides.iter_mut().zip([-1.0, 1.0]) {
                    self.keep_clipped(*triangle, &height, sign, side);
                }
            }
        }
        let corners = self.corners_on(plane, whole);
        let mut sides = sides.map(|side| side.region);
        for (side, sign) in sides.iter_mut().zip([-1.0, 1.0]) {
            side.planes.clone_from(&self.planes);
            side.planes.push((*plane, sign));
            side.inner.clone_from(&corners);
            side.inner
                .extend(self.inner.iter().filter(|p| sign * plane.height(p) >= 0.0));
        }
        sides
    }

    /// Where the plane meets two of the region's own inside the solid.
    fn corners_on(&self, plane: &Plane, whole: &Whole) -> Vec<Point3<f64>> {
        let mut corners = Vec::new();
        for (i, (first, _)) in self.planes.iter().enumerate() {
            for (second, _) in &self.planes[..i] {
                let normals = Matrix3::from_rows(&[
                    plane.normal.transpose(),
                    first.normal.transpose(),
                    second.normal.transpose(),
                ]);
                let offsets = Vector3::new(0.0, -first.height(&plane.origin), -second.height(&plane.origin));
                let Some(inverse) = normals
                    .try_inverse()
                    .filter(|_| normals.determinant().abs() > 1e-6)
                else {
                    continue;
                };
                let corner = plane.origin + inverse * offsets;
                let is_inside = self
                    .planes
                    .iter()
                    .all(|(p, side)| side * p.height(&corner) >= -1e-9 * whole.reach);
                if is_inside && whole.holds(&corner) {
                    corners.push(corner);
                }
            }
        }
        corners
    }

    fn keep_whole(&self, triangle: [u32; 3], side: &mut Builder) {
        let corners = triangle.map(|v| side.keep(v, &self.vertices[v as usize]));
        side.region.triangles.push(corners);
    }

    /// Adds what lies where `sign` · height ≥ 0: a triangle or a quadrilateral.
    fn keep_clipped(&self, triangle: [u32; 3], height: &[f64], sign: f64, side: &mut Builder) {
        let mut polygon = [0_u32; 4];
        let mut len = 0;
        let mut push = |corner: u32| {
            polygon[len] = corner;
            len += 1;
        };
        for k in 0..3 {
            let (from, to) = (triangle[k], triangle[(k + 1) % 3]);
            let (a, b) = (sign * height[from as usize], sign * height[to as usize]);
            if a >= 0.0 {
                push(side.keep(from, &self.vertices[from as usize]));
            }
            if a * b < 0.0 {
                // Both triangles of an edge cut it in the same order of its ends, so they agree to the last bit.
                let (low, high) = (from.min(to), from.max(to));
                let (p, q) = (self.vertices[low as usize], self.vertices[high as usize]);
                let heights = [height[low as usize], height[high as usize]];
                push(side.keep_on_edge([low, high], || crossing([&p, &q], heights)));
            }
        }
        for last in 2..len {
            side.region
                .triangles
                .push([polygon[0], polygon[last - 1], polygon[last]]);
        }
    }
}

/// Where an edge meets the plane that its ends lie at these heights from.
fn crossing([p, q]: [&Point3<f64>; 2], [low, high]: [f64; 2]) -> Point3<f64> {
    p + (q - p) * (low / (low - high))
}

/// A region under construction, and where the vertices of its source went.
struct Builder {
    region: Region,
    kept: Vec<u32>,
    on_edges: BTreeMap<[u32; 2], u32>,
}

impl Builder {
    fn new(n_source_vertices: usize) -> Self {
        Self {
            region: Region {
                vertices: Vec::new(),
                triangles: Vec::new(),
                planes: Vec::new(),
                inner: Vec::new(),
            },
            kept: vec![u32::MAX; n_source_vertices],
            on_edges: BTreeMap::new(),
        }
    }

    fn keep(&mut self, source: u32, p: &Point3<f64>) -> u32 {
        let kept = &mut self.kept[source as usize];
        if *kept == u32::MAX {
            *kept = self.region.vertices.len() as u32;
            self.region.vertices.push(*p);
        }
        *kept
    }

    fn keep_on_edge(&mut self, edge: [u32; 2], point: impl FnOnce() -> Point3<f64>) -> u32 {
        let vertices = &mut self.region.vertices;
        *self.on_edges.entry(edge).or_insert_with(|| {
            vertices.push(point());
            vertices.len() as u32 - 1
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(region: &Region) -> f64 {
        let corners = region
            .triangles
            .iter()
            .map(|t| t.map(|v| region.vertices[v as usize]));
        corners
            .map(|[a, b, c]| (b - a).cross(&(c - a)).norm() / 2.0)
            .sum()
    }

    #[test]
    fn the_parts_of_a_cut_have_the_area_of_the_whole() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]].map(Point3::from);
        let mesh = TriMesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]).unwrap();
        let whole = Whole::new(Region::of_mesh(&mesh));
        let normal = Vector3::new(1.0, 2.0, 3.0).normalize();
        for position in [0.1, 0.5, 1.0] {
            let plane = Plane {
                normal,
                origin: (normal * position).into(),
            };
            let [below, above] = whole.region.cut(&plane, &whole);
            assert!((area(&below) + area(&above) - area(&whole.region)).abs() < 1e-12);
            assert!(
                below
                    .vertices
                    .iter()
                    .all(|p| normal.dot(&p.coords) <= position + 1e-12)
            );
            assert!(
                above
                    .vertices
                    .iter()
                    .all(|p| normal.dot(&p.coords) >= position - 1e-12)
            );
        }
    }

    #[test]
    fn a_cut_beside_the_body_leaves_one_part_empty() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(Point3::from);
        let mesh = TriMesh::new(corners.to_vec(), vec![[0, 1, 2]]).unwrap();
        let whole = Whole::new(Region::of_mesh(&mesh));
        let plane = Plane {
            normal: Vector3::x(),
            origin: Point3::new(2.0, 0.0, 0.0),
        };
        let [below, above] = whole.region.cut(&plane, &whole);
        assert!(!below.is_empty() && above.is_empty());
    }
}
