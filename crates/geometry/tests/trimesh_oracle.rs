//! What trimesh finds of the bundled and the shared objects (`oracle/meshes.py`).

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use prehend_geometry::{
    MeshFormat, VolumeMethod, convex_hull, enclosed_volume, inspect, minimum_volume_box, read_mesh, repair,
    surface_area,
};
use serde::Deserialize;

#[derive(Deserialize)]
struct Oracle {
    objects: BTreeMap<String, Facts>,
}

/// In the file's unit.
#[derive(Deserialize)]
struct Facts {
    vertices: usize,
    triangles: usize,
    merged: usize,
    watertight: bool,
    consistent: bool,
    volume: f64,
    area: f64,
    hull: f64,
    #[serde(rename = "box")]
    smallest_box: f64,
}

/// The mesh files one folder below a folder, in order; none where it is absent.
fn mesh_files(folder: &Path) -> Vec<PathBuf> {
    let below = |folder: &Path| -> Vec<PathBuf> {
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        entries.map(|entry| entry.path()).collect()
    };
    let mut files: Vec<_> = below(folder).iter().flat_map(|kind| below(kind)).collect();
    files.retain(|path| format_of(path).is_some());
    files.sort();
    files
}

fn format_of(path: &Path) -> Option<MeshFormat> {
    MeshFormat::from_extension(path.extension()?.to_str()?)
}

fn close(found: f64, expected: f64, tolerance: f64) -> bool {
    (found - expected).abs() <= tolerance * expected.abs()
}

fn check(files: &[PathBuf]) {
    let oracle: Oracle = serde_json::from_str(include_str!("oracle/meshes.json")).unwrap();
    for path in files {
        let name = path.file_name().unwrap().to_string_lossy();
        let facts = oracle.objects.get(&*name);
        let facts = facts.unwrap_or_else(|| panic!("{name}: run oracle/meshes.py again"));
        let mesh = read_mesh(&fs::read(path).unwrap(), format_of(path).unwrap()).unwrap();
        assert_eq!(mesh.n_triangles(), facts.triangles, "{name}");
        // A vertex counts once for each texture coordinate there; only the YCB scans have those.
        if !name.starts_with("ycb") {
            assert_eq!(mesh.vertices().len(), facts.vertices, "{name}");
        }
        assert_eq!(inspect(&mesh).watertight, facts.watertight, "{name}");
        assert!(close(surface_area(&mesh), facts.area, 1e-9), "{name}: area");
        let hull = convex_hull(mesh.vertices()).unwrap().volume();
        assert!(close(hull, facts.hull, 1e-9), "{name}: {hull} {}", facts.hull);
        let smallest = minimum_volume_box(mesh.vertices()).unwrap().volume();
        // Boxes within 5e-7 of the least volume count as equal.
        assert!(smallest <= facts.smallest_box * (1.0 + 1e-6), "{name}: box");

        let (mended, _) = repair(mesh);
        assert_eq!(mended.vertices().len(), facts.merged, "{name}");
        let inside = enclosed_volume(&mended);
        let is_closed = facts.watertight && facts.consistent;
        assert_eq!(inside.method == VolumeMethod::SignedVolume, is_closed, "{name}");
        if is_closed {
            assert!(
                close(inside.volume, facts.volume.abs(), 1e-9),
                "{name}: {} {}",
                inside.volume,
                facts.volume
            );
        }
    }
}

#[test]
fn bundled_objects_have_the_figures_that_trimesh_finds() {
    let files = mesh_files(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../objects")));
    assert_eq!(files.len(), 25);
    check(&files);
}

#[test]
fn shared_objects_have_the_figures_that_trimesh_finds() {
    let files = mesh_files(Path::new(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../../shared/data/objects"
    )));
    if files.is_empty() {
        eprintln!("skipped: trimesh's figures of the shared objects needs ../shared/data");
        return;
    }
    assert_eq!(files.len(), 26);
    check(&files);
}
