//! What the crate can tell about a mesh: a cube read from OFF text, turned inside out by hand, mended and measured.
//!
//! `cargo run -p prehend-geometry --example mesh_facts`

use nalgebra::Vector3;
use prehend_geometry::{
    GeometryError, MeshFormat, OrientedBox, Tetrahedron, inspect, mass_properties, read_mesh, repair,
    surface_area,
};

/// A cube with edges of 0.1 m from the origin on, its faces wound inwards, one of them missing.
const CUBE: &str = "OFF
8 5 0
0 0 0
0.1 0 0
0.1 0.1 0
0 0.1 0
0 0 0.1
0.1 0 0.1
0.1 0.1 0.1
0 0.1 0.1
4 0 1 2 3
4 0 4 5 1
4 1 5 6 2
4 2 6 7 3
4 3 7 4 0
";

fn main() -> Result<(), GeometryError> {
    let open = read_mesh(CUBE.as_bytes(), MeshFormat::Off)?;
    let report = inspect(&open);
    println!(
        "as read: {} hole, perimeter {:.1} m, area {:.2} m²",
        report.n_holes, report.holes[0].perimeter, report.holes[0].area
    );

    let closed = CUBE.replace("8 5 0", "8 6 0") + "4 4 7 6 5\n";
    let (mesh, repairs) = repair(read_mesh(closed.as_bytes(), MeshFormat::Off)?);
    let mass = mass_properties(&mesh);
    println!(
        "closed: watertight {}, parts turned {}",
        inspect(&mesh).watertight,
        repairs.inverted
    );
    println!("volume {:.4} m³, area {:.2} m²", mass.volume, surface_area(&mesh));
    println!("centre of mass {:.3}", mass.center_of_mass);

    let cube = OrientedBox::centered([0.1; 3]);
    let corner = cube.min_corner();
    let enclosure = Tetrahedron([
        corner,
        corner + Vector3::x() * 0.2,
        corner + Vector3::y() * 0.2,
        corner + Vector3::z() * 0.2,
    ]);
    // Twice the corner tetrahedron leaves out a sixth of the cube, at the far corner.
    println!(
        "share of the cube in a tetrahedron: {:.6}",
        enclosure.intersection_volume(&cube) / cube.volume()
    );
    Ok(())
}
