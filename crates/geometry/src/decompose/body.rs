//! A body twice: where it lies, and in its own frame, where everything is decided.

use nalgebra::{Point3, Vector3};

use super::body_frame::BodyFrame;
use super::fit::Cloud;
use super::region::{Plane, Region};
use super::whole::Whole;
use super::{DecomposeMethod, DecomposeOptions};
use crate::min_box::minimum_volume_box_near;
use crate::{GeometryError, OrientedBox, TriMesh};

/// A body, and the lengths that the options mean for it.
pub(super) struct Body {
    /// The smallest box around it where it lies (m).
    pub(super) root: OrientedBox,
    /// All of it, in its own frame and where it lies.
    thought: Whole,
    real: Whole,
    /// A quickly found box around it in its own frame.
    pub(super) quick_root: OrientedBox,
    /// [`DecomposeOptions::min_extent`] and [`DecomposeOptions::min_slab`] in its own frame.
    pub(super) min_extent: f64,
    pub(super) min_slab: f64,
    /// Fewest points that a cut may leave on a side.
    pub(super) min_points: usize,
    frame: BodyFrame,
    min_real_extent: f64,
}

/// A part of a body, cut out of both by the same planes.
#[derive(Clone)]
pub(super) struct Part {
    /// In the body's own frame, rounded: for decisions.
    pub(super) thought: Region,
    /// Where it lies, exactly: for the boxes.
    pub(super) real: Region,
}

/// With so many triangles cuts are chosen where many of them are tried; boxes are fitted to all triangles.
const N_TRIANGLES: usize = 2000;

/// Fewer points of a cloud than these are no part of a body.
const MIN_CLOUD_POINTS: usize = 20;

impl Body {
    pub(super) fn of_mesh(mesh: &TriMesh, options: &DecomposeOptions) -> Result<Self, GeometryError> {
        let n_triangles = match options.method {
            DecomposeMethod::FitAndSplit => usize::MAX,
            DecomposeMethod::Refined { .. } | DecomposeMethod::Exactly { .. } => N_TRIANGLES,
        };
        Self::new(Region::of_mesh(mesh), 1, n_triangles, options)
    }

    pub(super) fn of_points(
        points: &[Point3<f64>],
        options: &DecomposeOptions,
    ) -> Result<Self, GeometryError> {
        Self::new(Region::of_points(points), MIN_CLOUD_POINTS, usize::MAX, options)
    }

    fn new(
        real: Region,
        min_points: usize,
        n_triangles: usize,
        options: &DecomposeOptions,
    ) -> Result<Self, GeometryError> {
        let smallest = minimum_volume_box_near(real.vertices(), &[])?;
        let longest = smallest.extents.max();
        let frame = BodyFrame::of(&real).filter(|_| (longest * longest * longest).is_finite());
        let Some(frame) = frame else {
            return Err(GeometryError::BadExtents {
                extents: smallest.extents.into(),
            });
        };
        let thought = real.moved(|p| frame.rounded(p));
        let cloud = Cloud::new(thought.points());
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        // Floored with a guess first: the longest extent is at least 1 and at most 2.
        let quick_root = cloud.fit(&axes, options.min_extent);
        let longest_thought = quick_root.extents().max();
        Ok(Self {
            root: smallest.floored(options.min_extent * longest),
            thought: Whole::new(thought.simplified(n_triangles)),
            real: Whole::new(real),
            quick_root,
            min_extent: options.min_extent * longest_thought,
            min_slab: options.min_slab * longest_thought,
            min_points,
            frame,
            min_real_extent: options.min_extent * longest,
        })
    }

    /// The whole as a part.
    pub(super) fn whole(&self) -> Part {
        Part {
            thought: self.thought.region.clone(),
            real: self.real.region.clone(),
        }
    }

    /// The whole in the body's own frame.
    pub(super) fn thought(&self) -> &Whole {
        &self.thought
    }

    /// The two parts beside a plane of the body's own frame; either may be empty.
    pub(super) fn cut(&self, part: &Part, plane: &Plane) -> [Part; 2] {
        let [below, above] = part.thought.cut(plane, &self.thought);
        let [real_below, real_above] = part.real.cut(&self.frame.placed(plane), &self.real);
        [(below, real_below), (above, real_above)].map(|(thought, real)| Part { thought, real })
    }

    /// Whether the side above a plane has the lower coordinates where the body lies.
    pub(super) fn points_down(&self, plane: &Plane) -> bool {
        let normal = self.frame.placed(plane).normal;
        normal[normal.iamax()] < 0.0
    }

    /// The smallest box around some regions where they lie; the axes of boxes of the body's own frame are tried too.
    pub(super) fn fit(
        &self,
        regions: &[&Region],
        near: &[&OrientedBox],
    ) -> Result<OrientedBox, GeometryError> {
        let points: Vec<_> = regions.iter().flat_map(|r| r.points()).collect();
        let axes = near.iter().flat_map(|b| [0, 1, 2].map(|k| b.axis(k)));
        let hints: Vec<Vector3<f64>> = axes.map(|axis| self.frame.turned(&axis)).collect();
        Ok(minimum_volume_box_near(&points, &hints)?.floored(self.min_real_extent))
    }

    /// Cubic metres per volume of the body's own frame.
    pub(super) fn real_volume(&self) -> f64 {
        self.frame.size().powi(3)
    }
}
