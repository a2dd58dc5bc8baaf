//! Volume of the wrench space: the one measure that needs the whole hull.

use crate::epsilon::{SEEN_TOLERANCE, TOLERANCE};
use crate::growth::{longer, shorter};
use crate::polytope::Polytope;
use crate::start::{Least, first_simplex};
use crate::{GraspWrenchSpace, QualityError};

/// Volume of the wrench space over the axes that count, 0 for a flat one; measured by the metric where there is one
/// (the ellipsoid wᵀ M w ≤ 1 has the volume of the unit ball).
///
/// Grows the polytope at every facet, until none has a point beyond it. Takes milliseconds for a few contacts and
/// seconds for dozens.
///
/// # Errors
///
/// [`QualityError::TooManyFacets`] past a million facets, [`QualityError::SmoothVolume`] where a contact is smooth.
pub(crate) fn volume(space: &GraspWrenchSpace) -> Result<f64, QualityError> {
    if !space.is_polyhedral() {
        return Err(QualityError::SmoothVolume);
    }
    match space.n_axes() {
        2 => grown::<2>(space),
        3 => grown::<3>(space),
        4 => grown::<4>(space),
        5 => grown::<5>(space),
        _ => grown::<6>(space),
    }
}

fn grown<const D: usize>(space: &GraspWrenchSpace) -> Result<f64, QualityError> {
    let tolerance = TOLERANCE * space.scaled_size();
    let mut polytope = Polytope::<D>::default();
    let started =
        first_simplex(space, &mut Least::new(), f64::NEG_INFINITY, tolerance).is_some_and(|simplex| {
            let simplex = simplex.map(|p| shorter(&p));
            polytope.reset(&simplex[..=D], SEEN_TOLERANCE * space.scaled_size())
        });
    if !started {
        return Ok(0.0);
    }
    let mut open = polytope.created().to_vec();
    while let Some(id) = open.pop() {
        let Some(&plane) = polytope.plane(id) else {
            continue;
        };
        let (_, point) = space.scaled_support(&longer(&plane.normal));
        let point = shorter(&point);
        if plane.height(&point) <= tolerance || polytope.has_point(&point) {
            continue;
        }
        polytope.insert(&point, id, "volume", MOST_FACETS)?;
        open.extend_from_slice(polytope.created());
    }
    Ok(polytope.volume() * space.largest_norm().powi(D as i32))
}

/// Bounds memory at about 150 MB.
const MOST_FACETS: usize = 1_000_000;
