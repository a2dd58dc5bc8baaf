//! Boxes at any orientation.

use nalgebra::{Matrix3, Point3, Rotation3, Vector3};
use serde::{Deserialize, Serialize};

use crate::{GeometryError, TriMesh};

/// A box at any orientation. Extents are full lengths (m), positive and finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrientedBox {
    center: Point3<f64>,
    axes: Rotation3<f64>,
    extents: Vector3<f64>,
}

impl OrientedBox {
    /// A box from its centre, the rotation whose columns are its axes, and its full lengths along them.
    ///
    /// # Errors
    ///
    /// [`GeometryError::BadExtents`] unless every extent is positive and finite.
    pub fn new(
        center: Point3<f64>,
        axes: Rotation3<f64>,
        extents: Vector3<f64>,
    ) -> Result<Self, GeometryError> {
        if extents.iter().all(|e| e.is_finite() && *e > 0.0) {
            Ok(Self {
                center,
                axes,
                extents,
            })
        } else {
            Err(GeometryError::BadExtents {
                extents: extents.into(),
            })
        }
    }

    /// An axis-aligned box about the origin.
    ///
    /// # Panics
    ///
    /// Where an extent is not positive and finite.
    pub fn centered(extents: [f64; 3]) -> Self {
        Self::new(Point3::origin(), Rotation3::identity(), extents.into())
            .expect("extents are positive and finite")
    }

    /// Centre, in the frame that the box is given in.
    pub fn center(&self) -> Point3<f64> {
        self.center
    }

    /// Rotation whose columns are the box's unit axes: `world_from_box`.
    pub fn axes(&self) -> &Rotation3<f64> {
        &self.axes
    }

    /// One unit axis (0, 1 or 2).
    pub fn axis(&self, axis: usize) -> Vector3<f64> {
        self.axes.matrix().column(axis).into()
    }

    /// Full lengths along the axes.
    pub fn extents(&self) -> Vector3<f64> {
        self.extents
    }

    /// Half lengths along the axes.
    pub fn half_extents(&self) -> Vector3<f64> {
        self.extents / 2.0
    }

    /// Volume, m³.
    pub fn volume(&self) -> f64 {
        self.extents.product()
    }

    /// A point in the box's own frame: origin at the centre, coordinates along the axes.
    pub fn local(&self, point: &Point3<f64>) -> Vector3<f64> {
        self.axes.inverse_transform_vector(&(point - self.center))
    }

    /// Whether the point lies inside or on the box, grown by `margin` on every side.
    pub fn contains(&self, point: &Point3<f64>, margin: f64) -> bool {
        let half = self.half_extents();
        self.local(point)
            .iter()
            .zip(half.iter())
            .all(|(x, h)| x.abs() <= h + margin)
    }

    /// Distance from a point to the box; 0 inside.
    pub fn distance(&self, point: &Point3<f64>) -> f64 {
        (self.local(point).abs() - self.half_extents())
            .sup(&Vector3::zeros())
            .norm()
    }

    /// The eight corners; corner `i` has the sign of bit `k` of `i` along axis `k` (set: positive).
    pub fn corners(&self) -> [Point3<f64>; 8] {
        let half = self.half_extents();
        std::array::from_fn(|i| {
            let sign = Vector3::from_fn(|k, _| if i >> k & 1 == 1 { half[k] } else { -half[k] });
            self.center + self.axes * sign
        })
    }

    /// Triangles of the surface as indices of [`OrientedBox::corners`], outwards: two for each face, −x +x −y +y −z +z.
    pub const TRIANGLES: [[u32; 3]; 12] = [
        [0, 4, 6],
        [0, 6, 2],
        [1, 3, 7],
        [1, 7, 5],
        [0, 1, 5],
        [0, 5, 4],
        [2, 6, 7],
        [2, 7, 3],
        [0, 2, 3],
        [0, 3, 1],
        [4, 5, 7],
        [4, 7, 6],
    ];

    /// The surface, closed and outwards.
    ///
    /// # Panics
    ///
    /// Where a corner lies beyond the largest number.
    pub fn surface(&self) -> TriMesh {
        TriMesh::new(self.corners().to_vec(), Self::TRIANGLES.to_vec()).expect("the corners are finite")
    }

    /// The corner with the least coordinate along every axis.
    pub fn min_corner(&self) -> Point3<f64> {
        self.corners()[0]
    }
}

/// How a box stands in JSON: `axes` are three unit rows, `extents` full lengths.
#[derive(Serialize, Deserialize)]
struct BoxRecord {
    center: [f64; 3],
    axes: [[f64; 3]; 3],
    extents: [f64; 3],
}

impl Serialize for OrientedBox {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let axes = std::array::from_fn(|k| self.axis(k).into());
        BoxRecord {
            center: self.center.coords.into(),
            axes,
            extents: self.extents.into(),
        }
        .serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for OrientedBox {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        use serde::de::Error;
        let record = BoxRecord::deserialize(deserializer)?;
        let matrix = Matrix3::from_columns(&record.axes.map(Vector3::from));
        let error = (matrix.transpose() * matrix - Matrix3::identity()).abs().max();
        if !error.is_finite() || error > 1e-6 || matrix.determinant() < 0.0 {
            return Err(D::Error::custom(format!(
                "`axes` {:?} are not three right-handed orthonormal rows",
                record.axes
            )));
        }
        // Rows written with a few digits are made orthonormal again, so that volumes stay exact.
        let axes = Rotation3::from_matrix_eps(&matrix, 1e-15, 32, Rotation3::from_matrix_unchecked(matrix));
        let axes = if error < 1e-14 {
            Rotation3::from_matrix_unchecked(matrix)
        } else {
            axes
        };
        Self::new(record.center.into(), axes, record.extents.into()).map_err(D::Error::custom)
    }
}
