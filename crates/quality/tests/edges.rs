//! The edges of the question: every set of contacts has a value that is written down, or an error that names the contact.

use nalgebra::{Point3, Vector3};
use prehend_quality::{
    ConeShape, Contact, EpsilonSolver, GraspWrenchSpace, LengthUnit, LimitSurface, Norm, Quality,
    QualityError, QualityOptions, WrenchAxes, grasp_quality,
};

fn contact(point: [f64; 3], normal: [f64; 3], mu: f64) -> Contact {
    Contact::new(0, point.into(), normal.into(), mu, 0.0).unwrap()
}

fn unit_options() -> QualityOptions {
    QualityOptions::new(Point3::origin(), 1.0)
}

fn quality(contacts: &[Contact], options: &QualityOptions) -> Quality {
    let found = grasp_quality(contacts, options).unwrap();
    assert!(found.epsilon.is_finite() && found.origin_distance.is_finite());
    assert!((found.limiting_wrench.norm() - 1.0).abs() < 1e-9, "{found:?}");
    found
}

fn every_cone() -> [QualityOptions; 4] {
    let options = unit_options();
    [
        options,
        QualityOptions {
            cone: ConeShape::Smooth,
            ..options
        },
        QualityOptions {
            norm: Norm::LInf,
            ..options
        },
        QualityOptions {
            cone: ConeShape::Edges(3),
            limit_surface: LimitSurface::Ellipsoid,
            ..options
        },
    ]
}

/// Six contacts at the faces of a cube, off their middles so that frictionless ones span all six axes.
fn six() -> Vec<Contact> {
    (0..3)
        .flat_map(|axis| [1.0, -1.0].map(|sign| (axis, sign)))
        .map(|(axis, sign)| {
            let mut point = Vector3::zeros();
            point[axis] = -sign;
            point[(axis + 1) % 3] = 0.2 * sign;
            let mut normal = Vector3::zeros();
            normal[axis] = sign;
            contact(point.into(), normal.into(), 0.5)
        })
        .collect()
}

#[test]
fn two_antipodal_points_have_rank_five_and_touch_the_origin() {
    let pair = [
        contact([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], 0.5),
        contact([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], 0.5),
    ];
    for options in every_cone() {
        let found = quality(&pair, &options);
        assert_eq!((found.epsilon, found.force_closure, found.rank), (0.0, false, 5));
        assert!(found.origin_distance < 1e-11);
        // Nothing answers a twist about the line between them.
        assert!(found.limiting_wrench[3].abs() > 1.0 - 1e-9, "{found:?}");
    }
}

#[test]
fn one_contact_never_closes_and_is_as_far_as_its_axis() {
    for mu in [0.0, 0.3, 2.0] {
        for options in every_cone().into_iter().filter(|o| o.norm == Norm::L1) {
            let found = quality(&[contact([0.0; 3], [0.0, 0.0, 2.0], mu)], &options);
            assert_eq!((found.epsilon, found.force_closure), (0.0, false));
            // Through the centre: the cone's middle (n, 0) is its nearest point. Rank: one normal, two tangents.
            assert!((found.origin_distance - 1.0).abs() < 1e-9, "{found:?}");
            assert_eq!(found.rank, if mu > 0.0 { 3 } else { 1 });
        }
    }
}

#[test]
fn frictionless_contacts_hold_a_ball_against_forces_only() {
    let around: Vec<Contact> = six()
        .iter()
        .map(|c| {
            let n = c.at.normal.into_inner();
            contact((-n).into(), n.into(), 0.0)
        })
        .collect();
    let found = quality(&around, &unit_options());
    assert_eq!((found.epsilon, found.rank), (0.0, 3));
    // The forces alone: the octahedron |x| + |y| + |z| ≤ 1, whose faces are 1/√3 away.
    let forces = QualityOptions {
        axes: WrenchAxes::FORCES,
        volume: true,
        ..unit_options()
    };
    let found = quality(&around, &forces);
    assert!((found.epsilon - 1.0 / 3.0_f64.sqrt()).abs() < 1e-12 && found.force_closure);
    assert_eq!(found.rank, 3);
    assert!((found.volume.unwrap() - 4.0 / 3.0).abs() < 1e-12);
}

#[test]
fn two_axes_give_the_ball_of_a_polygon() {
    let planar = WrenchAxes::new([true, true, false, false, false, false]).unwrap();
    let around: Vec<Contact> = six().iter().map(|c| Contact { mu: 0.0, ..*c }).collect();
    let found = quality(
        &around,
        &QualityOptions {
            axes: planar,
            volume: true,
            ..unit_options()
        },
    );
    // The square |x| + |y| ≤ 1.
    assert!((found.epsilon - 0.5_f64.sqrt()).abs() < 1e-12);
    assert!((found.volume.unwrap() - 2.0).abs() < 1e-12);
}

#[test]
fn doubled_contacts_and_opposite_ones_at_one_point_are_welcome() {
    for options in every_cone() {
        let once = quality(&six(), &options);
        assert!(once.force_closure);
        if options.norm == Norm::L1 {
            let twice: Vec<Contact> = six().into_iter().chain(six()).chain(six()).collect();
            let twice = quality(&twice, &options);
            let slack = if options.cone == ConeShape::Smooth {
                2e-4
            } else {
                1e-12
            };
            assert!((once.epsilon - twice.epsilon).abs() <= slack);
        }
        let opposite = [
            contact([1.0, 0.0, 0.0], [1.0, 0.0, 0.0], 0.5),
            contact([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], 0.5),
        ];
        let found = quality(&opposite, &options);
        assert_eq!(
            (found.epsilon, found.force_closure, found.origin_distance),
            (0.0, false, 0.0)
        );
    }
}

#[test]
fn all_on_one_side_never_closes_and_the_distance_is_that_of_the_plane() {
    let side: Vec<Contact> = [[0.5, 0.5], [-0.5, 0.5], [0.5, -0.5], [-0.5, -0.5]]
        .map(|[x, y]| contact([x, y, -1.0], [0.0, 0.0, 1.0], 0.5))
        .to_vec();
    for options in every_cone().into_iter().filter(|o| o.norm == Norm::L1) {
        let found = quality(&side, &options);
        assert_eq!((found.epsilon, found.force_closure), (0.0, false));
        assert!((found.origin_distance - 1.0).abs() < 1e-9);
        // A pull along +z meets nothing.
        assert!(found.limiting_wrench[2] > 0.5, "{found:?}");
    }
}

#[test]
fn smooth_contacts_by_the_hundred_stay_within_their_bounds() {
    let many: Vec<Contact> = (0..200)
        .map(|i| {
            let z = -1.0 + 2.0 * (f64::from(i) + 0.5) / 200.0;
            let (sin, cos) = (f64::from(i) * 2.399_963).sin_cos();
            let r = (1.0 - z * z).sqrt();
            let out = Vector3::new(r * cos, r * sin, z);
            contact([out.x, 0.6 * out.y, 1.5 * out.z], (-out).into(), 0.5)
        })
        .collect();
    let space = GraspWrenchSpace::new(&many, &unit_options()).unwrap();
    assert!(EpsilonSolver::default().epsilon_at_least(&space, 0.1).unwrap());
    let bounds = EpsilonSolver::default().epsilon_within(&space, 0.05).unwrap();
    assert!(bounds.lower > 0.1 && bounds.upper - bounds.lower <= 0.05);
}

#[test]
fn millimetres_change_nothing_but_the_samples_of_soft_contacts() {
    let in_mm: Vec<Contact> = six()
        .iter()
        .map(|c| Contact {
            at: prehend_geometry::ContactPoint {
                point: c.at.point * 1e3,
                ..c.at
            },
            ..*c
        })
        .collect();
    let options = QualityOptions {
        length_unit: LengthUnit::Millimetre,
        ..QualityOptions::new(Point3::origin(), 1e3)
    };
    let (mm, m) = (quality(&in_mm, &options), quality(&six(), &unit_options()));
    assert!((mm.epsilon - m.epsilon).abs() < 1e-12);
}

#[test]
fn gravity_moves_every_wrench() {
    let lifted = QualityOptions {
        gravity: Vector3::new(0.0, 0.0, 0.5),
        ..unit_options()
    };
    let plain = GraspWrenchSpace::new(&six(), &unit_options()).unwrap();
    let moved = GraspWrenchSpace::new(&six(), &lifted).unwrap();
    for (a, b) in plain.wrenches().iter().zip(moved.wrenches()) {
        let step = b - a;
        assert!((step[2] - 0.5).abs() < 1e-15 && step.norm() < 0.5 + 1e-15);
    }
    // 1.5 of gravity lifts even the contact from above off the origin's side.
    let too_much = QualityOptions {
        gravity: Vector3::new(0.0, 0.0, 1.5),
        ..unit_options()
    };
    assert_eq!(quality(&six(), &too_much).epsilon, 0.0);
}

#[test]
fn errors_name_the_contact() {
    let error = Contact::new(3, Point3::origin(), Vector3::zeros(), 0.5, 0.0).unwrap_err();
    assert!(matches!(error, QualityError::BadNormal { contact_idx: 3, .. }));
    let mut bad = six();
    bad[4].mu = f64::NAN;
    let error = grasp_quality(&bad, &unit_options()).unwrap_err();
    assert!(matches!(error, QualityError::BadFriction { contact_idx: 4, .. }));
    let smooth = QualityOptions {
        cone: ConeShape::Smooth,
        volume: true,
        ..unit_options()
    };
    assert_eq!(
        grasp_quality(&six(), &smooth).unwrap_err().to_string(),
        "the volume needs cones with edges and sampled limit surfaces; give `cone` a number of edges"
    );
}
