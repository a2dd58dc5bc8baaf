//! Points spread evenly over a surface, and which of them are neighbours.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};
use prehend_geometry::TriMesh;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::TutorError;

/// Points spread evenly over a surface.
#[derive(Debug, Clone)]
pub(crate) struct SurfaceSamples {
    pub(crate) points: Vec<Point3<f64>>,
    /// Outward unit normals, as the mesh winds its triangles.
    pub(crate) normals: Vec<Vector3<f64>>,
    /// The area (m²) that each point stands for; they sum to the surface's.
    pub(crate) areas: Vec<f64>,
    /// For each point, the points beside it on the same side of the surface, ascending.
    pub(crate) neighbors: Vec<Vec<u32>>,
}

impl SurfaceSamples {
    /// About `n` points by dart throwing: many candidates drawn by area, in random order, each kept unless a kept one
    /// on the same side is too near. Candidates then vote for the area of the kept point nearest to them.
    pub(crate) fn draw(mesh: &TriMesh, n: usize, seed: u64) -> Result<Self, TutorError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let doubled: Vec<Vector3<f64>> = mesh.corners().map(|[a, b, c]| (b - a).cross(&(c - a))).collect();
        let area = doubled.iter().map(|d| d.norm() / 2.0).sum::<f64>();
        if !(area.is_finite() && area > 0.0) {
            return Err(TutorError::NoSurface { area });
        }

        let n_candidates = CANDIDATES_PER_POINT * n;
        let mut candidates = Vec::with_capacity(n_candidates);
        let mut triangle = 0;
        let mut passed = doubled[0].norm() / 2.0;
        for k in 0..n_candidates {
            let at = (k as f64 + rng.random::<f64>()) / n_candidates as f64 * area;
            while passed < at && triangle + 1 < doubled.len() {
                triangle += 1;
                passed += doubled[triangle].norm() / 2.0;
            }
            let (mut u, mut v) = (rng.random::<f64>(), rng.random::<f64>());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let [a, b, c] = mesh.triangle(triangle);
            let normal = doubled[triangle].try_normalize(0.0).unwrap_or_else(Vector3::z);
            candidates.push((a + u * (b - a) + v * (c - a), normal));
        }
        for k in (1..candidates.len()).rev() {
            candidates.swap(k, rng.random_range(0..=k));
        }

        let spacing = SPACING * (area / n as f64).sqrt();
        let mut grid = Grid {
            cell: spacing,
            cells: BTreeMap::new(),
        };
        let mut samples = Self {
            points: vec![],
            normals: vec![],
            areas: vec![],
            neighbors: vec![],
        };
        for (point, normal) in &candidates {
            if samples.nearest(&grid, point, normal, spacing).is_none() {
                grid.insert(point, samples.points.len() as u32);
                samples.points.push(*point);
                samples.normals.push(*normal);
            }
        }
        samples.areas = vec![0.0; samples.points.len()];
        for (point, normal) in &candidates {
            if let Some(nearest) = samples.nearest(&grid, point, normal, spacing) {
                samples.areas[nearest as usize] += area / n_candidates as f64;
            }
        }
        samples.neighbors = (0..samples.points.len())
            .map(|i| samples.beside(&grid, i, REACH * spacing))
            .collect();
        Ok(samples)
    }

    /// The kept point nearest to `point` within `radius` and on the same side.
    fn nearest(&self, grid: &Grid, point: &Point3<f64>, normal: &Vector3<f64>, radius: f64) -> Option<u32> {
        let mut best: Option<(f64, u32)> = None;
        grid.near(point, 1, |i| {
            let distance = (self.points[i as usize] - point).norm();
            if distance < radius
                && self.normals[i as usize].dot(normal) > SAME_SIDE
                && best.is_none_or(|b| (distance, i) < b)
            {
                best = Some((distance, i));
            }
        });
        best.map(|(_, i)| i)
    }

    fn beside(&self, grid: &Grid, of: usize, radius: f64) -> Vec<u32> {
        let mut found = Vec::new();
        grid.near(&self.points[of], REACH.ceil() as i64, |i| {
            if i as usize != of
                && (self.points[i as usize] - self.points[of]).norm() < radius
                && self.normals[i as usize].dot(&self.normals[of]) > SAME_SIDE
            {
                found.push(i);
            }
        });
        found.sort_unstable();
        found
    }
}

/// Candidates drawn per point asked for; more make the spread more even.
const CANDIDATES_PER_POINT: usize = 10;
/// Least distance of two points, as a share of √(area per point): dart throwing then keeps about as many as asked.
const SPACING: f64 = 0.83;
/// Points are neighbours up to this many spacings.
const REACH: f64 = 2.0;
/// Cosine between two normals above which they count as one side: past a right-angled edge, but not through a wall.
const SAME_SIDE: f64 = -0.2;

/// Points by the cube that they lie in.
struct Grid {
    cell: f64,
    cells: BTreeMap<[i64; 3], Vec<u32>>,
}

impl Grid {
    fn key(&self, p: &Point3<f64>) -> [i64; 3] {
        [p.x, p.y, p.z].map(|c| (c / self.cell).floor() as i64)
    }

    fn insert(&mut self, p: &Point3<f64>, index: u32) {
        self.cells.entry(self.key(p)).or_default().push(index);
    }

    fn near(&self, p: &Point3<f64>, cells: i64, mut visit: impl FnMut(u32)) {
        let [x, y, z] = self.key(p);
        for dx in -cells..=cells {
            for dy in -cells..=cells {
                for (_, found) in self
                    .cells
                    .range([x + dx, y + dy, z - cells]..=[x + dx, y + dy, z + cells])
                {
                    for &i in found {
                        visit(i);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(side: f64) -> TriMesh {
        let corners = [[0.0, 0.0], [side, 0.0], [side, side], [0.0, side]];
        let vertices = corners.iter().map(|[x, y]| Point3::new(*x, *y, 0.0)).collect();
        TriMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3]]).unwrap()
    }

    #[test]
    fn the_areas_sum_to_the_surface_and_the_count_is_near_what_was_asked() {
        let samples = SurfaceSamples::draw(&square(0.1), 1000, 1).unwrap();
        assert!((samples.areas.iter().sum::<f64>() - 0.01).abs() < 1e-9);
        assert!(
            (700..1300).contains(&samples.points.len()),
            "{}",
            samples.points.len()
        );
        let lonely = samples.neighbors.iter().filter(|n| n.len() < 2).count();
        assert_eq!(lonely, 0);
    }

    #[test]
    fn the_same_seed_gives_the_same_points() {
        let a = SurfaceSamples::draw(&square(0.1), 300, 5).unwrap();
        let b = SurfaceSamples::draw(&square(0.1), 300, 5).unwrap();
        assert_eq!((a.points, a.areas), (b.points, b.areas));
    }

    #[test]
    fn a_flat_sliver_has_no_surface() {
        let line = TriMesh::new(
            [0.0, 1.0, 2.0].map(|x| Point3::new(x, 0.0, 0.0)).to_vec(),
            vec![[0, 1, 2]],
        )
        .unwrap();
        assert_eq!(
            SurfaceSamples::draw(&line, 10, 1).unwrap_err(),
            TutorError::NoSurface { area: 0.0 }
        );
    }
}
