//! Which grasps of this hand on this object serve this task?

use nalgebra::{Isometry3, Translation3};
use prehend_grasp::{Features, Grasp, GraspObject, Proposal, Reason, SynthesisOptions, synthesize_each};
use prehend_hand::Hand;
use prehend_imitation::{evidence, recognise};
use prehend_model::Model;

use crate::Error;
use crate::files::Fingerprint;
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
    /// Tries looked at; those that a proposal passed over among them.
    pub tried: usize,
    /// Tries closed.
    pub closed: usize,
    /// Grasps kept for which the task is more probable than not.
    pub suitable: usize,
    /// Force-closure grasps among them.
    pub kept: usize,
}

/// What to plan for.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// A state of the model's node `task`.
    pub task: &'a str,
    /// The model.
    pub model: &'a Model,
    /// How many grasps to answer with.
    pub top: usize,
    /// Close only tries drawn from P(A | task, object): each is taken with the probability P(task | object, A) that the
    /// model gives its action.
    pub proposals: bool,
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
    request: &Request<'_>,
    options: &SynthesisOptions,
    watch: Watch,
) -> Result<Plan, Error> {
    let Request {
        task,
        model,
        top,
        proposals,
    } = *request;
    let trained_on = model
        .extra()
        .get("provenance")
        .and_then(|json| serde_json::from_str::<serde_json::Value>(&json).ok())
        .and_then(|provenance| Some(provenance.get("hand")?.as_str()?.to_owned()));
    if let Some(other) = trained_on.filter(|name| name != hand.name()) {
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
    let draw = |proposal: &Proposal| {
        let chance = chance(model, task_idx, &grasp_object, proposal);
        uniform(proposal) < chance.unwrap_or(0.0)
    };
    let mut grasps = Vec::new();
    let tally = synthesize_each(
        hand,
        &grasp_object,
        &options,
        proposals.then_some(&draw),
        &report,
        &mut |grasp| {
            grasps.push(grasp);
            true
        },
    );
    watch.check()?;
    let tally = tally.map_err(|e| Error::file(&shape.object.path, e))?;
    let (tried, kept) = (tally.tried, tally.kept);
    let closed = tried - tally.rejected.get(&Reason::PassedOver).copied().unwrap_or(0);
    let mut ranked = Vec::with_capacity(kept);
    for grasp in grasps {
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
    let suitable = ranked.iter().filter(|p| p.p_task > 0.5).count();
    ranked.truncate(top);
    let reason = ranked.is_empty().then(|| {
        let mut reasons: Vec<_> = tally.rejected.iter().collect();
        reasons.sort_by(|a, b| b.1.cmp(a.1));
        let most = reasons
            .iter()
            .take(3)
            .map(|(r, n)| format!("{n} {r}"))
            .collect::<Vec<_>>()
            .join(", ");
        let hint = reasons
            .first()
            .map_or("no face of the object fits the hand's opening", |(r, _)| r.hint());
        format!("none of {tried} tries holds in force closure ({most}); {hint}")
    });
    Ok(Plan {
        grasps: ranked,
        reason,
        tried,
        closed,
        suitable,
        kept,
    })
}

/// P(task | object, action): what the model says before anything is closed.
fn chance(model: &Model, task_idx: usize, object: &GraspObject, proposal: &Proposal) -> Option<f64> {
    let features = Features {
        size: object.size(),
        cvex: object.cvex(),
        egpc: proposal.egpc,
        upos: proposal.upos,
        dir: proposal.dir,
        fvol: 1.0,
        fvol_union: 1.0,
        qeps: 0.0,
    };
    let evidence = evidence(model, &features, &["size", "cvex", "egpc", "upos", "dir"]).ok()?;
    let answer = model.query(&["task"], &evidence).ok()?;
    answer.probabilities("task")?.get(task_idx).copied()
}

/// A number in [0, 1) that every proposal has for itself: the draw does not depend on threads.
fn uniform(proposal: &Proposal) -> f64 {
    let numbers = proposal.egpc.iter().chain(&proposal.upos).chain(&proposal.dir);
    let bytes: Vec<u8> = numbers.flat_map(|x| x.to_bits().to_le_bytes()).collect();
    let digits = Fingerprint::of_stage("proposal").with(&bytes).finish();
    u64::from_str_radix(&digits, 16).map_or(0.0, |bits| (bits >> 11) as f64 / (1u64 << 53) as f64)
}

fn pregrasp(hand: &Hand, grasp: &Grasp) -> Isometry3<f64> {
    let root_from_palm = hand.root_from_palm(&grasp.joints);
    let approach = grasp.object_from_root * root_from_palm * nalgebra::Vector3::z();
    Translation3::from(approach * -PREGRASP_DISTANCE) * grasp.object_from_root
}
