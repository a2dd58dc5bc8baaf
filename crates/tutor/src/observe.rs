//! What the tutor sees of a grasp: the margin of every rule that applies.

use std::collections::VecDeque;

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use prehend_geometry::ContactPoint;
use prehend_hand::{JointPositions, LinkIdx};

use crate::object::PartOf;
use crate::placed_hand::PlacedHand;
use crate::{Rule, Task, Thresholds, TutorHand, TutorObject};

/// A grasp as the tutor sees it.
#[derive(Debug, Clone, Copy)]
pub struct GraspView<'a> {
    /// Pose of the hand's root link in the object frame.
    pub object_from_root: Isometry3<f64>,
    /// The hand's posture.
    pub joints: &'a JointPositions,
    /// Which link touches the object where; object frame, normals into the object.
    pub contacts: &'a [(LinkIdx, ContactPoint)],
}

/// The margins of one grasp, for every rule that applies to the object, in the order of [`Rule::ALL`]. Positive margins
/// speak for the task. Every persona judges from the same observation.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    pub(crate) affords: Vec<Task>,
    pub(crate) margins: Vec<(Rule, f64)>,
}

impl Observation {
    /// The margins, each in the unit that [`Rule::margin_in_words`] names.
    pub fn margins(&self) -> &[(Rule, f64)] {
        &self.margins
    }
}

/// Looks at a grasp once, for all personas. Margins are finite for finite poses.
///
/// Takes a few tenths of a millisecond.
pub fn observe(
    hand: &TutorHand,
    object: &TutorObject,
    grasp: &GraspView,
    thresholds: &Thresholds,
) -> Observation {
    let reach = thresholds.free_distance.max(CLEARANCE_CAP);
    let placed = hand.placed(
        &grasp.object_from_root,
        grasp.joints,
        &object.center,
        object.radius,
        reach,
    );
    let object_from_palm = hand.object_from_palm(&grasp.object_from_root, grasp.joints);
    let palm = Point3::from(object_from_palm.translation.vector);
    let approach = object_from_palm * Vector3::z();
    let closing = object_from_palm * Vector3::x();
    let touched: Vec<PartOf> = grasp.contacts.iter().map(|(_, c)| object.touched_by(c)).collect();

    // The palm may lean on a wall while the fingers hold a handle.
    let palm_link = hand.hand().description().map(|d| d.palm.link);
    let by_fingers: Vec<PartOf> = grasp
        .contacts
        .iter()
        .zip(&touched)
        .filter(|((link, _), _)| Some(*link) != palm_link)
        .map(|(_, on)| *on)
        .collect();

    let mut margins = hand_over(object, &placed, &by_fingers, thresholds);
    if object.affords().contains(&Task::Pouring) {
        margins.extend(pouring(object, &placed, &touched, &palm, &approach, thresholds));
    }
    if object.affords().contains(&Task::ToolUse) {
        margins.extend(tool_use(object, &touched, &palm, &approach, &closing, thresholds));
    }
    Observation {
        affords: object.affords().to_vec(),
        margins,
    }
}

/// Distances beyond this (m) are all the same to a rule.
const CLEARANCE_CAP: f64 = 0.020;

fn hand_over(
    object: &TutorObject,
    placed: &PlacedHand,
    by_fingers: &[PartOf],
    thresholds: &Thresholds,
) -> Vec<(Rule, f64)> {
    let samples = &object.samples;
    let free: Vec<bool> = samples
        .points
        .iter()
        .map(|p| !placed.is_near(p, thresholds.free_distance))
        .collect();
    let share = |of: &dyn Fn(usize) -> bool| {
        let area = |free_only: bool| -> f64 {
            (0..free.len())
                .filter(|&i| of(i) && (free[i] || !free_only))
                .map(|i| samples.areas[i])
                .sum()
        };
        area(true) / area(false)
    };
    let mut margins = vec![
        (Rule::SurfaceLeftFree, share(&|_| true) - thresholds.free_share),
        (
            Rule::PatchForReceiver,
            best_patch(object, &free, thresholds.patch) - 1.0,
        ),
    ];
    if object.has_handle() {
        if object.vessel.is_some() {
            let on_handle = by_fingers.iter().filter(|t| t.handle).count();
            let lesser = on_handle.min(by_fingers.len() - on_handle);
            margins.push((Rule::NotHandleAndWall, 1.0 - lesser as f64));
        }
        margins.push((
            Rule::HandleLeftFree,
            share(&|i| object.on[i].handle) - thresholds.free_handle_share,
        ));
    }
    margins
}

fn pouring(
    object: &TutorObject,
    placed: &PlacedHand,
    touched: &[PartOf],
    palm: &Point3<f64>,
    approach: &Vector3<f64>,
    thresholds: &Thresholds,
) -> Vec<(Rule, f64)> {
    let Some(vessel) = &object.vessel else {
        return vec![];
    };
    let m = vessel.opening.normal.into_inner();
    let mut clearance = CLEARANCE_CAP;
    let mut reach = 0.0_f64;
    for (point, depth) in &vessel.way {
        let distance = placed.distance(point, CLEARANCE_CAP);
        clearance = clearance.min(distance);
        if distance <= 0.0 {
            reach = reach.max(*depth);
        }
    }
    let off_rim = (palm - vessel.opening.center).dot(&m).abs() / vessel.height;
    vec![
        (Rule::OpeningClear, clearance - reach + thresholds.opening_reach),
        (
            Rule::ApproachOffOpening,
            approach.angle(&-m) - thresholds.opening_angle,
        ),
        (
            Rule::InsideUntouched,
            none_of(touched.iter().filter(|t| t.inside).count()),
        ),
        (Rule::PalmOffRim, off_rim - thresholds.rim_share),
        (Rule::WristCanTilt, approach.angle(&m) - thresholds.tilt_angle),
    ]
}

fn tool_use(
    object: &TutorObject,
    touched: &[PartOf],
    palm: &Point3<f64>,
    approach: &Vector3<f64>,
    closing: &Vector3<f64>,
    thresholds: &Thresholds,
) -> Vec<(Rule, f64)> {
    let Some(tool) = &object.tool else { return vec![] };
    let on_handle = touched.iter().filter(|t| t.handle).count() as f64 / touched.len().max(1) as f64;
    let distance_to = |handle: bool| {
        let chosen = object
            .samples
            .points
            .iter()
            .zip(&object.on)
            .filter(|(_, on)| on.handle == handle);
        chosen
            .map(|(p, _)| (p - palm).norm())
            .fold(f64::INFINITY, f64::min)
    };
    // A tool that is all handle has nothing else for the palm to be over.
    let nearer = (distance_to(false) - distance_to(true)).clamp(-1.0, 1.0);
    let along = closing.angle(&tool.axis);
    let off_axis = along.min(std::f64::consts::PI - along);
    vec![
        (Rule::ContactsOnHandle, on_handle - thresholds.handle_share),
        (Rule::PalmOverHandle, nearer),
        (
            Rule::FunctionalUntouched,
            none_of(touched.iter().filter(|t| t.functional).count()),
        ),
        (Rule::ClosesAcross, off_axis - thresholds.across_angle),
        (
            Rule::ApproachOffFunctional,
            approach.angle(&-tool.axis) - thresholds.functional_angle,
        ),
    ]
}

/// 1 where nothing offends, else minus how much does.
fn none_of(count: usize) -> f64 {
    if count == 0 { 1.0 } else { -(count as f64) }
}

/// Size of the best free patch relative to `asked` length × width; 1 is just enough.
///
/// A patch is a connected set of free points that are neither sharp nor on the inside of a vessel. Its length is its
/// extent along its longest direction; its width its area divided by that, so that a free handle counts unrolled.
fn best_patch(object: &TutorObject, free: &[bool], asked: [f64; 2]) -> f64 {
    let samples = &object.samples;
    let wanted = |i: usize| free[i] && !object.on[i].sharp && !object.on[i].inside;
    let mut visited = vec![false; free.len()];
    let mut best = 0.0_f64;
    for start in 0..free.len() {
        if visited[start] || !wanted(start) {
            continue;
        }
        visited[start] = true;
        let mut patch = vec![start];
        let mut queue = VecDeque::from([start]);
        while let Some(i) = queue.pop_front() {
            for &j in &samples.neighbors[i] {
                let j = j as usize;
                if !visited[j] && wanted(j) {
                    visited[j] = true;
                    patch.push(j);
                    queue.push_back(j);
                }
            }
        }
        let area: f64 = patch.iter().map(|&i| samples.areas[i]).sum();
        let length = extent(patch.iter().map(|&i| samples.points[i].coords));
        if length > 0.0 {
            best = best.max((length / asked[0]).min(area / length / asked[1]));
        }
    }
    best.min(PATCH_CAP)
}

/// Patches beyond this many times the size asked are all the same.
const PATCH_CAP: f64 = 3.0;

/// Length of a set of points along its principal direction.
fn extent(points: impl Iterator<Item = Vector3<f64>> + Clone) -> f64 {
    let n = points.clone().count() as f64;
    let mean = points.clone().sum::<Vector3<f64>>() / n;
    let spread: Matrix3<f64> = points.clone().map(|p| (p - mean) * (p - mean).transpose()).sum();
    let eigen = spread.symmetric_eigen();
    let long: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into();
    let (low, high) = points
        .map(|p| p.dot(&long))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| {
            (l.min(x), h.max(x))
        });
    (high - low).max(0.0)
}
