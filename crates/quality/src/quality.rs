//! Everything that is asked about a grasp's contacts, at once.

use faer::Mat;

use crate::volume::volume;
use crate::{
    Contact, EpsilonSolver, GraspWrenchSpace, QualityError, QualityOptions, Wrench, origin_distance,
};

/// How well contacts hold; see [`grasp_quality`].
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Quality {
    /// Radius of the largest origin-centred ball inside the wrench space; 0 without force closure.
    pub epsilon: f64,
    /// Whether `epsilon` exceeds [`crate::FORCE_CLOSURE_TOLERANCE`] × the largest wrench norm.
    pub force_closure: bool,
    /// Distance from the origin to the wrench space; 0 where the origin lies in it.
    pub origin_distance: f64,
    /// Rank of the matrix of all wrenches over the axes that count. Below their number (6) some push meets no resistance
    /// at all.
    pub rank: usize,
    /// The disturbance, of norm 1, that the contacts resist least, `[fx fy fz τx τy τz]`: they can answer ε × this much
    /// of it. Without force closure, one that they cannot answer at all.
    pub limiting_wrench: Wrench,
    /// Six-dimensional volume of the wrench space, where it was asked for; 0 for a flat one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volume: Option<f64>,
}

/// Measures a grasp by its contacts.
///
/// Contacts that do not hold give ε = 0, whatever the reason: a flat wrench space (one contact, two point contacts, no
/// friction on a ball), the origin outside, or on the boundary. Doubled contacts change nothing but time.
///
/// # Errors
///
/// Those of [`GraspWrenchSpace::new`], which name the offending contact, and [`QualityError::TooManyFacets`].
///
/// # Source
///
/// ε: Ferrari and Canny, ICRA 1992. Wrenches: `docs/conventions.md`.
///
/// # Examples
///
/// ```
/// use nalgebra::{Point3, Vector3};
/// use prehend_quality::{Contact, QualityOptions, grasp_quality};
///
/// // Two fingertips that carry torsion, pinching a 40 mm cube.
/// let left = Contact::new(0, Point3::new(-0.02, 0.0, 0.0), Vector3::x(), 1.0, 2.13e-3)?;
/// let right = Contact::new(1, Point3::new(0.02, 0.0, 0.0), -Vector3::x(), 1.0, 2.13e-3)?;
/// let options = QualityOptions::new(Point3::origin(), 0.0346);
/// assert!(grasp_quality(&[left, right], &options)?.force_closure);
///
/// // Without torsion nothing stops the cube from turning about the line between them.
/// let hard = [left, right].map(|c| Contact { torsion: 0.0, ..c });
/// let quality = grasp_quality(&hard, &options)?;
/// assert_eq!((quality.epsilon, quality.rank), (0.0, 5));
/// # Ok::<(), prehend_quality::QualityError>(())
/// ```
pub fn grasp_quality(contacts: &[Contact], options: &QualityOptions) -> Result<Quality, QualityError> {
    grasp_quality_with(contacts, options, &mut EpsilonSolver::default())
}

/// [`grasp_quality`] with a solver that is kept from one grasp to the next.
///
/// # Errors
///
/// As [`grasp_quality`].
pub fn grasp_quality_with(
    contacts: &[Contact],
    options: &QualityOptions,
    solver: &mut EpsilonSolver,
) -> Result<Quality, QualityError> {
    let space = GraspWrenchSpace::new(contacts, options)?;
    let bounds = solver.bounds(&space)?;
    let epsilon = if space.is_polyhedral() {
        bounds.upper
    } else {
        bounds.lower
    };
    let force_closure = epsilon > 0.0;
    // A ball in the space has room along every axis, far above what the rank counts as 0.
    let (rank, origin_distance) = if force_closure {
        (options.axes.count(), 0.0)
    } else {
        (wrench_rank(&space), origin_distance(&space))
    };
    let volume = if options.volume {
        Some(volume(&space)?)
    } else {
        None
    };
    Ok(Quality {
        epsilon,
        force_closure,
        origin_distance,
        rank,
        limiting_wrench: bounds.limiting_wrench,
        volume,
    })
}

/// Rank of the matrix of wrenches, over the axes that count.
///
/// Forces and torques are first brought to one size: torques are divided by the largest that the contacts' arms could
/// give, so that rounding errors in vanishing torques stay small. Singular values up to 1e-11 of the largest count as 0.
pub fn wrench_rank(space: &GraspWrenchSpace) -> usize {
    let (force, torque) = space.block_sizes();
    let torque = if torque > 0.0 { torque } else { 1.0 };
    let wrenches = space.wrenches();
    let axes = space.coordinates().axes();
    // R of Qᵀ has the singular values of the wide matrix, in a 6 × 6 block.
    let tall = Mat::from_fn(wrenches.len(), axes.len(), |i, k| {
        wrenches[i][axes[k]] / if axes[k] < 3 { force } else { torque }
    });
    let r = tall.qr();
    let Ok(singular_values) = r.thin_R().to_owned().singular_values() else {
        return 0;
    };
    let largest = singular_values.iter().copied().fold(0.0, f64::max);
    singular_values.iter().filter(|&&s| s > 1e-11 * largest).count()
}
