//! What a mesh's annotation leaves out, guessed from its shape; each guess is noted in words.

use nalgebra::{Point3, Rotation3, Unit, Vector3};
use prehend_geometry::{OrientedBox, TriMesh};
use prehend_tutor::Opening;

use super::{Annotation, Object, Placement};

/// Types that the tutor has rules for, with a typical largest extent (m) for files without a real size.
const TYPICAL_EXTENTS: [(&str, f64); 6] = [
    ("bottle", 0.25),
    ("glass", 0.15),
    ("mug", 0.12),
    ("knife", 0.28),
    ("hammer", 0.32),
    ("screwdriver", 0.22),
];

/// The paper's six types.
pub(super) const KNOWN_KINDS: [&str; 6] = ["bottle", "glass", "mug", "knife", "hammer", "screwdriver"];

/// The types that hold liquid.
pub(super) const CONTAINERS: [&str; 3] = ["bottle", "glass", "mug"];

/// A silhouette that reaches this much farther than its median has a front: a mug's handle does (about 1.6), a
/// polygonal bottle (about 1.2) does not.
const FRONT_RATIO: f64 = 1.3;

/// The share of the height below the top that counts as the rim.
const RIM_SHARE: f64 = 0.02;

/// Scale, up and front from the annotation, else guessed.
pub(super) fn placement(
    mesh: &TriMesh,
    annotation: &Annotation,
    kind: &str,
    notes: &mut Vec<String>,
) -> Placement {
    let scale = annotation
        .metres_per_unit
        .unwrap_or_else(|| scale(mesh, kind, notes));
    let up = annotation.up.map_or_else(
        || {
            notes.push("assumed: up is the file's +z".to_owned());
            Vector3::z()
        },
        |v| Vector3::from(v).normalize(),
    );
    let front = match annotation.front {
        Some(front) => Vector3::from(front),
        None => front(mesh, &up, notes),
    };
    let front = (front - up * up.dot(&front)).normalize();
    Placement {
        scale,
        up: up.into(),
        front: front.into(),
    }
}

fn scale(mesh: &TriMesh, kind: &str, notes: &mut Vec<String>) -> f64 {
    let (low, high) = mesh.axis_aligned_bounds();
    let largest = (high - low).max();
    if largest > 20.0 {
        notes.push(format!(
            "guessed: millimetres, since the largest extent is {largest:.4} units"
        ));
        0.001
    } else if (0.02..0.6).contains(&largest) {
        notes.push(format!(
            "assumed: metres, since the largest extent is {largest:.4} units"
        ));
        1.0
    } else {
        let typical = TYPICAL_EXTENTS
            .iter()
            .find(|(k, _)| *k == kind)
            .map_or(0.2, |(_, extent)| *extent);
        notes.push(format!(
            "guessed: the largest extent of {largest:.4} units is no hand-sized length in metres or millimetres; set to {typical} m"
        ));
        typical / largest
    }
}

/// Direction of the part farthest off the up axis, or any perpendicular one for a body of revolution.
fn front(mesh: &TriMesh, up: &Vector3<f64>, notes: &mut Vec<String>) -> Vector3<f64> {
    const SECTORS: usize = 72;
    let z_from_up = Rotation3::rotation_between(up, &Vector3::z())
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    // The axis goes through the middle of the rim, which a handle does not pull aside as it does the centroid.
    let turned: Vec<Point3<f64>> = mesh.corners().flatten().map(|p| z_from_up * p).collect();
    let (low, high) = turned
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| {
            (l.min(p.z), h.max(p.z))
        });
    let rim: Vec<_> = turned
        .iter()
        .filter(|p| p.z > high - 0.05 * (high - low))
        .collect();
    let bounds = |k: usize| {
        let (l, h) = rim.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| {
            (l.min(p[k]), h.max(p[k]))
        });
        (l + h) / 2.0
    };
    let axis = Vector3::new(bounds(0), bounds(1), 0.0);
    let mut reach = [0.0_f64; SECTORS];
    let mut farthest = (0.0, Vector3::x());
    for p in &turned {
        let off = Vector3::new(p.x, p.y, 0.0) - axis;
        let radius = off.norm();
        let sector = ((off.y.atan2(off.x) / std::f64::consts::TAU).rem_euclid(1.0) * SECTORS as f64) as usize;
        reach[sector.min(SECTORS - 1)] = reach[sector.min(SECTORS - 1)].max(radius);
        if radius > farthest.0 {
            farthest = (radius, off / radius);
        }
    }
    let mut sorted: Vec<f64> = reach.iter().copied().filter(|r| *r > 0.0).collect();
    sorted.sort_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    if farthest.0 > FRONT_RATIO * median && median > 0.0 {
        let direction = z_from_up.inverse() * farthest.1;
        notes.push(format!(
            "guessed: front is {}, where the shape reaches farthest from its axis",
            axis_words(&direction)
        ));
        direction
    } else {
        notes.push("assumed: no front, since the shape is nearly round about its axis".to_owned());
        z_from_up.inverse() * Vector3::x()
    }
}

fn axis_words(v: &Vector3<f64>) -> String {
    format!("({:.2}, {:.2}, {:.2}) in the file's axes", v.x, v.y, v.z)
}

/// The opening of a vessel, from the rim at its top.
pub(super) fn opening(object: &mut Object) {
    if object.parts.opening.is_some() || !object.is_container() {
        return;
    }
    let (low, high) = object.mesh.axis_aligned_bounds();
    let rim: Vec<Point3<f64>> = object
        .mesh
        .corners()
        .flatten()
        .filter(|p| p.z > high.z - RIM_SHARE * (high.z - low.z))
        .collect();
    let middle = |k: usize| {
        let (l, h) = rim.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| {
            (l.min(p[k]), h.max(p[k]))
        });
        (l + h) / 2.0
    };
    let center = Point3::new(middle(0), middle(1), high.z);
    let radius = rim.iter().map(|p| (p - center).xy().norm()).fold(0.0, f64::max);
    object.notes.push(format!(
        "guessed: opening of radius {:.0} mm, from the rim at the top",
        radius * 1e3
    ));
    object.parts.opening = Some(Opening {
        center,
        normal: Unit::new_unchecked(Vector3::z()),
        radius,
    });
}

/// Handle and working part from the boxes of the decomposition.
pub(super) fn parts(object: &mut Object, root: &OrientedBox, boxes: &[OrientedBox]) {
    if KNOWN_KINDS.contains(&object.kind.as_str()) && !object.is_container() {
        tool_parts(object, root, boxes);
    } else if object.kind == "mug" && object.parts.handle.is_empty() {
        mug_handle(object, boxes);
    }
}

/// A tool's working end is up, so the box with the highest centre works and the rest is held.
fn tool_parts(object: &mut Object, root: &OrientedBox, boxes: &[OrientedBox]) {
    if !object.parts.handle.is_empty() && !object.parts.functional.is_empty() {
        return;
    }
    let (working, held) = if boxes.len() > 1 {
        let highest = (0..boxes.len())
            .max_by(|&a, &b| boxes[a].center().z.total_cmp(&boxes[b].center().z))
            .unwrap_or(0);
        let held = boxes
            .iter()
            .enumerate()
            .filter(|(i, _)| *i != highest)
            .map(|(_, b)| *b)
            .collect();
        (vec![boxes[highest]], held)
    } else {
        halves(root)
    };
    object.notes.push(format!(
        "guessed: working part from the highest of {} boxes, handle from the rest",
        boxes.len().max(1)
    ));
    if object.parts.functional.is_empty() {
        object.parts.functional = working;
    }
    if object.parts.handle.is_empty() {
        object.parts.handle = held;
    }
    if object.kind == "knife" && object.parts.sharp.is_empty() {
        object.parts.sharp = object.parts.functional.clone();
        object.notes.push("guessed: the whole blade is sharp".to_owned());
    }
}

/// The upper and the lower half of a box, cut across its axis nearest to the vertical.
fn halves(root: &OrientedBox) -> (Vec<OrientedBox>, Vec<OrientedBox>) {
    let k = (0..3)
        .max_by(|&a, &b| root.axis(a).z.abs().total_cmp(&root.axis(b).z.abs()))
        .unwrap_or(2);
    let up = root.axis(k) * root.axis(k).z.signum();
    let mut extents = root.extents();
    let shift = up * (extents[k] / 4.0);
    extents[k] /= 2.0;
    let half = |center| {
        OrientedBox::new(center, *root.axes(), extents)
            .into_iter()
            .collect()
    };
    (half(root.center() + shift), half(root.center() - shift))
}

/// A mug's handle is the box farthest off the axis of its opening, where there is more than one box.
fn mug_handle(object: &mut Object, boxes: &[OrientedBox]) {
    let Some(axis) = object.parts.opening.as_ref().map(|o| o.center) else {
        return;
    };
    let off = |b: &OrientedBox| (b.center() - axis).xy().norm();
    let largest = boxes.iter().map(OrientedBox::volume).fold(0.0, f64::max);
    let candidate = boxes
        .iter()
        .filter(|b| b.volume() < largest)
        .max_by(|a, b| off(a).total_cmp(&off(b)));
    if let Some(handle) = candidate {
        object
            .notes
            .push("guessed: handle from the box farthest off the axis".to_owned());
        object.parts.handle = vec![*handle];
    }
}
