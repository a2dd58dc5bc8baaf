//! How far a placed solid is from a surface, and where they touch.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::collider::{Collider, Core};
use crate::core_distance::{self, core_to_triangle};
use crate::separating_planes::Planes;
use crate::{Surface, closest};

/// The closest points of a surface and a solid, in the surface's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// Distance, metres. Negative where a ball or capsule reaches through the surface (its axis stays on this side);
    /// 0 where another solid does.
    pub distance: f64,
    /// The point on the surface.
    pub on_surface: Point3<f64>,
    /// The point on the solid.
    pub on_solid: Point3<f64>,
    /// The surface's triangle.
    pub triangle: usize,
}

impl Surface {
    /// The gap between the surface and a solid placed by `surface_from_solid`; `None` where it is `cutoff` or more.
    ///
    /// Exact up to rounding. A small cutoff is cheap. The surface is a shell: a solid that lies wholly inside a
    /// closed mesh has a positive gap too; see [`Surface::is_inside`].
    pub fn gap(&self, solid: &Collider, surface_from_solid: &Isometry3<f64>, cutoff: f64) -> Option<Gap> {
        self.gap_from(solid, surface_from_solid, cutoff, None)
    }

    /// [`gap`](Self::gap) for a solid that has moved a little: `hint` is the triangle that was nearest before, which is
    /// looked at first.
    pub fn gap_from(
        &self,
        solid: &Collider,
        surface_from_solid: &Isometry3<f64>,
        cutoff: f64,
        hint: Option<usize>,
    ) -> Option<Gap> {
        let hint = hint.filter(|i| *i < self.mesh().n_triangles()).map(|i| i as u32);
        let near = self
            .tree()
            .nearest_core(solid, surface_from_solid, cutoff + solid.radius, hint)?;
        let outward = near.on_tree - near.on_core;
        let on_solid = match outward.try_normalize(1e-12) {
            Some(unit) if solid.radius > 0.0 => near.on_core + unit * solid.radius,
            _ => near.on_core,
        };
        Some(Gap {
            distance: near.distance - solid.radius,
            on_surface: near.on_tree,
            on_solid,
            triangle: near.triangle as usize,
        })
    }

    /// Whether a placed solid and the surface share a point.
    pub fn intersects(&self, solid: &Collider, surface_from_solid: &Isometry3<f64>) -> bool {
        self.tree()
            .nearest_core(solid, surface_from_solid, solid.radius + f64::MIN_POSITIVE, None)
            .is_some()
    }

    /// A lower bound of the gap from the distance grid, mostly without looking at a triangle; may be negative.
    ///
    /// Of a solid far away it is that of the ball around it (one place of the grid), nearer by that of the balls that cover
    /// it: far away it is at least half of what all balls would tell.
    pub fn gap_lower_bound(&self, solid: &Collider, surface_from_solid: &Isometry3<f64>) -> f64 {
        let ball = solid.bounding_ball();
        let around = self.distance_lower_bound(&(surface_from_solid * ball.center)) - ball.radius;
        if around >= ball.radius || solid.cover().len() == 1 {
            return around;
        }
        let rotation = surface_from_solid.rotation.to_rotation_matrix();
        let mut least = f64::INFINITY;
        for ball in solid.cover() {
            let center = rotation * ball.center + surface_from_solid.translation.vector;
            least = least.min(self.distance_lower_bound(&center) - ball.radius);
        }
        least.max(around)
    }

    /// Every pair of features closer than `tolerance`: the closest points of near triangles, the surface's vertices near
    /// the solid, the solid's corners near the surface, and crossing edges.
    ///
    /// Together they span the patch on which the two touch: a flat pad on a flat face gives the patch's corners among
    /// others. Pairs come in the order of the tree; there may be many, and some may coincide.
    pub fn touching(
        &self,
        solid: &Collider,
        surface_from_solid: &Isometry3<f64>,
        tolerance: f64,
    ) -> Vec<Gap> {
        let reach = tolerance + solid.radius;
        let mut triangles = Vec::new();
        self.tree()
            .for_each_near(solid, surface_from_solid, reach, |t| triangles.push(t));
        triangles.sort_unstable();
        if triangles.is_empty() {
            return Vec::new();
        }
        let corners: Vec<_> = solid.corners.iter().map(|p| surface_from_solid * p).collect();
        let edge_bounds: Vec<_> = solid
            .edges
            .iter()
            .map(|e| bounds(&e.map(|i| corners[i as usize])))
            .collect();
        let mut found = Vec::new();
        let mut planes = Planes::default();
        for triangle_idx in triangles {
            let triangle = self.tree().triangle(triangle_idx);
            let mut keep = |on_core: Point3<f64>, on_surface: Point3<f64>| {
                let between = on_surface - on_core;
                let distance = between.norm();
                if distance < reach {
                    let unit = between.try_normalize(1e-12);
                    let on_solid = unit.map_or(on_core, |u| on_core + u * solid.radius);
                    let triangle = triangle_idx as usize;
                    found.push(Gap {
                        distance: distance - solid.radius,
                        on_surface,
                        on_solid,
                        triangle,
                    });
                }
            };
            let nearest = match &solid.core {
                Core::Convex(_) if planes.are_before(triangle, reach) => None,
                Core::Convex(body) => {
                    planes.convex_to_triangle(solid, body, surface_from_solid, triangle, reach)
                }
                _ => core_to_triangle(solid, surface_from_solid, triangle, reach),
            };
            let Some((on_core, on_surface)) = nearest else {
                continue;
            };
            if (on_core - on_surface).norm() >= reach {
                continue;
            }
            keep(on_core, on_surface);
            // Most features of the solid are far from the triangle, which their bounds tell.
            let around = bounds(triangle);
            let local = triangle.map(|p| surface_from_solid.inverse_transform_point(&p));
            for p in &corners {
                if are_near(&around, &(p.coords, p.coords), reach) {
                    keep(*p, closest::on_triangle(p, triangle));
                }
            }
            for (p, at) in triangle.iter().zip(&local) {
                let apart = (at.coords - solid.core_center).abs() - solid.core_half;
                if apart.max() <= reach
                    && let Some(on_core) = nearest_on_core(solid, surface_from_solid, &corners, p, reach)
                {
                    keep(on_core, *p);
                }
            }
            for ([a, b], bounds) in solid.edges.iter().zip(&edge_bounds) {
                if !are_near(&around, bounds, reach) {
                    continue;
                }
                for k in 0..3 {
                    let (p, q) = (&corners[*a as usize], &corners[*b as usize]);
                    let (on_core, on_surface) =
                        closest::of_segments(p, q, &triangle[k], &triangle[(k + 1) % 3]);
                    keep(on_core, on_surface);
                }
            }
        }
        found
    }
}

/// Lowest and highest coordinates of some points.
fn bounds(points: &[Point3<f64>]) -> (Vector3<f64>, Vector3<f64>) {
    let first = points[0].coords;
    let rest = points[1..].iter();
    rest.fold((first, first), |(low, high), p| {
        (low.inf(&p.coords), high.sup(&p.coords))
    })
}

/// Whether two axis-aligned boxes come within `reach` along every axis.
fn are_near(a: &(Vector3<f64>, Vector3<f64>), b: &(Vector3<f64>, Vector3<f64>), reach: f64) -> bool {
    (0..3).all(|k| a.0[k] <= b.1[k] + reach && b.0[k] <= a.1[k] + reach)
}

/// The point of the core's surface nearest to `p`, in the surface's frame; `None` where it is `below` or farther.
fn nearest_on_core(
    solid: &Collider,
    surface_from_solid: &Isometry3<f64>,
    corners: &[Point3<f64>],
    p: &Point3<f64>,
    below: f64,
) -> Option<Point3<f64>> {
    match &solid.core {
        Core::Point => Some(corners[0]),
        Core::Segment(half) => {
            let [a, b] = core_distance::segment(surface_from_solid, *half);
            Some(closest::on_segment(p, &a, &b))
        }
        Core::Mesh(tree) => {
            let local = surface_from_solid.inverse_transform_point(p);
            tree.nearest_point(&local, below)
                .map(|(_, q, _)| surface_from_solid * q)
        }
        Core::Convex(_) => {
            let faces = solid.faces.iter().map(|f| f.map(|i| corners[i as usize]));
            let on_faces = faces
                .filter(|f| are_near(&bounds(f), &(p.coords, p.coords), below))
                .map(|f| closest::on_triangle(p, &f));
            on_faces.min_by(|a, b| (a - p).norm_squared().total_cmp(&(b - p).norm_squared()))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Solid, TriMesh};
    use nalgebra::{Translation3, UnitQuaternion};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use std::sync::Arc;

    /// A bumpy closed surface of about 500 triangles, 0.1 m in size.
    fn blob() -> Surface {
        let (n_rings, n_sides) = (16u32, 17u32);
        let mut vertices = vec![Point3::new(0.0, 0.0, -0.05), Point3::new(0.0, 0.0, 0.05)];
        for i in 1..n_rings {
            let polar = f64::from(i) / f64::from(n_rings) * std::f64::consts::PI;
            for j in 0..n_sides {
                let turn = f64::from(j) / f64::from(n_sides) * std::f64::consts::TAU;
                let r = 0.04 * (1.0 + 0.3 * (3.0 * turn).sin() * (2.0 * polar).sin());
                let radial = r * polar.sin();
                vertices.push(Point3::new(
                    radial * turn.cos(),
                    radial * turn.sin(),
                    -0.05 * polar.cos(),
                ));
            }
        }
        let at = |i: u32, j: u32| 2 + (i - 1) * n_sides + j % n_sides;
        let mut triangles = Vec::new();
        for j in 0..n_sides {
            triangles.push([0, at(1, j + 1), at(1, j)]);
            triangles.push([1, at(n_rings - 1, j), at(n_rings - 1, j + 1)]);
            for i in 1..n_rings - 1 {
                triangles.push([at(i, j), at(i, j + 1), at(i + 1, j + 1)]);
                triangles.push([at(i, j), at(i + 1, j + 1), at(i + 1, j)]);
            }
        }
        Surface::new(TriMesh::new(vertices, triangles).unwrap())
    }

    fn solids() -> Vec<Solid> {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let mut random = || rng.random_range(-0.02..0.02);
        let points: Vec<_> = (0..40)
            .map(|_| Point3::new(random(), random(), 2.0 * random()))
            .collect();
        let mesh = Solid::Hull(Arc::new(points.clone())).display_mesh();
        vec![
            Solid::Sphere { radius: 0.012 },
            Solid::Capsule {
                half_length: 0.02,
                radius: 0.008,
            },
            Solid::Cuboid {
                half_extents: Vector3::new(0.02, 0.01, 0.03),
            },
            Solid::Cylinder {
                half_length: 0.02,
                radius: 0.01,
            },
            Solid::Hull(Arc::new(points)),
            Solid::Mesh(Arc::new(mesh)),
        ]
    }

    fn random_pose(rng: &mut ChaCha8Rng, reach: f64) -> Isometry3<f64> {
        let mut random = || rng.random_range(-1.0..1.0);
        let at = Translation3::new(random() * reach, random() * reach, random() * reach);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(random(), random(), random()) * 3.0);
        Isometry3::from_parts(at, turn)
    }

    /// Least distance over all triangles, by parry's own shapes and queries, which share no code with ours.
    fn by_parry(surface: &Surface, solid: &Solid, pose: &Isometry3<f64>) -> f64 {
        use parry3d_f64::math::{Pose, Rotation, Vector};
        use parry3d_f64::{query, shape};
        let v = |p: &Point3<f64>| Vector::new(p.x, p.y, p.z);
        let (r, t) = (pose.rotation.coords, pose.translation.vector);
        let mut pose = Pose::from_parts(
            Vector::new(t.x, t.y, t.z),
            Rotation::from_xyzw(r.x, r.y, r.z, r.w),
        );
        let shape: Box<dyn shape::Shape> = match solid {
            Solid::Sphere { radius } => Box::new(shape::Ball::new(*radius)),
            Solid::Capsule { half_length, radius } => Box::new(shape::Capsule::new_z(*half_length, *radius)),
            Solid::Cuboid { half_extents: h } => Box::new(shape::Cuboid::new(Vector::new(h.x, h.y, h.z))),
            Solid::Cylinder { half_length, radius } => {
                let quarter = Rotation::from_xyzw(0.5f64.sqrt(), 0.0, 0.0, 0.5f64.sqrt());
                pose.rotation *= quarter;
                Box::new(shape::Cylinder::new(*half_length, *radius))
            }
            Solid::Hull(points) => {
                let points: Vec<_> = points.iter().map(v).collect();
                Box::new(shape::ConvexPolyhedron::from_convex_hull(&points).unwrap())
            }
            Solid::Mesh(mesh) => {
                let points = mesh.vertices().iter().map(v).collect();
                Box::new(shape::TriMesh::new(points, mesh.triangles().to_vec()).unwrap())
            }
        };
        let triangles = surface
            .mesh()
            .corners()
            .map(|t| shape::Triangle::new(v(&t[0]), v(&t[1]), v(&t[2])));
        triangles.fold(f64::INFINITY, |least, t| {
            least.min(
                query::distance(&Pose::IDENTITY, &t, &pose, &*shape)
                    .unwrap()
                    .distance,
            )
        })
    }

    #[test]
    fn gaps_agree_with_parry_over_all_triangles() {
        let surface = blob();
        let mut rng = ChaCha8Rng::seed_from_u64(21);
        for solid in solids() {
            let collider = Collider::new(&solid).unwrap();
            let mut n_apart = 0;
            for _ in 0..60 {
                let pose = random_pose(&mut rng, 0.08);
                let expected = by_parry(&surface, &solid, &pose);
                let gap = surface.gap(&collider, &pose, 1.0).unwrap();
                assert!(
                    (gap.distance.max(0.0) - expected).abs() < 1e-8,
                    "{solid:?}: {} {expected}",
                    gap.distance
                );
                assert_eq!(surface.intersects(&collider, &pose), gap.distance <= 0.0);
                assert!(surface.gap_lower_bound(&collider, &pose) <= expected + 1e-9);
                if expected > 0.0 {
                    n_apart += 1;
                    assert!(((gap.on_surface - gap.on_solid).norm() - expected).abs() < 1e-8);
                    assert!(surface.gap(&collider, &pose, expected * 0.999).is_none());
                    assert!(surface.closest_point(&gap.on_surface).distance < 1e-9);
                }
            }
            assert!((10..60).contains(&n_apart), "both cases are seen: {n_apart}");
        }
    }

    #[test]
    fn a_flat_pad_on_a_larger_face_touches_at_its_four_corners() {
        let table = Surface::new(
            Solid::Cuboid {
                half_extents: Vector3::new(0.2, 0.2, 0.05),
            }
            .display_mesh(),
        );
        let pad = Collider::new(&Solid::Cuboid {
            half_extents: Vector3::new(0.01, 0.02, 0.005),
        })
        .unwrap();
        let pairs = table.touching(&pad, &Isometry3::translation(0.03, 0.05, 0.0551), 2e-4);
        for (x, y) in [(0.02, 0.03), (0.02, 0.07), (0.04, 0.03), (0.04, 0.07)] {
            let corner = Point3::new(x, y, 0.05);
            assert!(
                pairs.iter().any(|g| (g.on_surface - corner).norm() < 1e-9),
                "{corner}"
            );
        }
        assert!(pairs.iter().all(|g| (g.distance - 1e-4).abs() < 1e-9));
        assert!(
            table
                .touching(&pad, &Isometry3::translation(0.03, 0.05, 0.0553), 2e-4)
                .is_empty()
        );
    }

    #[test]
    fn a_capsule_lying_on_a_face_touches_along_its_length() {
        let table = Surface::new(
            Solid::Cuboid {
                half_extents: Vector3::new(0.2, 0.2, 0.05),
            }
            .display_mesh(),
        );
        let finger = Collider::new(&Solid::Capsule {
            half_length: 0.02,
            radius: 0.01,
        })
        .unwrap();
        let lying = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2);
        let pose = Isometry3::from_parts(Translation3::new(0.03, 0.01, 0.06 + 5e-5), lying);
        let pairs = table.touching(&finger, &pose, 2e-4);
        let span = |f: fn(f64, f64) -> f64, start| pairs.iter().map(|g| g.on_surface.x).fold(start, f);
        assert!((span(f64::min, 1.0) - 0.01).abs() < 1e-9 && (span(f64::max, -1.0) - 0.05).abs() < 1e-9);
    }
}
