//! Planes that touch a convex core: what lies beyond one of them is far enough away not to be looked at.
//!
//! ```text
//!              ╱ ▔▔▔▔▔ ╲  core
//!    ─────────┴─────────┴──────── plane through its outermost point
//!        ↕ best      a triangle or a tree's node that lies wholly
//!    ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─  below here cannot be nearer than `best`
//! ```
//!
//! Closest points are dear (GJK); each pair of them gives such a plane, and so does each run that stops early because the
//! two are too far apart. Where a solid touches a smooth wall, one or two planes rule out all other triangles.

use nalgebra::{Isometry3, Point3, Vector3};
use parry3d_f64::partitioning::BvhNode;

use crate::collider::Collider;
use crate::core_distance::by_features;
use crate::parry_bridge::{self, Closest, ConvexBody};

/// A plane that touches a convex core, its normal away from the core.
#[derive(Clone, Copy, Default)]
pub(crate) struct Plane {
    normal: Vector3<f64>,
    height: f64,
}

impl Plane {
    /// The plane with this unit normal.
    pub(crate) fn on_core(body: &ConvexBody, tree_from_core: &Isometry3<f64>, normal: Vector3<f64>) -> Self {
        let height = normal.dot(&body.farthest(tree_from_core, &normal).coords);
        Self { normal, height }
    }
}

/// How many planes are kept: contacts in a hollow need several.
const N_PLANES: usize = 6;

/// The last planes that were found.
#[derive(Default)]
pub(crate) struct Planes {
    all: [Plane; N_PLANES],
    n_found: usize,
}

impl Planes {
    pub(crate) fn add(&mut self, plane: Option<Plane>) {
        if let Some(plane) = plane {
            self.all[self.n_found % N_PLANES] = plane;
            self.n_found += 1;
        }
    }

    fn iter(&self) -> impl Iterator<Item = &Plane> {
        self.all[..self.n_found.min(N_PLANES)].iter()
    }

    /// Whether some plane shows that a triangle's distance from the core is `best` or more.
    pub(crate) fn are_before(&self, [a, b, c]: &[Point3<f64>; 3], best: f64) -> bool {
        self.iter().any(|plane| {
            let height = |p: &Point3<f64>| plane.normal.dot(&p.coords);
            height(a).min(height(b)).min(height(c)) - plane.height >= best
        })
    }

    /// Whether some plane shows that everything in a node is `best` or more away from the core.
    pub(crate) fn are_before_node(&self, node: &BvhNode, best: f64) -> bool {
        let (center, half) = parry_bridge::node_bounds(node);
        let (center, half) = (Vector3::from(center), Vector3::from(half));
        self.iter()
            .any(|plane| plane.normal.dot(&center) - plane.normal.abs().dot(&half) - plane.height >= best)
    }

    /// Closest points (core, triangle); `None` where they are not closer than `below`, by a plane that is then kept.
    pub(crate) fn convex_to_triangle(
        &mut self,
        collider: &Collider,
        body: &ConvexBody,
        tree_from_core: &Isometry3<f64>,
        triangle: &[Point3<f64>; 3],
        below: f64,
    ) -> Option<(Point3<f64>, Point3<f64>)> {
        // From the core to the triangle's plane, if it lies on one side of it.
        let [a, b, c] = triangle;
        let normal = (b - a).cross(&(c - a)).try_normalize(f64::MIN_POSITIVE);
        let towards = normal.map(|n| {
            let center = tree_from_core * Point3::from(collider.core_center);
            if n.dot(&(a - center)) < 0.0 { -n } else { n }
        });
        if let Some(normal) = towards {
            let plane = Plane::on_core(body, tree_from_core, normal);
            if normal.dot(&a.coords) - plane.height >= below {
                self.add(Some(plane));
                return None;
            }
        }
        match parry_bridge::triangle_to_body(triangle, body, tree_from_core, below, towards.as_ref()) {
            Closest::Apart(on_triangle, on_core) => Some((on_core, on_triangle)),
            Closest::Intersecting => Some((triangle[0], triangle[0])),
            Closest::Beyond(normal, on_core) => {
                let height = normal.dot(&on_core.coords);
                self.add(Some(Plane { normal, height }));
                None
            }
            Closest::Unsettled => Some(by_features(collider, tree_from_core, triangle)),
        }
    }
}
