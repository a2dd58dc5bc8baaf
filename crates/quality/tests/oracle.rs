//! Against Qhull and NNLS by way of SciPy: see `tests/oracle/hulls.py`.

use nalgebra::{Point3, Vector3};
use prehend_quality::{
    ConeShape, Contact, EpsilonSolver, GraspWrenchSpace, LengthUnit, Norm, QualityOptions, TaskWrenches,
    Wrench, WrenchAxes, WrenchMetric, grasp_quality, grasp_quality_with,
};
use serde::Deserialize;

#[derive(Deserialize)]
struct Oracle {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    center: [f64; 3],
    torque_scale: f64,
    cone_edges: usize,
    norm: Norm,
    length_unit: LengthUnit,
    axes: String,
    semi_axes: [f64; 6],
    gravity: [f64; 3],
    task: Vec<[f64; 6]>,
    /// Point, normal, friction coefficient, torsion length.
    contacts: Vec<[f64; 8]>,
    rank: usize,
    epsilon: f64,
    force_closure: bool,
    origin_distance: f64,
    volume: f64,
    task_scale: Option<f64>,
}

impl Case {
    fn question(&self) -> (Vec<Contact>, QualityOptions) {
        let contact = |(i, c): (usize, &[f64; 8])| {
            let [px, py, pz, nx, ny, nz, mu, torsion] = *c;
            Contact::new(i, Point3::new(px, py, pz), Vector3::new(nx, ny, nz), mu, torsion).unwrap()
        };
        let mut counts = [false; 6];
        for (counts, letter) in counts.iter_mut().zip(self.axes.chars()) {
            *counts = letter == 'x';
        }
        let options = QualityOptions {
            cone: ConeShape::Edges(self.cone_edges),
            norm: self.norm,
            length_unit: self.length_unit,
            gravity: self.gravity.into(),
            axes: WrenchAxes::new(counts).unwrap(),
            metric: Some(WrenchMetric::from_semi_axes(self.semi_axes).unwrap()),
            volume: self.contacts.len() <= 6,
            ..QualityOptions::new(Point3::from(self.center), self.torque_scale)
        };
        (self.contacts.iter().enumerate().map(contact).collect(), options)
    }
}

fn cases() -> Vec<Case> {
    serde_json::from_str::<Oracle>(include_str!("oracle/hulls.json"))
        .unwrap()
        .cases
}

#[test]
fn epsilon_distance_rank_and_volume_agree_with_qhull_and_nnls() {
    let cases = cases();
    assert!(cases.len() >= 500);
    assert!(cases.iter().filter(|c| c.force_closure).count() >= 240);
    let mut solver = EpsilonSolver::default();
    for case in &cases {
        let (contacts, options) = case.question();
        let quality = grasp_quality_with(&contacts, &options, &mut solver).unwrap();
        let name = &case.name;
        assert_eq!(
            quality.force_closure, case.force_closure,
            "{name}: {} {}",
            quality.epsilon, case.epsilon
        );
        // Qhull's own planes are good to about 1e-12; `QJ1e-13` cases to a little less.
        assert!(
            (quality.epsilon - case.epsilon).abs() < 1e-11,
            "{name}: epsilon {} {}",
            quality.epsilon,
            case.epsilon
        );
        assert_eq!(quality.rank, case.rank, "{name}: rank");
        // NNLS with a penalty row is good to about 1e-8.
        assert!(
            (quality.origin_distance - case.origin_distance).abs() < 1e-7,
            "{name}: distance {} {}",
            quality.origin_distance,
            case.origin_distance
        );
        if let Some(volume) = quality.volume {
            assert!(
                (volume - case.volume).abs() <= 1e-8 * case.volume,
                "{name}: volume {volume} {}",
                case.volume
            );
        }
    }
}

#[test]
fn a_kept_solver_answers_as_a_new_one() {
    let mut solver = EpsilonSolver::default();
    for case in cases() {
        let (contacts, options) = case.question();
        let options = QualityOptions {
            volume: false,
            ..options
        };
        let kept = grasp_quality_with(&contacts, &options, &mut solver).unwrap();
        assert_eq!(kept, grasp_quality(&contacts, &options).unwrap(), "{}", case.name);
    }
}

#[test]
fn task_scales_agree_with_linear_programs() {
    let mut n_tasks = 0;
    for case in cases() {
        let Some(expected) = case.task_scale else {
            continue;
        };
        let (contacts, options) = case.question();
        let space = GraspWrenchSpace::new(&contacts, &options).unwrap();
        let task = TaskWrenches::new(case.task.iter().map(|t| Wrench::from(*t)).collect()).unwrap();
        let found = task.scale(&space).scale;
        // HiGHS keeps its constraints to 1e-7.
        assert!(
            (found - expected).abs() < 1e-6,
            "{}: {found} {expected}",
            case.name
        );
        n_tasks += 1;
    }
    assert!(n_tasks >= 40);
}
