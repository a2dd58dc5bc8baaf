//! Which links are the palm, and which chains are fingers.

use std::collections::BTreeSet;

use nalgebra::{Isometry3, Point3, Vector3};
use prehend_geometry::{Collider, Solid, Surface, TriMesh, convex_hull};

use super::tree::Tree;
use crate::{Hand, HandError, JointIdx, JointPositions, LinkIdx};

/// A chain that is driven by another one's joints and shorter than this share of it is a linkage, not a finger.
const LINKAGE_SHARE: f64 = 0.6;
/// The tip of a finger is what of its last link is farther from the last joint than this share of the farthest point.
const TIP_SHARE: f64 = 0.5;
/// Joints below the palm: up to so many are a wrist, more an arm.
const WRIST_JOINTS: usize = 2;

/// The parts of a hand: what moves as one, and what hangs on what.
pub(super) struct Anatomy<'a> {
    pub hand: &'a Hand,
    /// Convex hull of each link's shape, link frame; empty where it has none.
    pub points: Vec<Vec<Point3<f64>>>,
    /// Links that fixed joints hold together, each from the root outwards.
    pub groups: Vec<Vec<LinkIdx>>,
    /// The group that the fingers hang on.
    pub palm_group: usize,
    /// The link of that group that carries most fingers and has a shape; else the largest.
    pub palm: LinkIdx,
    /// The whole palm's surface, in the frame of `palm`.
    pub palm_surface: Option<Surface>,
    /// The fingers, in the URDF's order.
    pub fingers: Vec<Chain>,
    /// How many chains were left out as linkages.
    pub n_linkages: usize,
}

/// A way from the palm to a link at whose end nothing more moves.
pub(super) struct Chain {
    /// Movable joints on it, from the palm outwards.
    pub joints: Vec<JointIdx>,
    /// Links with a shape on it, from the palm outwards; never empty.
    pub links: Vec<LinkIdx>,
    /// Hull of the far half of what the last joint moves, in the frame of `tip_link`.
    pub tip: Collider,
    /// Its corners.
    pub tip_points: Vec<Point3<f64>>,
    /// The frame of `tip`.
    pub tip_link: LinkIdx,
    /// Its joints that flex it: the largest set of parallel axes, the farthest out where sets are of one size.
    pub flexion: Vec<JointIdx>,
}

/// Corners of the convex hull of all solids of a link, link frame.
fn link_points(hand: &Hand, link: usize) -> Vec<Point3<f64>> {
    let solids = hand.links()[link].collision.iter();
    let points: Vec<Point3<f64>> = solids
        .flat_map(|placed| {
            let mesh = placed.solid.display_mesh();
            mesh.vertices()
                .iter()
                .map(|p| placed.link_from_solid * p)
                .collect::<Vec<_>>()
        })
        .collect();
    hull_corners(points)
}

/// The corners that a convex hull needs; all points where they span no volume.
fn hull_corners(points: Vec<Point3<f64>>) -> Vec<Point3<f64>> {
    match convex_hull(&points) {
        Ok(hull) => {
            let used: BTreeSet<u32> = hull.triangles().iter().flatten().copied().collect();
            used.iter().map(|&i| hull.points()[i as usize]).collect()
        }
        Err(_) => points,
    }
}

/// Corners of what of a hull is far from a point, not counting the way along a direction (unit, or 0).
pub(super) fn far_part(
    points: Vec<Point3<f64>>,
    from: &Point3<f64>,
    along: &Vector3<f64>,
) -> Vec<Point3<f64>> {
    let away = |p: &Point3<f64>| {
        let way = p - from;
        way - along * along.dot(&way)
    };
    let Ok(hull) = convex_hull(&points) else {
        return points;
    };
    let corners = hull.points();
    let Some(farthest) = corners
        .iter()
        .max_by(|a, b| away(a).norm().total_cmp(&away(b).norm()))
    else {
        return points;
    };
    let out = away(farthest);
    let beyond = |p: &Point3<f64>| (p - from).dot(&out) - TIP_SHARE * out.norm_squared();
    let mut kept: Vec<Point3<f64>> = Vec::new();
    for &[a, b, c] in hull.triangles() {
        for (p, q) in [(a, b), (b, c), (c, a)] {
            let (p, q) = (corners[p as usize], corners[q as usize]);
            let (u, v) = (beyond(&p), beyond(&q));
            if u >= 0.0 {
                kept.push(p);
            }
            // Each edge belongs to two triangles, once in each sense.
            if u < 0.0 && v > 0.0 {
                kept.push(p + (q - p) * (u / (u - v)));
            }
        }
    }
    hull_corners(kept)
}

/// The hull of points as something to measure distances of.
pub(super) fn hull_of(points: &[Point3<f64>]) -> Option<Collider> {
    Collider::new(&Solid::Hull(points.to_vec().into())).ok()
}

impl<'a> Anatomy<'a> {
    pub fn new(hand: &'a Hand) -> Result<Self, HandError> {
        let points: Vec<Vec<Point3<f64>>> = (0..hand.links.len()).map(|l| link_points(hand, l)).collect();
        if points.iter().all(Vec::is_empty) {
            return Err(not_a_hand(
                "no link has a <collision> shape; add shapes to touch with",
            ));
        }
        let tree = Tree::new(hand, &points);
        let palm_group = tree.palm_group(&points)?;
        let palm = tree.palm_link(palm_group, &points);
        let zero = hand.joint_positions_from_slice(&vec![0.0; hand.joints.len()]);
        let mut fingers: Vec<Chain> = Vec::new();
        for leaf in tree.leaves_below(palm_group) {
            fingers.extend(tree.chain(palm_group, leaf, &points, &zero));
        }
        if fingers.is_empty() {
            return Err(not_a_hand(
                "no movable joint carries a link with a shape; a hand needs at least one finger that moves",
            ));
        }
        let n_chains = fingers.len();
        let fingers = without_linkages(hand, fingers, &zero);
        let mut anatomy = Self {
            hand,
            groups: tree.groups,
            palm_group,
            palm,
            palm_surface: None,
            n_linkages: n_chains - fingers.len(),
            fingers,
            points,
        };
        anatomy.palm_surface = anatomy.surface_of_palm();
        Ok(anatomy)
    }

    /// Points of the whole palm, in the frame of the palm's link. Empty where it has no shape.
    pub fn palm_points(&self) -> Vec<Point3<f64>> {
        let zero = self
            .hand
            .joint_positions_from_slice(&vec![0.0; self.hand.joints.len()]);
        let poses = self.hand.link_poses(&zero);
        let palm_from_root = poses.root_from_link(self.palm).inverse();
        self.groups[self.palm_group]
            .iter()
            .flat_map(|&link| {
                let palm_from_link = palm_from_root * poses.root_from_link(link);
                self.points[link.0].iter().map(move |p| palm_from_link * p)
            })
            .collect()
    }

    fn surface_of_palm(&self) -> Option<Surface> {
        let zero = self
            .hand
            .joint_positions_from_slice(&vec![0.0; self.hand.joints.len()]);
        let poses = self.hand.link_poses(&zero);
        let palm_from_root = poses.root_from_link(self.palm).inverse();
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for &link in &self.groups[self.palm_group] {
            for placed in &self.hand.link(link).collision {
                let mesh = placed.solid.display_mesh();
                let palm_from_solid = palm_from_root * poses.root_from_link(link) * placed.link_from_solid;
                let first = vertices.len() as u32;
                vertices.extend(mesh.vertices().iter().map(|p| palm_from_solid * p));
                triangles.extend(mesh.triangles().iter().map(|t| t.map(|i| i + first)));
            }
        }
        Some(Surface::new(TriMesh::new(vertices, triangles).ok()?))
    }

    /// The free joint that a joint follows, and by which factor.
    pub fn leader(&self, joint: JointIdx) -> (usize, f64) {
        leader(self.hand, joint)
    }

    /// Pose of a finger's last link in the palm link's frame.
    pub fn palm_from_tip(&self, finger: &Chain, positions: &JointPositions) -> Isometry3<f64> {
        self.hand.link_pose(self.palm, positions).inverse() * self.hand.link_pose(finger.tip_link, positions)
    }

    /// All links that could touch: the palm's and the fingers', linkages among them.
    pub fn contact_links(&self) -> Vec<LinkIdx> {
        let below = |link: LinkIdx| {
            let mut at = Some(link);
            while let Some(l) = at {
                if self.groups[self.palm_group].contains(&l) {
                    return true;
                }
                at = self.hand.parent(l);
            }
            false
        };
        (0..self.hand.links.len())
            .map(LinkIdx)
            .filter(|&l| !self.points[l.0].is_empty() && below(l))
            .collect()
    }
}

impl Hand {
    /// The link with which the hand begins: the root, wrists included, or the first link beyond the last joint of an
    /// arm (more than two joints) that the URDF has below the palm.
    ///
    /// # Errors
    ///
    /// [`HandError::NotAHand`] where no link has a shape, or where the URDF is of a robot with several hands or none.
    pub fn base_of_hand(&self) -> Result<LinkIdx, HandError> {
        let points: Vec<Vec<Point3<f64>>> = (0..self.links.len()).map(|l| link_points(self, l)).collect();
        let tree = Tree::new(self, &points);
        let palm = tree.palm_group(&points)?;
        let first = tree.groups[palm][0];
        if self.joints_to(first).len() > WRIST_JOINTS {
            Ok(first)
        } else {
            Ok(self.root())
        }
    }
}

pub(super) fn not_a_hand(reason: &str) -> HandError {
    HandError::NotAHand {
        reason: reason.to_owned(),
    }
}

fn leader(hand: &Hand, joint: JointIdx) -> (usize, f64) {
    let mimic = hand.joint(joint).mimic;
    mimic.map_or((joint.0, 1.0), |m| (m.joint.0, m.multiplier))
}

/// Length of the diagonal of the box along the axes around points.
pub(super) fn diagonal(points: &[Point3<f64>]) -> f64 {
    let low = points
        .iter()
        .fold(Vector3::repeat(f64::INFINITY), |l, p| l.inf(&p.coords));
    let high = points
        .iter()
        .fold(Vector3::repeat(f64::NEG_INFINITY), |h, p| h.sup(&p.coords));
    if points.is_empty() {
        0.0
    } else {
        (high - low).norm()
    }
}

/// Fingers without the chains that only guide them.
fn without_linkages(hand: &Hand, fingers: Vec<Chain>, zero: &JointPositions) -> Vec<Chain> {
    let poses = hand.link_poses(zero);
    let drivers =
        |chain: &Chain| -> BTreeSet<usize> { chain.joints.iter().map(|&j| leader(hand, j).0).collect() };
    // How far its tip reaches from its first joint.
    let reach = |chain: &Chain| {
        let (base, _) = hand.joint_axis(chain.joints[0], &poses);
        let root_from_tip = poses.root_from_link(chain.tip_link);
        let far = chain.tip_points.iter().map(|p| (root_from_tip * p - base).norm());
        far.fold(0.0, f64::max)
    };
    let facts: Vec<(BTreeSet<usize>, f64)> = fingers.iter().map(|c| (drivers(c), reach(c))).collect();
    let is_linkage = |i: usize| {
        let (own, length) = &facts[i];
        facts
            .iter()
            .any(|(others, longer)| own.is_subset(others) && *length < LINKAGE_SHARE * longer)
    };
    let kept: Vec<bool> = (0..fingers.len()).map(|i| !is_linkage(i)).collect();
    let mut kept = kept.into_iter();
    fingers
        .into_iter()
        .filter(|_| kept.next().unwrap_or(true))
        .collect()
}
