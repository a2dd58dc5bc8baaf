//! How far two placed solids are from each other.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::closest;
use crate::collider::{Collider, Core};
use crate::core_distance::segment;
use crate::parry_bridge::{self, Closest};

impl Collider {
    /// Distance to another solid placed in this one's frame by `self_from_other`; `None` where it is `cutoff` or more.
    ///
    /// 0 where they overlap (meshes count as shells). Exact up to rounding.
    pub fn distance_to(&self, other: &Self, self_from_other: &Isometry3<f64>, cutoff: f64) -> Option<f64> {
        let (a, b) = (self.bounding_ball(), other.bounding_ball());
        if (self_from_other * b.center - a.center).norm() - a.radius - b.radius >= cutoff {
            return None;
        }
        let (distance, _) = self.distance_and_direction(other, self_from_other, cutoff)?;
        Some(distance)
    }

    /// How far apart two convex solids are along a unit direction from this one to the other; less than their distance, or
    /// negative, where it is not the best one. Of a mesh it is that of its hull.
    pub fn apart_along(
        &self,
        other: &Self,
        self_from_other: &Isometry3<f64>,
        direction: &Vector3<f64>,
    ) -> f64 {
        let reach = self.hull.farthest(&Isometry3::identity(), direction);
        let start = other.hull.farthest(self_from_other, &-*direction);
        direction.dot(&(start - reach)) - self.radius - other.radius
    }

    /// [`distance_to`](Self::distance_to) with the unit direction from this solid to the other one along which they are so
    /// far apart; `None` for the direction where the two overlap or one is a mesh.
    pub fn distance_and_direction(
        &self,
        other: &Self,
        self_from_other: &Isometry3<f64>,
        cutoff: f64,
    ) -> Option<(f64, Option<Vector3<f64>>)> {
        let radii = self.radius + other.radius;
        let (on_self, on_other) = self.closest_to(other, self_from_other, cutoff + radii)?;
        let between = on_other - on_self;
        let distance = (between.norm() - radii).max(0.0);
        let is_mesh = |c: &Self| matches!(c.core, Core::Mesh(_));
        let direction = between
            .try_normalize(1e-6)
            .filter(|_| distance > 0.0 && !is_mesh(self) && !is_mesh(other));
        (distance < cutoff).then_some((distance, direction))
    }

    /// Whether the distance to another solid comes in closed form: both are balls or capsules.
    pub fn is_quick_to(&self, other: &Self) -> bool {
        let is_round = |c: &Self| matches!(c.core, Core::Point | Core::Segment(_));
        is_round(self) && is_round(other)
    }

    /// Closest points of the cores, in this one's frame; equal where they meet. `None` where they are `cutoff` or more
    /// apart, if a tree says so.
    fn closest_to(
        &self,
        other: &Self,
        self_from_other: &Isometry3<f64>,
        cutoff: f64,
    ) -> Option<(Point3<f64>, Point3<f64>)> {
        Some(match (&self.core, &other.core) {
            (Core::Mesh(tree), _) => {
                let near = tree.nearest_core(other, self_from_other, cutoff, None)?;
                (near.on_tree, near.on_core)
            }
            (_, Core::Mesh(tree)) => {
                let near = tree.nearest_core(self, &self_from_other.inverse(), cutoff, None)?;
                (self_from_other * near.on_core, self_from_other * near.on_tree)
            }
            _ if self.is_quick_to(other) => {
                let ends = |c: &Self, pose: &Isometry3<f64>| match c.core {
                    Core::Segment(half) => segment(pose, half),
                    _ => [Point3::from(pose.translation.vector); 2],
                };
                let ([p, q], [r, s]) = (ends(self, &Isometry3::identity()), ends(other, self_from_other));
                closest::of_segments(&p, &q, &r, &s)
            }
            _ => match parry_bridge::body_to_body(&self.hull, &other.hull, self_from_other) {
                Closest::Apart(p, q) => (p, q),
                // An unsettled iteration means that the cores are as good as touching.
                Closest::Intersecting | Closest::Beyond(..) | Closest::Unsettled => {
                    (Point3::origin(), Point3::origin())
                }
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Solid;
    use nalgebra::{Translation3, UnitQuaternion};
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

    #[test]
    fn no_direction_shows_more_than_the_distance_and_that_between_the_closest_points_shows_all_of_it() {
        for a in &kinds() {
            for b in &kinds() {
                for step in 0..20 {
                    // The second one passes by the first and turns.
                    let along = 0.4 - 0.04 * f64::from(step);
                    let turn =
                        UnitQuaternion::from_scaled_axis(Vector3::new(0.3, 0.1, 0.2) * f64::from(step));
                    let pose = Isometry3::from_parts(Translation3::new(along, 0.36, 0.0), turn);
                    let exact = a.distance_to(b, &pose, 1.0).unwrap();
                    let (distance, direction) = a.distance_and_direction(b, &pose, 1.0).unwrap();
                    assert_eq!(distance, exact);
                    assert!(a.apart_along(b, &pose, &Vector3::y()) <= exact + 1e-9);
                    let shown = direction.map_or(exact, |d| a.apart_along(b, &pose, &d));
                    assert!((shown - exact).abs() < 1e-6, "{shown} {exact}");
                }
            }
        }
    }
}
