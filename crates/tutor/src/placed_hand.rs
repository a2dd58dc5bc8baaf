//! The hand's links as solids that a point can be near to.

use nalgebra::{Isometry3, Point3, Vector3};
use prehend_geometry::{Solid, TriMesh, convex_hull};
use prehend_hand::{Hand, JointPositions, LinkIdx};

use crate::TutorError;

/// A hand made ready for judging: its links' collision solids, meshes as their convex hulls.
#[derive(Debug, Clone)]
pub struct TutorHand {
    hand: Hand,
    solids: Vec<LinkSolid>,
}

#[derive(Debug, Clone)]
struct LinkSolid {
    link: LinkIdx,
    link_from_solid: Isometry3<f64>,
    shape: Near,
    /// A ball in the solid's frame that holds it.
    center: Point3<f64>,
    radius: f64,
}

/// A solid, and for a hull the planes of its faces.
#[derive(Debug, Clone)]
enum Near {
    Simple(Solid),
    /// Outward unit normals and offsets of the faces; the hull's surface.
    Hull(Vec<(Vector3<f64>, f64)>, Solid),
}

impl TutorHand {
    /// Prepares a hand. Links without collision solids do not count.
    ///
    /// # Errors
    ///
    /// [`TutorError::NoDescription`] where nothing says how the palm looks, [`TutorError::BadLink`] where a hull
    /// cannot be built.
    pub fn new(hand: &Hand) -> Result<Self, TutorError> {
        if hand.description().is_none() {
            return Err(TutorError::NoDescription {
                hand: hand.name().to_owned(),
            });
        }
        let mut solids = Vec::new();
        for (i, link) in hand.links().iter().enumerate() {
            for placed in &link.collision {
                let bad = |reason: String| TutorError::BadLink {
                    link: link.name.clone(),
                    reason,
                };
                let (shape, center, radius) = near(&placed.solid).map_err(bad)?;
                let link_from_solid = placed.link_from_solid;
                solids.push(LinkSolid {
                    link: LinkIdx(i),
                    link_from_solid,
                    shape,
                    center,
                    radius,
                });
            }
        }
        Ok(Self {
            hand: hand.clone(),
            solids,
        })
    }

    /// The hand.
    pub fn hand(&self) -> &Hand {
        &self.hand
    }

    /// The palm's frame in the object's.
    pub(crate) fn object_from_palm(
        &self,
        object_from_root: &Isometry3<f64>,
        joints: &JointPositions,
    ) -> Isometry3<f64> {
        object_from_root * self.hand.root_from_palm(joints)
    }

    /// The links where they stand; those that keep more than `reach` from the ball (`around`, `radius`) are left out.
    pub(crate) fn placed(
        &self,
        object_from_root: &Isometry3<f64>,
        joints: &JointPositions,
        around: &Point3<f64>,
        radius: f64,
        reach: f64,
    ) -> PlacedHand<'_> {
        let poses = self.hand.link_poses(joints);
        let solids = self.solids.iter().filter_map(|s| {
            let object_from_solid = object_from_root * poses.root_from_link(s.link) * s.link_from_solid;
            let center = object_from_solid * s.center;
            ((center - around).norm() <= radius + s.radius + reach).then(|| Placed {
                solid_from_object: object_from_solid.inverse(),
                center,
                radius: s.radius,
                shape: &s.shape,
            })
        });
        PlacedHand {
            solids: solids.collect(),
        }
    }
}

/// A hand where it stands in the object's frame.
pub(crate) struct PlacedHand<'a> {
    solids: Vec<Placed<'a>>,
}

struct Placed<'a> {
    solid_from_object: Isometry3<f64>,
    center: Point3<f64>,
    radius: f64,
    shape: &'a Near,
}

impl PlacedHand<'_> {
    /// Distance (m) from a point to the nearest link, 0 inside, at most `limit`.
    pub(crate) fn distance(&self, p: &Point3<f64>, limit: f64) -> f64 {
        let mut least = limit;
        for placed in &self.solids {
            let reach = placed.radius + least;
            if (placed.center - p).norm_squared() < reach * reach {
                least = least.min(placed.shape.distance(&(placed.solid_from_object * p), least));
            }
        }
        least
    }

    /// Whether some link comes within `limit` of the point; stops at the first that does.
    pub(crate) fn is_near(&self, p: &Point3<f64>, limit: f64) -> bool {
        self.solids.iter().any(|placed| {
            let reach = placed.radius + limit;
            (placed.center - p).norm_squared() < reach * reach
                && placed.shape.distance(&(placed.solid_from_object * p), limit) < limit
        })
    }
}

impl Near {
    /// Distance, exact below `limit`; anything from `limit` on means farther.
    fn distance(&self, p: &Point3<f64>, limit: f64) -> f64 {
        match self {
            Self::Simple(solid) => solid.distance_to_point(p),
            Self::Hull(planes, surface) => {
                let mut height = f64::NEG_INFINITY;
                for (n, d) in planes {
                    height = height.max(n.dot(&p.coords) - d);
                    // Beyond one face by the limit: no other can bring it nearer.
                    if height >= limit {
                        return height;
                    }
                }
                if height <= 0.0 {
                    0.0
                } else {
                    surface.distance_to_point(p)
                }
            }
        }
    }
}

fn near(solid: &Solid) -> Result<(Near, Point3<f64>, f64), String> {
    let points = match solid {
        Solid::Hull(points) => points.as_slice(),
        Solid::Mesh(mesh) => mesh.vertices(),
        simple => {
            return Ok((
                Near::Simple(simple.clone()),
                Point3::origin(),
                simple.bounding_radius(),
            ));
        }
    };
    let hull = match convex_hull(points) {
        Ok(hull) if hull.volume() > 0.0 => hull,
        // Flat: its own triangles, or the points themselves, are exact.
        _ => {
            return Ok((
                Near::Simple(solid.clone()),
                Point3::origin(),
                solid.bounding_radius(),
            ));
        }
    };
    let corners = hull.points();
    let low = corners
        .iter()
        .fold(Vector3::repeat(f64::INFINITY), |m, p| m.inf(&p.coords));
    let high = corners
        .iter()
        .fold(Vector3::repeat(f64::NEG_INFINITY), |m, p| m.sup(&p.coords));
    let center = Point3::from((low + high) / 2.0);
    let radius = corners.iter().map(|p| (p - center).norm()).fold(0.0, f64::max);
    let planes = hull.triangles().iter().filter_map(|t| {
        let [a, b, c] = t.map(|i| corners[i as usize]);
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0)?;
        Some((normal, normal.dot(&a.coords)))
    });
    let planes = planes.collect();
    let surface = TriMesh::new(corners.to_vec(), hull.triangles().to_vec()).map_err(|e| e.to_string())?;
    Ok((Near::Hull(planes, Solid::Mesh(surface.into())), center, radius))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hull_measures_as_the_box_that_it_is() {
        let half = Vector3::new(0.01, 0.02, 0.03);
        let cuboid = Solid::Cuboid { half_extents: half };
        let corners = (0..8).map(|i| {
            let sign = |k: usize| if i >> k & 1 == 1 { 1.0 } else { -1.0 };
            Point3::new(sign(0) * half.x, sign(1) * half.y, sign(2) * half.z)
        });
        let (hull, center, radius) = near(&Solid::Hull(corners.collect::<Vec<_>>().into())).unwrap();
        assert!(center.coords.norm() < 1e-15 && (radius - half.norm()).abs() < 1e-12);
        for i in 0..200_i32 {
            let f = f64::from(i);
            let p = Point3::new((f * 0.7).sin(), (f * 1.3).sin(), (f * 2.1).cos()) * 0.05;
            let expected = cuboid.distance_to_point(&p);
            let found = hull.distance(&p, 0.03);
            assert!(
                (found - expected).abs() < 1e-12 || (found >= 0.03 && expected >= 0.03),
                "{p}"
            );
        }
    }
}
