//! Where the palm is and where it looks.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use prehend_geometry::{Surface, minimum_volume_box};

use super::anatomy::{Anatomy, diagonal};
use super::closing::{Motion, tip_center};
use super::wrap::{Wraps, closing_order, cylinders};
use crate::{JointKind, PalmFrame};

/// A closing direction this near (cosine of 25°) to one of the palm's own axes is that axis.
const SNAP: f64 = 0.906;

/// Directions this near (cosine of 10°) are one.
const SAME: f64 = 0.985;
/// z is across the flexion axes where their cosine is less than this (60°).
const ACROSS: f64 = 0.5;
/// The fingers' axes agree where their mean is longer than this.
const AGREE: f64 = 0.5;
/// How much it counts that the fingers meet in front of the palm, beside the share of cylinders held.
const IN_FRONT: f64 = 0.3;

/// Looks on the way from open to where the sides meet.
const WAY_LOOKS: usize = 8;

/// A palm frame, and by how much its approach direction beat the next best.
pub(super) struct Found {
    pub palm: PalmFrame,
    pub margin: f64,
}

/// The palm frame and the pre-shapes that go with it.
///
/// z is one of the palm's own axes, across the axes about which the larger side's fingers flex (or the line on which
/// they slide); x is across both. Of all such frames the one wins in which the fingers can close around the most
/// cylinders on the palm; next counts that the place where the sides meet lies in front of the palm.
pub(super) fn palm_frame(anatomy: &Anatomy<'_>, motion: &Motion) -> (Found, Wraps) {
    let palm_points = anatomy.palm_points();
    let (pinch, open) = motion.pinch_and_open();
    let (thumb, fingers) = sides_at(anatomy, motion, pinch);
    let meeting = nalgebra::center(&thumb, &fingers);
    // Where the fingers are, seen from the thumb: on the whole way from open to where they meet.
    let looks = (0..WAY_LOOKS).map(|k| open + (pinch - open) * k as f64 / WAY_LOOKS as f64);
    let between = looks.map(|t| {
        let (thumb, fingers) = sides_at(anatomy, motion, t);
        fingers - thumb
    });
    let from_thumb = between.sum::<Vector3<f64>>().try_normalize(1e-6);
    let turning = Turning::of(anatomy, motion);

    let mut axes: Vec<Vector3<f64>> = vec![Vector3::x(), Vector3::y(), Vector3::z()];
    if let Ok(found) = minimum_volume_box(&palm_points) {
        let own = (0..3).map(|k| found.axes.matrix().column(k).into_owned());
        axes.extend(own.filter(|a: &Vector3<f64>| a.iter().all(|c| c.is_finite())));
    }
    let mut candidates: Vec<Vector3<f64>> = Vec::new();
    for z in axes.iter().flat_map(|a| [*a, -a]) {
        if turning.allows(&z) && !candidates.iter().any(|c| c.dot(&z) > SAME) {
            candidates.push(z);
        }
    }
    let center = mean(&palm_points);
    let size = diagonal(&palm_points).max(1e-6);
    let closing = closing_order(anatomy, motion);
    let cylinders = cylinders(motion);
    let mut found: Vec<(f64, PalmFrame, Wraps)> = candidates
        .into_iter()
        .map(|z| {
            let x = closing_axis(&axes, &turning, from_thumb, &z);
            let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
            let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
            let origin = on_palm(&palm_points, anatomy.palm_surface.as_ref(), &meeting, &rotation);
            let palm = PalmFrame {
                link: anatomy.palm,
                link_from_palm: Isometry3::from_parts(origin.into(), rotation),
            };
            let wraps = Wraps::new(anatomy, motion, &palm, &closing, &cylinders);
            let forward = (meeting - center).try_normalize(1e-9).map_or(0.0, |f| f.dot(&z));
            let off = beside(&palm_points, &meeting, &z) / size;
            let held = wraps.n_held as f64 / wraps.n_cylinders as f64;
            (held + IN_FRONT * (forward - off), palm, wraps)
        })
        .collect();
    // Stable: the first of equals.
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let next = found.get(1).map_or(f64::NEG_INFINITY, |f| f.0);
    let (merit, palm, wraps) = found.swap_remove(0);
    let margin = (merit - next).clamp(0.0, 1.0);
    (Found { palm, margin }, wraps)
}

/// What the larger side's fingers move about or along, in the palm link's frame.
struct Turning {
    /// Unit; `None` where the fingers do not agree.
    axis: Option<Vector3<f64>>,
    slides: bool,
}

impl Turning {
    fn of(anatomy: &Anatomy<'_>, motion: &Motion) -> Self {
        let hand = anatomy.hand;
        let positions = hand.joint_positions_from_slice(&motion.reference);
        let poses = hand.link_poses(&positions);
        let palm_from_root = poses.root_from_link(anatomy.palm).inverse();
        let (mut sum, mut n, mut slides) = (Vector3::zeros(), 0.0, true);
        let sides = anatomy.fingers.iter().zip(&motion.thumb_side);
        for (finger, _) in sides.filter(|(_, thumb)| !**thumb) {
            let Some(&joint) = finger.flexion.first() else {
                continue;
            };
            let (leader, factor) = anatomy.leader(joint);
            sum += palm_from_root
                * hand.joint_axis(joint, &poses).1
                * (motion.direction[leader] * factor).signum();
            n += 1.0;
            slides &= hand.joint(joint).kind == JointKind::Prismatic;
        }
        let agree: bool = sum.norm() > AGREE * n;
        Self {
            axis: if agree { sum.try_normalize(1e-9) } else { None },
            slides,
        }
    }

    fn allows(&self, z: &Vector3<f64>) -> bool {
        self.axis.is_none_or(|axis| axis.dot(z).abs() < ACROSS)
    }
}

/// Mean of the tips on the thumb's side, and on the other, in the palm link's frame. One finger closes on the palm.
fn sides_at(anatomy: &Anatomy<'_>, motion: &Motion, t: f64) -> (Point3<f64>, Point3<f64>) {
    let positions = motion.at(anatomy, t);
    let side = |of_thumb: bool| {
        let tips: Vec<Point3<f64>> = anatomy
            .fingers
            .iter()
            .zip(&motion.thumb_side)
            .filter(|(_, thumb)| **thumb == of_thumb)
            .map(|(finger, _)| tip_center(anatomy, finger, &positions))
            .collect();
        (!tips.is_empty()).then(|| mean(&tips))
    };
    let palm = || mean(&anatomy.palm_points());
    (side(true).unwrap_or_else(palm), side(false).unwrap_or_else(palm))
}

fn mean(points: &[Point3<f64>]) -> Point3<f64> {
    let sum = points.iter().fold(Vector3::zeros(), |s, p| s + p.coords);
    Point3::from(sum / points.len().max(1) as f64)
}

/// How far (m) a point stands beside the shadow that the palm's box throws along `z`.
fn beside(palm: &[Point3<f64>], point: &Point3<f64>, z: &Vector3<f64>) -> f64 {
    if palm.is_empty() {
        return 0.0;
    }
    let (u, v) = across(z);
    let off = |axis: &Vector3<f64>| {
        let (low, high) = extent(palm, axis);
        let at = point.coords.dot(axis);
        (low - at).max(at - high).max(0.0)
    };
    off(&u).hypot(off(&v))
}

fn extent(points: &[Point3<f64>], axis: &Vector3<f64>) -> (f64, f64) {
    points
        .iter()
        .map(|p| p.coords.dot(axis))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), d| {
            (l.min(d), h.max(d))
        })
}

/// Two unit vectors across a third.
fn across(z: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let other = if z.x.abs() < 0.9 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let u = (other - z * z.dot(&other)).normalize();
    (u, z.cross(&u))
}

fn closing_axis(
    axes: &[Vector3<f64>],
    turning: &Turning,
    from_thumb: Option<Vector3<f64>>,
    z: &Vector3<f64>,
) -> Vector3<f64> {
    let flat = |v: Vector3<f64>| (v - z * z.dot(&v)).try_normalize(1e-3);
    let line = match turning.axis {
        Some(axis) if turning.slides => flat(axis),
        Some(axis) => flat(axis.cross(z)),
        None => from_thumb.and_then(flat),
    };
    let Some(line) = line else {
        return across(z).0;
    };
    let towards = from_thumb.map_or(1.0, |t| if t.dot(&line) < 0.0 { -1.0 } else { 1.0 });
    let x = line * towards;
    let signed = axes.iter().flat_map(|a| [*a, -a]).filter_map(flat);
    let nearest = signed.max_by(|a, b| a.dot(&x).total_cmp(&b.dot(&x)));
    nearest.filter(|a| a.dot(&x) > SNAP).unwrap_or(x)
}

/// The point of the palm below the place where the fingers meet; moved over the palm where that lies beside it.
fn on_palm(
    palm: &[Point3<f64>],
    surface: Option<&Surface>,
    meeting: &Point3<f64>,
    rotation: &UnitQuaternion<f64>,
) -> Point3<f64> {
    if palm.is_empty() {
        return Point3::origin();
    }
    let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()].map(|a| rotation * a);
    let inside = |axis: &Vector3<f64>| {
        let (low, high) = extent(palm, axis);
        meeting.coords.dot(axis).clamp(low, high)
    };
    let top = extent(palm, &z).1;
    let above = x * inside(&x) + y * inside(&y) + z * (top + 0.01);
    let hit = surface.and_then(|s| s.cast_ray(&Point3::from(above), &-z, 1e3));
    Point3::from(above - z * hit.map_or(0.01, |h| h.distance))
}
