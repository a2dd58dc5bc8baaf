//! Hyperplanes in six dimensions.

use crate::polytope::sub;
use crate::wrench_space::dot;

/// The points x with `normal` · x = `offset`; the normal has unit length and points out of the polytope.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hyperplane {
    pub(crate) normal: [f64; 6],
    pub(crate) offset: f64,
}

impl Hyperplane {
    /// Signed height of a point over the plane.
    pub(crate) fn height(&self, point: &[f64; 6]) -> f64 {
        dot(&self.normal, point) - self.offset
    }

    /// The plane of the pencil of `seen` and `unseen` that holds a point at heights `h_seen` > 0 ≥ `h_unseen` over
    /// them, and the length that its normal had before it was normalised: 1 where the two planes are one, 0 where they
    /// are opposite.
    pub(crate) fn pencil(seen: &Self, h_seen: f64, unseen: &Self, h_unseen: f64) -> (Self, f64) {
        // A height inside the tolerance may be a little above 0; the point then counts as on the unseen plane.
        let below = (-h_unseen).max(0.0);
        let (a, b) = (h_seen / (h_seen + below), below / (h_seen + below));
        let normal: [f64; 6] = std::array::from_fn(|k| a * unseen.normal[k] + b * seen.normal[k]);
        let length = dot(&normal, &normal).sqrt();
        if length == 0.0 {
            return (*unseen, 0.0);
        }
        let offset = (a * unseen.offset + b * seen.offset) / length;
        (
            Self {
                normal: normal.map(|c| c / length),
                offset,
            },
            length,
        )
    }
}

/// The plane through six points, pointing away from `inside`; none where they are (nearly) dependent.
///
/// Eliminates the five edges from the first point with complete pivoting; the normal is what is left.
pub(crate) fn through_points(points: &[[f64; 6]; 6], inside: &[f64; 6]) -> Option<Hyperplane> {
    let mut rows: [[f64; 6]; 5] = std::array::from_fn(|i| sub(&points[i + 1], &points[0]));
    let mut columns = [0, 1, 2, 3, 4, 5];
    let mut first_pivot = 0.0;
    for step in 0..5 {
        let (mut best, mut row, mut column) = (0.0, step, step);
        for r in step..5 {
            for c in step..6 {
                let size = rows[r][c].abs();
                if size > best {
                    (best, row, column) = (size, r, c);
                }
            }
        }
        if step == 0 {
            first_pivot = best;
        }
        // Below this, rounding in the points decides where the normal goes.
        if best <= 1e-9 * first_pivot || best == 0.0 {
            return None;
        }
        rows.swap(step, row);
        if column != step {
            for r in &mut rows {
                r.swap(step, column);
            }
            columns.swap(step, column);
        }
        for r in step + 1..5 {
            let factor = rows[r][step] / rows[step][step];
            for c in step + 1..6 {
                rows[r][c] -= factor * rows[step][c];
            }
        }
    }
    // Back substitution with the last unknown 1.
    let mut solution = [0.0; 6];
    solution[5] = 1.0;
    for r in (0..5).rev() {
        let known: f64 = (r + 1..6).map(|c| rows[r][c] * solution[c]).sum();
        solution[r] = -known / rows[r][r];
    }
    let length = dot(&solution, &solution).sqrt();
    let mut normal = [0.0; 6];
    for k in 0..6 {
        normal[columns[k]] = solution[k] / length;
    }
    let mut offset = points.iter().map(|p| dot(&normal, p)).sum::<f64>() / 6.0;
    if dot(&normal, inside) > offset {
        normal = normal.map(|c| -c);
        offset = -offset;
    }
    Some(Hyperplane { normal, offset })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plane_through_the_unit_points_leans_equally() {
        let points: [[f64; 6]; 6] =
            std::array::from_fn(|i| std::array::from_fn(|k| if i == k { 1.0 } else { 0.0 }));
        let plane = through_points(&points, &[0.0; 6]).unwrap();
        let expected = 1.0 / 6.0_f64.sqrt();
        assert!(plane.normal.iter().all(|c| (c - expected).abs() < 1e-15));
        assert!((plane.offset - expected).abs() < 1e-15);
    }

    #[test]
    fn the_pencil_holds_the_point() {
        let seen = Hyperplane {
            normal: [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            offset: 1.0,
        };
        let unseen = Hyperplane {
            normal: [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
            offset: 1.0,
        };
        let point = [3.0, 0.5, 0.0, 0.0, 0.0, 0.0];
        let (plane, _) = Hyperplane::pencil(&seen, seen.height(&point), &unseen, unseen.height(&point));
        assert!(plane.height(&point).abs() < 1e-15);
        assert!(plane.height(&[1.0, 1.0, 7.0, 0.0, 0.0, 0.0]).abs() < 1e-15);
    }
}
