//! The posterior of a node of unit vectors: again a mixture of von Mises–Fisher distributions.
//!
//! Such a node has discrete parents and no children. Unobserved, it is distributed as its mixtures of all configurations,
//! each with the posterior probability of the configuration.

use nalgebra::DVector;
use serde_json::{Value, json};

use crate::cpd::Cpd;
use crate::error::ModelError;
use crate::evidence::{Evidence, unit_vector};
use crate::model::Model;
use crate::von_mises_fisher::{VonMisesFisher, log_mixture};

/// What is known of a direction.
#[derive(Debug, Clone, PartialEq)]
pub struct DirectionPosterior {
    /// Natural logarithm of the density of the evidence.
    pub log_evidence: f64,
    /// The mixture; weights sum to 1.
    pub components: Vec<VonMisesFisher>,
    name: String,
}

impl Model {
    /// The posterior of a von Mises–Fisher node.
    ///
    /// # Errors
    ///
    /// The node is unknown, of another kind, or observed; otherwise as [`Model::query`].
    ///
    /// # Examples
    ///
    /// ```
    /// use prehend_model::{Evidence, Model};
    ///
    /// let model = Model::from_json(r#"{ "format": "prehend-model", "version": 1, "nodes": [
    ///     { "name": "task", "kind": "discrete", "states": ["pour", "use"], "table": [[0.5, 0.5]] },
    ///     { "name": "upos", "kind": "von_mises_fisher_mixture", "columns": ["x", "y", "z"], "discrete_parents": ["task"],
    ///       "components": [[{ "weight": 1.0, "direction": [0, 0, 1], "concentration": 9.0 }],
    ///                      [{ "weight": 1.0, "direction": [1, 0, 0], "concentration": 4.0 }]] }] }"#)?;
    /// let evidence = Evidence::new().with_state(&model, "task", "pour")?;
    /// let answer = model.query_direction("upos", &evidence)?;
    /// assert!(answer.log_density(&[0.0, 0.0, 1.0])? > answer.log_density(&[1.0, 0.0, 0.0])?);
    /// # Ok::<(), prehend_model::ModelError>(())
    /// ```
    pub fn query_direction(&self, name: &str, evidence: &Evidence) -> Result<DirectionPosterior, ModelError> {
        let idx = self.index(name)?;
        let refuse = |found: &str, expected: &str| ModelError::BadValue {
            node: name.into(),
            found: found.into(),
            expected: expected.into(),
        };
        let Cpd::VonMisesFisher(cpd) = &self.node(idx).cpd else {
            return Err(refuse(
                "a node of another kind",
                "a von_mises_fisher_mixture; ask `posterior` about others",
            ));
        };
        if evidence.get(idx).is_some() {
            return Err(refuse("an observed node as target", "evidence without it"));
        }
        let parents: Vec<&str> = cpd
            .discrete_parents
            .iter()
            .map(|&parent| self.node(parent).name.as_str())
            .collect();
        let answer = self.query(&parents, evidence)?;
        let mut states = vec![0; self.nodes().len()];
        let mut components = Vec::new();
        for term in &answer.terms {
            for (&parent, &state) in cpd.discrete_parents.iter().zip(&term.states) {
                states[parent.0] = state;
            }
            let share = term.log_weight.exp();
            components.extend(
                cpd.components[self.configuration(idx, &states)]
                    .iter()
                    .map(|component| VonMisesFisher {
                        weight: share * component.weight,
                        ..component.clone()
                    }),
            );
        }
        Ok(DirectionPosterior {
            log_evidence: answer.log_evidence,
            components,
            name: name.into(),
        })
    }
}

impl DirectionPosterior {
    /// log density on the sphere at a unit vector.
    ///
    /// # Errors
    ///
    /// The point is no unit vector of the node's dimension.
    pub fn log_density(&self, point: &[f64]) -> Result<f64, ModelError> {
        let d = self
            .components
            .first()
            .map_or(0, |component| component.direction.len());
        if point.len() != d {
            return Err(ModelError::BadValue {
                node: self.name.clone(),
                found: format!("the point {point:?}"),
                expected: format!("{d} numbers"),
            });
        }
        Ok(log_mixture(&self.components, &unit_vector(&self.name, point)?))
    }

    /// Mean vector, in the unit ball: its length says how much the directions agree.
    pub fn mean(&self) -> DVector<f64> {
        let d = self
            .components
            .first()
            .map_or(0, |component| component.direction.len());
        self.components.iter().fold(DVector::zeros(d), |mean, component| {
            let length = crate::bessel::bessel_ratio(0.5 * d as f64 - 1.0, component.concentration);
            mean + component.weight * length * &component.direction
        })
    }

    /// The answer as JSON, with `log_density_sphere` at the given points.
    ///
    /// # Errors
    ///
    /// As [`DirectionPosterior::log_density`].
    pub fn to_json_at(&self, at: &[Vec<f64>]) -> Result<String, ModelError> {
        let components: Vec<Value> = self
            .components
            .iter()
            .map(|c| json!({ "weight": c.weight, "direction": c.direction.as_slice(), "concentration": c.concentration }))
            .collect();
        let mut out = json!({
            "log_evidence": self.log_evidence,
            "mean": self.mean().as_slice(),
            "components": components,
        });
        if !at.is_empty() {
            let densities: Vec<f64> = at
                .iter()
                .map(|point| self.log_density(point))
                .collect::<Result<_, _>>()?;
            out["log_density_sphere"] = json!(densities);
        }
        Ok(out.to_string())
    }
}
