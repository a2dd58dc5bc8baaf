//! Smallest boxes of input at the edge: nothing, a few points, flat ones, tiny, huge and far ones.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use prehend_geometry::{GeometryError, convex_hull, minimum_volume_box};

fn turned(points: &[[f64; 3]]) -> Vec<Point3<f64>> {
    let turn = UnitQuaternion::from_euler_angles(0.4, 1.1, -0.7);
    points.iter().map(|p| turn * Point3::from(*p)).collect()
}

/// The points, each of them three times, and all of them moved by a thousand times their size, at three scales.
fn variants(points: &[Point3<f64>]) -> Vec<(f64, Vec<Point3<f64>>)> {
    let mut all = Vec::new();
    for scale in [1e-12, 1.0, 1e12] {
        let scaled: Vec<_> = points.iter().map(|p| p * scale).collect();
        let away = Vector3::new(1000.0, -1000.0, 1000.0) * scale;
        all.push((scale, scaled.iter().map(|p| p + away).collect()));
        all.push((scale, [&scaled[..], &scaled, &scaled].concat()));
        all.push((scale, scaled));
    }
    all
}

/// The extents above 0, smallest first, in units of the scale.
fn extents(points: &[Point3<f64>], scale: f64) -> Vec<f64> {
    let smallest = minimum_volume_box(points).unwrap();
    assert!(smallest.center.coords.iter().all(|c| c.is_finite()));
    let mut extents: Vec<f64> = smallest
        .extents
        .iter()
        .map(|e| e / scale)
        .filter(|e| *e > 0.0)
        .collect();
    extents.sort_by(f64::total_cmp);
    extents
}

fn assert_extents(points: &[[f64; 3]], expected: &[f64]) {
    for (scale, points) in variants(&turned(points)) {
        let found = extents(&points, scale);
        assert_eq!(found.len(), expected.len(), "{scale:e}: {found:?}");
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-8, "{scale:e}: {found} {expected}");
        }
    }
}

#[test]
fn no_points_and_points_that_are_not_finite_are_errors() {
    assert_eq!(
        minimum_volume_box(&[]),
        Err(GeometryError::Empty { what: "points" })
    );
    for value in [f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
        let points = [
            Point3::origin(),
            Point3::new(1.0, 2.0, 3.0),
            Point3::new(0.0, value, 0.0),
        ];
        for error in [
            minimum_volume_box(&points).unwrap_err(),
            convex_hull(&points).unwrap_err(),
        ] {
            assert!(matches!(error, GeometryError::NotFinite { vertex: 2, .. }));
        }
    }
    let apart = [Point3::new(-1.7e308, 0.0, 0.0), Point3::new(1.7e308, 0.0, 0.0)];
    assert!(matches!(
        minimum_volume_box(&apart),
        Err(GeometryError::BadExtents { .. })
    ));
}

#[test]
fn one_two_and_three_points_are_a_point_a_segment_and_a_rectangle() {
    assert_extents(&[[0.3, 0.2, 0.1]], &[]);
    assert_extents(&[[0.0; 3], [1.0, 2.0, 2.0]], &[3.0]);
    // Of the rectangles around a right-angled triangle three are smallest; all have twice its area.
    for (scale, points) in variants(&turned(&[[0.0; 3], [0.3, 0.0, 0.0], [0.0, 0.4, 0.0]])) {
        let found = extents(&points, scale);
        assert!(
            found.len() == 2 && (found[0] * found[1] - 0.12).abs() < 1e-9,
            "{scale:e} {found:?}"
        );
    }
}

#[test]
fn collinear_and_coplanar_points_have_no_volume_at_any_scale_and_place() {
    let line: Vec<[f64; 3]> = (0..9).map(|i| [f64::from(i * i) / 64.0, 0.0, 0.0]).collect();
    assert_extents(&line, &[1.0]);
    let grid = (0..20).map(|i| [f64::from(i % 5) / 4.0, f64::from(i / 5) / 6.0, 0.0]);
    assert_extents(&grid.collect::<Vec<_>>(), &[0.5, 1.0]);
}

#[test]
fn a_block_keeps_its_extents_at_any_scale_and_place() {
    let lengths = [0.3, 0.5, 0.7];
    let corner = |i: u32| std::array::from_fn(|k| if i >> k & 1 == 1 { lengths[k] } else { 0.0 });
    let corners: Vec<[f64; 3]> = (0..8).map(corner).collect();
    assert_extents(&corners, &[0.3, 0.5, 0.7]);
}
