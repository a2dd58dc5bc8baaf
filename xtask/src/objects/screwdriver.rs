//! Screwdrivers: fluted handles, round and square shafts, flat and cross tips, carried up from the butt.

use super::curve::Track;
use super::model::{Drawing, PartBox, boxes_along};
use super::shell::{Part, Ring, Shell};
use super::sweep::{Frame, around, place, superellipse};

/// All screwdrivers.
pub fn all() -> Vec<Drawing> {
    vec![slotted(), phillips(), stubby(), precision()]
}

/// At a height: [half thickness (x), half width (y), power, depth of the handle's flutes, depth of the tip's cross].
type Stations<'a> = &'a [(f64, [f64; 5])];

struct Screwdriver<'a> {
    name: &'static str,
    stations: Stations<'a>,
    step: f64,
    columns: usize,
    /// Flutes around the handle.
    flutes: f64,
    /// Where the shaft leaves the handle.
    shaft_from: f64,
    /// kg/m³ of the handle, and its word for the friction table.
    handle: (f64, &'static str),
    least_thickness: f64,
}

fn draw(tool: &Screwdriver) -> Drawing {
    let track = Track::new(tool.stations);
    let heights = track.steps(tool.step);
    let angles = around(tool.columns);
    let mut shell = Shell::new(Part::Handle);
    let rings: Vec<Ring> = heights
        .iter()
        .map(|&z| {
            let [half_x, half_y, power, flute, cross] = track.at(z);
            let section = angles.iter().map(|&angle| {
                let groove = |depth: f64, n: f64| 1.0 - depth * (0.5 - 0.5 * (n * angle).cos());
                superellipse(angle, half_x, half_y, power)
                    .map(|v| v * groove(flute, tool.flutes) * groove(cross, 4.0))
            });
            place(&mut shell, &Frame::upwards(0.0, 0.0, z), section)
        })
        .collect();
    let split = heights
        .iter()
        .position(|&z| z >= tool.shaft_from)
        .expect("the shaft begins at a station");
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
    Drawing {
        kind: "screwdriver",
        name: tool.name,
        shell,
        densities: [7800.0, tool.handle.0, 7800.0],
        material: tool.handle.1,
        opening: None,
        handle,
        functional,
        sharp: vec![],
        least_thickness: tool.least_thickness,
    }
}

/// A long flat-tipped screwdriver with a square shaft.
fn slotted() -> Drawing {
    draw(&Screwdriver {
        name: "slotted_screwdriver",
        stations: &[
            (0.0, [7.0, 7.0, 2.0, 0.0, 0.0]),
            (2.5, [13.0, 13.0, 2.0, 0.0, 0.0]),
            (8.0, [16.5, 16.5, 2.0, 0.0, 0.0]),
            (20.0, [17.5, 17.5, 2.0, 0.08, 0.0]),
            (70.0, [17.0, 17.0, 2.0, 0.1, 0.0]),
            (86.0, [13.5, 13.5, 2.0, 0.03, 0.0]),
            (94.0, [11.0, 11.0, 2.0, 0.0, 0.0]),
            (106.0, [13.0, 13.0, 2.0, 0.0, 0.0]),
            (112.0, [11.0, 11.0, 2.0, 0.0, 0.0]),
            (114.0, [6.5, 6.5, 3.0, 0.0, 0.0]),
            (120.0, [6.3, 6.3, 3.0, 0.0, 0.0]),
            (121.5, [3.6, 3.6, 6.0, 0.0, 0.0]),
            (250.0, [3.6, 3.6, 6.0, 0.0, 0.0]),
            (258.0, [2.7, 4.6, 5.0, 0.0, 0.0]),
            (274.0, [0.7, 4.8, 6.0, 0.0, 0.0]),
        ],
        step: 5.0,
        columns: 36,
        flutes: 6.0,
        shaft_from: 114.0,
        handle: (1150.0, "plastic"),
        least_thickness: 1.2,
    })
}

/// A cross-tipped screwdriver with a three-lobed handle and a round shaft.
fn phillips() -> Drawing {
    draw(&Screwdriver {
        name: "phillips_screwdriver",
        stations: &[
            (0.0, [6.0, 6.0, 2.0, 0.0, 0.0]),
            (2.0, [10.5, 10.5, 2.0, 0.02, 0.0]),
            (8.0, [14.0, 14.0, 2.0, 0.1, 0.0]),
            (30.0, [15.5, 15.5, 2.0, 0.16, 0.0]),
            (60.0, [14.5, 14.5, 2.0, 0.16, 0.0]),
            (78.0, [9.5, 9.5, 2.0, 0.05, 0.0]),
            (90.0, [10.5, 10.5, 2.0, 0.0, 0.0]),
            (96.0, [8.0, 8.0, 2.0, 0.0, 0.0]),
            (98.0, [3.2, 3.2, 2.0, 0.0, 0.0]),
            (188.0, [3.2, 3.2, 2.0, 0.0, 0.0]),
            (192.0, [3.0, 3.0, 2.0, 0.0, 0.3]),
            (198.0, [1.4, 1.4, 2.0, 0.0, 0.4]),
            (199.0, [0.8, 0.8, 2.0, 0.0, 0.2]),
        ],
        step: 4.0,
        columns: 32,
        flutes: 3.0,
        shaft_from: 98.0,
        handle: (1150.0, "plastic"),
        least_thickness: 0.8,
    })
}

/// A stubby screwdriver: a thick wooden pear on a short shaft.
fn stubby() -> Drawing {
    draw(&Screwdriver {
        name: "stubby_screwdriver",
        stations: &[
            (0.0, [9.0, 9.0, 2.0, 0.0, 0.0]),
            (2.0, [14.5, 14.5, 2.0, 0.0, 0.0]),
            (8.0, [19.0, 19.0, 2.0, 0.02, 0.0]),
            (20.0, [20.5, 20.5, 2.0, 0.04, 0.0]),
            (36.0, [17.0, 17.0, 2.0, 0.04, 0.0]),
            (50.0, [12.5, 12.5, 2.0, 0.0, 0.0]),
            (58.0, [12.0, 12.0, 2.0, 0.0, 0.0]),
            (60.0, [9.5, 9.5, 2.0, 0.0, 0.0]),
            (61.5, [3.2, 3.2, 2.0, 0.0, 0.0]),
            (84.0, [3.2, 3.2, 2.0, 0.0, 0.0]),
            (90.0, [1.9, 3.6, 4.0, 0.0, 0.0]),
            (97.0, [0.6, 3.3, 6.0, 0.0, 0.0]),
        ],
        step: 2.4,
        columns: 36,
        flutes: 8.0,
        shaft_from: 61.5,
        handle: (750.0, "wood"),
        least_thickness: 1.0,
    })
}

/// A slim screwdriver for small screws, metal throughout, with a cap that turns.
fn precision() -> Drawing {
    draw(&Screwdriver {
        name: "precision_screwdriver",
        stations: &[
            (0.0, [4.5, 4.5, 2.0, 0.0, 0.0]),
            (1.0, [6.6, 6.6, 2.0, 0.0, 0.0]),
            (6.0, [6.6, 6.6, 2.0, 0.0, 0.0]),
            (7.0, [4.4, 4.4, 2.0, 0.0, 0.0]),
            (9.0, [4.4, 4.4, 2.0, 0.0, 0.0]),
            (10.5, [5.4, 5.4, 2.0, 0.0, 0.0]),
            (20.0, [5.6, 5.6, 2.0, 0.1, 0.0]),
            (68.0, [5.2, 5.2, 2.0, 0.1, 0.0]),
            (76.0, [5.0, 5.0, 2.0, 0.0, 0.0]),
            (86.0, [3.0, 3.0, 2.0, 0.0, 0.0]),
            (88.0, [1.6, 1.6, 2.0, 0.0, 0.0]),
            (142.0, [1.6, 1.6, 2.0, 0.0, 0.0]),
            (145.0, [1.5, 1.5, 2.0, 0.0, 0.28]),
            (149.0, [0.7, 0.7, 2.0, 0.0, 0.35]),
            (149.6, [0.45, 0.45, 2.0, 0.0, 0.2]),
        ],
        step: 2.6,
        columns: 32,
        flutes: 8.0,
        shaft_from: 88.0,
        handle: (2700.0, "metal"),
        least_thickness: 0.5,
    })
}
