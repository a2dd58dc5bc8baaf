//! What the decomposition does with meshes of real objects; needs `../shared/data`.

use std::path::{Path, PathBuf};

use prehend_geometry::{DecomposeOptions, MeshFormat, TriMesh, decompose, read_mesh};

const OBJECTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/objects");

/// All meshes below a folder, sorted, scaled to metres as the file beside each says.
fn objects() -> Vec<(String, TriMesh)> {
    let mut paths: Vec<PathBuf> = Vec::new();
    for folder in std::fs::read_dir(OBJECTS).into_iter().flatten().flatten() {
        paths.extend(
            std::fs::read_dir(folder.path())
                .into_iter()
                .flatten()
                .flatten()
                .map(|entry| entry.path()),
        );
    }
    paths.sort();
    paths
        .iter()
        .filter_map(|path| Some((name(path), mesh(path)?)))
        .collect()
}

fn name(path: &Path) -> String {
    let kind = path
        .parent()
        .and_then(Path::file_name)
        .unwrap_or_default()
        .to_string_lossy();
    format!(
        "{kind}/{}",
        path.file_stem().unwrap_or_default().to_string_lossy()
    )
}

fn mesh(path: &Path) -> Option<TriMesh> {
    let format = MeshFormat::from_extension(path.extension()?.to_str()?)?;
    let mesh = read_mesh(&std::fs::read(path).ok()?, format).ok()?;
    let notes = std::fs::read_to_string(path.with_extension("toml")).ok()?;
    let scale = notes
        .lines()
        .find_map(|line| line.strip_prefix("metres_per_unit = "))?;
    Some(mesh.scaled(scale.trim().parse().ok()?))
}

#[test]
#[allow(
    clippy::disallowed_methods,
    reason = "times are printed, nothing depends on them"
)]
fn real_objects_become_a_few_boxes() {
    let objects = objects();
    if objects.is_empty() {
        eprintln!("skipped: decomposition of real objects needs ../shared/data");
        return;
    }
    for (name, mesh) in objects {
        let start = std::time::Instant::now();
        let decomposition = decompose(&mesh, &DecomposeOptions::default()).unwrap();
        let ms = start.elapsed().as_secs_f64() * 1e3;
        let n = decomposition.boxes.len();
        let [x, y, z]: [f64; 3] = decomposition.root.extents().into();
        println!(
            "{name:40} {:6} triangles  {n:2} boxes  cvex {:6.3}  {x:.4} {y:.4} {z:.4}  {ms:6.1} ms",
            mesh.n_triangles(),
            decomposition.cvex
        );
        assert!(decomposition.cvex >= 1.0);
        assert!((n as f64) <= 1.0 + decomposition.cvex.ln() / (1.0_f64 / 0.94).ln() + 1e-9);
    }
}
