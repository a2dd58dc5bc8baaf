//! One bundled object: its surface and what its description says.

use super::mass;
use super::shell::{Part, Ring, Shell};
use nalgebra::Point3;

/// Box along the axes, in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartBox {
    /// Middle.
    pub center: [f64; 3],
    /// Full lengths.
    pub extents: [f64; 3],
}

impl PartBox {
    /// Smallest box around `points`, a little wider so that they lie inside.
    pub fn around<'a>(points: impl IntoIterator<Item = &'a Point3<f64>>, slack: f64) -> Self {
        let (mut low, mut high) = ([f64::MAX; 3], [f64::MIN; 3]);
        for point in points {
            for k in 0..3 {
                low[k] = low[k].min(point[k]);
                high[k] = high[k].max(point[k]);
            }
        }
        Self {
            center: std::array::from_fn(|k| 0.5 * (low[k] + high[k])),
            extents: std::array::from_fn(|k| high[k] - low[k] + 2.0 * slack),
        }
    }

    /// Whether `point` lies inside.
    #[cfg(test)]
    pub fn contains(&self, point: &Point3<f64>) -> bool {
        (0..3).all(|k| (point[k] - self.center[k]).abs() <= 0.5 * self.extents[k])
    }

    fn scaled(&self, factor: f64) -> Self {
        Self {
            center: self.center.map(|v| v * factor),
            extents: self.extents.map(|v| v * factor),
        }
    }
}

/// Disc of a vessel's rim, in the plane z = `z`, about the z axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Opening {
    /// Height of the rim.
    pub z: f64,
    /// Inner radius.
    pub radius: f64,
}

/// A finished object in metres, top to +z, front to +x.
#[derive(Debug, Clone)]
pub struct Model {
    /// Folder under `objects/`.
    pub kind: &'static str,
    /// File name without extension.
    pub name: &'static str,
    /// Surface.
    pub shell: Shell,
    /// Kilograms.
    pub mass: f64,
    /// Centre of mass of the solid.
    pub center_of_mass: [f64; 3],
    /// Word for the friction table.
    pub material: &'static str,
    /// Rim of a vessel.
    pub opening: Option<Opening>,
    /// Where it is meant to be held.
    pub handle: Vec<PartBox>,
    /// What it is for.
    pub functional: Vec<PartBox>,
    /// What cuts.
    pub sharp: Vec<PartBox>,
    /// Thinnest place that the design has, measured along inward normals.
    #[cfg_attr(not(test), expect(dead_code, reason = "only the tests measure it"))]
    pub least_thickness: f64,
}

/// An object as it is drawn: in millimetres, with a density for each part.
#[derive(Debug)]
pub struct Drawing {
    /// Folder under `objects/`.
    pub kind: &'static str,
    /// File name without extension.
    pub name: &'static str,
    /// Surface.
    pub shell: Shell,
    /// kg/m³ of body, handle and functional part.
    pub densities: [f64; 3],
    /// Word for the friction table.
    pub material: &'static str,
    /// Rim of a vessel.
    pub opening: Option<Opening>,
    /// Where it is meant to be held.
    pub handle: Vec<PartBox>,
    /// What it is for.
    pub functional: Vec<PartBox>,
    /// What cuts.
    pub sharp: Vec<PartBox>,
    /// Thinnest place that the design has.
    pub least_thickness: f64,
}

impl Drawing {
    /// Scales to metres and rounds every coordinate to 0.1 µm, so that the last bits of a platform's sine do not
    /// show in the files.
    pub fn finish(self) -> Model {
        let mut shell = self.shell;
        shell.drop_unused();
        for point in &mut shell.points {
            *point = point.map(|v| (v * 1e4).round() / 1e7 + 0.0);
        }
        let [body, handle, functional] = self.densities;
        let (mass, center) = mass::mass_and_center(&shell, |part| match part {
            Part::Body => body,
            Part::Handle => handle,
            Part::Functional => functional,
        });
        let metres = |boxes: Vec<PartBox>| boxes.iter().map(|part| part.scaled(1e-3)).collect();
        Model {
            kind: self.kind,
            name: self.name,
            shell,
            mass,
            center_of_mass: center.coords.into(),
            material: self.material,
            opening: self.opening.map(|o| Opening {
                z: o.z * 1e-3,
                radius: o.radius * 1e-3,
            }),
            handle: metres(self.handle),
            functional: metres(self.functional),
            sharp: metres(self.sharp),
            least_thickness: self.least_thickness * 1e-3,
        }
    }
}

/// Boxes along a run of rings, `pieces` of them, each around its rings and sharing the ring between with its neighbour.
pub fn boxes_along(shell: &Shell, rings: &[Ring], pieces: usize) -> Vec<PartBox> {
    let spans = rings.len() - 1;
    (0..pieces)
        .map(|piece| {
            let (from, to) = (piece * spans / pieces, (piece + 1) * spans / pieces);
            PartBox::around(
                rings[from..=to].iter().flatten().map(|&idx| &shell.points[idx]),
                0.2,
            )
        })
        .collect()
}
