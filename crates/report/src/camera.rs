//! An orthographic camera.

use nalgebra::{Point3, Rotation3, Vector3};

use crate::scene::Scene;

/// Where an orthographic picture is taken from. Sizes in it can be compared: no perspective.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Camera x to the right, y up, z towards the viewer.
    pub camera_from_world: Rotation3<f64>,
    /// The world's point in the middle of the picture.
    pub center: Point3<f64>,
    /// Metres from the middle of the picture to the middle of its nearer edges.
    pub half_size: f64,
}

impl Camera {
    /// The camera that shows the whole scene in a picture of `width` × `height` pixels, with a margin of 4 %.
    pub fn fitting(scene: &Scene, camera_from_world: Rotation3<f64>, width: usize, height: usize) -> Self {
        let mut low = Vector3::repeat(f64::INFINITY);
        let mut high = Vector3::repeat(f64::NEG_INFINITY);
        for p in scene.points() {
            let seen = camera_from_world * p.coords;
            low = low.inf(&seen);
            high = high.sup(&seen);
        }
        if low.x > high.x {
            (low, high) = (Vector3::zeros(), Vector3::zeros());
        }
        let shorter = width.min(height).max(1) as f64;
        let half = (high - low) / 2.0;
        let half_size =
            (half.x * shorter / width.max(1) as f64).max(half.y * shorter / height.max(1) as f64) * 1.04;
        let half_size = if half_size.is_finite() && half_size > 0.0 {
            half_size
        } else {
            1.0
        };
        let center = Point3::from(camera_from_world.inverse() * ((low + high) / 2.0));
        Self {
            camera_from_world,
            center,
            half_size,
        }
    }

    /// Camera coordinates of a world point, in metres from the middle of the picture.
    pub(crate) fn seen(&self, point: &Point3<f64>) -> Vector3<f64> {
        self.camera_from_world * (point - self.center)
    }
}
