//! Which pre-shapes a hand needs: the principal directions of postures in which it has closed around something.

use std::collections::BTreeSet;

use nalgebra::{DMatrix, SymmetricEigen};

use super::anatomy::Anatomy;
use super::closing::{Motion, bounded, tip_center};
use super::overlap::LinkSolids;
use super::wrap::{Wraps, closing_order};
use crate::{Eigengrasp, Hand, LinkIdx};

/// Fewer postures than this have no principal directions worth the name.
pub(super) const FEWEST: usize = 4;
/// Spreading joints move only where the sides still oppose by this share of the most.
const OPPOSING: f64 = 0.5;
/// Variance (rad² or m²) of a second direction that counts as one: a hundredth of the first one's.
const SECOND: f64 = 0.01;

/// Pre-shapes leave out this share of the extension, from its closed end: half-closed fingers meet an object before they
/// are around it. And they go on by this share of it beyond the most open posture: of five hands on three objects, all kept
/// more grasps so, by 18 to 136 %.
const OPEN_SHARE: f64 = 0.5;
const WIDER_SHARE: f64 = 0.125;

/// A tenth of its range moves a spreading joint's fingertips apart by this much (m) at least, and by this share of what
/// the joint that spreads most does.
const LEAST_FAN: f64 = 5e-4;
const FAN_SHARE: f64 = 0.25;

/// What the first eigengrasp is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Spread {
    /// Joints that do not close.
    Joints,
    /// The second principal direction of closing postures.
    SecondDirection,
    /// The same direction as the second eigengrasp: the hand has no other.
    SameDirection,
}

/// Pre-shapes of a hand.
pub(super) struct Preshapes {
    /// Value of each joint at amplitudes (0, 0).
    pub origin: Vec<f64>,
    /// Spread, extension.
    pub eigengrasps: [Eigengrasp; 2],
    pub spread: Spread,
    /// Share of the variance of closing joints that the extension explains.
    pub explained: f64,
    /// How many cylinders the hand closed around.
    pub n_cylinders: usize,
}

impl Preshapes {
    pub fn new(anatomy: &Anatomy<'_>, motion: &Motion, wraps: &Wraps) -> Self {
        let closing: Vec<usize> = closing_order(anatomy, motion);
        let n_cylinders = wraps.postures.len();
        let postures = postures(anatomy, motion, wraps, &closing);
        let principal = Principal::of(&postures, &closing);
        let free: Vec<usize> = anatomy.hand.free_joints().map(|j| j.0).collect();
        let mut origin = motion.reference.clone();
        for (&joint, &value) in closing.iter().zip(&principal.mean) {
            let (low, high) = bounded(anatomy, joint);
            origin[joint] = value.clamp(low, high);
        }
        let eigengrasp = |name: &str, by_joint: &[f64], (lower, upper): (f64, f64)| Eigengrasp {
            name: name.to_owned(),
            direction: free.iter().map(|&j| by_joint[j]).collect(),
            lower,
            upper,
        };
        let spread_out = |direction: &[f64]| {
            let mut by_joint = vec![0.0; anatomy.hand.joints().len()];
            for (&joint, &d) in closing.iter().zip(direction) {
                by_joint[joint] = d;
            }
            by_joint
        };
        // More open is against the closing direction.
        let opening = |direction: &[f64]| {
            let along: f64 = closing
                .iter()
                .zip(direction)
                .map(|(&j, d)| -motion.direction[j] * d)
                .sum();
            if along < 0.0 { -1.0 } else { 1.0 }
        };
        let first = principal.signed(0, opening(&principal.directions[0]));
        let extension = eigengrasp("extension", &spread_out(&first.0), first.1);
        let (spread, kind) = match spread_of(anatomy, motion, &mut origin) {
            Some((direction, limits)) => (eigengrasp("spread", &direction, limits), Spread::Joints),
            None if principal.directions.len() > 1
                && principal.variances[1] > SECOND * principal.variances[0] =>
            {
                let second = principal.signed(1, opening(&principal.directions[1]));
                (
                    eigengrasp("spread", &spread_out(&second.0), second.1),
                    Spread::SecondDirection,
                )
            }
            None => {
                // Both share the one direction: a quarter of the way each, from half open to open.
                let (joint, (open, closed)) = (closing[0], motion.range(anatomy, closing[0]));
                origin[joint] = open + 0.25 * (closed - open);
                let eighth = ((open - closed) / 8.0).abs() / first.0[0].abs().max(1e-9);
                let limits = (-eighth, eighth);
                (
                    eigengrasp("spread", &spread_out(&first.0), limits),
                    Spread::SameDirection,
                )
            }
        };
        let mut eigengrasps = [spread, extension];
        if kind == Spread::SameDirection {
            eigengrasps[1].lower = eigengrasps[0].lower;
            eigengrasps[1].upper = eigengrasps[0].upper;
        } else {
            let extension = &mut eigengrasps[1];
            let range = extension.upper - extension.lower;
            extension.lower += OPEN_SHARE * range;
            extension.upper += WIDER_SHARE * range;
        }
        Self {
            origin,
            eigengrasps,
            spread: kind,
            explained: principal.variances[0] / principal.variances.iter().sum::<f64>().max(1e-300),
            n_cylinders,
        }
    }

    /// Narrows both amplitudes' limits to pre-shapes that do not collide with themselves: of a grid of pre-shapes to the
    /// block with the most free ones, where a collision undoes [`COLLISION_COST`] free ones. Kept as they are where all
    /// collide.
    pub fn keep_free(
        &mut self,
        described: &Hand,
        solids: &LinkSolids<'_>,
        exempt: &BTreeSet<(LinkIdx, LinkIdx)>,
    ) {
        let at = |k: usize| 2.0 * k as f64 / (GRID - 1) as f64 - 1.0;
        let free: Vec<Vec<bool>> = (0..GRID)
            .map(|i| {
                (0..GRID)
                    .map(|j| !solids.collides(exempt, &described.preshape([at(i), at(j)])))
                    .collect()
            })
            .collect();
        let Some(block) = best_block(&free) else {
            return;
        };
        let ends = self.eigengrasps.iter_mut().zip(block);
        for (eigengrasp, (first, last)) in ends {
            let (lower, upper) = (eigengrasp.lower, eigengrasp.upper);
            let step = (upper - lower) / (GRID - 1) as f64;
            // One row only stands for the amplitudes nearest to it.
            let (low, high) = if first == last {
                (first as f64 - 0.25, last as f64 + 0.25)
            } else {
                (first as f64, last as f64)
            };
            eigengrasp.lower = (lower + low * step).max(lower);
            eigengrasp.upper = (lower + high * step).min(upper);
        }
    }
}

/// Amplitudes looked at along each direction.
const GRID: usize = 11;
/// What a pre-shape that collides with itself counts in a block, against free ones of 1.
const COLLISION_COST: f64 = 8.0;

/// First and last row, first and last column of the block that counts most; `None` where no cell is free.
fn best_block(free: &[Vec<bool>]) -> Option<[(usize, usize); 2]> {
    let value = |i: usize, j: usize| if free[i][j] { 1.0 } else { -COLLISION_COST };
    let mut best = (0.0, None);
    for top in 0..free.len() {
        let mut columns = vec![0.0; free[top].len()];
        for bottom in top..free.len() {
            for (j, sum) in columns.iter_mut().enumerate() {
                *sum += value(bottom, j);
            }
            for left in 0..columns.len() {
                let mut sum = 0.0;
                for (right, column) in columns.iter().enumerate().skip(left) {
                    sum += column;
                    if sum > best.0 {
                        best = (sum, Some([(top, bottom), (left, right)]));
                    }
                }
            }
        }
    }
    best.1
}

/// Postures of the closing joints before closing around cylinders; the straight way from open to where the sides meet
/// where there are too few.
fn postures(anatomy: &Anatomy<'_>, motion: &Motion, wraps: &Wraps, closing: &[usize]) -> Vec<Vec<f64>> {
    if wraps.postures.len() >= FEWEST {
        return wraps.postures.clone();
    }
    let (pinch, open) = motion.pinch_and_open();
    (0..8)
        .map(|k| {
            let posture = motion.at(anatomy, open + (pinch - open) * f64::from(k) / 10.0);
            closing.iter().map(|&j| posture.as_slice()[j]).collect()
        })
        .collect()
}

/// Principal directions of postures.
struct Principal {
    mean: Vec<f64>,
    /// Largest variance first.
    directions: Vec<Vec<f64>>,
    variances: Vec<f64>,
    /// Least and greatest amplitude along each.
    ranges: Vec<(f64, f64)>,
}

impl Principal {
    fn of(postures: &[Vec<f64>], closing: &[usize]) -> Self {
        let (n, dim) = (postures.len() as f64, closing.len());
        let mean: Vec<f64> = (0..dim)
            .map(|k| postures.iter().map(|p| p[k]).sum::<f64>() / n)
            .collect();
        let centered = DMatrix::from_fn(postures.len(), dim, |i, k| postures[i][k] - mean[k]);
        let eigen = SymmetricEigen::new(centered.transpose() * &centered / n);
        let mut order: Vec<usize> = (0..dim).collect();
        order.sort_by(|&a, &b| {
            eigen.eigenvalues[b]
                .total_cmp(&eigen.eigenvalues[a])
                .then(a.cmp(&b))
        });
        let directions: Vec<Vec<f64>> = order
            .iter()
            .map(|&k| eigen.eigenvectors.column(k).iter().copied().collect())
            .collect();
        let ranges = directions
            .iter()
            .map(|d| {
                let along =
                    (0..postures.len()).map(|i| (0..dim).map(|k| centered[(i, k)] * d[k]).sum::<f64>());
                along.fold((0.0_f64, 0.0_f64), |(l, h), a| (l.min(a), h.max(a)))
            })
            .collect();
        Self {
            mean,
            directions,
            variances: order.iter().map(|&k| eigen.eigenvalues[k].max(0.0)).collect(),
            ranges,
        }
    }

    /// A direction with its amplitudes, turned round for a sign of −1; amplitudes are never a single point.
    fn signed(&self, k: usize, sign: f64) -> (Vec<f64>, (f64, f64)) {
        let (low, high) = self.ranges[k];
        let (low, high) = if sign < 0.0 { (-high, -low) } else { (low, high) };
        let direction = self.directions[k].iter().map(|d| sign * d).collect();
        (direction, (low.min(-1e-3), high.max(1e-3)))
    }
}

/// The direction in which joints that do not close fan the fingertips out, and its amplitudes about `origin`, which is
/// moved to the middle of them. `None` where there is no such joint.
fn spread_of(anatomy: &Anatomy<'_>, motion: &Motion, origin: &mut [f64]) -> Option<(Vec<f64>, (f64, f64))> {
    let still: BTreeSet<usize> = anatomy
        .fingers
        .iter()
        .flat_map(|f| f.joints.iter().map(|&j| anatomy.leader(j).0))
        .filter(|&j| motion.direction[j] == 0.0)
        .collect();
    let mut direction = fan_direction(anatomy, motion, &still)?;
    let length = direction.iter().map(|d| d * d).sum::<f64>().sqrt();
    if length < 1e-9 {
        return None;
    }
    for d in &mut direction {
        *d /= length;
    }
    // How far that goes either way before the sides no longer oppose, or no joint moves any more.
    let at = |amplitude: f64| {
        let mut values = motion.reference.clone();
        let mut moved = false;
        for &joint in &still {
            let (low, high) = bounded(anatomy, joint);
            let wanted = values[joint] + amplitude * direction[joint];
            moved |= direction[joint] != 0.0 && (low..=high).contains(&wanted);
            values[joint] = wanted.clamp(low, high);
        }
        moved.then_some(values)
    };
    let reaches = |sign: f64| {
        let steps = 24;
        let mut last = 0.0;
        for k in 1..=steps {
            let amplitude = sign * 2.0 * length * f64::from(k) / f64::from(steps);
            let Some(values) = at(amplitude) else { break };
            if !motion.still_opposes(anatomy, &values, OPPOSING) {
                break;
            }
            last = amplitude;
        }
        last
    };
    let (low, high) = (reaches(-1.0), reaches(1.0));
    if high - low < 1e-3 {
        return None;
    }
    let middle = f64::midpoint(low, high);
    if let Some(values) = at(middle) {
        for &joint in &still {
            origin[joint] = values[joint];
        }
    }
    Some((direction, (low - middle, high - middle)))
}

/// Half the range of each joint that fans the fingertips of the larger side out, with the sign that does; `None` where
/// no joint does.
fn fan_direction(anatomy: &Anatomy<'_>, motion: &Motion, still: &BTreeSet<usize>) -> Option<Vec<f64>> {
    let (pinch, open) = motion.pinch_and_open();
    let start = motion.at(anatomy, f64::midpoint(pinch, open));
    let n_same_side = motion.thumb_side.iter().filter(|t| !**t).count();
    let fan = |joint: usize, value: f64| {
        let mut values = start.as_slice().to_vec();
        values[joint] = value;
        let positions = anatomy.hand.joint_positions_from_slice(&values);
        let tips: Vec<_> = anatomy
            .fingers
            .iter()
            .zip(&motion.thumb_side)
            // With one finger a side there is nothing but the way between the sides.
            .filter(|(_, thumb)| !**thumb || n_same_side < 2)
            .map(|(f, _)| tip_center(anatomy, f, &positions))
            .collect();
        let pairs = (0..tips.len()).flat_map(|a| (a + 1..tips.len()).map(move |b| (a, b)));
        pairs.map(|(a, b)| (tips[a] - tips[b]).norm()).sum::<f64>()
    };
    let mut widening = vec![0.0; anatomy.hand.joints().len()];
    for &joint in still {
        let (low, high) = bounded(anatomy, joint);
        let step = 0.05 * (high - low);
        let here = motion.reference[joint];
        widening[joint] = fan(joint, (here + step).min(high)) - fan(joint, (here - step).max(low));
    }
    let most = widening.iter().fold(0.0_f64, |m, w| m.max(w.abs()));
    if most < LEAST_FAN {
        return None;
    }
    let direction = |joint: usize| {
        let (low, high) = bounded(anatomy, joint);
        let w: f64 = widening[joint];
        if w.abs() < FAN_SHARE * most {
            0.0
        } else {
            w.signum() * (high - low) / 2.0
        }
    };
    Some(
        (0..widening.len())
            .map(|j| if still.contains(&j) { direction(j) } else { 0.0 })
            .collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::best_block;

    #[test]
    fn the_block_leaves_out_what_collides() {
        let rows = ["####....", "####....", "#.......", "........"];
        let free: Vec<Vec<bool>> = rows
            .iter()
            .map(|r| r.chars().map(|c| c == '.').collect())
            .collect();
        // Four rows of four, or two rows of seven and eight: 16 against 15 less one collision.
        assert_eq!(best_block(&free), Some([(0, 3), (4, 7)]));
        assert_eq!(best_block(&[vec![false; 3], vec![false; 3]]), None);
        assert_eq!(
            best_block(&[vec![true; 2], vec![true; 2]]),
            Some([(0, 1), (0, 1)])
        );
    }
}
