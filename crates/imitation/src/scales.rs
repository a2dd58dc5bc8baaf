//! Units in which features of different kinds can be compared.

use prehend_grasp::Features;
use prehend_model::{Cpd, Model};

use crate::ImitationError;

/// Standard deviation of each dimension over the imitator's training data; distances are measured in these.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    size: [f64; 3],
    cvex: f64,
    egpc: [f64; 2],
    upos: [f64; 3],
    dir: f64,
}

/// A dimension that does not vary gets this share of 1 as its unit, so that equal values stay at distance 0.
const LEAST: f64 = 1e-6;

/// Root mean square of a unit quaternion's four numbers: the one unit of `dir`, since q and −q are one orientation and
/// have no mean.
const DIR: f64 = 0.5;

impl Scales {
    /// The standard deviations by which the imitator's training data were standardised, which its model carries.
    ///
    /// # Errors
    ///
    /// [`ImitationError::Unscaled`] where a node says nothing of its training data, as in a model written by hand;
    /// [`Scales::of`] takes them from grasps instead.
    pub fn of_model(imitator: &Model) -> Result<Self, ImitationError> {
        Ok(Self {
            size: units(imitator, "size")?,
            cvex: units::<1>(imitator, "cvex")?[0],
            egpc: units(imitator, "egpc")?,
            upos: units(imitator, "upos")?,
            dir: DIR,
        })
    }

    /// Standard deviations of grasps: the imitator's training data, or what comes nearest to them.
    pub fn of(rows: &[Features]) -> Self {
        let deviation = |f: &dyn Fn(&Features) -> f64| {
            let n = rows.len().max(1) as f64;
            let mean = rows.iter().map(f).sum::<f64>() / n;
            (rows.iter().map(|r| (f(r) - mean).powi(2)).sum::<f64>() / n)
                .sqrt()
                .max(LEAST)
        };
        Self {
            size: std::array::from_fn(|k| deviation(&|f| f.size[k])),
            cvex: deviation(&|f| f.cvex),
            egpc: std::array::from_fn(|k| deviation(&|f| f.egpc[k])),
            upos: std::array::from_fn(|k| deviation(&|f| f.upos[k])),
            dir: DIR,
        }
    }

    /// Squared distance of two objects: over size and cvex.
    pub fn squared_object_distance(&self, a: &Features, b: &Features) -> f64 {
        (0..3)
            .map(|k| ((a.size[k] - b.size[k]) / self.size[k]).powi(2))
            .sum::<f64>()
            + ((a.cvex - b.cvex) / self.cvex).powi(2)
    }

    /// Squared distance of two actions: over egpc (in [−1, 1] for both hands), upos and dir.
    pub fn squared_action_distance(&self, a: &Features, b: &Features) -> f64 {
        (0..2)
            .map(|k| ((a.egpc[k] - b.egpc[k]) / self.egpc[k]).powi(2))
            .sum::<f64>()
            + (0..3)
                .map(|k| ((a.upos[k] - b.upos[k]) / self.upos[k]).powi(2))
                .sum::<f64>()
            + squared_turn(&a.dir, &b.dir) / self.dir.powi(2)
    }
}

/// The units of a node with `D` dimensions.
fn units<const D: usize>(model: &Model, name: &str) -> Result<[f64; D], ImitationError> {
    match &model.node(model.index(name)?).cpd {
        Cpd::Mixture(mixture) => mixture.scaling.as_ref(),
        _ => None,
    }
    .and_then(|scaling| <[f64; D]>::try_from(scaling.standard_deviation.as_slice()).ok())
    .ok_or_else(|| ImitationError::Unscaled { node: name.into() })
}

/// Squared distance of two orientations as points of the unit sphere in ℝ⁴, the nearer sign: 0 to 2.
fn squared_turn(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    let dot: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum();
    (2.0 - 2.0 * dot.abs()).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model(scaling: &str) -> Model {
        let node = |name: &str, d: usize| {
            let zeros = vec!["0.0"; d].join(",");
            let rows: Vec<String> = (0..d)
                .map(|i| {
                    let row: Vec<&str> = (0..d).map(|j| if i == j { "1.0" } else { "0.0" }).collect();
                    format!("[{}]", row.join(","))
                })
                .collect();
            let columns: Vec<String> = (0..d).map(|k| format!("\"{name}_{k}\"")).collect();
            format!(
                r#"{{"name":"{name}","kind":"gaussian_mixture","columns":[{}],"discrete_parents":[],"continuous_parents":[],{}
                "components":[[{{"weight":1.0,"mean":[{zeros}],"coefficients":[{}],"covariance":[{}]}}]]}}"#,
                columns.join(","),
                if d == 3 { scaling.to_owned() } else { scaling_of(d) },
                vec!["[]"; d].join(","),
                rows.join(",")
            )
        };
        let nodes = [node("size", 3), node("cvex", 1), node("egpc", 2), node("upos", 3)].join(",");
        Model::from_json(&format!(
            r#"{{"format":"prehend-model","version":1,"nodes":[{nodes}]}}"#
        ))
        .unwrap()
    }

    fn scaling_of(d: usize) -> String {
        format!(
            r#""scaling":{{"mean":[{0}],"standard_deviation":[{0}]}},"#,
            vec!["2.0"; d].join(",")
        )
    }

    #[test]
    fn distances_are_in_the_units_of_the_imitators_training_data() {
        let scales = Scales::of_model(&model(&scaling_of(3))).unwrap();
        let here = Features {
            size: [1.0; 3],
            cvex: 1.0,
            egpc: [0.0; 2],
            upos: [0.0; 3],
            dir: [1.0, 0.0, 0.0, 0.0],
            fvol: 0.0,
            fvol_union: 0.0,
            qeps: 0.0,
        };
        let there = Features {
            size: [1.0, 1.0, 5.0],
            upos: [0.0, 2.0, 0.0],
            dir: [0.0, 1.0, 0.0, 0.0],
            ..here
        };
        assert_eq!(scales.squared_object_distance(&here, &there), 4.0);
        assert_eq!(scales.squared_action_distance(&here, &there), 1.0 + 2.0 / 0.25);
    }

    #[test]
    fn a_model_without_units_names_the_node_that_lacks_them() {
        let error = Scales::of_model(&model("")).unwrap_err();
        assert_eq!(
            error.to_string(),
            "node `size` of the imitator's model does not say by which units its training data were standardised; \
             train it with `prehend train`, or take the units from grasps"
        );
    }
}
