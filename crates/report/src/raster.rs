//! The rasteriser: a scene and a camera become pixels.
//!
//! Samples lie on a grid finer than the pixels; each keeps the depth, body and normal of what is nearest. Light, lines
//! and translucent bodies are added per sample, and samples are averaged in linear light.

use nalgebra::Vector3;

use crate::ReportError;
use crate::camera::Camera;
use crate::linear_light::{Rgba, to_srgb};
use crate::scene::{Body, Dot, Line, Scene};

/// Pixels: `width * height` rows of red, green, blue, alpha (not multiplied), top row first, sRGB.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Raster {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Four bytes a pixel.
    pub rgba: Vec<u8>,
}

/// How a picture is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawOptions {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Samples along each side of a pixel; 3 looks smooth.
    pub samples: usize,
    /// Dark lines round bodies, at jumps of depth and at creases.
    pub lines: bool,
}

impl DrawOptions {
    /// A square picture with 3 × 3 samples and lines.
    pub fn square(size: usize) -> Self {
        Self {
            width: size,
            height: size,
            samples: 3,
            lines: true,
        }
    }
}

/// Draws the scene on a transparent ground. The same scene gives the same bytes.
///
/// # Errors
///
/// [`ReportError::PictureSize`] where a side is 0 or more than 8192 pixels.
pub fn draw(scene: &Scene, camera: &Camera, options: &DrawOptions) -> Result<Raster, ReportError> {
    let DrawOptions {
        width,
        height,
        samples,
        lines,
    } = *options;
    if !(1..=8192).contains(&width) || !(1..=8192).contains(&height) {
        return Err(ReportError::PictureSize { width, height });
    }
    let samples = samples.clamp(1, 8);
    let mut canvas = Canvas::new(width * samples, height * samples, samples, camera);
    for (b, body) in scene
        .bodies
        .iter()
        .enumerate()
        .filter(|(_, body)| body.opacity >= 1.0)
    {
        canvas.fill_depth(body, b as u32);
    }
    canvas.light(&scene.bodies);
    if lines {
        for body in scene.bodies.iter().filter(|body| body.opacity >= 1.0) {
            for [a, b] in &body.mesh.creases {
                let ends = [body.pose * a, body.pose * b];
                canvas.line(&Line {
                    ends,
                    color: OUTLINE,
                    width: 0.7,
                    opacity: 0.4,
                    hidden_opacity: 0.0,
                });
            }
        }
        canvas.outline();
    }
    canvas.translucent(&scene.bodies);
    for line in &scene.lines {
        canvas.line(line);
    }
    canvas.dots(&scene.dots);
    Ok(canvas.resolve(width, height))
}

const NOTHING: u32 = u32::MAX;
const OUTLINE: [u8; 3] = [0x1f, 0x24, 0x2b];

/// A triangle's corner on the sample grid: x and y in samples, z in metres towards the viewer.
type Corner = Vector3<f64>;

struct Canvas<'a> {
    width: usize,
    height: usize,
    samples: usize,
    /// Samples to a unit of width: pixels in small pictures, growing with the picture beyond 200 pixels.
    unit: f64,
    camera: &'a Camera,
    /// Samples a metre.
    scale: f64,
    depth: Vec<f32>,
    body: Vec<u32>,
    normal: Vec<[f32; 3]>,
    color: Vec<Rgba>,
}

impl<'a> Canvas<'a> {
    fn new(width: usize, height: usize, samples: usize, camera: &'a Camera) -> Self {
        let n = width * height;
        Self {
            width,
            height,
            samples,
            unit: samples as f64 * (width.min(height) as f64 / samples as f64 / 200.0).max(1.0),
            camera,
            scale: width.min(height) as f64 / 2.0 / camera.half_size,
            depth: vec![f32::NEG_INFINITY; n],
            body: vec![NOTHING; n],
            normal: vec![[0.0; 3]; n],
            color: vec![Rgba::CLEAR; n],
        }
    }

    fn place(&self, point: &nalgebra::Point3<f64>) -> Corner {
        let seen = self.camera.seen(point);
        Vector3::new(
            self.width as f64 / 2.0 + seen.x * self.scale,
            self.height as f64 / 2.0 - seen.y * self.scale,
            seen.z,
        )
    }

    /// Calls `visit` with the index, depth and barycentric coordinates of every sample inside the triangle.
    fn cover(&self, [a, b, c]: [Corner; 3], mut visit: impl FnMut(usize, f64, [f64; 3])) {
        let area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        if !area.is_finite() || area.abs() < 1e-9 {
            return;
        }
        let first = |low: f64| (low - 0.5).ceil().max(0.0) as usize;
        let last = |high: f64, size: usize| (high - 0.5).floor().min(size as f64 - 1.0);
        let (x0, y0) = (first(a.x.min(b.x).min(c.x)), first(a.y.min(b.y).min(c.y)));
        let x1 = last(a.x.max(b.x).max(c.x), self.width);
        let y1 = last(a.y.max(b.y).max(c.y), self.height);
        // Most triangles of a fine mesh lie between samples.
        if x1 < x0 as f64 || y1 < y0 as f64 {
            return;
        }
        // Barycentric coordinates are linear in x and y.
        let edge = |p: Corner, q: Corner| {
            [
                (p.y - q.y) / area,
                (q.x - p.x) / area,
                (p.x * q.y - p.y * q.x) / area,
            ]
        };
        let edges = [edge(b, c), edge(c, a), edge(a, b)];
        for y in y0..=y1 as usize {
            let py = y as f64 + 0.5;
            let at_row = edges.map(|[_, ey, e]| ey * py + e);
            // Where each coordinate turns negative, and a sample more.
            let (mut from, mut to) = (x0 as f64, x1);
            for ([ex, _, _], at_row) in edges.iter().zip(at_row) {
                if *ex > 0.0 {
                    from = from.max(-at_row / ex - 1.5);
                } else if *ex < 0.0 {
                    to = to.min(-at_row / ex + 0.5);
                }
            }
            if to < from {
                continue;
            }
            for x in from as usize..=to as usize {
                let px = x as f64 + 0.5;
                let w: [f64; 3] = std::array::from_fn(|k| edges[k][0] * px + at_row[k]);
                if w[0] >= 0.0 && w[1] >= 0.0 && w[2] >= 0.0 {
                    visit(y * self.width + x, w[0] * a.z + w[1] * b.z + w[2] * c.z, w);
                }
            }
        }
    }

    fn fill_depth(&mut self, body: &Body, id: u32) {
        let corners: Vec<Corner> = body
            .mesh
            .vertices
            .iter()
            .map(|p| self.place(&(body.pose * p)))
            .collect();
        let camera_from_body = self.camera.camera_from_world * body.pose.rotation.to_rotation_matrix();
        let (mut depth, mut owner, mut normal) = (
            std::mem::take(&mut self.depth),
            std::mem::take(&mut self.body),
            std::mem::take(&mut self.normal),
        );
        for (triangle, normals) in body.mesh.triangles.iter().zip(&body.mesh.normals) {
            let mut turned = None;
            self.cover(triangle.map(|v| corners[v as usize]), |i, z, w| {
                if z as f32 > depth[i] {
                    let normals = turned.get_or_insert_with(|| normals.map(|n| camera_from_body * n));
                    let n = normals[0] * w[0] + normals[1] * w[1] + normals[2] * w[2];
                    depth[i] = z as f32;
                    owner[i] = id;
                    normal[i] = [n.x as f32, n.y as f32, n.z as f32];
                }
            });
        }
        (self.depth, self.body, self.normal) = (depth, owner, normal);
    }

    /// Lights every sample: a little from the sky, a little from the eye, most from the upper left.
    fn light(&mut self, bodies: &[Body]) {
        let colors: Vec<Rgba> = bodies.iter().map(|b| Rgba::opaque(b.color)).collect();
        let light = Light::new(self.camera);
        for i in 0..self.color.len() {
            if self.body[i] != NOTHING {
                self.color[i] = colors[self.body[i] as usize].times(light.on(self.normal[i]));
            }
        }
    }

    /// Darkens samples at the rim of each body and where depth jumps by more than 2 % of the picture.
    fn outline(&mut self) {
        let jump = (0.04 * self.camera.half_size) as f32;
        let (w, h) = (self.width, self.height);
        let nearer_than = |i: usize, j: usize| {
            let (a, b) = (self.body[i], self.body[j]);
            a != NOTHING
                && ((a != b && (b == NOTHING || self.depth[i] >= self.depth[j]))
                    || (a == b && self.depth[i] - self.depth[j] > jump))
        };
        let mut rim = Vec::new();
        for y in 0..h {
            for x in 0..w {
                let i = y * w + x;
                let at_rim = (x + 1 < w && nearer_than(i, i + 1))
                    || (x > 0 && nearer_than(i, i - 1))
                    || (y + 1 < h && nearer_than(i, i + w))
                    || (y > 0 && nearer_than(i, i - w));
                if at_rim {
                    rim.push((x, y));
                }
            }
        }
        let reach = (self.unit / 2.0).floor() as isize;
        let mut dark = vec![false; w * h];
        for (x, y) in rim {
            for (dx, dy) in (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dx, dy))) {
                let (x, y) = (x as isize + dx, y as isize + dy);
                if dx * dx + dy * dy <= reach * reach
                    && (0..w as isize).contains(&x)
                    && (0..h as isize).contains(&y)
                {
                    dark[y as usize * w + x as usize] = true;
                }
            }
        }
        let ink = Rgba::opaque(OUTLINE);
        for (color, _) in self.color.iter_mut().zip(&dark).filter(|(_, dark)| **dark) {
            *color = color.under(ink, 0.8);
        }
    }

    /// Blends translucent bodies over what lies behind them, farthest triangle first.
    fn translucent(&mut self, bodies: &[Body]) {
        let light = Light::new(self.camera);
        let mut triangles: Vec<(f64, usize, [Corner; 3], [f32; 3])> = Vec::new();
        for (b, body) in bodies.iter().enumerate().filter(|(_, body)| body.opacity < 1.0) {
            let corners: Vec<Corner> = body
                .mesh
                .vertices
                .iter()
                .map(|p| self.place(&(body.pose * p)))
                .collect();
            let camera_from_body = self.camera.camera_from_world * body.pose.rotation.to_rotation_matrix();
            for (triangle, normals) in body.mesh.triangles.iter().zip(&body.mesh.normals) {
                let corners = triangle.map(|v| corners[v as usize]);
                let normal = camera_from_body * normals[0];
                let middle = corners.iter().map(|c| c.z).sum::<f64>() / 3.0;
                triangles.push((
                    middle,
                    b,
                    corners,
                    [normal.x as f32, normal.y as f32, normal.z as f32],
                ));
            }
        }
        triangles.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut color = std::mem::take(&mut self.color);
        for (_, b, corners, normal) in triangles {
            let over = Rgba::opaque(bodies[b].color).times(light.on(normal));
            let opacity = bodies[b].opacity as f32;
            self.cover(corners, |i, z, _| {
                if z as f32 > self.depth[i] {
                    color[i] = color[i].under(over, opacity);
                }
            });
        }
        self.color = color;
    }

    fn line(&mut self, line: &Line) {
        let [a, b] = line.ends.map(|p| self.place(&p));
        let radius = (line.width * self.unit / 2.0).max(0.5);
        let along = (b - a).xy();
        let length2 = along.norm_squared();
        let bias = 0.006 * self.camera.half_size;
        let color = Rgba::opaque(line.color);
        let Some([x0, y0, x1, y1]) =
            self.window([a.x.min(b.x), a.y.min(b.y), a.x.max(b.x), a.y.max(b.y)], radius)
        else {
            return;
        };
        for y in y0..=y1 {
            for x in x0..=x1 {
                let from_a = nalgebra::Vector2::new(x as f64 + 0.5, y as f64 + 0.5) - a.xy();
                let t = if length2 > 0.0 {
                    (from_a.dot(&along) / length2).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                if (from_a - along * t).norm_squared() <= radius * radius {
                    let i = y * self.width + x;
                    let seen = (a.z + (b.z - a.z) * t + bias) as f32 >= self.depth[i];
                    let opacity = if seen { line.opacity } else { line.hidden_opacity };
                    self.color[i] = self.color[i].under(color, opacity as f32);
                }
            }
        }
    }

    /// Discs with a light rim over everything; fainter where something stands before them.
    fn dots(&mut self, dots: &[Dot]) {
        let mut placed: Vec<(bool, Corner, &Dot)> = dots
            .iter()
            .map(|dot| {
                let at = self.place(&dot.center);
                let inside =
                    at.x >= 0.0 && at.y >= 0.0 && at.x < self.width as f64 && at.y < self.height as f64;
                let before = inside.then(|| self.depth[at.y as usize * self.width + at.x as usize]);
                let seen = before.is_none_or(|z| (at.z + 0.03 * self.camera.half_size) as f32 >= z);
                (seen, at, dot)
            })
            .collect();
        placed.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.z.total_cmp(&b.1.z)));
        for (seen, at, dot) in placed {
            let radius = dot.radius * self.unit;
            let rim = radius + self.unit;
            let (fill, light) = (Rgba::opaque(dot.color), Rgba::opaque([255, 255, 255]));
            let Some([x0, y0, x1, y1]) = self.window([at.x, at.y, at.x, at.y], rim) else {
                continue;
            };
            for y in y0..=y1 {
                for x in x0..=x1 {
                    let distance = (x as f64 + 0.5 - at.x).hypot(y as f64 + 0.5 - at.y);
                    let i = y * self.width + x;
                    let opacity = if seen { 1.0 } else { 0.5 };
                    if distance <= radius {
                        self.color[i] = self.color[i].under(fill, opacity);
                    } else if distance <= rim {
                        self.color[i] = self.color[i].under(light, opacity * 0.9);
                    }
                }
            }
        }
    }

    /// The samples of a rectangle grown by `radius`; `None` where it misses the picture.
    fn window(&self, [x0, y0, x1, y1]: [f64; 4], radius: f64) -> Option<[usize; 4]> {
        let (w, h) = (self.width as f64, self.height as f64);
        let (low_x, low_y) = ((x0 - radius).floor().max(0.0), (y0 - radius).floor().max(0.0));
        let (high_x, high_y) = (
            (x1 + radius).ceil().min(w - 1.0),
            (y1 + radius).ceil().min(h - 1.0),
        );
        (low_x <= high_x && low_y <= high_y).then_some([low_x, low_y, high_x, high_y].map(|v| v as usize))
    }

    fn resolve(&self, width: usize, height: usize) -> Raster {
        let n = self.samples;
        let mut rgba = Vec::with_capacity(width * height * 4);
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let sum = (0..n * n).fold(Rgba::CLEAR, |sum, s| {
                sum.plus(self.color[(y * n + s / n) * self.width + x * n + s % n])
            });
            rgba.extend(to_srgb(sum, (n * n) as f32));
        }
        Raster { width, height, rgba }
    }
}

/// Three lights that go with the camera.
struct Light {
    sky: [f32; 3],
    key: [f32; 3],
}

impl Light {
    fn new(camera: &Camera) -> Self {
        let sky = camera.camera_from_world * Vector3::z();
        let key = Vector3::new(-0.45, 0.62, 0.65).normalize();
        let single = |v: Vector3<f64>| [v.x as f32, v.y as f32, v.z as f32];
        Self {
            sky: single(sky),
            key: single(key),
        }
    }

    /// How bright a surface with this normal is; the normal is turned to the viewer first.
    fn on(&self, normal: [f32; 3]) -> f32 {
        let [x, y, z] = normal;
        let length = (x * x + y * y + z * z).sqrt().max(1e-9);
        let turn = if z < 0.0 { -1.0 / length } else { 1.0 / length };
        let n = [x * turn, y * turn, z * turn];
        let dot = |a: [f32; 3]| a[0] * n[0] + a[1] * n[1] + a[2] * n[2];
        0.30 * (0.5 + 0.5 * dot(self.sky)) + 0.24 * n[2] + 0.52 * dot(self.key).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::{Isometry3, Point3, Rotation3};
    use prehend_geometry::Solid;

    use super::*;
    use crate::display_mesh::DisplayMesh;

    #[test]
    fn the_depth_of_a_ball_is_that_of_the_closed_form() {
        let ball = Arc::new(DisplayMesh::new(&Solid::Sphere { radius: 1.0 }.display_mesh()));
        let camera = Camera {
            camera_from_world: Rotation3::identity(),
            center: Point3::origin(),
            half_size: 1.25,
        };
        let mut canvas = Canvas::new(200, 200, 1, &camera);
        let body = Body {
            mesh: ball,
            pose: Isometry3::identity(),
            color: [255; 3],
            opacity: 1.0,
        };
        canvas.fill_depth(&body, 7);
        let (mut worst, mut seen) = (0.0_f64, 0);
        for (i, &z) in canvas.depth.iter().enumerate() {
            let at = |k: usize| (k as f64 + 0.5 - 100.0) / 80.0;
            let r2 = at(i % 200).powi(2) + at(i / 200).powi(2);
            assert_eq!(canvas.body[i] == 7, z.is_finite());
            if r2 < 0.8 {
                worst = worst.max((f64::from(z) - (1.0 - r2).sqrt()).abs());
                seen += 1;
            }
        }
        // The ball is an inscribed polyhedron; its flat faces lie up to a few percent inside.
        assert!(
            seen > 15_000 && worst < 0.05,
            "{seen} samples, off by up to {worst}"
        );
    }

    #[test]
    fn edge_on_triangles_and_far_away_ones_cover_nothing() {
        let camera = Camera {
            camera_from_world: Rotation3::identity(),
            center: Point3::origin(),
            half_size: 1.0,
        };
        let canvas = Canvas::new(10, 10, 1, &camera);
        let p = |x: f64, y: f64| Corner::new(x, y, 0.0);
        for corners in [
            [p(1.0, 1.0), p(5.0, 5.0), p(9.0, 9.0)],
            [p(1.0, 1.0), p(1.0, 1.0), p(1.0, 1.0)],
            [p(1e12, 1e12), p(2e12, 1e12), p(1e12, 2e12)],
            [p(-50.0, -50.0), p(-40.0, -50.0), p(-50.0, -40.0)],
            [p(f64::NAN, 0.0), p(4.0, 0.0), p(0.0, 4.0)],
        ] {
            canvas.cover(corners, |i, _, _| panic!("sample {i} is covered by {corners:?}"));
        }
    }
}
