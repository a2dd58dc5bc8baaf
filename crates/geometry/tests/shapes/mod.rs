//! Bodies with known dimensions (m), for the tests beside this folder.

use nalgebra::Point3;
use prehend_geometry::TriMesh;

/// Boxes given by their lowest and highest corner, each closed and outwards, joined into one mesh.
pub fn boxes(boxes: &[([f64; 3], [f64; 3])]) -> TriMesh {
    const SIDES: [[u32; 4]; 6] = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for (low, high) in boxes {
        let first = vertices.len() as u32;
        let coordinate = |corner: usize, k: usize| if corner >> k & 1 == 1 { high[k] } else { low[k] };
        vertices.extend((0..8).map(|i| Point3::new(coordinate(i, 0), coordinate(i, 1), coordinate(i, 2))));
        triangles.extend(
            SIDES
                .iter()
                .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
                .map(|t| t.map(|v| v + first)),
        );
    }
    TriMesh::new(vertices, triangles).expect("indices are in range")
}

/// A head of 120 × 30 × 30 mm across the end of a handle of 30 × 20 × 300 mm.
pub fn hammer() -> TriMesh {
    boxes(&[
        ([-0.06, -0.015, 0.3], [0.06, 0.015, 0.33]),
        ([-0.015, -0.01, 0.0], [0.015, 0.01, 0.3]),
    ])
}

/// Rings of points (radius, height) about z, joined in order and to one another at the ends.
fn lathe(
    profile: &[(f64, f64)],
    n_sides: u32,
    vertices: &mut Vec<Point3<f64>>,
    triangles: &mut Vec<[u32; 3]>,
) {
    let first = vertices.len() as u32;
    let n_rings = profile.len() as u32;
    for &(r, z) in profile {
        vertices.extend((0..n_sides).map(|i| {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n_sides);
            Point3::new(r * angle.cos(), r * angle.sin(), z)
        }));
    }
    for ring in 0..n_rings - 1 {
        for i in 0..n_sides {
            let at = |ring: u32, i: u32| first + ring * n_sides + i % n_sides;
            let [a, b, c, d] = [at(ring, i), at(ring, i + 1), at(ring + 1, i + 1), at(ring + 1, i)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
}

/// A cup of radius 40 mm, height 100 mm and wall 3 mm with a handle of square section that reaches out 35 mm.
pub fn mug() -> TriMesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    let profile = [
        (1e-9, 0.0),
        (0.04, 0.0),
        (0.04, 0.1),
        (0.037, 0.1),
        (0.037, 0.003),
        (1e-9, 0.003),
    ];
    lathe(&profile, 64, &mut vertices, &mut triangles);
    let handle = boxes(&[
        ([0.038, -0.005, 0.02], [0.075, 0.005, 0.03]),
        ([0.065, -0.005, 0.02], [0.075, 0.005, 0.08]),
        ([0.038, -0.005, 0.07], [0.075, 0.005, 0.08]),
    ]);
    let first = vertices.len() as u32;
    vertices.extend(handle.vertices());
    triangles.extend(handle.triangles().iter().map(|t| t.map(|v| v + first)));
    TriMesh::new(vertices, triangles).expect("indices are in range")
}

/// A bottle of radius 35 mm with a shoulder and a neck, 250 mm high.
pub fn bottle() -> TriMesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    let profile = [
        (1e-9, 0.0),
        (0.035, 0.0),
        (0.035, 0.15),
        (0.012, 0.19),
        (0.012, 0.25),
        (1e-9, 0.25),
    ];
    lathe(&profile, 64, &mut vertices, &mut triangles);
    TriMesh::new(vertices, triangles).expect("indices are in range")
}
