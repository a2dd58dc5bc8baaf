//! Hyperplanes in D dimensions.

/// The points x with `normal` · x = `offset`; the normal has unit length and points out of the polytope.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hyperplane<const D: usize> {
    pub(crate) normal: [f64; D],
    pub(crate) offset: f64,
}

impl<const D: usize> Hyperplane<D> {
    /// Signed height of a point over the plane.
    #[inline]
    pub(crate) fn height(&self, point: &[f64; D]) -> f64 {
        dot(&self.normal, point) - self.offset
    }

    /// The plane of the pencil of `seen` and `unseen` that holds a point at heights `h_seen` > 0 ≥ `h_unseen` over
    /// them, and the length that its normal had before it was normalised: 1 where the two planes are one, 0 where they
    /// are opposite.
    #[inline]
    pub(crate) fn pencil(seen: &Self, h_seen: f64, unseen: &Self, h_unseen: f64) -> (Self, f64) {
        // A height inside the tolerance may be a little above 0; the point then counts as on the unseen plane.
        let below = (-h_unseen).max(0.0);
        let sum: [f64; D] = std::array::from_fn(|k| h_seen * unseen.normal[k] + below * seen.normal[k]);
        let length = dot(&sum, &sum).sqrt();
        if length == 0.0 {
            return (*unseen, 0.0);
        }
        let inverse = 1.0 / length;
        let plane = Self {
            normal: sum.map(|c| c * inverse),
            offset: (h_seen * unseen.offset + below * seen.offset) * inverse,
        };
        (plane, length / (h_seen + below))
    }
}

/// The plane through D points, pointing away from `inside`; none where they are (nearly) dependent.
///
/// Eliminates the D − 1 edges from the first point with complete pivoting; the normal is what is left.
pub(crate) fn through_points<const D: usize>(
    points: &[[f64; D]; D],
    inside: &[f64; D],
) -> Option<Hyperplane<D>> {
    let mut rows: [[f64; D]; D] =
        std::array::from_fn(|i| sub(&points[if i + 1 < D { i + 1 } else { 0 }], &points[0]));
    let mut columns: [usize; D] = std::array::from_fn(|k| k);
    let mut first_pivot = 0.0;
    for step in 0..D - 1 {
        let (mut best, mut row, mut column) = (0.0, step, step);
        for r in step..D - 1 {
            for c in step..D {
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
        for r in step + 1..D - 1 {
            let factor = rows[r][step] / rows[step][step];
            for c in step + 1..D {
                rows[r][c] -= factor * rows[step][c];
            }
        }
    }
    // Back substitution with the last unknown 1.
    let mut solution = [0.0; D];
    solution[D - 1] = 1.0;
    for r in (0..D - 1).rev() {
        let known: f64 = (r + 1..D).map(|c| rows[r][c] * solution[c]).sum();
        solution[r] = -known / rows[r][r];
    }
    let length = dot(&solution, &solution).sqrt();
    let mut normal = [0.0; D];
    for k in 0..D {
        normal[columns[k]] = solution[k] / length;
    }
    let mut offset = points.iter().map(|p| dot(&normal, p)).sum::<f64>() / D as f64;
    if dot(&normal, inside) > offset {
        normal = normal.map(|c| -c);
        offset = -offset;
    }
    Some(Hyperplane { normal, offset })
}

/// Determinant of D rows, by elimination with partial pivoting.
pub(crate) fn determinant<const D: usize>(mut rows: [[f64; D]; D]) -> f64 {
    let mut product = 1.0;
    for step in 0..D {
        let row = (step..D)
            .max_by(|&a, &b| rows[a][step].abs().total_cmp(&rows[b][step].abs()))
            .unwrap_or(step);
        if row != step {
            rows.swap(row, step);
            product = -product;
        }
        let pivot = rows[step][step];
        product *= pivot;
        if pivot == 0.0 {
            return 0.0;
        }
        for r in step + 1..D {
            let factor = rows[r][step] / pivot;
            for c in step + 1..D {
                rows[r][c] -= factor * rows[step][c];
            }
        }
    }
    product
}

/// a · b. Even and odd terms are summed apart, two to a register.
#[inline]
pub(crate) fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    let mut sums = [0.0; 2];
    for k in 0..D / 2 {
        sums[0] += a[2 * k] * b[2 * k];
        sums[1] += a[2 * k + 1] * b[2 * k + 1];
    }
    if D % 2 == 1 {
        sums[0] += a[D - 1] * b[D - 1];
    }
    sums[0] + sums[1]
}

pub(crate) fn sub<const D: usize>(a: &[f64; D], b: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|k| a[k] - b[k])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plane_through_the_unit_points_leans_equally() {
        fn check<const D: usize>() {
            let points: [[f64; D]; D] =
                std::array::from_fn(|i| std::array::from_fn(|k| if i == k { 1.0 } else { 0.0 }));
            let plane = through_points(&points, &[0.0; D]).unwrap();
            let expected = 1.0 / (D as f64).sqrt();
            assert!(plane.normal.iter().all(|c| (c - expected).abs() < 1e-15));
            assert!((plane.offset - expected).abs() < 1e-15);
            assert_eq!(determinant(points), 1.0);
        }
        check::<2>();
        check::<3>();
        check::<5>();
        check::<6>();
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

    #[test]
    fn determinants_follow_the_rows_order() {
        assert_eq!(determinant([[0.0, 2.0], [3.0, 0.0]]), -6.0);
        assert_eq!(determinant([[1.0, 2.0], [2.0, 4.0]]), 0.0);
    }
}
