//! A simplicial polytope in six dimensions that grows point by point.
//!
//! Beneath and beyond: a new point sees some facets; they go, and each ridge between a seen and an unseen facet spans
//! a new facet with the point. The plane of a new facet lies in the pencil of the two planes at its ridge,
//!
//! ```text
//! n ∝ h_s n_u − h_u n_s        (h: height of the point over the seen and the unseen plane, h_s > 0 ≥ h_u)
//! ```
//!
//! so a facet needs no linear solve, and many points in one plane (friction cones are full of them) do no harm: the
//! flat slivers that they make inherit a plane that is right.

use crate::hyperplane::{Hyperplane, through_points};
use crate::wrench_space::dot;

/// Index of a facet and how often its place was reused, so that a stale one is recognised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct FacetId {
    place: u32,
    generation: u32,
}

/// The polytope. Cleared and filled again, it keeps its memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct Polytope {
    points: Vec<[f64; 6]>,
    facets: Vec<Facet>,
    free: Vec<u32>,
    /// A point well inside.
    inside: [f64; 6],
    /// How far over a plane a point must stand to see it.
    tolerance: f64,
    round: u32,
    seen: Vec<u32>,
    created: Vec<FacetId>,
}

#[derive(Debug, Clone)]
struct Facet {
    plane: Hyperplane,
    /// Corners, as indices of points.
    corners: [u32; 6],
    /// `neighbors[k]` lies across the ridge opposite `corners[k]`.
    neighbors: [u32; 6],
    generation: u32,
    alive: bool,
    /// The insertion that looked at this facet last, whether it saw it, and how high the point stood.
    round: u32,
    seen: bool,
    height: f64,
    /// During an insertion: the facet that replaces this one at the ridge opposite `corners[k]`.
    fresh: [u32; 6],
}

impl Polytope {
    /// Starts again from a simplex. `tolerance`: heights up to it count as on the plane.
    ///
    /// Returns false, and leaves no facets, where the simplex is too flat to have planes.
    pub(crate) fn reset(&mut self, simplex: &[[f64; 6]; 7], tolerance: f64) -> bool {
        self.points.clear();
        self.facets.clear();
        self.free.clear();
        self.created.clear();
        self.points.extend_from_slice(simplex);
        self.inside = std::array::from_fn(|k| simplex.iter().map(|p| p[k]).sum::<f64>() / 7.0);
        self.tolerance = tolerance;
        self.round = 0;
        for left_out in 0..7_u32 {
            let mut corners: [u32; 6] = std::array::from_fn(|i| {
                if (i as u32) < left_out {
                    i as u32
                } else {
                    i as u32 + 1
                }
            });
            // The boundary of a simplex takes alternating signs; with this swap all facets turn the same way.
            if left_out % 2 == 1 {
                corners.swap(0, 1);
            }
            let Some(plane) = self.plane_through(&corners) else {
                self.facets.clear();
                self.created.clear();
                return false;
            };
            // The facet without corner `c` is facet `c`; across the ridge opposite `corners[k]` lies facet `corners[k]`.
            let id = self.add(Facet::new(plane, corners, corners));
            self.created.push(id);
        }
        true
    }

    /// The facets made by the last [`Self::reset`] or [`Self::insert`].
    pub(crate) fn created(&self) -> &[FacetId] {
        &self.created
    }

    /// The plane of a facet, unless the facet is gone.
    pub(crate) fn plane(&self, id: FacetId) -> Option<&Hyperplane> {
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

    /// Whether one of the facet's corners is this very point.
    pub(crate) fn has_corner(&self, id: FacetId, point: &[f64; 6]) -> bool {
        self.facets[id.place as usize]
            .corners
            .iter()
            .any(|&c| self.points[c as usize] == *point)
    }

    /// Sum of the signed volumes of the pyramids from the inside point to the facets.
    ///
    /// The corners of every facet are in the order that one orientation of the surface gives them (a new facet takes
    /// its point in place of the corner that it covers). Where many points lie in one plane, slivers may fold over
    /// each other; with signs, the folds cancel.
    pub(crate) fn volume(&self) -> f64 {
        let pyramids = self.facets.iter().filter(|f| f.alive).map(|f| {
            let edges = f.corners.map(|c| sub(&self.points[c as usize], &self.inside));
            nalgebra::Matrix6::from_fn(|r, c| edges[r][c]).determinant()
        });
        pyramids.sum::<f64>().abs() / 720.0
    }

    /// Adds a point that stands over the facet `start`; [`Self::created`] then lists the new facets.
    pub(crate) fn insert(&mut self, point: &[f64; 6], start: FacetId) {
        let point_idx = self.points.len() as u32;
        self.points.push(*point);
        self.created.clear();
        self.flood(point, start.place);

        let seen = std::mem::take(&mut self.seen);
        for &place in &seen {
            for k in 0..6 {
                let across = self.facets[place as usize].neighbors[k];
                if !self.facets[across as usize].seen {
                    self.replace_at_ridge(place, k, across, point_idx);
                }
            }
        }
        for &place in &seen {
            for k in 0..6 {
                if !self.facets[self.facets[place as usize].neighbors[k] as usize].seen {
                    self.link(place, k);
                }
            }
        }
        for &place in &seen {
            self.facets[place as usize].alive = false;
            self.free.push(place);
        }
        self.seen = seen;
    }

    /// Marks all facets that see the point, starting from one that does.
    fn flood(&mut self, point: &[f64; 6], start: u32) {
        self.round += 1;
        self.seen.clear();
        self.seen.push(start);
        let first = &mut self.facets[start as usize];
        first.height = first.plane.height(point);
        first.seen = true;
        first.round = self.round;
        let mut next = 0;
        while next < self.seen.len() {
            let neighbors = self.facets[self.seen[next] as usize].neighbors;
            next += 1;
            for across in neighbors {
                let facet = &mut self.facets[across as usize];
                if facet.round != self.round {
                    facet.round = self.round;
                    facet.height = facet.plane.height(point);
                    facet.seen = facet.height > self.tolerance;
                    if facet.seen {
                        self.seen.push(across);
                    }
                }
            }
        }
    }

    /// Makes the facet of the new point and the ridge between the seen facet `place` and the unseen `across`.
    fn replace_at_ridge(&mut self, place: u32, k: usize, across: u32, point_idx: u32) {
        let (seen, unseen) = (&self.facets[place as usize], &self.facets[across as usize]);
        let mut corners = seen.corners;
        corners[k] = point_idx;
        let mut neighbors = [u32::MAX; 6];
        neighbors[k] = across;
        let (pencil, spread) = Hyperplane::pencil(&seen.plane, seen.height, &unseen.plane, unseen.height);
        // At a sharp ridge the two normals nearly cancel, and a fresh solve is the better plane.
        let plane = if spread < 1e-3 {
            self.plane_through(&corners).unwrap_or(pencil)
        } else {
            pencil
        };
        let id = self.add(Facet::new(plane, corners, neighbors));
        self.facets[place as usize].fresh[k] = id.place;
        let back = position(&self.facets[across as usize].neighbors, place);
        self.facets[across as usize].neighbors[back] = id.place;
        // The seen facet still points at `across`, so that the walk below finds the horizon.
        self.created.push(id);
    }

    /// Finds the neighbours of the new facet at ridge `k` of the seen facet `place`: for each other corner, walks round
    /// the part of the ridge without it through seen facets until the horizon comes back.
    fn link(&mut self, place: u32, k: usize) {
        let new = self.facets[place as usize].fresh[k];
        let corners = self.facets[place as usize].corners;
        for j in 0..6 {
            if j == k {
                continue;
            }
            // The walk turns about the corners other than `corners[k]` and `corners[j]`; it leaves `current` opposite
            // slot `cross`, over a ridge whose only corner off the axis is `pivot`.
            let mut current = place;
            let mut cross = j;
            let mut pivot = corners[k];
            loop {
                let facet = &self.facets[current as usize];
                let next = facet.neighbors[cross];
                if !self.facets[next as usize].seen {
                    self.facets[new as usize].neighbors[j] = facet.fresh[cross];
                    break;
                }
                let next_facet = &self.facets[next as usize];
                let arrived = next_facet.corners[position(&next_facet.neighbors, current)];
                cross = position(&next_facet.corners, pivot);
                pivot = arrived;
                current = next;
            }
        }
    }

    fn add(&mut self, mut facet: Facet) -> FacetId {
        if let Some(place) = self.free.pop() {
            let old = &mut self.facets[place as usize];
            facet.generation = old.generation.wrapping_add(1);
            let generation = facet.generation;
            *old = facet;
            FacetId { place, generation }
        } else {
            self.facets.push(facet);
            FacetId {
                place: self.facets.len() as u32 - 1,
                generation: 0,
            }
        }
    }

    fn plane_through(&self, corners: &[u32; 6]) -> Option<Hyperplane> {
        through_points(&corners.map(|c| self.points[c as usize]), &self.inside)
    }
}

impl Facet {
    fn new(plane: Hyperplane, corners: [u32; 6], neighbors: [u32; 6]) -> Self {
        let fresh = [u32::MAX; 6];
        Self {
            plane,
            corners,
            neighbors,
            generation: 0,
            alive: true,
            round: 0,
            seen: false,
            height: 0.0,
            fresh,
        }
    }
}

/// Where `value` stands in `slots`. It always does: facets that share a ridge name each other and its corners.
fn position(slots: &[u32; 6], value: u32) -> usize {
    slots
        .iter()
        .position(|&s| s == value)
        .expect("neighbouring facets name each other")
}

pub(crate) fn sub(a: &[f64; 6], b: &[f64; 6]) -> [f64; 6] {
    std::array::from_fn(|k| a[k] - b[k])
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
    fn check_links(polytope: &Polytope) {
        for (place, facet) in polytope.facets.iter().enumerate().filter(|(_, f)| f.alive) {
            for k in 0..6 {
                let other = &polytope.facets[facet.neighbors[k] as usize];
                assert!(other.alive);
                let back = position(&other.neighbors, place as u32);
                let mut ours: Vec<u32> = (0..6).filter(|&i| i != k).map(|i| facet.corners[i]).collect();
                let mut theirs: Vec<u32> = (0..6).filter(|&i| i != back).map(|i| other.corners[i]).collect();
                ours.sort_unstable();
                theirs.sort_unstable();
                assert_eq!(ours, theirs);
            }
        }
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
        let simplex = std::array::from_fn(|i| if i == 6 { unit(0, -1.0) } else { unit(i, 1.0) });
        assert!(polytope.reset(&simplex, 1e-13));
        for k in 1..6 {
            let point = unit(k, -1.0);
            let ids: Vec<FacetId> = (0..polytope.facets.len() as u32)
                .filter(|&p| polytope.facets[p as usize].alive)
                .map(|place| FacetId {
                    place,
                    generation: polytope.facets[place as usize].generation,
                })
                .collect();
            let start = ids
                .into_iter()
                .find(|&id| polytope.plane(id).unwrap().height(&point) > 1e-9)
                .unwrap();
            polytope.insert(&point, start);
            check_links(&polytope);
        }
        assert_eq!(polytope.n_facets(), 64);
        assert!((polytope.volume() - 64.0 / 720.0).abs() < 1e-15);
    }

    #[test]
    fn a_flat_simplex_is_refused() {
        let mut simplex = corner_simplex();
        simplex[6] = [0.5, 0.5, 0.0, 0.0, 0.0, 0.0];
        assert!(!Polytope::default().reset(&simplex, 1e-13));
    }
}
