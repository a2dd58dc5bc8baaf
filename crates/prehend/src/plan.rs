//! Which grasps of this hand on this object serve this task?

use nalgebra::{Isometry3, Translation3};
use prehend_grasp::{Grasp, SynthesisOptions, synthesize};
use prehend_hand::Hand;
use prehend_imitation::recognise;
use prehend_model::Model;

use crate::Error;
use crate::grasp_table::grasp_id;
use crate::progress::Watch;
use crate::stages::decompose::Shape;
use crate::stages::synthesize::stream;

/// How far (m) back along the approach the pre-grasp stands: room for the fingers of a hand-sized hand.
pub const PREGRASP_DISTANCE: f64 = 0.10;

/// A grasp with the probability that it serves the task.
#[derive(Debug, Clone)]
pub struct Planned {
    /// Its identifier.
    pub grasp_id: String,
    /// P(task | o, a, c).
    pub p_task: f64,
    /// The grasp.
    pub grasp: Grasp,
    /// Root link's pose [`PREGRASP_DISTANCE`] back along the approach, object frame; the hand has its pre-shape there.
    pub pregrasp: Isometry3<f64>,
}

/// The answer of [`plan`].
#[derive(Debug, Clone)]
pub struct Plan {
    /// Best first, at most as many as asked for.
    pub grasps: Vec<Planned>,
    /// Why there are none, where there are none.
    pub reason: Option<String>,
    /// Tries made.
    pub tried: usize,
    /// Force-closure grasps among them.
    pub kept: usize,
}

/// Plans grasps, asks the model for P(task | object, action, constraints), and ranks: most probable first, among equals
/// the one with the larger ε.
///
/// # Errors
///
/// Where the model does not know the task or lacks a node, or the planner was stopped.
pub fn plan(
    hand: &Hand,
    shape: &Shape,
    task: &str,
    model: &Model,
    top: usize,
    options: &SynthesisOptions,
    watch: Watch,
) -> Result<Plan, Error> {
    let trained_on = model
        .extra()
        .get("provenance")
        .and_then(|p| p.get("hand"))
        .and_then(|h| h.as_str());
    if let Some(other) = trained_on.filter(|name| *name != hand.name()) {
        watch.progress.warn(&format!(
            "the model was trained on grasps of {other}, not of {}; its probabilities may mislead",
            hand.name()
        ));
    }
    let states = model.node(model.index("task")?).states().to_vec();
    let Some(task_idx) = states.iter().position(|s| s == task) else {
        return Err(Error::input(format!(
            "the model knows no task `{task}`; it knows {}",
            states.join(", ")
        )));
    };
    let report = |_finished: usize| {
        watch.progress.advance(1);
        watch.check().is_ok()
    };
    let grasp_object = shape.grasp_object()?;
    let options = SynthesisOptions {
        stream: stream(hand.name(), &shape.object.name),
        ..options.clone()
    };
    let synthesis = synthesize(hand, &grasp_object, &options, &report);
    watch.check()?;
    let synthesis = synthesis.map_err(|e| Error::file(&shape.object.path, e))?;
    let (tried, kept) = (synthesis.tried, synthesis.grasps.len());
    let mut ranked = Vec::with_capacity(kept);
    for grasp in synthesis.grasps {
        let posterior = recognise(model, &grasp.features)
            .map_err(Error::input)?
            .probabilities;
        ranked.push(Planned {
            grasp_id: grasp_id(hand.name(), &shape.object.name, grasp.try_idx),
            p_task: posterior[task_idx],
            pregrasp: pregrasp(hand, &grasp),
            grasp,
        });
    }
    ranked.sort_by(|a, b| {
        b.p_task
            .total_cmp(&a.p_task)
            .then(b.grasp.features.qeps.total_cmp(&a.grasp.features.qeps))
            .then(a.grasp.try_idx.cmp(&b.grasp.try_idx))
    });
    ranked.truncate(top);
    let reason = ranked.is_empty().then(|| {
        let mut reasons: Vec<_> = synthesis.rejected.iter().collect();
        reasons.sort_by(|a, b| b.1.cmp(a.1));
        let most = reasons.iter().take(3).map(|(r, n)| format!("{n} {r}")).collect::<Vec<_>>().join(", ");
        format!("none of {tried} tries holds in force closure ({most}); give more tries, or check the object's scale")
    });
    Ok(Plan {
        grasps: ranked,
        reason,
        tried,
        kept,
    })
}

fn pregrasp(hand: &Hand, grasp: &Grasp) -> Isometry3<f64> {
    let root_from_palm = hand.root_from_palm(&grasp.joints);
    let approach = grasp.object_from_root * root_from_palm * nalgebra::Vector3::z();
    Translation3::from(approach * -PREGRASP_DISTANCE) * grasp.object_from_root
}
