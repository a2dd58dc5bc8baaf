//! Where a link touches, reduced to a small set of points that hardly moves when the hand hardly moves.
//!
//! ```text
//!   · · · · · ·        ●─────────●      Pairs of features that come near (·) with about one normal are a patch. Its convex
//!   · · · · · ·   ──▶  │  patch  │      outline, seen along the normal, loses corners (●), always the one that costs least
//!   · · · · · ·        ●─────────●      area, until at most four are left and none are close together.
//! ```

use nalgebra::{Point3, UnitVector3, Vector3};
use prehend_geometry::ContactPoint;

/// Contacts of a link closer to each other than this are one, metres.
pub const MERGE_DISTANCE: f64 = 3e-3;
/// Soft contacts closer to each other than this are one, metres: each stands for what a fingertip of rubber flattens
/// against around it, 3.5 mm to either side, and has the torsion of all that.
pub const SOFT_MERGE_DISTANCE: f64 = 7e-3;
/// Corners of a patch, at most.
pub const MOST_CORNERS: usize = 4;
/// Normals with a larger dot product (15°) belong to one patch: facets of a round body, and the noise of a scan.
const SAME_PATCH: f64 = 0.966;
/// Normals with a larger dot product (2.6°) are told apart no further.
const SAME_NORMAL: f64 = 1.0 - 1e-3;
/// Two corners of a flat patch are as close as each other, but for rounding, metres.
const SAME_WEIGHT: f64 = 1e-6;

/// Features of a link and of the object that come near each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Candidate {
    pub(crate) at: ContactPoint,
    /// How much it counts, metres: the closer, the more; nothing where the two hardly touch.
    pub(crate) weight: f64,
}

/// A few contacts that stand for all candidates of a link.
///
/// Every patch has one normal, the mean of its candidates'. Its contacts are among the candidates' points; no two are
/// closer than `apart` (m).
pub(crate) fn reduced(candidates: &[Candidate], apart: f64) -> Vec<ContactPoint> {
    let mut kept: Vec<ContactPoint> = Vec::new();
    for patch in patches(candidates) {
        for point in patch.corners(apart) {
            if kept.iter().all(|k| (k.point - point).norm() >= apart) {
                let normal = patch.normal;
                kept.push(ContactPoint { point, normal });
            }
        }
    }
    kept
}

/// Candidates with about one normal.
#[derive(Debug, Clone, Default)]
struct Group {
    members: Vec<Candidate>,
    weight: f64,
    sum: Vector3<f64>,
}

impl Group {
    fn add(&mut self, candidate: Candidate) {
        self.members.push(candidate);
        self.weight += candidate.weight;
        self.sum += candidate.at.normal.into_inner() * candidate.weight;
    }

    fn normal(&self) -> UnitVector3<f64> {
        UnitVector3::try_new(self.sum, 0.0).unwrap_or(self.members[0].at.normal)
    }
}

/// The patches, the one that touches most first: around the direction that most candidates are near, then around what is
/// most frequent of the rest.
fn patches(candidates: &[Candidate]) -> Vec<Patch> {
    let mut groups: Vec<(UnitVector3<f64>, Group)> = Vec::new();
    for candidate in candidates {
        let normal = candidate.at.normal;
        let own = groups.iter().position(|(n, _)| n.dot(&normal) > SAME_NORMAL);
        let own = own.unwrap_or_else(|| {
            groups.push((normal, Group::default()));
            groups.len() - 1
        });
        groups[own].1.add(*candidate);
    }
    let mut groups: Vec<Group> = groups.into_iter().map(|(_, group)| group).collect();
    let mut found = Vec::new();
    while !groups.is_empty() {
        let normals: Vec<_> = groups.iter().map(Group::normal).collect();
        let support = |n: &UnitVector3<f64>| -> f64 {
            let near = groups.iter().zip(&normals).filter(|(_, m)| m.dot(n) > SAME_PATCH);
            near.map(|(group, _)| group.weight).sum()
        };
        let most = normals
            .iter()
            .map(|n| (support(n), *n))
            .reduce(|a, b| if b.0 > a.0 { b } else { a });
        let Some((_, middle)) = most else { break };
        let (own, rest): (Vec<_>, Vec<_>) = groups
            .into_iter()
            .partition(|g| g.normal().dot(&middle) > SAME_PATCH);
        let mut patch = Group::default();
        own.iter().flat_map(|g| &g.members).for_each(|c| patch.add(*c));
        found.push(Patch {
            normal: patch.normal(),
            candidates: patch.members,
        });
        groups = rest;
    }
    found
}

struct Patch {
    normal: UnitVector3<f64>,
    candidates: Vec<Candidate>,
}

impl Patch {
    /// At most four points no two of which are close: the corners of a face, the ends of a line, or the middle.
    fn corners(&self, apart: f64) -> Vec<Point3<f64>> {
        let mut corners = self.outline();
        while corners.len() > 2 {
            let n = corners.len();
            let edge = |i: usize| (corners[(i + 1) % n].0 - corners[i].0).norm();
            let shortest = (0..n).fold(0, |a, b| if edge(b) < edge(a) { b } else { a });
            // What the outline loses with a corner.
            let area = |i: usize| {
                let (back, on) = (
                    corners[(i + n - 1) % n].0 - corners[i].0,
                    corners[(i + 1) % n].0 - corners[i].0,
                );
                back.cross(&on).dot(&self.normal).abs()
            };
            let cheaper = |a: usize, b: usize| if area(b) < area(a) { b } else { a };
            let dropped = if n > MOST_CORNERS {
                (0..n).fold(0, cheaper)
            } else if edge(shortest) < apart {
                // The closer one stays: at the end of a line that is the one on the line.
                let (first, second) = (shortest, (shortest + 1) % n);
                let more = self.weight(corners[second].1) - self.weight(corners[first].1);
                match more.abs() > SAME_WEIGHT {
                    true if more > 0.0 => first,
                    true => second,
                    false => cheaper(first, second),
                }
            } else {
                break;
            };
            corners.remove(dropped);
        }
        let is_dot = corners.len() < 2 || (corners[0].0 - corners[1].0).norm() < apart;
        if corners.len() <= 2 && is_dot {
            return vec![self.middle()];
        }
        corners
            .into_iter()
            .map(|(_, i)| self.candidates[i].at.point)
            .collect()
    }

    fn weight(&self, candidate_idx: usize) -> f64 {
        self.candidates[candidate_idx].weight
    }

    /// The candidate nearest to the mean.
    fn middle(&self) -> Point3<f64> {
        let weight: f64 = self.candidates.iter().map(|c| c.weight).sum();
        let sum: Vector3<f64> = self.candidates.iter().map(|c| c.at.point.coords * c.weight).sum();
        let points = self.candidates.iter().map(|c| c.at.point);
        let first = self.candidates[0].at.point;
        let mean = if weight > 0.0 {
            Point3::from(sum / weight)
        } else {
            first
        };
        points.fold(first, |a, b| {
            if (b - mean).norm_squared() < (a - mean).norm_squared() {
                b
            } else {
                a
            }
        })
    }

    /// Corners of the convex outline, in the plane across the normal, each with the candidate that it stands for.
    fn outline(&self) -> Vec<(Vector3<f64>, usize)> {
        let across = if self.normal.x.abs() < 0.9 {
            Vector3::x()
        } else {
            Vector3::y()
        };
        let u = self.normal.cross(&across).normalize();
        let v = self.normal.cross(&u);
        let flat = |p: &Point3<f64>| (p.coords.dot(&u), p.coords.dot(&v));
        let mut places: Vec<((f64, f64), usize)> = self
            .candidates
            .iter()
            .enumerate()
            .map(|(i, c)| (flat(&c.at.point), i))
            .collect();
        let order = |a: &(f64, f64), b: &(f64, f64)| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1));
        places.sort_by(|a, b| order(&a.0, &b.0).then(a.1.cmp(&b.1)));
        places.dedup_by(|b, a| a.0 == b.0);
        let turn = |o: (f64, f64), a: (f64, f64), b: (f64, f64)| {
            (a.0 - o.0) * (b.1 - o.1) - (a.1 - o.1) * (b.0 - o.0)
        };
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
        let mut corners = chain(&mut places.iter());
        corners.extend(chain(&mut places.iter().rev()));
        corners
            .into_iter()
            .map(|((x, y), i)| (u * x + v * y, i))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reduced(candidates: &[Candidate]) -> Vec<ContactPoint> {
        super::reduced(candidates, MERGE_DISTANCE)
    }

    fn candidates(points: &[[f64; 3]], normal: Vector3<f64>) -> Vec<Candidate> {
        let normal = UnitVector3::new_normalize(normal);
        let at = |p: &[f64; 3]| ContactPoint {
            point: Point3::from(*p),
            normal,
        };
        points
            .iter()
            .map(|p| Candidate {
                at: at(p),
                weight: 1e-4,
            })
            .collect()
    }

    fn sorted(kept: &[ContactPoint]) -> Vec<[f64; 3]> {
        let mut points: Vec<[f64; 3]> = kept.iter().map(|k| k.point.coords.into()).collect();
        points.sort_by(|a, b| a.partial_cmp(b).unwrap());
        points
    }

    /// Points of a grid in the plane z = 0.1, `step` apart.
    fn grid(nx: u32, ny: u32, step: f64) -> Vec<[f64; 3]> {
        (0..nx)
            .flat_map(|i| (0..ny).map(move |j| [f64::from(i) * step, f64::from(j) * step, 0.1]))
            .collect()
    }

    #[test]
    fn a_flat_patch_keeps_its_four_corners() {
        let kept = reduced(&candidates(&grid(11, 6, 2e-3), Vector3::z()));
        let corners = [
            [0.0, 0.0, 0.1],
            [0.0, 0.01, 0.1],
            [0.02, 0.0, 0.1],
            [0.02, 0.01, 0.1],
        ];
        assert_eq!(sorted(&kept), corners);
    }

    #[test]
    fn a_round_patch_keeps_four_points_however_finely_it_is_cut() {
        for n in [5u32, 16, 200] {
            let on_circle = |i: u32| {
                let (s, c) = (f64::from(i) / f64::from(n) * std::f64::consts::TAU).sin_cos();
                [0.01 * c, 0.01 * s, 0.0]
            };
            let kept = reduced(&candidates(
                &(0..n).map(on_circle).collect::<Vec<_>>(),
                Vector3::z(),
            ));
            assert_eq!(kept.len(), MOST_CORNERS);
        }
    }

    #[test]
    fn a_line_keeps_its_ends_and_a_dot_one_point() {
        let line: Vec<[f64; 3]> = (0..9).map(|i| [f64::from(i) * 2e-3, 0.0, 0.0]).collect();
        assert_eq!(
            sorted(&reduced(&candidates(&line, Vector3::z()))),
            [[0.0; 3], [0.016, 0.0, 0.0]]
        );
        // A line half a millimetre wide has two ends, too.
        let kept = reduced(&candidates(&grid(41, 2, 5e-4), Vector3::z()));
        assert_eq!(kept.len(), 2);
        assert!((kept[0].point - kept[1].point).norm() >= 0.02);
        let dot = candidates(&[[0.0; 3], [1e-4, 0.0, 0.0], [0.0, 1e-3, 0.0]], Vector3::y());
        assert_eq!(reduced(&dot).len(), 1);
    }

    #[test]
    fn facets_of_a_wall_are_one_patch_and_faces_of_a_corner_are_two() {
        let plate = grid(2, 2, 0.01);
        let tilted = |degrees: f64| {
            let (s, c) = degrees.to_radians().sin_cos();
            Vector3::new(s, 0.0, c)
        };
        let wall: Vec<_> = [-5.0, 0.0, 5.0]
            .iter()
            .flat_map(|d| candidates(&plate, tilted(*d)))
            .collect();
        let kept = reduced(&wall);
        assert_eq!(kept.len(), 4);
        assert!(
            kept.iter()
                .all(|k| (k.normal.into_inner() - Vector3::z()).norm() < 1e-12)
        );
        let mut corner = candidates(&plate, Vector3::z());
        corner.extend(candidates(&[[0.02, 0.0, 0.11], [0.02, 0.01, 0.11]], Vector3::x()));
        assert_eq!(reduced(&corner).len(), 6);
    }

    #[test]
    fn copies_and_points_in_between_change_nothing() {
        let plate = candidates(&grid(2, 2, 0.01), Vector3::z());
        let mut more = candidates(&grid(21, 21, 5e-4), Vector3::z());
        more.extend(plate.iter().chain(&plate));
        assert_eq!(sorted(&reduced(&plate)), sorted(&reduced(&more)));
    }

    #[test]
    fn what_lies_within_the_reach_of_one_soft_contact_is_one() {
        let pad = candidates(&grid(2, 2, 4e-3), Vector3::z());
        assert_eq!(reduced(&pad).len(), 4);
        assert_eq!(super::reduced(&pad, SOFT_MERGE_DISTANCE).len(), 1);
    }

    #[test]
    fn nothing_gives_nothing() {
        assert!(reduced(&[]).is_empty());
    }
}
