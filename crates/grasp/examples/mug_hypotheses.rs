//! Where could the Schunk hand come from to take the bundled coffee mug, and what does each box give?
//!
//! `cargo run -p prehend-grasp --example mug_hypotheses`

use std::path::Path;

use prehend_geometry::{DecomposeOptions, MeshFormat, decompose, read_mesh};
use prehend_grasp::{GraspObject, SynthesisOptions, hypotheses, synthesize};
use prehend_hand::Hand;
use prehend_quality::Material;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let top = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mesh = read_mesh(
        &std::fs::read(top.join("objects/mug/coffee_mug.ply"))?,
        MeshFormat::Ply,
    )?;
    let boxes = decompose(&mesh, &DecomposeOptions::default())?;
    let mug = GraspObject::new(mesh, &boxes, None, Material::Glass)?;
    let folder = top.join("hands/schunk_sdh");
    let hand = Hand::from_urdf(
        &std::fs::read_to_string(folder.join("schunk_sdh.urdf"))?,
        &|file| Err(format!("{file} is not at hand")),
    )?
    .with_description(&std::fs::read_to_string(folder.join("hand.toml"))?)?;

    let opening = hand.description().map_or(0.0, |d| d.opening_width);
    let all = hypotheses(&mug, opening, 0.12);
    for (i, region) in mug.regions().iter().enumerate() {
        let kind = if i < mug.leaves().len() { "leaf " } else { "inner" };
        let extents = region.oriented_box.extents() * 1e3;
        let n = all.iter().filter(|h| h.box_idx == i).count();
        println!(
            "{kind} box {i}: {:3.0} x {:3.0} x {:3.0} mm, {n:2} hypotheses",
            extents.x, extents.y, extents.z
        );
    }
    let found = synthesize(
        &hand,
        &mug,
        &SynthesisOptions {
            tries: 200,
            ..Default::default()
        },
        &|_| true,
    )?;
    println!(
        "{} of {} tries hold the mug; the others:",
        found.grasps.len(),
        found.tried
    );
    for (reason, n) in &found.rejected {
        println!("  {n:3} {reason}");
    }
    let best = found
        .grasps
        .iter()
        .max_by(|a, b| a.features.qeps.total_cmp(&b.features.qeps));
    if let Some(best) = best {
        println!(
            "the best has eps {:.3} with {} contacts",
            best.features.qeps,
            best.contacts.len()
        );
    }
    Ok(())
}
