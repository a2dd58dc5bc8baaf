//! Any bytes give an error or a sound shape. The first byte picks the format.
#![no_main]

use libfuzzer_sys::fuzz_target;
use prehend_geometry::{MeshFormat, Shape, inspect, mass_properties, read_shape, repair};

fuzz_target!(|data: &[u8]| {
    let Some((first, bytes)) = data.split_first() else { return };
    let extension = MeshFormat::EXTENSIONS[usize::from(*first) % MeshFormat::EXTENSIONS.len()];
    let format = MeshFormat::from_extension(extension).expect("a listed extension is known");
    let Ok(shape) = read_shape(bytes, format) else { return };
    assert!(shape.points().iter().all(|p| p.iter().all(|c| c.is_finite())));
    if let Shape::Mesh(mesh) = shape {
        mass_properties(&mesh);
        inspect(&repair(mesh).0);
    }
});
