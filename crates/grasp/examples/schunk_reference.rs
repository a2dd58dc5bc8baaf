//! The Schunk hand at the faces of six objects' boxes, as GraspIt! was asked: which closings hold, and how well?
//!
//! 6 faces × 4 rolls × 4 spreads × 4 postures of the fingers, the palm's axis through the face's middle, from 300 mm
//! outside; the vendor's visual meshes as shape. `docs/grasps.md` has the table beside GraspIt!'s.
//!
//! `cargo run --release -p prehend-grasp --example schunk_reference 1` asks for every try, which takes minutes; without a
//! number every 31st is made.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion};
use prehend_geometry::{DecomposeOptions, MeshFormat, decompose, read_mesh, repair};
use prehend_grasp::{CloseOptions, Face, GraspObject, ReadyHand};
use prehend_hand::Hand;
use prehend_quality::Material;
use rayon::prelude::*;

/// Mesh, metres per unit, GraspIt!'s share of force closure, its quantiles of ε (5, 25, 50, 75, 95 %).
const OBJECTS: [(&str, f64, f64, [f64; 5]); 6] = [
    (
        "mug/ycb_025_mug.obj",
        1.0,
        0.656,
        [0.050, 0.145, 0.260, 0.374, 0.510],
    ),
    (
        "hammer/ycb_048_hammer.obj",
        1.0,
        0.276,
        [0.003, 0.008, 0.021, 0.036, 0.052],
    ),
    (
        "screwdriver/ycb_044_flat_screwdriver.obj",
        1.0,
        0.312,
        [0.005, 0.025, 0.045, 0.060, 0.093],
    ),
    (
        "bottle/ycb_006_mustard_bottle.obj",
        1.0,
        0.536,
        [0.007, 0.064, 0.109, 0.163, 0.274],
    ),
    (
        "mug/psb_m504.obj",
        0.140_46,
        0.654,
        [0.037, 0.110, 0.200, 0.312, 0.456],
    ),
    (
        "glass/pr_glass.stl",
        1.0,
        0.570,
        [0.017, 0.054, 0.156, 0.226, 0.413],
    ),
];
const SPREADS: [f64; 4] = [0.0, 0.4, 0.8, 1.57];
const FINGERS: [[f64; 2]; 4] = [[0.0, 0.0], [-0.4, 0.2], [-0.79, 0.79], [-1.2, 0.9]];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let shared = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data"));
    if !shared.is_dir() {
        eprintln!("skipped: the Schunk hand beside GraspIt! needs ../shared/data");
        return Ok(());
    }
    // 31 and 4 share no factor, so that what is left out is spread over faces, rolls, spreads and fingers.
    let every: usize = std::env::args().nth(1).map_or(Ok(31), |n| n.parse())?;
    let folder = shared.join("hands/schunk_sdh");
    let urdf = std::fs::read_to_string(folder.join("schunk_sdh.urdf"))?;
    let urdf = urdf
        .replace("collision>", "unused>")
        .replace("visual>", "collision>");
    let resolve = |file: &str| std::fs::read(folder.join(file)).map_err(|e| e.to_string());
    let hand =
        Hand::from_urdf(&urdf, &resolve)?.with_description(include_str!("../tests/schunk_sdh_hand.toml"))?;
    let ready = ReadyHand::new(&hand)?;
    println!(
        "object                      FC  GraspIt!   epsilon at 5, 25, 50, 75, 95 % (GraspIt!)   contacts   not closed"
    );
    for (file, scale, share, quantiles) in OBJECTS {
        let path = shared.join("objects").join(file);
        let format =
            MeshFormat::from_extension(path.extension().and_then(|e| e.to_str()).unwrap_or_default());
        let mesh = read_mesh(&std::fs::read(&path)?, format.ok_or("an unknown format")?)?.scaled(scale);
        let (mesh, _) = repair(mesh);
        let boxes = decompose(&mesh, &DecomposeOptions::default())?;
        let object = GraspObject::new(mesh, &boxes, None, Material::Plastic)?;
        let tries: Vec<[usize; 4]> = (0..6 * 4 * 4 * 4)
            .step_by(every.max(1))
            .map(|i| [i / 64, i / 16 % 4, i / 4 % 4, i % 4])
            .collect();
        let closed: Vec<_> = tries
            .par_iter()
            .map(|&[face, roll, spread, fingers]| {
                let face = Face::of(object.root(), face);
                let x = face.edges[roll % 2] * if roll >= 2 { -1.0 } else { 1.0 };
                let z = -face.normal;
                let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
                let start = Isometry3::from_parts(
                    (face.center + face.normal * 0.3).into(),
                    UnitQuaternion::from_rotation_matrix(&axes),
                );
                let mut joints = BTreeMap::from([("sdh_knuckle_joint".to_owned(), SPREADS[spread])]);
                for (number, value) in [2, 3].into_iter().zip(FINGERS[fingers]) {
                    joints.extend(
                        ["finger_1", "finger_2", "thumb_"].map(|f| (format!("sdh_{f}{number}_joint"), value)),
                    );
                }
                let options = CloseOptions {
                    approach: true,
                    ..CloseOptions::default()
                };
                ready.close(
                    &object,
                    &start,
                    &hand.positions(&joints).expect("within limits"),
                    &options,
                )
            })
            .collect::<Result<_, _>>()?;
        let held: Vec<_> = closed.iter().filter(|c| c.reason.is_none()).collect();
        let mut epsilons: Vec<f64> = held.iter().map(|c| c.epsilon).collect();
        epsilons.sort_by(f64::total_cmp);
        let at = |q: f64| {
            epsilons
                .get((q * epsilons.len() as f64) as usize)
                .copied()
                .unwrap_or(0.0)
        };
        let ours = [0.05, 0.25, 0.5, 0.75, 0.95]
            .map(|q| format!("{:.3}", at(q)))
            .join(" ");
        let theirs = quantiles.map(|q| format!("{q:.3}")).join(" ");
        let mut reasons: BTreeMap<&str, usize> = BTreeMap::new();
        for reason in closed.iter().filter_map(|c| c.reason) {
            *reasons.entry(reason.name()).or_insert(0) += 1;
        }
        println!(
            "{:26} {:.3} {share:.3}   {ours} ({theirs})   {:.1}   {reasons:?}",
            file.split('/').next_back().unwrap_or(file),
            held.len() as f64 / closed.len() as f64,
            held.iter().map(|c| c.contacts.len()).sum::<usize>() as f64 / held.len().max(1) as f64,
        );
    }
    Ok(())
}
