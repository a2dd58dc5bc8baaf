//! Drinking glasses: conical, stemmed, and small.

use super::curve::Corner;
use super::lathe;
use super::model::Drawing;
use super::vessel::{Vessel, draw};

/// All glasses.
pub fn all() -> Vec<Drawing> {
    vec![tumbler(), wine(), martini(), shot()]
}

fn turned(
    name: &'static str,
    profile: &[Corner],
    spacing: f64,
    columns: usize,
    least_thickness: f64,
) -> Drawing {
    draw(&Vessel {
        kind: "glass",
        name,
        profile,
        spacing,
        columns,
        section: &lathe::round,
        ear: None,
        material: "glass",
        density: 2500.0,
        least_thickness,
    })
}

/// A conical water glass with a heavy base.
fn tumbler() -> Drawing {
    let profile = [
        Corner(0.0, 1.5, 0.0),
        Corner(22.0, 1.0, 3.0),
        Corner(25.0, 0.0, 1.5),
        Corner(31.0, 0.0, 2.5),
        Corner(41.5, 122.0, 1.5),
        Corner(38.3, 122.0, 1.5),
        Corner(28.6, 12.0, 6.0),
        Corner(0.0, 10.5, 0.0),
    ];
    turned("tumbler", &profile, 6.5, 52, 2.9)
}

/// A stemmed wine glass.
fn wine() -> Drawing {
    let profile = [
        Corner(0.0, 2.6, 0.0),
        Corner(20.0, 1.6, 9.0),
        Corner(31.0, 0.0, 1.0),
        Corner(37.0, 0.0, 1.0),
        Corner(37.0, 2.8, 1.2),
        Corner(13.0, 6.0, 9.0),
        Corner(4.2, 14.0, 9.0),
        Corner(3.8, 86.0, 12.0),
        Corner(12.0, 96.0, 9.0),
        Corner(38.0, 106.0, 18.0),
        Corner(44.5, 140.0, 24.0),
        Corner(41.0, 175.0, 22.0),
        Corner(33.5, 214.0, 1.1),
        Corner(31.1, 214.0, 1.1),
        Corner(38.5, 175.0, 21.0),
        Corner(42.0, 141.0, 23.0),
        Corner(36.0, 109.0, 17.0),
        Corner(12.0, 99.6, 9.0),
        Corner(0.0, 98.0, 0.0),
    ];
    turned("wine_glass", &profile, 5.5, 48, 2.0)
}

/// A cone on a stem.
fn martini() -> Drawing {
    let profile = [
        Corner(0.0, 2.6, 0.0),
        Corner(22.0, 1.6, 9.0),
        Corner(34.0, 0.0, 1.0),
        Corner(40.0, 0.0, 1.0),
        Corner(40.0, 3.0, 1.3),
        Corner(14.0, 6.0, 9.0),
        Corner(4.6, 15.0, 9.0),
        Corner(4.4, 88.0, 7.0),
        Corner(57.0, 168.0, 1.4),
        Corner(53.8, 168.0, 1.4),
        Corner(4.5, 93.0, 4.0),
        Corner(0.0, 92.0, 0.0),
    ];
    turned("martini_glass", &profile, 5.5, 48, 1.8)
}

/// A shot glass with a thick base.
fn shot() -> Drawing {
    let profile = [
        Corner(0.0, 1.2, 0.0),
        Corner(14.0, 0.8, 2.0),
        Corner(16.0, 0.0, 1.0),
        Corner(19.5, 0.0, 1.5),
        Corner(24.5, 61.0, 1.4),
        Corner(21.0, 61.0, 1.4),
        Corner(17.6, 15.0, 4.0),
        Corner(0.0, 13.0, 0.0),
    ];
    turned("shot_glass", &profile, 3.6, 44, 3.0)
}
