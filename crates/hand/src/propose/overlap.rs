//! Which pairs of links may overlap: those that always do.

use std::collections::BTreeSet;

use nalgebra::Isometry3;
use prehend_geometry::Collider;

use super::anatomy::Anatomy;
use super::closing::bounded;
use crate::{JointPositions, LinkIdx};

/// Postures that are looked at.
const POSTURES: usize = 200;
/// Links nearer than this (m) overlap.
const TOUCHING: f64 = 1e-5;

/// Solids of links, to look for overlaps.
pub(super) struct LinkSolids<'a> {
    anatomy: &'a Anatomy<'a>,
    solids: Vec<Vec<(Collider, Isometry3<f64>)>>,
}

/// A pair of links that may overlap, and why.
pub(super) struct Exempt {
    pub pair: (LinkIdx, LinkIdx),
    pub because: &'static str,
}

impl<'a> LinkSolids<'a> {
    pub fn new(anatomy: &'a Anatomy<'a>) -> Self {
        let solids = anatomy
            .hand
            .links()
            .iter()
            .map(|link| {
                let solids = link.collision.iter();
                solids
                    .filter_map(|s| Some((Collider::new(&s.solid).ok()?, s.link_from_solid)))
                    .collect()
            })
            .collect();
        Self { anatomy, solids }
    }

    /// Whether two links overlap.
    pub fn overlap(&self, a: LinkIdx, b: LinkIdx, poses: &crate::LinkPoses) -> bool {
        let a_from_b = poses.root_from_link(a).inv_mul(&poses.root_from_link(b));
        self.solids[a.0].iter().any(|(solid, a_from_solid)| {
            self.solids[b.0].iter().any(|(other, b_from_other)| {
                let placed = a_from_solid.inv_mul(&(a_from_b * b_from_other));
                solid.distance_to(other, &placed, TOUCHING).is_some()
            })
        })
    }

    /// Whether any pair overlaps that is not exempt.
    pub fn collides(&self, exempt: &BTreeSet<(LinkIdx, LinkIdx)>, positions: &JointPositions) -> bool {
        let poses = self.anatomy.hand.link_poses(positions);
        self.pairs()
            .any(|(a, b)| !exempt.contains(&(a, b)) && self.overlap(a, b, &poses))
    }

    /// Pairs of links with shapes that no joint joins.
    fn pairs(&self) -> impl Iterator<Item = (LinkIdx, LinkIdx)> + '_ {
        let n = self.solids.len();
        (0..n)
            .flat_map(move |a| (a + 1..n).map(move |b| (LinkIdx(a), LinkIdx(b))))
            .filter(|(a, b)| !self.solids[a.0].is_empty() && !self.solids[b.0].is_empty())
    }

    /// Pairs that need no look: they move as one, or are neighbours with nothing but links without shape between
    /// them; and pairs that overlap in every posture that was looked at.
    pub fn exempt(&self) -> Vec<Exempt> {
        let hand = self.anatomy.hand;
        let group = |link: LinkIdx| self.anatomy.groups.iter().position(|g| g.contains(&link));
        let carriers: Vec<Option<LinkIdx>> =
            (0..self.solids.len()).map(|l| self.carrier(LinkIdx(l))).collect();
        let mut found = Vec::new();
        let mut open: Vec<(LinkIdx, LinkIdx)> = Vec::new();
        for (a, b) in self.pairs() {
            if hand.parent(a) == Some(b) || hand.parent(b) == Some(a) {
                continue;
            }
            let because = if group(a) == group(b) {
                "move as one"
            } else if carriers[a.0] == Some(b) || carriers[b.0] == Some(a) {
                "neighbours"
            } else {
                open.push((a, b));
                continue;
            };
            found.push(Exempt {
                pair: (a, b),
                because,
            });
        }
        for sample in 0..POSTURES {
            if open.is_empty() {
                break;
            }
            let poses = hand.link_poses(&self.sample(sample));
            open.retain(|&(a, b)| self.overlap(a, b, &poses));
        }
        found.extend(open.into_iter().map(|pair| Exempt {
            pair,
            because: "overlap in every posture",
        }));
        found.sort_by_key(|e| e.pair);
        found
    }

    /// The nearest link on the way to the root, beyond a joint, that has a shape.
    fn carrier(&self, link: LinkIdx) -> Option<LinkIdx> {
        let mut at = self.anatomy.hand.parent(link);
        while let Some(l) = at {
            if !self.solids[l.0].is_empty() {
                return Some(l);
            }
            at = self.anatomy.hand.parent(l);
        }
        None
    }

    /// The k-th posture of a sequence that fills the joints' ranges evenly: multiples of irrational steps, modulo 1.
    fn sample(&self, k: usize) -> JointPositions {
        let n = self.anatomy.hand.joints().len();
        // The positive root of x^(n+1) = x + 1 gives steps that fill n dimensions well.
        let mut root = 1.5_f64;
        for _ in 0..50 {
            root = (1.0 + root).powf(1.0 / (n as f64 + 1.0));
        }
        let values: Vec<f64> = (0..n)
            .map(|j| {
                let share = (0.5 + (k as f64) * root.powi(-(j as i32 + 1))).fract();
                let (low, high) = bounded(self.anatomy, j);
                low + share * (high - low)
            })
            .collect();
        self.anatomy.hand.joint_positions_from_slice(&values)
    }
}
