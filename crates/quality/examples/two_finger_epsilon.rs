//! Two fingertips pinch a 40 mm cube: what torsion and friction buy.
//!
//! Run with `cargo run -p prehend-quality --example two_finger_epsilon`.

use nalgebra::{Point3, Vector3};
use prehend_quality::{
    Contact, Material, QualityError, QualityOptions, friction_coefficient, grasp_quality,
    soft_torsion_default,
};

fn main() -> Result<(), QualityError> {
    let half = 0.02;
    let torque_scale = half * 3.0_f64.sqrt();
    let options = QualityOptions {
        volume: true,
        ..QualityOptions::new(Point3::origin(), torque_scale)
    };
    println!(
        "{:8} {:>5} {:>8} {:>8} {:>4} {:>14} {:>10}",
        "fingers", "mu", "torsion", "epsilon", "rank", "force closure", "volume"
    );
    for finger in [Material::Plastic, Material::Rubber] {
        let mu = friction_coefficient(finger, Material::Wood);
        let torsion = if finger.is_soft() {
            soft_torsion_default()
        } else {
            0.0
        };
        let left = Contact::new(0, Point3::new(-half, 0.0, 0.0), Vector3::x(), mu, torsion)?;
        let right = Contact::new(1, Point3::new(half, 0.0, 0.0), -Vector3::x(), mu, torsion)?;
        let q = grasp_quality(&[left, right], &options)?;
        println!(
            "{:8} {mu:5.2} {torsion:8.5} {:8.5} {:4} {:>14} {:10.3e}",
            finger.name(),
            q.epsilon,
            q.rank,
            if q.force_closure { "yes" } else { "no" },
            q.volume.unwrap_or(0.0)
        );
        // Two hard points leave the turn about their line free; torsion takes it away.
        assert_eq!(q.force_closure, finger.is_soft());
    }
    Ok(())
}
