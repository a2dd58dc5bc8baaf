//! Spherical maps over an object, drawn: six views and two equal-area discs a task.

use crate::picture::Picture;

/// Titles of the two discs.
pub const DISC_TITLES: [&str; 2] = ["upper half", "lower half"];

/// The maps of one object, drawn.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SphereSheet {
    /// The object as seen in each of [`crate::View::SIX`], on a transparent ground, to lie over the maps.
    pub object: Vec<Picture>,
    /// One row a map.
    pub rows: Vec<SphereRow>,
}

/// One map, drawn, and what it says in numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SphereRow {
    /// The task.
    pub task: String,
    /// The density on the half of the sphere that each of [`crate::View::SIX`] sees.
    pub views: Vec<Picture>,
    /// Lambert equal-area discs of the upper half seen from above, and of the lower half seen from below.
    pub discs: Vec<Picture>,
    /// Largest density over the uniform one.
    pub peak: f64,
    /// Where it is: a unit vector in the object's frame.
    pub peak_direction: [f64; 3],
    /// Smallest share of the sphere that holds half of the probability.
    pub area_of_half: f64,
    /// Smallest share of the sphere that holds nine tenths of it.
    pub area_of_nine_tenths: f64,
    /// Probability of z > 0.
    pub above: f64,
    /// Probability of x > 0.
    pub in_front: f64,
}
