//! Mugs: straight, bowl-shaped, faceted and conical, each with its own ear.

use super::curve::Corner;
use super::ear::Ear;
use super::lathe;
use super::model::Drawing;
use super::vessel::{Feet, Vessel, draw};

/// All mugs.
pub fn all() -> Vec<Drawing> {
    vec![coffee(), cappuccino(), stein(), camping()]
}

/// A stoneware mug, straight, with a C-shaped ear.
fn coffee() -> Drawing {
    draw(&Vessel {
        kind: "mug",
        name: "coffee_mug",
        profile: &[
            Corner(0.0, 2.2, 0.0),
            Corner(29.0, 2.2, 1.0),
            Corner(30.5, 0.0, 0.7),
            Corner(34.0, 0.0, 1.0),
            Corner(41.0, 7.0, 5.0),
            Corner(41.0, 96.0, 2.0),
            Corner(36.8, 96.0, 2.0),
            Corner(36.8, 8.0, 7.0),
            Corner(0.0, 7.0, 0.0),
        ],
        spacing: 7.0,
        columns: 52,
        section: &lathe::round,
        ear: Some((
            Feet {
                half_angle: 0.19,
                columns: 6,
                heights: [[70.0, 82.0], [22.0, 34.0]],
                rows: 4,
            },
            Ear {
                path: &[Corner(72.0, 80.0, 26.0), Corner(70.0, 28.0, 24.0)],
                sections: 26,
                half: [[7.2, 5.6], [5.8, 4.3], [7.0, 5.4]],
                power: 2.4,
            },
        )),
        material: "glass",
        density: 2350.0,
        least_thickness: 3.6,
    })
}

/// A wide porcelain cup on a small foot, with a small ear.
fn cappuccino() -> Drawing {
    draw(&Vessel {
        kind: "mug",
        name: "cappuccino_cup",
        profile: &[
            Corner(0.0, 2.5, 0.0),
            Corner(21.0, 2.5, 1.0),
            Corner(22.5, 0.0, 0.7),
            Corner(27.0, 0.0, 1.0),
            Corner(28.5, 4.0, 1.0),
            Corner(45.0, 18.0, 16.0),
            Corner(52.0, 63.0, 1.8),
            Corner(48.0, 63.0, 1.8),
            Corner(41.5, 21.0, 14.0),
            Corner(24.0, 7.0, 6.0),
            Corner(0.0, 6.5, 0.0),
        ],
        spacing: 6.0,
        columns: 52,
        section: &lathe::round,
        ear: Some((
            Feet {
                half_angle: 0.11,
                columns: 4,
                heights: [[44.0, 53.0], [19.0, 28.0]],
                rows: 3,
            },
            Ear {
                path: &[Corner(80.0, 55.0, 12.0), Corner(68.0, 20.0, 14.0)],
                sections: 22,
                half: [[4.8, 4.0], [3.9, 3.2], [4.4, 3.8]],
                power: 2.2,
            },
        )),
        material: "glass",
        density: 2400.0,
        least_thickness: 3.2,
    })
}

/// A tall faceted beer mug of thick glass with a large D-shaped ear.
fn stein() -> Drawing {
    draw(&Vessel {
        kind: "mug",
        name: "beer_stein",
        profile: &[
            Corner(0.0, 4.0, 0.0),
            Corner(32.0, 3.0, 3.0),
            Corner(36.0, 0.0, 2.0),
            Corner(44.0, 0.0, 3.0),
            Corner(48.0, 14.0, 6.0),
            Corner(43.0, 154.0, 2.2),
            Corner(38.0, 154.0, 2.2),
            Corner(41.0, 18.0, 8.0),
            Corner(0.0, 15.0, 0.0),
        ],
        spacing: 9.0,
        columns: 60,
        section: &|angle, radius, z| {
            let fade = (1.0 - ((z - 70.0) / 66.0).powi(4)).max(0.0);
            lathe::round(angle, radius * (1.0 + 0.012 * fade * (10.0 * angle).cos()), z)
        },
        ear: Some((
            Feet {
                half_angle: 0.22,
                columns: 6,
                heights: [[112.0, 132.0], [28.0, 48.0]],
                rows: 5,
            },
            Ear {
                path: &[Corner(95.0, 125.0, 26.0), Corner(95.0, 36.0, 26.0)],
                sections: 28,
                half: [[9.2, 8.2], [9.5, 6.8], [9.4, 8.4]],
                power: 2.6,
            },
        )),
        material: "glass",
        density: 2500.0,
        least_thickness: 4.2,
    })
}

/// A conical camping cup of thin metal with a strap for an ear.
fn camping() -> Drawing {
    draw(&Vessel {
        kind: "mug",
        name: "camping_cup",
        profile: &[
            Corner(0.0, 1.5, 0.0),
            Corner(33.0, 1.5, 1.0),
            Corner(35.0, 0.0, 0.7),
            Corner(37.5, 0.0, 1.5),
            Corner(39.5, 3.0, 3.0),
            Corner(45.0, 76.0, 2.0),
            Corner(46.8, 79.5, 1.0),
            Corner(46.8, 81.5, 1.0),
            Corner(43.6, 81.5, 1.0),
            Corner(42.9, 76.0, 2.0),
            Corner(37.2, 4.0, 3.0),
            Corner(0.0, 3.8, 0.0),
        ],
        spacing: 6.5,
        columns: 48,
        section: &lathe::round,
        ear: Some((
            Feet {
                half_angle: 0.22,
                columns: 8,
                heights: [[61.0, 67.0], [16.0, 22.0]],
                rows: 2,
            },
            Ear {
                path: &[Corner(74.0, 70.0, 18.0), Corner(68.0, 18.0, 22.0)],
                sections: 26,
                half: [[9.0, 2.4], [8.0, 1.7], [8.2, 2.4]],
                power: 3.5,
            },
        )),
        material: "metal",
        density: 2700.0,
        least_thickness: 1.9,
    })
}
