//! The smallest box around the bundled mug, beside the box along its frame: `cargo run --example mvbb_of_a_mug`.

use std::error::Error;

use nalgebra::{Point3, UnitQuaternion, Vector3};
use prehend_geometry::{MeshFormat, convex_hull, minimum_volume_box, read_mesh};

fn main() -> Result<(), Box<dyn Error>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../objects/mug/coffee_mug.ply");
    let mesh = read_mesh(&std::fs::read(path)?, MeshFormat::Ply)?;
    let hull = convex_hull(mesh.vertices())?;
    println!(
        "{} points, {} corners of the hull",
        mesh.vertices().len(),
        hull.points().len()
    );

    // However the mug lies, its smallest box has the same size.
    for degrees in [0.0_f64, 10.0, 37.0, 80.0] {
        let turn =
            UnitQuaternion::from_scaled_axis(Vector3::new(1.0, 2.0, 0.5).normalize() * degrees.to_radians());
        let lying: Vec<Point3<f64>> = mesh.vertices().iter().map(|p| turn * p).collect();
        let smallest = minimum_volume_box(&lying)?;
        let mut low = lying[0];
        let mut high = lying[0];
        for p in &lying {
            low = low.inf(p);
            high = high.sup(p);
        }
        let [x, y, z]: [f64; 3] = (smallest.extents * 1000.0).into();
        println!(
            "turned by {degrees:2}°: {x:.1} × {y:.1} × {z:.1} mm, {:.4} l; along the frame {:.4} l; the hull fills {:.0} %",
            smallest.volume() * 1000.0,
            (high - low).product() * 1000.0,
            100.0 * hull.volume() / smallest.volume(),
        );
    }
    Ok(())
}
