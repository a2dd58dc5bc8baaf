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
    // Few facets are nearer than a bound that is small and enough.
    if space.n_axes() < 6 || goal.enough < 0.5 * least.reach {
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
    let mut cones = [None; 7];
    for start in starts {
        let mut here = Least {
            reach: f64::INFINITY,
            direction: start,
        };
        for _ in 0..RAYS {
            let before = here.reach;
            let ray = here.direction;
            let hit = hit(&planes, &ray);
            if cones[hit].is_none() {
                cones[hit] = inverse_without(simplex, hit);
            }
            let Some(cone) = cones[hit] else {
                break;
            };
            let Some(cone) = leave(space, cone, &ray, goal.tolerance, &mut here) else {
                break;
            };
            // Where the cone of the facet's corners holds its normal, the next ray would leave there again.
            let settled = cone.iter().all(|row| dot(row, &here.direction) >= 0.0);
            if settled || here.reach >= before * (1.0 - 1e-9) {
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

/// The facet of the simplex that the ray leaves through.
fn hit(planes: &[Hyperplane<6>; 7], ray: &[f64; 6]) -> usize {
    let mut hit = (0, f64::NEG_INFINITY);
    for (i, plane) in planes.iter().enumerate() {
        let steepness = dot(&plane.normal, ray) / plane.offset;
        if steepness > hit.1 {
            hit = (i, steepness);
        }
    }
    hit.0
}

/// Finds the facet that the ray leaves through, from six corners whose cone holds the ray; none where that takes too
/// long. Cones are inverses of matrices whose columns are the corners.
fn leave(
    space: &GraspWrenchSpace,
    mut inverse: [[f64; 6]; 6],
    ray: &[f64; 6],
    tolerance: f64,
    least: &mut Least,
) -> Option<[[f64; 6]; 6]> {
    // Enough for any space of contacts; a bound, since rounding could turn in circles.
    for _ in 0..60 {
        let polar: [f64; 6] = std::array::from_fn(|k| inverse.iter().map(|r| r[k]).sum());
        let length = dot(&polar, &polar).sqrt();
        let direction = polar.map(|c| c / length);
        let (reach, point) = space.scaled_support(&direction);
        least.see(reach, &direction);
        if reach - 1.0 / length <= tolerance {
            return Some(inverse);
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
            return None;
        }
        let taken = inverse[j].map(|c| c / pivot);
        for (row, (_, of_point)) in inverse.iter_mut().zip(shares) {
            for k in 0..6 {
                row[k] -= of_point * taken[k];
            }
        }
        inverse[j] = taken;
    }
    None
}

/// Inverse of the matrix whose columns are the simplex's corners but one.
fn inverse_without(simplex: &[[f64; 6]; 7], left_out: usize) -> Option<[[f64; 6]; 6]> {
    let corner = |j: usize| &simplex[j + usize::from(j >= left_out)];
    let matrix = nalgebra::Matrix6::from_fn(|r, c| corner(c)[r]);
    let inverse = matrix.try_inverse()?;
    Some(std::array::from_fn(|r| std::array::from_fn(|c| inverse[(r, c)])))
}
