//! Closing around cylinders that lie on the palm.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, UnitVector3, Vector3};
use prehend_geometry::{Collider, Solid, Surface};

use super::anatomy::{Anatomy, hull_of};
use super::closing::{Motion, bounded};
use crate::{JointKind, LinkIdx, PalmFrame};

/// Cylinders to close around: so many radii, at so many heights above the palm (shares of the fingers' reach).
const RADII: usize = 8;
const HEIGHTS: [f64; 3] = [0.0, 0.5, 0.85];
/// Steps from open to closed.
const STEPS: usize = 40;
/// A link this near (m) touches while closing; at the end, this many times as far does.
const TOUCH: f64 = 5e-4;
const TOUCHED: f64 = 5.0;
/// A cylinder this near (m) to the palm touches that.
const ON_PALM: f64 = 5e-3;
/// How far a finger opens again from where it touched: its first joint, rad or m.
const BACK: f64 = 0.35;
const BACK_SLIDE: f64 = 0.015;
/// Its other joints keep this share of their bend.
const STAY_BENT: f64 = 0.6;
/// Touched at directions that leave no more than this angle between neighbours, a cylinder with friction is held.
const HELD: f64 = 3.84;

/// What closing around the cylinders came to.
pub(super) struct Wraps {
    /// Values of the closing joints, opened again a little, for every cylinder that all fingers touch; that several
    /// do, where there are fewer than four of those.
    pub postures: Vec<Vec<f64>>,
    /// How many cylinders were held: touched from all around.
    pub n_held: usize,
    /// How many there were.
    pub n_cylinders: usize,
    /// Diameter (m) of the widest one that was held; 0 where none was.
    pub widest_held: f64,
}

impl Wraps {
    pub fn new(
        anatomy: &Anatomy<'_>,
        motion: &Motion,
        palm: &PalmFrame,
        closing: &[usize],
        cylinders: &[Cylinder],
    ) -> Self {
        let wrap = Wrap::new(anatomy, motion, closing);
        let reach = reach(anatomy, motion, palm);
        let (mut all, mut some) = (Vec::new(), Vec::new());
        let mut n_held = 0;
        let mut widest_held = 0.0_f64;
        for cylinder in cylinders {
            let radius = cylinder.radius;
            for share in HEIGHTS {
                let height = (radius + 0.002).max(share * reach);
                let Some(around) = wrap.around(palm, cylinder, height) else {
                    continue;
                };
                if around.held {
                    n_held += 1;
                    widest_held = widest_held.max(2.0 * radius);
                }
                if around.n_touching == anatomy.fingers.len() {
                    all.push(around.posture);
                } else if around.n_touching > 1 {
                    some.push(around.posture);
                }
            }
        }
        if all.len() < 4 {
            all.extend(some);
        }
        Self {
            postures: all,
            n_held,
            n_cylinders: cylinders.len() * HEIGHTS.len(),
            widest_held,
        }
    }
}

/// What is closed around; its axis is its z.
pub(super) struct Cylinder {
    radius: f64,
    solid: Collider,
    surface: Surface,
}

/// Cylinders from nearly the widest gap between the sides down to an eighth of it.
pub(super) fn cylinders(motion: &Motion) -> Vec<Cylinder> {
    let widest = motion.gaps.iter().copied().fold(0.0, f64::max) / 2.0;
    let radii = (0..RADII).map(|k| (0.9 * widest * 8f64.powf(-(k as f64) / (RADII - 1) as f64)).max(1e-3));
    let cylinder = |radius: f64| {
        let solid = Solid::Cylinder {
            half_length: 0.5,
            radius,
        };
        Some(Cylinder {
            radius,
            surface: Surface::new(solid.display_mesh()),
            solid: Collider::new(&solid).ok()?,
        })
    };
    radii.filter_map(cylinder).collect()
}

/// The free joints that close, finger by finger, from the palm outwards.
pub(super) fn closing_order(anatomy: &Anatomy<'_>, motion: &Motion) -> Vec<usize> {
    let mut order = Vec::new();
    for finger in &anatomy.fingers {
        for &joint in &finger.flexion {
            let (leader, _) = anatomy.leader(joint);
            if motion.direction[leader] != 0.0 && !order.contains(&leader) {
                order.push(leader);
            }
        }
    }
    order
}

/// How high (m) above the palm the fingers reach, half closed: the mean of their highest points.
fn reach(anatomy: &Anatomy<'_>, motion: &Motion, palm: &PalmFrame) -> f64 {
    let (pinch, open) = motion.pinch_and_open();
    let positions = motion.at(anatomy, f64::midpoint(pinch, open));
    let frame_from_link = palm.link_from_palm.inverse();
    let tops = anatomy.fingers.iter().map(|finger| {
        let frame_from_tip = frame_from_link * anatomy.palm_from_tip(finger, &positions);
        let heights = finger.tip_points.iter().map(|p| (frame_from_tip * p).z);
        heights.fold(f64::NEG_INFINITY, f64::max)
    });
    tops.sum::<f64>() / anatomy.fingers.len() as f64
}

/// Closes fingers around cylinders, one joint after the other from the palm outwards.
struct Wrap<'a> {
    anatomy: &'a Anatomy<'a>,
    motion: &'a Motion,
    closing: &'a [usize],
    hulls: Vec<Option<Collider>>,
    /// Links that each closing joint moves.
    moved: Vec<Vec<usize>>,
}

/// One cylinder, closed around.
struct Around {
    posture: Vec<f64>,
    n_touching: usize,
    held: bool,
}

impl<'a> Wrap<'a> {
    fn new(anatomy: &'a Anatomy<'a>, motion: &'a Motion, closing: &'a [usize]) -> Self {
        let of_finger = |link: usize| anatomy.fingers.iter().any(|f| f.links.contains(&LinkIdx(link)));
        let moved = closing
            .iter()
            .map(|&leader| {
                (0..anatomy.points.len())
                    .filter(|&l| of_finger(l))
                    .filter(|&l| {
                        let way = anatomy.hand.joints_to(LinkIdx(l));
                        way.iter().any(|&j| anatomy.leader(j).0 == leader)
                    })
                    .collect()
            })
            .collect();
        Self {
            anatomy,
            motion,
            closing,
            hulls: anatomy.points.iter().map(|p| hull_of(p)).collect(),
            moved,
        }
    }

    /// Closes on a cylinder across the palm; `None` where the open hand overlaps it.
    fn around(&self, palm: &PalmFrame, cylinder: &Cylinder, height: f64) -> Option<Around> {
        let x = UnitVector3::new_normalize(Vector3::x());
        let across = UnitQuaternion::from_axis_angle(&x, -std::f64::consts::FRAC_PI_2);
        let palm_from_cylinder = Isometry3::from_parts(Translation3::new(0.0, 0.0, height), across);
        let placed = palm.link_from_palm * palm_from_cylinder;
        let hand = self.anatomy.hand;
        let mut values = self.motion.reference.clone();
        for &joint in self.closing {
            values[joint] = self.start(joint);
        }
        let cylinder_in_links = |values: &[f64]| -> Vec<Isometry3<f64>> {
            let poses = hand.link_poses(&hand.joint_positions_from_slice(values));
            let root_from_cylinder = poses.root_from_link(palm.link) * placed;
            let links = poses.as_slice().iter();
            links
                .map(|root_from_link| root_from_link.inv_mul(&root_from_cylinder))
                .collect()
        };
        let is_near = |link: usize, in_links: &[Isometry3<f64>], tolerance: f64| {
            let gap = self.hulls[link]
                .as_ref()
                .and_then(|hull| hull.distance_to(&cylinder.solid, &in_links[link], 0.01));
            gap.is_some_and(|g| g <= tolerance)
        };
        let any_near = |links: &[usize], values: &[f64], tolerance: f64| {
            let in_links = cylinder_in_links(values);
            links.iter().any(|&l| is_near(l, &in_links, tolerance))
        };
        if self.moved.iter().any(|links| any_near(links, &values, 0.0)) {
            return None;
        }
        for (k, &joint) in self.closing.iter().enumerate() {
            let (open, closed) = self.motion.range(self.anatomy, joint);
            let step = (closed - open) / STEPS as f64;
            while !any_near(&self.moved[k], &values, TOUCH) && (closed - values[joint] - step) * step >= 0.0 {
                values[joint] += step;
            }
        }
        let in_links = cylinder_in_links(&values);
        let touches = |link: usize| is_near(link, &in_links, TOUCHED * TOUCH);
        let n_touching = self
            .anatomy
            .fingers
            .iter()
            .filter(|f| f.links.iter().any(|l| touches(l.0)))
            .count();
        let mut angles: Vec<f64> = self
            .anatomy
            .fingers
            .iter()
            .flat_map(|f| &f.links)
            .filter(|l| touches(l.0))
            .filter_map(|l| {
                let pose = in_links[l.0].inverse();
                let gap = cylinder.surface.gap(self.hulls[l.0].as_ref()?, &pose, 0.01)?;
                let at = palm_from_cylinder * gap.on_surface;
                Some((at.z - height).atan2(at.x))
            })
            .collect();
        if height - cylinder.radius < ON_PALM {
            angles.push(-std::f64::consts::FRAC_PI_2);
        }
        self.open_again(&mut values);
        Some(Around {
            posture: self.closing.iter().map(|&j| values[j]).collect(),
            n_touching,
            held: is_held(angles),
        })
    }

    /// Opens the first joint of each finger a little, and bends the others less.
    fn open_again(&self, values: &mut [f64]) {
        for &joint in self.closing {
            let start = self.start(joint);
            if !self.is_first(joint) {
                values[joint] = start + STAY_BENT * (values[joint] - start);
            }
        }
        let mut opened = Vec::new();
        for finger in &self.anatomy.fingers {
            let Some(&first) = finger.flexion.first() else {
                continue;
            };
            let joint = self.anatomy.leader(first).0;
            if opened.contains(&joint) {
                continue;
            }
            opened.push(joint);
            let slides = self.anatomy.hand.joints()[joint].kind == JointKind::Prismatic;
            let back = if slides { BACK_SLIDE } else { BACK };
            let (low, high) = bounded(self.anatomy, joint);
            values[joint] = (values[joint] - self.motion.direction[joint] * back).clamp(low, high);
        }
    }

    /// Where a joint starts: open; a joint beyond a finger's first one straight, where it can bend both ways.
    fn start(&self, joint: usize) -> f64 {
        let (open, closed) = self.motion.range(self.anatomy, joint);
        let both_ways = open * closed < 0.0;
        if !self.is_first(joint) && both_ways {
            0.0
        } else {
            open
        }
    }

    /// Whether a joint is the first that flexes some finger.
    fn is_first(&self, joint: usize) -> bool {
        let mut fingers = self.anatomy.fingers.iter();
        fingers.any(|f| {
            f.flexion
                .first()
                .is_some_and(|&j| self.anatomy.leader(j).0 == joint)
        })
    }
}

/// Whether contacts in these directions hold a cylinder: none of them is missing on a whole side.
fn is_held(mut angles: Vec<f64>) -> bool {
    angles.sort_by(f64::total_cmp);
    let Some((&first, &last)) = angles.first().zip(angles.last()) else {
        return false;
    };
    let around = first + std::f64::consts::TAU - last;
    let widest = angles.windows(2).map(|p| p[1] - p[0]).fold(around, f64::max);
    widest <= HELD
}

#[cfg(test)]
mod tests {
    use super::is_held;

    #[test]
    fn a_cylinder_is_held_from_opposite_sides_and_not_from_one() {
        assert!(is_held(vec![0.0, 3.1]));
        assert!(is_held(vec![-1.6, 0.5, 2.6]));
        assert!(!is_held(vec![0.0, 1.5]));
        assert!(!is_held(vec![0.3]));
        assert!(!is_held(Vec::new()));
    }
}
