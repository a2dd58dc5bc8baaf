//! Against Qhull and NNLS by way of SciPy: see `tests/oracle/hulls.py`.

use nalgebra::Point3;
use prehend_quality::{
    ConeShape, Contact, EpsilonSolver, LengthUnit, Norm, QualityOptions, grasp_quality, grasp_quality_with,
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
    contacts: Vec<OracleContact>,
    rank: usize,
    epsilon: f64,
    force_closure: bool,
    origin_distance: f64,
    volume: f64,
}

#[derive(Deserialize)]
struct OracleContact {
    point: [f64; 3],
    normal: [f64; 3],
    mu: f64,
    torsion: f64,
}

impl Case {
    fn question(&self) -> (Vec<Contact>, QualityOptions) {
        let contact = |(i, c): (usize, &OracleContact)| {
            Contact::new(i, c.point.into(), c.normal.into(), c.mu, c.torsion).unwrap()
        };
        let options = QualityOptions {
            cone: ConeShape::Edges(self.cone_edges),
            norm: self.norm,
            length_unit: self.length_unit,
            volume: true,
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
    assert!(cases.len() >= 200);
    assert!(cases.iter().filter(|c| c.force_closure).count() >= 100);
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
        let volume = quality.volume.unwrap();
        assert!(
            (volume - case.volume).abs() <= 1e-8 * case.volume,
            "{name}: volume {volume} {}",
            case.volume
        );
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
