//! Signed distances to a surface on a grid: coarse everywhere around it, fine in a narrow band.
//!
//! ```text
//! ┌───────┬───────┬───────┐   Coarse nodes (●) every 4 h hold the distance anywhere near the object. A coarse cell that the
//! │       │ ┼┼┼┼┼ │       │   surface comes near has a brick of 5 × 5 × 5 fine nodes, h apart, which hold it up to
//! ●───────●───────●───────●   BAND + √3 h from the surface: a point within BAND lies between eight of them.
//! │ ┼┼┼┼┼ │ ┼┼┼┼┼ │ ┼┼┼┼┼ │
//! │~~~~~~~│~~~~~~~│~~~~~~~│   Between nodes distances are trilinear.
//! ```
//!
//! A grasp comes near a part of an object only: bricks are measured when they are first asked for. Their values do not
//! depend on who asks, or when.
//!
//! **Error.** A distance changes by at most the length of a step, so the mean of eight nodes' distances with trilinear
//! weights wᵢ is off by at most Σ wᵢ |x − xᵢ| ≤ √(Σ wᵢ |x − xᵢ|²) = h √(Σₖ tₖ (1 − tₖ)), tₖ the place in the cell along
//! each axis: nothing at a node, at most √3/2 h in a cell's middle.
//!
//! **Sign.** Where a surface has holes the sign jumps without a surface between. Coarse cells where it does, and their
//! neighbours, are marked as torn and give no estimate.

use std::sync::OnceLock;

use nalgebra::{Point3, Vector3};

use crate::sides::Sides;
use crate::triangle_tree::TriangleTree;

/// Fine cells along a coarse one.
pub(crate) const N_FINE: usize = 4;
/// Fine nodes along a brick.
pub(crate) const N_ACROSS: usize = N_FINE + 1;
/// Fine nodes of a brick.
pub(crate) const N_BRICK: usize = N_ACROSS * N_ACROSS * N_ACROSS;
/// The fine band reaches this many spacings to either side of the surface.
pub(crate) const BAND: f64 = 2.0;

/// Signed distances (m) at the nodes of a coarse grid and of fine bricks.
#[derive(Debug)]
pub(crate) struct DistanceGrid {
    pub(crate) tree: TriangleTree,
    pub(crate) sides: Sides,
    pub(crate) low: Point3<f64>,
    /// Of fine nodes, metres; coarse ones are [`N_FINE`] times as far apart.
    pub(crate) spacing: f64,
    /// Coarse cells along each axis.
    pub(crate) counts: [usize; 3],
    /// At coarse nodes, x fastest.
    pub(crate) coarse: Vec<f32>,
    /// For each coarse cell its [`Fine`]'s index plus 1; 0 without one. [`TORN`] is set where there is no estimate,
    /// [`DOUBTFUL`] where there may be none.
    pub(crate) cells: Vec<u32>,
    pub(crate) fine: Vec<Fine>,
}

/// What is known of a coarse cell near the surface; measured when it is first asked for.
#[derive(Debug, Default)]
pub(crate) struct Fine {
    /// `None` where no node lies in the band.
    brick: OnceLock<Option<Box<Brick>>>,
    /// Whether the sign jumps in this brick or one around it.
    torn: OnceLock<bool>,
}

/// Distances of a brick's nodes, x fastest; infinite beyond the band.
pub(crate) type Brick = [f32; N_BRICK];

/// Set in [`DistanceGrid::cells`] where the sign jumps nearby.
pub(crate) const TORN: u32 = 1 << 31;
/// Set where a look at the bricks around shows whether the sign jumps.
pub(crate) const DOUBTFUL: u32 = 1 << 30;
/// What rounding to f32 may cost, relative.
const ROUNDING: f64 = 6e-8;

/// Distances at the corners of the cell around a point (bit k of the index: upper along axis k), the point's place in it
/// (0 to 1 along each axis) and its size.
struct Cell {
    corners: [f64; 8],
    place: Vector3<f64>,
    size: f64,
}

impl Cell {
    /// How far the corners are from the point, metres.
    #[inline]
    fn ways(&self) -> [f64; 8] {
        let squares: [[f64; 2]; 3] = std::array::from_fn(|k| {
            let t = self.place[k];
            [t * t, (1.0 - t) * (1.0 - t)]
        });
        std::array::from_fn(|i| {
            (squares[0][i & 1] + squares[1][i >> 1 & 1] + squares[2][i >> 2]).sqrt() * self.size
        })
    }

    /// The side of the point, from the first corner that is nearer to it than to any surface.
    fn side(&self) -> Option<bool> {
        let ways = self.ways();
        (0..8).find_map(|i| {
            (self.corners[i].abs() * (1.0 - ROUNDING) > ways[i]).then_some(self.corners[i] < 0.0)
        })
    }
}

impl DistanceGrid {
    /// Spacing of the fine nodes, metres.
    pub(crate) fn spacing(&self) -> f64 {
        self.spacing
    }

    /// Bytes of the distances, with the bricks that were measured so far.
    pub(crate) fn n_bytes(&self) -> usize {
        let measured = self
            .fine
            .iter()
            .filter(|f| matches!(f.brick.get(), Some(Some(_))));
        (self.coarse.len() + self.cells.len()) * size_of::<f32>()
            + size_of_val(self.fine.as_slice())
            + measured.count() * size_of::<Brick>()
    }

    fn fine(&self, cell: usize) -> Option<&Fine> {
        let fine_idx = (self.cells[cell] & !(TORN | DOUBTFUL)).checked_sub(1)?;
        Some(&self.fine[fine_idx as usize])
    }

    /// The brick of a coarse cell; `None` without a node in the band.
    #[inline]
    pub(crate) fn brick(&self, cell: usize) -> Option<&Brick> {
        let fine = self.fine(cell)?;
        fine.brick.get_or_init(|| self.measured_brick(cell)).as_deref()
    }

    /// Whether the sign jumps in or near a coarse cell, so that there is no estimate.
    #[inline]
    fn is_torn(&self, cell: usize) -> bool {
        let flags = self.cells[cell];
        let look = || {
            self.fine(cell)
                .is_some_and(|f| *f.torn.get_or_init(|| self.is_torn_around(cell)))
        };
        flags & TORN != 0 || flags & DOUBTFUL != 0 && look()
    }

    /// The trilinear signed distance and a bound of its error; `None` outside the grid and where the sign jumps.
    #[inline]
    pub(crate) fn estimate(&self, p: &Point3<f64>) -> Option<(f64, f64)> {
        let (coarse, idx, place) = self.locate(p)?;
        if self.is_torn(idx) {
            return None;
        }
        let Cell {
            corners: d,
            place: t,
            size,
        } = self.cell(coarse, idx, place);
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let low = mix(mix(d[0], d[1], t.x), mix(d[2], d[3], t.x), t.y);
        let high = mix(mix(d[4], d[5], t.x), mix(d[6], d[7], t.x), t.y);
        let distance = mix(low, high, t.z);
        let spread = t.component_mul(&(Vector3::repeat(1.0) - t)).sum();
        let error = size * spread.max(0.0).sqrt() * (1.0 + 1e-12) + ROUNDING * (distance.abs() + size);
        Some((distance, error))
    }

    /// A lower bound of the distance from `p` to the surface, on either side; 0 where nothing better is known.
    pub(crate) fn lower_bound(&self, p: &Point3<f64>) -> f64 {
        let Some((coarse, idx, place)) = self.locate(p) else {
            // The surface lies within its bounds.
            let nearest = p.coords.sup(&self.sides.low.coords).inf(&self.sides.high.coords);
            return (p.coords - nearest).norm();
        };
        let cell = self.cell(coarse, idx, place);
        let corners = cell.corners.iter().zip(cell.ways());
        let bounds = corners.map(|(d, way)| d.abs() * (1.0 - ROUNDING) - way);
        bounds.fold(0.0, f64::max)
    }

    /// Which side of the surface a point is on, where a node is nearer to it than to any surface.
    pub(crate) fn side(&self, p: &Point3<f64>) -> Option<bool> {
        let (coarse, idx, place) = self.locate(p)?;
        if self.is_torn(idx) {
            return None;
        }
        // Most points need no brick.
        self.coarse_cell(coarse, place)
            .side()
            .or_else(|| self.cell(coarse, idx, place).side())
    }

    /// The coarse cell of a point, its index in `cells`, and the point's place in it.
    #[inline]
    fn locate(&self, p: &Point3<f64>) -> Option<([usize; 3], usize, Vector3<f64>)> {
        let at = (p - self.low) / (self.spacing * N_FINE as f64);
        // Written so that NaN is outside.
        if !(0..3).all(|k| at[k] >= 0.0 && at[k] < self.counts[k] as f64) {
            return None;
        }
        let cell: [usize; 3] = at.map(|x| x as usize).into();
        let idx = (cell[2] * self.counts[1] + cell[1]) * self.counts[0] + cell[0];
        Some((cell, idx, at - Vector3::from(cell.map(|c| c as f64))))
    }

    /// The smallest cell around a point whose corners' distances are known.
    #[inline]
    fn cell(&self, coarse: [usize; 3], idx: usize, place: Vector3<f64>) -> Cell {
        if let Some(brick) = self.brick(idx) {
            let at = place * N_FINE as f64;
            let cell: [usize; 3] = at.map(|x| (x as usize).min(N_FINE - 1)).into();
            let first = (cell[2] * N_ACROSS + cell[1]) * N_ACROSS + cell[0];
            let corners = corners(brick, first, N_ACROSS, N_ACROSS * N_ACROSS);
            if corners.iter().all(|d| d.is_finite()) {
                let place = at - Vector3::from(cell.map(|c| c as f64));
                return Cell {
                    corners,
                    place,
                    size: self.spacing,
                };
            }
        }
        self.coarse_cell(coarse, place)
    }

    #[inline]
    fn coarse_cell(&self, coarse: [usize; 3], place: Vector3<f64>) -> Cell {
        let (row, slice) = (self.counts[0] + 1, (self.counts[0] + 1) * (self.counts[1] + 1));
        let first = coarse[2] * slice + coarse[1] * row + coarse[0];
        Cell {
            corners: corners(&self.coarse, first, row, slice),
            place,
            size: self.spacing * N_FINE as f64,
        }
    }
}

/// The values at a cell's corners.
#[inline]
pub(crate) fn corners(values: &[f32], first: usize, row: usize, slice: usize) -> [f64; 8] {
    let pair = |at: usize| [f64::from(values[at]), f64::from(values[at + 1])];
    let ([a, b], [c, d]) = (pair(first), pair(first + row));
    let ([e, f], [g, h]) = (pair(first + slice), pair(first + slice + row));
    [a, b, c, d, e, f, g, h]
}
