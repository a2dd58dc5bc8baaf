//! The epsilon quality: how small a push in the worst direction breaks the grasp.

use crate::descent::descend;
use crate::frontier::Frontier;
use crate::growth::Growth;
use crate::start::{Least, first_simplex};
use crate::{Contact, GraspWrenchSpace, QualityError, QualityOptions, Wrench};

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

/// How near its two bounds [`EpsilonSolver::epsilon`] brings ε where a contact is smooth, as a share of the largest
/// wrench norm.
pub const SMOOTH_TOLERANCE: f64 = 1e-4;

/// What is known of ε: `lower` ≤ ε ≤ `upper`.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct EpsilonBounds {
    /// Radius of a ball that is proven to lie inside the space; 0 or more.
    pub lower: f64,
    /// How far the space reaches against `limiting_wrench`: no larger ball fits. 0 without force closure.
    pub upper: f64,
    /// The disturbance, of norm 1, that the contacts resist least: they can answer `upper` × this much of it and no
    /// more. Without force closure, one that they cannot answer at all.
    pub limiting_wrench: Wrench,
}

/// Computes [`epsilon`], and keeps its memory from one grasp to the next. The result does not depend on earlier calls.
///
/// ```text
/// P ← a simplex of support points
/// u ← offset of a facet of the space, found by going downhill from P       (ε ≤ u)
/// loop: F ← facet of P with the least signed offset d from the origin, n its outward normal
///       d ≥ u: ε = u                                  (ε ≥ d, since P lies inside)
///       s ← max n · w over the whole space, u ← min(u, s)   (ε ≤ s, whatever P is)
///       s ≤ 0: the origin is not inside, ε = 0
///       add the point of s to P; facets farther out than u are never made
/// ```
///
/// A few dozen points decide; the whole hull, thousands of facets, is never built. Exact to 1e-12 of the largest wrench
/// norm (times the number of contacts for L∞) where all cones have edges. Every round adds a point of the space that was
/// not in P before, so with edges it ends after at most as many rounds as there are wrenches; a bound on the facets
/// stops the rest.
#[derive(Debug, Clone, Default)]
pub struct EpsilonSolver {
    frontier: Frontier,
    whole: Whole,
    space: Option<GraspWrenchSpace>,
}

impl EpsilonSolver {
    /// See [`epsilon`]. With smooth contacts, the lower of two bounds that are [`SMOOTH_TOLERANCE`] apart.
    ///
    /// # Errors
    ///
    /// As [`epsilon`].
    pub fn epsilon(&mut self, space: &GraspWrenchSpace) -> Result<f64, QualityError> {
        let bounds = self.bounds(space)?;
        // Both bounds agree where all cones have edges; the upper one is a support value, free of the facet's rounding.
        Ok(if space.is_polyhedral() {
            bounds.upper
        } else {
            bounds.lower
        })
    }

    /// ε of contacts, without making a [`GraspWrenchSpace`] anew: allocates nothing once the solver has seen grasps of
    /// this size.
    ///
    /// # Errors
    ///
    /// As [`GraspWrenchSpace::new`] and [`epsilon`].
    pub fn epsilon_of(
        &mut self,
        contacts: &[Contact],
        options: &QualityOptions,
    ) -> Result<f64, QualityError> {
        let space = match self.space.take() {
            Some(mut space) => {
                space.fill(contacts, options)?;
                space
            }
            None => GraspWrenchSpace::new(contacts, options)?,
        };
        let epsilon = self.epsilon(&space);
        self.space = Some(space);
        epsilon
    }

    /// The bounds that [`Self::epsilon`] ends with, and the worst direction.
    ///
    /// # Errors
    ///
    /// As [`epsilon`].
    pub fn bounds(&mut self, space: &GraspWrenchSpace) -> Result<EpsilonBounds, QualityError> {
        let tolerance = if space.is_polyhedral() {
            TOLERANCE * space.scaled_size()
        } else {
            SMOOTH_TOLERANCE
        };
        self.solve(space, &Goal::new(tolerance))
    }

    /// ε to `tolerance` (in ε's own unit): stops as soon as the bounds are that near.
    ///
    /// Without force closure both bounds are 0. A tolerance finer than rounding allows gives bounds that are 1e-12 of the
    /// largest wrench norm apart.
    ///
    /// # Errors
    ///
    /// [`QualityError::BadTolerance`] unless it is positive and finite; and as [`epsilon`], which a smooth cone and a
    /// very fine tolerance can bring about.
    pub fn epsilon_within(
        &mut self,
        space: &GraspWrenchSpace,
        tolerance: f64,
    ) -> Result<EpsilonBounds, QualityError> {
        if !(tolerance.is_finite() && tolerance > 0.0) {
            return Err(QualityError::BadTolerance { tolerance });
        }
        let finest = TOLERANCE * space.scaled_size();
        let goal = Goal::new((tolerance / space.largest_norm()).max(finest));
        self.solve(space, &goal)
    }

    /// Whether ε reaches `bound`, to 1e-12 of the largest wrench norm: stops as soon as either answer is sure. True for
    /// any bound up to 0.
    ///
    /// # Errors
    ///
    /// As [`epsilon`].
    pub fn epsilon_at_least(&mut self, space: &GraspWrenchSpace, bound: f64) -> Result<bool, QualityError> {
        if bound <= 0.0 {
            return Ok(true);
        }
        let tolerance = TOLERANCE * space.scaled_size();
        let scaled = bound / space.largest_norm();
        let goal = Goal {
            too_little: (scaled - tolerance).max(FORCE_CLOSURE_TOLERANCE),
            enough: scaled,
            tolerance: 0.5 * tolerance,
        };
        let bounds = self.solve(space, &goal)?;
        Ok(bounds.lower >= bound - tolerance * space.largest_norm())
    }

    fn solve(&mut self, space: &GraspWrenchSpace, goal: &Goal) -> Result<EpsilonBounds, QualityError> {
        let tolerance = TOLERANCE * space.scaled_size();
        let mut least = Least::new();
        let lower = if let Some(simplex) = first_simplex(space, &mut least, goal.too_little, tolerance) {
            self.grow(space, &simplex, goal, &mut least)?
        } else {
            // A flat space reaches nowhere along its normal, whatever was seen of it.
            if least.reach > goal.too_little {
                least.reach = 0.0;
            }
            0.0
        };
        let size = space.largest_norm();
        let closed = least.reach > FORCE_CLOSURE_TOLERANCE;
        Ok(EpsilonBounds {
            lower: if closed { lower.max(0.0) * size } else { 0.0 },
            upper: if closed { least.reach * size } else { 0.0 },
            limiting_wrench: -space.coordinates().wrench(&least.direction),
        })
    }

    /// Grows a polytope from a simplex until the goal is met: a lower bound, and `least` the upper one.
    fn grow(
        &mut self,
        space: &GraspWrenchSpace,
        simplex: &[[f64; 6]; 7],
        goal: &Goal,
        least: &mut Least,
    ) -> Result<f64, QualityError> {
        let seen_tolerance = SEEN_TOLERANCE * space.scaled_size();
        let n_axes = space.n_axes();
        if !self.frontier.reset(&simplex[..=n_axes], seen_tolerance) {
            least.reach = 0.0;
            return Ok(0.0);
        }
        descend(space, simplex, &self.frontier, goal, least);
        loop {
            // Facets that reach this far need not be looked at.
            let radius = (least.reach - goal.tolerance).min(goal.enough);
            let Some((facet, offset)) = self.frontier.nearest().filter(|(_, offset)| *offset < radius) else {
                return Ok(radius);
            };
            if least.reach <= goal.too_little {
                return Ok(offset);
            }
            if self.frontier.n_facets() > MOST_FACETS || self.frontier.n_points() >= usize::from(u16::MAX) {
                return Err(QualityError::TooManyFacets {
                    what: "epsilon",
                    facets: MOST_FACETS,
                });
            }
            let plane = self.frontier.plane(facet);
            let (reach, point) = space.scaled_support(&plane.normal);
            least.see(reach, &plane.normal);
            if least.reach <= goal.too_little {
                return Ok(offset);
            }
            let radius = (least.reach - goal.tolerance).min(goal.enough);
            let new = plane.height(&point) > seen_tolerance && !self.frontier.has_point(&point);
            if offset < radius && (!new || self.frontier.insert(&point, radius).is_err()) {
                return self.whole.run(space, simplex, goal, least);
            }
        }
    }
}

/// Polytopes with their whole boundary, for each number of axes.
#[derive(Debug, Clone, Default)]
struct Whole(Growth<2>, Growth<3>, Growth<4>, Growth<5>, Growth<6>);

impl Whole {
    fn run(
        &mut self,
        space: &GraspWrenchSpace,
        simplex: &[[f64; 6]; 7],
        goal: &Goal,
        least: &mut Least,
    ) -> Result<f64, QualityError> {
        match space.n_axes() {
            2 => self.0.run(space, simplex, goal, least),
            3 => self.1.run(space, simplex, goal, least),
            4 => self.2.run(space, simplex, goal, least),
            5 => self.3.run(space, simplex, goal, least),
            _ => self.4.run(space, simplex, goal, least),
        }
    }
}

/// When to stop, in scaled units.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Goal {
    /// ε is known not to exceed this.
    pub(crate) too_little: f64,
    /// ε is known to reach this.
    pub(crate) enough: f64,
    /// The bounds are this near.
    pub(crate) tolerance: f64,
}

impl Goal {
    fn new(tolerance: f64) -> Self {
        Self {
            too_little: FORCE_CLOSURE_TOLERANCE,
            enough: f64::INFINITY,
            tolerance,
        }
    }
}

/// ε is exact to this, in units of the largest wrench norm.
pub(crate) const TOLERANCE: f64 = 1e-12;
/// A facet sees a point that is higher than this; well below `TOLERANCE`, so that a facet that asks for a point sees it.
pub(crate) const SEEN_TOLERANCE: f64 = 1e-13;
/// More facets than any sensible grasp asks for (200 contacts: a few thousand); bounds time and memory.
pub(crate) const MOST_FACETS: usize = 400_000;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ConeShape;
    use nalgebra::{Point3, Vector3};

    /// `n` contacts spread over a ball by the golden angle, turned by `shift`.
    fn ball(n: usize, shift: f64) -> Vec<Contact> {
        (0..n)
            .map(|i| {
                let z = 1.0 - (2 * i + 1) as f64 / n as f64;
                let turn = i as f64 * 2.399_963 + shift * (i * i) as f64;
                let r = (1.0 - z * z).sqrt();
                let out = Vector3::new(r * turn.cos(), r * turn.sin(), z);
                Contact::new(i, Point3::from(out), -out, 0.5, 0.0).unwrap()
            })
            .collect()
    }

    fn options() -> QualityOptions {
        QualityOptions::new(Point3::origin(), 1.0)
    }

    #[test]
    fn bounds_hold_epsilon_and_stop_early() {
        let mut solver = EpsilonSolver::default();
        for shift in [0.0, 0.3, 0.7, 1.1] {
            let space = GraspWrenchSpace::new(&ball(6, shift), &options()).unwrap();
            let exact = solver.epsilon(&space).unwrap();
            for tolerance in [1e-12, 1e-6, 1e-2, 0.1, 10.0] {
                let bounds = solver.epsilon_within(&space, tolerance).unwrap();
                assert!(bounds.lower <= exact + 1e-12 && exact <= bounds.upper + 1e-12);
                assert!(bounds.upper - bounds.lower <= tolerance + 1e-12);
            }
            for share in [0.0, 0.5, 0.99, 1.0 - 1e-9] {
                assert!(solver.epsilon_at_least(&space, share * exact).unwrap());
            }
            for share in [1.0 + 1e-9, 1.01, 2.0, 1e9] {
                let bound = share * exact + 1e-11;
                assert!(!solver.epsilon_at_least(&space, bound).unwrap());
            }
        }
    }

    #[test]
    fn the_space_reaches_epsilon_against_the_limiting_wrench() {
        let mut solver = EpsilonSolver::default();
        for shift in [0.0, 0.3, 0.7, 1.1] {
            let space = GraspWrenchSpace::new(&ball(7, shift), &options()).unwrap();
            let bounds = solver.bounds(&space).unwrap();
            assert!((bounds.limiting_wrench.norm() - 1.0).abs() < 1e-12);
            let reach = space.support(&-bounds.limiting_wrench).0;
            assert!((reach - bounds.upper).abs() < 1e-12 && bounds.upper > 0.0);
        }
    }

    /// ε by the polytope that keeps its whole boundary.
    fn by_whole(space: &GraspWrenchSpace) -> f64 {
        let goal = Goal::new(TOLERANCE * space.scaled_size());
        let mut least = Least::new();
        if let Some(simplex) = first_simplex(space, &mut least, goal.too_little, goal.tolerance) {
            Whole::default().run(space, &simplex, &goal, &mut least).unwrap();
        }
        if least.reach > FORCE_CLOSURE_TOLERANCE && least.reach.is_finite() {
            least.reach * space.largest_norm()
        } else {
            0.0
        }
    }

    #[test]
    fn the_whole_boundary_says_the_same() {
        let mut solver = EpsilonSolver::default();
        let mut held = 0;
        // Contacts on the faces of a cube, at points of a lattice: many wrenches lie in one plane.
        let mut number = 1_u32;
        let mut pick = |n: u32| {
            number = number.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (number >> 16) % n
        };
        for n in [4, 5, 6, 7, 9, 12].into_iter().cycle().take(120) {
            let contacts: Vec<Contact> = (0..n)
                .map(|i| {
                    let mut point = Vector3::from_fn(|_, _| f64::from(pick(5)) / 2.0 - 1.0);
                    let (axis, side) = (pick(3) as usize, if pick(2) == 0 { 1.0 } else { -1.0 });
                    point[axis] = side;
                    let mut normal = Vector3::zeros();
                    normal[axis] = -side;
                    Contact::new(i, Point3::from(point), normal, 0.5, 0.0).unwrap()
                })
                .collect();
            let space = GraspWrenchSpace::new(&contacts, &options()).unwrap();
            let exact = solver.epsilon(&space).unwrap();
            assert!((by_whole(&space) - exact).abs() < 1e-12 * space.largest_norm());
            held += usize::from(exact > 0.0);
        }
        assert!((20..100).contains(&held), "{held}");
        for n in 4..9 {
            for shift in 0..6 {
                for norm in [crate::Norm::L1, crate::Norm::LInf] {
                    let options = QualityOptions { norm, ..options() };
                    let n = if norm == crate::Norm::L1 { n } else { n.min(5) };
                    let space = GraspWrenchSpace::new(&ball(n, 0.1 * f64::from(shift)), &options).unwrap();
                    let exact = solver.epsilon(&space).unwrap();
                    assert!((by_whole(&space) - exact).abs() < 1e-12 * space.largest_norm() * n as f64);
                }
            }
        }
    }

    #[test]
    fn smooth_cones_lie_between_their_edges_and_a_wider_cone() {
        let mut solver = EpsilonSolver::default();
        let smooth = QualityOptions {
            cone: ConeShape::Smooth,
            ..options()
        };
        let space = GraspWrenchSpace::new(&ball(5, 0.3), &smooth).unwrap();
        let bounds = solver.bounds(&space).unwrap();
        assert!(bounds.upper - bounds.lower <= SMOOTH_TOLERANCE * space.largest_norm());
        let edged = |edges| {
            let options = QualityOptions {
                cone: ConeShape::Edges(edges),
                ..options()
            };
            let space = GraspWrenchSpace::new(&ball(5, 0.3), &options).unwrap();
            EpsilonSolver::default().epsilon(&space).unwrap()
        };
        // 64 edges reach cos(π/64) of the round cone's friction: 0.12 % of μ |(1, 1)| less.
        assert!(edged(64) <= bounds.upper + 1e-12);
        assert!(edged(64) + 0.0013 * 0.5 * 2.0_f64.sqrt() >= bounds.lower);
    }

    #[test]
    fn a_tolerance_of_nothing_is_an_error() {
        let space = GraspWrenchSpace::new(&ball(4, 0.0), &options()).unwrap();
        for tolerance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let error = EpsilonSolver::default().epsilon_within(&space, tolerance);
            assert!(matches!(error, Err(QualityError::BadTolerance { .. })));
        }
    }
}
