//! The features of a grasp: what the network is told of object, action and constraint.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use prehend_geometry::{OrientedBox, Tetrahedron, convex_hull, largest_tetrahedron, union_volume};

/// Radius (m) of the sphere on which palm positions are measured, for all objects and hands.
pub const UPOS_RADIUS: f64 = 0.30;

/// Extents (m) of a box, its axes matched to x, y, z (`size`).
///
/// Of the six ways to name the axes the one with the largest Σ |axis · e| is taken, ties to the first in lexicographic
/// order, so that a bottle on its side and upright differ, but no axis ever counts twice.
///
/// ```
/// use nalgebra::{Point3, Rotation3, Vector3};
/// use prehend_geometry::OrientedBox;
///
/// let lying = Rotation3::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2);
/// let bottle = OrientedBox::new(Point3::origin(), lying, Vector3::new(0.07, 0.08, 0.25))?;
/// let size = prehend_grasp::object_size(&bottle);
/// assert_eq!(size, [0.25, 0.08, 0.07]);
/// # Ok::<(), prehend_geometry::GeometryError>(())
/// ```
pub fn object_size(root: &OrientedBox) -> [f64; 3] {
    let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let fit = |order: &[usize; 3]| -> f64 { (0..3).map(|k| root.axis(order[k])[k].abs()).sum() };
    let mut best = orders[0];
    for order in &orders[1..] {
        // Rounding must not choose between equal matches.
        if fit(order) > fit(&best) + 1e-9 {
            best = *order;
        }
    }
    best.map(|axis| root.extents()[axis])
}

/// Where the hand comes from (`upos`): the line through the palm along the approach meets the sphere of
/// [`UPOS_RADIUS`] about `center`; the point on the side that the hand comes from, as a unit vector from `center`.
///
/// With w = palm − center and d = −approach: λ = −w·d + √((w·d)² − |w|² + r²), upos = (w + λ d) / r.
/// `None` where the palm is on or outside the sphere.
///
/// Source: paper, section V-B, "Unified Position (A₂)"; the paper leaves the choice of the meeting point open.
pub fn unified_position(object_from_palm: &Isometry3<f64>, center: &Point3<f64>) -> Option<[f64; 3]> {
    let w = object_from_palm.translation.vector - center.coords;
    if w.norm() >= UPOS_RADIUS {
        return None;
    }
    let d = -(object_from_palm.rotation * Vector3::z());
    let along = w.dot(&d);
    let lambda = -along + (along * along - w.norm_squared() + UPOS_RADIUS * UPOS_RADIUS).sqrt();
    Some((w + d * lambda).normalize().into())
}

/// Orientation of the palm frame in the object's frame (`dir`): unit quaternion w, x, y, z with w ≥ 0; where w is 0,
/// the first of x, y, z that is not 0 is positive.
pub fn palm_orientation(object_from_palm: &UnitQuaternion<f64>) -> [f64; 4] {
    let q = object_from_palm.coords;
    let wxyz = [q.w, q.x, q.y, q.z];
    let negative = wxyz.iter().find(|c| **c != 0.0).is_some_and(|c| *c < 0.0);
    // Adding 0 turns −0 into 0.
    wxyz.map(|c| if negative { -c + 0.0 } else { c + 0.0 })
}

/// How much of an object a grasp leaves free, two ways; see [`free_volume`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeVolume {
    /// 1 − Σ vol(Δ ∩ Bᵢ) / Σ vol(Bᵢ): regions that boxes share count once per box.
    pub fvol: f64,
    /// 1 − vol(Δ ∩ ∪Bᵢ) / vol(∪Bᵢ): they count once.
    pub fvol_union: f64,
}

/// Fraction of the object's volume that a grasp leaves uncovered (`fvol`).
///
/// ```text
/// fvol = 1 − Σᵢ vol(Δ ∩ Bᵢ) / Σᵢ vol(Bᵢ)
/// ```
///
/// Δ is the largest tetrahedron of the palm frame's origin and three contacts, `boxes` the decomposition; all in the
/// object's frame, metres. The result is in [0, 1]; fewer than three contacts or a flat Δ cover nothing and give 1, and
/// so does an object without boxes.
///
/// Source: paper, section V-B, "Free Volume (C₁)".
pub fn free_volume(palm: &Point3<f64>, contacts: &[Point3<f64>], boxes: &[OrientedBox]) -> FreeVolume {
    let all: f64 = boxes.iter().map(OrientedBox::volume).sum();
    free_volume_with(palm, contacts, boxes, all, union_volume(boxes))
}

/// `fvol` of [`free_volume`] with the convex hull of the palm and all contacts for Δ: what the whole hand encloses.
///
/// At most what [`free_volume`] gives, in [0, 1]; 1 where palm and contacts lie in one plane or are fewer than four, where
/// one of them is not finite, and for an object without boxes. The order of the contacts does not matter beyond rounding.
///
/// ```
/// use nalgebra::Point3;
/// use prehend_geometry::OrientedBox;
///
/// // Four contacts and the palm span a pyramid, a third of its cube; the largest tetrahedron is half of it.
/// let cube = OrientedBox::new(Point3::new(0.5, 0.5, 0.5), nalgebra::Rotation3::identity(), [1.0; 3].into())?;
/// let palm = Point3::new(0.5, 0.5, 1.0);
/// let contacts = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| Point3::new(x, y, 0.0));
/// let of_hull = prehend_grasp::free_volume_of_hull(&palm, &contacts, &[cube]);
/// assert!((of_hull - 2.0 / 3.0).abs() < 1e-12);
/// assert!((prehend_grasp::free_volume(&palm, &contacts, &[cube]).fvol - 5.0 / 6.0).abs() < 1e-12);
/// # Ok::<(), prehend_geometry::GeometryError>(())
/// ```
pub fn free_volume_of_hull(palm: &Point3<f64>, contacts: &[Point3<f64>], boxes: &[OrientedBox]) -> f64 {
    let all: f64 = boxes.iter().map(OrientedBox::volume).sum();
    let points: Vec<Point3<f64>> = std::iter::once(palm).chain(contacts).copied().collect();
    let mut covered = 0.0;
    if let Ok(hull) = convex_hull(&points)
        && hull.rank() == 3
    {
        // Faces and one corner span tetrahedra that share faces only; those of the corner's own faces are flat.
        let apex = hull.points()[0];
        for face in hull.triangles().iter().filter(|face| !face.contains(&0)) {
            let [a, b, c] = face.map(|i| hull.points()[i as usize]);
            let part = Tetrahedron([apex, a, b, c]);
            covered += boxes.iter().map(|b| part.intersection_volume(b)).sum::<f64>();
        }
    }
    if covered > 0.0 {
        (1.0 - covered / all).clamp(0.0, 1.0)
    } else {
        1.0
    }
}

/// [`free_volume`] where the volumes of all boxes are already known.
pub(crate) fn free_volume_with(
    palm: &Point3<f64>,
    contacts: &[Point3<f64>],
    boxes: &[OrientedBox],
    sum: f64,
    union: f64,
) -> FreeVolume {
    let Some(enclosure) = largest_tetrahedron(*palm, contacts).filter(|_| sum > 0.0) else {
        return FreeVolume {
            fvol: 1.0,
            fvol_union: 1.0,
        };
    };
    let covered: f64 = boxes.iter().map(|b| enclosure.intersection_volume(b)).sum();
    FreeVolume {
        fvol: (1.0 - covered / sum).clamp(0.0, 1.0),
        fvol_union: (1.0 - enclosure.union_volume(boxes) / union).clamp(0.0, 1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    #[test]
    fn a_palm_straight_above_the_centre_is_measured_at_the_north_pole_whatever_its_height() {
        for height in [0.05, 0.2, -0.1] {
            let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
            let palm = Isometry3::from_parts(nalgebra::Translation3::new(0.0, 0.0, height), down);
            let upos = unified_position(&palm, &Point3::origin()).unwrap();
            assert!((Vector3::from(upos) - Vector3::z()).norm() < 1e-12);
        }
    }

    #[test]
    fn the_meeting_point_lies_on_the_approach_line_on_the_side_of_the_hand() {
        let turn = UnitQuaternion::from_euler_angles(0.4, 1.1, -2.0);
        let palm = Isometry3::from_parts(nalgebra::Translation3::new(0.1, -0.05, 0.12), turn);
        let center = Point3::new(0.01, 0.02, 0.03);
        let upos = Vector3::from(unified_position(&palm, &center).unwrap());
        assert!((upos.norm() - 1.0).abs() < 1e-12);
        let back = center.coords + upos * UPOS_RADIUS - palm.translation.vector;
        assert!(
            (back.normalize() + turn * Vector3::z()).norm() < 1e-9,
            "behind the palm"
        );
    }

    #[test]
    fn a_palm_outside_the_sphere_has_no_unified_position() {
        let palm = Isometry3::translation(0.0, 0.0, UPOS_RADIUS);
        assert_eq!(unified_position(&palm, &Point3::origin()), None);
    }

    #[test]
    fn orientation_and_its_negative_are_stored_alike() {
        let q = nalgebra::Quaternion::new(-0.5, 0.5, -0.5, 0.5);
        for q in [q, -q] {
            let q = UnitQuaternion::new_unchecked(q);
            assert_eq!(palm_orientation(&q), [0.5, -0.5, 0.5, -0.5]);
        }
        let half_turn = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(-0.0, 0.0, -0.6, 0.8));
        assert_eq!(palm_orientation(&half_turn), [0.0, 0.0, 0.6, -0.8]);
    }

    #[test]
    fn a_box_turned_by_a_little_keeps_the_order_of_its_extents() {
        let turn = Rotation3::from_euler_angles(0.3, -0.2, 0.4);
        let root = OrientedBox::new(Point3::origin(), turn, Vector3::new(0.1, 0.2, 0.3)).unwrap();
        assert_eq!(object_size(&root), [0.1, 0.2, 0.3]);
    }

    #[test]
    fn a_corner_tetrahedron_leaves_five_sixths_of_a_cube() {
        let cube = OrientedBox::centered([1.0; 3]);
        let corner = cube.min_corner();
        let contacts = [Vector3::x(), Vector3::y(), Vector3::z()].map(|e| corner + e);
        let free = free_volume(&corner, &contacts, &[cube]);
        assert!((free.fvol - 5.0 / 6.0).abs() < 1e-12 && (free.fvol_union - 5.0 / 6.0).abs() < 1e-12);
        // The same box twice: both numerator and denominator double.
        let doubled = free_volume(&corner, &contacts, &[cube, cube]);
        assert!((doubled.fvol - free.fvol).abs() < 1e-12 && (doubled.fvol_union - free.fvol).abs() < 1e-12);
    }

    #[test]
    fn two_contacts_or_none_leave_everything_free() {
        let cube = OrientedBox::centered([1.0; 3]);
        let free = free_volume(&Point3::origin(), &[cube.min_corner(); 2], &[cube]);
        assert_eq!((free.fvol, free.fvol_union), (1.0, 1.0));
    }

    #[test]
    fn the_hull_covers_no_less_than_the_largest_tetrahedron_and_flat_ones_nothing() {
        let cube = OrientedBox::centered([0.1; 3]);
        let palm = Point3::new(0.0, 0.01, 0.07);
        let contacts: Vec<_> = (0..12)
            .map(|i| {
                let turn = f64::from(i) * 2.4;
                Point3::new(0.05 * turn.cos(), 0.05 * turn.sin(), 0.004 * f64::from(i) - 0.03)
            })
            .collect();
        let of_hull = free_volume_of_hull(&palm, &contacts, &[cube]);
        assert!(of_hull < free_volume(&palm, &contacts, &[cube]).fvol - 0.01);
        let mut reversed = contacts.clone();
        reversed.reverse();
        assert!((free_volume_of_hull(&palm, &reversed, &[cube]) - of_hull).abs() < 1e-12);
        // Three contacts span the tetrahedron itself.
        let three = &contacts[..3];
        let same = free_volume(&palm, three, &[cube, cube]);
        assert!((free_volume_of_hull(&palm, three, &[cube, cube]) - same.fvol).abs() < 1e-12);
        let flat: Vec<_> = contacts.iter().map(|p| Point3::new(p.x, p.y, 0.07)).collect();
        for (contacts, boxes) in [
            (&flat[..], &[cube][..]),
            (&contacts[..2], &[cube]),
            (&contacts, &[]),
        ] {
            assert_eq!(free_volume_of_hull(&palm, contacts, boxes), 1.0);
        }
    }
}
