//! The grasp wrench space: everything that the contacts can do to the object.

use std::ops::Range;

use crate::friction_cone::{n_wrenches, push_wrenches, torque_bound};
use crate::{Contact, Norm, QualityError, QualityOptions, Wrench};

/// The convex set of wrenches that the contacts can exert, seen through its support function.
///
/// With [`Norm::L1`] it is the hull of all wrenches (the origin is not added), with [`Norm::LInf`] the Minkowski sum
/// over the contacts i of conv({0} ∪ {w_ij}), whose support is Σᵢ max(0, maxⱼ n · w_ij). Neither hull is ever listed.
#[derive(Debug, Clone, PartialEq)]
pub struct GraspWrenchSpace {
    wrenches: Vec<Wrench>,
    /// Which wrenches are whose, contact by contact.
    of_contact: Vec<Range<usize>>,
    norm: Norm,
    largest_norm: f64,
    largest_force: f64,
    torque_bound: f64,
    /// The wrenches divided by `largest_norm`, one array per coordinate.
    scaled: [Vec<f64>; 6],
}

impl GraspWrenchSpace {
    /// The wrenches of `contacts`; see [`QualityOptions`] for the frame and units.
    ///
    /// # Errors
    ///
    /// [`QualityError::NoContacts`]; a bad contact's error, naming it; a bad option's error; and
    /// [`QualityError::WrenchOverflow`] where finite inputs make an infinite wrench.
    pub fn new(contacts: &[Contact], options: &QualityOptions) -> Result<Self, QualityError> {
        options.check()?;
        if contacts.is_empty() {
            return Err(QualityError::NoContacts);
        }
        let n_all = contacts.iter().map(|c| n_wrenches(c, options.cone_edges)).sum();
        let mut wrenches = Vec::with_capacity(n_all);
        let mut of_contact = Vec::with_capacity(contacts.len());
        let mut largest_torque = 0.0_f64;
        for (contact_idx, contact) in contacts.iter().enumerate() {
            contact.check(contact_idx)?;
            let first = wrenches.len();
            push_wrenches(contact, options, &mut wrenches);
            // The square bound keeps every dot product below in range.
            if !wrenches[first..].iter().all(|w| w.norm_squared().is_finite()) {
                return Err(QualityError::WrenchOverflow { contact_idx });
            }
            of_contact.push(first..wrenches.len());
            largest_torque = largest_torque.max(torque_bound(contact, &options.center, options.torque_scale));
        }
        // At least 1, since every normal force is.
        let largest_norm = wrenches.iter().map(Wrench::norm).fold(0.0, f64::max);
        let largest_force = wrenches
            .iter()
            .map(|w| w.fixed_rows::<3>(0).norm())
            .fold(0.0, f64::max);
        let scaled = std::array::from_fn(|k| wrenches.iter().map(|w| w[k] / largest_norm).collect());
        let torque_bound = largest_torque;
        Ok(Self {
            wrenches,
            of_contact,
            norm: options.norm,
            largest_norm,
            largest_force,
            torque_bound,
            scaled,
        })
    }

    /// All wrenches, contact by contact.
    pub fn wrenches(&self) -> &[Wrench] {
        &self.wrenches
    }

    /// Norm of the longest wrench; at least 1.
    pub fn largest_norm(&self) -> f64 {
        self.largest_norm
    }

    /// How far the space reaches along `direction`, max over its points w of direction · w, and such a point.
    /// Ties take the first wrench. `direction` should be finite.
    pub fn support(&self, direction: &Wrench) -> (f64, Wrench) {
        let (value, point) = self.scaled_support(&(*direction).into());
        (value * self.largest_norm, Wrench::from(point) * self.largest_norm)
    }

    /// [`Self::support`] of the space divided by [`Self::largest_norm`].
    pub(crate) fn scaled_support(&self, direction: &[f64; 6]) -> (f64, [f64; 6]) {
        match self.norm {
            Norm::L1 => {
                let (value, idx) = self.best(direction, 0..self.wrenches.len());
                (value, self.scaled_wrench(idx))
            }
            Norm::LInf => {
                let mut sum = [0.0; 6];
                for range in &self.of_contact {
                    let (value, idx) = self.best(direction, range.clone());
                    if value > 0.0 {
                        let wrench = self.scaled_wrench(idx);
                        for k in 0..6 {
                            sum[k] += wrench[k];
                        }
                    }
                }
                (dot(direction, &sum), sum)
            }
        }
    }

    /// Size of the scaled space that rounding errors compare with: 1 for L₁, at most the number of contacts for L∞.
    pub(crate) fn scaled_size(&self) -> f64 {
        match self.norm {
            Norm::L1 => 1.0,
            Norm::LInf => self.of_contact.len() as f64,
        }
    }

    /// Force and torque sizes that the rank is judged by.
    pub(crate) fn block_sizes(&self) -> (f64, f64) {
        (self.largest_force, self.torque_bound)
    }

    fn scaled_wrench(&self, idx: usize) -> [f64; 6] {
        std::array::from_fn(|k| self.scaled[k][idx])
    }

    /// The largest dot product in a range, and the first wrench that has it.
    fn best(&self, d: &[f64; 6], range: Range<usize>) -> (f64, usize) {
        let first = range.start;
        let [a, b, c, e, f, g] = std::array::from_fn(|k| &self.scaled[k][range.clone()]);
        let mut best = (f64::NEG_INFINITY, first);
        let dots = a.iter().zip(b).zip(c).zip(e).zip(f).zip(g);
        for (i, (((((a, b), c), e), f), g)) in dots.enumerate() {
            let value = (d[0] * a + d[1] * b + d[2] * c) + (d[3] * e + d[4] * f + d[5] * g);
            if value > best.0 {
                best = (value, first + i);
            }
        }
        best
    }
}

pub(crate) fn dot(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) + (a[3] * b[3] + a[4] * b[4] + a[5] * b[5])
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Vector3};

    #[test]
    fn support_of_the_sum_counts_only_contacts_that_help() {
        let up = Contact::new(0, Point3::origin(), Vector3::z(), 0.0, 0.0).unwrap();
        let down = Contact::new(1, Point3::origin(), -Vector3::z(), 0.0, 0.0).unwrap();
        let options = QualityOptions {
            norm: Norm::LInf,
            ..QualityOptions::new(Point3::origin(), 1.0)
        };
        let space = GraspWrenchSpace::new(&[up, up, down], &options).unwrap();
        let z = Wrench::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0);
        assert_eq!(space.support(&z), (2.0, 2.0 * z));
        assert_eq!(space.support(&-z), (1.0, -z));
    }

    #[test]
    fn huge_points_are_an_error_that_names_the_contact() {
        let near = Contact::new(0, Point3::origin(), Vector3::z(), 0.5, 0.0).unwrap();
        let far = Contact::new(1, Point3::new(1e200, 0.0, 0.0), Vector3::z(), 0.5, 0.0).unwrap();
        let options = QualityOptions::new(Point3::origin(), 1.0);
        assert_eq!(
            GraspWrenchSpace::new(&[near, far], &options),
            Err(QualityError::WrenchOverflow { contact_idx: 1 })
        );
    }
}
