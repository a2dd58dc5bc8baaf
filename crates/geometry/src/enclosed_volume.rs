//! The volume inside a surface, also one with holes.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::topology::{Edges, chains, position_triangles, rim};
use crate::{TriMesh, convex_hull, surface_area};

/// A surface with holes counts as a body if what it encloses exceeds this share of area^{3/2}: a ball has 0.094.
const FULLNESS: f64 = 1e-3;

/// How a volume was come by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VolumeMethod {
    /// The surface is closed (each edge has two triangles, wound alike): the sum of signed tetrahedra over its triangles,
    /// exact. What several parts of it enclose counts once for each.
    SignedVolume,
    /// The surface has holes, or edges of more than two triangles: the integral of the winding number of the surface with
    /// each hole closed by a fan about the middle of its rim. Exact for flat holes, and where there are none.
    WindingNumber,
    /// Nothing sensible is enclosed (a sheet, or windings that contradict each other): the volume of the convex hull.
    ConvexHull,
}

/// A volume, and how it was come by.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EnclosedVolume {
    /// The volume (m³), never negative.
    pub volume: f64,
    /// How.
    pub method: VolumeMethod,
}

/// The volume inside a mesh that has been mended ([`repair`](crate::repair)).
///
/// Unlike [`signed_volume`](crate::signed_volume) it does not depend on where a mesh with holes lies: holes are closed by
/// fans, and the sum of signed tetrahedra over a closed surface is the integral of its winding number. Where that gives
/// next to nothing, or more than the convex hull, the hull's volume stands in, and `method` says so. A flat mesh has 0.
///
/// # Examples
///
/// A cube with an open top:
///
/// ```
/// use prehend_geometry::{MeshFormat, VolumeMethod, enclosed_volume, read_mesh};
///
/// let text = "OFF 8 5\n5 5 5\n6 5 5\n6 6 5\n5 6 5\n5 5 6\n6 5 6\n6 6 6\n5 6 6\n\
///     4 0 3 2 1\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n";
/// let inside = enclosed_volume(&read_mesh(text.as_bytes(), MeshFormat::Off)?);
/// assert!((inside.volume - 1.0).abs() < 1e-12);
/// assert_eq!(inside.method, VolumeMethod::WindingNumber);
/// # Ok::<(), prehend_geometry::GeometryError>(())
/// ```
pub fn enclosed_volume(mesh: &TriMesh) -> EnclosedVolume {
    let triangles = position_triangles(mesh);
    let edges = Edges::new(&triangles);
    let mut consistent = true;
    let mut is_closed = true;
    let mut open = Vec::new();
    for (ends, sides) in edges.iter() {
        open.extend(rim(ends, sides));
        is_closed &= sides.len() == 2;
        consistent &= !matches!(sides, [one, other] if one.upward == other.upward);
    }
    let (low, high) = mesh.axis_aligned_bounds();
    let reference = low + (high - low) / 2.0;
    let at = |v: u32| mesh.vertices()[v as usize] - reference;
    let sixfold = |[a, b, c]: [Vector3<f64>; 3]| a.dot(&b.cross(&c));
    let mut sum: f64 = triangles.iter().map(|t| sixfold(t.map(at))).sum();
    for hole in chains(&open) {
        let middle = hole
            .iter()
            .map(|&[from, to]| at(from) + at(to))
            .sum::<Vector3<f64>>()
            / (2 * hole.len()) as f64;
        sum += hole
            .iter()
            .map(|&[from, to]| sixfold([at(to), at(from), middle]))
            .sum::<f64>();
    }
    let volume = (sum / 6.0).abs();
    if is_closed && consistent {
        return EnclosedVolume {
            volume,
            method: VolumeMethod::SignedVolume,
        };
    }
    let used: Vec<_> = mesh.corners().flatten().collect();
    let hull = convex_hull(&used).map_or(0.0, |hull| hull.volume());
    let sensible =
        consistent && volume > FULLNESS * surface_area(mesh).powf(1.5) && volume <= hull * (1.0 + 1e-9);
    if sensible {
        EnclosedVolume {
            volume,
            method: VolumeMethod::WindingNumber,
        }
    } else {
        EnclosedVolume {
            volume: hull,
            method: VolumeMethod::ConvexHull,
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;
    use crate::repair::tests::cube;

    fn without(n: usize) -> TriMesh {
        let cube = cube(2.0);
        TriMesh::new(cube.vertices().to_vec(), cube.triangles()[n..].to_vec()).unwrap()
    }

    #[test]
    fn flat_holes_change_nothing_wherever_the_mesh_lies() {
        for n in 0..5 {
            for shift in [0.0, 1000.0] {
                let inside =
                    enclosed_volume(&without(n).transformed(&Isometry3::translation(shift, -shift, 3.0)));
                assert!((inside.volume - 8.0).abs() < 1e-9, "{n} {inside:?}");
                assert_eq!(inside.method == VolumeMethod::SignedVolume, n == 0);
            }
        }
    }

    #[test]
    fn bodies_that_share_an_edge_are_not_closed_but_have_the_sum_of_their_volumes() {
        let (low, high) = (
            cube(1.0),
            cube(1.0).transformed(&Isometry3::translation(1.0, 0.0, 1.0)),
        );
        let vertices = [low.vertices(), high.vertices()].concat();
        let triangles = [low.triangles(), high.triangles()].concat();
        let second = |t: &[u32; 3]| t.map(|v| v + 8);
        let triangles = (triangles[..12].iter().copied()).chain(triangles[12..].iter().map(second));
        let inside = enclosed_volume(&TriMesh::new(vertices, triangles.collect()).unwrap());
        assert!((inside.volume - 2.0).abs() < 1e-12);
        assert_eq!(inside.method, VolumeMethod::WindingNumber);
    }

    #[test]
    fn a_shell_in_a_shell_counts_once_more_and_a_cavity_is_taken_off() {
        let (outer, inner) = (cube(2.0), cube(1.0));
        let vertices = [outer.vertices(), inner.vertices()].concat();
        for (turned, expected) in [(false, 9.0), (true, 7.0)] {
            let second = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|v| v + 8);
                if turned { [a, c, b] } else { [a, b, c] }
            };
            let triangles = outer.triangles().iter().copied();
            let triangles = triangles.chain(inner.triangles().iter().map(second)).collect();
            let inside = enclosed_volume(&TriMesh::new(vertices.clone(), triangles).unwrap());
            assert!((inside.volume - expected).abs() < 1e-12, "{inside:?}");
            assert_eq!(inside.method, VolumeMethod::SignedVolume);
        }
    }

    #[test]
    fn sheets_and_contradicting_windings_say_that_the_hull_stands_in() {
        let sheet = enclosed_volume(&without(10));
        assert_eq!((sheet.volume, sheet.method), (0.0, VolumeMethod::ConvexHull));
        let mut triangles = cube(2.0).triangles().to_vec();
        triangles[0].swap(0, 1);
        let crossed = TriMesh::new(cube(2.0).vertices().to_vec(), triangles).unwrap();
        let inside = enclosed_volume(&crossed);
        assert!((inside.volume - 8.0).abs() < 1e-9);
        assert_eq!(inside.method, VolumeMethod::ConvexHull);
    }
}
