//! A mesh made ready for drawing: normals smoothed where the surface is smooth, and lines where it is not.

use nalgebra::{Point3, Vector3};
use prehend_geometry::TriMesh;

/// Faces whose planes differ by less than this share a smooth normal where they meet.
const SMOOTH_COS: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Faces whose planes differ by more than this meet in a visible line.
const CREASE_COS: f64 = 0.5;

/// A mesh with one normal a corner. Prepare it once, draw it often.
///
/// Winding is ignored: a normal may point to either side and is turned to the viewer when drawn, so that open and
/// inconsistently wound meshes look like surfaces too. Vertices at the same place count as one.
#[derive(Debug, Clone, PartialEq)]
pub struct DisplayMesh {
    pub(crate) vertices: Vec<Point3<f64>>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Three unit normals a triangle; zero where the triangle has no area.
    pub(crate) normals: Vec<[Vector3<f64>; 3]>,
    /// Ends of the lines in which faces meet at more than 60°.
    pub(crate) creases: Vec<[Point3<f64>; 2]>,
}

impl DisplayMesh {
    /// Averages normals over the faces at each vertex that lie within 45° of a face, weighted by their angle there.
    pub fn new(mesh: &TriMesh) -> Self {
        let vertices = mesh.vertices().to_vec();
        let triangles = mesh.triangles().to_vec();
        let place = places(&vertices);
        let faces: Vec<Vector3<f64>> = mesh.corners().map(|c| face_normal(&c)).collect();

        // Corners sorted by place: (place, triangle, corner).
        let mut corners: Vec<(u32, u32, u8)> = Vec::with_capacity(triangles.len() * 3);
        for (t, corner) in triangles.iter().enumerate() {
            corners.extend((0..3_u8).map(|k| (place[corner[k as usize] as usize], t as u32, k)));
        }
        corners.sort_unstable();

        let angles: Vec<[f64; 3]> = mesh.corners().map(|c| corner_angles(&c)).collect();
        let mut normals = vec![[Vector3::zeros(); 3]; triangles.len()];
        for around in corners.chunk_by(|a, b| a.0 == b.0) {
            for &(_, t, k) in around {
                let own = faces[t as usize];
                let sum: Vector3<f64> = around
                    .iter()
                    .map(|&(_, other, j)| {
                        let cos = own.dot(&faces[other as usize]);
                        let weight = if cos.abs() >= SMOOTH_COS {
                            angles[other as usize][j as usize]
                        } else {
                            0.0
                        };
                        faces[other as usize] * (weight * cos.signum())
                    })
                    .sum();
                normals[t as usize][k as usize] = sum.try_normalize(1e-12).unwrap_or(own);
            }
        }
        let creases = creases(&vertices, &triangles, &place, &faces);
        Self {
            vertices,
            triangles,
            normals,
            creases,
        }
    }
}

/// For each vertex the index of the first vertex at exactly its place.
fn places(vertices: &[Point3<f64>]) -> Vec<u32> {
    // + 0.0 makes −0 and 0 one place.
    let key = |v: u32| vertices[v as usize].coords.map(|c| (c + 0.0).to_bits());
    let mut order: Vec<u32> = (0..vertices.len() as u32).collect();
    order.sort_by_key(|&v| (<[u64; 3]>::from(key(v)), v));
    let mut place = vec![0; vertices.len()];
    for same in order.chunk_by(|&a, &b| key(a) == key(b)) {
        for &v in same {
            place[v as usize] = same[0];
        }
    }
    place
}

fn face_normal([a, b, c]: &[Point3<f64>; 3]) -> Vector3<f64> {
    (b - a)
        .cross(&(c - a))
        .try_normalize(0.0)
        .filter(|n| n.iter().all(|x| x.is_finite()))
        .unwrap_or_default()
}

fn corner_angles(corners: &[Point3<f64>; 3]) -> [f64; 3] {
    std::array::from_fn(|k| {
        let (here, next, last) = (corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]);
        (next - here).angle(&(last - here))
    })
}

fn creases(
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
    place: &[u32],
    faces: &[Vector3<f64>],
) -> Vec<[Point3<f64>; 2]> {
    let mut edges: Vec<([u32; 2], u32)> = Vec::with_capacity(triangles.len() * 3);
    for (t, corner) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (place[corner[k] as usize], place[corner[(k + 1) % 3] as usize]);
            if a != b {
                edges.push(([a.min(b), a.max(b)], t as u32));
            }
        }
    }
    edges.sort_unstable();
    edges
        .chunk_by(|a, b| a.0 == b.0)
        .filter(|sharing| match sharing {
            [(_, s), (_, t)] => faces[*s as usize].dot(&faces[*t as usize]).abs() < CREASE_COS,
            [_] => true,
            _ => false,
        })
        .map(|sharing| sharing[0].0.map(|v| vertices[v as usize]))
        .collect()
}

#[cfg(test)]
mod tests {
    use prehend_geometry::OrientedBox;

    use super::*;

    #[test]
    fn a_cube_keeps_flat_faces_and_shows_its_twelve_edges() {
        let cube = DisplayMesh::new(&OrientedBox::centered([1.0; 3]).surface());
        for normals in &cube.normals {
            assert!(normals.iter().all(|n| (n.abs().max() - 1.0).abs() < 1e-12));
        }
        assert_eq!(cube.creases.len(), 12);
    }

    #[test]
    fn two_faces_ten_degrees_apart_share_their_normal_whichever_way_they_are_wound() {
        let (sin, cos) = 10_f64.to_radians().sin_cos();
        let vertices = vec![
            Point3::new(0.0, 0.0, 0.0),
            Point3::new(0.0, 1.0, 0.0),
            Point3::new(1.0, 0.5, 0.0),
            Point3::new(-cos, 0.5, sin),
        ];
        for second in [[0, 1, 3], [0, 3, 1]] {
            let mesh = TriMesh::new(vertices.clone(), vec![[0, 2, 1], second]).unwrap();
            let display = DisplayMesh::new(&mesh);
            let (a, b) = (display.normals[0][0], display.normals[1][0]);
            assert!(a.dot(&b).abs() > 1.0 - 1e-12, "{a} {b}");
            assert!((a.x.abs() - 5_f64.to_radians().sin()).abs() < 1e-9);
            assert_eq!(display.creases.len(), 4, "the open edges, not the fold");
        }
    }

    #[test]
    fn vertices_given_twice_are_one_place() {
        let p = |x: f64, y: f64| Point3::new(x, y, -0.0 * x);
        let vertices = vec![
            p(0.0, 0.0),
            p(1.0, 0.0),
            p(0.0, 1.0),
            p(1.0, 0.0),
            p(1.0, 1.0),
            p(0.0, 1.0),
        ];
        let mesh = TriMesh::new(vertices, vec![[0, 1, 2], [3, 4, 5]]).unwrap();
        assert_eq!(DisplayMesh::new(&mesh).creases.len(), 4);
    }

    #[test]
    fn triangles_without_area_are_harmless() {
        let mesh = TriMesh::new(vec![Point3::origin(); 3], vec![[0, 1, 2]]).unwrap();
        let display = DisplayMesh::new(&mesh);
        assert_eq!(display.normals[0][0], Vector3::zeros());
        assert!(display.creases.is_empty());
    }
}
