//! The grasp wrench space: everything that the contacts can do to the object.

use std::ops::Range;

use crate::coordinates::Coordinates;
use crate::friction_cone::{ContactWrenches, Shape, fill_circle, torque_bound};
use crate::hyperplane::dot;
use crate::{ConeShape, Contact, Norm, QualityError, QualityOptions, Wrench};

/// The convex set of wrenches that the contacts can exert, seen through its support function.
///
/// With [`Norm::L1`] it is the hull of the union of the contacts' wrenches (the origin is not added), with
/// [`Norm::LInf`] the Minkowski sum over the contacts i of conv({0} ∪ Wᵢ), whose support is Σᵢ max(0, hᵢ). Neither hull
/// is ever listed. hᵢ, the support of one contact, is the largest n · w over its edges or samples, or for a smooth
/// cone n · c + |Aᵀ n|, c its centre and A its two or three axes.
///
/// With [`QualityOptions::axes`] it is the projection on the axes that count, the other coordinates being 0.
#[derive(Debug, Clone, PartialEq)]
pub struct GraspWrenchSpace {
    wrenches: Vec<Wrench>,
    coordinates: Coordinates,
    norm: Norm,
    largest_norm: f64,
    largest_force: f64,
    torque_bound: f64,
    /// The listed wrenches' coordinates divided by `largest_norm`, contact by contact.
    blocks: Vec<Block>,
    balls: Vec<Ball>,
    parts: Vec<Part>,
    /// Sum of all wrenches' scaled coordinates: where most of them push.
    sum: [f64; 6],
    circle: Vec<[f64; 2]>,
}

/// Eight wrenches, one row per coordinate. The last block of a contact is filled up with its first wrench.
#[derive(Debug, Clone, PartialEq)]
struct Block([[f64; LANES]; 6]);

const LANES: usize = 8;

/// A smooth contact in scaled coordinates.
#[derive(Debug, Clone, PartialEq)]
struct Ball {
    center: [f64; 6],
    axes: [[f64; 6]; 3],
}

/// Where one contact's wrenches are.
#[derive(Debug, Clone, PartialEq)]
enum Part {
    Blocks(Range<usize>),
    Ball(usize),
}

impl GraspWrenchSpace {
    /// The wrenches of `contacts`; see [`QualityOptions`] for the frame and units.
    ///
    /// # Errors
    ///
    /// [`QualityError::NoContacts`]; a bad contact's error, naming it; a bad option's error; and
    /// [`QualityError::WrenchOverflow`] where finite inputs make an infinite wrench.
    pub fn new(contacts: &[Contact], options: &QualityOptions) -> Result<Self, QualityError> {
        let mut space = Self {
            wrenches: Vec::new(),
            coordinates: Coordinates::new(options.axes, options.metric.as_ref())?,
            norm: options.norm,
            largest_norm: 1.0,
            largest_force: 0.0,
            torque_bound: 0.0,
            blocks: Vec::new(),
            balls: Vec::new(),
            parts: Vec::new(),
            sum: [0.0; 6],
            circle: Vec::new(),
        };
        space.fill(contacts, options)?;
        Ok(space)
    }

    /// Makes this the space of other contacts, in the memory that it has. After an error it must be filled again.
    pub(crate) fn fill(
        &mut self,
        contacts: &[Contact],
        options: &QualityOptions,
    ) -> Result<(), QualityError> {
        options.check()?;
        if contacts.is_empty() {
            return Err(QualityError::NoContacts);
        }
        self.coordinates = Coordinates::new(options.axes, options.metric.as_ref())?;
        self.norm = options.norm;
        self.wrenches.clear();
        self.blocks.clear();
        self.balls.clear();
        self.parts.clear();
        self.torque_bound = 0.0;
        let n_edges = match options.cone {
            ConeShape::Edges(n) => n,
            ConeShape::Smooth => 0,
        };
        if self.circle.len() != n_edges {
            fill_circle(n_edges, &mut self.circle);
        }
        let mut largest_squared = 0.0_f64;
        for (contact_idx, contact) in contacts.iter().enumerate() {
            contact.check(contact_idx)?;
            let wrenches = ContactWrenches::new(contact, options);
            let first = self.wrenches.len();
            // The square bound keeps every dot product below in range.
            let squared = match wrenches.shape(options) {
                Shape::Listed => {
                    wrenches.list(&self.circle, options.length_unit, &mut self.wrenches);
                    self.push_blocks(first)
                }
                Shape::Ball { center, axes } => {
                    self.wrenches.push(center);
                    self.wrenches.extend(axes.map(|a| center + a));
                    self.push_ball(&center, &axes)
                }
            };
            if !squared.is_finite() {
                return Err(QualityError::WrenchOverflow { contact_idx });
            }
            largest_squared = largest_squared.max(squared);
            let bound = torque_bound(contact, &options.center, options.torque_scale);
            self.torque_bound = self.torque_bound.max(bound);
        }
        let largest_norm = largest_squared.sqrt();
        self.largest_norm = if largest_norm > 0.0 { largest_norm } else { 1.0 };
        self.largest_force = self
            .wrenches
            .iter()
            .map(|w| w.fixed_rows::<3>(0).norm())
            .fold(0.0, f64::max);
        self.scale();
        Ok(())
    }

    /// Stores the wrenches from `first` on as blocks; returns the largest squared norm, infinite where one is not finite.
    fn push_blocks(&mut self, first: usize) -> f64 {
        let start = self.blocks.len();
        let mut largest = 0.0_f64;
        let listed = &self.wrenches[first..];
        for chunk in listed.chunks(LANES) {
            let mut block = Block([[0.0; LANES]; 6]);
            for lane in 0..LANES {
                let point = self.coordinates.of(chunk.get(lane).unwrap_or(&listed[0]));
                let squared = dot(&point, &point);
                largest = if squared.is_finite() {
                    largest.max(squared)
                } else {
                    f64::INFINITY
                };
                for k in 0..6 {
                    block.0[k][lane] = point[k];
                }
            }
            self.blocks.push(block);
        }
        self.parts.push(Part::Blocks(start..self.blocks.len()));
        largest
    }

    /// Stores a smooth contact; returns a bound of its wrenches' squared norm.
    fn push_ball(&mut self, center: &Wrench, axes: &[Wrench; 3]) -> f64 {
        let ball = Ball {
            center: self.coordinates.of(center),
            axes: axes.map(|a| self.coordinates.of(&a)),
        };
        let reach: f64 = ball.axes.iter().map(|a| dot(a, a)).sum();
        let bound = dot(&ball.center, &ball.center).sqrt() + reach.sqrt();
        self.parts.push(Part::Ball(self.balls.len()));
        self.balls.push(ball);
        let squared = bound * bound;
        if squared.is_finite() {
            squared
        } else {
            f64::INFINITY
        }
    }

    /// Divides everything stored by `largest_norm`.
    fn scale(&mut self) {
        let size = self.largest_norm;
        self.sum = [0.0; 6];
        for block in &mut self.blocks {
            for k in 0..6 {
                for c in &mut block.0[k] {
                    *c /= size;
                    self.sum[k] += *c;
                }
            }
        }
        for ball in &mut self.balls {
            ball.center = ball.center.map(|c| c / size);
            ball.axes = ball.axes.map(|a| a.map(|c| c / size));
            for k in 0..6 {
                self.sum[k] += LANES as f64 * ball.center[k];
            }
        }
    }

    /// Wrenches of the space, contact by contact: all edges and samples; of a smooth contact its pure normal force and
    /// three more, which span the same.
    pub fn wrenches(&self) -> &[Wrench] {
        &self.wrenches
    }

    /// Norm of the longest wrench, by [`QualityOptions::metric`] over the axes that count (a bound of it where a contact
    /// is smooth). Positive.
    pub fn largest_norm(&self) -> f64 {
        self.largest_norm
    }

    /// Whether the space has finitely many corners, so that ε is known exactly.
    pub fn is_polyhedral(&self) -> bool {
        self.balls.is_empty()
    }

    /// How far the space reaches along `direction`, max over its points w of direction · w, and such a point.
    /// Ties take the first wrench. `direction` should be finite.
    pub fn support(&self, direction: &Wrench) -> (f64, Wrench) {
        let (value, point) = self.scaled_support(&self.coordinates.of_direction(direction));
        (
            value * self.largest_norm,
            self.coordinates.wrench(&point) * self.largest_norm,
        )
    }

    /// How many axes count.
    pub(crate) fn n_axes(&self) -> usize {
        self.coordinates.n_axes()
    }

    pub(crate) fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    /// [`Self::support`] in coordinates divided by [`Self::largest_norm`].
    pub(crate) fn scaled_support(&self, direction: &[f64; 6]) -> (f64, [f64; 6]) {
        match self.norm {
            Norm::L1 => {
                let mut best = best_in(&self.blocks, direction);
                for ball in &self.balls {
                    let (value, point) = ball.support(direction);
                    if value > best.0 {
                        best = (value, point);
                    }
                }
                best
            }
            Norm::LInf => {
                let mut sum = [0.0; 6];
                for part in &self.parts {
                    let (value, point) = match part {
                        Part::Blocks(range) => best_in(&self.blocks[range.clone()], direction),
                        Part::Ball(idx) => self.balls[*idx].support(direction),
                    };
                    if value > 0.0 {
                        for k in 0..6 {
                            sum[k] += point[k];
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
            Norm::LInf => self.parts.len() as f64,
        }
    }

    /// Sum of the scaled wrenches.
    pub(crate) fn scaled_sum(&self) -> &[f64; 6] {
        &self.sum
    }

    /// Force and torque sizes that the rank is judged by.
    pub(crate) fn block_sizes(&self) -> (f64, f64) {
        (self.largest_force, self.torque_bound)
    }
}

impl Ball {
    fn support(&self, direction: &[f64; 6]) -> (f64, [f64; 6]) {
        let along = self.axes.map(|a| dot(&a, direction));
        let length = dot(&along, &along).sqrt();
        let mut point = self.center;
        if length > 0.0 {
            for (axis, along) in self.axes.iter().zip(along) {
                for k in 0..6 {
                    point[k] += axis[k] * (along / length);
                }
            }
        }
        (dot(direction, &point), point)
    }
}

/// The largest dot product in the blocks, and the first wrench that has it.
fn best_in(blocks: &[Block], d: &[f64; 6]) -> (f64, [f64; 6]) {
    let mut best = (f64::NEG_INFINITY, 0);
    for (idx, block) in blocks.iter().enumerate() {
        let values = block.dots(d);
        let mut most = values;
        for half in [LANES / 2, LANES / 4, LANES / 8] {
            for lane in 0..half {
                most[lane] = if most[lane + half] > most[lane] {
                    most[lane + half]
                } else {
                    most[lane]
                };
            }
        }
        if most[0] > best.0 {
            best = (most[0], idx);
        }
    }
    let Some(block) = blocks.get(best.1) else {
        return (f64::NEG_INFINITY, [0.0; 6]);
    };
    let lane = block.dots(d).iter().position(|&v| v == best.0).unwrap_or(0);
    (best.0, std::array::from_fn(|k| block.0[k][lane]))
}

impl Block {
    fn dots(&self, d: &[f64; 6]) -> [f64; LANES] {
        let mut sums = [0.0; LANES];
        for lane in 0..LANES {
            let [a, b, c, e, f, g] = std::array::from_fn(|k| d[k] * self.0[k][lane]);
            sums[lane] = (a + c + f) + (b + e + g);
        }
        sums
    }
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
    fn a_smooth_cone_reaches_as_far_as_any_number_of_edges() {
        let point = Point3::new(0.03, -0.02, 0.05);
        let contact = Contact::new(0, point, Vector3::new(1.0, 2.0, -0.5), 0.7, 0.0).unwrap();
        let space = |cone| {
            let options = QualityOptions {
                cone,
                gravity: Vector3::new(0.0, 0.1, 0.5),
                ..QualityOptions::new(Point3::origin(), 0.1)
            };
            GraspWrenchSpace::new(&[contact], &options).unwrap()
        };
        let (smooth, edged) = (space(ConeShape::Smooth), space(ConeShape::Edges(1024)));
        assert!(edged.is_polyhedral() && !smooth.is_polyhedral());
        for k in 0..50 {
            let d = Wrench::from_fn(|i, _| (1.7 * f64::from(k) + 2.3 * i as f64).sin());
            let (round, straight) = (smooth.support(&d).0, edged.support(&d).0);
            // An edge every 2π/1024: short of the circle by at most μ |d| |arm| (1 − cos(π/1024)).
            assert!(round >= straight - 1e-12 && round - straight < 3e-5);
        }
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
