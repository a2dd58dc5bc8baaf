//! One picture of a density on the sphere: a half seen orthographically, or an equal-area disc.

use nalgebra::Vector3;

use crate::icosphere::Icosphere;
use crate::linear_light::{Rgba, to_srgb};
use crate::palette::viridis;
use crate::raster::Raster;
use crate::view::View;

/// One picture of a sphere.
#[derive(Clone, Copy)]
pub(crate) enum Panel {
    /// The half that a view sees, orthographically; the sphere fills the picture.
    View(View),
    /// The half about a view's axis as Lambert's azimuthal equal-area disc, oriented like the view.
    Disc(View),
}

/// What each sample of a picture looks at: three directions of the grid and their weights; nothing beside the sphere.
pub(crate) type Pixels = Vec<Option<[(usize, f64); 3]>>;

/// Samples along each side of a pixel.
const SAMPLES: usize = 2;

impl Panel {
    pub(crate) fn pixels(self, grid: &Icosphere, size: usize) -> Pixels {
        let n = SAMPLES * size;
        let at = |i: usize| 2.0 * (i as f64 + 0.5) / n as f64 - 1.0;
        let (Panel::View(view) | Panel::Disc(view)) = self;
        let world_from_camera = view.camera_from_world().inverse();
        (0..n * n)
            .map(|i| {
                let (x, y) = (at(i % n), -at(i / n));
                let r2 = x * x + y * y;
                let seen = match self {
                    Panel::View(_) => Vector3::new(x, y, (1.0 - r2).max(0.0).sqrt()),
                    // r = √2 sin(θ/2), so that r = 1 at the equator and cos θ = 1 − r².
                    Panel::Disc(_) => Vector3::new(
                        x * (2.0 - r2).max(0.0).sqrt(),
                        y * (2.0 - r2).max(0.0).sqrt(),
                        1.0 - r2,
                    ),
                };
                (r2 <= 1.0).then(|| grid.locate(&(world_from_camera * seen)))
            })
            .collect()
    }

    /// Draws base-2 logarithms of density over uniform, with lines at two levels and, on discs, marks.
    pub(crate) fn draw(
        self,
        log: &[f64],
        levels: [f64; 2],
        marks: &[Vector3<f64>],
        pixels: &Pixels,
    ) -> Raster {
        let mut raster = paint(levels, log, pixels);
        if let Panel::Disc(view) = self {
            dots(&mut raster, view, marks);
        }
        raster
    }
}

/// Marks on the disc about a view's axis, those of its half.
fn dots(raster: &mut Raster, view: View, marks: &[Vector3<f64>]) {
    let size = raster.width as f64;
    for mark in marks {
        let Some(unit) = mark.try_normalize(1e-9) else {
            continue;
        };
        let seen = view.camera_from_world() * unit;
        if seen.z >= 0.0 {
            let shrink = (1.0 + seen.z).sqrt();
            let at = |v: f64| size / 2.0 * (1.0 + v / shrink);
            dot(raster, at(seen.x), size - at(seen.y));
        }
    }
}

fn dot(raster: &mut Raster, x: f64, y: f64) {
    let radius = raster.width as f64 / 90.0;
    let (low_x, low_y) = (
        (x - radius).floor().max(0.0) as usize,
        (y - radius).floor().max(0.0) as usize,
    );
    for py in low_y..((y + radius).ceil().max(0.0) as usize).min(raster.height) {
        for px in low_x..((x + radius).ceil().max(0.0) as usize).min(raster.width) {
            if (px as f64 + 0.5 - x).hypot(py as f64 + 0.5 - y) <= radius {
                let at = 4 * (py * raster.width + px);
                raster.rgba[at..at + 4].copy_from_slice(&[255, 255, 255, 255]);
            }
        }
    }
}

/// Colours each sample by the base-2 logarithm of its density, ¼ to 16, with a line where it crosses a level; clear
/// beside the sphere.
fn paint(levels: [f64; 2], log: &[f64], pixels: &Pixels) -> Raster {
    let n = pixels.len().isqrt();
    let size = n / SAMPLES;
    let value = |at: &[(usize, f64); 3]| at.iter().map(|(v, weight)| weight * log[*v]).sum();
    let values: Vec<Option<f64>> = pixels.iter().map(|p| p.as_ref().map(value)).collect();
    let crosses = |i: usize, j: usize, level: f64| match (values[i], values[j]) {
        (Some(a), Some(b)) => (a >= level) != (b >= level),
        _ => false,
    };
    let sample = |x: usize, y: usize| -> Rgba {
        let i = y * n + x;
        let Some(v) = values[i] else { return Rgba::CLEAR };
        let color = Rgba::opaque(viridis((v + 2.0) / 6.0));
        let on_line = |level: f64, wide: bool| {
            (x + 1 < n && crosses(i, i + 1, level))
                || (y + 1 < n && crosses(i, i + n, level))
                || (wide && ((x > 0 && crosses(i, i - 1, level)) || (y > 0 && crosses(i, i - n, level))))
        };
        // Dark lines on light ground and light ones on dark ground.
        let ink = Rgba::opaque(if v > 1.0 {
            [0x10, 0x14, 0x1c]
        } else {
            [0xff, 0xff, 0xff]
        });
        if on_line(levels[0], true) {
            color.under(ink, 0.9)
        } else if on_line(levels[1], false) {
            color.under(ink, 0.75)
        } else {
            color
        }
    };
    let mut rgba = Vec::with_capacity(size * size * 4);
    for (y, x) in (0..size).flat_map(|y| (0..size).map(move |x| (y, x))) {
        let sum = (0..4).fold(Rgba::CLEAR, |sum, s| {
            sum.plus(sample(2 * x + s % 2, 2 * y + s / 2))
        });
        rgba.extend(to_srgb(sum, 4.0));
    }
    Raster {
        width: size,
        height: size,
        rgba,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn discs_keep_areas() {
        // A cap of 60° about +z holds a quarter of the sphere, half of the upper disc: r² = 1 − cos θ = 0.5.
        let grid = Icosphere::new(5);
        let log: Vec<f64> = grid
            .directions()
            .iter()
            .map(|d| if d.z > 0.5 { 4.0 } else { -2.0 })
            .collect();
        let raster = paint([99.0, 99.0], &log, &Panel::Disc(View::Top).pixels(&grid, 200));
        let bright = raster
            .rgba
            .chunks(4)
            .filter(|p| p[3] == 255 && p[0] > 160)
            .count() as f64;
        let all = raster.rgba.chunks(4).filter(|p| p[3] == 255).count() as f64;
        assert!((bright / all - 0.5).abs() < 0.01, "{}", bright / all);
    }

    #[test]
    fn the_view_from_the_front_shows_the_front() {
        let grid = Icosphere::new(4);
        let log: Vec<f64> = grid.directions().iter().map(|d| 4.0 * d.x).collect();
        let middle = |view: View| {
            let raster = paint([99.0, 99.0], &log, &Panel::View(view).pixels(&grid, 33));
            raster.rgba[4 * (16 * 33 + 16)]
        };
        assert!(middle(View::Front) > 240 && middle(View::Back) < 80);
    }
}
