//! How much of an object's boxes does a grasp enclose, and how much does it leave free?
//!
//! `cargo run -p prehend-geometry --example shared_volume`

use nalgebra::{Point3, Rotation3, Vector3};
use prehend_geometry::{GeometryError, OrientedBox, largest_tetrahedron, union_volume};

fn main() -> Result<(), GeometryError> {
    // A mug: its body, and a handle whose box reaches 2 mm into it.
    let body = OrientedBox::new(
        Point3::origin(),
        Rotation3::identity(),
        Vector3::new(0.08, 0.08, 0.1),
    )?;
    let handle = OrientedBox::new(
        Point3::new(0.053, 0.0, 0.0),
        Rotation3::identity(),
        Vector3::new(0.03, 0.012, 0.07),
    )?;
    let boxes = [body, handle];

    // A side grasp: the palm in front of the body, thumb and two fingers around it.
    let palm = Point3::new(0.0, -0.07, 0.0);
    let contacts = [
        [-0.04, 0.01, 0.01],
        [0.04, 0.01, 0.03],
        [0.04, 0.01, -0.02],
        [0.04, -0.01, 0.03],
    ]
    .map(Point3::from);
    let enclosure = largest_tetrahedron(palm, &contacts).expect("three contacts and the palm span a volume");
    println!("tetrahedron        {:8.3} cm3", enclosure.volume() * 1e6);

    let shared = boxes.map(|b| enclosure.intersection_volume(&b));
    for (name, (part, whole)) in ["body", "handle"].iter().zip(shared.iter().zip(&boxes)) {
        println!(
            "{name:8} encloses  {:8.3} of {:7.3} cm3",
            part * 1e6,
            whole.volume() * 1e6
        );
    }
    let sum: f64 = boxes.iter().map(OrientedBox::volume).sum();
    println!(
        "fvol               {:8.4}",
        1.0 - shared.iter().sum::<f64>() / sum
    );

    // What both boxes hold counts once.
    let once = union_volume(&boxes);
    println!("boxes overlap by   {:8.3} cm3", (sum - once) * 1e6);
    println!(
        "fvol_union         {:8.4}",
        1.0 - enclosure.union_volume(&boxes) / once
    );
    Ok(())
}
