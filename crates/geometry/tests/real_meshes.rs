//! Real meshes of objects and hands load with the counts that another program found.

use std::fs;
use std::path::{Path, PathBuf};

use prehend_geometry::{
    GeometryError, MeshFormat, inspect, mass_properties, read_mesh, repair, signed_volume,
};

fn data() -> Option<PathBuf> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data"));
    if folder.is_dir() {
        return Some(folder.to_owned());
    }
    eprintln!("skipped: real meshes needs ../shared/data");
    None
}

fn format_of(path: &Path) -> Option<MeshFormat> {
    MeshFormat::from_extension(path.extension()?.to_str()?)
}

/// All mesh files below a folder, in order.
fn meshes(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(meshes(&path));
        } else if format_of(&path).is_some() {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// `objects.csv` was counted with trimesh 5.2, vertices and triangles as in the file.
#[test]
fn every_object_loads_with_the_counts_of_its_table() {
    let Some(data) = data() else { return };
    let table = fs::read_to_string(data.join("objects.csv")).unwrap();
    let mut rows = table.lines();
    let names: Vec<&str> = rows.next().unwrap().split(',').collect();
    let column = |name: &str| names.iter().position(|n| *n == name).unwrap();
    let mut n_objects = 0;
    for row in rows {
        let cells: Vec<&str> = row.split(',').collect();
        let path = data.join(cells[column("file")]);
        let mesh = read_mesh(&fs::read(&path).unwrap(), format_of(&path).unwrap()).unwrap();
        let file = path.display();
        assert_eq!(
            mesh.n_triangles().to_string(),
            cells[column("triangles")],
            "{file}"
        );
        // The table counts a vertex once per texture coordinate; only the YCB scans have those.
        if !cells[column("file")].contains("ycb") {
            assert_eq!(
                mesh.vertices().len().to_string(),
                cells[column("vertices")],
                "{file}"
            );
        }
        let closed = cells[column("watertight_after_merge")] == "yes";
        assert_eq!(inspect(&mesh).watertight, closed, "{file}");
        let (repaired, _) = repair(mesh);
        let report = inspect(&repaired);
        assert_eq!(report.inconsistent_edges, 0, "{file}");
        assert!(signed_volume(&repaired) > 0.0, "{file}");
        assert!(
            mass_properties(&repaired)
                .center_of_mass
                .iter()
                .all(|c| c.is_finite()),
            "{file}"
        );
        n_objects += 1;
    }
    assert_eq!(n_objects, 26);
}

#[test]
fn every_mesh_of_a_hand_loads() {
    let Some(data) = data() else { return };
    let files = meshes(&data.join("hands"));
    for path in &files {
        let mesh = read_mesh(&fs::read(path).unwrap(), format_of(path).unwrap());
        if let Err(error @ GeometryError::NotBuilt { .. }) = &mesh {
            eprintln!("skipped: {}: {error}", path.display());
            continue;
        }
        assert!(mesh.is_ok(), "{}: {}", path.display(), mesh.unwrap_err());
    }
    assert!(files.len() >= 23, "found {}", files.len());
}
