//! Microseconds per grasp, for random contacts on a ball (μ 0.5): ε alone, and everything that `grasp_quality` answers.
//!
//! Run with `cargo run --release -p prehend-quality --example epsilon_speed`.
#![expect(
    clippy::disallowed_methods,
    reason = "the clock is what this example is about"
)]

use std::time::Instant;

use nalgebra::{Point3, Vector3};
use prehend_quality::{
    Contact, EpsilonSolver, GraspWrenchSpace, QualityError, QualityOptions, grasp_quality_with,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn main() -> Result<(), QualityError> {
    println!(
        "{:>8} {:>5} {:>6} {:>9} {:>9} {:>9} {:>9}",
        "contacts", "edges", "held %", "ε held", "ε loose", "all held", "all loose"
    );
    for (n_contacts, cone_edges) in [(3, 8), (4, 8), (6, 8), (8, 8), (12, 8), (20, 8), (8, 32)] {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let mut solver = EpsilonSolver::default();
        let options = QualityOptions {
            cone_edges,
            ..QualityOptions::new(Point3::origin(), 0.05)
        };
        // Seconds and grasps, loose and held.
        let mut tally = [(0.0, 0.0, 0_u32); 2];
        for _ in 0..300 {
            let contacts: Vec<Contact> = (0..n_contacts)
                .map(|i| {
                    let z: f64 = rng.random_range(-1.0..1.0);
                    let turn: f64 = rng.random_range(0.0..std::f64::consts::TAU);
                    let r = (1.0 - z * z).sqrt();
                    let out = Vector3::new(r * turn.cos(), r * turn.sin(), z);
                    Contact::new(i, Point3::from(0.05 * out), -out, 0.5, 0.0)
                })
                .collect::<Result<_, _>>()?;
            let begin = Instant::now();
            let space = GraspWrenchSpace::new(&contacts, &options)?;
            let epsilon = solver.epsilon(&space)?;
            let middle = Instant::now();
            grasp_quality_with(&contacts, &options, &mut solver)?;
            let (only, all, count) = &mut tally[usize::from(epsilon > 0.0)];
            *only += (middle - begin).as_secs_f64();
            *all += middle.elapsed().as_secs_f64();
            *count += 1;
        }
        let [loose, held] = tally.map(|(only, all, count)| {
            let per_grasp = 1e6 / f64::from(count.max(1));
            (only * per_grasp, all * per_grasp, count)
        });
        println!(
            "{n_contacts:8} {cone_edges:5} {:6} {:9.1} {:9.1} {:9.1} {:9.1}",
            held.2 / 3,
            held.0,
            loose.0,
            held.1,
            loose.1
        );
    }
    Ok(())
}
