//! A hammer of two boxes, taken apart: `cargo run -p prehend-geometry --example boxes_of_a_hammer`.
//!
//! Prints the box around the whole, the two boxes that it is made of, and cvex = 1188 / (108 + 180) ≈ 4.1.

use nalgebra::{Isometry3, Point3, Vector3};
use prehend_geometry::{DecomposeOptions, GeometryError, OrientedBox, TriMesh, decompose};

fn main() -> Result<(), GeometryError> {
    let head = OrientedBox::centered([0.12, 0.03, 0.03]);
    let handle = OrientedBox::centered([0.03, 0.02, 0.31]);
    let mut vertices: Vec<Point3<f64>> = Vec::new();
    let mut triangles = Vec::new();
    for (part, up) in [(head, 0.315), (handle, 0.155)] {
        let first = vertices.len() as u32;
        vertices.extend(part.corners().map(|corner| corner + Vector3::z() * up));
        let sides = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        for [a, b, c, d] in sides.map(|side| side.map(|corner| first + corner)) {
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    // However it lies.
    let turn = Isometry3::rotation(Vector3::new(0.3, 0.5, -0.2));
    let hammer = TriMesh::new(vertices, triangles)?.transformed(&turn);

    let found = decompose(&hammer, &DecomposeOptions::default())?;
    let print = |name: &str, b: &OrientedBox| {
        let [x, y, z]: [f64; 3] = (b.extents() * 1000.0).into();
        println!("{name}: {x:.0} × {y:.0} × {z:.0} mm, {:.0} cm³", b.volume() * 1e6);
    };
    print("whole", &found.root);
    for part in &found.boxes {
        print("part", part);
    }
    println!("cvex {:.2}", found.cvex);
    Ok(())
}
