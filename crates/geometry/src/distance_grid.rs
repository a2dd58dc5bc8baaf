//! Distances to a surface on a regular grid: a cheap lower bound anywhere.

use nalgebra::{Point3, Vector3};

use crate::triangle_tree::TriangleTree;

/// Distances (m) at the nodes of a regular grid around a surface.
#[derive(Debug, Clone)]
pub(crate) struct DistanceGrid {
    low: Point3<f64>,
    spacing: f64,
    counts: [usize; 3],
    /// Rounded down to f32, so that they stay lower bounds.
    distances: Vec<f32>,
    surface_low: Point3<f64>,
    surface_high: Point3<f64>,
}

/// About this many nodes along the longest side.
const N_LONGEST: f64 = 48.0;
/// The grid reaches this much of its surface's longest side beyond it.
const MARGIN: f64 = 0.2;

impl DistanceGrid {
    /// Measures the distances. Neighbouring nodes start from each other's bound, so that each costs a few triangles.
    pub(crate) fn new(tree: &TriangleTree, low: Point3<f64>, high: Point3<f64>) -> Self {
        let longest = (high - low).max().max(1e-9);
        let margin = Vector3::repeat(longest * MARGIN);
        let spacing = longest * (1.0 + 2.0 * MARGIN) / N_LONGEST;
        let size = high - low + margin * 2.0;
        let counts: [usize; 3] = size.map(|s| (s / spacing).ceil() as usize + 1).into();
        let grid_low = low - margin;
        let mut distances = Vec::with_capacity(counts.iter().product());
        // Spacing plus a hair: the new distance is at most the neighbour's plus the step.
        let step = spacing * (1.0 + 1e-9) + 1e-12;
        let mut last = f64::INFINITY;
        for k in 0..counts[2] {
            for j in 0..counts[1] {
                for i in 0..counts[0] {
                    let p = grid_low + Vector3::new(i as f64, j as f64, k as f64) * spacing;
                    let below = if i > 0 { last + step } else { f64::INFINITY };
                    last = tree.nearest_point(&p, below).map_or(below, |(d, ..)| d);
                    distances.push((last as f32).next_down());
                }
            }
        }
        Self {
            low: grid_low,
            spacing,
            counts,
            distances,
            surface_low: low,
            surface_high: high,
        }
    }

    /// A lower bound of the distance from `p` to the surface; 0 where nothing better is known.
    pub(crate) fn lower_bound(&self, p: &Point3<f64>) -> f64 {
        let cell = (p - self.low) / self.spacing;
        let inside = (0..3).all(|k| cell[k] >= 0.0 && cell[k] < (self.counts[k] - 1) as f64);
        if !inside {
            // The surface lies within its bounds.
            let nearest = p
                .coords
                .sup(&self.surface_low.coords)
                .inf(&self.surface_high.coords);
            return (p.coords - nearest).norm();
        }
        let floor = cell.map(f64::floor);
        let base = floor.map(|f| f as usize);
        let fraction = cell - floor;
        let mut bound = 0.0_f64;
        for corner in 0..8 {
            let bit = [corner & 1, corner >> 1 & 1, corner >> 2 & 1];
            let at =
                ((base.z + bit[2]) * self.counts[1] + base.y + bit[1]) * self.counts[0] + base.x + bit[0];
            let offset = fraction - Vector3::from(bit.map(|b| b as f64));
            bound = bound.max(f64::from(self.distances[at]) - offset.norm() * self.spacing);
        }
        bound
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TriMesh;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn the_bound_never_exceeds_the_distance_and_is_close_to_it_far_away() {
        let corners = [
            [0.0, 0.0, 0.0],
            [0.2, 0.0, 0.01],
            [0.0, 0.1, 0.0],
            [0.05, 0.05, 0.15],
        ]
        .map(Point3::from);
        let mesh = TriMesh::new(corners.to_vec(), vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]).unwrap();
        let tree = TriangleTree::new(&mesh);
        let (low, high) = mesh.axis_aligned_bounds();
        let grid = DistanceGrid::new(&tree, low, high);
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut largest_loss = 0.0_f64;
        for _ in 0..20_000 {
            let p = Point3::from(Vector3::from_fn(|_, _| rng.random_range(-0.15..0.35)));
            let exact = tree.nearest_point(&p, f64::INFINITY).unwrap().0;
            let bound = grid.lower_bound(&p);
            assert!(bound <= exact + 1e-12, "{p}: {bound} > {exact}");
            if (0..3).all(|k| p[k] > -0.03 && p[k] < high[k] + 0.03) {
                largest_loss = largest_loss.max(exact - bound);
            }
        }
        assert!(
            largest_loss < 0.2 * 1.4 / 48.0 * 0.9,
            "at most half a cell's diagonal: {largest_loss}"
        );
    }
}
