//! From where an object is looked at.

use nalgebra::{Rotation3, UnitVector3, Vector3};

/// A direction of view along the object's axes: +x is its front, +z its top.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum View {
    /// From +x: the face that the object turns to us.
    Front,
    /// From −x.
    Back,
    /// From +y: the left hand of someone who stands in the object and looks to its front.
    Left,
    /// From −y.
    Right,
    /// From +z, front down.
    Top,
    /// From −z, front up.
    Bottom,
    /// From between front, right and top: the view for a single picture.
    Oblique,
}

impl View {
    /// The six views along the axes.
    pub const SIX: [View; 6] = [
        View::Front,
        View::Back,
        View::Left,
        View::Right,
        View::Top,
        View::Bottom,
    ];

    /// Its name with the axis that points to the viewer.
    pub fn title(self) -> &'static str {
        match self {
            View::Front => "front +x",
            View::Back => "back −x",
            View::Left => "left +y",
            View::Right => "right −y",
            View::Top => "top +z",
            View::Bottom => "below −z",
            View::Oblique => "oblique",
        }
    }

    /// The rotation `camera_from_world`: camera x to the right, y up, z towards the viewer.
    pub fn camera_from_world(self) -> Rotation3<f64> {
        let (towards, up) = match self {
            View::Front => (Vector3::x(), Vector3::z()),
            View::Back => (-Vector3::x(), Vector3::z()),
            View::Left => (Vector3::y(), Vector3::z()),
            View::Right => (-Vector3::y(), Vector3::z()),
            View::Top => (Vector3::z(), -Vector3::x()),
            View::Bottom => (-Vector3::z(), Vector3::x()),
            View::Oblique => return looking_from(35.0, -40.0),
        };
        axes(&UnitVector3::new_unchecked(towards), &up)
    }
}

/// `camera_from_world` for a viewer at an elevation above the horizon and an azimuth from +x towards +y, degrees. The
/// world's z points up in the picture, or away from the viewer's feet straight above and below.
pub fn looking_from(elevation_deg: f64, azimuth_deg: f64) -> Rotation3<f64> {
    let (sin_e, cos_e) = elevation_deg.to_radians().sin_cos();
    let (sin_a, cos_a) = azimuth_deg.to_radians().sin_cos();
    let towards = UnitVector3::new_normalize(Vector3::new(cos_e * cos_a, cos_e * sin_a, sin_e));
    let up = Vector3::new(-sin_e * cos_a, -sin_e * sin_a, cos_e);
    axes(&towards, &up)
}

fn axes(towards: &UnitVector3<f64>, up: &Vector3<f64>) -> Rotation3<f64> {
    let right = up.cross(towards).normalize();
    let up = towards.cross(&right);
    Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_rows(&[
        right.transpose(),
        up.transpose(),
        towards.transpose(),
    ]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_six_views_are_rotations_that_bring_their_axis_to_the_viewer() {
        let towards = [
            Vector3::x(),
            -Vector3::x(),
            Vector3::y(),
            -Vector3::y(),
            Vector3::z(),
            -Vector3::z(),
        ];
        for (view, axis) in View::SIX.iter().zip(towards) {
            let rotation = view.camera_from_world();
            assert!((rotation * axis - Vector3::z()).norm() < 1e-12, "{view:?}");
            assert!((rotation.matrix().determinant() - 1.0).abs() < 1e-12, "{view:?}");
        }
    }

    #[test]
    fn a_viewer_in_front_sees_the_left_side_on_the_right_and_the_top_on_top() {
        let rotation = View::Front.camera_from_world();
        assert!((rotation * Vector3::y() - Vector3::x()).norm() < 1e-12);
        assert!((rotation * Vector3::z() - Vector3::y()).norm() < 1e-12);
    }

    #[test]
    fn looking_from_straight_above_is_still_a_rotation() {
        let rotation = looking_from(90.0, 0.0);
        assert!((rotation * Vector3::z() - Vector3::z()).norm() < 1e-12);
        assert!((rotation.matrix().determinant() - 1.0).abs() < 1e-12);
    }
}
