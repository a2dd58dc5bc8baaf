//! What is drawn: bodies, lines, dots, in metres.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Vector3};
use prehend_geometry::OrientedBox;

use crate::display_mesh::DisplayMesh;

/// Things to draw, all in one frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scene {
    /// Surfaces. Each gets an outline of its own.
    pub bodies: Vec<Body>,
    /// Straight lines.
    pub lines: Vec<Line>,
    /// Dots of a fixed size on the picture.
    pub dots: Vec<Dot>,
}

/// A surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Its shape.
    pub mesh: Arc<DisplayMesh>,
    /// `scene_from_mesh`.
    pub pose: Isometry3<f64>,
    /// sRGB.
    pub color: [u8; 3],
    /// 1 is opaque; less is blended over what lies behind.
    pub opacity: f64,
}

/// A straight line.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Its ends.
    pub ends: [Point3<f64>; 2],
    /// sRGB.
    pub color: [u8; 3],
    /// Pixels, in pictures of at most 200 pixels; it grows with larger ones.
    pub width: f64,
    /// Opacity where nothing stands before it.
    pub opacity: f64,
    /// Opacity behind other things.
    pub hidden_opacity: f64,
}

/// A disc with a light rim.
#[derive(Debug, Clone, PartialEq)]
pub struct Dot {
    /// Where.
    pub center: Point3<f64>,
    /// Pixels without the rim, in pictures of at most 200 pixels; it grows with larger ones.
    pub radius: f64,
    /// sRGB.
    pub color: [u8; 3],
}

impl Scene {
    /// Adds an opaque body.
    pub fn add(&mut self, mesh: &Arc<DisplayMesh>, pose: Isometry3<f64>, color: [u8; 3]) {
        self.bodies.push(Body {
            mesh: Arc::clone(mesh),
            pose,
            color,
            opacity: 1.0,
        });
    }

    /// Adds a box as twelve lines and translucent faces.
    pub fn add_box(&mut self, solid: &OrientedBox, color: [u8; 3]) {
        let corners = solid.corners();
        for a in 0..8_usize {
            for k in 0..3 {
                let b = a | 1 << k;
                if a != b {
                    let ends = [corners[a], corners[b]];
                    self.lines.push(Line {
                        ends,
                        color,
                        width: 1.4,
                        opacity: 0.95,
                        hidden_opacity: 0.28,
                    });
                }
            }
        }
        self.bodies.push(Body {
            mesh: Arc::new(DisplayMesh::new(&solid.surface())),
            pose: Isometry3::identity(),
            color,
            opacity: 0.10,
        });
    }

    /// Adds an arrow from `from` along `along`, whose length is the arrow's.
    pub fn add_arrow(&mut self, from: Point3<f64>, along: Vector3<f64>, color: [u8; 3]) {
        let tip = from + along;
        let Some(side) = along
            .cross(&Vector3::z())
            .try_normalize(1e-9)
            .or_else(|| along.cross(&Vector3::x()).try_normalize(1e-9))
        else {
            return;
        };
        let other = along.cross(&side).normalize();
        let mut line = |a, b| {
            self.lines.push(Line {
                ends: [a, b],
                color,
                width: 2.6,
                opacity: 1.0,
                hidden_opacity: 0.45,
            });
        };
        line(from, tip);
        for barb in [side, -side, other, -other] {
            line(tip, tip - along * 0.16 + barb * (0.08 * along.norm()));
        }
    }

    /// Adds a circle about `center` in the plane across `normal`.
    pub fn add_circle(&mut self, center: Point3<f64>, normal: Vector3<f64>, radius: f64, color: [u8; 3]) {
        let Some(n) = normal.try_normalize(1e-9) else {
            return;
        };
        let helper = if n.x.abs() < 0.9 {
            Vector3::x()
        } else {
            Vector3::y()
        };
        let u = n.cross(&helper).normalize() * radius;
        let v = n.cross(&u);
        let at = |i: u32| {
            let (sin, cos) = (f64::from(i) / 48.0 * std::f64::consts::TAU).sin_cos();
            center + u * cos + v * sin
        };
        for i in 0..48 {
            self.lines.push(Line {
                ends: [at(i), at(i + 1)],
                color,
                width: 2.4,
                opacity: 1.0,
                hidden_opacity: 0.45,
            });
        }
    }

    /// Every point that a picture must hold.
    pub fn points(&self) -> impl Iterator<Item = Point3<f64>> + '_ {
        let of_bodies = self
            .bodies
            .iter()
            .flat_map(|b| b.mesh.vertices.iter().map(|p| b.pose * p));
        of_bodies
            .chain(self.lines.iter().flat_map(|l| l.ends))
            .chain(self.dots.iter().map(|d| d.center))
    }
}
