//! What shape a mesh is in.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::TriMesh;
use crate::topology::{Edges, Groups, components, is_collapsed, position_triangles};

/// What shape a mesh is in. Vertices at equal positions count as one, so an STL file can be watertight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MeshReport {
    /// Whether every edge has exactly two triangles: the surface is closed.
    pub watertight: bool,
    /// Edges with one triangle.
    pub boundary_edges: usize,
    /// Edges with three triangles or more.
    pub non_manifold_edges: usize,
    /// Edges whose two triangles run along them in the same direction, so that one of the two is wound wrongly.
    pub inconsistent_edges: usize,
    /// Triangles of which two corners coincide; they take no part in the other figures.
    pub degenerate_triangles: usize,
    /// Parts that no edge connects.
    pub n_components: usize,
    /// Holes: groups of boundary edges that hang together.
    pub n_holes: usize,
    /// Length of each hole's boundary (m), longest first.
    pub hole_perimeters: Vec<f64>,
}

/// Looks a mesh over without changing it.
pub fn inspect(mesh: &TriMesh) -> MeshReport {
    let triangles = position_triangles(mesh);
    let edges = Edges::new(&triangles);
    let mut boundary = Vec::new();
    let (mut non_manifold_edges, mut inconsistent_edges) = (0, 0);
    for (ends, sides) in edges.iter() {
        match sides {
            [_] => boundary.push(ends),
            [one, other] => inconsistent_edges += usize::from(one.upward == other.upward),
            _ => non_manifold_edges += 1,
        }
    }
    let hole_perimeters = perimeters(mesh, &boundary);
    let degenerate_triangles = triangles.iter().filter(|t| is_collapsed(**t)).count();
    MeshReport {
        watertight: boundary.is_empty() && non_manifold_edges == 0 && degenerate_triangles < triangles.len(),
        boundary_edges: boundary.len(),
        non_manifold_edges,
        inconsistent_edges,
        degenerate_triangles,
        n_components: components(&triangles, &edges).len(),
        n_holes: hole_perimeters.len(),
        hole_perimeters,
    }
}

/// Length of each group of edges that hang together, longest first.
fn perimeters(mesh: &TriMesh, boundary: &[[u32; 2]]) -> Vec<f64> {
    let mut first_edge_at = BTreeMap::new();
    let mut groups = Groups::new(boundary.len());
    for (edge, ends) in boundary.iter().enumerate() {
        for end in ends {
            groups.join(edge, *first_edge_at.entry(end).or_insert(edge));
        }
    }
    let length = |edge: usize| {
        let [a, b] = boundary[edge].map(|v| mesh.vertices()[v as usize]);
        (b - a).norm()
    };
    let mut perimeters: Vec<f64> = groups
        .members(|_| true)
        .iter()
        .map(|hole| hole.iter().map(|&edge| length(edge)).sum())
        .collect();
    perimeters.sort_by(|a, b| b.total_cmp(a));
    perimeters
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::repair::tests::cube;

    #[test]
    fn a_cube_is_watertight_even_as_a_soup() {
        let expected = MeshReport {
            watertight: true,
            boundary_edges: 0,
            non_manifold_edges: 0,
            inconsistent_edges: 0,
            degenerate_triangles: 0,
            n_components: 1,
            n_holes: 0,
            hole_perimeters: vec![],
        };
        let cube = cube(1.0);
        assert_eq!(inspect(&cube), expected);
        let corners: Vec<_> = cube.corners().flatten().collect();
        let soup = TriMesh::new(corners, (0..12).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect()).unwrap();
        assert_eq!(inspect(&soup), expected);
    }

    #[test]
    fn two_missing_faces_are_two_holes() {
        let cube = cube(0.5);
        // Faces come in pairs of triangles; the first two faces are opposite each other.
        let open = TriMesh::new(cube.vertices().to_vec(), cube.triangles()[4..].to_vec()).unwrap();
        let report = inspect(&open);
        assert_eq!(
            (report.watertight, report.boundary_edges, report.n_holes),
            (false, 8, 2)
        );
        assert_eq!(report.hole_perimeters, [2.0, 2.0]);
    }

    #[test]
    fn a_fin_and_a_turned_triangle_are_counted() {
        let cube = cube(1.0);
        let mut vertices = cube.vertices().to_vec();
        let mut triangles = cube.triangles().to_vec();
        triangles[0].swap(0, 1);
        assert_eq!(
            inspect(&TriMesh::new(vertices.clone(), triangles.clone()).unwrap()).inconsistent_edges,
            3
        );
        vertices.push(Point3::new(3.0, 3.0, 3.0));
        triangles.push([0, 1, 8]);
        triangles.push([5, 5, 8]);
        let report = inspect(&TriMesh::new(vertices, triangles).unwrap());
        assert_eq!(
            (
                report.boundary_edges,
                report.non_manifold_edges,
                report.degenerate_triangles
            ),
            (2, 1, 1)
        );
    }
}
