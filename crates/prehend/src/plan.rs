//! Which grasps of this hand on this object serve this task?

use std::sync::atomic::{AtomicU64, Ordering};

use nalgebra::{Isometry3, Translation3};
use prehend_grasp::{Grasp, GraspObject, Proposal, Reason, SynthesisOptions, synthesize_each};
use prehend_hand::Hand;
use prehend_imitation::recognise;
use prehend_model::{BatchQuery, Model};

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
    /// model gives its action, divided by the largest of the first few hundred tries.
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
    let chances = Chances::new(model, task_idx, &grasp_object)?;
    let largest = if proposals {
        chances.largest(hand, &grasp_object, &options)?
    } else {
        1.0
    };
    if largest <= 0.0 {
        return Ok(Plan {
            grasps: Vec::new(),
            reason: Some(format!(
                "the model gives `{task}` no chance with any of the first {} tries on this object; plan without --proposals",
                PILOT * 100
            )),
            tried: PILOT * 100,
            closed: 0,
            suitable: 0,
            kept: 0,
        });
    }
    let draw = |proposal: &Proposal| uniform(proposal) * largest < chances.of(proposal);
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

/// P(task | object, A), compiled for many actions on one object.
struct Chances<'a> {
    query: BatchQuery<'a>,
    task_idx: usize,
    nodes: Vec<&'static str>,
    size: [f64; 3],
    cvex: f64,
}

/// Tries of which none is closed: a hundred are passed over for each.
const PILOT: usize = 4;

impl<'a> Chances<'a> {
    fn new(model: &'a Model, task_idx: usize, object: &GraspObject) -> Result<Self, Error> {
        let nodes = ["size", "cvex", "egpc", "upos", "dir"];
        let nodes: Vec<&str> = nodes.into_iter().filter(|n| model.index(n).is_ok()).collect();
        Ok(Self {
            query: BatchQuery::new(model, "task", &nodes)?,
            task_idx,
            nodes,
            size: object.size(),
            cvex: object.cvex(),
        })
    }

    /// 0 where the model cannot say.
    fn of(&self, proposal: &Proposal) -> f64 {
        let row = self.nodes.iter().flat_map(|node| match *node {
            "size" => self.size.to_vec(),
            "cvex" => vec![self.cvex],
            "egpc" => proposal.egpc.to_vec(),
            "upos" => proposal.upos.to_vec(),
            _ => proposal.dir.to_vec(),
        });
        let answers = self.query.run(&[row.collect()]);
        let posterior = answers.into_iter().next().and_then(Result::ok);
        let chance = posterior.and_then(|p| p.posterior.get(self.task_idx).copied());
        chance.unwrap_or(0.0)
    }

    /// The largest among the first few hundred tries, none of which is closed.
    fn largest(&self, hand: &Hand, object: &GraspObject, options: &SynthesisOptions) -> Result<f64, Error> {
        // Bits of numbers from 0 to 1 have the order of the numbers.
        let largest = AtomicU64::new(0);
        let look = |proposal: &Proposal| {
            largest.fetch_max(self.of(proposal).max(0.0).to_bits(), Ordering::Relaxed);
            false
        };
        let pilot = SynthesisOptions {
            tries: PILOT,
            ..options.clone()
        };
        synthesize_each(hand, object, &pilot, Some(&look), &|_| true, &mut |_| true).map_err(Error::input)?;
        Ok(f64::from_bits(largest.into_inner()))
    }
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
