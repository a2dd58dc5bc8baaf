//! What must hold of anything that a reader makes of any bytes.

use prehend_geometry::{
    MeshFormat, Shape, inspect, mass_properties, read_mesh, read_shape, repair, surface_area, write_ply,
};

/// Any bytes give an error with a message, or a sound shape that can be mended, measured and written.
pub fn shape(bytes: &[u8], format: MeshFormat) {
    match read_shape(bytes, format) {
        Ok(shape) => sound(shape),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

/// Points, at least one, all finite; of a mesh also what is made of it.
pub fn sound(shape: Shape) {
    assert!(!shape.points().is_empty());
    assert!(shape.points().iter().all(|p| p.iter().all(|c| c.is_finite())));
    let Shape::Mesh(mesh) = shape else { return };
    let n_vertices = mesh.vertices().len() as u32;
    assert!(mesh.triangles().iter().flatten().all(|&v| v < n_vertices));
    mass_properties(&mesh);
    surface_area(&mesh);
    inspect(&mesh);
    assert!(read_mesh(&write_ply(&mesh), MeshFormat::Ply).as_ref() == Ok(&mesh));
    let n_triangles = mesh.n_triangles();
    let (mended, repairs) = repair(mesh);
    assert!(mended.n_triangles() + repairs.dropped_triangles == n_triangles);
    let report = inspect(&mended);
    assert!(report.degenerate_triangles == 0 || report.degenerate_triangles == mended.n_triangles());
}
