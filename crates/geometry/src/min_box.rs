//! The smallest box around points, at any orientation.

pub(crate) mod body;
mod canonical;
mod descent;
mod linear_program;
pub(crate) mod search;

use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

use crate::hull::{HULL_TOLERANCE, check_points, hull_within};
use crate::{ConvexHull, GeometryError, OrientedBox};
use canonical::{Candidate, choose, nearest_to_frame};

/// The smallest box around some points. Extents are full lengths, and 0 where the points are flat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MinimumBox {
    /// Centre, in the points' frame.
    pub center: Point3<f64>,
    /// Rotation whose columns are the box's unit axes.
    pub axes: Rotation3<f64>,
    /// Full lengths along the axes; at least 0.
    pub extents: Vector3<f64>,
}

impl MinimumBox {
    /// Volume; 0 for flat points.
    pub fn volume(&self) -> f64 {
        self.extents.product()
    }

    /// The same box with every extent raised to at least `min_extent`, about the same centre.
    ///
    /// # Panics
    ///
    /// Where `min_extent` is not positive and finite.
    pub fn floored(&self, min_extent: f64) -> OrientedBox {
        let extents = self.extents.map(|e| e.max(min_extent));
        OrientedBox::new(self.center, self.axes, extents).expect("the smallest extent is positive and finite")
    }
}

/// The box of least volume around `points`, at any orientation.
///
/// The convex hull is measured by rotating calipers about some 110 directions: normals of its largest facets, and a
/// lattice along its principal axes, and on hulls of up to 24 corners also 240 normals of planes that hold an edge. About a
/// given axis the calipers are exact. The best of these boxes, 12 to 60,
/// are turned downhill, each step minimising the linearised volume exactly, until no small turn helps.
///
/// Which of several equally small boxes is meant depends on the frame of the points:
///
/// - the axes are matched to x, y, z by the assignment with the largest Σ |axis · e|, with axis · e ≥ 0, and are
///   right-handed; they are not sorted by length;
/// - boxes within 5e-7 of the least volume count as equal;
/// - among equal boxes one along x, y and z is taken, or else one with an axis along x, y or z, or else the one that is
///   turned least from the frame: a body of revolution (bottle, glass) stands upright whatever its tessellation.
///
/// So the volume is the same to 1e-6 however the points are turned, scaled, shuffled or moved; and so is the box, where no
/// other one is equal to it. The least volume itself is found by search, not proved: see the tables in
/// `docs/geometry.md`.
///
/// Points in a plane give the rectangle of least area and an extent of 0, collinear points a segment, equal points
/// a point. Every input point lies in the box up to rounding.
///
/// # Errors
///
/// [`GeometryError::Empty`] for no points, [`GeometryError::NotFinite`] for a coordinate that is NaN or infinite,
/// [`GeometryError::BadExtents`] where the points are so far apart that their distance is infinite.
///
/// # Source
///
/// Barequet and Har-Peled (2001) for directions and calipers. Boxes that are smallest about each of their axes need not
/// be smallest: the descent by linear programs, our own, leaves those.
///
/// # Examples
///
/// ```
/// use nalgebra::Point3;
/// use prehend_geometry::minimum_volume_box;
///
/// // Four corners of a unit cube span a regular tetrahedron, whose smallest box is that cube.
/// let corners = [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
/// let smallest = minimum_volume_box(&corners.map(Point3::from))?;
/// assert!((smallest.volume() - 1.0).abs() < 1e-9);
/// # Ok::<(), prehend_geometry::GeometryError>(())
/// ```
pub fn minimum_volume_box(points: &[Point3<f64>]) -> Result<MinimumBox, GeometryError> {
    minimum_volume_box_near(points, &[])
}

/// [`minimum_volume_box`] that also tries the given unit axes, for example those of an enclosing box.
pub(crate) fn minimum_volume_box_near(
    points: &[Point3<f64>],
    hints: &[Vector3<f64>],
) -> Result<MinimumBox, GeometryError> {
    check_points(points)?;
    let hull = hull_within(points, HULL_TOLERANCE);
    let candidates = candidate_axes(&hull, hints);
    let axes = choose(&candidates);
    let smallest = measure(points, &axes, hull.rank());
    if smallest.extents.iter().all(|e| e.is_finite()) {
        Ok(smallest)
    } else {
        Err(GeometryError::BadExtents {
            extents: smallest.extents.into(),
        })
    }
}

/// Orientations worth choosing from, with the volume (area, length) of the hull's box in each.
fn candidate_axes(hull: &ConvexHull, hints: &[Vector3<f64>]) -> Vec<Candidate> {
    let unit = search::to_unit_size(hull);
    match hull.rank() {
        3 => search::solid(&unit, hints),
        2 => search::flat(&unit),
        1 => vec![Candidate {
            axes: least_turned_along(&(unit.points[1] - unit.points[0])),
            size: 1.0,
        }],
        _ => vec![Candidate {
            axes: Matrix3::identity(),
            size: 1.0,
        }],
    }
}

/// Axes of which one lies along a segment, turned least from the frame.
fn least_turned_along(segment: &Vector3<f64>) -> Matrix3<f64> {
    let nearest = segment.iamax();
    let along = if segment[nearest] < 0.0 {
        -segment
    } else {
        *segment
    };
    Rotation3::rotation_between(&Vector3::ith(nearest, 1.0), &along)
        .unwrap_or_else(Rotation3::identity)
        .into_inner()
}

/// The box around all points with these axes; the flat axes of points of lower rank get the extent 0.
fn measure(points: &[Point3<f64>], axes: &Matrix3<f64>, rank: usize) -> MinimumBox {
    let (axes, _) = nearest_to_frame(axes);
    // Coordinates relative to one of the points stay exact far from the origin.
    let base = points[0];
    let mut low = Vector3::zeros();
    let mut high = Vector3::zeros();
    let inverse = axes.transpose();
    for p in points {
        let local = inverse * (p - base);
        low = low.inf(&local);
        high = high.sup(&local);
    }
    let mut extents = high - low;
    let mut by_length = [0, 1, 2];
    by_length.sort_by(|&i, &j| extents[i].total_cmp(&extents[j]));
    for &k in &by_length[..3 - rank] {
        // What is left along a flat axis is rounding.
        extents[k] = 0.0;
    }
    let center = base + axes * ((low + high) / 2.0);
    MinimumBox {
        center,
        axes: Rotation3::from_matrix_unchecked(axes),
        extents,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cuboid(extents: [f64; 3]) -> Vec<Point3<f64>> {
        OrientedBox::centered(extents).corners().to_vec()
    }

    /// Rings of `n_sides` points at (radius, height).
    fn lathe(profile: &[(f64, f64)], n_sides: usize) -> Vec<Point3<f64>> {
        let ring = |&(r, z): &(f64, f64)| {
            (0..n_sides)
                .map(move |i| std::f64::consts::TAU * i as f64 / n_sides as f64)
                .map(move |a| Point3::new(r * a.cos(), r * a.sin(), z))
        };
        profile.iter().flat_map(ring).collect()
    }

    fn turned(points: &[Point3<f64>], angles: [f64; 3]) -> Vec<Point3<f64>> {
        let turn = Rotation3::from_euler_angles(angles[0], angles[1], angles[2]);
        points.iter().map(|p| turn * p).collect()
    }

    #[test]
    fn a_turned_cuboid_gets_its_own_volume_back() {
        for angles in [[0.0, 0.0, 0.0], [0.5, -0.2, 1.3], [2.0, 1.0, 0.1]] {
            let smallest = minimum_volume_box(&turned(&cuboid([0.1, 0.2, 0.7]), angles)).unwrap();
            assert!((smallest.volume() / 0.014 - 1.0).abs() < 1e-9, "{smallest:?}");
        }
    }

    #[test]
    fn axes_follow_the_frame_and_not_the_lengths() {
        let smallest = minimum_volume_box(&cuboid([0.3, 0.1, 0.2])).unwrap();
        assert_eq!(smallest.axes, Rotation3::identity());
        assert!((smallest.extents - Vector3::new(0.3, 0.1, 0.2)).amax() < 1e-15);
        let quarter = turned(&cuboid([0.3, 0.1, 0.2]), [0.0, 0.0, 1.4]);
        let smallest = minimum_volume_box(&quarter).unwrap();
        assert!(
            (smallest.extents - Vector3::new(0.1, 0.3, 0.2)).amax() < 1e-9,
            "{smallest:?}"
        );
        assert!((smallest.axes.angle() - (std::f64::consts::FRAC_PI_2 - 1.4)).abs() < 1e-6);
    }

    #[test]
    fn a_regular_octahedron_needs_no_more_than_the_best_known_box() {
        // 64/27; the box along the frame has 8, the best one on a facet 8/3 (12.5 % more).
        let octahedron: Vec<_> = (0..3)
            .flat_map(|k| [1.0, -1.0].map(|s| Point3::from(Vector3::ith(k, s))))
            .collect();
        let volume = minimum_volume_box(&octahedron).unwrap().volume();
        assert!((volume - 64.0 / 27.0).abs() < 1e-5, "{volume}");
    }

    #[test]
    fn a_bottle_stands_upright_and_is_as_wide_as_deep() {
        let profile = [
            (0.03, 0.0),
            (0.035, 0.01),
            (0.035, 0.15),
            (0.012, 0.2),
            (0.012, 0.25),
        ];
        for n_sides in [12, 24, 48, 64, 96, 250] {
            let smallest = minimum_volume_box(&lathe(&profile, n_sides)).unwrap();
            assert_eq!(smallest.axes.matrix().column(2), Vector3::z());
            assert!((smallest.extents.z - 0.25).abs() < 1e-12);
            assert!(
                (smallest.extents.x / smallest.extents.y - 1.0).abs() < 3e-4,
                "{n_sides}: {smallest:?}"
            );
            assert!((smallest.extents.x / 0.07 - 1.0).abs() < 0.04);
        }
    }

    #[test]
    fn flat_straight_and_single_points_have_zero_extents() {
        let plate = minimum_volume_box(&turned(&cuboid([0.1, 0.2, 1e-300]), [0.4, 0.5, 0.6])).unwrap();
        let mut lengths: [f64; 3] = plate.extents.into();
        lengths.sort_by(f64::total_cmp);
        assert_eq!(lengths[0], 0.0);
        assert!((lengths[1] - 0.1).abs() < 1e-12 && (lengths[2] - 0.2).abs() < 1e-12);
        let segment = minimum_volume_box(&[Point3::origin(), Point3::new(-3.0, 0.0, -4.0)]).unwrap();
        assert!(
            (segment.extents - Vector3::new(0.0, 0.0, 5.0)).amax() < 1e-12,
            "{segment:?}"
        );
        let point = minimum_volume_box(&[Point3::new(1.0, 2.0, 3.0)]).unwrap();
        assert_eq!(
            (point.center, point.extents),
            (Point3::new(1.0, 2.0, 3.0), Vector3::zeros())
        );
        assert_eq!(point.floored(0.001).extents(), Vector3::repeat(0.001));
    }

    #[test]
    fn points_too_far_apart_are_an_error() {
        let points = [[f64::MAX, 0.0, 0.0], [-f64::MAX, 0.0, 0.0], [0.0, 1.0, 0.0]].map(Point3::from);
        assert!(matches!(
            minimum_volume_box(&points),
            Err(GeometryError::BadExtents { .. })
        ));
    }
}
