//! Smallest boxes, hull included, of the bundled objects, and of the shared ones where those are present.
//!
//! `cargo bench -p prehend-benches --bench boxes`; `benches/peers/boxes.py` times other programs on the same files.

use std::fs;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Point3;
use prehend::geometry::{MeshFormat, convex_hull, minimum_volume_box, read_mesh};

/// Names and vertices of all mesh files below a folder, in order; none where it is absent.
fn clouds(folder: &Path) -> Vec<(String, Vec<Point3<f64>>)> {
    let mut found = Vec::new();
    let mut paths: Vec<PathBuf> =
        fs::read_dir(folder).map_or_else(|_| Vec::new(), |dir| dir.flatten().map(|e| e.path()).collect());
    paths.sort();
    for path in paths {
        if path.is_dir() {
            found.extend(clouds(&path));
        } else if let Some(format) = path
            .extension()
            .and_then(|e| e.to_str())
            .and_then(MeshFormat::from_extension)
        {
            let mesh = read_mesh(&fs::read(&path).expect("a readable file"), format).expect("a sound mesh");
            let name = path
                .file_stem()
                .map_or_else(String::new, |s| s.to_string_lossy().into_owned());
            found.push((name, mesh.vertices().to_vec()));
        }
    }
    found
}

fn boxes(c: &mut Criterion) {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let mut all = clouds(&root.join("objects"));
    all.extend(clouds(&root.join("../shared/data/objects")));
    let mut group = c.benchmark_group("minimum_volume_box");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(300));
    for (name, points) in &all {
        group.bench_function(name, |b| b.iter(|| minimum_volume_box(black_box(points))));
    }
    group.finish();
    let mut group = c.benchmark_group("convex_hull");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(300));
    for (name, points) in all
        .iter()
        .filter(|(name, _)| name == "coffee_mug" || name.starts_with("lpsb"))
    {
        group.bench_function(name, |b| b.iter(|| convex_hull(black_box(points))));
    }
    group.finish();
}

criterion_group!(benches, boxes);
criterion_main!(benches);
