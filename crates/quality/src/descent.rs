//! A good upper bound of ε before anything is grown.
//!
//! From the origin a ray leaves the space through some facet. The ray along that facet's normal leaves it no farther
//! out than the facet's plane, so the facet it leaves through is nearer, or the same. Going on like this ends at a
//! facet that is nearest among those around it.
//!
//! The facet that a ray leaves through is found by the dual simplex method: six corners whose cone holds the ray; the
//! support point over their plane takes the place of one of them, such that the cone still holds it.

use crate::GraspWrenchSpace;
use crate::epsilon::{FORCE_CLOSURE_TOLERANCE, Goal};
use crate::frontier::Frontier;
use crate::hyperplane::{Hyperplane, dot};
use crate::start::Least;

/// Tells `least` of the facets that rays downhill leave through, starting at the direction that it has and at facets of
/// the simplex that the frontier was started from; nothing is done unless that holds the origin.
pub(crate) fn descend(
    space: &GraspWrenchSpace,
    simplex: &[[f64; 6]; 7],
    frontier: &Frontier,
    goal: &Goal,
    least: &mut Least,
) {
    if space.n_axes() < 6 {
        return;
    }
    let planes: [Hyperplane<6>; 7] = std::array::from_fn(|place| frontier.plane(place));
    if planes.iter().any(|p| p.offset <= FORCE_CLOSURE_TOLERANCE) {
        return;
    }
    let starts = [
        least.direction,
        planes[0].normal,
        planes[1].normal,
        planes[2].normal,
    ];
    // Where some bound is enough, few facets are nearer than that.
    let n_starts = if goal.enough < f64::INFINITY {
        1
    } else {
        starts.len()
    };
    for start in starts.into_iter().take(n_starts) {
        let mut here = Least {
            reach: f64::INFINITY,
            direction: start,
        };
        for _ in 0..RAYS {
            let before = here.reach;
            let ray = here.direction;
            let left = leave(space, simplex, &planes, &ray, goal.tolerance, &mut here);
            if !left || here.reach >= before * (1.0 - 1e-9) {
                break;
            }
        }
        least.see(here.reach, &here.direction);
        if least.reach <= goal.too_little {
            return;
        }
    }
}

/// Rays from one start; later ones gain little.
const RAYS: usize = 4;

/// Finds the facet that the ray leaves through; false where that takes too long.
fn leave(
    space: &GraspWrenchSpace,
    simplex: &[[f64; 6]; 7],
    planes: &[Hyperplane<6>; 7],
    ray: &[f64; 6],
    tolerance: f64,
    least: &mut Least,
) -> bool {
    let mut hit = (0, f64::NEG_INFINITY);
    for (i, plane) in planes.iter().enumerate() {
        let steepness = dot(&plane.normal, ray) / plane.offset;
        if steepness > hit.1 {
            hit = (i, steepness);
        }
    }
    let Some(mut inverse) = inverse_without(simplex, hit.0) else {
        return false;
    };
    // Enough for any space of contacts; a bound, since rounding could turn in circles.
    for _ in 0..60 {
        let polar: [f64; 6] = std::array::from_fn(|k| inverse.iter().map(|r| r[k]).sum());
        let length = dot(&polar, &polar).sqrt();
        let direction = polar.map(|c| c / length);
        let (reach, point) = space.scaled_support(&direction);
        least.see(reach, &direction);
        if reach - 1.0 / length <= tolerance {
            return true;
        }
        let mut leaving = (0, f64::INFINITY, 0.0);
        let shares = inverse.map(|row| (dot(&row, ray), dot(&row, &point)));
        for (j, (of_ray, of_point)) in shares.iter().enumerate() {
            if *of_point > 1e-12 && of_ray / of_point < leaving.1 {
                leaving = (j, of_ray / of_point, *of_point);
            }
        }
        let (j, _, pivot) = leaving;
        if pivot == 0.0 {
            return false;
        }
        let taken = inverse[j].map(|c| c / pivot);
        for (row, (_, of_point)) in inverse.iter_mut().zip(shares) {
            for k in 0..6 {
                row[k] -= of_point * taken[k];
            }
        }
        inverse[j] = taken;
    }
    false
}

/// Inverse of the matrix whose columns are the simplex's corners but one.
fn inverse_without(simplex: &[[f64; 6]; 7], left_out: usize) -> Option<[[f64; 6]; 6]> {
    let corner = |j: usize| &simplex[j + usize::from(j >= left_out)];
    let matrix = nalgebra::Matrix6::from_fn(|r, c| corner(c)[r]);
    let inverse = matrix.try_inverse()?;
    Some(std::array::from_fn(|r| std::array::from_fn(|c| inverse[(r, c)])))
}
