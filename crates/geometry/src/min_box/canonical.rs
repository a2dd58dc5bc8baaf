//! Which of several equally small boxes is meant.

use nalgebra::{Matrix3, Vector3};

/// Boxes whose volumes differ by less than this share count as equal.
const EQUAL: f64 = 5e-7;

/// A box along the frame may be larger than the smallest by this share.
///
/// Upright boxes of a body of revolution differ from the smallest box of its polygons by less than this from about
/// 50 sides on where that box is tilted. It is too little to matter as a length: 0.2 mm on a side of a 0.4 m object.
const FRAME_PREFERENCE: f64 = 5e-4;

/// |axis · e| above this counts as along the frame's axis.
const ALONG: f64 = 1.0 - 1e-15;

/// Axes of a box (orthonormal columns) and how large it is: its volume, or for flat points its area.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub(super) axes: Matrix3<f64>,
    pub(super) size: f64,
}

/// The axes that the rules of [`super::minimum_volume_box`] ask for. `candidates` must not be empty.
pub(super) fn choose(candidates: &[Candidate]) -> Matrix3<f64> {
    let least = candidates.iter().map(|c| c.size).fold(f64::INFINITY, f64::min);
    let preferred = candidates
        .iter()
        .filter(|c| c.size <= least * (1.0 + FRAME_PREFERENCE));
    let n_along = |c: &Candidate| (0..3).filter(|&k| c.axes.column(k).amax() >= ALONG).count();
    for wanted in [3, 1] {
        let along = preferred.clone().filter(|c| n_along(c) >= wanted);
        let least = along.clone().map(|c| c.size).fold(f64::INFINITY, f64::min);
        if let Some(axes) = least_turned(along.filter(|c| c.size <= least * (1.0 + EQUAL))) {
            return axes;
        }
    }
    least_turned(candidates.iter().filter(|c| c.size <= least * (1.0 + EQUAL)))
        .unwrap_or_else(Matrix3::identity)
}

/// Of some boxes the one turned least from the frame; the first of equals.
fn least_turned<'a>(candidates: impl Iterator<Item = &'a Candidate>) -> Option<Matrix3<f64>> {
    let mut best: Option<(Matrix3<f64>, f64)> = None;
    for candidate in candidates {
        let (axes, trace) = nearest_to_frame(&candidate.axes);
        if best.is_none_or(|(_, most)| trace > most + 1e-9) {
            best = Some((axes, trace));
        }
    }
    best.map(|(axes, _)| axes)
}

/// The columns matched to x, y, z by the assignment with the largest Σ |axis · e| and with axis · e ≥ 0; and that sum.
///
/// The sum is the trace of the resulting matrix, 1 + 2 cos θ for the angle θ that it turns by. It always exceeds 1
/// (the six assignments' sums average at least 1 and are only all equal to 1 if one is 3), while improper orthogonal
/// matrices have traces of at most 1: the result is right-handed whatever the input was.
pub(super) fn nearest_to_frame(axes: &Matrix3<f64>) -> (Matrix3<f64>, f64) {
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let sum = |order: &[usize; 3]| (0..3).map(|k| axes[(k, order[k])].abs()).sum::<f64>();
    let mut best = (ORDERS[0], sum(&ORDERS[0]));
    for order in &ORDERS[1..] {
        if sum(order) > best.1 + 1e-9 {
            best = (*order, sum(order));
        }
    }
    let column = |k: usize| {
        let axis: Vector3<f64> = axes.column(best.0[k]).into();
        // Adding 0 turns −0 into 0.
        (if axis[k] < 0.0 { -axis } else { axis }).map(|x| x + 0.0)
    };
    (Matrix3::from_columns(&[column(0), column(1), column(2)]), best.1)
}
