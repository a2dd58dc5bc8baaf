//! Meshes as PLY files.

use crate::TriMesh;

/// The mesh as a binary little-endian PLY file, coordinates as `double`: what is read back is equal bit by bit.
///
/// # Examples
///
/// ```
/// use nalgebra::Point3;
/// use prehend_geometry::{MeshFormat, TriMesh, read_mesh, write_ply};
///
/// let corners = vec![Point3::origin(), Point3::new(0.1, 0.0, 0.0), Point3::new(0.0, 0.1, 0.0)];
/// let mesh = TriMesh::new(corners, vec![[0, 1, 2]])?;
/// assert_eq!(read_mesh(&write_ply(&mesh), MeshFormat::Ply)?, mesh);
/// # Ok::<(), prehend_geometry::GeometryError>(())
/// ```
pub fn write_ply(mesh: &TriMesh) -> Vec<u8> {
    let head = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
         property double z\nelement face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        mesh.vertices().len(),
        mesh.n_triangles(),
    );
    let mut bytes = Vec::with_capacity(head.len() + mesh.vertices().len() * 24 + mesh.n_triangles() * 13);
    bytes.extend_from_slice(head.as_bytes());
    for vertex in mesh.vertices() {
        for coordinate in vertex.iter() {
            bytes.extend_from_slice(&coordinate.to_le_bytes());
        }
    }
    for triangle in mesh.triangles() {
        bytes.push(3);
        for vertex in triangle {
            bytes.extend_from_slice(&vertex.to_le_bytes());
        }
    }
    bytes
}
