//! What ε comes to when contacts, pose and friction are not known exactly.

use nalgebra::{Point3, UnitQuaternion, UnitVector3, Vector3};
use prehend_geometry::ContactPoint;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::{Contact, EpsilonSolver, QualityError, QualityOptions};

/// Standard deviations of what is not known, all normal and independent; each 0 by default.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Uncertainty {
    /// Of each contact point along the surface, in both directions across its normal (length).
    pub contact_position: f64,
    /// Of each contact's normal about both directions across it (rad).
    pub contact_normal: f64,
    /// Of all contacts together along each axis, against the object and its centre (length): the hand stands elsewhere.
    pub pose_translation: f64,
    /// Of all contacts together about each axis through the centre (rad).
    pub pose_rotation: f64,
    /// Of ln μ of each contact by itself: 0.2 is about 20 %.
    pub friction: f64,
    /// Of ln μ of all contacts together: the pair of materials is another one than thought.
    pub friction_common: f64,
}

impl Default for Uncertainty {
    fn default() -> Self {
        Self {
            contact_position: 0.0,
            contact_normal: 0.0,
            pose_translation: 0.0,
            pose_rotation: 0.0,
            friction: 0.0,
            friction_common: 0.0,
        }
    }
}

impl Uncertainty {
    fn check(&self) -> Result<(), QualityError> {
        for (name, value) in [
            ("contact_position", self.contact_position),
            ("contact_normal", self.contact_normal),
            ("pose_translation", self.pose_translation),
            ("pose_rotation", self.pose_rotation),
            ("friction", self.friction),
            ("friction_common", self.friction_common),
        ] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(QualityError::BadUncertainty { name, value });
            }
        }
        Ok(())
    }
}

/// The shares at which [`EpsilonDistribution::quantiles`] are taken.
pub const QUANTILES: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];

/// What ε comes to under [`Uncertainty`].
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct EpsilonDistribution {
    /// Share of the samples in force closure.
    pub probability_of_force_closure: f64,
    /// Wilson's 95 % interval of that share: what the number of samples leaves open.
    pub probability_interval: [f64; 2],
    /// Mean of ε, samples without force closure counting 0.
    pub mean: f64,
    /// Standard deviation of ε.
    pub standard_deviation: f64,
    /// ε at [`QUANTILES`].
    pub quantiles: [f64; 5],
    /// Number of samples.
    pub samples: usize,
}

/// The distribution of ε, from `samples` draws.
///
/// Sample i depends on `seed` and i alone, so more samples extend the fewer. Points move across their normals as they
/// were given: this crate knows no surface, so it suits deviations that are small beside the surface's radii. With all
/// standard deviations 0 every sample is the grasp itself.
///
/// # Errors
///
/// [`QualityError::BadUncertainty`] for a negative or infinite standard deviation, [`QualityError::NoSamples`], and those
/// of [`crate::grasp_quality`].
pub fn epsilon_distribution(
    contacts: &[Contact],
    options: &QualityOptions,
    uncertainty: &Uncertainty,
    samples: usize,
    seed: u64,
) -> Result<EpsilonDistribution, QualityError> {
    uncertainty.check()?;
    if samples == 0 {
        return Err(QualityError::NoSamples);
    }
    let mut solver = EpsilonSolver::default();
    // Errors of the grasp itself name its contacts; a draw cannot add any.
    solver.epsilon_of(contacts, options)?;
    let mut values = Vec::with_capacity(samples);
    let mut drawn = contacts.to_vec();
    for i in 0..samples {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(i as u64);
        draw(contacts, options, uncertainty, &mut rng, &mut drawn);
        values.push(solver.epsilon_of(&drawn, options)?);
    }
    let n = samples as f64;
    let closed = values.iter().filter(|&&e| e > 0.0).count() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|e| (e - mean) * (e - mean)).sum::<f64>() / (n - 1.0).max(1.0);
    values.sort_by(f64::total_cmp);
    Ok(EpsilonDistribution {
        probability_of_force_closure: closed / n,
        probability_interval: wilson(closed / n, n),
        mean,
        standard_deviation: variance.sqrt(),
        quantiles: QUANTILES.map(|q| {
            let at = q * (n - 1.0);
            let (low, high) = (values[at.floor() as usize], values[at.ceil() as usize]);
            low + (high - low) * at.fract()
        }),
        samples,
    })
}

fn draw(
    contacts: &[Contact],
    options: &QualityOptions,
    sd: &Uncertainty,
    rng: &mut ChaCha8Rng,
    drawn: &mut [Contact],
) {
    let mut vector = |scale: f64| {
        let parts: [f64; 3] = std::array::from_fn(|_| StandardNormal.sample(rng));
        Vector3::from(parts) * scale
    };
    let shift = vector(sd.pose_translation);
    let turn = UnitQuaternion::from_scaled_axis(vector(sd.pose_rotation));
    let common = vector(sd.friction_common).x;
    for (contact, drawn) in contacts.iter().zip(drawn) {
        let normal = contact.at.normal;
        let across = |v: Vector3<f64>| v - normal.into_inner() * normal.dot(&v);
        let point = contact.at.point + across(vector(sd.contact_position));
        let tilt = across(vector(sd.contact_normal));
        let slip = vector(sd.friction).x;
        *drawn = Contact {
            at: ContactPoint {
                point: Point3::from(options.center.coords + turn * (point - options.center) + shift),
                normal: UnitVector3::new_normalize(
                    turn * (UnitQuaternion::from_scaled_axis(tilt) * normal.into_inner()),
                ),
            },
            mu: contact.mu * (common + slip).exp(),
            torsion: contact.torsion,
        };
    }
}

/// Wilson's score interval at 95 %.
fn wilson(share: f64, n: f64) -> [f64; 2] {
    const Z: f64 = 1.959_963_984_540_054;
    let middle = (share + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
    let reach = Z / (1.0 + Z * Z / n) * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
    [(middle - reach).max(0.0), (middle + reach).min(1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::GraspWrenchSpace;
    use crate::epsilon;

    fn three() -> Vec<Contact> {
        (0..3)
            .map(|i| {
                let angle = std::f64::consts::TAU * i as f64 / 3.0;
                let out = Vector3::new(angle.cos(), angle.sin(), 0.0);
                Contact::new(i, Point3::from(0.04 * out), -out, 0.3, 0.0).unwrap()
            })
            .collect()
    }

    fn options() -> QualityOptions {
        QualityOptions::new(Point3::origin(), 0.04)
    }

    #[test]
    fn without_uncertainty_every_sample_is_the_grasp_itself() {
        let here = epsilon(&GraspWrenchSpace::new(&three(), &options()).unwrap()).unwrap();
        let d = epsilon_distribution(&three(), &options(), &Uncertainty::default(), 5, 1).unwrap();
        assert_eq!(d.probability_of_force_closure, 1.0);
        for value in d.quantiles.into_iter().chain([d.mean]) {
            assert!((value - here).abs() < 1e-12, "{value} {here}");
        }
        assert!(d.standard_deviation < 1e-12);
    }

    #[test]
    fn turning_everything_about_the_centre_changes_little_and_moving_it_away_much() {
        let here = epsilon(&GraspWrenchSpace::new(&three(), &options()).unwrap()).unwrap();
        let with = |u: Uncertainty| epsilon_distribution(&three(), &options(), &u, 400, 7).unwrap();
        let turned = with(Uncertainty {
            pose_rotation: 0.5,
            ..Uncertainty::default()
        });
        assert_eq!(turned.probability_of_force_closure, 1.0);
        // Eight edges change a cone's reach by up to 1 − cos 22.5° = 8 % of its friction.
        assert!((turned.mean / here - 1.0).abs() < 0.2, "{turned:?} {here}");
        let moved = with(Uncertainty {
            pose_translation: 0.02,
            ..Uncertainty::default()
        });
        assert!(moved.mean < 0.8 * here, "{moved:?}");
        let tilted = with(Uncertainty {
            contact_normal: 0.15,
            ..Uncertainty::default()
        });
        let p = tilted.probability_of_force_closure;
        assert!(p > 0.2 && p < 0.9, "{tilted:?}");
        let [low, high] = tilted.probability_interval;
        assert!(low < p && p < high && high - low < 0.11);
    }

    #[test]
    fn the_seed_decides_and_more_samples_extend_the_fewer() {
        let u = Uncertainty {
            friction: 0.3,
            friction_common: 0.2,
            contact_position: 0.004,
            ..Uncertainty::default()
        };
        let run = |n, seed| epsilon_distribution(&three(), &options(), &u, n, seed).unwrap();
        assert_eq!(run(50, 3), run(50, 3));
        assert_ne!(run(50, 3), run(50, 4));
        let (few, more) = (run(1, 3), run(2, 3));
        // Two samples lie 5/90 of their distance beyond the outer quantiles.
        let beyond = (more.quantiles[4] - more.quantiles[0]) / 18.0;
        let ends = [more.quantiles[0] - beyond, more.quantiles[4] + beyond];
        assert!(
            ends.iter().any(|e| (e - few.mean).abs() < 1e-12),
            "{ends:?} {few:?}"
        );
    }

    #[test]
    fn bad_settings_are_named() {
        let u = Uncertainty {
            friction: -0.1,
            ..Uncertainty::default()
        };
        let error = epsilon_distribution(&three(), &options(), &u, 5, 1).unwrap_err();
        assert_eq!(
            error.to_string(),
            "uncertainty: `friction` is -0.1; expected a finite standard deviation of at least 0"
        );
        let none = epsilon_distribution(&three(), &options(), &Uncertainty::default(), 0, 1).unwrap_err();
        assert_eq!(none.to_string(), "0 samples say nothing; ask for at least 1");
    }
}
