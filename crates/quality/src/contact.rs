//! One contact, with its friction.

use nalgebra::{Point3, UnitVector3, Vector3};
use prehend_geometry::ContactPoint;

use crate::QualityError;

/// Where a link touches the object, and what friction it has there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// The point and the unit normal into the object.
    pub at: ContactPoint,
    /// Coulomb friction coefficient, 0 or more; 0 makes the contact frictionless.
    pub mu: f64,
    /// Semi-axis e of the limit surface along torsion, a length in the unit of the points: the largest torsional
    /// moment is e times the largest tangential force. 0 makes a point contact.
    pub torsion: f64,
}

impl Contact {
    /// A contact from loose numbers; the normal may have any length but zero. `contact_idx` only serves the message.
    ///
    /// # Errors
    ///
    /// [`QualityError::BadPoint`], [`QualityError::BadNormal`], [`QualityError::BadFriction`] and
    /// [`QualityError::BadTorsion`], each naming `contact_idx`.
    pub fn new(
        contact_idx: usize,
        point: Point3<f64>,
        normal: Vector3<f64>,
        mu: f64,
        torsion: f64,
    ) -> Result<Self, QualityError> {
        // Divided by its largest component first, so that neither tiny nor huge normals leave the range of f64.
        let largest = normal.amax();
        if !normal.iter().all(|c| c.is_finite()) || largest == 0.0 {
            return Err(QualityError::BadNormal {
                contact_idx,
                normal: normal.into(),
            });
        }
        let normal = UnitVector3::new_normalize(normal / largest);
        let contact = Self {
            at: ContactPoint { point, normal },
            mu,
            torsion,
        };
        contact.check(contact_idx)?;
        Ok(contact)
    }

    /// Checks what the type cannot promise: finite numbers, a normal of unit length, no negative friction.
    pub(crate) fn check(&self, contact_idx: usize) -> Result<(), QualityError> {
        let ContactPoint { point, normal } = self.at;
        if !point.iter().all(|c| c.is_finite()) {
            return Err(QualityError::BadPoint {
                contact_idx,
                point: point.coords.into(),
            });
        }
        // `UnitVector3` can be made unchecked; written this way, NaN fails too.
        if (normal.norm() - 1.0).abs().partial_cmp(&1e-6) != Some(std::cmp::Ordering::Less) {
            return Err(QualityError::BadNormal {
                contact_idx,
                normal: normal.into_inner().into(),
            });
        }
        if !(self.mu.is_finite() && self.mu >= 0.0) {
            return Err(QualityError::BadFriction {
                contact_idx,
                mu: self.mu,
            });
        }
        if !(self.torsion.is_finite() && self.torsion >= 0.0) {
            return Err(QualityError::BadTorsion {
                contact_idx,
                torsion: self.torsion,
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_normal_of_any_length_becomes_a_unit_vector() {
        for length in [1e-300, 1.0, 1e300] {
            let contact =
                Contact::new(0, Point3::origin(), Vector3::new(0.0, length, 0.0), 0.5, 0.0).unwrap();
            assert_eq!(contact.at.normal.into_inner(), Vector3::y());
        }
    }

    #[test]
    fn bad_numbers_name_their_contact() {
        let z = Vector3::z();
        let origin = Point3::origin();
        assert_eq!(
            Contact::new(4, origin, Vector3::zeros(), 0.5, 0.0),
            Err(QualityError::BadNormal {
                contact_idx: 4,
                normal: [0.0; 3]
            })
        );
        assert!(matches!(
            Contact::new(2, origin, Vector3::new(f64::NAN, 0.0, 1.0), 0.5, 0.0),
            Err(QualityError::BadNormal { contact_idx: 2, .. })
        ));
        assert_eq!(
            Contact::new(1, origin, z, -0.1, 0.0),
            Err(QualityError::BadFriction {
                contact_idx: 1,
                mu: -0.1
            })
        );
        assert_eq!(
            Contact::new(7, origin, z, 0.1, f64::INFINITY),
            Err(QualityError::BadTorsion {
                contact_idx: 7,
                torsion: f64::INFINITY
            })
        );
        assert!(matches!(
            Contact::new(5, Point3::new(0.0, f64::NAN, 0.0), z, 0.1, 0.0),
            Err(QualityError::BadPoint { contact_idx: 5, .. })
        ));
    }
}
