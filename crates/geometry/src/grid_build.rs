//! Measuring the distances of a [`DistanceGrid`].
//!
//! Fine nodes near the surface get theirs from the triangles near their brick: a triangle within the band of a node is
//! within reach of its brick. Signs spread from node to node where no surface can lie between: two neighbours h apart
//! whose distances add up to more than h. Regions that this does not reach, and nodes near holes, ask for their winding
//! number.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::closest;
use crate::distance_grid::{BAND, DistanceGrid, N_ACROSS, N_BRICK, N_FINE, TORN, corners};
use crate::holes::Holes;
use crate::triangle_tree::TriangleTree;
use crate::winding::WindingTree;

/// Spacing is chosen for about so many bricks.
const N_BRICKS: f64 = 5000.0;
/// A brick for every so much of (4 h)² of surface: what bands around flat faces take.
const BRICKS_PER_FACE: f64 = 3.4;
/// At most this many coarse cells along the longest side.
const MAX_COARSE: f64 = 64.0;
/// The coarse grid reaches this much of its surface's longest side beyond it.
const MARGIN: f64 = 0.2;
impl DistanceGrid {
    /// Measures all distances, in parallel; the same whatever the number of threads.
    pub(crate) fn new(
        tree: &TriangleTree,
        winding: &WindingTree,
        low: Point3<f64>,
        high: Point3<f64>,
    ) -> Self {
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
            low: grid_low,
            spacing: coarse_step / N_FINE as f64,
            counts,
            coarse: Vec::new(),
            cells: vec![0; counts.iter().product()],
            fine: Vec::new(),
            surface_low: low,
            surface_high: high,
        };
        let sides = Sides {
            low,
            high,
            holes: Holes::of(&tree.triangles),
            winding,
        };
        grid.coarse = grid.coarse_distances(tree);
        grid.sign_coarse(&sides);
        grid.fill_bricks(tree, &sides);
        grid.mark_torn();
        grid
    }

    /// Distances at coarse nodes. Neighbours start from each other's bound, so that each costs a few triangles.
    fn coarse_distances(&self, tree: &TriangleTree) -> Vec<f32> {
        let step = self.spacing * N_FINE as f64;
        let [nx, ny, nz] = self.counts;
        let rows: Vec<Vec<f32>> = (0..(ny + 1) * (nz + 1))
            .into_par_iter()
            .map(|row| {
                let (j, k) = (row % (ny + 1), row / (ny + 1));
                let mut below = f64::INFINITY;
                let node = |i: usize| {
                    let p = self.low + Vector3::new(i as f64, j as f64, k as f64) * step;
                    let distance = tree.nearest_point(&p, below).map_or(below, |(d, ..)| d);
                    // Plus a hair: the next distance is at most this one's plus the step.
                    below = distance + step * (1.0 + 1e-9) + 1e-12;
                    distance as f32
                };
                (0..=nx).map(node).collect()
            })
            .collect();
        rows.concat()
    }

    /// Turns coarse distances inside negative.
    fn sign_coarse(&mut self, sides: &Sides) {
        let size = self.spacing * N_FINE as f64;
        let n = self.counts.map(|n| n + 1);
        let place = |i: usize| {
            self.low + Vector3::new(i % n[0], i / n[0] % n[1], i / (n[0] * n[1])).map(|i| i as f64) * size
        };
        let known: Vec<Option<bool>> = (0..self.coarse.len())
            .into_par_iter()
            .map(|i| sides.known_at(&place(i), || sides.holes.are_far_from(&place(i), size)))
            .collect();
        spread(&mut self.coarse, n, size, known, |i| sides.is_inside(&place(i)));
    }

    /// Fills the bricks of all coarse cells that have a node in the band.
    fn fill_bricks(&mut self, tree: &TriangleTree, sides: &Sides) {
        let reach = self.spacing * (BAND + 3.0_f64.sqrt() * (1.0 + 1e-9));
        let near = self.near_triangles(tree, reach);
        let bricks: Vec<Option<(usize, Brick)>> = near
            .par_iter()
            .map(|(cell, triangles)| {
                let low = self.low + self.coarse_place(*cell) * (self.spacing * N_FINE as f64);
                let mut brick = distances(tree, triangles, &low, self.spacing, reach)?;
                self.sign_brick(*cell, &mut brick, &low, sides);
                Some((*cell, brick))
            })
            .collect();
        for (cell, brick) in bricks.into_iter().flatten() {
            self.fine.extend(brick);
            self.cells[cell] = (self.fine.len() / N_BRICK) as u32;
        }
    }

    fn coarse_place(&self, cell: usize) -> Vector3<f64> {
        let [nx, ny, _] = self.counts;
        Vector3::new(cell % nx, cell / nx % ny, cell / (nx * ny)).map(|i| i as f64)
    }

    /// For each coarse cell with any: the triangles that may come within `reach` of it.
    fn near_triangles(&self, tree: &TriangleTree, reach: f64) -> Vec<(usize, Vec<u32>)> {
        let size = self.spacing * N_FINE as f64;
        let mut pairs: Vec<(u32, u32)> = Vec::new();
        for (i, [a, b, c]) in tree.triangles.iter().enumerate() {
            let range = |k: usize| {
                let low = (a[k].min(b[k]).min(c[k]) - reach - self.low[k]) / size;
                let high = (a[k].max(b[k]).max(c[k]) + reach - self.low[k]) / size;
                (low.max(0.0) as usize)..((high.max(0.0) as usize) + 1).min(self.counts[k])
            };
            let normal = (b - a).cross(&(c - a));
            let slab = normal.norm() * reach + normal.abs().sum() * size / 2.0;
            for z in range(2) {
                for y in range(1) {
                    for x in range(0) {
                        let middle = self.low
                            + (Vector3::new(x, y, z).map(|i| i as f64) + Vector3::repeat(0.5)) * size;
                        if normal.dot(&(middle - a)).abs() <= slab * (1.0 + 1e-9) {
                            let cell = (z * self.counts[1] + y) * self.counts[0] + x;
                            pairs.push((cell as u32, i as u32));
                        }
                    }
                }
            }
        }
        pairs.par_sort_unstable();
        pairs
            .chunk_by(|a, b| a.0 == b.0)
            .map(|chunk| (chunk[0].0 as usize, chunk.iter().map(|pair| pair.1).collect()))
            .collect()
    }

    /// Turns a brick's distances inside negative. Its corners are coarse nodes, whose sides are known.
    fn sign_brick(&self, cell: usize, brick: &mut Brick, low: &Point3<f64>, sides: &Sides) {
        let place = |i: usize| low + brick_place(i) * self.spacing;
        let half = self.spacing * N_FINE as f64 / 2.0;
        let are_far = sides
            .holes
            .are_far_from(&(low + Vector3::repeat(half)), half * 3.0_f64.sqrt());
        let mut known: Vec<Option<bool>> = (0..N_BRICK)
            .map(|i| sides.known_at(&place(i), || are_far))
            .collect();
        let (row, slice) = (self.counts[0] + 1, (self.counts[0] + 1) * (self.counts[1] + 1));
        let at = self.coarse_place(cell).map(|x| x as usize);
        let around = corners(&self.coarse, at.z * slice + at.y * row + at.x, row, slice);
        for (i, d) in around.iter().enumerate() {
            let bit = |k: usize| (i >> k & 1) * N_FINE;
            known[(bit(2) * N_ACROSS + bit(1)) * N_ACROSS + bit(0)] = Some(*d < 0.0);
        }
        spread(brick, [N_ACROSS; 3], self.spacing, known, |i| {
            sides.is_inside(&place(i))
        });
    }

    /// Marks the cells where neighbours' distances differ by more than they are apart, and the cells around these.
    fn mark_torn(&mut self) {
        let [nx, ny, nz] = self.counts;
        let (row, slice) = (nx + 1, (nx + 1) * (ny + 1));
        let torn: Vec<usize> = (0..self.cells.len())
            .into_par_iter()
            .filter(|&cell| {
                let [x, y, z] = [cell % nx, cell / nx % ny, cell / (nx * ny)];
                let around = corners(&self.coarse, z * slice + y * row + x, row, slice);
                let is_torn = |corners: &[f64; 8], size: f64| {
                    (0..8).any(|i| {
                        let others = [1, 2, 4]
                            .iter()
                            .filter(|bit| i & **bit == 0)
                            .map(|bit| corners[i | bit]);
                        others
                            .into_iter()
                            .any(|d| (d - corners[i]).abs() > size * (1.0 + 1e-4))
                    })
                };
                let in_brick = |brick: usize| {
                    (0..N_FINE * N_FINE * N_FINE).any(|i| {
                        let (x, y, z) = (i % N_FINE, i / N_FINE % N_FINE, i / (N_FINE * N_FINE));
                        let first = brick * N_BRICK + (z * N_ACROSS + y) * N_ACROSS + x;
                        let around = corners(&self.fine, first, N_ACROSS, N_ACROSS * N_ACROSS);
                        around.iter().all(|d| d.is_finite()) && is_torn(&around, self.spacing)
                    })
                };
                let brick = (self.cells[cell] as usize).checked_sub(1);
                is_torn(&around, self.spacing * N_FINE as f64) || brick.is_some_and(in_brick)
            })
            .collect();
        for cell in torn {
            let [x, y, z] = [cell % nx, cell / nx % ny, cell / (nx * ny)];
            let around = |i: usize, n: usize| i.saturating_sub(1)..(i + 2).min(n);
            for z in around(z, nz) {
                for y in around(y, ny) {
                    for x in around(x, nx) {
                        self.cells[(z * ny + y) * nx + x] |= TORN;
                    }
                }
            }
        }
    }
}

type Brick = [f32; N_BRICK];

/// Unsigned distances at a brick's nodes, infinite from `reach` on; `None` where all are.
fn distances(
    tree: &TriangleTree,
    triangles: &[u32],
    low: &Point3<f64>,
    spacing: f64,
    reach: f64,
) -> Option<Brick> {
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
            Near {
                middle,
                radius,
                corners,
            }
        })
        .collect();
    let mut brick = [f32::INFINITY; N_BRICK];
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

/// A triangle and a ball around it.
#[derive(Clone, Copy)]
struct Near {
    middle: Point3<f64>,
    radius: f64,
    corners: [Point3<f64>; 3],
}

impl Near {
    fn may_be_within(&self, p: &Point3<f64>, limit: f64) -> bool {
        let sure = limit + self.radius;
        (self.middle - p).norm_squared() < sure * sure
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

/// Which side of the surface a point is on.
struct Sides<'a> {
    low: Point3<f64>,
    high: Point3<f64>,
    holes: Holes,
    winding: &'a WindingTree,
}

impl Sides<'_> {
    /// What need not be spread: points beyond the surface's bounds are outside, those near holes are looked at each.
    fn known_at(&self, p: &Point3<f64>, far_from_holes: impl Fn() -> bool) -> Option<bool> {
        let within = (0..3).all(|k| p[k] >= self.low[k] && p[k] <= self.high[k]);
        if within && far_from_holes() {
            None
        } else {
            Some(within && self.winding.is_inside(p))
        }
    }

    fn is_inside(&self, p: &Point3<f64>) -> bool {
        self.winding.is_inside(p)
    }
}

/// Turns distances inside negative: known sides spread to neighbours that no surface can part, `ask` says where they begin.
fn spread(
    distances: &mut [f32],
    counts: [usize; 3],
    size: f64,
    mut known: Vec<Option<bool>>,
    ask: impl Fn(usize) -> bool,
) {
    let mut stack: Vec<usize> = (0..distances.len()).filter(|&i| known[i].is_some()).collect();
    let mut next = 0;
    loop {
        while let Some(i) = stack.pop() {
            let mut stride = 1;
            for n in counts {
                let at = i / stride % n;
                let before = (at > 0).then(|| i - stride);
                let after = (at + 1 < n).then(|| i + stride);
                for j in before.into_iter().chain(after) {
                    let apart = f64::from(distances[i]) + f64::from(distances[j]);
                    if known[j].is_none() && apart > size * (1.0 + 1e-6) {
                        known[j] = known[i];
                        stack.push(j);
                    }
                }
                stride *= n;
            }
        }
        let Some(i) = (next..known.len()).find(|&i| known[i].is_none()) else {
            break;
        };
        known[i] = Some(ask(i));
        stack.push(i);
        next = i + 1;
    }
    for (distance, inside) in distances.iter_mut().zip(known) {
        if inside == Some(true) {
            *distance = -*distance;
        }
    }
}

/// Where a brick's node is, in spacings from its first.
fn brick_place(i: usize) -> Vector3<f64> {
    Vector3::new(i % N_ACROSS, i / N_ACROSS % N_ACROSS, i / (N_ACROSS * N_ACROSS)).map(|i| i as f64)
}
