//! Materials, and the friction between each two of them.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::QualityError;

/// What a link or an object is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Material {
    /// Glass and glazed ceramics.
    Glass,
    /// Metal.
    Metal,
    /// Hard plastic.
    Plastic,
    /// Wood.
    Wood,
    /// Rubber: soft, its contacts carry torsion.
    Rubber,
    /// Stone.
    Stone,
}

impl Material {
    /// Every material, in the order of the friction table.
    pub const ALL: [Self; 6] = [
        Self::Glass,
        Self::Metal,
        Self::Plastic,
        Self::Wood,
        Self::Rubber,
        Self::Stone,
    ];

    /// The lower-case name that files use.
    pub fn name(self) -> &'static str {
        ["glass", "metal", "plastic", "wood", "rubber", "stone"][self as usize]
    }

    /// Whether its contacts are soft, that is, carry torsion. Only rubber's do.
    pub fn is_soft(self) -> bool {
        self == Self::Rubber
    }
}

/// Static friction coefficient between two materials; symmetric.
///
/// Source: the table that GraspIt! uses by default (`docs/references.md`).
///
/// ```
/// use prehend_quality::{Material, friction_coefficient};
/// assert_eq!(friction_coefficient(Material::Rubber, Material::Glass), 1.0);
/// assert_eq!(friction_coefficient(Material::Plastic, Material::Plastic), 0.3);
/// ```
pub fn friction_coefficient(a: Material, b: Material) -> f64 {
    STATIC_FRICTION[a as usize][b as usize]
}

/// Rows and columns: glass, metal, plastic, wood, rubber, stone.
const STATIC_FRICTION: [[f64; 6]; 6] = [
    [0.2, 0.2, 0.2, 0.3, 1.0, 0.3],
    [0.2, 0.2, 0.2, 0.3, 1.0, 0.4],
    [0.2, 0.2, 0.3, 0.4, 1.0, 0.4],
    [0.3, 0.3, 0.4, 0.4, 1.0, 0.6],
    [1.0, 1.0, 1.0, 1.0, 2.0, 1.5],
    [0.3, 0.4, 0.4, 0.6, 1.5, 0.7],
];

impl FromStr for Material {
    type Err = QualityError;

    fn from_str(name: &str) -> Result<Self, QualityError> {
        Self::ALL
            .into_iter()
            .find(|m| m.name() == name)
            .ok_or_else(|| QualityError::UnknownMaterial {
                found: name.to_owned(),
            })
    }
}

impl std::fmt::Display for Material {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_symmetric() {
        for a in Material::ALL {
            for b in Material::ALL {
                assert_eq!(
                    friction_coefficient(a, b),
                    friction_coefficient(b, a),
                    "{a} on {b}"
                );
            }
        }
    }

    #[test]
    fn names_read_back() {
        for material in Material::ALL {
            assert_eq!(material.name().parse(), Ok(material));
            assert_eq!(
                serde_json::to_string(&material).unwrap(),
                format!("\"{material}\"")
            );
        }
        assert_eq!(
            "ruber".parse::<Material>().unwrap_err().to_string(),
            "`ruber` is not a material; expected glass, metal, plastic, wood, rubber or stone"
        );
    }
}
