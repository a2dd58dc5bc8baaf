//! Cutting tetrahedra by planes.
//!
//! A tetrahedron is at most three tetrahedra on either side of a plane, so cutting by any number of planes needs no
//! face lists, no caps and no ordering. Pieces of no volume are harmless, but are dropped to save work.
//!
//! ```text
//! one corner a in front:    front  a ab ac ad            behind  prism (ab ac ad)(b c d)
//! two corners a, b:         front  prism (a ac ad)(b bc bd)   behind  prism (c ac bc)(d ad bd)
//! three corners:            one corner, seen from behind
//! ```

use nalgebra::Vector3;

/// Four corners, relative to a point nearby.
pub(crate) type Simplex = [Vector3<f64>; 4];

/// The half-space `normal · x ≤ offset`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HalfSpace {
    pub normal: Vector3<f64>,
    pub offset: f64,
}

impl HalfSpace {
    /// How far inside a point is, in units of the normal's length. What rounding could have made counts as 0, so that
    /// faces in one plane leave no slivers behind, which further cuts would multiply.
    #[inline]
    fn depth(&self, p: &Vector3<f64>) -> f64 {
        let [x, y, z] = [self.normal.x * p.x, self.normal.y * p.y, self.normal.z * p.z];
        let depth = self.offset - (x + y + z);
        let rounding = 4.0 * f64::EPSILON * (self.offset.abs() + (x.abs() + y.abs() + z.abs()));
        if depth.abs() <= rounding { 0.0 } else { depth }
    }

    #[inline]
    fn depths(&self, [a, b, c, d]: &Simplex) -> [f64; 4] {
        [self.depth(a), self.depth(b), self.depth(c), self.depth(d)]
    }
}

/// Volume, never negative.
pub(crate) fn volume(simplex: &Simplex) -> f64 {
    let [a, b, c, d] = simplex;
    (b - a).cross(&(c - a)).dot(&(d - a)).abs() / 6.0
}

/// Adds what lies inside the half-space to `inside` and the rest to `outside`.
pub(crate) fn split(
    simplex: &Simplex,
    plane: &HalfSpace,
    inside: &mut Vec<Simplex>,
    outside: &mut Vec<Simplex>,
) {
    let depths = plane.depths(simplex);
    if depths.iter().all(|&s| s >= 0.0) {
        inside.push(*simplex);
        return;
    }
    // Corners inside first; a corner on the plane counts as inside.
    let mut order = [0, 1, 2, 3];
    order.sort_by_key(|&i| depths[i] < 0.0);
    let n_inside = depths.iter().filter(|&&s| s >= 0.0).count();
    let p = order.map(|i| simplex[i]);
    let s = order.map(|i| depths[i]);
    // Where the edge from corner i (inside) to corner j (outside) meets the plane.
    let cut = |i: usize, j: usize| p[i] + (p[j] - p[i]) * (s[i] / (s[i] - s[j]));
    match n_inside {
        0 => push(outside, *simplex),
        1 => {
            let [ab, ac, ad] = [cut(0, 1), cut(0, 2), cut(0, 3)];
            push(inside, [p[0], ab, ac, ad]);
            push_prism(outside, [ab, ac, ad], [p[1], p[2], p[3]]);
        }
        2 => {
            let [ac, ad, bc, bd] = [cut(0, 2), cut(0, 3), cut(1, 2), cut(1, 3)];
            push_prism(inside, [p[0], ac, ad], [p[1], bc, bd]);
            push_prism(outside, [p[2], ac, bc], [p[3], ad, bd]);
        }
        _ => {
            let [ad, bd, cd] = [cut(0, 3), cut(1, 3), cut(2, 3)];
            push_prism(inside, [ad, bd, cd], [p[0], p[1], p[2]]);
            push(outside, [p[3], ad, bd, cd]);
        }
    }
}

/// Whether no part of the simplex lies strictly inside the half-space.
pub(crate) fn is_outside(simplex: &Simplex, plane: &HalfSpace) -> bool {
    simplex.iter().all(|p| plane.depth(p) <= 0.0)
}

/// The box `|x| ≤ half` as six simplices around one diagonal.
pub(crate) fn box_simplices(half: &Vector3<f64>) -> [Simplex; 6] {
    let corner = |bits: usize| Vector3::from_fn(|k, _| if bits >> k & 1 == 1 { half[k] } else { -half[k] });
    [[1, 2], [1, 4], [2, 1], [2, 4], [4, 1], [4, 2]]
        .map(|[first, second]| [corner(0), corner(first), corner(first + second), corner(7)])
}

/// Three simplices fill the prism whose edges join `p[i]` and `q[i]`.
fn push_prism(pieces: &mut Vec<Simplex>, p: [Vector3<f64>; 3], q: [Vector3<f64>; 3]) {
    push(pieces, [p[0], p[1], p[2], q[0]]);
    push(pieces, [p[1], p[2], q[0], q[1]]);
    push(pieces, [p[2], q[0], q[1], q[2]]);
}

fn push(pieces: &mut Vec<Simplex>, simplex: Simplex) {
    if volume(&simplex) > 0.0 {
        pieces.push(simplex);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Share of a simplex in front of a plane, from its corners' depths alone: Σ_{s_i>0} s_i³ / Π_{j≠i} (s_i − s_j).
    /// Exact where no two depths are equal (divided differences of max(s, 0)³).
    fn share_in_front(s: [f64; 4]) -> f64 {
        (0..4)
            .filter(|&i| s[i] > 0.0)
            .map(|i| s[i].powi(3) / (0..4).filter(|&j| j != i).map(|j| s[i] - s[j]).product::<f64>())
            .sum()
    }

    #[test]
    fn both_sides_of_a_cut_have_the_volumes_of_the_closed_form() {
        let simplex = [
            Vector3::new(0.1, 0.2, -0.4),
            Vector3::new(1.3, 0.1, 0.2),
            Vector3::new(0.2, 1.1, 0.5),
            Vector3::new(0.4, 0.3, 1.7),
        ];
        for offset in [-0.3, 0.15, 0.3, 0.45, 1.0, 1.6, 2.5] {
            let plane = HalfSpace {
                normal: Vector3::new(0.3, -0.2, 1.0),
                offset,
            };
            let (mut inside, mut outside) = (Vec::new(), Vec::new());
            split(&simplex, &plane, &mut inside, &mut outside);
            let total = |pieces: &[Simplex]| pieces.iter().map(volume).sum::<f64>();
            let expected = share_in_front(plane.depths(&simplex)) * volume(&simplex);
            assert!(
                (total(&inside) - expected).abs() < 1e-14,
                "at {offset}: {} and {expected}",
                total(&inside)
            );
            assert!(
                (total(&inside) + total(&outside) - volume(&simplex)).abs() < 1e-15,
                "at {offset}"
            );
        }
    }

    #[test]
    fn a_corner_on_the_plane_makes_no_sliver() {
        let simplex = [Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::z()];
        let (mut inside, mut outside) = (Vec::new(), Vec::new());
        split(
            &simplex,
            &HalfSpace {
                normal: Vector3::z(),
                offset: 0.0,
            },
            &mut inside,
            &mut outside,
        );
        assert!(inside.is_empty());
        assert_eq!(outside.iter().map(volume).sum::<f64>(), 1.0 / 6.0);
    }

    #[test]
    fn six_simplices_fill_a_box() {
        let pieces = box_simplices(&Vector3::new(0.5, 1.0, 1.5));
        assert!(pieces.iter().all(|s| (volume(s) - 1.0).abs() < 1e-15));
    }
}
