//! Bottles: with and without shoulders, round and flat, and one with a handle.

use super::curve::{Corner, Track};
use super::ear::Ear;
use super::lathe;
use super::model::Drawing;
use super::vessel::{Feet, Vessel, draw};

/// All bottles.
pub fn all() -> Vec<Drawing> {
    vec![wine(), beer(), sports(), flask(), jug()]
}

/// A tall bottle with high shoulders and a hollow under its base.
fn wine() -> Drawing {
    draw(&Vessel {
        kind: "bottle",
        name: "wine_bottle",
        profile: &[
            Corner(0.0, 20.0, 0.0),
            Corner(15.0, 19.0, 8.0),
            Corner(29.0, 0.0, 3.0),
            Corner(34.0, 0.0, 2.5),
            Corner(38.0, 5.0, 4.0),
            Corner(38.0, 214.0, 24.0),
            Corner(14.8, 238.0, 20.0),
            Corner(13.8, 282.0, 1.0),
            Corner(15.2, 283.0, 0.6),
            Corner(15.2, 299.0, 1.2),
            Corner(9.4, 299.0, 1.2),
            Corner(9.6, 238.0, 18.0),
            Corner(34.4, 211.0, 22.0),
            Corner(34.4, 5.5, 4.0),
            Corner(31.0, 5.0, 2.0),
            Corner(17.0, 24.5, 8.0),
            Corner(0.0, 25.5, 0.0),
        ],
        spacing: 9.0,
        columns: 48,
        section: &lathe::round,
        ear: None,
        material: "glass",
        density: 2500.0,
        least_thickness: 3.0,
    })
}

/// A long-neck bottle without shoulders.
fn beer() -> Drawing {
    draw(&Vessel {
        kind: "bottle",
        name: "beer_bottle",
        profile: &[
            Corner(0.0, 3.5, 0.0),
            Corner(20.0, 2.5, 4.0),
            Corner(24.0, 0.0, 1.5),
            Corner(27.5, 0.0, 1.5),
            Corner(30.5, 4.0, 3.0),
            Corner(30.5, 118.0, 34.0),
            Corner(13.5, 178.0, 34.0),
            Corner(12.2, 214.0, 1.0),
            Corner(13.4, 215.5, 0.8),
            Corner(13.4, 227.0, 1.2),
            Corner(8.6, 227.0, 1.2),
            Corner(9.8, 178.0, 34.0),
            Corner(27.4, 116.0, 33.0),
            Corner(27.4, 6.5, 4.0),
            Corner(0.0, 7.5, 0.0),
        ],
        spacing: 7.0,
        columns: 44,
        section: &lathe::round,
        ear: None,
        material: "glass",
        density: 2500.0,
        least_thickness: 2.6,
    })
}

/// A waisted plastic drinking bottle with a wide mouth.
fn sports() -> Drawing {
    draw(&Vessel {
        kind: "bottle",
        name: "sports_bottle",
        profile: &[
            Corner(0.0, 4.0, 0.0),
            Corner(24.0, 4.0, 3.0),
            Corner(28.0, 0.0, 1.5),
            Corner(33.0, 0.0, 2.0),
            Corner(37.0, 6.0, 5.0),
            Corner(37.0, 70.0, 20.0),
            Corner(30.5, 102.0, 16.0),
            Corner(37.0, 134.0, 18.0),
            Corner(37.0, 160.0, 12.0),
            Corner(24.5, 177.0, 6.0),
            Corner(24.5, 196.0, 0.9),
            Corner(22.3, 196.0, 0.9),
            Corner(22.3, 175.6, 5.5),
            Corner(34.7, 158.7, 11.0),
            Corner(34.7, 134.4, 17.0),
            Corner(28.2, 102.0, 15.5),
            Corner(34.7, 69.6, 19.0),
            Corner(34.7, 7.0, 4.0),
            Corner(0.0, 6.6, 0.0),
        ],
        spacing: 6.0,
        columns: 44,
        section: &lathe::round,
        ear: None,
        material: "plastic",
        density: 950.0,
        least_thickness: 1.8,
    })
}

/// A flat spirit bottle, wider than deep.
fn flask() -> Drawing {
    let stretch = Track::new(&[
        (-1.0, [25.0]),
        (0.0, [25.0]),
        (112.0, [25.0]),
        (150.0, [0.0]),
        (190.0, [0.0]),
    ]);
    draw(&Vessel {
        kind: "bottle",
        name: "flat_flask",
        profile: &[
            Corner(0.0, 2.0, 0.0),
            Corner(12.0, 2.0, 2.0),
            Corner(14.5, 0.0, 1.5),
            Corner(19.0, 0.0, 2.0),
            Corner(22.0, 5.0, 4.0),
            Corner(22.0, 128.0, 14.0),
            Corner(13.5, 152.0, 8.0),
            Corner(12.8, 166.0, 1.0),
            Corner(14.2, 167.0, 0.8),
            Corner(14.2, 177.0, 1.2),
            Corner(9.0, 177.0, 1.2),
            Corner(9.2, 150.0, 8.0),
            Corner(18.2, 125.0, 13.0),
            Corner(18.2, 7.5, 4.0),
            Corner(0.0, 7.0, 0.0),
        ],
        spacing: 6.0,
        columns: 56,
        section: &|angle, radius, z| {
            let [x, y] = lathe::round(angle, radius, z);
            [x, y + stretch.at(z)[0] * saturated(angle.sin())]
        },
        ear: None,
        material: "glass",
        density: 2500.0,
        least_thickness: 2.2,
    })
}

/// A square plastic jug with a handle from its shoulder to its side.
fn jug() -> Drawing {
    let stretch = Track::new(&[
        (-1.0, [24.0]),
        (0.0, [24.0]),
        (150.0, [24.0]),
        (222.0, [0.0]),
        (270.0, [0.0]),
    ]);
    draw(&Vessel {
        kind: "bottle",
        name: "handled_jug",
        profile: &[
            Corner(0.0, 4.0, 0.0),
            Corner(18.0, 4.0, 3.0),
            Corner(22.0, 0.0, 2.0),
            Corner(27.0, 0.0, 2.0),
            Corner(31.0, 5.0, 5.0),
            Corner(31.0, 160.0, 20.0),
            Corner(21.0, 222.0, 12.0),
            Corner(20.0, 240.0, 1.0),
            Corner(22.0, 241.5, 0.9),
            Corner(22.0, 252.0, 1.0),
            Corner(17.2, 252.0, 1.0),
            Corner(17.2, 221.0, 12.0),
            Corner(27.6, 158.0, 20.0),
            Corner(27.6, 8.0, 5.0),
            Corner(0.0, 7.5, 0.0),
        ],
        spacing: 8.5,
        columns: 56,
        section: &|angle, radius, z| {
            let [x, y] = lathe::round(angle, radius, z);
            let stretch = stretch.at(z)[0];
            [
                x + stretch * saturated(angle.cos()),
                y + stretch * saturated(angle.sin()),
            ]
        },
        ear: Some((
            Feet {
                half_angle: 0.2,
                columns: 6,
                heights: [[190.0, 210.0], [78.0, 98.0]],
                rows: 5,
            },
            Ear {
                path: &[
                    Corner(62.0, 216.0, 16.0),
                    Corner(96.0, 190.0, 26.0),
                    Corner(93.0, 90.0, 26.0),
                ],
                sections: 30,
                half: [[6.0, 8.4], [9.5, 8.0], [11.0, 9.0]],
                power: 2.4,
            },
        )),
        material: "plastic",
        density: 950.0,
        least_thickness: 2.0,
    })
}

/// Rises from −1 to 1 with `c`, steeply in the middle: what pulls a circle's sides apart into a rounded rectangle.
fn saturated(c: f64) -> f64 {
    (2.2 * c).tanh() / 2.2_f64.tanh()
}
