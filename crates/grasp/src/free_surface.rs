//! How much of an object's surface a placed hand leaves free, and how much of that in one patch.

use nalgebra::{Isometry3, Point3};
use prehend_geometry::{Collider, Solid, TriMesh};
use prehend_hand::{Hand, JointPositions};

use crate::GraspError;

/// Pieces are at most this share of the clearance long: their middles stand for them.
const PIECE_SHARE: f64 = 0.25;
/// Nor need they be shorter than this share of the object, however small the clearance.
const FINEST_SHARE: f64 = 1.0 / 200.0;
/// Pieces along the longest side of a triangle, at most.
const MOST_PIECES: usize = 256;

/// What of an object's surface stays free; see [`free_surface`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeSurface {
    /// Free area over whole area: in [0, 1].
    pub share: f64,
    /// Area (m²) of the largest connected free patch: at most `share` of the whole area.
    pub largest_patch: f64,
}

/// The part of an object's surface that is farther than `clearance` (m) from every link of a placed hand.
///
/// 25 to 30 mm leave room for another person's fingers. `object_from_root` places the hand's root link in the object's
/// frame. Triangles are cut into pieces with sides of at most a quarter of the clearance (or a 200th of the object); a
/// piece is free where its middle is, so the rim of what is free is off by less than a piece. Pieces that share an edge
/// are connected; triangles do where they name the same two vertices, so a mesh whose vertices are not merged falls
/// apart into its triangles. Both sides of a thin wall count, inside walls of vessels too.
///
/// A mesh without area has nothing free: 0 and 0. Close to what the scripted tutor looks at, so that no experiment that
/// it scores may use it; of use beside labels from people.
///
/// # Errors
///
/// [`GraspError::NotFinite`] for a clearance or pose that is not finite, [`GraspError::NoShape`] for a hand without
/// collision geometry, [`GraspError::Shape`] for one with a shape that cannot be used.
///
/// # Examples
///
/// A ball at one end of a bar leaves the other end free:
///
/// ```
/// use std::collections::BTreeMap;
/// use nalgebra::{Isometry3, Vector3};
/// use prehend_geometry::{Solid, surface_area};
/// use prehend_hand::Hand;
///
/// let urdf = r#"<robot name="ball"><link name="palm">
///   <collision><geometry><sphere radius="0.02"/></geometry></collision></link></robot>"#;
/// let ball = Hand::from_urdf(urdf, &|file| Err(format!("{file} is not at hand")))?;
/// let joints = ball.positions(&BTreeMap::new())?;
/// let bar = Solid::Cuboid { half_extents: Vector3::new(0.1, 0.01, 0.01) }.display_mesh();
/// let at_end = Isometry3::translation(0.12, 0.0, 0.0);
/// let free = prehend_grasp::free_surface(&ball, &at_end, &joints, &bar, 0.03)?;
/// assert!(free.share > 0.8 && free.share < 0.9);
/// assert!((free.largest_patch - free.share * surface_area(&bar)).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn free_surface(
    hand: &Hand,
    object_from_root: &Isometry3<f64>,
    joints: &JointPositions,
    object: &TriMesh,
    clearance: f64,
) -> Result<FreeSurface, GraspError> {
    let pose = object_from_root.to_homogeneous();
    if let Some(&value) = pose.iter().chain([&clearance]).find(|x| !x.is_finite()) {
        return Err(GraspError::NotFinite {
            what: "the clearance or a number of the pose",
            value,
        });
    }
    let solids = placed_solids(hand, object_from_root, joints)?;
    let point = Collider::new(&Solid::Sphere { radius: 0.0 }).map_err(|source| GraspError::Shape {
        hand: hand.name().to_owned(),
        link: "a point".to_owned(),
        source: Box::new(source),
    })?;
    let is_free = |p: &Point3<f64>| {
        solids.iter().all(|(solid, solid_from_object)| {
            let at = Isometry3::from((solid_from_object * p).coords);
            solid.distance_to(&point, &at, clearance.max(0.0)).is_none()
        })
    };
    let (low, high) = object.axis_aligned_bounds();
    let length = (clearance * PIECE_SHARE).max((high - low).max() * FINEST_SHARE);
    let cuts: Vec<CutTriangle> = cut(object, length);
    let mut patches = Patches::new(&cuts, object, is_free);
    patches.join_within(&cuts);
    patches.join_across(&cuts, object);
    Ok(patches.measured())
}

/// Each solid of the hand with the transform that brings points of the object into its frame.
fn placed_solids(
    hand: &Hand,
    object_from_root: &Isometry3<f64>,
    joints: &JointPositions,
) -> Result<Vec<(Collider, Isometry3<f64>)>, GraspError> {
    let poses = hand.link_poses(joints);
    let mut solids = Vec::new();
    for (link, root_from_link) in hand.links().iter().zip(poses.as_slice()) {
        for placed in &link.collision {
            let collider = Collider::new(&placed.solid).map_err(|source| GraspError::Shape {
                hand: hand.name().to_owned(),
                link: link.name.clone(),
                source: Box::new(source),
            })?;
            let object_from_solid = object_from_root * root_from_link * placed.link_from_solid;
            solids.push((collider, object_from_solid.inverse()));
        }
    }
    if solids.is_empty() {
        return Err(GraspError::NoShape {
            hand: hand.name().to_owned(),
        });
    }
    Ok(solids)
}

/// A triangle cut into n² alike pieces, `first` the index of its first.
///
/// ```text
///   c                 row i from side ab towards c: n − i upright pieces (i, j) and between them n − i − 1 turned
///   ╱╲                ones, in the order upright, turned, upright, …
///  ╱__╲    row 1
/// ╱╲  ╱╲   row 0
/// a‾‾‾‾‾b
/// ```
struct CutTriangle {
    n: usize,
    first: usize,
}

impl CutTriangle {
    fn upright(&self, i: usize, j: usize) -> usize {
        self.first + i * (2 * self.n - i) + 2 * j
    }

    /// The piece at place `k` of a side (0: ab, 1: bc, 2: ca), counted in the side's direction.
    fn along(&self, side: usize, k: usize) -> usize {
        let last = self.n - 1;
        match side {
            0 => self.upright(0, k),
            1 => self.upright(k, last - k),
            _ => self.upright(last - k, 0),
        }
    }
}

fn cut(mesh: &TriMesh, length: f64) -> Vec<CutTriangle> {
    let mut first = 0;
    mesh.corners()
        .map(|[a, b, c]| {
            let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
            // NaN and infinity, from a mesh without size, end at the limits.
            let n = ((longest / length).ceil() as usize).clamp(1, MOST_PIECES);
            let cut = CutTriangle { n, first };
            first += n * n;
            cut
        })
        .collect()
}

/// Free pieces, joined into patches.
struct Patches {
    /// 0 for pieces that are not free.
    areas: Vec<f64>,
    is_free: Vec<bool>,
    /// A piece nearer to the first of its patch; itself for the first.
    towards_first: Vec<usize>,
    whole_area: f64,
}

impl Patches {
    fn new(cuts: &[CutTriangle], mesh: &TriMesh, free: impl Fn(&Point3<f64>) -> bool) -> Self {
        let mut found = Self {
            areas: Vec::new(),
            is_free: Vec::new(),
            towards_first: Vec::new(),
            whole_area: 0.0,
        };
        for (cut, [a, b, c]) in cuts.iter().zip(mesh.corners()) {
            let whole = (b - a).cross(&(c - a)).norm() / 2.0;
            let n = cut.n as f64;
            found.whole_area += whole;
            for i in 0..cut.n {
                for nth in 0..2 * (cut.n - i) - 1 {
                    let third = if nth % 2 == 0 { 1.0 } else { 2.0 } / 3.0;
                    let (along_b, along_c) = ((nth / 2) as f64 + third, i as f64 + third);
                    let is_free = free(&(a + (b - a) * (along_b / n) + (c - a) * (along_c / n)));
                    found.areas.push(if is_free { whole / (n * n) } else { 0.0 });
                    found.is_free.push(is_free);
                    found.towards_first.push(found.towards_first.len());
                }
            }
        }
        found
    }

    fn join_within(&mut self, cuts: &[CutTriangle]) {
        for cut in cuts {
            for i in 0..cut.n {
                for j in 0..cut.n - i - 1 {
                    let turned = cut.upright(i, j) + 1;
                    for (i, j) in [(i, j), (i, j + 1), (i + 1, j)] {
                        self.join(turned, cut.upright(i, j));
                    }
                }
            }
        }
    }

    /// Joins pieces of triangles that share a side, where their parts of the side overlap.
    fn join_across(&mut self, cuts: &[CutTriangle], mesh: &TriMesh) {
        let mut sides: Vec<([u32; 2], usize, usize, bool)> = Vec::with_capacity(cuts.len() * 3);
        for (idx, t) in mesh.triangles().iter().enumerate() {
            for side in 0..3 {
                let (p, q) = (t[side], t[(side + 1) % 3]);
                sides.push(([p.min(q), p.max(q)], idx, side, p > q));
            }
        }
        sides.sort_unstable();
        for pair in sides.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
            let [(_, s, s_side, s_turned), (_, t, t_side, t_turned)] = [pair[0], pair[1]];
            let (s, t) = (&cuts[s], &cuts[t]);
            let place = |cut: &CutTriangle, k: usize, turned: bool| if turned { cut.n - 1 - k } else { k };
            for k in 0..s.n {
                for l in k * t.n / s.n..((k + 1) * t.n).div_ceil(s.n) {
                    self.join(
                        s.along(s_side, place(s, k, s_turned)),
                        t.along(t_side, place(t, l, t_turned)),
                    );
                }
            }
        }
    }

    fn join(&mut self, a: usize, b: usize) {
        if self.is_free[a] && self.is_free[b] {
            let (a, b) = (self.first_of(a), self.first_of(b));
            self.towards_first[a.max(b)] = a.min(b);
        }
    }

    fn first_of(&mut self, mut piece: usize) -> usize {
        while self.towards_first[piece] != piece {
            let next = self.towards_first[self.towards_first[piece]];
            self.towards_first[piece] = next;
            piece = next;
        }
        piece
    }

    fn measured(mut self) -> FreeSurface {
        if self.whole_area <= 0.0 {
            return FreeSurface {
                share: 0.0,
                largest_patch: 0.0,
            };
        }
        let free: f64 = self.areas.iter().sum();
        let mut patches = vec![0.0; self.areas.len()];
        for piece in 0..self.areas.len() {
            let first = self.first_of(piece);
            patches[first] += self.areas[piece];
        }
        FreeSurface {
            share: (free / self.whole_area).min(1.0),
            largest_patch: patches.into_iter().fold(0.0, f64::max),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use prehend_geometry::surface_area;
    use std::collections::BTreeMap;

    /// A hand that is a ball of radius 30 mm, and its only posture.
    fn ball() -> (Hand, JointPositions) {
        let urdf = r#"<robot name="ball"><link name="palm">
            <collision><geometry><sphere radius="0.03"/></geometry></collision></link></robot>"#;
        let hand = Hand::from_urdf(urdf, &|file| Err(file.to_owned())).unwrap();
        let joints = hand.positions(&BTreeMap::new()).unwrap();
        (hand, joints)
    }

    fn bar(half: [f64; 3]) -> TriMesh {
        Solid::Cuboid {
            half_extents: Vector3::from(half),
        }
        .display_mesh()
    }

    #[test]
    fn a_ball_around_the_middle_of_a_bar_leaves_two_ends_of_the_area_that_a_formula_gives() {
        let (hand, joints) = ball();
        let bar = bar([0.02, 0.02, 0.1]);
        let free = free_surface(&hand, &Isometry3::identity(), &joints, &bar, 0.03).unwrap();
        // On each side, what lies within 60 mm of the middle: 2 ∫ √(r² − y²) dy with r² = 60² − 20² over 40 mm.
        let (r2, h) = (0.06_f64.powi(2) - 0.02_f64.powi(2), 0.02_f64);
        let taken = 2.0 * (h * (r2 - h * h).sqrt() + r2 * (h / r2.sqrt()).asin());
        let area = surface_area(&bar);
        let expected = 1.0 - 4.0 * taken / area;
        assert!((free.share - expected).abs() < 0.01, "{free:?} {expected}");
        assert!(
            (free.largest_patch - free.share * area / 2.0).abs() < 0.01 * area,
            "{free:?}"
        );
    }

    #[test]
    fn triangles_cut_into_different_numbers_of_pieces_are_connected_across_their_sides() {
        let (hand, joints) = ball();
        let away = Isometry3::translation(10.0, 0.0, 0.0);
        // Sides of 2 and of 300 mm: 1 to 41 pieces along them.
        let plate = bar([0.15, 0.001, 0.02]);
        let free = free_surface(&hand, &away, &joints, &plate, 0.03).unwrap();
        assert!((free.share - 1.0).abs() < 1e-12);
        assert!(
            (free.largest_patch - surface_area(&plate)).abs() < 1e-12,
            "{free:?}"
        );
    }

    #[test]
    fn an_object_within_reach_or_without_area_has_nothing_free() {
        let (hand, joints) = ball();
        let nothing = FreeSurface {
            share: 0.0,
            largest_patch: 0.0,
        };
        let small = bar([0.02; 3]);
        let of = |mesh: &TriMesh| free_surface(&hand, &Isometry3::identity(), &joints, mesh, 0.03).unwrap();
        assert_eq!(of(&small), nothing);
        let line = TriMesh::new(
            vec![
                Point3::origin(),
                Point3::new(0.5, 0.0, 0.0),
                Point3::new(1.0, 0.0, 0.0),
            ],
            vec![[0, 1, 2]],
        );
        assert_eq!(of(&line.unwrap()), nothing);
        assert_eq!(
            free_surface(&hand, &Isometry3::identity(), &joints, &small, f64::NAN)
                .unwrap_err()
                .to_string(),
            "the clearance or a number of the pose is NaN; expected a finite number"
        );
    }
}
