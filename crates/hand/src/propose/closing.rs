//! Which way joints close, which fingers oppose, and where the others must stand for that.

use nalgebra::{Isometry3, Point3};
use prehend_geometry::Collider;

use super::anatomy::{Anatomy, Chain};
use crate::{JointIdx, JointKind, JointPositions, LinkPoses};

/// Looks along the way from open to closed.
const LOOKS: usize = 25;
/// Gaps are measured up to this, metres; hands are smaller.
const FAR: f64 = 2.0;
/// How much a finger's way to the palm counts beside its ways to other fingers.
const PALM_WEIGHT: f64 = 0.3;
/// Fingers bend farther than they bend back. That a joint's range lies wholly on one side of 0 counts as much for its
/// closing to that side as coming nearer by this length (m).
const MORE_BENT: f64 = 0.03;
/// Sides that come nearer each other by no more than this (m) do not oppose.
pub(super) const LEAST_OPPOSITION: f64 = 1e-6;
/// Beyond so many independent groups of fingers, each is judged alone.
const MOST_TOGETHER: usize = 8;

/// How a hand closes.
pub(super) struct Motion {
    /// Direction in which each joint that drives a finger's flexion closes, by joint; 0 for all others.
    pub direction: Vec<f64>,
    /// Where the other joints stand, by joint.
    pub reference: Vec<f64>,
    /// Which fingers stand on the thumb's side.
    pub thumb_side: Vec<bool>,
    /// How much nearer fingers of both sides come on the whole way, m.
    pub opposition: f64,
    /// By how much the chosen directions beat the next best, 0 (not at all) to 1.
    pub margin: f64,
    /// Gap between the sides at each look, m.
    pub gaps: Vec<f64>,
}

/// Leaders of flexion joints that close together, with the direction of each that goes with the group's.
struct Driven {
    leaders: Vec<(usize, f64)>,
    fingers: Vec<usize>,
}

impl Motion {
    pub fn new(anatomy: &Anatomy<'_>) -> Self {
        let motion = Self::bending(anatomy, MORE_BENT);
        if motion.opposition > LEAST_OPPOSITION {
            return motion;
        }
        // Fingers that only open from 0 on.
        Self::bending(anatomy, 0.0)
    }

    fn bending(anatomy: &Anatomy<'_>, more_bent: f64) -> Self {
        let groups = driven_groups(anatomy);
        let hand = anatomy.hand;
        let reference: Vec<f64> = hand
            .joints()
            .iter()
            .map(|j| 0.0_f64.clamp(j.lower, j.upper))
            .collect();
        let (direction, margin) = directions(anatomy, &groups, &reference, more_bent);
        let mut motion = Self {
            direction,
            reference,
            thumb_side: vec![false; anatomy.fingers.len()],
            opposition: 0.0,
            margin,
            gaps: Vec::new(),
        };
        motion.oppose(anatomy);
        (motion.direction, motion.margin) = directions(anatomy, &groups, &motion.reference, more_bent);
        let sides = Sides::of(anatomy, &motion);
        motion.thumb_side = sides.thumb_side;
        motion.opposition = sides.closed;
        motion.gaps = sides.gaps;
        motion
    }

    /// Joint range from open to closed.
    pub fn range(&self, anatomy: &Anatomy<'_>, joint: usize) -> (f64, f64) {
        let (low, high) = bounded(anatomy, joint);
        if self.direction[joint] < 0.0 {
            (high, low)
        } else {
            (low, high)
        }
    }

    /// The posture at `t` of the way from open (0) to closed (1).
    pub fn at(&self, anatomy: &Anatomy<'_>, t: f64) -> JointPositions {
        let mut values = self.reference.clone();
        for joint in 0..values.len() {
            if self.direction[joint] != 0.0 {
                let (open, closed) = self.range(anatomy, joint);
                values[joint] = open + t * (closed - open);
            }
        }
        anatomy.hand.joint_positions_from_slice(&values)
    }

    /// Where on the way the sides are nearest, and where they are farthest before that.
    pub fn pinch_and_open(&self) -> (f64, f64) {
        let least = self.gaps.iter().copied().fold(f64::INFINITY, f64::min);
        let pinch = self.gaps.iter().position(|g| *g <= least + 1e-3).unwrap_or(0);
        let mut open = 0;
        for look in 0..=pinch {
            if self.gaps[look] > self.gaps[open] {
                open = look;
            }
        }
        let at = |look: usize| look as f64 / (LOOKS - 1) as f64;
        (at(pinch), at(open))
    }

    /// Whether the sides still oppose with the other joints in another place: fingers of both sides come nearer each
    /// other by at least this share of what they do now.
    pub fn still_opposes(&self, anatomy: &Anatomy<'_>, reference: &[f64], share: f64) -> bool {
        let moved = Self {
            direction: self.direction.clone(),
            reference: reference.to_vec(),
            thumb_side: Vec::new(),
            opposition: 0.0,
            margin: 0.0,
            gaps: Vec::new(),
        };
        let now = TipGaps::new(anatomy, self).closed_between(&self.thumb_side);
        TipGaps::new(anatomy, &moved).closed_between(&self.thumb_side) >= share * now
    }

    /// Moves the joints that do not close to where the sides oppose best: by coordinates, from 0.
    fn oppose(&mut self, anatomy: &Anatomy<'_>) {
        let still: Vec<usize> = anatomy
            .fingers
            .iter()
            .flat_map(|f| f.joints.iter().map(|&j| anatomy.leader(j).0))
            .filter(|&j| self.direction[j] == 0.0)
            .collect::<std::collections::BTreeSet<_>>()
            .into_iter()
            .collect();
        let mut best = Sides::of(anatomy, self).merit;
        let unmoved = best.abs();
        for _ in 0..2 {
            for &joint in &still {
                let (low, high) = bounded(anatomy, joint);
                let kept = self.reference[joint];
                // A change must be worth it: hands oppose well where their zero is, as a rule. An end of a range that
                // leaves 0 out says little.
                let share = if low <= 0.0 && 0.0 <= high { 0.15 } else { 0.02 };
                let worth = share * unmoved.max(0.02);
                let mut chosen = kept;
                for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
                    self.reference[joint] = low + share * (high - low);
                    let merit = Sides::of(anatomy, self).merit;
                    if merit > best + worth {
                        (best, chosen) = (merit, self.reference[joint]);
                    }
                }
                self.reference[joint] = chosen;
            }
        }
    }
}

/// A joint's range; a quarter turn either way where it has none, or more than a full turn.
pub(super) fn bounded(anatomy: &Anatomy<'_>, joint: usize) -> (f64, f64) {
    let joint = anatomy.hand.joint(JointIdx(joint));
    let turns = joint.kind != JointKind::Prismatic;
    if turns && joint.upper - joint.lower > std::f64::consts::TAU {
        let quarter = std::f64::consts::FRAC_PI_2;
        let middle = 0.0_f64.clamp(joint.lower + quarter, joint.upper - quarter);
        (middle - quarter, middle + quarter)
    } else {
        (joint.lower, joint.upper)
    }
}

fn driven_groups(anatomy: &Anatomy<'_>) -> Vec<Driven> {
    let hand = anatomy.hand;
    let zero = hand.joint_positions_from_slice(&vec![0.0; hand.joints().len()]);
    let poses = hand.link_poses(&zero);
    let mut groups: Vec<Driven> = Vec::new();
    for (idx, finger) in anatomy.fingers.iter().enumerate() {
        let Some(&last) = finger.flexion.last() else {
            continue;
        };
        let along = hand.joint_axis(last, &poses).1;
        // What turns the finger one way: for each joint its leader and the leader's sense.
        let senses: Vec<(usize, f64)> = finger
            .flexion
            .iter()
            .map(|&joint| {
                let (leader, factor) = anatomy.leader(joint);
                let axis = hand.joint_axis(joint, &poses).1;
                (leader, (axis.dot(&along) * factor).signum())
            })
            .collect();
        let known = senses.iter().find_map(|&(leader, sense)| {
            groups.iter().enumerate().find_map(|(g, group)| {
                let found = group.leaders.iter().find(|(l, _)| *l == leader)?;
                Some((g, found.1 * sense))
            })
        });
        let (group, turn) = known.unwrap_or_else(|| {
            groups.push(Driven {
                leaders: Vec::new(),
                fingers: Vec::new(),
            });
            (groups.len() - 1, 1.0)
        });
        groups[group].fingers.push(idx);
        for (leader, sense) in senses {
            if !groups[group].leaders.iter().any(|(l, _)| *l == leader) {
                groups[group].leaders.push((leader, turn * sense));
            }
        }
    }
    groups
}

/// The closing direction of every driven joint, and how clearly it won.
fn directions(
    anatomy: &Anatomy<'_>,
    groups: &[Driven],
    reference: &[f64],
    more_bent: f64,
) -> (Vec<f64>, f64) {
    let hand = anatomy.hand;
    let signed = |signs: &dyn Fn(usize) -> f64| {
        let mut direction = vec![0.0; hand.joints().len()];
        for (g, group) in groups.iter().enumerate() {
            for &(leader, sense) in &group.leaders {
                direction[leader] = signs(g) * sense;
            }
        }
        direction
    };
    let motion = |direction: Vec<f64>| Motion {
        direction,
        reference: reference.to_vec(),
        thumb_side: Vec::new(),
        opposition: 0.0,
        margin: 0.0,
        gaps: Vec::new(),
    };
    // Where each finger's tip is with its group turned one way or the other.
    let ways: Vec<[Vec<Isometry3<f64>>; 2]> = anatomy
        .fingers
        .iter()
        .map(|finger| {
            [1.0, -1.0].map(|sign| {
                let motion = motion(signed(&|_| sign));
                looks()
                    .map(|t| anatomy.palm_from_tip(finger, &motion.at(anatomy, t)))
                    .collect()
            })
        })
        .collect();
    let group_of: Vec<usize> = (0..anatomy.fingers.len())
        .map(|f| groups.iter().position(|g| g.fingers.contains(&f)).unwrap_or(0))
        .collect();
    let to_palm: Vec<[f64; 2]> = (0..ways.len())
        .map(|f| {
            [0, 1].map(|s| {
                let gaps = ways[f][s].iter();
                let gaps: Vec<f64> = gaps
                    .map(|pose| gap_to_palm(anatomy, &anatomy.fingers[f], pose))
                    .collect();
                approach_of(&gaps)
            })
        })
        .collect();
    let mut between = vec![vec![[[0.0; 2]; 2]; ways.len()]; ways.len()];
    for a in 0..ways.len() {
        for b in a + 1..ways.len() {
            for s in 0..2 {
                for u in 0..2 {
                    let gaps: Vec<f64> = ways[a][s]
                        .iter()
                        .zip(&ways[b][u])
                        .map(|(p, q)| gap(&anatomy.fingers[a].tip, &anatomy.fingers[b].tip, &p.inv_mul(q)))
                        .collect();
                    between[a][b][s][u] = approach_of(&gaps);
                }
            }
        }
    }
    let turned = signed(&|_| 1.0);
    let bent: Vec<f64> = anatomy
        .fingers
        .iter()
        .map(|finger| {
            let shares = finger.flexion.iter().map(|&j| {
                let (leader, _) = anatomy.leader(j);
                let joint = hand.joint(JointIdx(leader));
                let (low, high) = bounded(anatomy, leader);
                let turns = joint.kind != JointKind::Prismatic && high - low > 1e-9;
                if turns {
                    turned[leader] * (high + low) / (high - low)
                } else {
                    0.0
                }
            });
            more_bent * shares.sum::<f64>() / finger.flexion.len().max(1) as f64
        })
        .collect();
    let score = |side: &dyn Fn(usize) -> usize| {
        let mut sum = 0.0;
        for a in 0..ways.len() {
            let s = side(group_of[a]);
            sum += PALM_WEIGHT * to_palm[a][s] + if s == 0 { bent[a] } else { -bent[a] };
            for b in a + 1..ways.len() {
                sum += between[a][b][s][side(group_of[b])];
            }
        }
        sum
    };
    let n = groups.len();
    if n > MOST_TOGETHER {
        let choice: Vec<usize> = (0..n)
            .map(|g| {
                let sum = |s: usize| groups[g].fingers.iter().map(|&f| to_palm[f][s]).sum::<f64>();
                usize::from(sum(1) > sum(0))
            })
            .collect();
        return (signed(&|g| if choice[g] == 0 { 1.0 } else { -1.0 }), 0.0);
    }
    let scored: Vec<(f64, usize)> = (0..1_usize << n)
        .map(|code| (score(&|g| code >> g & 1), code))
        .collect();
    // The first of equals; then the best that differs.
    let (best, code) = scored
        .iter()
        .copied()
        .reduce(|a, b| if b.0 > a.0 + 1e-9 { b } else { a })
        .unwrap_or((0.0, 0));
    let next = scored
        .iter()
        .filter(|(_, c)| *c != code)
        .map(|(s, _)| *s)
        .fold(f64::NEG_INFINITY, f64::max);
    let margin = ((best - next) / best.abs().max(1e-6)).clamp(0.0, 1.0);
    (signed(&|g| if code >> g & 1 == 0 { 1.0 } else { -1.0 }), margin)
}

fn looks() -> impl Iterator<Item = f64> {
    (0..LOOKS).map(|look| look as f64 / (LOOKS - 1) as f64)
}

/// Gap between a fingertip and the palm; 0 where that has no shape.
fn gap_to_palm(anatomy: &Anatomy<'_>, finger: &Chain, palm_from_tip: &Isometry3<f64>) -> f64 {
    anatomy.palm_surface.as_ref().map_or(0.0, |palm| {
        palm.gap(&finger.tip, palm_from_tip, FAR)
            .map_or(FAR, |g| g.distance)
    })
}

fn gap(a: &Collider, b: &Collider, a_from_b: &Isometry3<f64>) -> f64 {
    a.distance_to(b, a_from_b, FAR).unwrap_or(FAR)
}

/// How much nearer two parts are in the second half of a way than in the first, on average.
fn approach_of(gaps: &[f64]) -> f64 {
    let half = gaps.len() / 2;
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len().max(1) as f64;
    mean(&gaps[..half]) - mean(&gaps[half..])
}

/// The two sides that oppose each other.
struct Sides {
    thumb_side: Vec<bool>,
    /// Mean way that fingers of both sides come nearer each other.
    closed: f64,
    /// The same, less the way that fingers of one side do.
    score: f64,
    /// The score, less what is left of the gap between the sides at its least.
    merit: f64,
    gaps: Vec<f64>,
}

/// Gaps between fingertips at each look, by pair of fingers.
struct TipGaps(Vec<Vec<Vec<f64>>>);

impl TipGaps {
    fn new(anatomy: &Anatomy<'_>, motion: &Motion) -> Self {
        let fingers = &anatomy.fingers;
        let poses: Vec<LinkPoses> = looks()
            .map(|t| anatomy.hand.link_poses(&motion.at(anatomy, t)))
            .collect();
        let ways: Vec<Vec<Isometry3<f64>>> = fingers
            .iter()
            .map(|f| poses.iter().map(|p| p.root_from_link(f.tip_link)).collect())
            .collect();
        let n = fingers.len();
        let mut gaps = vec![vec![Vec::new(); n]; n];
        for a in 0..n {
            for b in a + 1..n {
                gaps[a][b] = ways[a]
                    .iter()
                    .zip(&ways[b])
                    .map(|(p, q)| gap(&fingers[a].tip, &fingers[b].tip, &p.inv_mul(q)))
                    .collect();
            }
        }
        Self(gaps)
    }

    /// Mean over pairs of fingers on different sides of how much they come nearer.
    fn closed_between(&self, on_side: &[bool]) -> f64 {
        let n = self.0.len();
        let pairs = (0..n).flat_map(|a| (a + 1..n).map(move |b| (a, b)));
        let (mut sum, mut count) = (0.0, 0.0);
        for (a, b) in pairs.filter(|&(a, b)| on_side[a] != on_side[b]) {
            sum += closed_by(&self.0[a][b]);
            count += 1.0;
        }
        if count > 0.0 { sum / count } else { 0.0 }
    }
}

impl Sides {
    fn of(anatomy: &Anatomy<'_>, motion: &Motion) -> Self {
        let fingers = &anatomy.fingers;
        if fingers.len() == 1 {
            let gaps: Vec<f64> = looks()
                .map(|t| anatomy.palm_from_tip(&fingers[0], &motion.at(anatomy, t)))
                .map(|pose| gap_to_palm(anatomy, &fingers[0], &pose))
                .collect();
            let least = gaps.iter().copied().fold(f64::INFINITY, f64::min);
            return Self {
                thumb_side: vec![false],
                closed: closed_by(&gaps),
                score: closed_by(&gaps),
                merit: closed_by(&gaps) - least,
                gaps,
            };
        }
        let n = fingers.len();
        let TipGaps(gaps) = TipGaps::new(anatomy, motion);
        let mut best: Option<Self> = None;
        // Every split into two sides, the first finger always on the same one.
        for code in 1..1_usize << (n - 1).min(12) {
            let on_second = |f: usize| f > 0 && code >> (f - 1) & 1 == 1;
            let mut cross: Vec<&Vec<f64>> = Vec::new();
            let mut same: Vec<&Vec<f64>> = Vec::new();
            for a in 0..n {
                for b in a + 1..n {
                    if on_second(a) == on_second(b) {
                        same.push(&gaps[a][b]);
                    } else {
                        cross.push(&gaps[a][b]);
                    }
                }
            }
            let mean_closed = |pairs: &[&Vec<f64>]| {
                pairs.iter().map(|g| closed_by(g)).sum::<f64>() / pairs.len().max(1) as f64
            };
            let closed = mean_closed(&cross);
            let score = closed - mean_closed(&same);
            if best.as_ref().is_some_and(|b| b.score >= score - 1e-9) {
                continue;
            }
            let mean_gaps: Vec<f64> = (0..LOOKS)
                .map(|look| cross.iter().map(|g| g[look]).sum::<f64>() / cross.len() as f64)
                .collect();
            let least = mean_gaps.iter().copied().fold(f64::INFINITY, f64::min);
            let n_second = (0..n).filter(|&f| on_second(f)).count();
            // The thumb's side is the smaller one; of two fingers, the first.
            let second_is_thumb = 2 * n_second < n;
            best = Some(Self {
                thumb_side: (0..n).map(|f| on_second(f) == second_is_thumb).collect(),
                closed,
                score,
                merit: score - least,
                gaps: mean_gaps,
            });
        }
        best.expect("two fingers can be split")
    }
}

/// How much a gap shrinks on its way to its least value.
fn closed_by(gaps: &[f64]) -> f64 {
    let mut least = (f64::INFINITY, 0);
    for (look, &gap) in gaps.iter().enumerate() {
        if gap < least.0 {
            least = (gap, look);
        }
    }
    gaps[..=least.1].iter().copied().fold(0.0, f64::max) - least.0
}

/// Mean of a tip's corners, in the palm link's frame.
pub(super) fn tip_center(anatomy: &Anatomy<'_>, finger: &Chain, positions: &JointPositions) -> Point3<f64> {
    let sum = finger
        .tip_points
        .iter()
        .fold(nalgebra::Vector3::zeros(), |s, p| s + p.coords);
    anatomy.palm_from_tip(finger, positions) * Point3::from(sum / finger.tip_points.len().max(1) as f64)
}
