//! The epsilon quality: how small a push in the worst direction breaks the grasp.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use crate::polytope::{FacetId, Polytope, sub};
use crate::wrench_space::dot;
use crate::{GraspWrenchSpace, QualityError};

/// Radius of the largest origin-centred ball inside the grasp wrench space; 0 without force closure.
///
/// [`EpsilonSolver`] does the same and keeps its memory for the next grasp.
///
/// # Errors
///
/// [`QualityError::TooManyFacets`] where the polytope outgrows its bound, which takes an L∞ space of very many contacts.
///
/// # Source
///
/// The measure: Ferrari and Canny, ICRA 1992, criterion 1. Growing the polytope: the expanding polytope algorithm
/// (van den Bergen 2001) carried to six dimensions.
pub fn epsilon(space: &GraspWrenchSpace) -> Result<f64, QualityError> {
    EpsilonSolver::default().epsilon(space)
}

/// Share of the largest wrench norm that ε must exceed to count as force closure.
pub const FORCE_CLOSURE_TOLERANCE: f64 = 1e-9;

/// Computes [`epsilon`], and keeps its memory from one grasp to the next. The result does not depend on earlier calls.
///
/// ```text
/// P ← a simplex of support points
/// loop: F ← facet of P with the least signed offset d from the origin, n its outward normal
///       s ← max n · w over the whole space            (ε ≤ s, whatever P is)
///       s ≤ 0: the origin is not inside, ε = 0
///       s = d: no point lies beyond F, so ε = d       (ε ≥ d, since P lies inside)
///       else add the point of s to P
/// ```
///
/// A few dozen points decide; the whole hull, thousands of facets, is never built. Exact to 1e-12 of the largest wrench
/// norm (times the number of contacts for L∞).
#[derive(Debug, Clone, Default)]
pub struct EpsilonSolver {
    polytope: Polytope,
    queue: BinaryHeap<Reverse<Candidate>>,
    support_points: Vec<[f64; 6]>,
}

impl EpsilonSolver {
    /// See [`epsilon`].
    ///
    /// # Errors
    ///
    /// As [`epsilon`].
    pub fn epsilon(&mut self, space: &GraspWrenchSpace) -> Result<f64, QualityError> {
        let scaled = self.grow(space, MOST_FACETS)?;
        Ok(if scaled > FORCE_CLOSURE_TOLERANCE {
            scaled * space.largest_norm()
        } else {
            0.0
        })
    }

    /// ε of the scaled space; anything up to the tolerance means that there is no force closure.
    fn grow(&mut self, space: &GraspWrenchSpace, most_facets: usize) -> Result<f64, QualityError> {
        let tolerance = TOLERANCE * space.scaled_size();
        // The least support seen in any direction: ε is never above it.
        let mut upper = f64::INFINITY;
        if !self.start(space, FORCE_CLOSURE_TOLERANCE, &mut upper) {
            return Ok(0.0);
        }
        self.queue.clear();
        self.queue_created(upper);
        while let Some(Reverse(candidate)) = self.queue.pop() {
            let id = candidate.id;
            let Some(&plane) = self.polytope.plane(id) else {
                continue;
            };
            if candidate.offset >= upper - tolerance {
                break;
            }
            // The winning facet deserves the better plane; if that lies farther out, others go first.
            if !candidate.refined {
                self.polytope.refine(id);
                let offset = self.polytope.plane(id).map_or(plane.offset, |p| p.offset);
                if offset > candidate.offset + tolerance {
                    self.queue.push(Reverse(Candidate {
                        offset,
                        id,
                        refined: true,
                    }));
                    continue;
                }
            }
            let Some(&plane) = self.polytope.plane(id) else {
                continue;
            };
            let (support, point) = space.scaled_support(&plane.normal);
            upper = upper.min(support);
            if upper <= FORCE_CLOSURE_TOLERANCE {
                return Ok(0.0);
            }
            // A corner of its own facet beyond it is rounding, not a new point.
            if plane.height(&point) <= tolerance || self.polytope.has_corner(id, &point) {
                continue;
            }
            if self.polytope.n_facets() > most_facets {
                return Err(QualityError::TooManyFacets {
                    what: "epsilon",
                    facets: most_facets,
                });
            }
            self.polytope.insert(&point, id);
            self.queue_created(upper);
        }
        Ok(upper)
    }

    /// Grows a simplex of support points; false as soon as some direction shows that the space reaches no farther than
    /// `least` (a flat space always does).
    fn start(&mut self, space: &GraspWrenchSpace, least: f64, upper: &mut f64) -> bool {
        first_simplex(space, &mut self.support_points, |reach| {
            *upper = upper.min(reach);
            reach > least
        })
        .is_some_and(|simplex| {
            self.polytope
                .reset(&simplex, SEEN_TOLERANCE * space.scaled_size())
        })
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

/// ε is exact to this, in units of the largest wrench norm.
pub(crate) const TOLERANCE: f64 = 1e-12;
/// A facet sees a point that is higher than this; well below `TOLERANCE`, so that a facet that asks for a point sees it.
pub(crate) const SEEN_TOLERANCE: f64 = 1e-13;
/// More facets than any sensible grasp asks for (200 contacts: a few thousand); bounds time and memory.
const MOST_FACETS: usize = 400_000;

/// Seven affinely independent points of the space, each about as far from the span of the ones before as can be.
///
/// `keep_going` is told how far the space reaches in each direction that is tried, and may stop the search. None where
/// it does, or where the space is flat.
pub(crate) fn first_simplex(
    space: &GraspWrenchSpace,
    seen: &mut Vec<[f64; 6]>,
    mut keep_going: impl FnMut(f64) -> bool,
) -> Option<[[f64; 6]; 7]> {
    seen.clear();
    let mut ask = |direction: &[f64; 6], seen: &mut Vec<[f64; 6]>| {
        let (reach, point) = space.scaled_support(direction);
        seen.push(point);
        keep_going(reach)
    };
    // Most grasps without force closure push to one side: the direction against all of them tells at once.
    let mut against = [0.0; 6];
    for wrench in space.wrenches() {
        for k in 0..6 {
            against[k] -= wrench[k];
        }
    }
    let length = dot(&against, &against).sqrt();
    if length > 0.0 && !ask(&against.map(|c| c / length), seen) {
        return None;
    }
    for direction in complement(&[]) {
        for sign in [1.0, -1.0] {
            if !ask(&direction.map(|c| sign * c), seen) {
                return None;
            }
        }
    }
    let mut simplex = [[0.0; 6]; 7];
    simplex[0] = *seen.iter().max_by(|a, b| dot(a, a).total_cmp(&dot(b, b)))?;
    let mut span: Vec<[f64; 6]> = Vec::with_capacity(6);
    for n_points in 1..7 {
        if n_points > 1 {
            for direction in complement(&span) {
                for sign in [1.0, -1.0] {
                    if !ask(&direction.map(|c| sign * c), seen) {
                        return None;
                    }
                }
            }
        }
        let off_span = |p: &[f64; 6]| remove_span(sub(p, &simplex[0]), &span);
        let farthest = seen
            .iter()
            .map(|p| (*p, off_span(p)))
            .max_by(|(_, a), (_, b)| dot(a, a).total_cmp(&dot(b, b)))?;
        let length = dot(&farthest.1, &farthest.1).sqrt();
        if length <= TOLERANCE * space.scaled_size() {
            return None;
        }
        simplex[n_points] = farthest.0;
        span.push(farthest.1.map(|c| c / length));
    }
    Some(simplex)
}

/// Orthonormal directions that are orthogonal to `span`, built from the coordinate axes that stand farthest off it.
fn complement(span: &[[f64; 6]]) -> Vec<[f64; 6]> {
    let mut all = span.to_vec();
    for _ in span.len()..6 {
        let axes = (0..6).map(|k| remove_span(std::array::from_fn(|i| f64::from(u8::from(i == k))), &all));
        let best = axes
            .max_by(|a, b| dot(a, a).total_cmp(&dot(b, b)))
            .expect("there are six axes");
        let length = dot(&best, &best).sqrt();
        all.push(best.map(|c| c / length));
    }
    all.split_off(span.len())
}

/// What is left of `v` off the orthonormal `span`; twice is enough (Gram–Schmidt with reorthogonalisation).
fn remove_span(mut v: [f64; 6], span: &[[f64; 6]]) -> [f64; 6] {
    for _ in 0..2 {
        for s in span {
            let along = dot(&v, s);
            for k in 0..6 {
                v[k] -= along * s[k];
            }
        }
    }
    v
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
