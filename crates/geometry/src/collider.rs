//! A solid made ready for distance queries.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::parry_bridge::{self, ConvexBody};
use crate::triangle_tree::TriangleTree;
use crate::{GeometryError, Solid};

/// A solid made ready for distance queries: its core with a radius around it, its corners and edges, and balls that cover it.
///
/// A ball is a point with a radius, a capsule a segment with a radius; a cuboid, a cylinder, a hull and a mesh are
/// their own core with radius 0. Build one per solid, then query it in as many poses as needed.
#[derive(Debug, Clone)]
pub struct Collider {
    pub(crate) core: Core,
    /// The core's hull, for what only needs its farthest points.
    pub(crate) hull: ConvexBody,
    /// Distance from the core to the solid's surface.
    pub(crate) radius: f64,
    /// Corners, edges and faces of the core, for contact patches.
    pub(crate) corners: Vec<Point3<f64>>,
    pub(crate) edges: Vec<[u32; 2]>,
    pub(crate) faces: Vec<[u32; 3]>,
    /// Centre and half lengths of the core's axis-aligned bounds.
    pub(crate) core_center: Vector3<f64>,
    pub(crate) core_half: Vector3<f64>,
    cover: Vec<Ball>,
    bounding: Ball,
}

/// A ball in the frame of what it bounds, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Centre.
    pub center: Point3<f64>,
    /// Radius.
    pub radius: f64,
}

#[derive(Debug, Clone)]
pub(crate) enum Core {
    Point,
    /// From `(0, 0, −half_length)` to `(0, 0, half_length)`.
    Segment(f64),
    Convex(ConvexBody),
    Mesh(TriangleTree),
}

/// How many corners stand for a cylinder's rim.
const N_RIM: u32 = 32;

impl Collider {
    /// Makes a solid ready. A hull whose points span no volume works, too; so does a mesh of any quality.
    ///
    /// # Errors
    ///
    /// [`GeometryError::Empty`] for a hull without points, [`GeometryError::BadExtents`] for a radius or length that is
    /// negative or not finite.
    pub fn new(solid: &Solid) -> Result<Self, GeometryError> {
        let checked = |lengths: [f64; 3]| {
            let fine = lengths.iter().all(|l| l.is_finite() && *l >= 0.0);
            if fine {
                Ok(())
            } else {
                Err(GeometryError::BadExtents { extents: lengths })
            }
        };
        let along_z = |half: f64| [-half, half].map(|z| Point3::new(0.0, 0.0, z)).to_vec();
        let (core, radius, corners, edges, faces) = match solid {
            Solid::Sphere { radius } => {
                checked([*radius; 3])?;
                (Core::Point, *radius, vec![Point3::origin()], vec![], vec![])
            }
            Solid::Capsule { half_length, radius } => {
                checked([*radius, *radius, *half_length])?;
                (
                    Core::Segment(*half_length),
                    *radius,
                    along_z(*half_length),
                    vec![[0, 1]],
                    vec![],
                )
            }
            Solid::Cuboid { half_extents } => {
                checked((*half_extents).into())?;
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
                let edges = (0..8u32).flat_map(|i| {
                    (0..3)
                        .filter(move |k| i >> k & 1 == 0)
                        .map(move |k| [i, i | 1 << k])
                });
                (
                    Core::Convex(ConvexBody::cuboid((*half_extents).into())),
                    0.0,
                    corners,
                    edges.collect(),
                    cuboid_faces(),
                )
            }
            Solid::Cylinder { half_length, radius } => {
                checked([*radius, *radius, *half_length])?;
                let (corners, edges, faces) = prism(*half_length, *radius);
                (
                    Core::Convex(ConvexBody::cylinder(*half_length, *radius)),
                    0.0,
                    corners,
                    edges,
                    faces,
                )
            }
            Solid::Hull(points) => {
                if points.is_empty() {
                    return Err(GeometryError::Empty { what: "points" });
                }
                let (corners, faces) =
                    parry_bridge::hull(points).unwrap_or_else(|| (points.to_vec(), Vec::new()));
                let edges = edges_of(&faces);
                (
                    Core::Convex(ConvexBody::points(&corners)),
                    0.0,
                    corners,
                    edges,
                    faces,
                )
            }
            Solid::Mesh(mesh) => {
                let edges = edges_of(mesh.triangles());
                let core = Core::Mesh(TriangleTree::new(mesh));
                (
                    core,
                    0.0,
                    mesh.vertices().to_vec(),
                    edges,
                    mesh.triangles().to_vec(),
                )
            }
        };
        let mut low = Vector3::repeat(f64::INFINITY);
        let mut high = Vector3::repeat(f64::NEG_INFINITY);
        for p in &corners {
            low = low.inf(&p.coords);
            high = high.sup(&p.coords);
        }
        if let Solid::Cylinder { radius, .. } = solid {
            (high.x, high.y) = (*radius, *radius);
            (low.x, low.y) = (-radius, -radius);
        }
        let core_center = (low + high) / 2.0;
        let core_half = (high - low) / 2.0;
        let farthest = match solid {
            Solid::Cylinder { half_length, radius } => radius.hypot(*half_length),
            _ => corners
                .iter()
                .map(|p| (p.coords - core_center).norm())
                .fold(0.0, f64::max),
        };
        let bounding = Ball {
            center: core_center.into(),
            radius: farthest + radius,
        };
        let cover = cover(core_center, core_half, radius, &bounding);
        let hull = match &core {
            Core::Convex(body) => body.clone(),
            Core::Mesh(_) => {
                let outer = parry_bridge::hull(&corners).map(|(corners, _)| corners);
                ConvexBody::points(outer.as_ref().unwrap_or(&corners))
            }
            Core::Point | Core::Segment(_) => ConvexBody::points(&corners),
        };
        Ok(Self {
            core,
            hull,
            radius,
            corners,
            edges,
            faces,
            core_center,
            core_half,
            cover,
            bounding,
        })
    }

    /// A ball that holds the solid, in its frame.
    pub fn bounding_ball(&self) -> Ball {
        self.bounding
    }

    /// Balls that together cover the solid, in its frame; few and as small as is cheap.
    pub fn cover(&self) -> &[Ball] {
        &self.cover
    }

    /// The lowest coordinate of the solid along unit direction `up` (given in `frame`), placed by `frame_from_solid`.
    pub fn lowest_along(&self, up: &Vector3<f64>, frame_from_solid: &Isometry3<f64>) -> f64 {
        let core = self
            .corners
            .iter()
            .map(|p| (frame_from_solid * p).coords.dot(up))
            .fold(f64::INFINITY, f64::min);
        core - self.radius
    }
}

/// Balls around parts of the core's bounds: cells about as large as the solid is thick.
fn cover(center: Vector3<f64>, half: Vector3<f64>, radius: f64, bounding: &Ball) -> Vec<Ball> {
    if radius > 0.0 {
        return capsule_cover(half.z, radius);
    }
    let thickness = half.min().max(half.max() / 6.0).max(1e-6);
    let counts = half.map(|h| (h / thickness).ceil().clamp(1.0, 6.0) as usize);
    if counts.iter().product::<usize>() == 1 {
        return vec![*bounding];
    }
    let cell = half.component_div(&counts.map(|n| n as f64));
    let mut balls = Vec::new();
    for i in 0..counts.x {
        for j in 0..counts.y {
            for k in 0..counts.z {
                let step = Vector3::new(i as f64, j as f64, k as f64) * 2.0 + Vector3::repeat(1.0);
                let at = center - half + cell.component_mul(&step);
                balls.push(Ball {
                    center: at.into(),
                    radius: cell.norm(),
                });
            }
        }
    }
    balls
}

/// A ball around each end, and balls around slices in between that reach little beyond the capsule.
fn capsule_cover(half_length: f64, radius: f64) -> Vec<Ball> {
    let at = |z: f64, radius: f64| Ball {
        center: Point3::new(0.0, 0.0, z),
        radius,
    };
    if half_length == 0.0 {
        return vec![at(0.0, radius)];
    }
    let n_slices = (half_length / (0.6 * radius)).ceil().clamp(1.0, 16.0);
    let slice = half_length / n_slices;
    let between = (0..n_slices as usize).map(|i| {
        let z = slice * (2.0 * i as f64 + 1.0) - half_length;
        at(z, slice.hypot(radius))
    });
    let ends = [-half_length, half_length].map(|z| at(z, radius));
    between.chain(ends).collect()
}

fn cuboid_faces() -> Vec<[u32; 3]> {
    let quads = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    quads
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect()
}

/// Corners, edges and faces.
type Features = (Vec<Point3<f64>>, Vec<[u32; 2]>, Vec<[u32; 3]>);

/// Corners, edges and faces of a prism inscribed in a cylinder about z.
fn prism(half_length: f64, radius: f64) -> Features {
    let mut corners = Vec::new();
    let (mut edges, mut faces) = (Vec::new(), Vec::new());
    for i in 0..N_RIM {
        let (s, c) = (f64::from(i) * std::f64::consts::TAU / f64::from(N_RIM)).sin_cos();
        corners.push(Point3::new(radius * c, radius * s, -half_length));
        corners.push(Point3::new(radius * c, radius * s, half_length));
        let (low, next) = (2 * i, 2 * ((i + 1) % N_RIM));
        edges.extend([[low, low + 1], [low, next], [low + 1, next + 1]]);
        faces.extend([[low, next, next + 1], [low, next + 1, low + 1]]);
        if i >= 1 && i + 1 < N_RIM {
            faces.extend([[0, next, low], [1, low + 1, next + 1]]);
        }
    }
    (corners, edges, faces)
}

/// The edges of triangles, each once.
fn edges_of(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let sorted = |a: u32, b: u32| [a.min(b), a.max(b)];
    let mut edges: Vec<[u32; 2]> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [sorted(a, b), sorted(b, c), sorted(c, a)])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    fn kinds() -> Vec<Solid> {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 2.0]]
            .map(Point3::from)
            .to_vec();
        vec![
            Solid::Sphere { radius: 0.3 },
            Solid::Capsule {
                half_length: 1.0,
                radius: 0.2,
            },
            Solid::Cuboid {
                half_extents: Vector3::new(1.0, 0.2, 0.5),
            },
            Solid::Cylinder {
                half_length: 0.8,
                radius: 0.3,
            },
            Solid::Hull(Arc::new(points)),
        ]
    }

    #[test]
    fn the_covering_balls_hold_every_corner_and_the_middle_of_every_edge() {
        for solid in kinds() {
            let collider = Collider::new(&solid).unwrap();
            let middles = collider.edges.iter().map(|e| {
                nalgebra::center(&collider.corners[e[0] as usize], &collider.corners[e[1] as usize])
            });
            for p in collider.corners.iter().copied().chain(middles) {
                let held = |b: &Ball| (p - b.center).norm() + collider.radius <= b.radius + 1e-12;
                if collider.radius > 0.0 {
                    assert!(held(&collider.bounding_ball()), "{solid:?} {p}");
                    continue;
                }
                assert!(collider.cover().iter().any(held), "{solid:?} {p}");
                assert!(held(&collider.bounding_ball()), "{solid:?} {p}");
            }
        }
    }

    #[test]
    fn every_point_of_a_capsule_lies_in_a_covering_ball() {
        for (half_length, radius) in [(1.0, 0.2), (0.01, 0.2), (5.0, 0.01), (0.0, 0.3)] {
            let capsule = Collider::new(&Solid::Capsule { half_length, radius }).unwrap();
            for i in 0..=400 {
                // Along the outline, cap, side, cap.
                let z = (f64::from(i) / 200.0 - 1.0) * (half_length + radius);
                let beyond = (z.abs() - half_length).max(0.0);
                let p = Point3::new((radius * radius - beyond * beyond).max(0.0).sqrt(), 0.0, z);
                let held = |b: &Ball| (p - b.center).norm() <= b.radius + 1e-9;
                assert!(capsule.cover().iter().any(held), "{half_length} {radius} {p}");
            }
        }
    }

    #[test]
    fn a_hull_without_points_and_a_negative_radius_are_errors() {
        assert_eq!(
            Collider::new(&Solid::Hull(Arc::new(vec![]))).unwrap_err(),
            GeometryError::Empty { what: "points" }
        );
        assert!(Collider::new(&Solid::Sphere { radius: -1.0 }).is_err());
    }

    #[test]
    fn the_lowest_point_of_a_capsule_counts_its_cap() {
        let capsule = Collider::new(&Solid::Capsule {
            half_length: 1.0,
            radius: 0.25,
        })
        .unwrap();
        let low = capsule.lowest_along(&Vector3::z(), &Isometry3::translation(0.0, 0.0, 3.0));
        assert!((low - 1.75).abs() < 1e-12);
    }
}
