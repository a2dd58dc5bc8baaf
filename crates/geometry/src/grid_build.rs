//! Measuring the distances of a [`DistanceGrid`]: coarse nodes when it is made, a brick when it is first asked for.
//!
//! Fine nodes get their distances from the triangles near their brick: a triangle within the band of a node is within
//! reach of its brick. Only near holes the side can change without a surface; there the bricks around are looked at, too.

use nalgebra::{Point3, Vector3};
use parry3d_f64::partitioning::TraversalAction;
use rayon::prelude::*;

use crate::distance_grid::{BAND, Brick, DOUBTFUL, DistanceGrid, N_ACROSS, N_BRICK, N_FINE, TORN, corners};
use crate::sides::{Sides, spread};
use crate::triangle_tree::TriangleTree;
use crate::{closest, parry_bridge};

/// Spacing is chosen for about so many bricks.
const N_BRICKS: f64 = 5000.0;
/// A brick for every so much of (4 h)² of surface: what bands around flat faces take.
const BRICKS_PER_FACE: f64 = 3.4;
/// At most this many coarse cells along the longest side.
const MAX_COARSE: f64 = 64.0;
/// The coarse grid reaches this much of its surface's longest side beyond it.
const MARGIN: f64 = 0.2;

/// The fine band ends this many spacings from the surface: beyond it lies what no cell of the band needs.
fn reach(spacing: f64) -> f64 {
    spacing * (BAND + 3.0_f64.sqrt() * (1.0 + 1e-9))
}

impl DistanceGrid {
    /// Measures the coarse distances, in parallel; the same whatever the number of threads.
    pub(crate) fn new(tree: TriangleTree, sides: Sides) -> Self {
        let (low, high) = (sides.low, sides.high);
        let longest = (high - low).max().max(1e-9);
        let area: f64 = tree
            .triangles
            .iter()
            .map(|[a, b, c]| (b - a).cross(&(c - a)).norm() / 2.0)
            .sum();
        let coarsest = longest * (1.0 + 2.0 * MARGIN) / MAX_COARSE;
        let coarse_step = (area * BRICKS_PER_FACE / N_BRICKS).sqrt().max(coarsest);
        let coarse_step = if coarse_step.is_finite() {
            coarse_step
        } else {
            coarsest
        };
        let grid_low = low - Vector3::repeat(longest * MARGIN);
        let size = high - low + Vector3::repeat(longest * 2.0 * MARGIN);
        let counts: [usize; 3] = size.map(|s| (s / coarse_step).ceil().max(1.0) as usize).into();
        let mut grid = Self {
            tree,
            sides,
            low: grid_low,
            spacing: coarse_step / N_FINE as f64,
            counts,
            coarse: Vec::new(),
            cells: vec![0; counts.iter().product()],
            fine: Vec::new(),
        };
        grid.coarse = grid.coarse_distances();
        grid.sign_coarse();
        grid.mark_torn();
        grid.number_fine();
        grid
    }

    /// Distances at coarse nodes. The triangle nearest to a node is near its neighbour's, too, so that each costs a few.
    fn coarse_distances(&self) -> Vec<f32> {
        let step = self.spacing * N_FINE as f64;
        let [nx, ny, nz] = self.counts;
        let rows: Vec<Vec<f32>> = (0..(ny + 1) * (nz + 1))
            .into_par_iter()
            .map(|row| {
                let (j, k) = (row % (ny + 1), row / (ny + 1));
                let mut nearest = None;
                let node = |i: usize| {
                    let p = self.low + Vector3::new(i as f64, j as f64, k as f64) * step;
                    let to_last =
                        nearest.map(|t| (closest::on_triangle(&p, self.tree.triangle(t)) - p).norm());
                    let below = to_last.filter(|d| d.is_finite()).unwrap_or(f64::INFINITY);
                    let distance = self.tree.nearest_point(&p, below).map_or(below, |(d, _, t)| {
                        nearest = Some(t);
                        d
                    });
                    distance as f32
                };
                (0..=nx).map(node).collect()
            })
            .collect();
        rows.concat()
    }

    /// Turns coarse distances inside negative.
    fn sign_coarse(&mut self) {
        let size = self.spacing * N_FINE as f64;
        let n = self.counts.map(|n| n + 1);
        let low = self.low;
        let place = |i: usize| {
            low + Vector3::new(i % n[0], i / n[0] % n[1], i / (n[0] * n[1])).map(|i| i as f64) * size
        };
        let sides = &self.sides;
        let known: Vec<Option<bool>> = (0..self.coarse.len())
            .into_par_iter()
            .map(|i| sides.known_at(&place(i), || sides.holes.are_far_from(&place(i), size)))
            .collect();
        spread(&mut self.coarse, n, size, known, |i| sides.is_inside(&place(i)));
    }

    /// Numbers the coarse cells that may have a node in the band (some corner is near enough) or a doubtful sign.
    fn number_fine(&mut self) {
        let doubtful: Vec<usize> = (0..self.cells.len())
            .into_par_iter()
            .filter(|&cell| self.may_have_brick(cell) && !self.is_far_from_holes(cell))
            .collect();
        for cell in doubtful {
            for other in self.with_neighbours(cell) {
                self.cells[other] |= DOUBTFUL;
            }
        }
        let mut n_fine = 0;
        for cell in 0..self.cells.len() {
            if self.cells[cell] & DOUBTFUL != 0 || self.may_have_brick(cell) {
                n_fine += 1;
                self.cells[cell] |= n_fine;
            }
        }
        self.fine.resize_with(n_fine as usize, Default::default);
    }

    fn may_have_brick(&self, cell: usize) -> bool {
        let size = self.spacing * N_FINE as f64;
        let near = (reach(self.spacing) + size * 0.75_f64.sqrt()) * (1.0 + 1e-6);
        self.around(cell).iter().any(|d| d.abs() <= near)
    }

    /// A coarse cell and those that share a corner with it.
    fn with_neighbours(&self, cell: usize) -> Vec<usize> {
        let [nx, ny, nz] = self.counts;
        let range = |i: usize, n: usize| i.saturating_sub(1)..(i + 2).min(n);
        let mut all = Vec::with_capacity(27);
        for z in range(cell / (nx * ny), nz) {
            for y in range(cell / nx % ny, ny) {
                all.extend(range(cell % nx, nx).map(|x| (z * ny + y) * nx + x));
            }
        }
        all
    }

    fn is_far_from_holes(&self, cell: usize) -> bool {
        let half = self.spacing * N_FINE as f64 / 2.0;
        let middle = self.cell_low(cell) + Vector3::repeat(half);
        self.sides.holes.are_far_from(&middle, half * 3.0_f64.sqrt())
    }

    /// The distances of a coarse cell's brick; `None` where no node lies in the band.
    pub(crate) fn measured_brick(&self, cell: usize) -> Option<Box<Brick>> {
        let low = self.cell_low(cell);
        let reach = reach(self.spacing);
        let mut brick = distances(
            &self.tree,
            &self.near_triangles(&low, reach),
            &low,
            self.spacing,
            reach,
        )?;
        self.sign_brick(cell, &mut brick, &low);
        Some(brick)
    }

    fn cell_low(&self, cell: usize) -> Point3<f64> {
        self.low + self.coarse_place(cell) * (self.spacing * N_FINE as f64)
    }

    /// Distances at a coarse cell's corners.
    fn around(&self, cell: usize) -> [f64; 8] {
        let (row, slice) = (self.counts[0] + 1, (self.counts[0] + 1) * (self.counts[1] + 1));
        let at = self.coarse_place(cell).map(|x| x as usize);
        corners(&self.coarse, at.z * slice + at.y * row + at.x, row, slice)
    }

    fn coarse_place(&self, cell: usize) -> Vector3<f64> {
        let [nx, ny, _] = self.counts;
        Vector3::new(cell % nx, cell / nx % ny, cell / (nx * ny)).map(|i| i as f64)
    }

    /// The triangles that may come within `reach` of the coarse cell that starts at `low`.
    fn near_triangles(&self, low: &Point3<f64>, reach: f64) -> Vec<u32> {
        let half = self.spacing * N_FINE as f64 / 2.0;
        let middle = low + Vector3::repeat(half);
        let mut found = Vec::new();
        self.tree.bvh.traverse(|node| {
            let (center, extent) = parry_bridge::node_bounds(node);
            let apart = (middle.coords - Vector3::from(center)).abs() - Vector3::from(extent);
            if apart.max() > (half + reach) * (1.0 + 1e-9) {
                return TraversalAction::Prune;
            }
            if let Some(i) = node.leaf_data() {
                let [a, b, c] = self.tree.triangle(i);
                let normal = (b - a).cross(&(c - a));
                let slab = normal.norm() * reach + normal.abs().sum() * half;
                if normal.dot(&(middle - a)).abs() <= slab * (1.0 + 1e-9) {
                    found.push(i);
                }
            }
            TraversalAction::Continue
        });
        found
    }

    /// Turns a brick's distances inside negative. Its corners are coarse nodes, whose sides are known.
    fn sign_brick(&self, cell: usize, brick: &mut Brick, low: &Point3<f64>) {
        let place = |i: usize| low + brick_place(i) * self.spacing;
        let are_far = self.is_far_from_holes(cell);
        let mut known: Vec<Option<bool>> = (0..N_BRICK)
            .map(|i| self.sides.known_at(&place(i), || are_far))
            .collect();
        for (i, d) in self.around(cell).iter().enumerate() {
            let bit = |k: usize| (i >> k & 1) * N_FINE;
            known[(bit(2) * N_ACROSS + bit(1)) * N_ACROSS + bit(0)] = Some(*d < 0.0);
        }
        spread(brick, [N_ACROSS; 3], self.spacing, known, |i| {
            self.sides.is_inside(&place(i))
        });
    }

    /// Marks the coarse cells where the sign jumps between corners, and the cells around these.
    fn mark_torn(&mut self) {
        let size = self.spacing * N_FINE as f64;
        let torn: Vec<usize> = (0..self.cells.len())
            .into_par_iter()
            .filter(|&cell| jumps(&self.around(cell), size))
            .collect();
        for cell in torn {
            for other in self.with_neighbours(cell) {
                self.cells[other] |= TORN;
            }
        }
    }

    /// Whether the sign jumps between fine nodes of a coarse cell or one around it.
    pub(crate) fn is_torn_around(&self, cell: usize) -> bool {
        let in_brick = |brick: &Brick| {
            (0..N_FINE * N_FINE * N_FINE).any(|i| {
                let (x, y, z) = (i % N_FINE, i / N_FINE % N_FINE, i / (N_FINE * N_FINE));
                let first = (z * N_ACROSS + y) * N_ACROSS + x;
                let around = corners(brick, first, N_ACROSS, N_ACROSS * N_ACROSS);
                around.iter().all(|d| d.is_finite()) && jumps(&around, self.spacing)
            })
        };
        self.with_neighbours(cell)
            .into_iter()
            .any(|other| self.brick(other).is_some_and(in_brick))
    }
}

/// Whether distances at a cell's corners differ by more than these are apart.
fn jumps(corners: &[f64; 8], size: f64) -> bool {
    (0..8).any(|i| {
        [1, 2, 4]
            .iter()
            .filter(|bit| i & **bit == 0)
            .any(|bit| (corners[i | bit] - corners[i]).abs() > size * (1.0 + 1e-4))
    })
}

/// Unsigned distances at a brick's nodes, infinite from `reach` on; `None` where all are.
fn distances(
    tree: &TriangleTree,
    triangles: &[u32],
    low: &Point3<f64>,
    spacing: f64,
    reach: f64,
) -> Option<Box<Brick>> {
    let near: Vec<Near> = triangles
        .iter()
        .map(|&i| {
            let corners = *tree.triangle(i);
            let middle = Point3::from((corners[0].coords + corners[1].coords + corners[2].coords) / 3.0);
            let radius = corners
                .iter()
                .map(|p| (p - middle).norm_squared())
                .fold(0.0, f64::max)
                .sqrt();
            let [a, b, c] = corners;
            let normal = (b - a).cross(&(c - a)).try_normalize(f64::MIN_POSITIVE);
            Near {
                middle,
                radius,
                normal: normal.unwrap_or_else(Vector3::zeros),
                corners,
            }
        })
        .collect();
    let mut brick = Box::new([f32::INFINITY; N_BRICK]);
    let mut any = false;
    let mut candidates = Vec::with_capacity(near.len());
    // An eighth of the brick at a time: what is nearest to one of its nodes is near its middle, too.
    for eighth in 0..8 {
        let range = |k: usize| {
            if eighth >> k & 1 == 0 {
                0..N_FINE / 2 + 1
            } else {
                N_FINE / 2 + 1..N_ACROSS
            }
        };
        let middle = Vector3::from_fn(|k, _| (range(k).start + range(k).end - 1) as f64 / 2.0);
        let radius = Vector3::from_fn(|k, _| (range(k).len() - 1) as f64 / 2.0).norm() * spacing;
        let p = low + middle * spacing;
        let limit = nearest(&p, &near, reach + radius).0 + 2.0 * radius;
        let limit = limit.min(reach + radius) * (1.0 + 1e-9);
        candidates.clear();
        candidates.extend(near.iter().filter(|t| t.may_be_within(&p, limit)).copied());
        if candidates.is_empty() {
            continue;
        }
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    let i = (z * N_ACROSS + y) * N_ACROSS + x;
                    let (distance, best) = nearest(&(low + brick_place(i) * spacing), &candidates, reach);
                    // The neighbour's nearest triangle comes first: most others are then farther at a glance.
                    candidates.swap(0, best);
                    if distance < reach {
                        brick[i] = distance as f32;
                        any = true;
                    }
                }
            }
        }
    }
    any.then_some(brick)
}

/// A triangle and a disc around it.
#[derive(Clone, Copy)]
struct Near {
    middle: Point3<f64>,
    radius: f64,
    /// Unit; zero for a triangle without area.
    normal: Vector3<f64>,
    corners: [Point3<f64>; 3],
}

impl Near {
    fn may_be_within(&self, p: &Point3<f64>, limit: f64) -> bool {
        let sure = limit + self.radius;
        let from_middle = p - self.middle;
        let squared = from_middle.norm_squared();
        if squared >= sure * sure {
            return false;
        }
        // No nearer than the disc: above it by the height, beside it by what the way along its plane exceeds the radius.
        let height = self.normal.dot(&from_middle);
        let beside = (squared - height * height).max(0.0).sqrt() - self.radius;
        beside <= 0.0 && height.abs() < limit || height * height + beside * beside < limit * limit
    }
}

/// The distance of the nearest of some triangles (or `reach` where none is nearer), and which one it is.
fn nearest(p: &Point3<f64>, triangles: &[Near], reach: f64) -> (f64, usize) {
    let (mut least, mut best) = (reach, 0);
    for (i, triangle) in triangles.iter().enumerate() {
        if triangle.may_be_within(p, least) {
            let d = (closest::on_triangle(p, &triangle.corners) - p).norm();
            if d < least {
                (least, best) = (d, i);
            }
        }
    }
    (least, best)
}

/// Where a brick's node is, in spacings from its first.
fn brick_place(i: usize) -> Vector3<f64> {
    Vector3::new(i % N_ACROSS, i / N_ACROSS % N_ACROSS, i / (N_ACROSS * N_ACROSS)).map(|i| i as f64)
}
