//! Sections carried along a path.

use super::shell::{Ring, Shell};
use nalgebra::{Point3, Vector3};
use std::f64::consts::PI;

/// Where a section stands: `side` and `up` span its plane, the surface travels along `side` × `up`.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// Middle of the section.
    pub origin: Point3<f64>,
    /// First axis of the section.
    pub side: Vector3<f64>,
    /// Second axis of the section.
    pub up: Vector3<f64>,
}

impl Frame {
    /// The point `a` along side and `b` along up.
    pub fn at(&self, [a, b]: [f64; 2]) -> Point3<f64> {
        self.origin + a * self.side + b * self.up
    }

    /// A frame at height `z` that travels up, with side along x and up along y.
    pub fn upwards(x: f64, y: f64, z: f64) -> Self {
        Self {
            origin: Point3::new(x, y, z),
            side: Vector3::x(),
            up: Vector3::y(),
        }
    }
}

/// Adds the ring of `section` placed in `frame`.
pub fn place(shell: &mut Shell, frame: &Frame, section: impl IntoIterator<Item = [f64; 2]>) -> Ring {
    shell.ring(section.into_iter().map(|point| frame.at(point)))
}

/// `n` even angles from −π.
pub fn around(n: usize) -> Vec<f64> {
    (0..n).map(|k| -PI + 2.0 * PI * k as f64 / n as f64).collect()
}

/// Angles that belong to the vertices of a hole's edge: from corner to corner, `m` steps along the first row, `n`
/// along the columns.
pub fn around_hole(m: usize, n: usize) -> Vec<f64> {
    let mut angles = Vec::with_capacity(2 * (m + n));
    for (quarter, steps) in [m, n, m, n].into_iter().enumerate() {
        let corner = PI * (-0.75 + 0.5 * quarter as f64);
        angles.extend((0..steps).map(|k| corner + 0.5 * PI * k as f64 / steps as f64));
    }
    angles
}

/// Point of a superellipse with half axes `a` and `b`: an ellipse at `power` 2, nearly a rectangle at 6.
pub fn superellipse(angle: f64, a: f64, b: f64, power: f64) -> [f64; 2] {
    let (sin, cos) = angle.sin_cos();
    let radius = (cos.abs().powf(power) + sin.abs().powf(power)).powf(-1.0 / power);
    [a * radius * cos, b * radius * sin]
}

/// Frames along a path in the x–z plane, with side along y.
pub fn frames_in_xz(path: &[[f64; 2]]) -> Vec<Frame> {
    (0..path.len())
        .map(|i| {
            let (before, after) = (path[i.saturating_sub(1)], path[(i + 1).min(path.len() - 1)]);
            let travel = Vector3::new(after[0] - before[0], 0.0, after[1] - before[1]).normalize();
            Frame {
                origin: Point3::new(path[i][0], 0.0, path[i][1]),
                side: Vector3::y(),
                up: travel.cross(&Vector3::y()),
            }
        })
        .collect()
}
