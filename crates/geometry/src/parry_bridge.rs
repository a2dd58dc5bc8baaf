//! The one place where nalgebra's types become those of parry and back.

use nalgebra::{Isometry3, Point3, Vector3};
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
        Self::Points(Points::new(points))
    }

    /// The point of the body, placed by `pose`, that is farthest along a direction.
    pub(crate) fn farthest(&self, pose: &Isometry3<f64>, direction: &Vector3<f64>) -> P {
        let local = pose.rotation.inverse_transform_vector(direction);
        pose * point(self.local_support_point(Vector::new(local.x, local.y, local.z)))
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

/// Coordinates of points, four at a time, the last point repeated: so processors compare several at once.
#[derive(Debug, Clone)]
pub(crate) struct Points(Vec<[[f64; 4]; 3]>);

impl Points {
    fn new(points: &[P]) -> Self {
        let four = |part: &[P]| {
            let at = |k: usize| std::array::from_fn(|i| part[i.min(part.len() - 1)][k]);
            [at(0), at(1), at(2)]
        };
        Self(points.chunks(4).map(four).collect())
    }
}

impl SupportMap for Points {
    fn local_support_point(&self, d: Vector) -> Vector {
        let along = |[x, y, z]: &[[f64; 4]; 3]| -> [f64; 4] {
            std::array::from_fn(|i| x[i] * d.x + y[i] * d.y + z[i] * d.z)
        };
        let mut farthest = [f64::NEG_INFINITY; 4];
        let mut part = [0; 4];
        for (idx, four) in self.0.iter().enumerate() {
            let along = along(four);
            for i in 0..4 {
                let is_farther = along[i] > farthest[i];
                farthest[i] = if is_farther { along[i] } else { farthest[i] };
                part[i] = if is_farther { idx as u64 } else { part[i] };
            }
        }
        let mut best = 0;
        for i in 1..4 {
            if farthest[i] > farthest[best] || farthest[i] == farthest[best] && part[i] < part[best] {
                best = i;
            }
        }
        let [x, y, z] = self.0[part[best] as usize];
        Vector::new(x[best], y[best], z[best])
    }
}

/// What GJK says of two convex bodies.
pub(crate) enum Closest {
    Intersecting,
    /// Closest points on the first and the second body, both in the first one's frame.
    Apart(P, P),
    /// They are farther apart than asked about, seen along this unit direction, on which the second body ends here.
    Beyond(Vector3<f64>, P),
    /// The iteration did not settle; the caller needs another way.
    Unsettled,
}

/// Closest points of a triangle and a convex body placed in the triangle's frame, where they are not farther apart than
/// `below`. `towards` is where the search starts: from the body to the triangle, about.
pub(crate) fn triangle_to_body(
    triangle: &[P; 3],
    body: &ConvexBody,
    pose: &Isometry3<f64>,
    below: f64,
    towards: Option<&Vector3<f64>>,
) -> Closest {
    let [a, b, c] = triangle.map(|p| vector(&p));
    let start = towards.map(|v| Vector::new(-v.x, -v.y, -v.z));
    closest(&Triangle::new(a, b, c), body, pose, below, start)
}

/// Closest points of two convex bodies, the second one placed in the first one's frame.
pub(crate) fn body_to_body(first: &ConvexBody, second: &ConvexBody, pose: &Isometry3<f64>) -> Closest {
    closest(first, second, pose, f64::MAX, None)
}

fn closest(
    first: &impl SupportMap,
    second: &impl SupportMap,
    pose: &Isometry3<f64>,
    below: f64,
    start: Option<Vector>,
) -> Closest {
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
        below.min(f64::MAX),
        &mut simplex,
        start,
    ) {
        GJKResult::Intersection => Closest::Intersecting,
        GJKResult::ClosestPoints(a, b, _) => Closest::Apart(point(a), point(b)),
        GJKResult::NoIntersection(d) => {
            let (on_first, on_second) = (first.local_support_point(d), second.support_point(&pose, -d));
            // Unless the iteration was given up, the direction shows it.
            if (on_second - on_first).dot(d) > below {
                Closest::Beyond(Vector3::new(-d.x, -d.y, -d.z), point(on_second))
            } else {
                Closest::Unsettled
            }
        }
        GJKResult::Proximity(_) => Closest::Unsettled,
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

/// Lowest and highest coordinates of a tree node's bounds.
pub(crate) fn node_corners(node: &BvhNode) -> ([f64; 3], [f64; 3]) {
    (node.mins().to_array(), node.maxs().to_array())
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
