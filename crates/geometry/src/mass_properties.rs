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
