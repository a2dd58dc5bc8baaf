//! Microseconds per grasp, for random contacts on a ball (μ 0.5): ε alone, and everything that `grasp_quality` answers.
//!
//! Run with `cargo run --release -p prehend-quality --example epsilon_speed`.
#![expect(
    clippy::disallowed_methods,
    reason = "the clock is what this example is about"
)]

use std::time::Instant;

use nalgebra::{Point3, Vector3};
use prehend_quality::{ConeShape, Contact, EpsilonSolver, QualityError, QualityOptions, grasp_quality_with};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn main() -> Result<(), QualityError> {
    println!("median µs    contacts  cone          held %    ε held   ε loose  all held all loose");
    let mut solver = EpsilonSolver::default();
    for (n_contacts, cone) in [3, 4, 8, 12, 16, 20]
        .map(|n| (n, ConeShape::Edges(8)))
        .into_iter()
        .chain([
            (8, ConeShape::Edges(32)),
            (4, ConeShape::Smooth),
            (8, ConeShape::Smooth),
        ])
    {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let options = QualityOptions {
            cone,
            ..QualityOptions::new(Point3::origin(), 0.05)
        };
        let (mut only, mut all) = ([vec![], vec![]], [vec![], vec![]]);
        for _ in 0..200 {
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
            let held = usize::from(solver.epsilon_of(&contacts, &options)? > 0.0);
            only[held].push(begin.elapsed());
            let begin = Instant::now();
            grasp_quality_with(&contacts, &options, &mut solver)?;
            all[held].push(begin.elapsed());
        }
        let held = only[1].len() / 2;
        let [a, b, c, d] = [&only[1], &only[0], &all[1], &all[0]].map(|times| {
            let mut times = times.clone();
            times.sort();
            times
                .get(times.len() / 2)
                .map_or(f64::NAN, |t| 1e6 * t.as_secs_f64())
        });
        println!(
            "{:12} {n_contacts:8}  {:12} {held:7} {a:9.1} {b:9.1} {c:9.1} {d:9.1}",
            "",
            format!("{cone:?}")
        );
    }
    Ok(())
}
