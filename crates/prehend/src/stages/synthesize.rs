//! Hands meet objects: `grasps/HAND/OBJECT.parquet` and `OBJECT.rejected.json`.

use std::cell::OnceCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use prehend_grasp::{Grasp, GraspObject, SynthesisOptions, synthesize, synthesize_each};
use prehend_hand::Hand;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::decompose::Shape;
use crate::files::{self, Fingerprint};
use crate::frame::{Frame, TableWriter};
use crate::grasp_table::{TableContext, to_frame};
use crate::progress::Watch;
use crate::{Error, hand_folder};

/// A hand and where it came from.
pub struct HandData {
    /// The hand.
    pub hand: Hand,
    /// Its folder as given.
    pub path: String,
    /// Equal where every file of the folder is equal.
    pub fingerprint: String,
}

/// Extensions of the files that make a hand: what its description, kinematics and shapes are read from.
const HAND_FILES: [&str; 10] = [
    "toml", "urdf", "stl", "obj", "ply", "off", "dae", "gltf", "glb", "bin",
];

impl HandData {
    /// Reads a hand that can grasp.
    ///
    /// # Errors
    ///
    /// As [`hand_folder::read_described_hand`].
    pub fn read(folder: &Path) -> Result<Self, Error> {
        let hand = hand_folder::read_described_hand(folder)?;
        let mut print = Fingerprint::of_stage("hand");
        for file in files::list(folder, &HAND_FILES)? {
            print = print.with(&files::read(&file)?);
        }
        Ok(Self {
            hand,
            path: folder.to_string_lossy().into_owned(),
            fingerprint: print.finish(),
        })
    }
}

/// Where one hand's grasps on one object stand, and how the tries went.
#[derive(Debug, Clone)]
pub struct GraspFile {
    /// The hand's name.
    pub hand: String,
    /// The object's name.
    pub object: String,
    /// The table.
    pub path: PathBuf,
    /// Fingerprint of the table's inputs.
    pub fingerprint: String,
    /// Tries by outcome.
    pub tries: Tries,
}

/// How the tries went; what stands in `OBJECT.rejected.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tries {
    /// All tries.
    pub tried: usize,
    /// Force-closure grasps.
    pub kept: usize,
    /// The rest, by reason.
    pub rejected: BTreeMap<String, usize>,
}

/// Plans and closes `options.tries` grasps of each hand on each object, except where an earlier run did. A pair that the
/// planner cannot work with is left out with a warning.
///
/// # Errors
///
/// A file that cannot be written, or [`Error::Stopped`].
pub fn run(
    hands: &[HandData],
    shapes: &[Shape],
    options: &BTreeMap<String, SynthesisOptions>,
    out: &Path,
    watch: Watch,
) -> Result<Vec<GraspFile>, Error> {
    let n_tries: usize = hands.iter().map(|h| options[h.hand.name()].tries).sum();
    watch.progress.begin("grasp", (n_tries * shapes.len()) as u64);
    // Objects side by side, so that nobody waits while one is made ready; each is made ready once for all hands.
    let of_shapes: Vec<Vec<Result<GraspFile, Error>>> = shapes
        .par_iter()
        .map(|shape| {
            let ready = OnceCell::new();
            let of_hand = |hand: &HandData| {
                watch.check()?;
                one(hand, shape, &ready, &options[hand.hand.name()], out, watch)
            };
            hands.iter().map(of_hand).collect()
        })
        .collect();
    watch.check()?;
    let mut of_shapes: Vec<_> = of_shapes.into_iter().map(Vec::into_iter).collect();
    let mut grasp_files = Vec::new();
    for hand in hands {
        for (shape, results) in shapes.iter().zip(&mut of_shapes) {
            let what = format!("{} with {}", shape.object.name, hand.hand.name());
            if let Some(result) = results.next() {
                grasp_files.extend(watch.or_left_out(&what, Some(&shape.object.path), result)?);
            }
        }
    }
    watch.progress.end();
    Ok(grasp_files)
}

fn one(
    hand: &HandData,
    shape: &Shape,
    ready: &OnceCell<GraspObject>,
    options: &SynthesisOptions,
    out: &Path,
    watch: Watch,
) -> Result<GraspFile, Error> {
    let object = &shape.object;
    let folder = out.join("grasps").join(hand.hand.name());
    let path = folder.join(format!("{}.parquet", object.name));
    let tries_path = folder.join(format!("{}.rejected.json", object.name));
    let fingerprint = Fingerprint::of_stage("synthesize")
        .with(shape.fingerprint.as_bytes())
        .with(hand.fingerprint.as_bytes())
        .with(hand.path.as_bytes())
        .with(object.path.to_string_lossy().as_bytes())
        .with(format!("{options:?}").as_bytes())
        .finish();
    let known = Frame::read_metadata(&path)
        .get("fingerprint")
        .is_some_and(|f| *f == fingerprint);
    let tries = files::read(&tries_path)
        .ok()
        .and_then(|b| serde_json::from_slice::<Tries>(&b).ok());
    if let (true, Some(tries)) = (known, tries) {
        watch.progress.advance(options.tries as u64);
        return Ok(GraspFile {
            hand: hand.hand.name().into(),
            object: object.name.clone(),
            path,
            fingerprint,
            tries,
        });
    }
    let grasp_object = if let Some(grasp_object) = ready.get() {
        grasp_object
    } else {
        let grasp_object = shape.grasp_object()?;
        ready.get_or_init(|| grasp_object)
    };
    let (mut frame, tries) = grasps_on(hand, shape, grasp_object, options, watch)?;
    // With enough grasps the rest of the tries need not be made.
    watch.progress.advance((options.tries - tries.tried) as u64);
    frame.metadata.insert("fingerprint".into(), fingerprint.clone());
    // The table comes last: a run that was stopped between the two files does both again.
    files::write(
        &tries_path,
        &serde_json::to_vec_pretty(&tries).map_err(Error::input)?,
    )?;
    frame.write(&path)?;
    Ok(GraspFile {
        hand: hand.hand.name().into(),
        object: object.name.clone(),
        path,
        fingerprint,
        tries,
    })
}

/// Grasps of one hand on one object as a table, without an output folder.
///
/// # Errors
///
/// [`Error::Stopped`], or what the planner says of hand and object.
pub fn grasp(
    hand: &HandData,
    shape: &Shape,
    options: &SynthesisOptions,
    watch: Watch,
) -> Result<(Frame, Tries), Error> {
    grasps_on(hand, shape, &shape.grasp_object()?, options, watch)
}

fn grasps_on(
    hand: &HandData,
    shape: &Shape,
    grasp_object: &GraspObject,
    options: &SynthesisOptions,
    watch: Watch,
) -> Result<(Frame, Tries), Error> {
    let report = |_finished: usize| {
        watch.progress.advance(1);
        watch.check().is_ok()
    };
    let options = SynthesisOptions {
        stream: stream(hand.hand.name(), &shape.object.name),
        ..options.clone()
    };
    let synthesis = synthesize(&hand.hand, grasp_object, &options, &report);
    watch.check()?;
    let synthesis = synthesis.map_err(|e| Error::file(&shape.object.path, e))?;
    let context = TableContext {
        hand: &hand.hand,
        hand_path: &hand.path,
        object: &shape.object,
        grasp_object,
        seed: options.seed,
    };
    let rejected = synthesis
        .rejected
        .iter()
        .map(|(reason, n)| (reason.to_string(), *n))
        .collect();
    let tries = Tries {
        tried: synthesis.tried,
        kept: synthesis.grasps.len(),
        rejected,
    };
    Ok((to_frame(&context, &synthesis.grasps), tries))
}

/// Grasps of one hand on one object, straight to a table: any number of tries needs the memory of a row group.
///
/// Without `table` the grasps are only counted.
///
/// # Errors
///
/// As [`grasp`], and what the disk says of the table.
pub fn grasp_to(
    hand: &HandData,
    shape: &Shape,
    options: &SynthesisOptions,
    table: Option<TableWriter>,
    watch: Watch,
) -> Result<Harvest, Error> {
    let grasp_object = shape.grasp_object()?;
    let options = SynthesisOptions {
        stream: stream(hand.hand.name(), &shape.object.name),
        ..options.clone()
    };
    let context = TableContext {
        hand: &hand.hand,
        hand_path: &hand.path,
        object: &shape.object,
        grasp_object: &grasp_object,
        seed: options.seed,
    };
    let mut table = table;
    let mut failure = None;
    let (mut waiting, mut sum, mut directions) = (Vec::new(), 0.0, BTreeSet::new());
    let mut put = |grasps: &mut Vec<Grasp>| {
        if let Some(table) = &mut table {
            failure = table.append(&to_frame(&context, grasps)).err();
        }
        grasps.clear();
        failure.is_none()
    };
    // The first part gives the table its columns, rows or not.
    let mut fine = put(&mut waiting);
    let report = |_finished: usize| {
        watch.progress.advance(1);
        watch.check().is_ok()
    };
    let mut each = |grasp: Grasp| {
        sum += grasp.features.qeps;
        directions.insert(direction_cell(&grasp.features.upos));
        waiting.push(grasp);
        if waiting.len() == PART {
            fine = put(&mut waiting);
        }
        fine
    };
    let tally = synthesize_each(&hand.hand, &grasp_object, &options, None, &report, &mut each);
    put(&mut waiting);
    if let Some(failure) = failure {
        return Err(failure);
    }
    watch.check()?;
    let tally = tally.map_err(|e| Error::file(&shape.object.path, e))?;
    table.map_or(Ok(()), TableWriter::finish)?;
    Ok(Harvest {
        tries: Tries {
            tried: tally.tried,
            kept: tally.kept,
            rejected: tally.rejected.iter().map(|(r, n)| (r.to_string(), *n)).collect(),
        },
        hints: tally.rejected.keys().map(|r| (r.to_string(), r.hint())).collect(),
        mean_epsilon: if tally.kept == 0 {
            0.0
        } else {
            sum / tally.kept as f64
        },
        directions: directions.len() as f64 / N_DIRECTIONS as f64,
    })
}

/// What [`grasp_to`] has to say of the grasps that it wrote.
#[derive(Debug, Clone, PartialEq)]
pub struct Harvest {
    /// How the tries went.
    pub tries: Tries,
    /// What to change where a reason is frequent.
    pub hints: BTreeMap<String, &'static str>,
    /// Mean ε; 0 without grasps.
    pub mean_epsilon: f64,
    /// Share of 96 equal parts of the sphere from which some grasp comes (`upos`).
    pub directions: f64,
}

/// Grasps that wait to become rows.
const PART: usize = 1000;

const N_DIRECTIONS: usize = 96;

/// Which of 8 × 12 parts of the sphere, equal in area, a unit vector lies in.
fn direction_cell(upos: &[f64; 3]) -> (usize, usize) {
    let turn = upos[1].atan2(upos[0]) / std::f64::consts::TAU + 0.5;
    let height = f64::midpoint(upos[2], 1.0);
    (((height * 8.0) as usize).min(7), ((turn * 12.0) as usize).min(11))
}

/// Names a hand and an object for the planner, so that each pair draws its own numbers.
pub fn stream(hand: &str, object: &str) -> String {
    format!("{hand}/{object}")
}
