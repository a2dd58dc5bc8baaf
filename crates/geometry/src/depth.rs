//! How deep a solid reaches into an object.

use nalgebra::{Isometry3, Point3};

use crate::collider::{Collider, Core};
use crate::{Surface, closest};

/// Places along a capsule's core and along edges at which depth is measured.
const N_SAMPLES: u32 = 9;

impl Surface {
    /// How deep (m) a placed solid reaches into the object that the surface bounds; 0 where the two are apart.
    ///
    /// The largest of: depths below the surface of places on the solid (along its core, corners, edges), and depths below
    /// the solid's faces of the surface's vertices. For balls and capsules outside by more than half it is exact; else a
    /// lower bound, close where solid and mesh are finely cut. Costs a pass over all triangles for each place: meant for reports.
    pub fn depth(&self, solid: &Collider, surface_from_solid: &Isometry3<f64>) -> f64 {
        let (low, high) = self.axis_aligned_bounds();
        let ball = solid.bounding_ball();
        let center = surface_from_solid * ball.center;
        if (0..3).any(|k| center[k] + ball.radius < low[k] || center[k] - ball.radius > high[k]) {
            return 0.0;
        }
        let below_surface = |p: &Point3<f64>| {
            let distance = self.closest_point(p).distance;
            if self.is_inside(p) { distance } else { -distance }
        };
        let corner = |i: u32| surface_from_solid * solid.corners[i as usize];
        let along_edges = solid.edges.iter().flat_map(|[a, b]| {
            let (p, q) = (corner(*a), corner(*b));
            (1..N_SAMPLES - 1).map(move |i| p + (q - p) * (f64::from(i) / f64::from(N_SAMPLES - 1)))
        });
        let corners = (0..solid.corners.len() as u32).map(corner);
        let of_solid = corners
            .chain(along_edges)
            .map(|p| below_surface(&p))
            .fold(f64::NEG_INFINITY, f64::max);
        // Between the places, the core itself may come closer than any of them.
        let touching = self
            .gap(solid, surface_from_solid, f64::MIN_POSITIVE)
            .map_or(0.0, |g| -g.distance);
        let of_vertices = match solid.core {
            Core::Convex(_) => self.deepest_vertex(solid, surface_from_solid),
            _ => 0.0,
        };
        (of_solid + solid.radius).max(touching).max(of_vertices).max(0.0)
    }

    /// The deepest that a vertex of the surface lies inside a convex solid, measured to the solid's faces.
    fn deepest_vertex(&self, solid: &Collider, surface_from_solid: &Isometry3<f64>) -> f64 {
        let mut deepest = 0.0_f64;
        for p in self.mesh().vertices() {
            let local = surface_from_solid.inverse_transform_point(p);
            let mut least = f64::INFINITY;
            for face in &solid.faces {
                let [a, b, c] = face.map(|i| solid.corners[i as usize]);
                let outside = (b - a).cross(&(c - a)).dot(&(local - a)) > 0.0;
                let distance = (closest::on_triangle(&local, &[a, b, c]) - local).norm();
                least = if outside { 0.0 } else { least.min(distance) };
                if least <= deepest {
                    break;
                }
            }
            if least.is_finite() {
                deepest = deepest.max(least);
            }
        }
        deepest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Solid;
    use nalgebra::Vector3;

    fn block() -> Surface {
        Surface::new(
            Solid::Cuboid {
                half_extents: Vector3::new(0.5, 0.5, 0.5),
            }
            .display_mesh(),
        )
    }

    #[test]
    fn solids_above_a_block_reach_as_deep_as_they_are_lowered() {
        let height = |h: f64| Isometry3::translation(0.0, 0.0, h);
        let solids = [
            Solid::Sphere { radius: 0.1 },
            Solid::Capsule {
                half_length: 0.2,
                radius: 0.1,
            },
            Solid::Cuboid {
                half_extents: Vector3::new(0.2, 0.2, 0.1),
            },
            Solid::Cylinder {
                half_length: 0.1,
                radius: 0.3,
            },
        ];
        for (solid, half_height) in solids.iter().zip([0.1, 0.3, 0.1, 0.1]) {
            let collider = Collider::new(solid).unwrap();
            for sunk in [0.03, 0.15] {
                let depth = block().depth(&collider, &height(0.5 + half_height - sunk));
                assert!((depth - sunk).abs() < 1e-9, "{solid:?}: {depth} {sunk}");
            }
            assert_eq!(block().depth(&collider, &height(0.5 + half_height + 1e-4)), 0.0);
        }
    }

    #[test]
    fn a_plate_pushed_over_a_corner_is_as_deep_as_the_corner_is_in_it() {
        let plate = Collider::new(&Solid::Cuboid {
            half_extents: Vector3::new(2.0, 2.0, 0.1),
        })
        .unwrap();
        let depth = block().depth(&plate, &Isometry3::translation(0.0, 0.0, 0.57));
        assert!((depth - 0.03).abs() < 1e-9, "{depth}");
    }
}
