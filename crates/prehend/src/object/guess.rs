//! What a mesh's annotation leaves out, guessed from its shape; each guess is noted in words.

use std::path::Path;

use nalgebra::{Point3, Rotation3, Unit, Vector3};
use prehend_geometry::{OrientedBox, Stated, TriMesh};
use prehend_tutor::Opening;

use super::{Annotation, Object, ObjectOptions, Origin, Origins, Placement};
use crate::Error;

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

/// A rim of a smaller radius (m) is a tip: nothing can be poured through it.
const LEAST_OPENING: f64 = 0.001;

/// Scale, up and front from the caller, else the annotation, else the file, else guessed.
pub(super) fn placement(
    mesh: &TriMesh,
    options: &ObjectOptions,
    annotation: &Annotation,
    stated: Stated,
    kind: &str,
    notes: &mut Vec<String>,
) -> Result<(Placement, Origins), Error> {
    let stated = if options.as_is { Stated::default() } else { stated };
    let said = |flag: Option<[f64; 3]>, toml: Option<[f64; 3]>, file: Option<[f64; 3]>| {
        flag.map(|v| (v, Origin::Flag))
            .or(toml.map(|v| (v, Origin::Toml)))
            .or(file.map(|v| (v, Origin::File)))
    };
    let (scale, scale_origin) = options
        .scale
        .map(|s| (s, Origin::Flag))
        .or(annotation.metres_per_unit.map(|s| (s, Origin::Toml)))
        .or(stated.metres_per_unit.map(|s| (s, Origin::File)))
        .unwrap_or_else(|| {
            if options.as_is {
                (1.0, Origin::Assumed)
            } else {
                scale(mesh, kind, notes)
            }
        });
    let (up, up_origin) = said(
        options.up,
        annotation.up,
        stated.up.map(|v| v.into_inner().into()),
    )
    .unwrap_or_else(|| {
        if !options.as_is {
            notes.push("assumed: up is the file's +z".to_owned());
        }
        ([0.0, 0.0, 1.0], Origin::Assumed)
    });
    // The caller's own directions have not been checked yet; one without length is refused below.
    let upward = Vector3::from(up).try_normalize(1e-9).unwrap_or_else(Vector3::z);
    let (front, front_origin) = said(options.front, annotation.front, None).unwrap_or_else(|| {
        if options.as_is {
            (any_front(&upward), Origin::Assumed)
        } else {
            front(mesh, &upward, notes)
        }
    });
    let origins = Origins {
        scale: scale_origin,
        up: up_origin,
        front: front_origin,
    };
    Ok((Placement::new(scale, up, front)?, origins))
}

/// The file's +x as front, or +y where +x is up.
pub(super) fn any_front(up: &Vector3<f64>) -> [f64; 3] {
    if up.x.abs() < 0.9 {
        [1.0, 0.0, 0.0]
    } else {
        [0.0, 1.0, 0.0]
    }
}

fn scale(mesh: &TriMesh, kind: &str, notes: &mut Vec<String>) -> (f64, Origin) {
    let (low, high) = mesh.axis_aligned_bounds();
    let largest = (high - low).max();
    if largest > 20.0 {
        notes.push(format!(
            "guessed: millimetres, since the largest extent is {largest:.4} units"
        ));
        (0.001, Origin::Guessed)
    } else if (0.02..0.6).contains(&largest) {
        notes.push(format!(
            "assumed: metres, since the largest extent is {largest:.4} units"
        ));
        (1.0, Origin::Assumed)
    } else {
        let typical = TYPICAL_EXTENTS
            .iter()
            .find(|(k, _)| *k == kind)
            .map_or(0.2, |(_, extent)| *extent);
        notes.push(format!(
            "guessed: the largest extent of {largest:.4} units is no hand-sized length in metres or millimetres; set to {typical} m"
        ));
        (typical / largest, Origin::Guessed)
    }
}

/// Whether a shape without annotation may be taken for millimetres: a mug, bottle, … of 30 to 600 units.
pub fn is_in_millimetres(points: &[Point3<f64>], path: &Path) -> bool {
    let lower = path.to_string_lossy().to_ascii_lowercase();
    KNOWN_KINDS.iter().any(|kind| lower.contains(kind)) && looks_like_millimetres(points)
}

/// Whether the largest extent is that of a thing for a hand, in millimetres.
pub fn looks_like_millimetres(points: &[Point3<f64>]) -> bool {
    let extent = |k: usize| {
        let (low, high) = points
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| {
                (l.min(p[k]), h.max(p[k]))
            });
        high - low
    };
    (30.0..=600.0).contains(&(0..3).map(extent).fold(0.0, f64::max))
}

/// Direction of the part farthest off the up axis, or any perpendicular one for a body of revolution.
fn front(mesh: &TriMesh, up: &Vector3<f64>, notes: &mut Vec<String>) -> ([f64; 3], Origin) {
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
        (direction.into(), Origin::Guessed)
    } else {
        notes.push("assumed: no front, since the shape is nearly round about its axis".to_owned());
        ((z_from_up.inverse() * Vector3::x()).into(), Origin::Assumed)
    }
}

fn axis_words(v: &Vector3<f64>) -> String {
    // Adding 0 turns −0 into 0.
    let [x, y, z] = [v.x, v.y, v.z].map(|c| (c * 100.0).round() / 100.0 + 0.0);
    format!("({x:.2}, {y:.2}, {z:.2}) in the file's axes")
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
    if radius < LEAST_OPENING {
        object
            .notes
            .push("guessed: no opening, since the shape ends in a point at the top".to_owned());
        return;
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ObjectOptions;

    /// A box with these corners, of twelve triangles.
    fn block(low: [f64; 3], high: [f64; 3]) -> TriMesh {
        let (low, high) = (Vector3::from(low), Vector3::from(high));
        let solid = OrientedBox::new(((low + high) / 2.0).into(), Rotation3::identity(), high - low);
        solid.unwrap().surface()
    }

    /// Two bodies in one mesh.
    fn both(a: &TriMesh, b: &TriMesh) -> TriMesh {
        let n = u32::try_from(a.vertices().len()).unwrap();
        let vertices = a.vertices().iter().chain(b.vertices()).copied().collect();
        let shifted = b.triangles().iter().map(|t| t.map(|i| i + n));
        TriMesh::new(vertices, a.triangles().iter().copied().chain(shifted).collect()).unwrap()
    }

    fn object(kind: &str, mesh: TriMesh) -> Object {
        let annotation = Annotation {
            kind: Some(kind.into()),
            ..Annotation::default()
        };
        Object::assemble(
            Path::new("thing.ply"),
            mesh,
            Stated::default(),
            &annotation,
            ObjectOptions::default(),
        )
        .unwrap()
    }

    fn says(object: &Object, words: &str) -> bool {
        object.notes.iter().any(|n| n.contains(words))
    }

    /// A mug in millimetres: a body 80 wide and 96 high, its handle towards −y.
    fn mug_in_millimetres() -> TriMesh {
        both(
            &block([-40.0, -40.0, 0.0], [40.0, 40.0, 96.0]),
            &block([-5.0, -90.0, 30.0], [5.0, -40.0, 60.0]),
        )
    }

    #[test]
    fn a_mug_in_millimetres_comes_in_metres_with_its_handle_in_front() {
        let mug = object("mug", mug_in_millimetres());
        assert_eq!(mug.placement.scale, 0.001);
        assert!(says(&mug, "guessed: millimetres"), "{:?}", mug.notes);
        assert!(mug.placement.front[1] < -0.99, "{:?}", mug.placement);
        let (low, high) = mug.mesh.axis_aligned_bounds();
        assert!((high.z - low.z - 0.096).abs() < 1e-9);
        assert!(high.x > 0.089, "the handle points along +x: {high}");
    }

    #[test]
    fn the_opening_lies_in_the_rim_at_the_top() {
        let mug = object("mug", mug_in_millimetres());
        let opening = mug.parts.opening.as_ref().unwrap();
        assert!((opening.center - Point3::new(0.0, 0.0, 0.096)).norm() < 1e-9);
        // A square rim: as far as its corners.
        assert!((opening.radius - 0.04 * 2.0_f64.sqrt()).abs() < 1e-6);
        assert!(says(&mug, "guessed: opening of radius 57 mm"), "{:?}", mug.notes);
    }

    #[test]
    fn a_vessel_that_ends_in_a_point_has_no_opening() {
        let cone = TriMesh::new(
            vec![
                Point3::new(-0.04, -0.04, 0.0),
                Point3::new(0.04, -0.04, 0.0),
                Point3::new(0.0, 0.04, 0.0),
                Point3::new(0.0, 0.0, 0.1),
            ],
            vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
        )
        .unwrap();
        let glass = object("glass", cone);
        assert!(glass.parts.opening.is_none());
        assert!(says(&glass, "no opening"), "{:?}", glass.notes);
    }

    #[test]
    fn the_handle_of_a_mug_is_the_box_farthest_off_its_axis() {
        let mut mug = object("mug", mug_in_millimetres());
        let of = |center: [f64; 3], extents: [f64; 3]| {
            OrientedBox::new(
                Point3::from(center),
                Rotation3::identity(),
                Vector3::from(extents),
            )
            .unwrap()
        };
        let body = of([0.0, 0.0, 0.048], [0.08, 0.08, 0.096]);
        let handle = of([0.065, 0.0, 0.045], [0.05, 0.01, 0.03]);
        mug.guess_parts(&body, &[body, handle]);
        assert_eq!(mug.parts.handle.len(), 1);
        assert_eq!(mug.parts.handle[0].center(), handle.center());
        assert!(says(&mug, "handle from the box farthest off the axis"));
    }

    #[test]
    fn a_tool_works_with_its_highest_box_and_a_knife_cuts_with_it() {
        let shaft = OrientedBox::new(
            Point3::new(0.0, 0.0, 0.06),
            Rotation3::identity(),
            Vector3::new(0.02, 0.02, 0.12),
        )
        .unwrap();
        let blade = OrientedBox::new(
            Point3::new(0.0, 0.0, 0.2),
            Rotation3::identity(),
            Vector3::new(0.03, 0.004, 0.16),
        )
        .unwrap();
        let mut knife = object("knife", block([-0.01, -0.01, 0.0], [0.01, 0.01, 0.28]));
        knife.guess_parts(&shaft, &[shaft, blade]);
        assert_eq!(knife.parts.functional[0].center(), blade.center());
        assert_eq!(knife.parts.handle[0].center(), shaft.center());
        assert_eq!(knife.parts.sharp.len(), 1);

        // With one box alone, the upper half works.
        let mut hammer = object("hammer", block([-0.01, -0.01, 0.0], [0.01, 0.01, 0.28]));
        hammer.guess_parts(&shaft, &[shaft]);
        assert!((hammer.parts.functional[0].center().z - 0.09).abs() < 1e-12);
        assert!((hammer.parts.handle[0].center().z - 0.03).abs() < 1e-12);
        assert!(hammer.parts.sharp.is_empty());
    }

    #[test]
    fn an_extent_that_is_neither_metres_nor_millimetres_becomes_the_typical_one() {
        let bottle = object("bottle", block([-0.3, -0.3, 0.0], [0.3, 0.3, 2.0]));
        let (low, high) = bottle.mesh.axis_aligned_bounds();
        assert!(((high - low).max() - 0.25).abs() < 1e-9);
        assert!(says(&bottle, "set to 0.25 m"), "{:?}", bottle.notes);
    }
}
