//! Step 1: which task was shown?

use prehend_grasp::Features;
use prehend_model::{Evidence, Model, ModelError};

use crate::ImitationError;

/// P(T | evidence): the tasks in the order of the model's states.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskPosterior {
    /// Names of the tasks.
    pub tasks: Vec<String>,
    /// Their probabilities, summing to 1.
    pub probabilities: Vec<f64>,
}

impl TaskPosterior {
    /// The most probable task, the first of equals.
    pub fn most_probable(&self) -> &str {
        let mut best = 0;
        for (idx, p) in self.probabilities.iter().enumerate() {
            if *p > self.probabilities[best] {
                best = idx;
            }
        }
        self.tasks.get(best).map_or("", String::as_str)
    }

    /// Probability of a task; 0 for one that the model does not know.
    pub fn of(&self, task: &str) -> f64 {
        self.tasks
            .iter()
            .position(|t| t == task)
            .map_or(0.0, |idx| self.probabilities[idx])
    }
}

/// Evidence about the named nodes from a grasp's features. Nodes that the model does not have are passed over.
///
/// # Errors
///
/// [`ModelError`] where a node has another dimension than its feature.
pub fn evidence(model: &Model, features: &Features, nodes: &[&str]) -> Result<Evidence, ModelError> {
    let mut evidence = Evidence::new();
    for (node, value) in values(features) {
        if nodes.contains(&node) && model.index(node).is_ok() {
            evidence = evidence.with_value(model, node, &value)?;
        }
    }
    Ok(evidence)
}

/// Every node with its value.
pub(crate) fn values(features: &Features) -> [(&'static str, Vec<f64>); 7] {
    [
        ("size", features.size.to_vec()),
        ("cvex", vec![features.cvex]),
        ("egpc", features.egpc.to_vec()),
        ("upos", features.upos.to_vec()),
        ("dir", features.dir.to_vec()),
        ("fvol", vec![features.fvol]),
        ("qeps", vec![features.qeps]),
    ]
}

/// The demonstrator's posterior over tasks given everything that was shown: P(T | o, a, c).
///
/// # Errors
///
/// [`ImitationError::Model`] where the model has no node `task` or the evidence has no density.
///
/// # Source
///
/// Paper, section VI-C, step 1.
pub fn recognise(demonstrator: &Model, shown: &Features) -> Result<TaskPosterior, ImitationError> {
    let nodes = ["size", "cvex", "egpc", "upos", "dir", "fvol", "qeps"];
    task_posterior(demonstrator, &evidence(demonstrator, shown, &nodes)?)
}

pub(crate) fn task_posterior(model: &Model, evidence: &Evidence) -> Result<TaskPosterior, ImitationError> {
    let tasks = model.node(model.index("task")?).states().to_vec();
    let probabilities = model
        .query(&["task"], evidence)?
        .probabilities("task")
        .unwrap_or_default();
    Ok(TaskPosterior { tasks, probabilities })
}

/// Expected reward of a candidate, Σ_t̂ Σ_t P(t̂ | shown) P(t | candidate) · reward(t̂, t).
///
/// `shown` and `candidate` are distributions over the same tasks in the same order; `reward` takes the indices of the
/// shown task and of the task that the candidate then serves. With reward 1 for the same task and a certain t̂ this is
/// the probability of Eq. 3.
///
/// # Source
///
/// Paper, Eq. 2.
pub fn expected_reward(shown: &[f64], candidate: &[f64], reward: impl Fn(usize, usize) -> f64) -> f64 {
    let row = |(i, p): (usize, &f64)| -> f64 {
        candidate
            .iter()
            .enumerate()
            .map(|(j, q)| p * q * reward(i, j))
            .sum()
    };
    shown.iter().enumerate().map(row).sum()
}
