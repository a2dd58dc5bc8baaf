//! How far two placed solids are from each other.

use nalgebra::{Isometry3, Point3};

use crate::closest;
use crate::collider::{Collider, Core};
use crate::core_distance::segment;
use crate::parry_bridge::{self, Closest, ConvexBody};

impl Collider {
    /// Distance to another solid placed in this one's frame by `self_from_other`; `None` where it is `cutoff` or more.
    ///
    /// 0 where they overlap (meshes count as shells). Exact up to rounding.
    pub fn distance_to(&self, other: &Self, self_from_other: &Isometry3<f64>, cutoff: f64) -> Option<f64> {
        let (a, b) = (self.bounding_ball(), other.bounding_ball());
        if (self_from_other * b.center - a.center).norm() - a.radius - b.radius >= cutoff {
            return None;
        }
        let radii = self.radius + other.radius;
        let core = match (&self.core, &other.core) {
            (Core::Mesh(tree), _) => {
                tree.nearest_core(other, self_from_other, cutoff + radii)?
                    .distance
            }
            (_, Core::Mesh(tree)) => {
                tree.nearest_core(self, &self_from_other.inverse(), cutoff + radii)?
                    .distance
            }
            (Core::Convex(body), _) => bodies(body, &other.body(), self_from_other),
            (_, Core::Convex(body)) => bodies(&self.body(), body, self_from_other),
            _ => {
                let ends = |c: &Self, pose: &Isometry3<f64>| match c.core {
                    Core::Segment(half) => segment(pose, half),
                    _ => [Point3::from(pose.translation.vector); 2],
                };
                let ([p, q], [r, s]) = (ends(self, &Isometry3::identity()), ends(other, self_from_other));
                let (on_self, on_other) = closest::of_segments(&p, &q, &r, &s);
                (on_self - on_other).norm()
            }
        };
        let distance = (core - radii).max(0.0);
        (distance < cutoff).then_some(distance)
    }

    /// The core as a convex body; a mesh has none and gives its corners' hull.
    fn body(&self) -> ConvexBody {
        match &self.core {
            Core::Convex(body) => body.clone(),
            _ => ConvexBody::points(&self.corners),
        }
    }
}

fn bodies(a: &ConvexBody, b: &ConvexBody, a_from_b: &Isometry3<f64>) -> f64 {
    match parry_bridge::body_to_body(a, b, a_from_b) {
        Closest::Apart(p, q) => (p - q).norm(),
        // An unsettled iteration means that the cores are as good as touching.
        Closest::Intersecting | Closest::Beyond(..) | Closest::Unsettled => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Solid;
    use nalgebra::Vector3;
    use std::sync::Arc;

    fn kinds() -> Vec<Collider> {
        let cube = Solid::Cuboid {
            half_extents: Vector3::repeat(0.1),
        };
        let mesh = Solid::Mesh(Arc::new(cube.display_mesh()));
        let hull = Solid::Hull(Arc::new(cube.display_mesh().vertices().to_vec()));
        let ball = Solid::Sphere { radius: 0.1 };
        let capsule = Solid::Capsule {
            half_length: 0.05,
            radius: 0.1,
        };
        let cylinder = Solid::Cylinder {
            half_length: 0.1,
            radius: 0.1,
        };
        [ball, capsule, cylinder, cube, hull, mesh]
            .iter()
            .map(|s| Collider::new(s).unwrap())
            .collect()
    }

    #[test]
    fn any_two_solids_of_half_width_0_1_side_by_side_are_as_far_apart_as_they_stand() {
        for a in &kinds() {
            for b in &kinds() {
                let apart = Isometry3::translation(0.23, 0.0, 0.0);
                let d = a.distance_to(b, &apart, 1.0).unwrap();
                assert!((d - 0.03).abs() < 1e-9, "{d}");
                assert!(a.distance_to(b, &apart, 0.03).is_none_or(|d| d < 0.03 + 1e-12));
                assert!(a.distance_to(b, &apart, 0.02).is_none());
                assert_eq!(
                    a.distance_to(b, &Isometry3::translation(0.19, 0.0, 0.0), 1.0),
                    Some(0.0)
                );
            }
        }
    }
}
