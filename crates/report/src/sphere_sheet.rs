//! Spherical maps over an object, drawn: six views and two equal-area discs a task.

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::{Point3, UnitVector3, Vector3};

use crate::ReportError;
use crate::camera::Camera;
use crate::display_mesh::DisplayMesh;
use crate::icosphere::Icosphere;
use crate::linear_light::{Rgba, to_srgb};
use crate::palette::cividis;
use crate::palette_png::encode_png;
use crate::picture::Picture;
use crate::raster::{DrawOptions, Raster, draw};
use crate::scene::Scene;
use crate::view::View;

/// Titles of the two discs.
pub const DISC_TITLES: [&str; 2] = ["upper half", "lower half"];

/// Densities over the directions of a sphere, to be drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct SphereMap {
    /// The task.
    pub task: String,
    /// Density (per steradian) at each direction of the grid; made to integrate to 1.
    pub density: Vec<f64>,
    /// Unit positions to mark on the discs: labelled grasps.
    pub marks: Vec<Vector3<f64>>,
}

/// The maps of one object, drawn.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SphereSheet {
    /// The object as seen in each of [`crate::View::SIX`], on a transparent ground, to lie over the maps.
    pub object: Vec<Picture>,
    /// One row a map.
    pub rows: Vec<SphereRow>,
}

/// One map, drawn, and what it says in numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SphereRow {
    /// The task.
    pub task: String,
    /// The density on the half of the sphere that each of [`crate::View::SIX`] sees.
    pub views: Vec<Picture>,
    /// Lambert equal-area discs of the upper half seen from above, and of the lower half seen from below.
    pub discs: Vec<Picture>,
    /// Largest density over the uniform one.
    pub peak: f64,
    /// Where it is: a unit vector in the object's frame.
    pub peak_direction: [f64; 3],
    /// Smallest share of the sphere that holds half of the probability.
    pub area_of_half: f64,
    /// Smallest share of the sphere that holds nine tenths of it.
    pub area_of_nine_tenths: f64,
    /// Probability of z > 0.
    pub above: f64,
    /// Probability of x > 0.
    pub in_front: f64,
}

/// Draws the maps of one object, each picture `size` pixels square.
///
/// `center` is the point that directions are taken from (the centre of the root box). The sphere is drawn close round
/// the object, since a direction has no distance.
///
/// # Errors
///
/// [`ReportError::MapSize`], [`ReportError::MapDensity`] for maps that do not fit the grid or cannot be normalised, and
/// [`ReportError::PictureSize`].
pub fn sphere_sheet(
    object: &Arc<DisplayMesh>,
    center: &Point3<f64>,
    grid: &Icosphere,
    maps: &[SphereMap],
    size: usize,
) -> Result<SphereSheet, ReportError> {
    let scene = Scene::object(object);
    let radius = 1.08 * scene.points().map(|p| (p - center).norm()).fold(1e-6, f64::max);
    let mut pictures = Vec::new();
    for view in View::SIX {
        let camera = Camera {
            camera_from_world: view.camera_from_world(),
            center: *center,
            half_size: radius,
        };
        let mut raster = draw(&scene, &camera, &DrawOptions::square(size))?;
        fade(&mut raster);
        pictures.push(Picture {
            name: String::new(),
            png: encode_png(&raster),
            alt: String::new(),
        });
    }
    let rows = maps
        .iter()
        .map(|map| row(grid, map, size))
        .collect::<Result<_, _>>()?;
    Ok(SphereSheet {
        object: pictures,
        rows,
    })
}

/// The object lies over the map as a drawing: its surface lets most of the colour through, its lines stay.
fn fade(raster: &mut Raster) {
    for pixel in raster.rgba.chunks_exact_mut(4) {
        let dark = 255 - pixel[..3].iter().copied().max().unwrap_or(0);
        let share = 0.30 + 0.70 * (f64::from(dark) / 200.0).powi(2).min(1.0);
        pixel[3] = (f64::from(pixel[3]) * share).round() as u8;
    }
}

fn row(grid: &Icosphere, map: &SphereMap, size: usize) -> Result<SphereRow, ReportError> {
    let expected = grid.directions().len();
    if map.density.len() != expected {
        let found = map.density.len();
        return Err(ReportError::MapSize {
            map: map.task.clone(),
            expected,
            found,
        });
    }
    let integral = grid.integral(&map.density);
    let usable = map.density.iter().all(|d| *d >= 0.0) && integral.is_finite() && integral > 0.0;
    if !usable {
        return Err(ReportError::MapDensity {
            map: map.task.clone(),
            integral,
        });
    }
    // Density over the uniform density, and its logarithm to base 2 for drawing.
    let ratio: Vec<f64> = map.density.iter().map(|d| d / integral * 4.0 * PI).collect();
    let log: Vec<f64> = ratio.iter().map(|r| r.max(1e-12).log2()).collect();
    let regions = densest(grid, &ratio);
    // Directions on the border between two halves count for both by half.
    let share = |along: fn(&UnitVector3<f64>) -> f64| -> f64 {
        let part = |i: usize, x: f64| {
            let half = if x.abs() < 1e-9 {
                0.5
            } else {
                f64::from(u8::from(x > 0.0))
            };
            half * grid.weights()[i] * ratio[i] / (4.0 * PI)
        };
        grid.directions()
            .iter()
            .enumerate()
            .map(|(i, d)| part(i, along(d)))
            .sum()
    };
    let best = (0..ratio.len())
        .max_by(|&a, &b| ratio[a].total_cmp(&ratio[b]).then(b.cmp(&a)))
        .unwrap_or(0);
    let alt = |what: &str| format!("{}: density over uniform, {what}.", map.task);
    let levels = regions.map(|r| r.0.log2());
    let views = View::SIX.iter().map(|view| Picture {
        name: String::new(),
        png: encode_png(&shell(grid, &log, *view, size, levels)),
        alt: alt(view.title()),
    });
    let discs = [1.0, -1.0].iter().zip(DISC_TITLES).map(|(side, title)| Picture {
        name: String::new(),
        png: encode_png(&disc(grid, &log, *side, size, levels, &map.marks)),
        alt: alt(title),
    });
    Ok(SphereRow {
        task: map.task.clone(),
        views: views.collect(),
        discs: discs.collect(),
        peak: ratio[best],
        peak_direction: grid.directions()[best].into_inner().into(),
        area_of_half: regions[0].1,
        area_of_nine_tenths: regions[1].1,
        above: share(|d| d.z),
        in_front: share(|d| d.x),
    })
}

/// Density at the border of the densest regions that hold 50 and 90 % of the probability, and their shares of the
/// sphere.
fn densest(grid: &Icosphere, ratio: &[f64]) -> [(f64, f64); 2] {
    let mut order: Vec<usize> = (0..ratio.len()).collect();
    order.sort_by(|&a, &b| ratio[b].total_cmp(&ratio[a]).then(a.cmp(&b)));
    let full = 4.0 * PI;
    [0.5, 0.9].map(|target| {
        let (mut mass, mut area) = (0.0, 0.0);
        for &i in &order {
            mass += grid.weights()[i] * ratio[i] / full;
            area += grid.weights()[i] / full;
            if mass >= target {
                return (ratio[i], area);
            }
        }
        (0.0, 1.0)
    })
}

/// The half of the sphere that a view sees, seen orthographically; the sphere fills the picture.
fn shell(grid: &Icosphere, log: &[f64], view: View, size: usize, levels: [f64; 2]) -> Raster {
    let world_from_camera = view.camera_from_world().inverse();
    paint(size, levels, |x, y| {
        let r2 = x * x + y * y;
        (r2 <= 1.0)
            .then(|| grid.interpolate(log, &(world_from_camera * Vector3::new(x, y, (1.0 - r2).sqrt()))))
    })
}

/// Lambert's azimuthal equal-area disc about +z (`side` 1) or −z (−1), oriented like the views from there.
///
/// ```text
/// r = √2 sin(θ/2), θ the angle from the axis: r = 1 at the equator
/// ```
fn disc(
    grid: &Icosphere,
    log: &[f64],
    side: f64,
    size: usize,
    levels: [f64; 2],
    marks: &[Vector3<f64>],
) -> Raster {
    let view = if side > 0.0 { View::Top } else { View::Bottom };
    let camera_from_world = view.camera_from_world();
    let mut raster = paint(size, levels, |x, y| {
        let r2 = x * x + y * y;
        // cos θ = 1 − 2 sin²(θ/2) = 1 − r².
        let (cos, stretch) = (1.0 - r2, (2.0 - r2).sqrt());
        let seen = Vector3::new(x * stretch, y * stretch, cos);
        (r2 <= 1.0).then(|| grid.interpolate(log, &(camera_from_world.inverse() * seen)))
    });
    for mark in marks {
        let Some(seen) = mark
            .try_normalize(1e-9)
            .map(|m| camera_from_world * m)
            .filter(|m| m.z >= 0.0)
        else {
            continue;
        };
        let shrink = (1.0 + seen.z).sqrt();
        let at = |v: f64| (v / shrink + 1.0) / 2.0 * size as f64;
        dot(&mut raster, at(seen.x), size as f64 - at(seen.y));
    }
    raster
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

/// Colours a square of [−1, 1]² by the base-2 logarithm that `value` gives, ¼ to 16, with a line where it crosses a
/// level; clear where it gives nothing.
fn paint(size: usize, levels: [f64; 2], value: impl Fn(f64, f64) -> Option<f64>) -> Raster {
    let n = 2 * size;
    let at = |i: usize| (i as f64 + 0.5) / size as f64 - 1.0;
    let values: Vec<Option<f64>> = (0..n * n).map(|i| value(at(i % n), -at(i / n))).collect();
    let crosses = |i: usize, j: usize, level: f64| match (values[i], values[j]) {
        (Some(a), Some(b)) => (a >= level) != (b >= level),
        _ => false,
    };
    let sample = |x: usize, y: usize| -> Rgba {
        let i = y * n + x;
        let Some(v) = values[i] else { return Rgba::CLEAR };
        let color = Rgba::opaque(cividis((v + 2.0) / 6.0));
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
    use prehend_geometry::Solid;

    use super::*;

    fn sheet(density: impl Fn(&Vector3<f64>) -> f64) -> Result<SphereSheet, ReportError> {
        let grid = Icosphere::new(4);
        let object = Arc::new(DisplayMesh::new(&Solid::Sphere { radius: 0.04 }.display_mesh()));
        let density = grid.directions().iter().map(|d| density(d)).collect();
        let map = SphereMap {
            task: "pouring".into(),
            density,
            marks: vec![Vector3::z()],
        };
        sphere_sheet(&object, &Point3::origin(), &grid, &[map], 32)
    }

    #[test]
    fn a_uniform_map_is_as_wide_as_its_probability() {
        let sheet = sheet(|_| 7.0).unwrap();
        let row = &sheet.rows[0];
        assert!((row.peak - 1.0).abs() < 1e-9);
        assert!((row.area_of_half - 0.5).abs() < 2e-3 && (row.area_of_nine_tenths - 0.9).abs() < 2e-3);
        assert!((row.above - 0.5).abs() < 0.01);
        assert_eq!((sheet.object.len(), row.views.len(), row.discs.len()), (6, 6, 2));
    }

    #[test]
    fn a_peaked_map_says_where_and_how_high() {
        // Von Mises–Fisher about +x: density over uniform at the mode is 2κ / (1 − e^(−2κ)).
        let row = &sheet(|d| (8.0 * (d.x - 1.0)).exp()).unwrap().rows[0];
        assert!((row.peak / 16.0 - 1.0).abs() < 0.01, "{}", row.peak);
        assert!((row.peak_direction[0] - 1.0).abs() < 0.01);
        // Half of it lies within the cap 1 − cos θ = ln 2 / κ, whose share of the sphere is half of that.
        assert!(
            (row.area_of_half / (2.0_f64.ln() / 16.0) - 1.0).abs() < 0.05,
            "{}",
            row.area_of_half
        );
        // P(x > 0) = (1 − e^(−κ)) / (1 − e^(−2κ)).
        assert!((row.in_front - 1.0).abs() < 1e-3);
    }

    #[test]
    fn discs_keep_areas() {
        // A cap of 60° about +z holds a quarter of the sphere, half of the upper disc: r² = 1 − cos θ = 0.5.
        let grid = Icosphere::new(5);
        let log: Vec<f64> = grid
            .directions()
            .iter()
            .map(|d| if d.z > 0.5 { 4.0 } else { -2.0 })
            .collect();
        let raster = disc(&grid, &log, 1.0, 200, [99.0, 99.0], &[]);
        let bright = raster
            .rgba
            .chunks(4)
            .filter(|p| p[3] == 255 && p[0] > 128)
            .count() as f64;
        let all = raster.rgba.chunks(4).filter(|p| p[3] == 255).count() as f64;
        assert!((bright / all - 0.5).abs() < 0.01, "{}", bright / all);
    }

    #[test]
    fn the_view_from_the_front_shows_the_front() {
        let grid = Icosphere::new(4);
        let log: Vec<f64> = grid.directions().iter().map(|d| 4.0 * d.x).collect();
        let middle = |view: View| {
            let raster = shell(&grid, &log, view, 33, [99.0, 99.0]);
            raster.rgba[4 * (16 * 33 + 16)]
        };
        assert!(middle(View::Front) > 240 && middle(View::Back) == 0);
    }

    #[test]
    fn maps_that_do_not_fit_are_refused_with_their_name() {
        let object = Arc::new(DisplayMesh::new(&Solid::Sphere { radius: 0.04 }.display_mesh()));
        let map = SphereMap {
            task: "pouring".into(),
            density: vec![1.0; 3],
            marks: vec![],
        };
        let error = sphere_sheet(&object, &Point3::origin(), &Icosphere::new(0), &[map], 8).unwrap_err();
        assert_eq!(
            error.to_string(),
            "spherical map `pouring`: expected 12 densities, one per direction of the grid, found 3"
        );
        assert_eq!(
            sheet(|_| 0.0).unwrap_err().to_string(),
            "spherical map `pouring`: the densities must be finite and at least 0 with a positive integral, found 0"
        );
    }
}
