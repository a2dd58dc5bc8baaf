//! How far a solid's core is from the triangles of a tree.

use std::cell::RefCell;

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use parry3d_f64::partitioning::{BvhNode, TraversalAction};

use crate::closest;
use crate::collider::{Collider, Core};
use crate::parry_bridge;
use crate::separating_planes::{Plane, Planes};
use crate::triangle_tree::TriangleTree;

/// The closest points of a tree and a solid's core, both in the tree's frame; equal where they meet.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Nearest {
    pub(crate) distance: f64,
    pub(crate) on_tree: Point3<f64>,
    pub(crate) on_core: Point3<f64>,
    pub(crate) triangle: u32,
}

impl TriangleTree {
    /// The nearest triangle to a solid's core closer than `below`. Other triangles as near as it may be chosen.
    ///
    /// A triangle that may be the nearest, `hint`, is looked at first: the better it is the less is looked at.
    pub(crate) fn nearest_core(
        &self,
        collider: &Collider,
        tree_from_core: &Isometry3<f64>,
        below: f64,
        hint: Option<u32>,
    ) -> Option<Nearest> {
        let placed = PlacedBounds::new(collider, tree_from_core);
        // A triangle beyond a plane that stands `best` off the core need not be looked at.
        let planes = RefCell::new(Planes::default());
        let leaf = |i: u32, best: f64| {
            let triangle = &self.triangles[i as usize];
            let is_flat = !matches!(collider.core, Core::Mesh(_) | Core::Point);
            if is_flat && placed.distance_to_plane_of(triangle) >= best {
                return None;
            }
            let Core::Convex(body) = &collider.core else {
                let pair = core_to_triangle(collider, tree_from_core, triangle, best)?;
                return Some(((pair.0 - pair.1).norm(), pair));
            };
            let mut planes = planes.borrow_mut();
            if planes.are_before(triangle, best) {
                return None;
            }
            let pair = planes.convex_to_triangle(collider, body, tree_from_core, triangle, best)?;
            let distance = (pair.0 - pair.1).norm();
            if distance < best {
                let normal = (pair.1 - pair.0).try_normalize(1e-6);
                planes.add(normal.map(|n| Plane::on_core(body, tree_from_core, n)));
            }
            Some((distance, pair))
        };
        // Where the search begins well, planes leave little to look at.
        let is_convex = matches!(collider.core, Core::Convex(_));
        let look = |i: u32| {
            leaf(i, below)
                .filter(|(distance, _)| *distance < below)
                .map(|s| (i, s))
        };
        let mut seed = hint.and_then(look);
        if is_convex && seed.is_none() {
            let reach = below + collider.core_half.norm();
            let first = self.near_triangle(&placed.center.into(), reach * (1.0 + 1e-9))?;
            seed = look(first);
            let again = seed.as_ref().and_then(|(_, (distance, (on_core, _)))| {
                let (_, _, second) = self.nearest_point(on_core, *distance)?;
                let found = leaf(second, *distance)?;
                (found.0 < *distance).then_some((second, found))
            });
            seed = again.or(seed);
        }
        let best = seed.as_ref().map_or(below, |(_, (distance, _))| *distance);
        let found = self.bvh.find_best(
            best,
            |node, best| {
                if is_convex && planes.borrow().are_before_node(node, best) {
                    best
                } else {
                    placed.distance(node, best)
                }
            },
            leaf,
        );
        found
            .or(seed)
            .map(|(triangle, (distance, (on_core, on_tree)))| Nearest {
                distance,
                on_tree,
                on_core,
                triangle,
            })
    }

    /// Calls `visit` with every triangle that may be closer to the core than `within` (some may be farther).
    pub(crate) fn for_each_near(
        &self,
        collider: &Collider,
        tree_from_core: &Isometry3<f64>,
        within: f64,
        mut visit: impl FnMut(u32),
    ) {
        let placed = PlacedBounds::new(collider, tree_from_core);
        self.bvh.traverse(|node| {
            if placed.distance(node, f64::INFINITY) > within {
                return TraversalAction::Prune;
            }
            if let Some(leaf) = node.leaf_data() {
                visit(leaf);
            }
            TraversalAction::Continue
        });
    }
}

/// Closest points (core, triangle) in the triangle's frame; `None` only where they are not closer than `below`.
pub(crate) fn core_to_triangle(
    collider: &Collider,
    tree_from_core: &Isometry3<f64>,
    triangle: &[Point3<f64>; 3],
    below: f64,
) -> Option<(Point3<f64>, Point3<f64>)> {
    match &collider.core {
        Core::Point => {
            let p = tree_from_core.translation.vector.into();
            Some((p, closest::on_triangle(&p, triangle)))
        }
        Core::Segment(half) => {
            let [p, q] = segment(tree_from_core, *half);
            Some(closest::of_segment_and_triangle(&p, &q, triangle))
        }
        Core::Convex(body) => {
            Planes::default().convex_to_triangle(collider, body, tree_from_core, triangle, below)
        }
        Core::Mesh(tree) => {
            let local = triangle.map(|p| tree_from_core.inverse_transform_point(&p));
            let low = local[0].inf(&local[1]).inf(&local[2]);
            let high = local[0].sup(&local[1]).sup(&local[2]);
            let found = tree.bvh.find_best(
                below,
                |node, _| bounds_distance(node, &low, &high),
                |i, _| {
                    let pair = closest::of_triangles(&tree.triangles[i as usize], &local);
                    Some(((pair.0 - pair.1).norm(), pair))
                },
            );
            found.map(|(_, (_, (a, b)))| (tree_from_core * a, tree_from_core * b))
        }
    }
}

/// The end points of a capsule's core in the tree's frame.
pub(crate) fn segment(tree_from_core: &Isometry3<f64>, half: f64) -> [Point3<f64>; 2] {
    let along = tree_from_core.rotation * Vector3::new(0.0, 0.0, half);
    let center = tree_from_core.translation.vector;
    [(center - along).into(), (center + along).into()]
}

/// Closest points over the faces and edges of a polytope, the slow way; what GJK cannot settle ends here.
pub(crate) fn by_features(
    collider: &Collider,
    tree_from_core: &Isometry3<f64>,
    triangle: &[Point3<f64>; 3],
) -> (Point3<f64>, Point3<f64>) {
    let corner = |i: u32| tree_from_core * collider.corners[i as usize];
    let faces = collider
        .faces
        .iter()
        .map(|f| closest::of_triangles(&f.map(corner), triangle));
    let edges = collider
        .edges
        .iter()
        .map(|e| closest::of_segment_and_triangle(&corner(e[0]), &corner(e[1]), triangle));
    let first = (corner(0), closest::on_triangle(&corner(0), triangle));
    let distance = |pair: &(Point3<f64>, Point3<f64>)| (pair.0 - pair.1).norm_squared();
    faces.chain(edges).fold(first, |best, pair| {
        if distance(&pair) < distance(&best) {
            pair
        } else {
            best
        }
    })
}

/// A core's bounds seen from a tree, and a tree's nodes seen from the core.
struct PlacedBounds {
    rotation: Matrix3<f64>,
    abs_rotation: Matrix3<f64>,
    center: Vector3<f64>,
    half_in_tree: Vector3<f64>,
    half: Vector3<f64>,
}

impl PlacedBounds {
    fn new(collider: &Collider, tree_from_core: &Isometry3<f64>) -> Self {
        let rotation = *tree_from_core.rotation.to_rotation_matrix().matrix();
        let abs_rotation = rotation.abs();
        Self {
            rotation,
            abs_rotation,
            center: rotation * collider.core_center + tree_from_core.translation.vector,
            half_in_tree: abs_rotation * collider.core_half,
            half: collider.core_half,
        }
    }

    /// A lower bound of the distance between the core and everything in the node; a rough one will do from `enough` on.
    fn distance(&self, node: &BvhNode, enough: f64) -> f64 {
        let (center, half) = parry_bridge::node_bounds(node);
        let (center, half) = (Vector3::from(center), Vector3::from(half));
        let between = center - self.center;
        let in_tree = (between.abs() - half - self.half_in_tree)
            .sup(&Vector3::zeros())
            .norm_squared();
        if in_tree >= enough * enough {
            return in_tree.sqrt();
        }
        let local = self.rotation.tr_mul(&between);
        let in_core = (local.abs() - self.abs_rotation.tr_mul(&half) - self.half)
            .sup(&Vector3::zeros())
            .norm_squared();
        in_tree.max(in_core).sqrt()
    }

    /// A lower bound of the distance between the core and the plane of a triangle; 0 for one without area.
    fn distance_to_plane_of(&self, [a, b, c]: &[Point3<f64>; 3]) -> f64 {
        let Some(normal) = (b - a).cross(&(c - a)).try_normalize(f64::MIN_POSITIVE) else {
            return 0.0;
        };
        let reach = self.rotation.tr_mul(&normal).abs().dot(&self.half);
        normal.dot(&(self.center - a.coords)).abs() - reach
    }
}

fn bounds_distance(node: &BvhNode, low: &Point3<f64>, high: &Point3<f64>) -> f64 {
    let (center, half) = parry_bridge::node_bounds(node);
    let middle = (low.coords + high.coords) / 2.0;
    let reach = (high - low) / 2.0 + Vector3::from(half);
    ((middle - Vector3::from(center)).abs() - reach)
        .sup(&Vector3::zeros())
        .norm()
}
