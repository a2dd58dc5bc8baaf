//! Laws that every grasp's quality obeys.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use prehend_quality::{
    ConeShape, Contact, EpsilonSolver, GraspWrenchSpace, LimitSurface, Norm, QualityError, QualityOptions,
    Wrench, WrenchMetric, grasp_quality,
};
use proptest::prelude::*;

fn direction() -> impl Strategy<Value = Vector3<f64>> {
    [-1.0..1.0_f64, -1.0..1.0, -1.0..1.0]
        .prop_map(Vector3::from)
        .prop_filter("not too short", |v| v.norm() > 0.1)
        .prop_map(|v| v.normalize())
}

/// A contact on a bumpy ball of about 40 mm: the normal leans a little off the inward radius.
fn contact() -> impl Strategy<Value = Contact> {
    (
        direction(),
        direction(),
        0.0..0.5_f64,
        prop_oneof![Just(0.0), 0.05..1.5_f64],
        prop_oneof![Just(0.0), Just(2e-3)],
    )
        .prop_map(|(out, lean, amount, mu, torsion)| {
            Contact::new(0, Point3::from(0.04 * out), -out + amount * lean, mu, torsion).unwrap()
        })
}

fn grasp(most: usize) -> impl Strategy<Value = Vec<Contact>> {
    prop::collection::vec(contact(), 1..most)
}

fn options() -> QualityOptions {
    QualityOptions::new(Point3::new(0.001, -0.002, 0.003), 0.045)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn another_contact_never_makes_it_worse(contacts in grasp(7), extra in contact()) {
        for norm in [Norm::L1, Norm::LInf] {
            if norm == Norm::LInf && contacts.len() > 3 {
                continue;
            }
            let options = QualityOptions { norm, ..options() };
            let before = grasp_quality(&contacts, &options).unwrap();
            let more: Vec<Contact> = contacts.iter().copied().chain([extra]).collect();
            let after = grasp_quality(&more, &options).unwrap();
            // Doubled tolerances, relative to the largest wrench norm, which a contact may raise.
            let slack = 1e-8;
            prop_assert!(after.epsilon >= before.epsilon - slack, "{before:?} {after:?}");
            prop_assert!(after.origin_distance <= before.origin_distance + slack);
            prop_assert!(after.rank >= before.rank);
        }
    }

    #[test]
    fn more_friction_never_makes_it_worse(contacts in grasp(7), factor in 1.0..2.0_f64) {
        let before = grasp_quality(&contacts, &options()).unwrap();
        let rougher: Vec<Contact> = contacts.iter().map(|c| Contact { mu: c.mu * factor, ..*c }).collect();
        let after = grasp_quality(&rougher, &options()).unwrap();
        prop_assert!(after.epsilon >= before.epsilon - 1e-8);
    }

    #[test]
    fn a_rigid_motion_matters_only_through_the_edges(contacts in grasp(6), axis in direction(), angle in 0.0..3.0_f64) {
        // Point contacts with 64 edges: the cone that the edges span lies between one of aperture cos(π/64) μ and one of μ.
        let hard: Vec<Contact> = contacts.iter().map(|c| Contact { torsion: 0.0, ..*c }).collect();
        let options = QualityOptions { cone: ConeShape::Edges(64), ..options() };
        let motion = Isometry3::from_parts(
            Translation3::new(0.3, -0.2, 0.1),
            UnitQuaternion::from_scaled_axis(angle * axis),
        );
        let moved: Vec<Contact> = hard
            .iter()
            .map(|c| Contact::new(0, motion * c.at.point, motion * c.at.normal.into_inner(), c.mu, 0.0).unwrap())
            .collect();
        let moved_options = QualityOptions { center: motion * options.center, ..options };
        let here = grasp_quality(&hard, &options).unwrap().epsilon;
        let there = grasp_quality(&moved, &moved_options).unwrap().epsilon;
        // Hausdorff distance of the two wrench spaces: μ (1 − cos(π/64)) × |(1, arm/scale)|, arm/scale ≤ 1.
        let largest_mu = hard.iter().map(|c| c.mu).fold(0.0, f64::max);
        let bound = largest_mu * (1.0 - (std::f64::consts::PI / 64.0).cos()) * 2.0_f64.sqrt() + 1e-8;
        prop_assert!((here - there).abs() <= bound, "{here} {there} {bound}");
    }

    #[test]
    fn one_length_unit_is_as_good_as_another(contacts in grasp(6)) {
        use prehend_quality::LengthUnit::Millimetre;
        let metre = grasp_quality(&contacts, &options()).unwrap();
        let mm: Vec<Contact> = contacts
            .iter()
            .map(|c| {
                let point = Point3::from(c.at.point.coords * 1e3);
                Contact::new(0, point, c.at.normal.into_inner(), c.mu, c.torsion * 1e3).unwrap()
            })
            .collect();
        let options = options();
        let in_mm = QualityOptions {
            center: Point3::from(options.center.coords * 1e3),
            torque_scale: options.torque_scale * 1e3,
            length_unit: Millimetre,
            ..options
        };
        prop_assert!((grasp_quality(&mm, &in_mm).unwrap().epsilon - metre.epsilon).abs() < 1e-9);
    }

    #[test]
    fn epsilon_is_a_lower_bound_of_the_support_in_every_direction(contacts in grasp(7), seed in 0..1000_u32) {
        for norm in [Norm::L1, Norm::LInf] {
            if norm == Norm::LInf && contacts.len() > 4 {
                continue;
            }
            let options = QualityOptions { norm, ..options() };
            let quality = grasp_quality(&contacts, &options).unwrap();
            let space = GraspWrenchSpace::new(&contacts, &options).unwrap();
            for i in 0..200_u32 {
                let angle = |k: u32| f64::from(seed * 997 + i * 131 + k * 71).sin() * 40.0;
                let direction = Wrench::from_fn(|k, _| angle(k as u32).sin()).normalize();
                let (reach, point) = space.support(&direction);
                prop_assert!((direction.dot(&point) - reach).abs() < 1e-9);
                if quality.force_closure {
                    prop_assert!(reach >= quality.epsilon - 1e-9);
                }
            }
        }
    }

    #[test]
    fn doubling_and_reversing_the_contacts_changes_nothing(contacts in grasp(6)) {
        let once = grasp_quality(&contacts, &options()).unwrap();
        let twice: Vec<Contact> = contacts.iter().rev().chain(&contacts).copied().collect();
        let twice = grasp_quality(&twice, &options()).unwrap();
        prop_assert!((once.epsilon - twice.epsilon).abs() < 1e-10, "{once:?} {twice:?}");
        prop_assert_eq!(once.rank, twice.rank);
        prop_assert!((once.origin_distance - twice.origin_distance).abs() < 1e-8);
    }

    #[test]
    fn a_rigid_motion_does_nothing_to_smooth_cones(contacts in grasp(6), axis in direction(), angle in 0.0..3.0_f64) {
        let options = QualityOptions {
            cone: ConeShape::Smooth,
            limit_surface: LimitSurface::Ellipsoid,
            ..options()
        };
        // The wrench ball is round over forces and over torques, so a turn about the centre keeps it.
        let turn = UnitQuaternion::from_scaled_axis(angle * axis);
        let turned: Vec<Contact> = contacts
            .iter()
            .map(|c| {
                let point = options.center + turn * (c.at.point - options.center);
                Contact::new(0, point, turn * c.at.normal.into_inner(), c.mu, c.torsion).unwrap()
            })
            .collect();
        let mut solver = EpsilonSolver::default();
        let mut bounds = |contacts: &[Contact]| {
            solver.bounds(&GraspWrenchSpace::new(contacts, &options).unwrap()).unwrap()
        };
        let (here, there) = (bounds(&contacts), bounds(&turned));
        prop_assert!(here.lower <= there.upper + 1e-9 && there.lower <= here.upper + 1e-9, "{here:?} {there:?}");
    }

    #[test]
    fn wrenches_inside_the_hull_change_nothing(contacts in grasp(6), share in 0.0..1.0_f64) {
        // The same contact with less friction pushes inside its own cone.
        let hard: Vec<Contact> = contacts.iter().map(|c| Contact { torsion: 0.0, ..*c }).collect();
        let more: Vec<Contact> = hard
            .iter()
            .copied()
            .chain(hard.iter().map(|c| Contact { mu: share * c.mu, ..*c }))
            .collect();
        let before = grasp_quality(&hard, &options()).unwrap();
        let after = grasp_quality(&more, &options()).unwrap();
        prop_assert!((before.epsilon - after.epsilon).abs() < 1e-10);
    }

    #[test]
    fn scaling_the_wrenches_scales_epsilon(contacts in grasp(6), factor in 0.1..10.0_f64) {
        // A metric of 1/s² makes every wrench s times as short.
        let metric = WrenchMetric::from_semi_axes([factor; 6]).unwrap();
        let plain = grasp_quality(&contacts, &options()).unwrap();
        let scaled = grasp_quality(&contacts, &QualityOptions { metric: Some(metric), ..options() }).unwrap();
        prop_assert!((plain.epsilon - scaled.epsilon * factor).abs() < 1e-10);
    }

    #[test]
    fn nearly_equal_contacts_neither_hang_nor_panic(contacts in grasp(5), size in prop_oneof![Just(1e-9), Just(1e-12), Just(1e-13), Just(1e-15)]) {
        let wobble = |i: usize| Vector3::new((i as f64).sin(), (2.0 * i as f64).cos(), (3.0 * i as f64).sin());
        let noisy: Vec<Contact> = (0..4 * contacts.len())
            .map(|i| {
                let c = contacts[i % contacts.len()];
                let normal = c.at.normal.into_inner() + size * wobble(i);
                Contact::new(i, c.at.point + size * wobble(i + 7), normal, c.mu, c.torsion).unwrap()
            })
            .collect();
        let clean = grasp_quality(&contacts, &options()).unwrap();
        let noisy = grasp_quality(&noisy, &options()).unwrap();
        // ε moves no more than the wrenches do: size × (1 + arm stretched by 1/scale = 22) per contact.
        prop_assert!((clean.epsilon - noisy.epsilon).abs() < 100.0 * size + 5e-9, "{clean:?} {noisy:?}");
    }
}

#[test]
fn epsilon_is_zero_with_the_origin_on_the_boundary() {
    // Frictionless contacts from below and the sides only: nothing pushes down, and the origin lies on the hull's face.
    let contacts: Vec<Contact> = [
        (Vector3::x(), [-0.05, 0.01, 0.0]),
        (-Vector3::x(), [0.05, 0.01, 0.0]),
        (Vector3::y(), [0.0, -0.05, 0.0]),
        (-Vector3::y(), [0.0, 0.05, 0.0]),
        (Vector3::z(), [0.01, 0.01, -0.05]),
        (Vector3::z(), [-0.01, 0.02, -0.05]),
    ]
    .iter()
    .enumerate()
    .map(|(i, (n, p))| Contact::new(i, (*p).into(), *n, 0.0, 0.0).unwrap())
    .collect();
    let quality = grasp_quality(&contacts, &QualityOptions::new(Point3::origin(), 0.1)).unwrap();
    assert_eq!(
        (quality.epsilon, quality.force_closure, quality.origin_distance),
        (0.0, false, 0.0)
    );
}

#[test]
fn two_hundred_contacts_take_a_moment_not_forever() {
    let contacts: Vec<Contact> = (0..200)
        .map(|i| {
            let z = -1.0 + 2.0 * (f64::from(i) + 0.5) / 200.0;
            let turn = f64::from(i) * 2.399_963;
            let r = (1.0 - z * z).sqrt();
            let out = Vector3::new(r * turn.cos(), r * turn.sin(), z);
            let point = Point3::new(0.05 * out.x, 0.03 * out.y, 0.08 * out.z);
            let soft = if i % 3 == 0 { 2e-3 } else { 0.0 };
            Contact::new(i as usize, point, -out, 0.5, soft).unwrap()
        })
        .collect();
    let options = QualityOptions::new(Point3::origin(), 0.08);
    let quality = grasp_quality(&contacts, &options).unwrap();
    assert!(quality.force_closure && quality.rank == 6);
}

#[test]
fn numbers_of_any_size_give_an_answer_or_an_error() {
    for size in [1e-200, 1e-20, 1e-6, 1.0, 1e6, 1e20, 1e150, 1e300] {
        for scale in [1e-300, 1e-9, 1.0, 1e9, 1e300] {
            for mu in [0.0, 1e-300, 1e-9, 1.0, 1e9, 1e300] {
                let contacts: Vec<Contact> = (0..4)
                    .map(|i| {
                        let turn = f64::from(i) * std::f64::consts::FRAC_PI_2;
                        let out = Vector3::new(turn.cos(), turn.sin(), 0.3 * f64::from(i) - 0.4);
                        Contact::new(i as usize, Point3::from(size * out), -out, mu, size * 0.05).unwrap()
                    })
                    .collect();
                match grasp_quality(&contacts, &QualityOptions::new(Point3::origin(), scale)) {
                    Ok(q) => {
                        assert!(
                            q.epsilon.is_finite() && q.epsilon >= 0.0,
                            "{size} {scale} {mu}: {q:?}"
                        );
                        assert!(
                            q.origin_distance.is_finite() && (1..=6).contains(&q.rank),
                            "{q:?}"
                        );
                    }
                    Err(error) => assert!(matches!(error, QualityError::WrenchOverflow { .. }), "{error}"),
                }
            }
        }
    }
}

#[test]
fn no_contacts_is_an_error() {
    let error = grasp_quality(&[], &QualityOptions::new(Point3::origin(), 1.0)).unwrap_err();
    assert_eq!(error.to_string(), "the grasp has no contacts; give at least one");
}

#[test]
fn an_unchecked_normal_is_an_error_that_names_the_contact() {
    let mut contact = Contact::new(0, Point3::origin(), Vector3::z(), 0.5, 0.0).unwrap();
    let good = contact;
    contact.at.normal = nalgebra::UnitVector3::new_unchecked(Vector3::new(0.0, f64::NAN, 0.0));
    let error = grasp_quality(&[good, contact], &QualityOptions::new(Point3::origin(), 1.0)).unwrap_err();
    assert!(matches!(error, QualityError::BadNormal { contact_idx: 1, .. }));
}
