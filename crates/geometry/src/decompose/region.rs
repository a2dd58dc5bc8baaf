//! A part of a surface, cut exactly.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use crate::TriMesh;

/// Some triangles of a surface, or what planes left of them. Every vertex belongs to a triangle.
pub(super) struct Region {
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
}

/// A vertex this close to the plane, relative to the largest distance from it, lies in it: no slivers by rounding.
const ON_PLANE: f64 = 1e-12;

impl Region {
    pub(super) fn of_mesh(mesh: &TriMesh) -> Self {
        let mut builder = Builder::new(mesh.vertices().len());
        for triangle in mesh.triangles() {
            let corners = triangle.map(|v| builder.keep(v, &mesh.vertices()[v as usize]));
            builder.region.triangles.push(corners);
        }
        builder.region
    }

    pub(super) fn vertices(&self) -> &[Point3<f64>] {
        &self.vertices
    }

    pub(super) fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    pub(super) fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// The parts below and above the plane {p : normal · (p − origin) = position}; triangles across it are clipped.
    pub(super) fn cut(&self, normal: &Vector3<f64>, origin: &Point3<f64>, position: f64) -> [Self; 2] {
        let mut height: Vec<f64> = self
            .vertices
            .iter()
            .map(|p| normal.dot(&(p - origin)) - position)
            .collect();
        let snap = ON_PLANE * height.iter().fold(0.0_f64, |most, h| most.max(h.abs()));
        for h in &mut height {
            if h.abs() <= snap {
                *h = 0.0;
            }
        }
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
        sides.map(|side| side.region)
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
                let t = height[low as usize] / (height[low as usize] - height[high as usize]);
                push(side.keep_on_edge([low, high], || p + (q - p) * t));
            }
        }
        for last in 2..len {
            side.region
                .triangles
                .push([polygon[0], polygon[last - 1], polygon[last]]);
        }
    }
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
        let whole = Region::of_mesh(&mesh);
        let normal = Vector3::new(1.0, 2.0, 3.0).normalize();
        for position in [0.1, 0.5, 1.0] {
            let [below, above] = whole.cut(&normal, &Point3::origin(), position);
            assert!((area(&below) + area(&above) - area(&whole)).abs() < 1e-12);
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
        let whole = Region::of_mesh(&TriMesh::new(corners.to_vec(), vec![[0, 1, 2]]).unwrap());
        let [below, above] = whole.cut(&Vector3::x(), &Point3::origin(), 2.0);
        assert!(!below.is_empty() && above.is_empty());
    }
}
