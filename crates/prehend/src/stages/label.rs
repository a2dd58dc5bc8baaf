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
use crate::progress::Watch;
use crate::{Error, run_record};

/// Points on the surface are drawn with this seed, whatever the run's: they are the tutor's eye, not its mood.
const SAMPLE_SEED: u64 = 0;

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
    for hand in hands {
        let tutor_hand = TutorHand::new(&hand.hand).map_err(Error::input)?;
        for file in grasp_files.iter().filter(|f| f.hand == hand.hand.name()) {
            watch.check()?;
            let Some(shape) = shapes.iter().find(|s| s.object.name == file.object) else {
                continue;
            };
            let margins = labels
                .margins
                .join(&file.hand)
                .join(format!("{}.parquet", file.object));
            let result = label_file(&tutor_hand, shape, file, seed, &mut store, &margins);
            let what = format!("labelling {} with {}", file.object, file.hand);
            watch.or_left_out(&what, Some(&shape.object.path), result)?;
            labels
                .datasets
                .entry(file.hand.clone())
                .or_default()
                .push(file.fingerprint.clone());
            labels.n_grasps += file.tries.kept;
            watch.progress.advance(1);
        }
    }
    watch.progress.end();
    Ok(labels)
}

fn label_file(
    hand: &TutorHand,
    shape: &Shape,
    file: &GraspFile,
    seed: u64,
    store: &mut LabelStore,
    margins: &Path,
) -> Result<(), Error> {
    let session = |persona: Persona| Session {
        tutor: "scripted".into(),
        persona: persona.name().into(),
        seed,
        dataset: file.fingerprint.clone(),
        hand: file.hand.clone(),
        object: file.object.clone(),
        object_type: shape.object.kind.clone(),
    };
    let missing = Persona::ALL
        .into_iter()
        .map(|p| Ok((p, store.has(&session(p))?)))
        .collect::<Result<Vec<_>, Error>>()?
        .into_iter()
        .filter_map(|(p, known)| (!known).then_some(p))
        .collect::<Vec<_>>();
    let known = Frame::read_metadata(margins)
        .get("fingerprint")
        .is_some_and(|f| *f == file.fingerprint);
    if missing.is_empty() && known {
        return Ok(());
    }
    let frame = Frame::read(&file.path)?;
    let grasps = records(&frame, hand.hand()).map_err(|e| Error::file(&file.path, e))?;
    let object = tutor_object(shape)?;
    let observations = observe_all(hand, &object, &grasps);
    let mut table = margins_table(&grasps, &observations);
    table
        .metadata
        .insert("fingerprint".into(), file.fingerprint.clone());
    table.write(margins)?;
    for persona in missing {
        let labelled = label(&grasps, &observations, persona, seed, 0.0);
        store.append(&session(persona), &labelled, &run_record::now())?;
    }
    Ok(())
}

/// The object as the tutor sees it.
///
/// # Errors
///
/// What the tutor says of its surface or opening, with the object's file.
pub fn tutor_object(shape: &Shape) -> Result<TutorObject, Error> {
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
    .map_err(|e| Error::file(&object.path, e))
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
