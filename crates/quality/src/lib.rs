//! How well do these contacts hold?
//!
//! A contact pushes on the object with a unit normal force and whatever friction allows. Written as wrenches about the
//! object's centre, all that the contacts can do together is a convex set in six dimensions, the grasp wrench space.
//! The largest ball about the origin inside it has the radius **ε**: any disturbance smaller than that can be resisted,
//! from whichever side it comes. ε = 0 means that some push meets no resistance, however hard the fingers press.
//!
//! ```text
//! contacts ──friction cones──▶ wrenches ──▶ GraspWrenchSpace ──support function──▶ ε, distance of the origin, volume
//! ```
//!
//! [`grasp_quality`] answers everything at once; [`EpsilonSolver`] answers only ε, thousands of times a second.
//! [`TaskWrenches`] puts a task's own disturbances in the place of the ball, [`epsilon_sensitivity`] says which contact to
//! move, [`epsilon_distribution`] what remains of ε when contacts, pose and friction are not known exactly, and
//! [`internal_forces`] how hard each contact presses when the hand squeezes and the object stays.
//! This crate knows points and normals. It never knows about hands.
//!
//! # Examples
//!
//! Three fingers, 120° apart round the middle of a ball, hold it:
//!
//! ```
//! use nalgebra::{Point3, Vector3};
//! use prehend_quality::{Contact, Material, QualityOptions, friction_coefficient, grasp_quality};
//!
//! let mu = friction_coefficient(Material::Rubber, Material::Plastic);
//! let contacts: Vec<Contact> = (0..3)
//!     .map(|i| {
//!         let angle = std::f64::consts::TAU * i as f64 / 3.0;
//!         let out = Vector3::new(angle.cos(), angle.sin(), 0.0);
//!         Contact::new(i, Point3::from(0.04 * out), -out, mu, 0.0)
//!     })
//!     .collect::<Result<_, _>>()?;
//! let quality = grasp_quality(&contacts, &QualityOptions::new(Point3::origin(), 0.04))?;
//! assert!(quality.force_closure);
//! assert!(quality.epsilon > 0.3 && quality.epsilon < 0.6);
//! # Ok::<(), prehend_quality::QualityError>(())
//! ```

mod contact;
mod error;
mod material;
mod soft_contact;

mod coordinates;
mod options;

mod friction_cone;
mod wrench_space;

mod edges;
mod facet;
mod frontier;
mod hyperplane;
mod polytope;

mod descent;
mod start;

mod epsilon;
mod growth;
mod min_norm;
mod volume;

mod internal_forces;
mod nnls;

mod quality;
mod sensitivity;
mod task;
mod uncertainty;

pub use contact::Contact;
pub use coordinates::{WrenchAxes, WrenchMetric};
pub use epsilon::{EpsilonBounds, EpsilonSolver, FORCE_CLOSURE_TOLERANCE, SMOOTH_TOLERANCE, epsilon};
pub use error::QualityError;
pub use friction_cone::Wrench;
pub use internal_forces::{ContactForce, InternalForces, internal_forces};
pub use material::{Material, friction_coefficient};
pub use min_norm::origin_distance;
pub use options::{ConeShape, LengthUnit, LimitSurface, Norm, QualityOptions};
pub use quality::{Quality, grasp_quality, grasp_quality_with, wrench_rank};
pub use sensitivity::{ContactSensitivity, epsilon_sensitivity};
pub use soft_contact::{DEGENERATE_RADIUS, soft_torsion, soft_torsion_default};
pub use task::{TaskScale, TaskWrenches};
pub use uncertainty::{EpsilonDistribution, QUANTILES, Uncertainty, epsilon_distribution};
pub use wrench_space::GraspWrenchSpace;
