//! Shared volumes beside exact rational ones (`oracle/shared_volumes.py`).

use nalgebra::Point3;
use prehend_geometry::{OrientedBox, Tetrahedron, union_volume};
use serde::Deserialize;

#[derive(Deserialize)]
struct Case {
    name: String,
    tetrahedron: [[f64; 3]; 4],
    boxes: Vec<OrientedBox>,
    /// The larger of longest edge over least height, and longest over shortest extent of a box.
    slenderness: f64,
    shared: Vec<f64>,
    union: f64,
    union_of_boxes: f64,
}

/// Relative to the smaller body, for bodies up to a thousand times longer than thick, or than each other. The promise is
/// 1e-12.
const TOLERANCE: f64 = 1e-13;

/// Beyond, this many machine epsilons times longest over shortest extent.
const EPSILONS: f64 = 4.0;

#[test]
fn shared_volumes_agree_with_exact_arithmetic() {
    let cases: Vec<Case> = serde_json::from_str(include_str!("oracle/shared_volumes.json")).unwrap();
    assert!(cases.len() > 150);
    let mut worst = [(0.0, String::new()), (0.0, String::new())];
    for case in &cases {
        let slender = case.slenderness > 1100.0;
        let tolerance = TOLERANCE.max(if slender {
            EPSILONS * f64::EPSILON * case.slenderness
        } else {
            0.0
        });
        let mut check = |what: String, found: f64, expected: f64, smaller: f64| {
            let error = (found - expected).abs() / smaller;
            assert!(
                error <= tolerance,
                "{what}: {found:e}, exactly {expected:e}, off by {error:e}"
            );
            let error = if slender {
                error / f64::EPSILON / case.slenderness
            } else {
                error
            };
            if error > worst[usize::from(slender)].0 {
                worst[usize::from(slender)] = (error, what);
            }
        };
        let name = &case.name;
        let tetrahedron = Tetrahedron(case.tetrahedron.map(Point3::from));
        let volume = tetrahedron.volume();
        for (oriented_box, &expected) in case.boxes.iter().zip(&case.shared) {
            let found = tetrahedron.intersection_volume(oriented_box);
            check(name.clone(), found, expected, volume.min(oriented_box.volume()));
        }
        let boxes: f64 = case.boxes.iter().map(OrientedBox::volume).sum();
        let found = tetrahedron.union_volume(&case.boxes);
        check(format!("{name}, union"), found, case.union, volume.min(boxes));
        let smallest = case
            .boxes
            .iter()
            .map(OrientedBox::volume)
            .fold(f64::INFINITY, f64::min);
        check(
            format!("{name}, boxes"),
            union_volume(&case.boxes),
            case.union_of_boxes,
            smallest,
        );
    }
    let [(ordinary, first), (slender, second)] = worst;
    println!(
        "worst: {ordinary:.1e} of the smaller body ({first}); slender: {slender:.2} epsilons x slenderness ({second})"
    );
}
