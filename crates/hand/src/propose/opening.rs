//! How wide a hand opens.

use nalgebra::Point3;

use super::anatomy::Anatomy;
use crate::{Hand, JointPositions};

/// Pre-shapes along each eigengrasp, and steps of closing from each.
const PRESHAPES: i32 = 11;
const STEPS: i32 = 20;

/// The diameter (m) of the widest cylinder across the palm that thumb and fingers can close around.
///
/// A cylinder of radius r lies on the palm. The sides hold it where their last links stand 2r apart, and reach at least
/// to the height r (1 − sin φ) where its surface leans back by the friction angle φ; soft fingertips have μ = 1, so
/// φ = 45°.
pub(super) fn opening_width(anatomy: &Anatomy<'_>, described: &Hand, thumb_side: &[bool]) -> f64 {
    let lowest_hold = 1.0 - std::f64::consts::FRAC_PI_4.sin();
    let at = |k: i32| 2.0 * f64::from(k) / f64::from(PRESHAPES - 1) - 1.0;
    let mut widest = 0.0_f64;
    for a in 0..PRESHAPES {
        for b in 0..PRESHAPES {
            let preshape = described.preshape([at(a), at(b)]);
            for step in 0..STEPS {
                let positions = closed_by(described, &preshape, f64::from(step) / f64::from(STEPS));
                let (reach, gap) = reach_and_gap(anatomy, described, thumb_side, &positions);
                widest = widest.max(gap.min(2.0 * reach / lowest_hold));
            }
        }
    }
    widest
}

/// Moves every closing joint by a share of two radians, or of its range where that is less.
fn closed_by(hand: &Hand, from: &JointPositions, share: f64) -> JointPositions {
    let mut values = from.as_slice().to_vec();
    for closing in &hand.description().expect("just described").closing {
        let joint = hand.joint(closing.joint);
        values[closing.joint.0] += closing.speed.signum() * share * (joint.upper - joint.lower).min(2.0);
    }
    hand.joint_positions_from_slice(&values)
}

/// How high above the palm the lower of both sides reaches (means over the fingers of a side), and how wide the gap
/// between their last links is along the palm's x.
fn reach_and_gap(
    anatomy: &Anatomy<'_>,
    hand: &Hand,
    thumb_side: &[bool],
    positions: &JointPositions,
) -> (f64, f64) {
    let palm_from_root = hand.root_from_palm(positions).inverse();
    let link_from_palm = hand.description().expect("just described").palm.link_from_palm;
    let palm_from_link = link_from_palm.inverse();
    let side = |of_thumb: bool| {
        let (mut inner, mut reach, mut n) = (0.0, 0.0, 0.0);
        for (finger, _) in anatomy
            .fingers
            .iter()
            .zip(thumb_side)
            .filter(|(_, t)| **t == of_thumb)
        {
            let palm_from_tip = palm_from_root * hand.link_pose(finger.tip_link, positions);
            let corners = finger.tip_points.iter().map(|p| palm_from_tip * p);
            let (low, high, top) = extremes(corners);
            inner += if of_thumb { high } else { low };
            reach += top;
            n += 1.0;
        }
        if n > 0.0 {
            return (inner / n, reach / n);
        }
        // No finger on this side: the other one closes on the palm.
        let (low, high, top) = extremes(anatomy.palm_points().into_iter().map(|p| palm_from_link * p));
        (if of_thumb { high } else { low }, top)
    };
    let ((thumb, thumb_reach), (fingers, reach)) = (side(true), side(false));
    let reach = thumb_reach.min(reach);
    // A jaw of the palm's own may stand in the one finger's way before the palm's end does.
    if let ([finger], Some(surface)) = (&anatomy.fingers[..], &anatomy.palm_surface) {
        let link_from_tip = link_from_palm * palm_from_root * hand.link_pose(finger.tip_link, positions);
        let towards_palm = link_from_palm * -nalgebra::Vector3::x();
        let corners = finger.tip_points.iter().map(|p| link_from_tip * p);
        let hits = corners.filter_map(|p| surface.cast_ray(&p, &towards_palm, 1.0));
        let gap = hits.map(|h| h.distance).fold(f64::INFINITY, f64::min);
        if gap.is_finite() {
            return (reach, gap);
        }
    }
    (reach, fingers - thumb)
}

/// Least x, greatest x, greatest z.
fn extremes(points: impl Iterator<Item = Point3<f64>>) -> (f64, f64, f64) {
    points.fold(
        (f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
        |(low, high, top), p| (low.min(p.x), high.max(p.x), top.max(p.z)),
    )
}
