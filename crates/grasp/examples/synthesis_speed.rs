//! How many tries a second, and what becomes of them: every bundled hand on every bundled object.
//!
//! `cargo run --release -p prehend-grasp --example synthesis_speed [TRIES] [HAND] [OBJECT]`
#![allow(clippy::disallowed_methods, reason = "an example that measures time")]

use std::path::{Path, PathBuf};
use std::time::Instant;

use prehend_geometry::{DecomposeOptions, MeshFormat, decompose, read_mesh};
use prehend_grasp::{GraspObject, SynthesisOptions, synthesize};
use prehend_hand::Hand;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let argument = |n: usize| std::env::args().nth(n).unwrap_or_default();
    let tries = std::env::args().nth(1).map_or(Ok(600), |n| n.parse())?;
    let wanted = |name: &str, n: usize| argument(n).is_empty() || argument(n) == name;
    let top = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for hand_folder in sorted(&top.join("hands"))? {
        let name = hand_folder
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if !wanted(&name, 2) {
            continue;
        }
        let urdf = std::fs::read_to_string(hand_folder.join(format!("{name}.urdf")))?;
        let hand = Hand::from_urdf(&urdf, &|file| Err(format!("{file} is not at hand")))?
            .with_description(&std::fs::read_to_string(hand_folder.join("hand.toml"))?)?;
        for file in sorted(&top.join("objects"))?
            .iter()
            .flat_map(|f| sorted(f).unwrap_or_default())
        {
            let stem = file.file_stem().unwrap_or_default().to_string_lossy();
            if file.extension().is_none_or(|e| e != "ply") || !wanted(&stem, 3) {
                continue;
            }
            let mesh = read_mesh(&std::fs::read(&file)?, MeshFormat::Ply)?;
            let start = Instant::now();
            let boxes = decompose(&mesh, &DecomposeOptions::default())?;
            let text = std::fs::read_to_string(file.with_extension("toml"))?;
            let material = text
                .lines()
                .find_map(|l| l.strip_prefix("material = "))
                .unwrap_or("\"plastic\"");
            let material = material.trim_matches('"').parse()?;
            let n_triangles = mesh.n_triangles();
            let object = GraspObject::new(mesh, &boxes, None, material)?;
            let ready = start.elapsed().as_secs_f64();
            let start = Instant::now();
            let options = SynthesisOptions {
                tries,
                ..SynthesisOptions::default()
            };
            let found = synthesize(&hand, &object, &options, &|_| true)?;
            let seconds = start.elapsed().as_secs_f64();
            let mut eps: Vec<f64> = found.grasps.iter().map(|g| g.features.qeps).collect();
            eps.sort_by(f64::total_cmp);
            let quantile = |q: f64| eps.get((q * eps.len() as f64) as usize).copied().unwrap_or(0.0);
            let contacts =
                found.grasps.iter().map(|g| g.contacts.len()).sum::<usize>() as f64 / eps.len().max(1) as f64;
            println!(
                "{name} {}: {n_triangles} triangles, ready in {ready:.2} s, {} hypotheses, {:.0} tries/s, kept {}/{}, eps {:.3} {:.3} {:.3}, {contacts:.1} contacts, {:?}",
                stem,
                found.n_hypotheses,
                found.tried as f64 / seconds,
                eps.len(),
                found.tried,
                quantile(0.05),
                quantile(0.5),
                quantile(0.95),
                found.rejected,
            );
        }
    }
    Ok(())
}

fn sorted(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut found = std::fs::read_dir(folder)?
        .map(|e| e.map(|e| e.path()))
        .collect::<Result<Vec<_>, _>>()?;
    found.sort();
    Ok(found)
}
