//! Spherical maps over an object, drawn: six views and two equal-area discs a task.

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::{Point3, UnitVector3, Vector3};
use rayon::prelude::*;

use crate::ReportError;
use crate::camera::Camera;
use crate::display_mesh::DisplayMesh;
use crate::icosphere::Icosphere;
use crate::linear_light::{Rgba, to_srgb};
use crate::palette::viridis;
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
    let seen = |view: &View| {
        let camera = Camera {
            camera_from_world: view.camera_from_world(),
            center: *center,
            half_size: radius,
        };
        let mut raster = draw(&scene, &camera, &DrawOptions::square(size))?;
        fade(&mut raster);
        Ok(Picture {
            name: String::new(),
            png: encode_png(&raster),
            alt: String::new(),
        })
    };
    let object = View::SIX
        .par_iter()
        .map(seen)
        .collect::<Result<Vec<_>, ReportError>>()?;
    let maps = maps
        .iter()
        .map(|map| Ratios::new(grid, map))
        .collect::<Result<Vec<_>, _>>()?;
    let mut rows: Vec<SphereRow> = maps.iter().map(Ratios::numbers).collect();
    // What a pixel looks at is the same for all maps.
    let panels: Vec<Panel> = View::SIX
        .map(Panel::View)
        .into_iter()
        .chain([Panel::Disc(View::Top), Panel::Disc(View::Bottom)])
        .collect();
    let drawn: Vec<Vec<Picture>> = panels
        .par_iter()
        .map(|panel| {
            let pixels = panel.pixels(grid, size);
            maps.iter().map(|map| panel.draw(map, &pixels, size)).collect()
        })
        .collect();
    for (panel, of_maps) in panels.iter().zip(drawn) {
        for (row, picture) in rows.iter_mut().zip(of_maps) {
            match panel {
                Panel::View(_) => row.views.push(picture),
                Panel::Disc(_) => row.discs.push(picture),
            }
        }
    }
    Ok(SphereSheet { object, rows })
}

/// The object lies over the map as a drawing: its surface lets most of the colour through, its lines stay.
fn fade(raster: &mut Raster) {
    for pixel in raster.rgba.chunks_exact_mut(4) {
        let dark = 255 - pixel[..3].iter().copied().max().unwrap_or(0);
        let share = 0.34 + 0.66 * (f64::from(dark) / 200.0).powi(2).min(1.0);
        pixel[3] = (f64::from(pixel[3]) * share).round() as u8;
    }
}

/// A map as density over the uniform density.
struct Ratios<'a> {
    grid: &'a Icosphere,
    map: &'a SphereMap,
    ratio: Vec<f64>,
    /// Base-2 logarithms, for drawing.
    log: Vec<f64>,
    /// Ratio at the border of the densest half and nine tenths, and their shares of the sphere.
    regions: [(f64, f64); 2],
}

impl<'a> Ratios<'a> {
    fn new(grid: &'a Icosphere, map: &'a SphereMap) -> Result<Self, ReportError> {
        let (expected, found) = (grid.directions().len(), map.density.len());
        if found != expected {
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
        let ratio: Vec<f64> = map.density.iter().map(|d| d / integral * 4.0 * PI).collect();
        let log = ratio.iter().map(|r| r.max(1e-12).log2()).collect();
        let regions = densest(grid, &ratio);
        Ok(Self {
            grid,
            map,
            ratio,
            log,
            regions,
        })
    }

    /// The row without its pictures.
    fn numbers(&self) -> SphereRow {
        let (grid, ratio) = (self.grid, &self.ratio);
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
        SphereRow {
            task: self.map.task.clone(),
            views: Vec::new(),
            discs: Vec::new(),
            peak: ratio[best],
            peak_direction: grid.directions()[best].into_inner().into(),
            area_of_half: self.regions[0].1,
            area_of_nine_tenths: self.regions[1].1,
            above: share(|d| d.z),
            in_front: share(|d| d.x),
        }
    }
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

/// One picture of a sphere.
#[derive(Clone, Copy)]
enum Panel {
    /// The half that a view sees, orthographically; the sphere fills the picture.
    View(View),
    /// The half about a view's axis as Lambert's azimuthal equal-area disc, oriented like the view.
    Disc(View),
}

/// What each sample of a picture looks at: three directions of the grid and their weights; nothing beside the sphere.
type Pixels = Vec<Option<[(usize, f64); 3]>>;

/// Samples along each side of a pixel.
const SAMPLES: usize = 2;

impl Panel {
    fn pixels(self, grid: &Icosphere, size: usize) -> Pixels {
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

    fn draw(self, map: &Ratios, pixels: &Pixels, size: usize) -> Picture {
        let mut raster = paint(size, map.regions.map(|r| r.0.log2()), &map.log, pixels);
        let what = match self {
            Panel::View(view) => view.title(),
            Panel::Disc(view) => {
                dots(&mut raster, view, &map.map.marks);
                DISC_TITLES[usize::from(view != View::Top)]
            }
        };
        let alt = format!("{}: density over uniform, {what}.", map.map.task);
        Picture {
            name: String::new(),
            png: encode_png(&raster),
            alt,
        }
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
fn paint(size: usize, levels: [f64; 2], log: &[f64], pixels: &Pixels) -> Raster {
    let n = SAMPLES * size;
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
        let raster = paint(
            200,
            [99.0, 99.0],
            &log,
            &Panel::Disc(View::Top).pixels(&grid, 200),
        );
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
            let raster = paint(33, [99.0, 99.0], &log, &Panel::View(view).pixels(&grid, 33));
            raster.rgba[4 * (16 * 33 + 16)]
        };
        assert!(middle(View::Front) > 240 && middle(View::Back) < 80);
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
