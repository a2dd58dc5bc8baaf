//! The one place where nalgebra's types become those of parry and back.

use nalgebra::{Isometry3, Point3};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::{Pose, Rotation, Vector};
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, BvhNode};
use parry3d_f64::query::details::closest_points_support_map_support_map_with_params;
use parry3d_f64::query::gjk::{GJKResult, VoronoiSimplex};
use parry3d_f64::shape::{Cuboid, Cylinder, SupportMap, Triangle};

type P = Point3<f64>;

/// A convex body given by the point of it that is farthest along a direction.
#[derive(Debug, Clone)]
pub(crate) enum ConvexBody {
    Cuboid(Cuboid),
    /// About the z axis: parry's cylinder about y, turned.
    Cylinder(ZCylinder),
    /// The convex hull of points.
    Points(Points),
}

impl ConvexBody {
    pub(crate) fn cuboid(half_extents: [f64; 3]) -> Self {
        Self::Cuboid(Cuboid::new(Vector::from_array(half_extents)))
    }

    pub(crate) fn cylinder(half_length: f64, radius: f64) -> Self {
        Self::Cylinder(ZCylinder(Cylinder::new(half_length, radius)))
    }

    pub(crate) fn points(points: &[P]) -> Self {
        Self::Points(Points(points.iter().map(vector).collect()))
    }
}

impl SupportMap for ConvexBody {
    fn local_support_point(&self, direction: Vector) -> Vector {
        match self {
            Self::Cuboid(shape) => shape.local_support_point(direction),
            Self::Cylinder(shape) => shape.local_support_point(direction),
            Self::Points(shape) => shape.local_support_point(direction),
        }
    }
}

#[derive(Debug, Clone)]
pub(crate) struct ZCylinder(Cylinder);

impl SupportMap for ZCylinder {
    fn local_support_point(&self, d: Vector) -> Vector {
        let p = self.0.local_support_point(Vector::new(d.x, d.z, d.y));
        Vector::new(p.x, p.z, p.y)
    }
}

#[derive(Debug, Clone)]
pub(crate) struct Points(Vec<Vector>);

impl SupportMap for Points {
    fn local_support_point(&self, direction: Vector) -> Vector {
        let mut best = self.0[0];
        let mut farthest = best.dot(direction);
        for p in &self.0[1..] {
            let along = p.dot(direction);
            if along > farthest {
                farthest = along;
                best = *p;
            }
        }
        best
    }
}

/// What GJK says of two convex bodies.
pub(crate) enum Closest {
    Intersecting,
    /// Closest points on the first and the second body, both in the first one's frame.
    Apart(P, P),
    /// The iteration did not settle; the caller needs another way.
    Unsettled,
}

/// Closest points of a triangle and a convex body placed in the triangle's frame.
pub(crate) fn triangle_to_body(triangle: &[P; 3], body: &ConvexBody, pose: &Isometry3<f64>) -> Closest {
    let [a, b, c] = triangle.map(|p| vector(&p));
    closest(&Triangle::new(a, b, c), body, pose)
}

/// Closest points of two convex bodies, the second one placed in the first one's frame.
pub(crate) fn body_to_body(first: &ConvexBody, second: &ConvexBody, pose: &Isometry3<f64>) -> Closest {
    closest(first, second, pose)
}

fn closest(first: &impl SupportMap, second: &impl SupportMap, pose: &Isometry3<f64>) -> Closest {
    let (r, t) = (pose.rotation.coords, pose.translation.vector);
    let pose = Pose::from_parts(
        Vector::new(t.x, t.y, t.z),
        Rotation::from_xyzw(r.x, r.y, r.z, r.w),
    );
    let mut simplex = VoronoiSimplex::new();
    match closest_points_support_map_support_map_with_params(
        &pose,
        first,
        second,
        f64::MAX,
        &mut simplex,
        None,
    ) {
        GJKResult::Intersection => Closest::Intersecting,
        GJKResult::ClosestPoints(a, b, _) => Closest::Apart(point(a), point(b)),
        GJKResult::NoIntersection(_) | GJKResult::Proximity(_) => Closest::Unsettled,
    }
}

/// A tree over triangles' bounds.
pub(crate) fn tree(triangles: &[[P; 3]]) -> Bvh {
    let bounds = triangles
        .iter()
        .enumerate()
        .map(|(i, [a, b, c])| (i, Aabb::new(vector(&a.inf(b).inf(c)), vector(&a.sup(b).sup(c)))));
    Bvh::from_iter(BvhBuildStrategy::Binned, bounds)
}

/// Centre and half lengths of a tree node's bounds.
pub(crate) fn node_bounds(node: &BvhNode) -> ([f64; 3], [f64; 3]) {
    let (low, high) = (node.mins(), node.maxs());
    (((low + high) * 0.5).to_array(), ((high - low) * 0.5).to_array())
}

/// Hull vertices and outward triangles; `None` where the points span no volume.
pub(crate) fn hull(points: &[P]) -> Option<(Vec<P>, Vec<[u32; 3]>)> {
    let points: Vec<Vector> = points.iter().map(vector).collect();
    let (vertices, triangles) = parry3d_f64::transformation::try_convex_hull(&points).ok()?;
    Some((vertices.into_iter().map(point).collect(), triangles))
}

fn vector(p: &P) -> Vector {
    Vector::new(p.x, p.y, p.z)
}

fn point(v: Vector) -> P {
    P::new(v.x, v.y, v.z)
}
