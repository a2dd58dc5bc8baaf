//! Turning a box downhill until no small turn makes it smaller.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::body::Body;
use super::canonical::Candidate;
use super::linear_program::{Piece, least_sum_of_maxima};

/// Corners of one side that a step looks at; with more of them within reach the step turns out shorter.
const MAX_PIECES: usize = 24;

/// Steps after which a descent ends.
const MAX_STEPS: usize = 60;

/// Turns shorter than this (rad) are rounding.
const LEAST_TURN: f64 = 1e-12;

/// The box that `start` turns into when every step makes it smaller.
///
/// With axes a₁ a₂ a₃ and widths wₖ = maxᵢ pᵢ·aₖ − minᵢ pᵢ·aₖ, a small turn ω changes the logarithm of the volume by
///
/// ```text
/// Σₖ (maxᵢ pᵢ·(aₖ + ω × aₖ) − minᵢ pᵢ·(aₖ + ω × aₖ)) / wₖ − 3
/// ```
///
/// up to second order, where the true change is mostly the smaller one. Each step minimises this sum of six maxima
/// exactly within a cube of turns (a linear program), takes the turn where it helps and shrinks the cube where not.
/// Where three edges become flush with faces, as in most minima, the last steps converge like Newton's.
/// Turns are at most `reach` (rad) per axis at first. The descent ends when a step promises less than the share `stop`,
/// or after 60 steps.
pub(super) fn descend(body: &Body, start: &Matrix3<f64>, reach: f64, stop: f64) -> Candidate {
    let mut axes = *start;
    let mut extremes = [0; 6];
    let mut widths = body.widths(&axes, &mut extremes);
    let mut reach = reach;
    let mut pieces = Vec::with_capacity(6 * MAX_PIECES);
    for _ in 0..MAX_STEPS {
        gather(body, &axes, &extremes, &widths, reach, &mut pieces);
        let (turn, change) = least_sum_of_maxima(&pieces, reach);
        let promise = -change;
        if promise < stop || reach < LEAST_TURN {
            break;
        }
        let turned = turn_by(&turn) * axes;
        let mut new_extremes = extremes;
        let new_widths = body.widths(&turned, &mut new_extremes);
        let ratio = new_widths.component_div(&widths).product();
        let length = turn.amax();
        if ratio < 1.0 {
            if 1.0 - ratio < 0.25 * promise {
                reach = 0.25 * length;
            } else if length >= 0.99 * reach {
                reach = (2.0 * reach).min(0.3);
            }
            (axes, extremes, widths) = (turned, new_extremes, new_widths);
        } else {
            reach = 0.25 * length;
        }
    }
    Candidate {
        axes: orthonormal(&axes),
        size: widths.product(),
    }
}

/// The rotation by about |ω| about ω (exact to third order, which the next step takes up).
fn turn_by(turn: &Vector3<f64>) -> Matrix3<f64> {
    let half = turn / 2.0;
    UnitQuaternion::from_quaternion(Quaternion::new(1.0, half.x, half.y, half.z))
        .to_rotation_matrix()
        .into_inner()
}

fn orthonormal(axes: &Matrix3<f64>) -> Matrix3<f64> {
    let x: Vector3<f64> = axes.column(0).normalize();
    let z = x.cross(&axes.column(1)).normalize();
    Matrix3::from_columns(&[x, z.cross(&x), z])
}

/// The corners that can become the farthest of their side within `reach`, as functions of the turn.
fn gather(
    body: &Body,
    axes: &Matrix3<f64>,
    extremes: &[u32; 6],
    widths: &Vector3<f64>,
    reach: f64,
    pieces: &mut Vec<Piece>,
) {
    let outward = |side: usize| -> Vector3<f64> {
        let axis = axes.column(side / 2) / widths[side / 2];
        if side.is_multiple_of(2) { axis } else { -axis }
    };
    pieces.clear();
    // p · (ω × a) = ω · (a × p)
    pieces.extend((0..6).map(|side| Piece {
        side,
        value: 0.0,
        slope: outward(side).cross(&body.points[extremes[side] as usize]),
    }));
    for side in 0..6 {
        let axis = outward(side);
        let farthest = extremes[side];
        let top = body.points[farthest as usize];
        let top_slope = pieces[side].slope;
        let mut near = [farthest; MAX_PIECES];
        let mut n_near = 1;
        let mut next = 0;
        'full: while next < n_near {
            for &corner in body.neighbours(near[next]) {
                let offset = body.points[corner as usize] - top;
                let value = axis.dot(&offset);
                let slope = axis.cross(&offset);
                let is_within_reach = value + reach * slope.abs().sum() > 0.0;
                if is_within_reach && !near[..n_near].contains(&corner) {
                    if n_near == MAX_PIECES {
                        break 'full;
                    }
                    near[n_near] = corner;
                    n_near += 1;
                    pieces.push(Piece {
                        side,
                        value,
                        slope: top_slope + slope,
                    });
                }
            }
            next += 1;
        }
    }
}
