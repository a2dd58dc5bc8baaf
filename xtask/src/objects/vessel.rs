//! Vessels: a turned wall, open at the top, with or without an ear in front.

use super::curve::Corner;
use super::ear::{self, Ear};
use super::lathe::{self, Columns, Profile};
use super::model::{Drawing, Opening, PartBox};
use super::shell::{Hole, Part, Shell};

/// How a vessel is put together.
pub struct Vessel<'a> {
    /// Folder under `objects/`.
    pub kind: &'static str,
    /// File name without extension.
    pub name: &'static str,
    /// (radius, z, rounding) from the middle of the base over the rim to the middle of the floor.
    pub profile: &'a [Corner],
    /// Largest distance between rows.
    pub spacing: f64,
    /// Columns around the wall, beside those under the ear.
    pub columns: usize,
    /// Outline at (angle, radius, z) as x and y.
    pub section: &'a dyn Fn(f64, f64, f64) -> [f64; 2],
    /// The ear and where it stands.
    pub ear: Option<(Feet, Ear<'a>)>,
    /// Word for the friction table.
    pub material: &'static str,
    /// kg/m³.
    pub density: f64,
    /// Thinnest place that the design has.
    pub least_thickness: f64,
}

/// Where an ear meets the wall.
pub struct Feet {
    /// Half the angle that each foot takes, and its columns.
    pub half_angle: f64,
    /// Columns under each foot.
    pub columns: usize,
    /// Lower and upper end of the upper and the lower foot.
    pub heights: [[f64; 2]; 2],
    /// Rows under each foot.
    pub rows: usize,
}

/// Weaves the vessel.
pub fn draw(vessel: &Vessel) -> Drawing {
    let mut profile = Profile::new(vessel.profile, vessel.spacing);
    let rim = vessel
        .profile
        .iter()
        .map(|corner| corner.1)
        .fold(f64::MIN, f64::max);
    let mouth = vessel
        .profile
        .iter()
        .rev()
        .find(|corner| corner.1 == rim)
        .expect("a profile has a rim");
    let opening = Some(Opening {
        z: rim,
        radius: mouth.0,
    });
    let columns = match &vessel.ear {
        None => Columns::even(vessel.columns),
        Some((feet, _)) => {
            for [low, high] in feet.heights {
                profile = profile.with_rows(low, high, feet.rows);
            }
            Columns::with_front(vessel.columns, feet.half_angle, feet.columns)
        }
    };
    let mut shell = Shell::new(Part::Body);
    let rings = lathe::turn(&mut shell, &profile, &columns, vessel.section);
    let holes: Vec<Hole> = vessel.ear.as_ref().map_or(vec![], |(feet, _)| {
        let columns = Columns::front(vessel.columns, feet.columns);
        let row = |low| profile.row(low);
        feet.heights
            .iter()
            .map(|&[low, _]| Hole {
                rows: row(low)..row(low) + feet.rows,
                columns: columns.clone(),
            })
            .collect()
    });
    shell.weave(&rings, &holes);
    lathe::close(&mut shell, &profile, &rings);
    let body = PartBox::around(&shell.points, 0.2);
    let handle = vessel.ear.as_ref().map_or(vec![], |(_, ear)| {
        ear::grow(&mut shell, &rings, &holes[0], &holes[1], ear)
    });
    Drawing {
        kind: vessel.kind,
        name: vessel.name,
        shell,
        densities: [vessel.density; 3],
        material: vessel.material,
        opening,
        handle,
        functional: vec![body],
        sharp: vec![],
        least_thickness: vessel.least_thickness,
    }
}
