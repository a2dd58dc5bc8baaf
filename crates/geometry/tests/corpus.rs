//! Every shape in `corpus` reads as it did before, and every file that ever broke a reader gives its error.
//!
//! The files are small, made by hand, or found by the fuzz targets (names that start with `found_`); these start from the
//! whole folder too.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use prehend_geometry::{MeshFormat, Shape, inspect, mass_properties, read_shape, repair};

fn files() -> Vec<PathBuf> {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
    let mut files: Vec<PathBuf> = fs::read_dir(corpus)
        .expect("the corpus is there")
        .flat_map(|folder| fs::read_dir(folder.unwrap().path()).into_iter().flatten())
        .map(|file| file.unwrap().path())
        .collect();
    files.sort();
    files
}

#[test]
fn the_corpus_reads_as_written_down() {
    let mut found = String::new();
    for path in files() {
        let folder = path.parent().and_then(Path::file_name).unwrap().to_string_lossy();
        let format = MeshFormat::from_extension(&folder).expect("a folder for each format");
        let line = match read_shape(&fs::read(&path).unwrap(), format) {
            Ok(Shape::Cloud(points)) => format!("cloud of {}", points.len()),
            Ok(Shape::Mesh(mesh)) => {
                let (n_vertices, n_triangles) = (mesh.vertices().len(), mesh.n_triangles());
                let (mended, _) = repair(mesh);
                let report = inspect(&mended);
                let volume = mass_properties(&mended).volume;
                format!(
                    "{n_vertices} vertices, {n_triangles} triangles, watertight {}, volume {volume:.6}",
                    report.watertight
                )
            }
            Err(error) => error.to_string(),
        };
        let name = path.file_name().unwrap().to_string_lossy();
        writeln!(found, "{folder}/{name}: {line}").unwrap();
    }
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/corpus.txt");
    if std::env::var_os("PREHEND_GOLDEN").is_some() {
        fs::write(&golden, &found).unwrap();
    }
    assert_eq!(found, fs::read_to_string(&golden).unwrap_or_default());
}
