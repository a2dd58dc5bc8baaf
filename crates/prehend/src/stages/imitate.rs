//! Experiment C: a shown grasp, and the object and grasp with which another hand best imitates it.

use std::path::Path;

use prehend_grasp::Features;
use prehend_imitation::{
    Candidate, Ranked, Scales, Similarity, Weighing, rank_grasps, rank_objects, recognise,
};

use super::ask::text_frame;
use super::learn::{Dataset, NamedNetwork, Trainer};
use crate::Error;
use crate::experiments::Experiments;
use crate::frame::Frame;
use crate::progress::{Watch, side_by_side};
use crate::training::TASKS;

/// One network's answer to the demonstration.
#[derive(Debug, Clone)]
pub struct Imitation {
    /// The network.
    pub network: String,
    /// The grasp that was shown.
    pub demonstration: String,
    /// Step 1: the demonstrator's P(T | o, a, c), in the order of [`TASKS`].
    pub task_posterior: [f64; 3],
    /// t̂, the most probable of them.
    pub recognised: String,
    /// Step 2.1: the objects, best first.
    pub objects: Vec<RankedObject>,
    /// Step 2.2: grasps on the chosen object, best first.
    pub grasps: Vec<RankedGrasp>,
    /// The best of all grasps on all objects by Eq. 3: P(t̂ | o, a, c) alone.
    pub joint: Option<RankedGrasp>,
    /// The best of all grasps on all objects by Eq. 5.
    pub joint_similar: Option<RankedGrasp>,
    /// λ of Eq. 5.
    pub lambda: f64,
}

/// An object with its scores.
#[derive(Debug, Clone)]
pub struct RankedObject {
    /// The object.
    pub object: String,
    /// P(t̂ | o).
    pub p_task: f64,
    /// S over the largest S.
    pub similarity: f64,
    /// The literal S of Eq. 4.
    pub similarity_raw: f64,
    /// Eq. 5.
    pub total: f64,
}

/// A grasp with its scores.
#[derive(Debug, Clone)]
pub struct RankedGrasp {
    /// The grasp.
    pub grasp_id: String,
    /// Its object.
    pub object: String,
    /// P(t̂ | o, a, c).
    pub p_task: f64,
    /// S over the largest S.
    pub similarity: f64,
    /// The literal S of Eq. 4.
    pub similarity_raw: f64,
    /// Eq. 5.
    pub total: f64,
}

impl Imitation {
    /// The object of step 2.1.
    pub fn chosen_object(&self) -> &str {
        self.objects.first().map_or("none", |o| o.object.as_str())
    }
}

/// Runs the experiment with every network and writes its tables. Empty where demonstrator or imitator have no grasps on
/// the objects that it needs, or there is nothing to learn from without these; a warning then says which.
///
/// # Errors
///
/// Where a model or a table cannot be written, or [`Error::Stopped`].
pub fn run(
    datasets: &[Dataset],
    experiments: &Experiments,
    networks: &[NamedNetwork],
    trainer: &Trainer,
    out: &Path,
    watch: Watch,
) -> Result<Vec<Imitation>, Error> {
    watch.progress.begin("imitate", networks.len() as u64);
    let shown = watch.or_left_out("experiment C", None, Shown::new(datasets, experiments))?;
    let runs = match shown {
        Some(shown) => side_by_side(watch, networks, |network, watch| {
            let run = shown.imitate(experiments, network, trainer, watch)?;
            watch.progress.advance(1);
            Ok(run)
        })?,
        None => Vec::new(),
    };
    let runs: Vec<Imitation> = runs.into_iter().flatten().collect();
    watch.progress.end();
    write_tables(&runs, out)?;
    Ok(runs)
}

/// The demonstration, and the hands on both sides.
struct Shown<'a> {
    demonstrator: &'a Dataset,
    imitator: &'a Dataset,
    grasp_id: String,
    features: Features,
}

impl<'a> Shown<'a> {
    fn new(datasets: &'a [Dataset], experiments: &Experiments) -> Result<Self, Error> {
        let of = |hand: &str| {
            datasets
                .iter()
                .find(|d| d.hand == hand)
                .ok_or_else(|| Error::input(format!("there are no grasps of {hand}")))
        };
        let (demonstrator, imitator) = (of(&experiments.demonstrator)?, of(&experiments.imitator)?);
        let (grasp_id, features) = demonstration(demonstrator, experiments)?.ok_or_else(|| {
            Error::input(format!(
                "{} has no {} grasp on {}",
                experiments.demonstrator, experiments.c.task, experiments.c.demonstration
            ))
        })?;
        Ok(Self {
            demonstrator,
            imitator,
            grasp_id,
            features,
        })
    }

    fn imitate(
        &self,
        experiments: &Experiments,
        network: &NamedNetwork,
        trainer: &Trainer,
        watch: Watch,
    ) -> Result<Option<Imitation>, Error> {
        let mut held_out = experiments.c.candidates.clone();
        held_out.push(experiments.c.demonstration.clone());
        let train = |dataset: &&Dataset, watch: Watch| {
            trainer.train_or_warn("experiment C", dataset, network, &held_out, "experiment-c", watch)
        };
        let both = [self.demonstrator, self.imitator];
        // With one hand only, it imitates itself: one model.
        let n_hands = if both[0].hand == both[1].hand { 1 } else { 2 };
        let trained = side_by_side(watch, &both[..n_hands], train)?;
        let (Some(Some(teacher)), Some(Some(pupil))) = (trained.first(), trained.last()) else {
            return Ok(None);
        };
        let answer = || {
            let posterior = recognise(&teacher.model, &self.features).map_err(Error::input)?;
            let choice = Choice::new(self.imitator, experiments, &pupil.model)?;
            let mut run = choice.of(&pupil.model, posterior.most_probable(), &self.features)?;
            run.network.clone_from(&network.name);
            run.demonstration.clone_from(&self.grasp_id);
            run.task_posterior = TASKS.map(|t| posterior.of(t));
            Ok(run)
        };
        let what = format!("experiment C with the network {}", network.name);
        watch.or_left_out(&what, None, answer())
    }
}

/// The demonstrator's grasp with the task's label and the largest ε.
fn demonstration(dataset: &Dataset, experiments: &Experiments) -> Result<Option<(String, Features)>, Error> {
    let (objects, tasks) = (dataset.copies.texts("object")?, dataset.copies.texts("task")?);
    let (ids, epsilon) = (dataset.copies.texts("grasp_id")?, dataset.copies.numbers("qeps")?);
    let best = (0..ids.len())
        .filter(|&r| objects[r] == experiments.c.demonstration && tasks[r] == experiments.c.task)
        .max_by(|&a, &b| epsilon[a].total_cmp(&epsilon[b]));
    match best {
        Some(row) => Ok(Some((ids[row].clone(), features(&dataset.copies)?[row]))),
        None => Ok(None),
    }
}

/// Features of every row of a grasp table.
///
/// # Errors
///
/// Where one of the nodes' columns is missing.
pub fn features(frame: &Frame) -> Result<Vec<Features>, Error> {
    let columns = |names: &[&str]| {
        names
            .iter()
            .map(|n| frame.numbers(n))
            .collect::<Result<Vec<_>, _>>()
    };
    let size = columns(&["size_x", "size_y", "size_z"])?;
    let egpc = columns(&["egpc_1", "egpc_2"])?;
    let upos = columns(&["upos_x", "upos_y", "upos_z"])?;
    let dir = columns(&["dir_w", "dir_x", "dir_y", "dir_z"])?;
    let rest = columns(&["cvex", "fvol", "qeps"])?;
    let fvol_union = frame.numbers("fvol_union").unwrap_or_else(|_| rest[1].clone());
    Ok((0..frame.n_rows())
        .map(|r| Features {
            size: std::array::from_fn(|k| size[k][r]),
            cvex: rest[0][r],
            egpc: std::array::from_fn(|k| egpc[k][r]),
            upos: std::array::from_fn(|k| upos[k][r]),
            dir: std::array::from_fn(|k| dir[k][r]),
            fvol: rest[1][r],
            fvol_union: fvol_union[r],
            qeps: rest[2][r],
        })
        .collect())
}

/// What the imitator can choose from.
struct Choice {
    /// One candidate an object, standing for it.
    objects: Vec<Candidate>,
    grasps: Vec<Candidate>,
    scales: Scales,
    lambda: f64,
}

impl Choice {
    fn new(
        imitator: &Dataset,
        experiments: &Experiments,
        pupil: &prehend_model::Model,
    ) -> Result<Self, Error> {
        let all = features(&imitator.grasps)?;
        let (ids, names) = (
            imitator.grasps.texts("grasp_id")?,
            imitator.grasps.texts("object")?,
        );
        let grasps: Vec<Candidate> = (0..ids.len())
            .filter(|&r| experiments.c.candidates.contains(&names[r]))
            .map(|r| Candidate {
                grasp_id: ids[r].clone(),
                object: names[r].clone(),
                features: all[r],
            })
            .collect();
        if grasps.is_empty() {
            return Err(Error::input(format!(
                "{} has no grasp on any object to choose from ({})",
                imitator.hand,
                experiments.c.candidates.join(", ")
            )));
        }
        let objects = experiments
            .c
            .candidates
            .iter()
            .filter_map(|name| grasps.iter().find(|g| g.object == *name).cloned())
            .collect();
        Ok(Self {
            objects,
            grasps,
            scales: Scales::of_model(pupil).map_err(Error::input)?,
            lambda: experiments.c.lambda,
        })
    }

    fn of(&self, pupil: &prehend_model::Model, task: &str, shown: &Features) -> Result<Imitation, Error> {
        let weighing = Weighing {
            lambda: self.lambda,
            similarity: Similarity::Scaled,
        };
        let objects =
            rank_objects(pupil, task, shown, &self.objects, &self.scales, weighing).map_err(Error::input)?;
        let objects: Vec<RankedObject> = objects
            .into_iter()
            .map(|r| RankedObject {
                object: self.objects[r.candidate_idx].object.clone(),
                p_task: r.p_task,
                similarity: r.similarity,
                similarity_raw: r.similarity_raw,
                total: r.total,
            })
            .collect();
        let chosen = objects.first().map_or("", |o| o.object.as_str());
        let on_chosen: Vec<Candidate> = self
            .grasps
            .iter()
            .filter(|g| g.object == chosen)
            .cloned()
            .collect();
        let grasps = named(
            &on_chosen,
            self.rank(pupil, task, shown, &on_chosen, self.lambda)?,
        );
        let joint = named(&self.grasps, self.rank(pupil, task, shown, &self.grasps, 1.0)?);
        let similar = named(
            &self.grasps,
            self.rank(pupil, task, shown, &self.grasps, self.lambda)?,
        );
        Ok(Imitation {
            network: String::new(),
            demonstration: String::new(),
            task_posterior: [0.0; 3],
            recognised: task.to_owned(),
            objects,
            grasps,
            joint: joint.into_iter().next(),
            joint_similar: similar.into_iter().next(),
            lambda: self.lambda,
        })
    }

    fn rank(
        &self,
        pupil: &prehend_model::Model,
        task: &str,
        shown: &Features,
        grasps: &[Candidate],
        lambda: f64,
    ) -> Result<Vec<Ranked>, Error> {
        let weighing = Weighing {
            lambda,
            similarity: Similarity::Scaled,
        };
        rank_grasps(pupil, task, shown, grasps, &self.scales, weighing).map_err(Error::input)
    }
}

fn named(candidates: &[Candidate], ranked: Vec<Ranked>) -> Vec<RankedGrasp> {
    ranked
        .into_iter()
        .map(|r| RankedGrasp {
            grasp_id: candidates[r.candidate_idx].grasp_id.clone(),
            object: candidates[r.candidate_idx].object.clone(),
            p_task: r.p_task,
            similarity: r.similarity,
            similarity_raw: r.similarity_raw,
            total: r.total,
        })
        .collect()
}

fn write_tables(runs: &[Imitation], out: &Path) -> Result<(), Error> {
    let folder = out.join("experiments");
    let mut objects = Vec::new();
    let mut grasps = Vec::new();
    for run in runs {
        for o in &run.objects {
            let numbers = [o.p_task, o.similarity, o.similarity_raw, o.total].map(|x| x.to_string());
            let [p, s, raw, total] = numbers;
            objects.push([
                run.network.clone(),
                run.recognised.clone(),
                o.object.clone(),
                p,
                s,
                raw,
                total,
            ]);
        }
        let choices = [("eq3", &run.joint), ("eq5", &run.joint_similar)];
        let joint = choices
            .into_iter()
            .filter_map(|(how, g)| Some((how, g.as_ref()?)));
        for (how, g) in run.grasps.iter().map(|g| ("step-2.2", g)).chain(joint) {
            let [p, s, raw, total] =
                [g.p_task, g.similarity, g.similarity_raw, g.total].map(|x| x.to_string());
            let (network, task) = (run.network.clone(), run.recognised.clone());
            grasps.push([
                network,
                how.to_owned(),
                task,
                g.grasp_id.clone(),
                g.object.clone(),
                p,
                s,
                raw,
                total,
            ]);
        }
    }
    text_frame(
        &[
            "network",
            "task",
            "object",
            "p_task",
            "similarity",
            "similarity_raw",
            "total",
        ],
        &objects,
    )
    .write(&folder.join("c_objects.csv"))?;
    let names = [
        "network",
        "choice",
        "task",
        "grasp_id",
        "object",
        "p_task",
        "similarity",
        "similarity_raw",
        "total",
    ];
    text_frame(&names, &grasps).write(&folder.join("c_grasps.csv"))
}
