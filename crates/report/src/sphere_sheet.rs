//! Spherical maps over an object, drawn: six views and two equal-area discs a task.

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::{Point3, UnitVector3, Vector3};
use rayon::prelude::*;

use crate::ReportError;
use crate::camera::Camera;
use crate::display_mesh::DisplayMesh;
use crate::icosphere::Icosphere;
use crate::palette_png::encode_png;
use crate::picture::Picture;
use crate::raster::{DrawOptions, Raster, draw};
use crate::scene::Scene;
use crate::sphere_panel::{Panel, Pixels};
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
            maps.iter().map(|map| map.picture(*panel, &pixels)).collect()
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

    /// The map in one panel.
    fn picture(&self, panel: Panel, pixels: &Pixels) -> Picture {
        let raster = panel.draw(
            &self.log,
            self.regions.map(|r| r.0.log2()),
            &self.map.marks,
            pixels,
        );
        let what = match panel {
            Panel::View(view) => view.title(),
            Panel::Disc(view) => DISC_TITLES[usize::from(view != View::Top)],
        };
        let alt = format!("{}: density over uniform, {what}.", self.map.task);
        Picture {
            name: String::new(),
            png: encode_png(&raster),
            alt,
        }
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
