//! The scripted tutor says which tasks each grasp affords: `labels.sqlite`, and every rule's margin in
//! `labels/HAND/OBJECT.parquet`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use prehend_tutor::{
    GraspView, Judgement, Labels as Drawn, ObjectClass, Observation, Persona, Rule, Task, Thresholds,
    TutorHand, TutorObject, judge, observe,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sha2::{Digest, Sha256};

use super::decompose::Shape;
use super::synthesize::{GraspFile, HandData};
use crate::frame::{Column, Frame};
use crate::grasp_table::{GraspRecord, records};
use crate::labels::{Answer, LabelStore, Labelled, Session};
use crate::progress::{Watch, side_by_side};
use crate::{Error, run_record};

/// Points on the surface are drawn with this seed, whatever the run's: they are the tutor's eye, not its mood.
const SAMPLE_SEED: u64 = 0;

/// Tables whose labels are in memory together.
const TABLES_TOGETHER: usize = 8;

/// Where the labels of a run stand.
#[derive(Debug, Clone)]
pub struct Labels {
    /// The store.
    pub store: PathBuf,
    /// Folder of the margins.
    pub margins: PathBuf,
    /// Fingerprints of the grasp tables that were labelled, by hand.
    pub datasets: BTreeMap<String, Vec<String>>,
    /// Grasps labelled by each persona.
    pub n_grasps: usize,
    /// Number of personas.
    pub n_personas: usize,
}

impl Labels {
    /// One persona's answers for one hand's grasps.
    ///
    /// # Errors
    ///
    /// Where the store cannot be read.
    pub fn answers(&self, hand: &str, persona: &str) -> Result<BTreeMap<String, Vec<Answer>>, Error> {
        let datasets = self.datasets.get(hand).map_or(&[][..], Vec::as_slice);
        LabelStore::open(&self.store)?.answers(persona, datasets)
    }

    /// The margins of one table's grasps: `grasp_id` and a column a rule; `None` where the tutor could not judge them.
    ///
    /// # Errors
    ///
    /// Where the table cannot be read.
    pub fn margins_of(&self, file: &GraspFile) -> Result<Option<Frame>, Error> {
        let path = self
            .margins
            .join(&file.hand)
            .join(format!("{}.parquet", file.object));
        let known = Frame::read_metadata(&path).get("fingerprint") == Some(&file.fingerprint);
        known.then(|| Frame::read(&path)).transpose()
    }
}

/// Labels every grasp with every persona, except where an earlier run did. An object that the tutor cannot judge is left
/// out with a warning.
///
/// # Errors
///
/// Where a table or the store cannot be read or written, or [`Error::Stopped`].
pub fn run(
    hands: &[HandData],
    shapes: &[Shape],
    grasp_files: &[GraspFile],
    seed: u64,
    out: &Path,
    watch: Watch,
) -> Result<Labels, Error> {
    watch.progress.begin("label", grasp_files.len() as u64);
    let mut labels = Labels {
        store: out.join("labels.sqlite"),
        margins: out.join("labels"),
        datasets: BTreeMap::new(),
        n_grasps: 0,
        n_personas: Persona::ALL.len(),
    };
    let mut store = LabelStore::open(&labels.store)?;
    let mut jobs = Vec::new();
    let tutor_hands = hands
        .iter()
        .map(|hand| TutorHand::new(&hand.hand).map_err(Error::input))
        .collect::<Result<Vec<_>, _>>()?;
    for (hand, tutor_hand) in hands.iter().zip(&tutor_hands) {
        for file in grasp_files.iter().filter(|f| f.hand == hand.hand.name()) {
            let Some(shape) = shapes.iter().find(|s| s.object.name == file.object) else {
                continue;
            };
            let mut job = Job {
                hand: tutor_hand,
                shape,
                file,
                seed,
                margins: labels
                    .margins
                    .join(&file.hand)
                    .join(format!("{}.parquet", file.object)),
                missing: Vec::new(),
            };
            for persona in Persona::ALL {
                if !store.has(&job.session(persona))? {
                    job.missing.push(persona);
                }
            }
            if job.missing.is_empty() && job.margins_are_known() {
                watch.progress.advance(1);
            } else {
                jobs.push(job);
            }
            labels
                .datasets
                .entry(file.hand.clone())
                .or_default()
                .push(file.fingerprint.clone());
            labels.n_grasps += file.tries.kept;
        }
    }
    // Both hands grasp the same objects.
    let wanted: BTreeMap<&str, &Shape> = jobs
        .iter()
        .map(|job| (job.file.object.as_str(), job.shape))
        .collect();
    let wanted: Vec<(&str, &Shape)> = wanted.into_iter().collect();
    let objects: BTreeMap<&str, Result<TutorObject, String>> =
        side_by_side(watch, &wanted, |(name, shape), _| Ok((*name, seen(shape))))?
            .into_iter()
            .collect();
    // While some tables are looked at, the labels of those before go into the store.
    let mut waiting: Vec<(Session, Vec<Labelled>)> = Vec::new();
    for some in jobs.chunks(TABLES_TOGETHER) {
        let (stored, seen) = rayon::join(
            || store.append_all(&waiting, &run_record::now()),
            || {
                side_by_side(watch, some, |job, watch| {
                    let what = format!("labelling {} with {}", job.file.object, job.file.hand);
                    let said = match &objects[job.file.object.as_str()] {
                        Ok(object) => job.run(object),
                        Err(reason) => Err(Error::file(&job.shape.object.path, reason)),
                    };
                    let said = watch.or_left_out(&what, Some(&job.shape.object.path), said)?;
                    watch.progress.advance(1);
                    Ok(said.unwrap_or_default())
                })
            },
        );
        stored?;
        waiting = seen?.concat();
    }
    store.append_all(&waiting, &run_record::now())?;
    watch.progress.end();
    Ok(labels)
}

/// One table to label.
struct Job<'a> {
    hand: &'a TutorHand,
    shape: &'a Shape,
    file: &'a GraspFile,
    seed: u64,
    /// Where the margins go.
    margins: PathBuf,
    /// Those whose labels the store does not have.
    missing: Vec<Persona>,
}

impl Job<'_> {
    fn session(&self, persona: Persona) -> Session {
        Session {
            tutor: "scripted".into(),
            persona: persona.name().into(),
            seed: self.seed,
            dataset: self.file.fingerprint.clone(),
            hand: self.file.hand.clone(),
            object: self.file.object.clone(),
            object_type: self.shape.object.kind.clone(),
        }
    }

    fn margins_are_known(&self) -> bool {
        Frame::read_metadata(&self.margins).get("fingerprint") == Some(&self.file.fingerprint)
    }

    /// Writes the margins, and returns the labels that are missing.
    fn run(&self, object: &TutorObject) -> Result<Vec<(Session, Vec<Labelled>)>, Error> {
        let file = self.file;
        let frame = Frame::read(&file.path)?;
        let grasps = records(&frame, self.hand.hand()).map_err(|e| Error::file(&file.path, e))?;
        let observations = observe_all(self.hand, object, &grasps);
        let mut table = margins_table(&grasps, &observations);
        table
            .metadata
            .insert("fingerprint".into(), file.fingerprint.clone());
        table.write(&self.margins)?;
        let said = |persona: &Persona| {
            let labelled = label(&grasps, &observations, *persona, self.seed, 0.0);
            (self.session(*persona), labelled)
        };
        Ok(self.missing.iter().map(said).collect())
    }
}

/// The object as the tutor sees it.
///
/// # Errors
///
/// What the tutor says of its surface or opening, with the object's file.
pub fn tutor_object(shape: &Shape) -> Result<TutorObject, Error> {
    seen(shape).map_err(|reason| Error::file(&shape.object.path, reason))
}

fn seen(shape: &Shape) -> Result<TutorObject, String> {
    let object = &shape.object;
    let surface = prehend_geometry::Surface::new(object.mesh.clone());
    let class = ObjectClass::of(&object.kind, &object.parts);
    TutorObject::new(
        &surface,
        &object.parts,
        class,
        &Thresholds::default(),
        SAMPLE_SEED,
    )
    .map_err(|e| e.to_string())
}

/// Looks at every grasp once.
pub fn observe_all(hand: &TutorHand, object: &TutorObject, grasps: &[GraspRecord]) -> Vec<Observation> {
    let thresholds = Thresholds::default();
    let look = |g: &GraspRecord| {
        let view = GraspView {
            object_from_root: g.object_from_root,
            joints: &g.joints,
            contacts: &g.contacts,
        };
        observe(hand, object, &view, &thresholds)
    };
    grasps.par_iter().map(look).collect()
}

/// One persona's labels of observed grasps, drawn with a stream of their own for each grasp.
pub fn label(
    grasps: &[GraspRecord],
    observations: &[Observation],
    persona: Persona,
    seed: u64,
    flip: f64,
) -> Vec<Labelled> {
    let thresholds = Thresholds::default();
    let one = |(grasp, observation): (&GraspRecord, &Observation)| {
        let judgement = judge(observation, persona, &thresholds);
        let drawn = judgement.draw(flip, &mut stream(seed, persona, &grasp.grasp_id));
        Labelled {
            grasp_id: grasp.grasp_id.clone(),
            answers: answers(&judgement, drawn, flip),
        }
    };
    grasps.par_iter().zip(observations).map(one).collect()
}

fn answers(judgement: &Judgement, drawn: Drawn, flip: f64) -> Vec<Answer> {
    let probabilities = judgement.label_probabilities(flip);
    Task::ALL
        .into_iter()
        .zip(probabilities)
        .map(|(task, probability)| Answer {
            task: task.name().into(),
            yes: drawn.contains(task),
            probability,
            rule: judgement
                .of(task)
                .deciding
                .map_or("not afforded", Rule::name)
                .into(),
        })
        .collect()
}

fn stream(seed: u64, persona: Persona, grasp_id: &str) -> ChaCha8Rng {
    let mut hash = Sha256::new();
    hash.update(b"label");
    hash.update(seed.to_le_bytes());
    hash.update(persona.name());
    hash.update([0]);
    hash.update(grasp_id);
    ChaCha8Rng::from_seed(hash.finalize().into())
}

fn margins_table(grasps: &[GraspRecord], observations: &[Observation]) -> Frame {
    let mut table = Frame::new();
    table.push(
        "grasp_id",
        Column::Text(grasps.iter().map(|g| Some(g.grasp_id.clone())).collect()),
    );
    for rule in Rule::ALL {
        let margin = |o: &Observation| {
            o.margins()
                .iter()
                .find(|(r, _)| *r == rule)
                .map_or(f64::NAN, |(_, m)| *m)
        };
        table.push(
            rule.name(),
            Column::Number(observations.iter().map(margin).collect()),
        );
    }
    table
}
