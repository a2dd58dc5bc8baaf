//! Volume of the wrench space: the one measure that needs the whole hull.

use crate::epsilon::{SEEN_TOLERANCE, TOLERANCE, first_simplex};
use crate::polytope::Polytope;
use crate::{GraspWrenchSpace, QualityError};

/// Six-dimensional volume of the wrench space, 0 for a flat one.
///
/// Grows the polytope at every facet, until none has a point beyond it. Takes milliseconds for a few contacts and
/// seconds for dozens.
///
/// # Errors
///
/// [`QualityError::TooManyFacets`] past a million facets.
pub(crate) fn volume(space: &GraspWrenchSpace) -> Result<f64, QualityError> {
    let Some(simplex) = first_simplex(space, &mut Vec::new(), |_| true) else {
        return Ok(0.0);
    };
    let mut polytope = Polytope::default();
    if !polytope.reset(&simplex, SEEN_TOLERANCE * space.scaled_size()) {
        return Ok(0.0);
    }
    let tolerance = TOLERANCE * space.scaled_size();
    let mut open = polytope.created().to_vec();
    while let Some(id) = open.pop() {
        let Some(&plane) = polytope.plane(id) else {
            continue;
        };
        let (_, point) = space.scaled_support(&plane.normal);
        if plane.height(&point) <= tolerance || polytope.has_corner(id, &point) {
            continue;
        }
        if polytope.n_facets() > MOST_FACETS {
            return Err(QualityError::TooManyFacets {
                what: "volume",
                facets: MOST_FACETS,
            });
        }
        polytope.insert(&point, id);
        open.extend_from_slice(polytope.created());
    }
    Ok(polytope.volume() * space.largest_norm().powi(6))
}

/// Bounds memory at about 150 MB.
const MOST_FACETS: usize = 1_000_000;
