//! Guessed parts beside the face labels that people gave to two scans.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use prehend::ObjectOptions;
use prehend::stages::decompose::{Shape, shape_of};

fn shared() -> Option<PathBuf> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    if data.is_dir() {
        return Some(data);
    }
    eprintln!("skipped: guessed parts beside labelled faces needs ../shared/data");
    None
}

/// Part of each face by the label file: a name, then the 1-based numbers of its faces, and so on.
fn labels(path: &Path) -> BTreeMap<String, Vec<usize>> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut parts = BTreeMap::new();
    let mut lines = text.lines().filter(|l| !l.trim().is_empty());
    while let (Some(name), Some(faces)) = (lines.next(), lines.next()) {
        let faces = faces
            .split_whitespace()
            .map(|n| n.parse::<usize>().unwrap() - 1)
            .collect();
        parts.insert(name.trim().to_owned(), faces);
    }
    parts
}

/// Shared area over joint area of the surface that the guess calls handle and the faces that people do.
fn handle_overlap(shape: &Shape, labelled: &[usize]) -> f64 {
    let mesh = &shape.object.mesh;
    let handle = &shape.object.parts.handle;
    let labelled: std::collections::BTreeSet<usize> = labelled.iter().copied().collect();
    let (mut both, mut either) = (0.0, 0.0);
    for face in 0..mesh.n_triangles() {
        let [a, b, c] = mesh.triangle(face);
        let middle = nalgebra::Point3::from((a.coords + b.coords + c.coords) / 3.0);
        let area = (b - a).cross(&(c - a)).norm() / 2.0;
        let guessed = handle.iter().any(|part| {
            let local = part.axes().inverse() * (middle - part.center());
            (0..3).all(|k| local[k].abs() <= part.extents()[k] / 2.0)
        });
        let told = labelled.contains(&face);
        both += if guessed && told { area } else { 0.0 };
        either += if guessed || told { area } else { 0.0 };
    }
    both / either
}

#[test]
fn the_guessed_handle_of_a_scanned_mug_is_the_one_that_people_labelled() {
    let Some(data) = shared() else { return };
    let mug = shape_of(&data.join("objects/mug/lpsb_27.off"), ObjectOptions::default()).unwrap();
    let told = labels(&data.join("labels/lpsb_27_labels.txt"));
    let overlap = handle_overlap(&mug, &told["handle"]);
    eprintln!(
        "handle of lpsb_27: intersection over union {overlap:.3}; {:?}",
        mug.object.notes
    );
    assert!(overlap > 0.8, "{overlap}");
}

#[test]
fn a_tumbler_has_no_handle() {
    let Some(data) = shared() else { return };
    let glass = shape_of(&data.join("objects/glass/lpsb_25.off"), ObjectOptions::default()).unwrap();
    let told = labels(&data.join("labels/lpsb_25_labels.txt"));
    assert_eq!(told.keys().collect::<Vec<_>>(), ["body"]);
    assert!(glass.object.parts.handle.is_empty(), "{:?}", glass.object.notes);
}
