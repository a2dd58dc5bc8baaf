//! Volumes of boxes beside many parallel planes at once.

use nalgebra::{Point3, Vector3};

use crate::decompose::region::{Plane, Region};

/// Boxes tried about each of three axes, turned by a share of a right angle each.
const N_ANGLES: usize = 8;
const N_DIRECTIONS: usize = 6 * N_ANGLES;

/// How far points reach in each of the sampled directions.
type Reach = [f32; N_DIRECTIONS];

/// A region's points in sampled directions.
///
/// About each of three axes there are eight boxes. The smallest of these 24 around the points on one side of a plane is
/// found without a hull, and for all parallel planes in one pass: it tells which planes are worth more care. Single
/// precision is enough for that.
pub(super) struct Widths {
    points: Vec<Point3<f64>>,
    /// For axis k the sides u of its boxes from 16 k on, and then the sides v.
    directions: [Vector3<f64>; N_DIRECTIONS],
    along: Vec<Reach>,
    edges: Vec<[u32; 2]>,
    min_extent: f32,
}

/// The smallest sampled volumes below and above each of some places; infinite where there is nothing.
pub(super) struct Sides {
    pub(super) below: Vec<f64>,
    pub(super) above: Vec<f64>,
}

impl Widths {
    pub(super) fn new(region: &Region, axes: &[Vector3<f64>; 3], min_extent: f64) -> Self {
        let directions: [Vector3<f64>; N_DIRECTIONS] = std::array::from_fn(|i| {
            let (k, side, step) = (i / (2 * N_ANGLES), i / N_ANGLES % 2, i % N_ANGLES);
            let angle = (step as f64 / N_ANGLES as f64 + side as f64) * std::f64::consts::FRAC_PI_2;
            axes[(k + 1) % 3] * angle.cos() + axes[(k + 2) % 3] * angle.sin()
        });
        let points = region.points();
        let along = points
            .iter()
            .map(|p| directions.map(|d| d.dot(&p.coords) as f32))
            .collect();
        let mut edges: Vec<[u32; 2]> = region
            .triangles()
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .map(|[p, q]| [p.min(q), p.max(q)])
            .collect();
        edges.sort_unstable();
        edges.dedup();
        Self {
            edges,
            points,
            directions,
            along,
            min_extent: min_extent as f32,
        }
    }

    /// The normals of planes to sweep: the axes, and between every two of them.
    pub(super) fn normals(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        const HALFWAY: usize = N_ANGLES / 2;
        (0..3).flat_map(|k| [0, HALFWAY, N_ANGLES + HALFWAY].map(|i| self.directions[2 * N_ANGLES * k + i]))
    }

    /// Lowest and highest coordinate along a normal.
    pub(super) fn span(&self, normal: &Vector3<f64>) -> (f64, f64) {
        let heights = self.points.iter().map(|p| normal.dot(&p.coords));
        heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| {
            (low.min(h), high.max(h))
        })
    }

    /// The place of the plane with the least volume on both sides, among `n` places from `low` to `high`, looked for
    /// again between its neighbours `n_rounds` times; and that volume.
    pub(super) fn best_place(
        &self,
        normal: &Vector3<f64>,
        (mut low, mut high): (f64, f64),
        n: usize,
        n_rounds: usize,
    ) -> (f64, f64) {
        let mut best = (low, f64::INFINITY);
        for _ in 0..n_rounds {
            let places = spread(low, high, n);
            let sides = self.sides(normal, &places);
            for ((&place, below), above) in places.iter().zip(&sides.below).zip(&sides.above) {
                if below + above < best.1 {
                    best = (place, below + above);
                }
            }
            let step = (high - low) / (n.max(2) - 1) as f64;
            (low, high) = ((best.0 - step).max(low), (best.0 + step).min(high));
        }
        best
    }

    /// The volume on both sides of a plane.
    pub(super) fn volume_beside(&self, plane: &Plane) -> f64 {
        let sides = self.sides(&plane.normal, &[plane.normal.dot(&plane.origin.coords)]);
        sides.below[0] + sides.above[0]
    }

    /// The smallest sampled volumes on both sides of planes at some places along a normal, in rising order.
    pub(super) fn sides(&self, normal: &Vector3<f64>, places: &[f64]) -> Sides {
        let heights: Vec<f64> = self.points.iter().map(|p| normal.dot(&p.coords)).collect();
        // Between places, and where edges cross them.
        let mut slabs = vec![Bounds::EMPTY; places.len() + 1];
        let mut rims = vec![Bounds::EMPTY; places.len()];
        let slab_of = |height: f64| places.partition_point(|&place| place < height);
        let slab: Vec<usize> = heights.iter().map(|&h| slab_of(h)).collect();
        for (reach, &slab) in self.along.iter().zip(&slab) {
            slabs[slab].add(reach);
        }
        for &[p, q] in &self.edges {
            let (p, q) = (p as usize, q as usize);
            for i in slab[p].min(slab[q])..slab[p].max(slab[q]) {
                let t = ((places[i] - heights[p]) / (heights[q] - heights[p])) as f32;
                rims[i].add_between(&self.along[p], &self.along[q], t);
            }
        }
        let mut sides = Sides {
            below: vec![f64::INFINITY; places.len()],
            above: vec![f64::INFINITY; places.len()],
        };
        let mut below = Bounds::EMPTY;
        for (i, volume) in sides.below.iter_mut().enumerate() {
            below.join(&slabs[i]);
            *volume = below.joined(&rims[i]).volume(self.min_extent);
        }
        let mut above = Bounds::EMPTY;
        for (i, volume) in sides.above.iter_mut().enumerate().rev() {
            above.join(&slabs[i + 1]);
            *volume = above.joined(&rims[i]).volume(self.min_extent);
        }
        sides
    }
}

/// `n` numbers (at least two) from `low` to `high`.
pub(super) fn spread(low: f64, high: f64, n: usize) -> Vec<f64> {
    let n = n.max(2) - 1;
    (0..=n)
        .map(|i| low + (high - low) * i as f64 / n as f64)
        .collect()
}

/// Least and greatest coordinate in each direction.
#[derive(Clone, Copy)]
struct Bounds {
    low: Reach,
    high: Reach,
}

impl Bounds {
    const EMPTY: Self = Self {
        low: [f32::INFINITY; N_DIRECTIONS],
        high: [f32::NEG_INFINITY; N_DIRECTIONS],
    };

    fn add(&mut self, reach: &Reach) {
        for ((low, high), x) in self.low.iter_mut().zip(&mut self.high).zip(reach) {
            *low = if x < low { *x } else { *low };
            *high = if x > high { *x } else { *high };
        }
    }

    fn add_between(&mut self, from: &Reach, to: &Reach, t: f32) {
        let mut reach = *from;
        for (x, y) in reach.iter_mut().zip(to) {
            *x += (y - *x) * t;
        }
        self.add(&reach);
    }

    fn join(&mut self, other: &Self) {
        for (low, x) in self.low.iter_mut().zip(other.low) {
            *low = low.min(x);
        }
        for (high, x) in self.high.iter_mut().zip(other.high) {
            *high = high.max(x);
        }
    }

    fn joined(&self, other: &Self) -> Self {
        let mut both = *self;
        both.join(other);
        both
    }

    /// The smallest of the sampled boxes.
    fn volume(&self, min_extent: f32) -> f64 {
        if self.low[0] > self.high[0] {
            return f64::INFINITY;
        }
        let width = |i: usize| (self.high[i] - self.low[i]).max(min_extent);
        let mut least = f32::INFINITY;
        for k in 0..3 {
            let height = width((k + 2) % 3 * 2 * N_ANGLES);
            let first = 2 * N_ANGLES * k;
            for i in first..first + N_ANGLES {
                least = least.min(height * width(i) * width(i + N_ANGLES));
            }
        }
        f64::from(least)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::OrientedBox;

    #[test]
    fn the_volumes_beside_a_cut_of_a_turned_cuboid_are_those_of_its_parts() {
        let turn = nalgebra::Isometry3::rotation(Vector3::new(0.3, -0.5, 1.0));
        let region = Region::of_mesh(
            &OrientedBox::centered([0.5, 0.25, 1.0])
                .surface()
                .transformed(&turn),
        );
        let axes = [0, 1, 2].map(|k| turn * Vector3::ith(k, 1.0));
        let widths = Widths::new(&region, &axes, 1e-3);
        let sides = widths.sides(&axes[2], &[-0.6, -0.25, 0.0, 0.6]);
        assert!(sides.below[0].is_infinite() && sides.above[3].is_infinite());
        for (i, below, above) in [(1, 0.25, 0.75), (2, 0.5, 0.5)] {
            assert!((sides.below[i] / (0.125 * below) - 1.0).abs() < 1e-5);
            assert!((sides.above[i] / (0.125 * above) - 1.0).abs() < 1e-5);
        }
        let (low, high) = widths.span(&axes[2]);
        assert!((low + 0.5).abs() < 1e-12 && (high - 0.5).abs() < 1e-12);
        // Half of a cube that was turned by 45° about one of its axes.
        let region = Region::of_mesh(&OrientedBox::centered([1.0; 3]).surface());
        let aslant = [
            Vector3::new(1.0, 1.0, 0.0),
            Vector3::new(-1.0, 1.0, 0.0),
            Vector3::new(0.0, 0.0, 1.0),
        ];
        let widths = Widths::new(&region, &aslant.map(|a| a.normalize()), 1e-3);
        let plane = Plane {
            normal: Vector3::x(),
            origin: Point3::new(0.1, 0.0, 0.0),
        };
        assert!((widths.volume_beside(&plane) - 1.0).abs() < 1e-5);
    }
}
