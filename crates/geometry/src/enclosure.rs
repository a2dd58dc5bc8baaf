//! The tetrahedron that a hand and its contacts span.

use nalgebra::Point3;

use crate::Tetrahedron;

/// A tetrahedron counts as flat below this share of the cube of its reach: rounding alone gives some 1e-16.
const FLATNESS: f64 = 1e-12;

/// The largest tetrahedron of `apex` and three of the contacts (Δ of the free volume).
///
/// Triples are tried in lexicographic order and only a strictly larger one replaces the best, so ties go to the first.
/// `None` with fewer than three contacts, and where apex and contacts lie in one plane.
///
/// # Source
///
/// Paper, section V-B, "Free Volume (C₁)".
pub fn largest_tetrahedron(apex: Point3<f64>, contacts: &[Point3<f64>]) -> Option<Tetrahedron> {
    let reach = contacts.iter().map(|p| (p - apex).norm()).fold(0.0, f64::max);
    let edges: Vec<_> = contacts.iter().map(|p| p - apex).collect();
    // A plain determinant is off by some 1e-15 of the product of its rows; only what could win is measured exactly.
    let rounding = 1e-14 * reach.powi(3);
    let mut largest_volume = FLATNESS * reach.powi(3);
    let mut largest = None;
    for i in 0..contacts.len() {
        for j in i + 1..contacts.len() {
            for k in j + 1..contacts.len() {
                let roughly = edges[i].cross(&edges[j]).dot(&edges[k]).abs() / 6.0;
                if roughly + rounding <= largest_volume {
                    continue;
                }
                let candidate = Tetrahedron([apex, contacts[i], contacts[j], contacts[k]]);
                let volume = candidate.volume();
                if volume > largest_volume {
                    largest_volume = volume;
                    largest = Some(candidate);
                }
            }
        }
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: f64, y: f64, z: f64) -> Point3<f64> {
        Point3::new(x, y, z)
    }

    #[test]
    fn the_triple_that_spans_most_wins() {
        let contacts = [
            point(1.0, 0.0, 0.0),
            point(0.0, 1.0, 0.0),
            point(0.0, 0.0, 0.5),
            point(0.0, 0.0, 2.0),
        ];
        let largest = largest_tetrahedron(Point3::origin(), &contacts).unwrap();
        assert_eq!(
            largest.0,
            [Point3::origin(), contacts[0], contacts[1], contacts[3]]
        );
        assert!((largest.volume() - 1.0 / 3.0).abs() < 1e-15);
    }

    #[test]
    fn equal_triples_go_to_the_first_in_order() {
        let contacts = [
            point(1.0, 0.0, 0.0),
            point(0.0, 1.0, 0.0),
            point(0.0, 0.0, 1.0),
            point(0.0, 0.0, -1.0),
        ];
        let largest = largest_tetrahedron(Point3::origin(), &contacts).unwrap();
        assert_eq!(largest.0[3], contacts[2]);
    }

    #[test]
    fn of_forty_contacts_on_a_ball_the_same_three_win_whatever_the_unit() {
        let contacts: Vec<_> = (0..40)
            .map(|i| {
                let z = 1.0 - f64::from(2 * i + 1) / 40.0;
                let (sin, cos) = (f64::from(i) * 2.399_963_229_728_653).sin_cos();
                let r = (1.0 - z * z).sqrt();
                point(r * cos, r * sin, z)
            })
            .collect();
        let apex = point(0.0, 0.0, 1.5);
        let largest = largest_tetrahedron(apex, &contacts).unwrap();
        let all = (0..40).flat_map(|i| (i + 1..40).flat_map(move |j| (j + 1..40).map(move |k| [i, j, k])));
        let exact =
            |[i, j, k]: [usize; 3]| Tetrahedron([apex, contacts[i], contacts[j], contacts[k]]).volume();
        assert_eq!(largest.volume(), all.map(exact).fold(0.0, f64::max));
        let small: Vec<_> = contacts.iter().map(|p| p * 2.0_f64.powi(-10)).collect();
        let scaled = largest_tetrahedron(apex * 2.0_f64.powi(-10), &small).unwrap();
        assert_eq!(scaled.0.map(|p| p * 1024.0), largest.0);
    }

    #[test]
    fn too_few_or_coplanar_contacts_span_nothing() {
        let plane: Vec<_> = (0..6)
            .map(|i| point(0.1 * f64::from(i), 0.3, 0.1 * f64::from(i * i)))
            .collect();
        assert_eq!(largest_tetrahedron(point(0.7, 0.3, 0.9), &plane), None);
        assert_eq!(largest_tetrahedron(Point3::origin(), &plane[..2]), None);
        assert_eq!(largest_tetrahedron(Point3::origin(), &[]), None);
    }
}
