//! What a solid looks like, and how far a point is from it.

use nalgebra::{Point3, Vector3};

use crate::{Solid, TriMesh, closest, parry_bridge};

/// Sides of a drawn circle.
const N_SIDES: u32 = 24;
/// Rings of a drawn half ball.
const N_RINGS: u32 = 6;

impl Solid {
    /// Distance from a point to the solid, both in the solid's frame; 0 inside. For a mesh: to its surface, also from inside.
    ///
    /// A hull costs a pass over its faces, which are built anew: use [`crate::Collider`] for many queries.
    pub fn distance_to_point(&self, p: &Point3<f64>) -> f64 {
        let beyond = |d: f64, r: f64| (d - r).max(0.0);
        match self {
            Self::Sphere { radius } => beyond(p.coords.norm(), *radius),
            Self::Capsule { half_length, radius } => {
                let along = p.z.clamp(-half_length, *half_length);
                beyond((p.coords - Vector3::new(0.0, 0.0, along)).norm(), *radius)
            }
            Self::Cuboid { half_extents } => (p.coords.abs() - half_extents).sup(&Vector3::zeros()).norm(),
            Self::Cylinder { half_length, radius } => {
                beyond(p.x.hypot(p.y), *radius).hypot(beyond(p.z.abs(), *half_length))
            }
            Self::Hull(points) => match parry_bridge::hull(points) {
                Some((corners, faces)) => {
                    let triangles = faces.iter().map(|f| f.map(|i| corners[i as usize]));
                    let outside =
                        |t: &[Point3<f64>; 3]| (t[1] - t[0]).cross(&(t[2] - t[0])).dot(&(p - t[0])) > 0.0;
                    let (least, inside) = triangles.fold((f64::INFINITY, true), |(least, inside), t| {
                        (
                            least.min((closest::on_triangle(p, &t) - p).norm()),
                            inside && !outside(&t),
                        )
                    });
                    if inside { 0.0 } else { least }
                }
                None => flat_hull_distance(points, p),
            },
            Self::Mesh(mesh) => mesh
                .corners()
                .map(|t| (closest::on_triangle(p, &t) - p).norm())
                .fold(f64::INFINITY, f64::min),
        }
    }

    /// Radius of the ball about the solid's origin that holds it.
    pub fn bounding_radius(&self) -> f64 {
        let farthest = |points: &[Point3<f64>]| points.iter().map(|p| p.coords.norm()).fold(0.0, f64::max);
        match self {
            Self::Sphere { radius } => *radius,
            Self::Capsule { half_length, radius } => half_length + radius,
            Self::Cuboid { half_extents } => half_extents.norm(),
            Self::Cylinder { half_length, radius } => half_length.hypot(*radius),
            Self::Hull(points) => farthest(points),
            Self::Mesh(mesh) => farthest(mesh.vertices()),
        }
    }

    /// Triangles to draw the solid with, outward oriented; round shapes are inscribed polyhedra.
    pub fn display_mesh(&self) -> TriMesh {
        match self {
            Self::Sphere { radius } => rounded(0.0, *radius),
            Self::Capsule { half_length, radius } => rounded(*half_length, *radius),
            Self::Cuboid { half_extents } => {
                let sign = |i: usize, k: usize| {
                    if i >> k & 1 == 1 {
                        half_extents[k]
                    } else {
                        -half_extents[k]
                    }
                };
                let corners = (0..8)
                    .map(|i| Point3::new(sign(i, 0), sign(i, 1), sign(i, 2)))
                    .collect();
                let quads = [
                    [0, 4, 6, 2],
                    [1, 3, 7, 5],
                    [0, 1, 5, 4],
                    [2, 6, 7, 3],
                    [0, 2, 3, 1],
                    [4, 5, 7, 6],
                ];
                built(
                    corners,
                    quads
                        .iter()
                        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
                        .collect(),
                )
            }
            Self::Cylinder { half_length, radius } => revolved(&[
                (0.0, -half_length),
                (*radius, -half_length),
                (*radius, *half_length),
                (0.0, *half_length),
            ]),
            Self::Hull(points) => match parry_bridge::hull(points) {
                Some((corners, faces)) => built(corners, faces),
                None => flat_fan(points),
            },
            Self::Mesh(mesh) => (**mesh).clone(),
        }
    }
}

/// A ball swept along z, as rings from the south pole to the north pole.
fn rounded(half_length: f64, radius: f64) -> TriMesh {
    let mut profile = Vec::new();
    for i in 0..=2 * N_RINGS + 1 {
        // The equator stands twice, at both ends of the core.
        let (ring, side) = if i <= N_RINGS { (i, -1.0) } else { (i - 1, 1.0) };
        let polar = f64::from(ring) / f64::from(2 * N_RINGS) * std::f64::consts::PI;
        let at = (radius * polar.sin(), side * half_length - radius * polar.cos());
        if profile.last() != Some(&at) {
            profile.push(at);
        }
    }
    let last = profile.len() - 1;
    (profile[0].0, profile[last].0) = (0.0, 0.0);
    revolved(&profile)
}

/// A profile of (radius, height) turned about z; the first and the last point lie on the axis.
fn revolved(profile: &[(f64, f64)]) -> TriMesh {
    let inner = &profile[1..profile.len() - 1];
    let mut vertices = vec![
        Point3::new(0.0, 0.0, profile[0].1),
        Point3::new(0.0, 0.0, profile[profile.len() - 1].1),
    ];
    for (r, z) in inner {
        for j in 0..N_SIDES {
            let (s, c) = (f64::from(j) / f64::from(N_SIDES) * std::f64::consts::TAU).sin_cos();
            vertices.push(Point3::new(r * c, r * s, *z));
        }
    }
    let at = |ring: u32, j: u32| 2 + ring * N_SIDES + j % N_SIDES;
    let top = inner.len() as u32 - 1;
    let mut triangles = Vec::new();
    for j in 0..N_SIDES {
        triangles.push([0, at(0, j + 1), at(0, j)]);
        triangles.push([1, at(top, j), at(top, j + 1)]);
        for ring in 0..top {
            triangles.push([at(ring, j), at(ring, j + 1), at(ring + 1, j + 1)]);
            triangles.push([at(ring, j), at(ring + 1, j + 1), at(ring + 1, j)]);
        }
    }
    built(vertices, triangles)
}

/// Points that span no volume, as a fan (drawing only); fewer than three are doubled up.
fn flat_fan(points: &[Point3<f64>]) -> TriMesh {
    let mut vertices = points.to_vec();
    while vertices.len() < 3 {
        vertices.push(vertices.last().copied().unwrap_or_else(Point3::origin));
    }
    let triangles = (1..vertices.len() as u32 - 1).map(|i| [0, i, i + 1]).collect();
    built(vertices, triangles)
}

/// Distance to points that span no volume: to every triangle that they form.
fn flat_hull_distance(points: &[Point3<f64>], p: &Point3<f64>) -> f64 {
    let mut least = f64::INFINITY;
    for (i, a) in points.iter().enumerate() {
        for (j, b) in points[..=i].iter().enumerate() {
            for c in &points[..=j] {
                least = least.min((closest::on_triangle(p, &[*a, *b, *c]) - p).norm());
            }
        }
    }
    least
}

fn built(vertices: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> TriMesh {
    TriMesh::new(vertices, triangles).expect("solids have finite corners and at least one face")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    fn solids() -> Vec<(Solid, f64)> {
        let unit = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
            .map(Point3::from)
            .to_vec();
        let pi = std::f64::consts::PI;
        vec![
            (Solid::Sphere { radius: 0.5 }, pi / 6.0),
            (
                Solid::Capsule {
                    half_length: 1.0,
                    radius: 0.5,
                },
                pi / 6.0 + pi / 2.0,
            ),
            (
                Solid::Cuboid {
                    half_extents: Vector3::new(0.5, 1.0, 1.5),
                },
                6.0,
            ),
            (
                Solid::Cylinder {
                    half_length: 1.0,
                    radius: 0.5,
                },
                pi / 2.0,
            ),
            (Solid::Hull(Arc::new(unit)), 1.0 / 6.0),
        ]
    }

    fn volume(mesh: &TriMesh) -> f64 {
        mesh.corners()
            .map(|[a, b, c]| a.coords.cross(&b.coords).dot(&c.coords) / 6.0)
            .sum()
    }

    #[test]
    fn drawn_solids_are_outward_oriented_and_nearly_as_large_as_the_solid() {
        for (solid, expected) in solids() {
            let ratio = volume(&solid.display_mesh()) / expected;
            assert!(ratio > 0.95 && ratio < 1.0 + 1e-12, "{solid:?} {ratio}");
        }
    }

    #[test]
    fn vertices_of_a_drawn_solid_are_on_it_and_points_beyond_them_are_outside() {
        for (solid, _) in solids() {
            for v in solid.display_mesh().vertices() {
                assert!(solid.distance_to_point(v) < 1e-9, "{solid:?} {v}");
                assert!(v.coords.norm() <= solid.bounding_radius() + 1e-9);
                let outside = Point3::from(v.coords + (v.coords - Vector3::repeat(0.1)) * 0.5);
                assert!(
                    solid.distance_to_point(&outside) > 1e-3 || v.coords.norm() < 1e-9,
                    "{solid:?} {v}"
                );
            }
        }
    }

    #[test]
    fn distances_are_those_of_the_textbook() {
        let at = |x, y, z| Point3::new(x, y, z);
        let capsule = Solid::Capsule {
            half_length: 1.0,
            radius: 0.5,
        };
        assert!((capsule.distance_to_point(&at(3.0, 0.0, 5.0)) - 4.5).abs() < 1e-12);
        let cylinder = Solid::Cylinder {
            half_length: 1.0,
            radius: 0.5,
        };
        assert!((cylinder.distance_to_point(&at(3.5, 0.0, 5.0)) - 5.0).abs() < 1e-12);
        assert_eq!(cylinder.distance_to_point(&at(0.3, 0.3, 0.9)), 0.0);
        let flat = Solid::Hull(Arc::new(
            [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]
                .map(Point3::from)
                .to_vec(),
        ));
        assert!((flat.distance_to_point(&at(0.5, 0.5, -2.0)) - 2.0).abs() < 1e-12);
    }
}
