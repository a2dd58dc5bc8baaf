//! Knives: sections carried up from the butt; the edge looks to +x.

use super::curve::Track;
use super::model::{Drawing, PartBox, boxes_along};
use super::shell::{Part, Ring, Shell};
use nalgebra::Point3;
use std::f64::consts::PI;

/// All knives.
pub fn all() -> Vec<Drawing> {
    vec![chef(), paring(), cleaver(), table()]
}

/// At a height: [x of the back, x of the edge, half thickness at the back, half thickness at the edge, power].
type Stations<'a> = &'a [(f64, [f64; 5])];

struct Knife<'a> {
    name: &'static str,
    stations: Stations<'a>,
    step: f64,
    /// Where the handle ends and the blade begins.
    blade_from: f64,
    /// Where the edge begins.
    edge_from: f64,
    /// kg/m³ of the handle.
    handle_density: f64,
    least_thickness: f64,
}

/// Points on each face of a section.
const FACE: usize = 14;

fn draw(knife: &Knife) -> Drawing {
    let track = Track::new(knife.stations);
    let heights = track.steps(knife.step);
    let mut shell = Shell::new(Part::Handle);
    let rings: Vec<Ring> = heights
        .iter()
        .map(|&z| shell.ring(section(track.at(z), z)))
        .collect();
    let split = heights
        .iter()
        .position(|&z| z >= knife.blade_from)
        .expect("the blade begins at a station");
    let butt = shell.mean(&rings[0]);
    shell.cap_start(&rings[0], butt);
    shell.weave(&rings[..=split], &[]);
    shell.start(Part::Functional);
    shell.weave(&rings[split..], &[]);
    shell.cap_end_flat(&rings[rings.len() - 1]);

    let handle = boxes_along(&shell, &rings[..=split], 2);
    let functional = vec![PartBox::around(
        rings[split + 1..].iter().flatten().map(|&idx| &shell.points[idx]),
        0.2,
    )];
    let edge: Vec<Ring> = rings
        .iter()
        .zip(&heights)
        .filter(|(_, z)| **z >= knife.edge_from)
        .map(|(ring, &z)| {
            let x_edge = track.at(z)[1];
            ring.iter()
                .copied()
                .filter(|&idx| shell.points[idx].x >= x_edge - 3.0)
                .collect()
        })
        .collect();
    let sharp = boxes_along(&shell, &edge, 8);
    Drawing {
        kind: "knife",
        name: knife.name,
        shell,
        densities: [7800.0, knife.handle_density, 7800.0],
        material: "metal",
        opening: None,
        handle,
        functional,
        sharp,
        least_thickness: knife.least_thickness,
    }
}

/// From the edge along the +y face to the back, and along the −y face to the edge again.
fn section([back, edge, half_back, half_edge, power]: [f64; 5], z: f64) -> impl Iterator<Item = Point3<f64>> {
    (0..2 * FACE).map(move |k| {
        let (face, k) = if k < FACE {
            (1.0, k)
        } else {
            (-1.0, 2 * FACE - 1 - k)
        };
        let along = (PI * (k as f64 + 0.5) / FACE as f64).cos();
        let bulge = (1.0 - along.abs().powf(power)).powf(1.0 / power);
        let half = half_back + (half_edge - half_back) * 0.5 * (along + 1.0);
        Point3::new(
            0.5 * (back + edge) + 0.5 * (edge - back) * along,
            face * half * bulge,
            z,
        )
    })
}

/// A chef's knife with a bolster and a tapered blade.
fn chef() -> Drawing {
    draw(&Knife {
        name: "chef_knife",
        stations: &[
            (0.0, [-7.0, 9.0, 5.5, 5.5, 2.5]),
            (2.0, [-11.0, 14.0, 8.5, 8.5, 2.5]),
            (10.0, [-12.5, 16.5, 10.0, 10.0, 2.5]),
            (30.0, [-12.0, 13.5, 10.0, 10.0, 2.5]),
            (65.0, [-11.5, 11.5, 10.0, 10.0, 2.5]),
            (108.0, [-11.5, 11.5, 9.0, 9.0, 2.5]),
            (114.0, [-12.0, 13.0, 9.4, 9.4, 2.8]),
            (120.0, [-12.0, 14.0, 7.5, 7.0, 3.0]),
            (125.0, [-12.0, 16.0, 3.2, 2.6, 4.0]),
            (127.0, [-12.0, 19.0, 1.7, 1.2, 6.0]),
            (129.0, [-12.0, 28.0, 1.3, 0.5, 9.0]),
            (131.0, [-12.0, 35.0, 1.25, 0.25, 10.0]),
            (190.0, [-12.0, 34.0, 1.15, 0.25, 10.0]),
            (250.0, [-11.5, 28.5, 1.0, 0.25, 10.0]),
            (295.0, [-10.5, 18.0, 0.9, 0.25, 10.0]),
            (318.0, [-8.8, 7.5, 0.8, 0.25, 10.0]),
            (327.0, [-7.4, 0.5, 0.78, 0.25, 10.0]),
            (330.0, [-6.6, -3.6, 0.75, 0.3, 10.0]),
        ],
        step: 4.5,
        blade_from: 120.0,
        edge_from: 131.0,
        handle_density: 1250.0,
        least_thickness: 0.35,
    })
}

/// A small paring knife with a wooden handle and no bolster.
fn paring() -> Drawing {
    draw(&Knife {
        name: "paring_knife",
        stations: &[
            (0.0, [-5.0, 6.0, 4.0, 4.0, 2.4]),
            (1.5, [-7.5, 9.0, 6.0, 6.0, 2.4]),
            (8.0, [-8.6, 10.4, 7.2, 7.2, 2.4]),
            (45.0, [-8.0, 9.5, 7.4, 7.4, 2.4]),
            (80.0, [-8.0, 7.0, 6.4, 6.4, 2.4]),
            (96.0, [-8.4, 9.0, 5.8, 5.8, 2.6]),
            (98.0, [-8.0, 8.6, 4.6, 4.4, 3.0]),
            (99.0, [-7.4, 8.8, 1.2, 0.9, 6.0]),
            (101.0, [-7.4, 12.0, 0.9, 0.35, 9.0]),
            (104.0, [-7.4, 12.6, 0.9, 0.22, 10.0]),
            (150.0, [-6.4, 11.4, 0.85, 0.22, 10.0]),
            (172.0, [-3.4, 8.8, 0.8, 0.22, 10.0]),
            (182.0, [1.2, 6.6, 0.76, 0.24, 10.0]),
            (184.5, [3.2, 5.6, 0.75, 0.3, 10.0]),
        ],
        step: 3.2,
        blade_from: 99.0,
        edge_from: 104.0,
        handle_density: 750.0,
        least_thickness: 0.3,
    })
}

/// A cleaver with a tall straight blade.
fn cleaver() -> Drawing {
    draw(&Knife {
        name: "cleaver",
        stations: &[
            (0.0, [-7.0, 9.0, 7.0, 7.0, 2.3]),
            (2.0, [-11.0, 13.0, 10.0, 10.0, 2.3]),
            (10.0, [-13.0, 15.0, 12.0, 12.0, 2.3]),
            (50.0, [-12.0, 13.0, 12.0, 12.0, 2.3]),
            (100.0, [-11.0, 11.0, 10.5, 10.5, 2.3]),
            (106.0, [-11.0, 11.0, 9.5, 9.5, 2.5]),
            (110.0, [-11.0, 11.0, 4.0, 4.0, 4.0]),
            (114.0, [-11.0, 11.5, 1.8, 1.6, 8.0]),
            (120.0, [-13.0, 15.0, 1.5, 1.2, 10.0]),
            (124.0, [-16.0, 35.0, 1.5, 0.7, 10.0]),
            (126.0, [-17.0, 58.0, 1.5, 0.4, 10.0]),
            (128.0, [-17.5, 67.0, 1.5, 0.35, 10.0]),
            (200.0, [-18.0, 70.0, 1.5, 0.35, 10.0]),
            (280.0, [-18.0, 68.5, 1.4, 0.35, 10.0]),
            (286.0, [-16.5, 67.5, 1.4, 0.35, 10.0]),
            (290.0, [-10.0, 63.0, 1.35, 0.4, 10.0]),
        ],
        step: 5.0,
        blade_from: 110.0,
        edge_from: 128.0,
        handle_density: 800.0,
        least_thickness: 0.45,
    })
}

/// A table knife of one piece of metal, round at the end.
fn table() -> Drawing {
    draw(&Knife {
        name: "table_knife",
        stations: &[
            (0.0, [-6.0, 6.0, 2.4, 2.4, 2.4]),
            (2.0, [-8.5, 8.5, 3.4, 3.4, 2.4]),
            (10.0, [-10.0, 10.0, 4.0, 4.0, 2.4]),
            (60.0, [-8.0, 8.0, 4.2, 4.2, 2.4]),
            (100.0, [-6.0, 6.0, 4.0, 4.0, 2.4]),
            (108.0, [-6.0, 6.2, 3.0, 2.8, 2.6]),
            (116.0, [-7.0, 8.0, 1.5, 1.2, 5.0]),
            (126.0, [-8.5, 10.5, 1.2, 0.4, 9.0]),
            (190.0, [-8.5, 11.0, 1.05, 0.35, 10.0]),
            (210.0, [-7.5, 10.0, 1.0, 0.35, 10.0]),
            (219.0, [-4.5, 7.0, 0.95, 0.4, 10.0]),
            (222.0, [-1.5, 4.0, 0.9, 0.5, 10.0]),
        ],
        step: 3.6,
        blade_from: 116.0,
        edge_from: 126.0,
        handle_density: 7800.0,
        least_thickness: 0.45,
    })
}
