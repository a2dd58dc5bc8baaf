//! Mugs: a turned body and an ear in front.

use super::curve::Corner;
use super::ear::{self, Ear};
use super::lathe::{self, Columns, Profile};
use super::model::{Drawing, Opening, PartBox};
use super::shell::{Hole, Part, Shell};

/// All mugs.
pub fn all() -> Vec<Drawing> {
    vec![coffee()]
}

/// How a mug is put together.
struct Mug<'a> {
    name: &'static str,
    /// (radius, z, rounding) from the middle of the base over the rim to the middle of the floor.
    profile: &'a [Corner],
    spacing: f64,
    /// Columns around the body beside those under the ear.
    columns: usize,
    /// Half the angle that the ear's foot takes, and its columns.
    foot: (f64, usize),
    /// Heights of the ear's upper and lower foot, and rows in each.
    feet: [[f64; 2]; 2],
    foot_rows: usize,
    ear: Ear<'a>,
    section: &'a dyn Fn(f64, f64, f64) -> [f64; 2],
    opening: Opening,
    material: &'static str,
    density: f64,
    least_thickness: f64,
}

fn draw(mug: &Mug) -> Drawing {
    let mut profile = Profile::new(mug.profile, mug.spacing);
    for [low, high] in mug.feet {
        profile = profile.with_rows(low, high, mug.foot_rows);
    }
    let (half_angle, m) = mug.foot;
    let columns = Columns::with_front(mug.columns, half_angle, m);
    let mut shell = Shell::new(Part::Body);
    let rings = lathe::turn(&mut shell, &profile, &columns, mug.section);
    let [top, bottom] = mug.feet.map(|[low, _]| {
        let row = profile.row(low);
        Hole {
            rows: row..row + mug.foot_rows,
            columns: Columns::front(mug.columns, m),
        }
    });
    shell.weave(&rings, &[top.clone(), bottom.clone()]);
    lathe::close(&mut shell, &profile, &rings);
    let body = PartBox::around(&shell.points, 0.2);
    let handle = ear::grow(&mut shell, &rings, &top, &bottom, &mug.ear);
    Drawing {
        kind: "mug",
        name: mug.name,
        shell,
        densities: [mug.density; 3],
        material: mug.material,
        opening: Some(mug.opening),
        handle,
        functional: vec![body],
        sharp: vec![],
        least_thickness: mug.least_thickness,
    }
}

/// A stoneware mug, straight, with a C-shaped ear.
fn coffee() -> Drawing {
    draw(&Mug {
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
        foot: (0.19, 6),
        feet: [[70.0, 82.0], [22.0, 34.0]],
        foot_rows: 4,
        ear: Ear {
            path: &[Corner(72.0, 80.0, 26.0), Corner(70.0, 28.0, 24.0)],
            sections: 26,
            half: [[7.2, 5.6], [5.8, 4.3], [7.0, 5.4]],
            power: 2.4,
        },
        section: &lathe::round,
        opening: Opening {
            z: 96.0,
            radius: 36.8,
        },
        material: "glass",
        density: 2350.0,
        least_thickness: 3.6,
    })
}
