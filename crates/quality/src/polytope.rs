//! A simplicial polytope in D dimensions that grows point by point.
//!
//! Beneath and beyond: a new point sees some facets; they go, and each ridge between a seen and an unseen facet spans
//! a new facet with the point. The plane of a new facet lies in the pencil of the two planes at its ridge,
//!
//! ```text
//! n ∝ h_s n_u − h_u n_s        (h: height of the point over the seen and the unseen plane, h_s > 0 ≥ h_u)
//! ```
//!
//! so a facet needs no linear solve, and many points in one plane (friction cones are full of them) do no harm: the
//! flat slivers that they make inherit a plane that is right. Facets live in one arena and name their neighbours
//! together with the slot that leads back, so nothing is searched for and nothing is hashed.

use crate::QualityError;
use crate::hyperplane::{Hyperplane, determinant, dot, sub, through_points};

/// Index of a facet and how often its place was reused, so that a stale one is recognised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct FacetId {
    place: u32,
    generation: u32,
}

/// The polytope. Cleared and filled again, it keeps its memory.
#[derive(Debug, Clone)]
pub(crate) struct Polytope<const D: usize> {
    points: Vec<[f64; D]>,
    facets: Vec<Facet<D>>,
    free: Vec<u32>,
    /// A point well inside.
    inside: [f64; D],
    /// How far over a plane a point must stand to see it.
    tolerance: f64,
    /// The insertion that looked at a facet last.
    stamps: Vec<u32>,
    round: u32,
    /// The first `n_seen` are the facets that see the point.
    seen: Vec<u32>,
    n_seen: usize,
    /// The first `n_horizon` are the ridges between seen and unseen facets: the seen side's slot, and the unseen's.
    horizon: Vec<(Link, Link)>,
    n_horizon: usize,
    created: Vec<FacetId>,
}

/// The two cache lines of a facet: its plane, and what it touches.
#[derive(Debug, Clone)]
#[repr(align(64))]
struct Facet<const D: usize> {
    plane: Hyperplane<D>,
    /// How high the point of the last insertion that looked here stood.
    height: f64,
    /// `neighbors[k]` lies across the ridge opposite `corners[k]`.
    neighbors: [Link; D],
    /// Indices of points.
    corners: [u16; D],
    generation: u32,
    alive: bool,
}

/// A facet and one of its slots, packed; one bit tells that the facet is new and replaces the owner of the link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Link(u32);

impl Link {
    const UNSET: Self = Self(u32::MAX >> 1);
    const FRESH: u32 = 1 << 31;

    fn new(place: u32, slot: usize) -> Self {
        Self(place << 3 | slot as u32)
    }

    fn fresh(place: u32) -> Self {
        Self(place << 3 | Self::FRESH)
    }

    fn is_fresh(self) -> bool {
        self.0 & Self::FRESH != 0
    }

    fn place(self) -> u32 {
        (self.0 & !Self::FRESH) >> 3
    }

    fn slot(self) -> usize {
        (self.0 & 7) as usize
    }
}

/// Corners are numbered by 16 bits, links hold places below 2²⁸.
const MOST_POINTS: usize = u16::MAX as usize;

impl<const D: usize> Default for Polytope<D> {
    fn default() -> Self {
        Self {
            points: Vec::new(),
            facets: Vec::new(),
            free: Vec::new(),
            inside: [0.0; D],
            tolerance: 0.0,
            stamps: Vec::new(),
            round: 0,
            seen: Vec::new(),
            n_seen: 0,
            horizon: Vec::new(),
            n_horizon: 0,
            created: Vec::new(),
        }
    }
}

impl<const D: usize> Polytope<D> {
    /// Starts again from a simplex of D + 1 points. `tolerance`: heights up to it count as on the plane.
    ///
    /// Returns false, and leaves no facets, where the simplex is too flat to have planes.
    pub(crate) fn reset(&mut self, simplex: &[[f64; D]], tolerance: f64) -> bool {
        self.points.clear();
        self.facets.clear();
        self.free.clear();
        self.stamps.clear();
        self.created.clear();
        self.points.extend_from_slice(simplex);
        self.inside =
            std::array::from_fn(|k| simplex.iter().map(|p| p[k]).sum::<f64>() / simplex.len() as f64);
        self.tolerance = tolerance;
        self.round = 0;
        let n_corners = simplex.len() as u16;
        // The boundary of a simplex takes alternating signs; with the swap all facets turn the same way.
        let corners_without = |left_out: u16| -> [u16; D] {
            let mut corners = std::array::from_fn(|i| i as u16 + u16::from(i as u16 >= left_out));
            if left_out % 2 == 1 {
                corners.swap(0, 1);
            }
            corners
        };
        for left_out in 0..n_corners {
            let corners = corners_without(left_out);
            let Some(plane) = self.plane_through(&corners) else {
                self.facets.clear();
                self.stamps.clear();
                self.created.clear();
                return false;
            };
            // The facet without corner `c` is facet `c`; across the ridge opposite `corners[k]` lies facet `corners[k]`.
            let neighbors = corners.map(|c| Link::new(u32::from(c), position(&corners_without(c), left_out)));
            let id = self.add(plane, corners, neighbors);
            self.created.push(id);
        }
        true
    }

    /// The facets made by the last [`Self::reset`] or [`Self::insert`].
    pub(crate) fn created(&self) -> &[FacetId] {
        &self.created
    }

    /// The plane of a facet, unless the facet is gone.
    pub(crate) fn plane(&self, id: FacetId) -> Option<&Hyperplane<D>> {
        let facet = &self.facets[id.place as usize];
        (facet.alive && facet.generation == id.generation).then_some(&facet.plane)
    }

    /// Solves the facet's plane again from its corners, where they are spread well enough to beat the pencil.
    pub(crate) fn refine(&mut self, id: FacetId) {
        let facet = &self.facets[id.place as usize];
        if let Some(plane) = self.plane_through(&facet.corners)
            && dot(&plane.normal, &facet.plane.normal) > 1.0 - 1e-6
        {
            self.facets[id.place as usize].plane = plane;
        }
    }

    /// How many facets there are.
    pub(crate) fn n_facets(&self) -> usize {
        self.facets.len() - self.free.len()
    }

    /// Whether this very point was inserted before.
    pub(crate) fn has_point(&self, point: &[f64; D]) -> bool {
        self.points.iter().any(|p| p == point)
    }

    /// Sum of the signed volumes of the pyramids from the inside point to the facets.
    ///
    /// The corners of every facet are in the order that one orientation of the surface gives them (a new facet takes
    /// its point in place of the corner that it covers). Where many points lie in one plane, slivers may fold over
    /// each other; with signs, the folds cancel.
    pub(crate) fn volume(&self) -> f64 {
        let pyramids = self
            .facets
            .iter()
            .filter(|f| f.alive)
            .map(|f| determinant(f.corners.map(|c| sub(&self.points[usize::from(c)], &self.inside))));
        let factorial: f64 = (1..=D).map(|k| k as f64).product();
        pyramids.sum::<f64>().abs() / factorial
    }

    /// Adds a point that stands over the facet `start`; [`Self::created`] then lists the new facets.
    ///
    /// # Errors
    ///
    /// [`QualityError::TooManyFacets`] with more than `most_facets` facets before the insertion.
    pub(crate) fn insert(
        &mut self,
        point: &[f64; D],
        start: FacetId,
        what: &'static str,
        most_facets: usize,
    ) -> Result<(), QualityError> {
        if self.n_facets() > most_facets || self.points.len() >= MOST_POINTS {
            return Err(QualityError::TooManyFacets {
                what,
                facets: most_facets,
            });
        }
        let point_idx = self.points.len() as u16;
        self.points.push(*point);
        self.created.clear();
        self.flood(point, start.place);
        // Rounding alone could let a point see everything; it then changes nothing.
        if self.n_horizon == 0 {
            return Ok(());
        }
        self.make_facets(point_idx);
        self.link_facets();
        for &place in &self.seen[..self.n_seen] {
            self.facets[place as usize].alive = false;
            self.free.push(place);
        }
        Ok(())
    }

    /// Finds all facets that see the point, starting from one that does, and the ridges around them.
    fn flood(&mut self, point: &[f64; D], start: u32) {
        self.round += 1;
        let round = self.round;
        // Room for all that may come; the loop then appends without asking whether it should (branches here are
        // coin tosses).
        let n_facets = self.facets.len();
        if self.seen.len() <= n_facets {
            self.seen.resize(2 * n_facets, 0);
            self.horizon.resize(2 * D * n_facets, (Link::UNSET, Link::UNSET));
        }
        let (mut n_seen, mut n_horizon) = (1, 0);
        self.seen[0] = start;
        let first = &mut self.facets[start as usize];
        first.height = first.plane.height(point);
        self.stamps[start as usize] = round;
        let mut next = 0;
        while next < n_seen {
            let place = self.seen[next];
            next += 1;
            let neighbors = self.facets[place as usize].neighbors;
            for (k, link) in neighbors.into_iter().enumerate() {
                let across = link.place() as usize;
                let facet = &mut self.facets[across];
                // Measured again on every visit: cheaper than a branch that is wrong half of the time.
                facet.height = facet.plane.height(point);
                let sees = u32::from(facet.height > self.tolerance);
                let new = u32::from(self.stamps[across] < round);
                self.stamps[across] = round;
                self.seen[n_seen] = link.place();
                n_seen += (new & sees) as usize;
                self.horizon[n_horizon] = (Link::new(place, k), link);
                n_horizon += 1 - sees as usize;
            }
        }
        (self.n_seen, self.n_horizon) = (n_seen, n_horizon);
    }

    /// Makes the facets of the new point and the ridges of the horizon.
    fn make_facets(&mut self, point_idx: u16) {
        let horizon = std::mem::take(&mut self.horizon);
        for &(from, to) in &horizon[..self.n_horizon] {
            let (seen, unseen) = (
                &self.facets[from.place() as usize],
                &self.facets[to.place() as usize],
            );
            let k = from.slot();
            let mut corners = seen.corners;
            corners[k] = point_idx;
            let (pencil, spread) = Hyperplane::pencil(&seen.plane, seen.height, &unseen.plane, unseen.height);
            // At a sharp ridge the two normals nearly cancel, and a fresh solve is the better plane.
            let plane = if spread < 1e-3 {
                self.plane_through(&corners).unwrap_or(pencil)
            } else {
                pencil
            };
            let mut neighbors = [Link::UNSET; D];
            neighbors[k] = to;
            let id = self.add(plane, corners, neighbors);
            self.facets[to.place() as usize].neighbors[to.slot()] = Link::new(id.place, k);
            // The seen facet tells those who walk by that here the new surface begins.
            self.facets[from.place() as usize].neighbors[k] = Link::fresh(id.place);
            self.created.push(id);
        }
        self.horizon = horizon;
    }

    /// Makes the new facets neighbours of each other: from the ridge of each, for each other corner, walks round the
    /// part of the ridge without it through seen facets until the horizon comes back.
    fn link_facets(&mut self) {
        for i in 0..self.n_horizon {
            let from = self.horizon[i].0;
            let (place, k) = (from.place() as usize, from.slot());
            let old = &self.facets[place];
            let new = old.neighbors[k].place();
            let (corners, links) = (old.corners, old.neighbors);
            let mut open = 0_u32;
            for (j, link) in self.facets[new as usize].neighbors.iter().enumerate() {
                open |= u32::from(*link == Link::UNSET) << j;
            }
            while open != 0 {
                let j = open.trailing_zeros() as usize;
                open &= open - 1;
                // The walk turns about the corners other than `pivot` and the one opposite the ridge it leaves by.
                let (mut pivot, mut pivot_slot, mut link) = (corners[k], k, links[j]);
                while !link.is_fresh() {
                    let facet = &self.facets[link.place() as usize];
                    let out = position(&facet.corners, pivot);
                    pivot_slot = link.slot();
                    pivot = facet.corners[pivot_slot];
                    link = facet.neighbors[out];
                }
                self.facets[new as usize].neighbors[j] = Link::new(link.place(), pivot_slot);
                self.facets[link.place() as usize].neighbors[pivot_slot] = Link::new(new, j);
            }
        }
    }

    fn add(&mut self, plane: Hyperplane<D>, corners: [u16; D], neighbors: [Link; D]) -> FacetId {
        let mut facet = Facet {
            plane,
            height: 0.0,
            neighbors,
            corners,
            generation: 0,
            alive: true,
        };
        if let Some(place) = self.free.pop() {
            let old = &mut self.facets[place as usize];
            facet.generation = old.generation.wrapping_add(1);
            let generation = facet.generation;
            *old = facet;
            self.stamps[place as usize] = 0;
            FacetId { place, generation }
        } else {
            self.facets.push(facet);
            self.stamps.push(0);
            FacetId {
                place: self.facets.len() as u32 - 1,
                generation: 0,
            }
        }
    }

    fn plane_through(&self, corners: &[u16; D]) -> Option<Hyperplane<D>> {
        through_points(&corners.map(|c| self.points[usize::from(c)]), &self.inside)
    }
}

/// Where `value` stands in `slots`. It always does: facets that share a ridge share its corners. Without a branch.
#[inline]
fn position<const D: usize>(slots: &[u16; D], value: u16) -> usize {
    let mut found = 0;
    for (i, &slot) in slots.iter().enumerate() {
        if slot == value {
            found = i;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit(k: usize, length: f64) -> [f64; 6] {
        std::array::from_fn(|i| if i == k { length } else { 0.0 })
    }

    fn corner_simplex() -> [[f64; 6]; 7] {
        std::array::from_fn(|i| if i == 0 { [0.0; 6] } else { unit(i - 1, 1.0) })
    }

    /// Every facet's neighbour points back, across the same ridge.
    fn check_links<const D: usize>(polytope: &Polytope<D>) {
        for (place, facet) in polytope.facets.iter().enumerate().filter(|(_, f)| f.alive) {
            for k in 0..D {
                let link = facet.neighbors[k];
                let other = &polytope.facets[link.place() as usize];
                assert!(other.alive);
                let back = link.slot();
                assert_eq!(other.neighbors[back], Link::new(place as u32, k));
                let without = |corners: &[u16; D], slot: usize| {
                    let mut rest: Vec<u16> = (0..D).filter(|&i| i != slot).map(|i| corners[i]).collect();
                    rest.sort_unstable();
                    rest
                };
                assert_eq!(without(&facet.corners, k), without(&other.corners, back));
            }
        }
    }

    fn add_point<const D: usize>(polytope: &mut Polytope<D>, point: [f64; D]) {
        let start = (0..polytope.facets.len() as u32)
            .map(|place| FacetId {
                place,
                generation: polytope.facets[place as usize].generation,
            })
            .find(|&id| polytope.plane(id).is_some_and(|p| p.height(&point) > 1e-9))
            .unwrap();
        polytope.insert(&point, start, "volume", 1000).unwrap();
        check_links(polytope);
    }

    #[test]
    fn the_corner_simplex_has_volume_one_720th() {
        let mut polytope = Polytope::default();
        assert!(polytope.reset(&corner_simplex(), 1e-13));
        assert_eq!(polytope.n_facets(), 7);
        check_links(&polytope);
        assert!((polytope.volume() - 1.0 / 720.0).abs() < 1e-17);
    }

    #[test]
    fn growing_a_simplex_to_the_cross_polytope_gives_its_64_facets() {
        let mut polytope = Polytope::default();
        // Start from 7 of its 12 corners: e₁ … e₆ and −e₁ are affinely independent.
        let simplex: [[f64; 6]; 7] =
            std::array::from_fn(|i| if i == 6 { unit(0, -1.0) } else { unit(i, 1.0) });
        assert!(polytope.reset(&simplex, 1e-13));
        for k in 1..6 {
            add_point(&mut polytope, unit(k, -1.0));
        }
        assert_eq!(polytope.n_facets(), 64);
        assert!((polytope.volume() - 64.0 / 720.0).abs() < 1e-15);
    }

    #[test]
    fn a_square_grows_in_the_plane_as_well() {
        let mut polytope = Polytope::default();
        assert!(polytope.reset(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], 1e-13));
        add_point(&mut polytope, [1.0, 1.0]);
        assert_eq!(polytope.n_facets(), 4);
        assert!((polytope.volume() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_flat_simplex_is_refused() {
        let mut simplex = corner_simplex();
        simplex[6] = [0.5, 0.5, 0.0, 0.0, 0.0, 0.0];
        assert!(!Polytope::default().reset(&simplex, 1e-13));
    }
}
