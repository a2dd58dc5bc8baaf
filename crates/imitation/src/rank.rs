//! Step 2: which object, and which grasp?

use prehend_grasp::Features;
use prehend_model::{BatchQuery, Evidence, Model, RowPosterior};

use crate::recognise::{evidence, task_posterior, values};
use crate::{ImitationError, Scales};

/// Squared distances in units of standard deviations count as at least this: closer than a tenth of a deviation is
/// equal, and Eq. 4 stays finite.
pub const SQUARED_DISTANCE_FLOOR: f64 = 0.01;

const OBJECT_NODES: [&str; 2] = ["size", "cvex"];
const ACTION_NODES: [&str; 5] = ["size", "cvex", "egpc", "upos", "dir"];
const ALL_NODES: [&str; 7] = ["size", "cvex", "egpc", "upos", "dir", "fvol", "qeps"];

/// A grasp that the imitator could make. For [`rank_objects`] any grasp of an object stands for it.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The grasp.
    pub grasp_id: String,
    /// The object.
    pub object: String,
    /// Its features.
    pub features: Features,
}

/// Which similarity enters Eq. 5.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Similarity {
    /// S divided by its largest value over the candidates: λ weighs two numbers in [0, 1].
    #[default]
    Scaled,
    /// The literal S of Eq. 4.
    Raw,
}

/// How task and similarity are weighed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weighing {
    /// λ of Eq. 5, in [0, 1]: weight of P(t̂ | …); the paper uses 0.8.
    pub lambda: f64,
    /// Which similarity enters.
    pub similarity: Similarity,
}

impl Default for Weighing {
    fn default() -> Self {
        Self {
            lambda: 0.8,
            similarity: Similarity::Scaled,
        }
    }
}

/// A candidate with its scores.
#[derive(Debug, Clone, PartialEq)]
pub struct Ranked {
    /// Which candidate: an index into the slice that was ranked.
    pub candidate_idx: usize,
    /// Pᴿ(t̂ | o) of an object, Pᴿ(t̂ | o, a, c) of a grasp.
    pub p_task: f64,
    /// S over its largest value among the candidates, in [0, 1].
    pub similarity: f64,
    /// The literal S of Eq. 4, in standardised units; may overflow to infinity where a density does.
    pub similarity_raw: f64,
    /// λ P + (1 − λ) S, Eq. 5.
    pub total: f64,
}

/// Objects, best total first; equal totals keep their order.
///
/// ```text
/// S(o) = pᴿ(o | t̂) / max(‖oᴴ − o‖², floor)          (Eq. 4)
/// total = λ Pᴿ(t̂ | o) + (1 − λ) S(o) / max S          (Eq. 5)
/// ```
///
/// # Errors
///
/// [`ImitationError::NoCandidates`], [`ImitationError::Lambda`], and the model's own.
///
/// # Source
///
/// Paper, section VI-C, step 2.1, Eqs. 4 and 5; our reading in `docs/paper-map.md`.
pub fn rank_objects(
    imitator: &Model,
    task: &str,
    shown: &Features,
    objects: &[Candidate],
    scales: &Scales,
    weighing: Weighing,
) -> Result<Vec<Ranked>, ImitationError> {
    let scored = objects
        .iter()
        .map(|candidate| {
            let seen = evidence(imitator, &candidate.features, &OBJECT_NODES)?;
            let log_density = log_density_given(imitator, task, &seen, &Evidence::new())?;
            let distance = scales.squared_object_distance(shown, &candidate.features);
            Ok((
                task_posterior(imitator, &seen)?.of(task),
                log_similarity(log_density, distance),
            ))
        })
        .collect::<Result<Vec<_>, ImitationError>>()?;
    weigh(scored, weighing, "object")
}

/// Grasps, best total first; equal totals keep their order. Give the grasps of the chosen object for the paper's
/// step 2.2, or those of all objects for the joint choice; with λ = 1 that is Eq. 3.
///
/// ```text
/// S(a) = pᴿ(a | t̂, o) / max(‖aᴴ − a‖², floor)        (Eq. 4)
/// total = λ Pᴿ(t̂ | o, a, c) + (1 − λ) S(a) / max S     (Eq. 5)
/// ```
///
/// # Errors
///
/// As [`rank_objects`].
///
/// # Source
///
/// Paper, section VI-C, step 2.2, Eqs. 3 to 5.
pub fn rank_grasps(
    imitator: &Model,
    task: &str,
    shown: &Features,
    grasps: &[Candidate],
    scales: &Scales,
    weighing: Weighing,
) -> Result<Vec<Ranked>, ImitationError> {
    let state = state(imitator, task)?;
    let of_object = answers(imitator, grasps, &OBJECT_NODES)?;
    let of_action = answers(imitator, grasps, &ACTION_NODES)?;
    let of_all = answers(imitator, grasps, &ALL_NODES)?;
    let scored = (0..grasps.len())
        .map(|i| {
            let log_density = if let (Some(action), Some(object)) =
                (joint(&of_action[i], state), joint(&of_object[i], state))
            {
                action - object
            } else {
                // Too small for a probability.
                let object = evidence(imitator, &grasps[i].features, &OBJECT_NODES)?;
                let action = evidence(imitator, &grasps[i].features, &ACTION_NODES)?;
                log_density_given(imitator, task, &action, &object)?
            };
            let distance = scales.squared_action_distance(shown, &grasps[i].features);
            Ok((of_all[i].posterior[state], log_similarity(log_density, distance)))
        })
        .collect::<Result<Vec<_>, ImitationError>>()?;
    weigh(scored, weighing, "grasp")
}

/// Which of the model's tasks this is.
fn state(model: &Model, task: &str) -> Result<usize, ImitationError> {
    Evidence::new().with_state(model, "task", task)?;
    let states = model.node(model.index("task")?).states();
    Ok(states.iter().position(|s| s == task).unwrap_or(0))
}

/// P(T | the named nodes) of every candidate, and the density of these.
fn answers(
    model: &Model,
    candidates: &[Candidate],
    nodes: &[&str],
) -> Result<Vec<RowPosterior>, ImitationError> {
    let Some(first) = candidates.first() else {
        return Ok(Vec::new());
    };
    // Says which node has another dimension than its feature.
    evidence(model, &first.features, nodes)?;
    let known = |node: &&(&str, Vec<f64>)| nodes.contains(&node.0) && model.index(node.0).is_ok();
    let names: Vec<&str> = values(&first.features)
        .iter()
        .filter(known)
        .map(|v| v.0)
        .collect();
    let rows: Vec<Vec<f64>> = candidates
        .iter()
        .map(|candidate| {
            let values = values(&candidate.features);
            values.iter().filter(known).flat_map(|v| v.1.clone()).collect()
        })
        .collect();
    let answers = BatchQuery::new(model, "task", &names)?.run(&rows);
    Ok(answers.into_iter().collect::<Result<_, _>>()?)
}

/// log p(task, what was seen); `None` where the task's probability is too small for a number.
fn joint(answer: &RowPosterior, state: usize) -> Option<f64> {
    let log_task = answer.posterior[state].ln();
    log_task.is_finite().then_some(answer.log_evidence + log_task)
}

/// log p(seen | task, given): `seen` must contain `given`.
fn log_density_given(
    model: &Model,
    task: &str,
    seen: &Evidence,
    given: &Evidence,
) -> Result<f64, ImitationError> {
    let with_task = seen.clone().with_state(model, "task", task)?;
    let condition = given.clone().with_state(model, "task", task)?;
    Ok(model.log_evidence(&with_task)? - model.log_evidence(&condition)?)
}

fn log_similarity(log_density: f64, squared_distance: f64) -> f64 {
    log_density - squared_distance.max(SQUARED_DISTANCE_FLOOR).ln()
}

fn weigh(
    scored: Vec<(f64, f64)>,
    weighing: Weighing,
    what: &'static str,
) -> Result<Vec<Ranked>, ImitationError> {
    if !(0.0..=1.0).contains(&weighing.lambda) {
        return Err(ImitationError::Lambda {
            lambda: weighing.lambda,
        });
    }
    if scored.is_empty() {
        return Err(ImitationError::NoCandidates { what });
    }
    let largest = scored
        .iter()
        .map(|(_, log_s)| *log_s)
        .fold(f64::NEG_INFINITY, f64::max);
    let mut ranked: Vec<Ranked> = scored
        .into_iter()
        .enumerate()
        .map(|(candidate_idx, (p_task, log_s))| {
            let similarity = if largest.is_finite() {
                (log_s - largest).exp()
            } else {
                0.0
            };
            let similarity_raw = log_s.exp();
            let s = match weighing.similarity {
                Similarity::Scaled => similarity,
                Similarity::Raw => similarity_raw,
            };
            // At λ = 1 the similarity has no say, even where it overflows.
            let total = if weighing.lambda == 1.0 {
                p_task
            } else {
                weighing.lambda * p_task + (1.0 - weighing.lambda) * s
            };
            Ranked {
                candidate_idx,
                p_task,
                similarity,
                similarity_raw,
                total,
            }
        })
        .collect();
    ranked.sort_by(|a, b| b.total.total_cmp(&a.total));
    Ok(ranked)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eq_5_weighs_two_numbers_between_0_and_1() {
        let scored = vec![(0.9, -700.0), (0.5, 800.0), (0.2, 799.0)];
        let ranked = weigh(scored, Weighing::default(), "grasp").unwrap();
        assert_eq!(ranked[0].candidate_idx, 0, "0.72 beats 0.4 + 0.2");
        assert!((ranked[1].total - (0.8 * 0.5 + 0.2)).abs() < 1e-12);
        assert!((ranked[2].similarity - (-1.0_f64).exp()).abs() < 1e-12);
    }

    #[test]
    fn lambda_1_is_the_task_alone_even_where_similarity_overflows() {
        let weighing = Weighing {
            lambda: 1.0,
            similarity: Similarity::Raw,
        };
        let ranked = weigh(vec![(0.1, 1e6), (0.3, 0.0)], weighing, "grasp").unwrap();
        assert_eq!((ranked[0].candidate_idx, ranked[0].total), (1, 0.3));
    }

    #[test]
    fn equal_features_do_not_divide_by_zero() {
        assert!(log_similarity(0.0, 0.0).is_finite());
    }

    #[test]
    fn what_cannot_be_weighed_is_said() {
        let message = |r: Result<Vec<Ranked>, ImitationError>| r.unwrap_err().to_string();
        let outside = Weighing {
            lambda: 1.5,
            ..Weighing::default()
        };
        assert_eq!(
            message(weigh(vec![(0.1, 0.0)], outside, "grasp")),
            "lambda is 1.5; expected a number from 0 (similarity alone) to 1 (task alone)"
        );
        assert_eq!(
            message(weigh(vec![], Weighing::default(), "object")),
            "there is no candidate object to choose from; give the imitator more grasps"
        );
    }
}
