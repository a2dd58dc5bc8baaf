//! Where the links touch: patches, reduced to a few points each.

use nalgebra::{Isometry3, Point3, UnitVector3, Vector3};
use prehend_geometry::{ContactPoint, Gap};

use crate::grasp_hand::GraspHand;
use crate::{GraspObject, LinkContact};

/// Features of link and object closer than this touch, metres.
pub const CONTACT_TOLERANCE: f64 = 2e-4;
/// Contacts of a link closer to each other than this are one, metres.
pub const MERGE_DISTANCE: f64 = 3e-3;
/// Normals with a larger dot product belong to one patch.
const SAME_NORMAL: f64 = 1.0 - 1e-3;

/// All contacts of a posture, in order of the links.
///
/// Every pair of features (vertex and face, edge and edge) of link and object closer than [`CONTACT_TOLERANCE`] is a
/// candidate: its point lies on the object, its normal is the direction of separation, from link to object. In the
/// middle of a face that is the face's normal; on an edge or a vertex it lies between the normals of the faces around,
/// so that facets of a round body do not matter. Candidates of a link with one normal form a patch, of which the
/// corners of its convex outline stay; corners within [`MERGE_DISTANCE`] of each other become one.
pub(crate) fn contacts_of(
    hand: &GraspHand<'_>,
    object: &GraspObject,
    solid_poses: &[Isometry3<f64>],
) -> Vec<LinkContact> {
    let mut contacts = Vec::new();
    let mut first = 0;
    while first < hand.solids.len() {
        let link = hand.solids[first].link;
        let n_of_link = hand.solids[first..].iter().take_while(|s| s.link == link).count();
        let mut candidates = Vec::new();
        for i in first..first + n_of_link {
            let collider = &hand.solids[i].collider;
            if object.surface().gap_lower_bound(collider, &solid_poses[i]) < CONTACT_TOLERANCE {
                let pairs = object
                    .surface()
                    .touching(collider, &solid_poses[i], CONTACT_TOLERANCE);
                candidates.extend(pairs.iter().filter_map(|gap| contact_point(object, gap)));
            }
        }
        let (mu, torsion) = hand.contact_law(first, object.material());
        contacts.extend(reduced(&candidates).into_iter().map(|at| LinkContact {
            link,
            at,
            mu,
            torsion,
        }));
        first += n_of_link;
    }
    contacts
}

fn contact_point(object: &GraspObject, gap: &Gap) -> Option<ContactPoint> {
    let towards_object = gap.on_surface - gap.on_solid;
    // Features that coincide have no direction of separation; the face's normal has to do.
    let normal = UnitVector3::try_new(towards_object, 1e-9)
        .or_else(|| object.surface().face_normal(gap.triangle).map(|n| -n))?;
    Some(ContactPoint {
        point: gap.on_surface,
        normal,
    })
}

/// A few contacts that stand for all candidates of a link.
fn reduced(candidates: &[ContactPoint]) -> Vec<ContactPoint> {
    let mut patches: Vec<(UnitVector3<f64>, Vec<Point3<f64>>)> = Vec::new();
    for candidate in candidates {
        match patches
            .iter_mut()
            .find(|(n, _)| n.dot(&candidate.normal) > SAME_NORMAL)
        {
            Some((_, points)) => points.push(candidate.point),
            None => patches.push((candidate.normal, vec![candidate.point])),
        }
    }
    // Large patches first: what a patch of a grazed edge adds near them says nothing new.
    let mut outlines: Vec<_> = patches
        .iter()
        .map(|(n, points)| (*n, outline(n, points)))
        .collect();
    outlines.sort_by(|a, b| perimeter(&b.1).total_cmp(&perimeter(&a.1)));
    let mut kept: Vec<ContactPoint> = Vec::new();
    for (normal, points) in outlines {
        for point in spread(&points) {
            if kept.iter().all(|k| (k.point - point).norm() >= MERGE_DISTANCE) {
                kept.push(ContactPoint { point, normal });
            }
        }
    }
    kept
}

fn perimeter(points: &[Point3<f64>]) -> f64 {
    (0..points.len())
        .map(|i| (points[(i + 1) % points.len()] - points[i]).norm())
        .sum()
}

/// Points in the order in which each is farthest from the ones before, until all are near one: the corners that tell most.
fn spread(points: &[Point3<f64>]) -> Vec<Point3<f64>> {
    let mut chosen: Vec<Point3<f64>> = Vec::new();
    let center = points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / points.len() as f64;
    loop {
        let room = |p: &Point3<f64>| match chosen.as_slice() {
            [] => (p.coords - center).norm() + MERGE_DISTANCE,
            _ => chosen
                .iter()
                .map(|c| (p - c).norm())
                .fold(f64::INFINITY, f64::min),
        };
        let Some(next) = points
            .iter()
            .copied()
            .reduce(|a, b| if room(&b) > room(&a) + 1e-9 { b } else { a })
        else {
            return chosen;
        };
        if room(&next) < MERGE_DISTANCE {
            return chosen;
        }
        // Two points closer together than twice the merging distance are one contact in their middle.
        chosen.push(next);
    }
}

/// Corners of the convex outline of points, seen along `normal`: two end points where they lie on a line.
fn outline(normal: &UnitVector3<f64>, points: &[Point3<f64>]) -> Vec<Point3<f64>> {
    let across = if normal.x.abs() < 0.9 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let u = normal.cross(&across).normalize();
    let v = normal.cross(&u);
    // Rounded to a hundredth of a millimetre, so that copies of a corner are one.
    let rounded = |p: &Point3<f64>| ((p.coords.dot(&u) * 1e5).round(), (p.coords.dot(&v) * 1e5).round());
    let mut flat: Vec<((f64, f64), usize)> =
        points.iter().enumerate().map(|(i, p)| (rounded(p), i)).collect();
    flat.sort_by(|a, b| {
        a.0.0
            .total_cmp(&b.0.0)
            .then(a.0.1.total_cmp(&b.0.1))
            .then(a.1.cmp(&b.1))
    });
    flat.dedup_by(|b, a| a.0 == b.0);
    if flat.len() <= 2 {
        return flat.iter().map(|(_, i)| points[*i]).collect();
    }
    let turn =
        |o: (f64, f64), a: (f64, f64), b: (f64, f64)| (a.0 - o.0) * (b.1 - o.1) - (a.1 - o.1) * (b.0 - o.0);
    let chain = |order: &mut dyn Iterator<Item = &((f64, f64), usize)>| {
        let mut half: Vec<((f64, f64), usize)> = Vec::new();
        for p in order {
            while half.len() >= 2 && turn(half[half.len() - 2].0, half[half.len() - 1].0, p.0) <= 0.0 {
                half.pop();
            }
            half.push(*p);
        }
        half.pop();
        half
    };
    let mut corners = chain(&mut flat.iter());
    corners.extend(chain(&mut flat.iter().rev()));
    corners.iter().map(|(_, i)| points[*i]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidates(points: &[[f64; 3]], normal: Vector3<f64>) -> Vec<ContactPoint> {
        let normal = UnitVector3::new_normalize(normal);
        points
            .iter()
            .map(|p| ContactPoint {
                point: Point3::from(*p),
                normal,
            })
            .collect()
    }

    #[test]
    fn a_flat_patch_keeps_its_four_corners() {
        let grid: Vec<[f64; 3]> = (0..11)
            .flat_map(|i| (0..6).map(move |j| [f64::from(i) * 2e-3, f64::from(j) * 2e-3, 0.1]))
            .collect();
        let mut kept = reduced(&candidates(&grid, Vector3::z()));
        kept.sort_by(|a, b| (a.point.x + 0.1 * a.point.y).total_cmp(&(b.point.x + 0.1 * b.point.y)));
        let points: Vec<[f64; 3]> = kept.iter().map(|k| k.point.coords.into()).collect();
        assert_eq!(
            points,
            [
                [0.0, 0.0, 0.1],
                [0.0, 0.01, 0.1],
                [0.02, 0.0, 0.1],
                [0.02, 0.01, 0.1]
            ]
        );
    }

    #[test]
    fn a_line_keeps_its_ends_and_a_dot_one_point() {
        let line: Vec<[f64; 3]> = (0..9).map(|i| [f64::from(i) * 2e-3, 0.0, 0.0]).collect();
        let xs: Vec<f64> = reduced(&candidates(&line, Vector3::z()))
            .iter()
            .map(|k| k.point.x)
            .collect();
        assert_eq!(xs.len(), 2);
        assert!(xs.contains(&0.0) && xs.contains(&0.016));
        let dot = candidates(&[[0.0; 3], [1e-4, 0.0, 0.0], [0.0, 1e-3, 0.0]], Vector3::y());
        assert_eq!(reduced(&dot).len(), 1);
    }

    #[test]
    fn two_faces_of_a_corner_give_patches_of_their_own() {
        let mut both = candidates(
            &[
                [0.0, 0.0, 0.0],
                [0.01, 0.0, 0.0],
                [0.0, 0.01, 0.0],
                [0.01, 0.01, 0.0],
            ],
            Vector3::z(),
        );
        both.extend(candidates(&[[0.02, 0.0, 0.01], [0.02, 0.01, 0.01]], Vector3::x()));
        assert_eq!(reduced(&both).len(), 6);
    }
}
