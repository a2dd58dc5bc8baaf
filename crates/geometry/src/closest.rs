//! Closest points between points, segments and triangles, in closed form.

use nalgebra::{Point3, Vector3};

type P = Point3<f64>;

/// The point of segment `ab` that is closest to `p`; `a` where the segment has no length.
pub(crate) fn on_segment(p: &P, a: &P, b: &P) -> P {
    let ab = b - a;
    let length_squared = ab.norm_squared();
    if length_squared == 0.0 {
        return *a;
    }
    a + ab * ((p - a).dot(&ab) / length_squared).clamp(0.0, 1.0)
}

/// The point of a triangle that is closest to `p`, by the Voronoi region of `p`; degenerate triangles count as their edges.
pub(crate) fn on_triangle(p: &P, [a, b, c]: &[P; 3]) -> P {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return *a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return *b;
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return *c;
    }
    let vc = d1 * d4 - d3 * d2;
    let vb = d5 * d2 - d1 * d6;
    let va = d3 * d6 - d5 * d4;
    let sum = va + vb + vc;
    // A flat triangle leaves only rounding in these products.
    if sum <= 1e-14 * ab.norm_squared() * ac.norm_squared() {
        return nearest_of(p, [on_segment(p, a, b), on_segment(p, b, c), on_segment(p, c, a)]);
    }
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    a + ab * (vb / sum) + ac * (vc / sum)
}

/// The closest points of segments `p q` and `a b`, in this order.
pub(crate) fn of_segments(p: &P, q: &P, a: &P, b: &P) -> (P, P) {
    let (d1, d2, r) = (q - p, b - a, p - a);
    let (aa, ee, f) = (d1.norm_squared(), d2.norm_squared(), d2.dot(&r));
    if aa == 0.0 {
        return (*p, on_segment(p, a, b));
    }
    if ee == 0.0 {
        return (on_segment(a, p, q), *a);
    }
    let (c, bb) = (d1.dot(&r), d1.dot(&d2));
    let denominator = aa * ee - bb * bb;
    let parallel = denominator <= 1e-14 * aa * ee;
    let s = if parallel {
        0.0
    } else {
        ((bb * f - c * ee) / denominator).clamp(0.0, 1.0)
    };
    let t = (bb * s + f) / ee;
    let (s, t) = if t < 0.0 {
        ((-c / aa).clamp(0.0, 1.0), 0.0)
    } else if t > 1.0 {
        (((bb - c) / aa).clamp(0.0, 1.0), 1.0)
    } else {
        (s, t)
    };
    (p + d1 * s, a + d2 * t)
}

/// The closest points of segment `p q` and a triangle, in this order; equal where they cross.
pub(crate) fn of_segment_and_triangle(p: &P, q: &P, triangle: &[P; 3]) -> (P, P) {
    if let Some(crossing) = crossing(p, q, triangle) {
        return (crossing, crossing);
    }
    let [a, b, c] = triangle;
    let mut best = (*p, on_triangle(p, triangle));
    let mut least = (best.0 - best.1).norm_squared();
    let candidates = [
        (*q, on_triangle(q, triangle)),
        of_segments(p, q, a, b),
        of_segments(p, q, b, c),
        of_segments(p, q, c, a),
    ];
    for pair in candidates {
        let d = (pair.0 - pair.1).norm_squared();
        if d < least {
            least = d;
            best = pair;
        }
    }
    best
}

/// The closest points of two triangles, in this order; equal where they cross.
pub(crate) fn of_triangles(first: &[P; 3], second: &[P; 3]) -> (P, P) {
    let mut best = (first[0], second[0]);
    let mut least = f64::INFINITY;
    for k in 0..3 {
        let on_first = of_segment_and_triangle(&second[k], &second[(k + 1) % 3], first);
        let on_second = of_segment_and_triangle(&first[k], &first[(k + 1) % 3], second);
        for pair in [(on_first.1, on_first.0), on_second] {
            let d = (pair.0 - pair.1).norm_squared();
            if d < least {
                least = d;
                best = pair;
            }
        }
    }
    best
}

/// Where segment `p q` passes through a triangle; `None` where it misses or runs in its plane.
fn crossing(p: &P, q: &P, triangle: &[P; 3]) -> Option<P> {
    let direction = q - p;
    ray_parameter(p, &direction, triangle)
        .filter(|t| (0.0..=1.0).contains(t))
        .map(|t| p + direction * t)
}

/// The `t` at which `origin + t · direction` meets a triangle (either side); `None` where it misses or is parallel.
pub(crate) fn ray_parameter(origin: &P, direction: &Vector3<f64>, [a, b, c]: &[P; 3]) -> Option<f64> {
    let (e1, e2) = (b - a, c - a);
    let across = direction.cross(&e2);
    let determinant = e1.dot(&across);
    if determinant.abs() <= 1e-14 * e1.norm() * across.norm() {
        return None;
    }
    let from_a = origin - a;
    let u = from_a.dot(&across) / determinant;
    let along = from_a.cross(&e1);
    let v = direction.dot(&along) / determinant;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then(|| e2.dot(&along) / determinant)
}

fn nearest_of(p: &P, candidates: [P; 3]) -> P {
    let [first, rest @ ..] = candidates;
    rest.into_iter().fold(first, |best, c| {
        if (c - p).norm_squared() < (best - p).norm_squared() {
            c
        } else {
            best
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn point(rng: &mut impl Rng) -> P {
        P::new(
            rng.random_range(-1.0..1.0),
            rng.random_range(-1.0..1.0),
            rng.random_range(-1.0..1.0),
        )
    }

    /// All points of a triangle on a grid of barycentric coordinates.
    fn grid([a, b, c]: &[P; 3]) -> Vec<P> {
        let n = 60;
        let steps =
            (0..=n).flat_map(|i| (0..=n - i).map(move |j| (f64::from(i) / 60.0, f64::from(j) / 60.0)));
        steps.map(|(u, v)| a + (b - a) * u + (c - a) * v).collect()
    }

    #[test]
    fn the_closest_point_of_a_triangle_beats_every_grid_point_by_at_most_the_grid_step() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for _ in 0..300 {
            let (p, triangle) = (
                point(&mut rng),
                [point(&mut rng), point(&mut rng), point(&mut rng)],
            );
            let exact = (on_triangle(&p, &triangle) - p).norm();
            let sampled = grid(&triangle)
                .iter()
                .map(|g| (g - p).norm())
                .fold(f64::INFINITY, f64::min);
            assert!(
                exact <= sampled + 1e-12 && sampled <= exact + 0.06,
                "{exact} {sampled}"
            );
        }
    }

    #[test]
    fn segment_and_triangle_agree_with_sampling_the_segment() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for _ in 0..1000 {
            let (p, q) = (point(&mut rng), point(&mut rng));
            let triangle = [point(&mut rng), point(&mut rng), point(&mut rng)];
            let (s, t) = of_segment_and_triangle(&p, &q, &triangle);
            let sampled = (0..=200)
                .map(|i| p + (q - p) * (f64::from(i) / 200.0))
                .map(|x| (on_triangle(&x, &triangle) - x).norm())
                .fold(f64::INFINITY, f64::min);
            let exact = (s - t).norm();
            assert!(
                exact <= sampled + 1e-9 && sampled <= exact + 0.01,
                "{exact} {sampled}"
            );
            assert!(
                (on_triangle(&t, &triangle) - t).norm() < 1e-9,
                "the point lies on the triangle"
            );
        }
    }

    #[test]
    fn two_triangles_agree_with_the_least_over_sampled_points() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for _ in 0..200 {
            let first = [point(&mut rng), point(&mut rng), point(&mut rng)];
            let second = first.map(|_| point(&mut rng) + Vector3::new(1.0, 0.3, 0.0));
            let (a, b) = of_triangles(&first, &second);
            let sampled = grid(&first)
                .iter()
                .map(|x| (on_triangle(x, &second) - x).norm())
                .fold(f64::INFINITY, f64::min);
            let exact = (a - b).norm();
            assert!(
                exact <= sampled + 1e-9 && sampled <= exact + 0.06,
                "{exact} {sampled}"
            );
        }
    }

    #[test]
    fn a_triangle_without_area_counts_as_its_longest_edge() {
        let flat = [P::origin(), P::new(1.0, 0.0, 0.0), P::new(0.4, 0.0, 0.0)];
        let nearest = on_triangle(&P::new(0.7, 1.0, 0.0), &flat);
        assert!((nearest - P::new(0.7, 0.0, 0.0)).norm() < 1e-12);
        let dot = [P::origin(); 3];
        assert_eq!(on_triangle(&P::new(0.7, 1.0, 0.0), &dot), P::origin());
    }

    #[test]
    fn parallel_segments_are_as_far_apart_as_their_lines() {
        let (a, b) = (P::origin(), P::new(1.0, 0.0, 0.0));
        let (s, t) = of_segments(&a, &b, &P::new(0.5, 2.0, 0.0), &P::new(3.0, 2.0, 0.0));
        assert!(((s - t).norm() - 2.0).abs() < 1e-12);
        let (s, t) = of_segments(&a, &b, &P::new(2.0, 0.0, 0.0), &P::new(3.0, 0.0, 0.0));
        assert!(((s - t).norm() - 1.0).abs() < 1e-12);
    }
}
