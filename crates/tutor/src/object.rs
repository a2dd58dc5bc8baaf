//! An object made ready for judging: its surface as points, and what each of them belongs to.

use nalgebra::{Matrix3, Point3, Vector3};
use prehend_geometry::{ContactPoint, OrientedBox, Surface};

use crate::samples::SurfaceSamples;
use crate::{ObjectClass, Opening, Parts, Task, Thresholds, TutorError};

/// An object made ready for judging: everything that does not depend on the grasp. Object frame: z up, front +x.
///
/// Takes some milliseconds to build; afterwards a grasp is judged in a fraction of one.
#[derive(Debug, Clone)]
pub struct TutorObject {
    surface: Surface,
    parts: Parts,
    affords: Vec<Task>,
    pub(crate) samples: SurfaceSamples,
    /// Per point of the surface.
    pub(crate) on: Vec<PartOf>,
    pub(crate) center: Point3<f64>,
    pub(crate) radius: f64,
    pub(crate) vessel: Option<Vessel>,
    pub(crate) tool: Option<Tool>,
}

/// What a point of the surface belongs to. A handle's points belong to it alone, even inside another part's boxes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "four independent answers about one point"
)]
pub(crate) struct PartOf {
    pub(crate) handle: bool,
    pub(crate) functional: bool,
    pub(crate) sharp: bool,
    /// On the inside of a vessel.
    pub(crate) inside: bool,
}

/// What the rules of pouring need.
#[derive(Debug, Clone)]
pub(crate) struct Vessel {
    pub(crate) opening: Opening,
    /// Height of the whole object along the opening's normal.
    pub(crate) height: f64,
    /// Points of the liquid's way, each with its depth from the way's side.
    pub(crate) way: Vec<(Point3<f64>, f64)>,
}

/// What the rules of tool-use need.
#[derive(Debug, Clone)]
pub(crate) struct Tool {
    /// Unit vector along the handle, towards the functional part.
    pub(crate) axis: Vector3<f64>,
}

impl TutorObject {
    /// Prepares an object from its surface, annotation and class. `thresholds` shape the liquid's way; `seed` places the
    /// about 1,500 points.
    ///
    /// A part whose boxes hold no surface counts as not there.
    ///
    /// # Errors
    ///
    /// [`TutorError::NoSurface`] for a surface without area, [`TutorError::BadOpening`] for an opening without radius
    /// or direction.
    pub fn new(
        surface: &Surface,
        parts: &Parts,
        class: ObjectClass,
        thresholds: &Thresholds,
        seed: u64,
    ) -> Result<Self, TutorError> {
        if let Some(opening) = &parts.opening {
            let normal = opening.normal.into_inner();
            let sound = opening.radius.is_finite()
                && opening.radius > 0.0
                && (normal.norm() - 1.0).abs() < 1e-6
                && opening.center.iter().all(|c| c.is_finite());
            if !sound {
                return Err(TutorError::BadOpening {
                    radius: opening.radius,
                    normal: normal.into(),
                });
            }
        }
        let samples = SurfaceSamples::draw(surface.mesh(), N_SAMPLES, seed)?;
        let mut object = Self {
            surface: surface.clone(),
            parts: parts.clone(),
            affords: vec![],
            on: vec![],
            center: Point3::origin(),
            radius: 0.0,
            vessel: None,
            tool: None,
            samples,
        };
        let (low, high) = surface.axis_aligned_bounds();
        object.center = nalgebra::center(&low, &high);
        object.radius = (high - low).norm() / 2.0;
        object.on = (0..object.samples.points.len())
            .map(|i| object.part_of(&object.samples.points[i], &object.samples.normals[i]))
            .collect();
        // Parts that hold no surface are as good as absent.
        let empty = |is: fn(&PartOf) -> bool| !object.on.iter().any(is);
        if empty(|p| p.handle) {
            object.parts.handle.clear();
        }
        if empty(|p| p.functional) {
            object.parts.functional.clear();
        }
        object.affords = class.affords(&object.parts);
        object.vessel = object
            .parts
            .opening
            .map(|opening| Vessel::new(opening, surface, thresholds));
        object.tool = object.find_tool();
        Ok(object)
    }

    /// The tasks that the object affords; no grasp on it is ever labelled with another.
    pub fn affords(&self) -> &[Task] {
        &self.affords
    }

    /// The surface.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// The parts, without those that hold no surface.
    pub fn parts(&self) -> &Parts {
        &self.parts
    }

    /// Whether the object has a handle with surface on it.
    pub(crate) fn has_handle(&self) -> bool {
        !self.parts.handle.is_empty()
    }

    /// What a contact touches.
    pub(crate) fn touched_by(&self, contact: &ContactPoint) -> PartOf {
        self.part_of(&contact.point, &-contact.normal.into_inner())
    }

    /// What a point belongs to, with the outward normal of the surface there.
    fn part_of(&self, point: &Point3<f64>, outward: &Vector3<f64>) -> PartOf {
        let within = |boxes: &[OrientedBox]| boxes.iter().any(|b| b.contains(point, PART_MARGIN));
        let handle = within(&self.parts.handle);
        PartOf {
            handle,
            functional: !handle && within(&self.parts.functional),
            sharp: !handle && within(&self.parts.sharp),
            inside: !handle
                && self
                    .parts
                    .opening
                    .is_some_and(|o| self.is_inside_vessel(&o, point, outward)),
        }
    }

    /// Whether a point of the surface belongs to the inside: it lies below the rim and sees the axis, or is a floor
    /// that sees the opening.
    fn is_inside_vessel(&self, opening: &Opening, point: &Point3<f64>, outward: &Vector3<f64>) -> bool {
        let m = opening.normal.into_inner();
        let below = -(point - opening.center).dot(&m);
        if below <= 0.0 {
            return false;
        }
        let on_axis = opening.center - below * m;
        let to_axis = on_axis - point;
        let lift = LIFT * self.radius;
        let from = point + lift * outward;
        let blocked = |direction: &Vector3<f64>, length: f64| {
            length > 2.0 * lift
                && self
                    .surface
                    .cast_ray(&from, direction, length - 2.0 * lift)
                    .is_some()
        };
        let distance = to_axis.norm();
        // The way up from the axis must be open, too: a solid bottom has an axis but no inside.
        let floor = outward.dot(&m) > 0.5 && distance < opening.radius && !blocked(&m, below);
        let wall = distance > 0.0
            && outward.dot(&to_axis) > 0.2 * distance
            && !blocked(&(to_axis / distance), distance)
            && self.surface.cast_ray(&on_axis, &m, below).is_none();
        floor || wall
    }

    /// Long axis of the handle, towards the functional part.
    fn find_tool(&self) -> Option<Tool> {
        let (handle, spread) = self.mean_and_spread(|p| p.handle)?;
        let (functional, _) = self.mean_and_spread(|p| p.functional)?;
        let towards = functional - handle;
        let eigen = spread.symmetric_eigen();
        let long: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into();
        let axis = if long.dot(&towards) < 0.0 { -long } else { long };
        Some(Tool { axis })
    }

    /// Centre and covariance of a part's surface; none where there is none.
    fn mean_and_spread(&self, is: fn(&PartOf) -> bool) -> Option<(Vector3<f64>, Matrix3<f64>)> {
        let chosen = || (0..self.on.len()).filter(|&i| is(&self.on[i]));
        let area: f64 = chosen().map(|i| self.samples.areas[i]).sum();
        if area <= 0.0 {
            return None;
        }
        let mean = chosen()
            .map(|i| self.samples.areas[i] * self.samples.points[i].coords)
            .sum::<Vector3<f64>>()
            / area;
        let spread = chosen().map(|i| {
            let off = self.samples.points[i].coords - mean;
            self.samples.areas[i] * off * off.transpose()
        });
        Some((mean, spread.sum::<Matrix3<f64>>() / area))
    }
}

/// How many points stand for the surface, about.
const N_SAMPLES: usize = 1500;
/// Boxes grow by this (m), so that contacts just off the surface still count.
const PART_MARGIN: f64 = 0.001;
/// Rays start this share of the object's radius off the surface.
const LIFT: f64 = 1e-4;

impl Vessel {
    fn new(opening: Opening, surface: &Surface, thresholds: &Thresholds) -> Self {
        let m = opening.normal.into_inner();
        let heights = surface.mesh().corners().flatten().map(|p| p.coords.dot(&m));
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| {
            (l.min(x), h.max(x))
        });
        let across = if m.x.abs() < 0.9 {
            Vector3::x()
        } else {
            Vector3::y()
        };
        let u = m.cross(&across).normalize();
        let v = m.cross(&u);
        let (first, last) = (-thresholds.opening_depth, thresholds.opening_height);
        let mut way = Vec::new();
        for layer in 0..N_LAYERS {
            let along = first + (last - first) * f64::from(layer) / f64::from(N_LAYERS - 1);
            let middle = opening.center + along * opening.radius * m;
            way.push((middle, opening.radius));
            for ring in 1..=N_RINGS {
                let r = opening.radius * f64::from(ring) / f64::from(N_RINGS);
                let n = 6 * ring;
                for k in 0..n {
                    let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(n)).sin_cos();
                    way.push((middle + r * (cos * u + sin * v), opening.radius - r));
                }
            }
        }
        Self {
            opening,
            height: high - low,
            way,
        }
    }
}

/// Layers of points in the liquid's way.
const N_LAYERS: u32 = 6;
/// Rings of points in a layer.
const N_RINGS: u32 = 4;
