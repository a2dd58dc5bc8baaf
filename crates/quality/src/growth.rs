//! ε by a polytope that keeps its whole boundary: slower than the frontier, and never in doubt.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use crate::epsilon::{Goal, MOST_FACETS, SEEN_TOLERANCE, TOLERANCE};
use crate::polytope::{FacetId, Polytope};
use crate::start::Least;
use crate::{GraspWrenchSpace, QualityError};

/// The polytope inside the space and its facets in the order of their distance.
#[derive(Debug, Clone, Default)]
pub(crate) struct Growth<const D: usize> {
    polytope: Polytope<D>,
    queue: BinaryHeap<Reverse<Candidate>>,
}

impl<const D: usize> Growth<D> {
    /// Grows from a simplex (of which the first D + 1 points count) until the goal is met; returns a lower bound, and
    /// tells `least` of upper ones.
    pub(crate) fn run(
        &mut self,
        space: &GraspWrenchSpace,
        simplex: &[[f64; 6]; 7],
        goal: &Goal,
        least: &mut Least,
    ) -> Result<f64, QualityError> {
        let flat = TOLERANCE * space.scaled_size();
        let simplex = simplex.map(|p| shorter(&p));
        if !self
            .polytope
            .reset(&simplex[..=D], SEEN_TOLERANCE * space.scaled_size())
        {
            least.reach = 0.0;
            return Ok(0.0);
        }
        self.queue.clear();
        self.queue_created(least.reach);
        // Facets whose rounding cannot be mended keep the lower bound down.
        let mut doubtful = f64::INFINITY;
        while let Some(Reverse(candidate)) = self.queue.pop() {
            let id = candidate.id;
            let Some(plane) = self.polytope.plane(id).copied() else {
                continue;
            };
            let known = candidate.offset.min(least.reach).min(doubtful);
            if candidate.offset >= least.reach - goal.tolerance || known >= goal.enough {
                return Ok(known);
            }
            let direction = longer(&plane.normal);
            let (reach, point) = space.scaled_support(&direction);
            least.see(reach, &direction);
            if least.reach <= goal.too_little {
                return Ok(known);
            }
            let point = shorter(&point);
            if plane.height(&point) > flat && !self.polytope.has_point(&point) {
                self.polytope.insert(&point, id, "epsilon", MOST_FACETS)?;
                self.queue_created(least.reach);
            } else if candidate.refined {
                doubtful = doubtful.min(candidate.offset);
            } else {
                // Nothing lies beyond: the facet deserves the better plane before it decides.
                self.polytope.refine(id);
                let offset = self.polytope.plane(id).map_or(plane.offset, |p| p.offset);
                self.queue.push(Reverse(Candidate {
                    offset,
                    id,
                    refined: true,
                }));
            }
        }
        Ok(least.reach.min(doubtful))
    }

    fn queue_created(&mut self, upper: f64) {
        for &id in self.polytope.created() {
            if let Some(plane) = self.polytope.plane(id)
                && plane.offset < upper
            {
                self.queue.push(Reverse(Candidate {
                    offset: plane.offset,
                    id,
                    refined: false,
                }));
            }
        }
    }
}

/// Coordinates that count.
pub(crate) fn shorter<const D: usize>(point: &[f64; 6]) -> [f64; D] {
    std::array::from_fn(|k| point[k])
}

/// Coordinates filled up with zeros.
pub(crate) fn longer<const D: usize>(point: &[f64; D]) -> [f64; 6] {
    std::array::from_fn(|k| if k < D { point[k] } else { 0.0 })
}

/// A facet that waits, ordered by its offset, then by its place, so that ties never depend on history.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    offset: f64,
    id: FacetId,
    refined: bool,
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.offset.total_cmp(&other.offset).then(self.id.cmp(&other.id))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}
