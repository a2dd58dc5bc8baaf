//! A warm solver allocates nothing.
//!
//! The allocator remembers the most memory that was ever in use. After a reset that is what is in use now, and any
//! allocation, however short-lived, raises it. One test only, so that no other thread disturbs.

use nalgebra::{Point3, Vector3};
use peak_alloc::PeakAlloc;
use prehend_quality::{
    ConeShape, Contact, EpsilonSolver, GraspWrenchSpace, Norm, QualityOptions, WrenchAxes,
};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// `n` contacts spread over a ball by the golden angle, turned by `shift`.
fn ball(n: usize, shift: f64) -> Vec<Contact> {
    (0..n)
        .map(|i| {
            let z = 1.0 - (2 * i + 1) as f64 / n as f64;
            let turn = i as f64 * 2.399_963 + shift * (i * i) as f64;
            let r = (1.0 - z * z).sqrt();
            let out = Vector3::new(r * turn.cos(), r * turn.sin(), z);
            Contact::new(i, Point3::from(out), -out, 0.5, 0.0).unwrap()
        })
        .collect()
}

/// Bytes by which the memory in use rose, at its highest, while `work` ran.
fn rise(work: impl FnOnce()) -> usize {
    MEMORY.reset_peak_usage();
    let before = MEMORY.current_usage();
    work();
    MEMORY.peak_usage() - before
}

#[test]
fn a_warm_solver_allocates_nothing() {
    assert!(rise(|| drop(std::hint::black_box(vec![0_u8; 100]))) >= 100);

    // Two contacts do not hold, eight do.
    let grasps: Vec<Vec<Contact>> = (0..12).map(|i| ball([2, 4, 8][i % 3], 0.1 * i as f64)).collect();
    let plain = QualityOptions::new(Point3::origin(), 1.0);
    let marks = [
        [true; 6],
        [true, true, true, true, true, false],
        [true, true, true, true, false, false],
        [true, true, true, false, false, false],
        [false, true, false, true, false, false],
    ];
    let masked = marks.map(|marks| QualityOptions {
        axes: WrenchAxes::new(marks).unwrap(),
        ..plain
    });
    let smooth = QualityOptions {
        cone: ConeShape::Smooth,
        ..plain
    };
    let sum = QualityOptions {
        norm: Norm::LInf,
        ..masked[3]
    };
    for options in masked.iter().chain([&smooth, &sum]) {
        let spaces: Vec<GraspWrenchSpace> = grasps
            .iter()
            .map(|g| GraspWrenchSpace::new(g, options).unwrap())
            .collect();
        let mut solver = EpsilonSolver::default();
        let mut run = || {
            for (grasp, space) in grasps.iter().zip(&spaces) {
                let epsilon = solver.epsilon_of(grasp, options).unwrap();
                assert_eq!(epsilon, solver.epsilon(space).unwrap());
                assert!(solver.epsilon_at_least(space, 0.5 * epsilon).unwrap());
                assert!(solver.epsilon_within(space, 0.01).unwrap().upper >= epsilon - 1e-12);
            }
        };
        run();
        assert_eq!(rise(run), 0, "{options:?}");
    }
}
