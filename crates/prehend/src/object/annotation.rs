//! The `NAME.toml` beside a mesh.

use nalgebra::{Matrix3, Rotation3, Vector3};
use serde::{Deserialize, Deserializer};

use crate::Error;

/// What a person says about a mesh; vectors and boxes in the file's own axes and units.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Annotation {
    /// `mug`, `hammer`, ….
    #[serde(rename = "type")]
    pub kind: Option<String>,
    /// Metres per unit of the file.
    pub metres_per_unit: Option<f64>,
    /// Direction that becomes +z.
    pub up: Option<[f64; 3]>,
    /// Direction that becomes +x.
    pub front: Option<[f64; 3]>,
    /// Mass, kg.
    pub mass: Option<f64>,
    /// Centre of mass.
    pub center_of_mass: Option<[f64; 3]>,
    /// Name in the friction table.
    pub material: Option<String>,
    /// The rim that liquid passes.
    pub opening: Option<Rim>,
    /// Where a user holds it.
    #[serde(default, deserialize_with = "one_or_many")]
    pub handle: Vec<PartBox>,
    /// What does the work: head, blade, tip, body.
    #[serde(default, deserialize_with = "one_or_many")]
    pub functional: Vec<PartBox>,
    /// What cuts.
    #[serde(default, deserialize_with = "one_or_many")]
    pub sharp: Vec<PartBox>,
}

/// A disc: the opening of a vessel.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rim {
    /// Centre.
    pub center: [f64; 3],
    /// Direction out of the vessel.
    pub normal: [f64; 3],
    /// Radius.
    pub radius: f64,
}

/// A box that cuts a part out of the surface.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PartBox {
    /// Centre.
    pub center: [f64; 3],
    /// Three unit rows; the file's axes where missing.
    pub axes: Option<[[f64; 3]; 3]>,
    /// Full lengths.
    pub extents: [f64; 3],
}

impl PartBox {
    pub(super) fn rotation(&self) -> Rotation3<f64> {
        let axes = self
            .axes
            .unwrap_or([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        Rotation3::from_matrix_unchecked(Matrix3::from_columns(&axes.map(|a| Vector3::from(a).normalize())))
    }

    fn check(&self, part: &str) -> Result<(), Error> {
        let columns = *self.rotation().matrix();
        let skew = (columns.transpose() * columns - Matrix3::identity()).abs().max();
        if !(skew < 1e-6 && columns.determinant() > 0.0) {
            return Err(Error::input(format!(
                "[[{part}]] axes {:?}: expected three right-handed, perpendicular unit rows",
                self.axes
            )));
        }
        Ok(())
    }
}

impl Annotation {
    /// Reads the annotation's text.
    ///
    /// # Errors
    ///
    /// Names the line or key, what was found, and what was expected.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let annotation: Self = toml::from_str(text).map_err(Error::input)?;
        let positive = |key: &str, value: Option<f64>| match value {
            Some(v) if !(v.is_finite() && v > 0.0) => {
                Err(Error::input(format!("{key} = {v}: expected a positive number")))
            }
            _ => Ok(()),
        };
        positive("metres_per_unit", annotation.metres_per_unit)?;
        positive("mass", annotation.mass)?;
        positive(
            "opening.radius",
            annotation.opening.as_ref().map(|rim| rim.radius),
        )?;
        let normal = annotation.opening.as_ref().map(|rim| rim.normal);
        for (key, vector) in [
            ("up", annotation.up),
            ("front", annotation.front),
            ("opening.normal", normal),
        ] {
            if let Some(v) = vector
                && !Vector3::from(v)
                    .try_normalize(1e-9)
                    .is_some_and(|n| n.iter().all(|c| c.is_finite()))
            {
                return Err(Error::input(format!(
                    "{key} = {v:?}: expected a direction, not a zero or infinite vector"
                )));
            }
        }
        // Where nothing is said, up is the file's +z.
        let up = annotation.up.unwrap_or([0.0, 0.0, 1.0]);
        if let Some(front) = annotation.front
            && Vector3::from(up)
                .normalize()
                .cross(&Vector3::from(front).normalize())
                .norm()
                < 1e-3
        {
            return Err(Error::input(format!(
                "front = {front:?} is parallel to up = {up:?}; expected two different directions"
            )));
        }
        for (part, boxes) in [
            ("handle", &annotation.handle),
            ("functional", &annotation.functional),
            ("sharp", &annotation.sharp),
        ] {
            boxes.iter().try_for_each(|b| b.check(part))?;
        }
        Ok(annotation)
    }
}

/// Accepts `[handle]` as well as `[[handle]]`.
fn one_or_many<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<PartBox>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum OneOrMany {
        One(PartBox),
        Many(Vec<PartBox>),
    }
    Ok(match OneOrMany::deserialize(deserializer)? {
        OneOrMany::One(part) => vec![part],
        OneOrMany::Many(parts) => parts,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_values_are_named() {
        for (text, message) in [
            (
                "metres_per_unit = -1.0",
                "metres_per_unit = -1: expected a positive number",
            ),
            (
                "up = [0, 0, 0]",
                "up = [0.0, 0.0, 0.0]: expected a direction, not a zero or infinite vector",
            ),
            (
                "front = [0,0,-1]",
                "front = [0.0, 0.0, -1.0] is parallel to up = [0.0, 0.0, 1.0]; expected two different directions",
            ),
            (
                "up = [0,0,1]\nfront = [0,0,2]",
                "front = [0.0, 0.0, 2.0] is parallel to up = [0.0, 0.0, 1.0]; expected two different directions",
            ),
        ] {
            assert_eq!(Annotation::parse(text).unwrap_err().to_string(), message);
        }
        assert!(
            Annotation::parse("colour = 1")
                .unwrap_err()
                .to_string()
                .contains("colour")
        );
    }

    #[test]
    fn a_part_may_be_one_box_or_several() {
        let one = Annotation::parse("[handle]\ncenter = [0,0,0]\nextents = [1,1,1]").unwrap();
        let many = Annotation::parse("[[handle]]\ncenter = [0,0,0]\nextents = [1,1,1]\n[[handle]]\ncenter = [1,0,0]\nextents = [1,1,1]").unwrap();
        assert_eq!((one.handle.len(), many.handle.len()), (1, 2));
    }
}
