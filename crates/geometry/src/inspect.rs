//! What shape a mesh is in.

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::TriMesh;
use crate::topology::{Edges, chains, components, is_collapsed, position_triangles};

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
    /// The holes, the one with the longest boundary first.
    pub holes: Vec<Hole>,
}

/// A group of boundary edges that hang together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Hole {
    /// How many edges it has.
    pub edges: usize,
    /// Their length (m).
    pub perimeter: f64,
    /// The area (m²) of what would close it: exact where the boundary is a flat loop, less than that of any cover else.
    pub area: f64,
}

/// Looks a mesh over without changing it.
pub fn inspect(mesh: &TriMesh) -> MeshReport {
    let triangles = position_triangles(mesh);
    let edges = Edges::new(&triangles);
    let mut boundary = Vec::new();
    let (mut non_manifold_edges, mut inconsistent_edges) = (0, 0);
    for (ends, sides) in edges.iter() {
        match sides {
            // In the triangle's own direction, so that the edges of a hole run round it.
            [side] if side.upward => boundary.push(ends),
            [_] => boundary.push([ends[1], ends[0]]),
            [one, other] => inconsistent_edges += usize::from(one.upward == other.upward),
            _ => non_manifold_edges += 1,
        }
    }
    let holes = holes(mesh, &boundary);
    let degenerate_triangles = triangles.iter().filter(|t| is_collapsed(**t)).count();
    MeshReport {
        watertight: boundary.is_empty() && non_manifold_edges == 0 && degenerate_triangles < triangles.len(),
        boundary_edges: boundary.len(),
        non_manifold_edges,
        inconsistent_edges,
        degenerate_triangles,
        n_components: components(&triangles, &edges).len(),
        n_holes: holes.len(),
        holes,
    }
}

/// What each chain of boundary edges goes round, longest first.
fn holes(mesh: &TriMesh, boundary: &[[u32; 2]]) -> Vec<Hole> {
    let at = |v: u32| mesh.vertices()[v as usize];
    let measure = |chain: Vec<[u32; 2]>| {
        let middle: Point3<f64> = at(chain[0][0]);
        let ends = chain.iter().map(|edge| edge.map(|v| at(v) - middle));
        // The area vector of a closed loop does not depend on the point that it is taken about.
        let area: Vector3<f64> = ends.clone().map(|[from, to]| from.cross(&to) / 2.0).sum();
        Hole {
            edges: chain.len(),
            perimeter: ends.map(|[from, to]| (to - from).norm()).sum(),
            area: area.norm(),
        }
    };
    let mut holes: Vec<Hole> = chains(boundary).into_iter().map(measure).collect();
    holes.sort_by(|a, b| b.perimeter.total_cmp(&a.perimeter));
    holes
}

#[cfg(test)]
mod tests {
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
            holes: vec![],
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
        let hole = Hole {
            edges: 4,
            perimeter: 2.0,
            area: 0.25,
        };
        assert_eq!(report.holes, [hole, hole]);
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
