//! Volume, area, centroids and inertia of a mesh.
//!
//! Integrals over a solid become sums over its surface (divergence theorem): each triangle and a reference point span
//! a signed tetrahedron, and what lies outside the solid cancels. The reference is the middle of the bounds, so that a
//! mesh a thousand units from the origin keeps its digits.

use nalgebra::{Matrix3, Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::TriMesh;

/// Below this share of area^{3/2} a volume counts as nothing: no centre of mass can be told from it.
const HOLLOWNESS: f64 = 1e-12;

/// What a solid of density 1 (kg/m³) inside a mesh weighs, and how.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MassProperties {
    /// Signed volume (m³): negative where the mesh is wound inside out.
    pub volume: f64,
    /// Centre of mass (m).
    pub center_of_mass: Point3<f64>,
    /// Inertia about the centre of mass along the mesh's axes (m⁵; times density it is kg m²).
    pub inertia: Matrix3<f64>,
}

/// Volume, centre of mass and inertia of the solid inside a mesh.
///
/// Exact for closed, consistently wound meshes. For others the sum still exists, as if each hole were closed by a cone
/// to the middle of the bounds. A mesh that encloses nothing has volume and inertia 0 and its surface centroid as centre.
pub fn mass_properties(mesh: &TriMesh) -> MassProperties {
    let reference = middle(mesh);
    let mut volume = 0.0;
    let mut first_moment = Vector3::zeros();
    let mut second_moment = Matrix3::zeros();
    for corners in mesh.corners() {
        let [a, b, c] = corners.map(|p| p - reference);
        let tetrahedron = a.dot(&b.cross(&c)) / 6.0;
        let sum = a + b + c;
        volume += tetrahedron;
        first_moment += sum * (tetrahedron / 4.0);
        // ∫ x xᵀ over a tetrahedron with one corner at the origin: V/20 (Σ vᵢ vᵢᵀ + (Σ vᵢ)(Σ vᵢ)ᵀ).
        let squares = a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose();
        second_moment += squares * (tetrahedron / 20.0);
    }
    if volume.abs() <= HOLLOWNESS * surface_area(mesh).powf(1.5) {
        return MassProperties {
            volume: 0.0,
            center_of_mass: surface_centroid(mesh),
            inertia: Matrix3::zeros(),
        };
    }
    let center = first_moment / volume;
    let covariance = (second_moment - center * center.transpose() * volume) * volume.signum();
    let inertia = Matrix3::identity() * covariance.trace() - covariance;
    MassProperties {
        volume,
        center_of_mass: reference + center,
        inertia,
    }
}

/// Signed volume (m³) inside a mesh: positive where triangles are counter-clockwise seen from outside.
///
/// Holes count as closed by cones to the middle of the bounds.
pub fn signed_volume(mesh: &TriMesh) -> f64 {
    let reference = middle(mesh);
    let sixfold: f64 = mesh
        .corners()
        .map(|corners| {
            let [a, b, c] = corners.map(|p| p - reference);
            a.dot(&b.cross(&c))
        })
        .sum();
    sixfold / 6.0
}

/// Total area of the triangles (m²).
pub fn surface_area(mesh: &TriMesh) -> f64 {
    mesh.corners()
        .map(|[a, b, c]| (b - a).cross(&(c - a)).norm() / 2.0)
        .sum()
}

/// Centroid of the surface (m): the mean of the triangles' centroids, weighted by area.
///
/// Where all triangles are flat, the plain mean of their corners.
pub fn surface_centroid(mesh: &TriMesh) -> Point3<f64> {
    let reference = middle(mesh);
    let mut area = 0.0;
    let mut weighted = Vector3::zeros();
    let mut plain = Vector3::zeros();
    for corners in mesh.corners() {
        let [a, b, c] = corners.map(|p| p - reference);
        let weight = (b - a).cross(&(c - a)).norm();
        let centroid = (a + b + c) / 3.0;
        area += weight;
        weighted += centroid * weight;
        plain += centroid;
    }
    if area > 0.0 {
        reference + weighted / area
    } else {
        reference + plain / mesh.n_triangles() as f64
    }
}

/// The middle of the bounds.
fn middle(mesh: &TriMesh) -> Point3<f64> {
    let (low, high) = mesh.axis_aligned_bounds();
    low + (high - low) / 2.0
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;
    use crate::repair::tests::cube;

    /// A block of edges a, b, c has the inertia m (b² + c²) / 12 about its x axis.
    #[test]
    fn a_block_has_the_figures_of_the_textbook() {
        let scale = Vector3::new(2.0, 3.0, 4.0);
        let vertices = cube(1.0)
            .vertices()
            .iter()
            .map(|p| p.coords.component_mul(&scale).into())
            .collect();
        let block = TriMesh::new(vertices, cube(1.0).triangles().to_vec()).unwrap();
        let away = Isometry3::translation(1000.0, -1000.0, 500.0);
        for (mesh, center) in [
            (block.clone(), Point3::origin()),
            (block.transformed(&away), away * Point3::origin()),
        ] {
            let mass = mass_properties(&mesh);
            assert!((mass.volume - 24.0).abs() < 1e-9);
            assert!((mass.center_of_mass - center).norm() < 1e-9);
            let expected = Matrix3::from_diagonal(&Vector3::new(50.0, 40.0, 26.0));
            assert!((mass.inertia - expected).norm() < 1e-9, "{}", mass.inertia);
            assert!((surface_area(&mesh) - 52.0).abs() < 1e-9);
            assert!((surface_centroid(&mesh) - center).norm() < 1e-9);
        }
    }

    #[test]
    fn inside_out_is_negative_volume_with_the_same_inertia() {
        let triangles = cube(2.0).triangles().iter().map(|&[a, b, c]| [a, c, b]).collect();
        let inverted = TriMesh::new(cube(2.0).vertices().to_vec(), triangles).unwrap();
        let (inverted, upright) = (mass_properties(&inverted), mass_properties(&cube(2.0)));
        assert!((inverted.volume + 8.0).abs() < 1e-14);
        assert!((inverted.inertia - upright.inertia).norm() < 1e-13);
    }

    #[test]
    fn a_sheet_has_its_surface_centroid_and_no_inertia() {
        let corners = [[0.0, 0.0, 5.0], [3.0, 0.0, 5.0], [0.0, 3.0, 5.0]]
            .map(Point3::from)
            .to_vec();
        let mass = mass_properties(&TriMesh::new(corners, vec![[0, 1, 2]]).unwrap());
        assert_eq!((mass.volume, mass.inertia), (0.0, Matrix3::zeros()));
        assert!((mass.center_of_mass - Point3::new(1.0, 1.0, 5.0)).norm() < 1e-15);
        let point = TriMesh::new(vec![Point3::new(1.0, 2.0, 3.0); 3], vec![[0, 1, 2]]).unwrap();
        assert_eq!(mass_properties(&point).center_of_mass, Point3::new(1.0, 2.0, 3.0));
    }
}
