//! Which of several equally small boxes is meant.

use nalgebra::{Matrix3, Vector3};

/// Boxes whose volumes differ by less than this share count as equal.
const EQUAL: f64 = 5e-7;

/// Axes this close (cosine) belong to one box, of which the smallest variant is meant.
const SAME_BOX: f64 = 1.0 - 1e-4;

/// An axis whose other two coordinates are below this is along the frame's axis.
const ALONG: f64 = 1e-15;

/// Axes of a box (orthonormal columns) and how large it is: its volume, or for flat points its area.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub(super) axes: Matrix3<f64>,
    pub(super) size: f64,
}

/// The axes that the rules of [`super::minimum_volume_box`] ask for. `candidates` must not be empty.
pub(super) fn choose(candidates: &[Candidate]) -> Matrix3<f64> {
    let least = candidates.iter().map(|c| c.size).fold(f64::INFINITY, f64::min);
    let equal = candidates.iter().filter(|c| c.size <= least * (1.0 + EQUAL));
    let is_along = |axis: Vector3<f64>| (0..3).filter(|&k| axis[k].abs() <= ALONG).count() == 2;
    let n_along = |c: &Candidate| (0..3).filter(|&k| is_along(c.axes.column(k).into())).count();
    for wanted in [3, 1, 0] {
        if let Some(axes) = least_turned(equal.clone().filter(|c| n_along(c) >= wanted)) {
            return without_rounding(&axes);
        }
    }
    Matrix3::identity()
}

/// Axes along the frame's up to rounding are exactly along it.
fn without_rounding(axes: &Matrix3<f64>) -> Matrix3<f64> {
    axes.map(|x| match x.abs() {
        size if size <= ALONG => 0.0,
        size if 1.0 - size <= ALONG => x.signum(),
        _ => x,
    })
}

/// Of some boxes the one turned least from the frame; the smallest of those that differ from it only by rounding.
fn least_turned<'a>(candidates: impl Iterator<Item = &'a Candidate>) -> Option<Matrix3<f64>> {
    let framed = candidates.map(|c| (nearest_to_frame(&c.axes), c.size));
    let framed: Vec<((Matrix3<f64>, f64), f64)> = framed.collect();
    let ((nearest, _), _) = framed.iter().copied().reduce(|best, other| {
        // The first of equals.
        if other.0.1 > best.0.1 + 1e-9 { other } else { best }
    })?;
    let is_same = |axes: &Matrix3<f64>| (0..3).all(|k| axes.column(k).dot(&nearest.column(k)) > SAME_BOX);
    framed
        .iter()
        .filter(|((axes, _), _)| is_same(axes))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|((axes, _), _)| *axes)
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
