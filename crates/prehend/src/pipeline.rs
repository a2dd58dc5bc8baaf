//! The paper from beginning to end: plan, close, measure, label, train, ask, imitate, report.

use std::collections::BTreeMap;
use std::path::PathBuf;

use prehend_grasp::SynthesisOptions;

use crate::experiments::Experiments;
use crate::progress::{Noted, Watch};
use crate::run_record::{Recorder, StageTime};
use crate::stages::learn::{NamedNetwork, Trainer};
use crate::stages::synthesize::HandData;
use crate::stages::{ask, decompose, imitate, label, learn, report, synthesize};
use crate::{Error, Object, ObjectOptions, files, hand_folder};

/// How long to look for grasps of one hand on one object.
struct Effort {
    /// Force-closure grasps that are enough.
    enough: usize,
    /// Tries at most.
    tries: usize,
}

/// A full run: what gives the paper's 600 labelled instances a task for the demonstrator and 1,200 for the imitator.
/// Tool-use sets the numbers: it is the rarest label, and grasps on slim tools hold seldom.
const DEMONSTRATOR: Effort = Effort {
    enough: 150,
    tries: 4000,
};
const IMITATOR: Effort = Effort {
    enough: 700,
    tries: 8000,
};

/// `--quick`: a first look.
const QUICK: Effort = Effort {
    enough: 40,
    tries: 600,
};

/// Objects per type with `--quick`.
const QUICK_OBJECTS: usize = 3;

/// What to run.
#[derive(Debug, Clone)]
pub struct PipelineOptions {
    /// A first look: a few objects of each type, fewer tries.
    pub quick: bool,
    /// Folder of meshes.
    pub objects: PathBuf,
    /// Folder of hands.
    pub hands: PathBuf,
    /// Folder of networks.
    pub networks: PathBuf,
    /// The experiments' settings; `experiments.toml` in the objects' folder, else derived.
    pub experiments: Option<PathBuf>,
    /// Where everything goes.
    pub out: PathBuf,
    /// Seed of everything drawn.
    pub seed: u64,
    /// Tries per hand and object.
    pub tries: Option<usize>,
    /// The arguments, for `run.json`.
    pub arguments: Vec<String>,
}

/// What came out.
#[derive(Debug, Clone)]
pub struct PipelineSummary {
    /// The report.
    pub report: PathBuf,
    /// Number of objects.
    pub n_objects: usize,
    /// Number of hands.
    pub n_hands: usize,
    /// Number of force-closure grasps over all hands and objects.
    pub n_grasps: usize,
    /// Seconds per stage.
    pub stages: Vec<StageTime>,
}

/// Runs every stage; what an earlier run finished is taken over.
///
/// # Errors
///
/// The first stage's that fails; finished work stays.
pub fn run(options: &PipelineOptions, watch: Watch) -> Result<PipelineSummary, Error> {
    let noted = Noted::new(watch.progress);
    let (on_screen, watch) = (
        watch,
        Watch {
            progress: &noted,
            ..watch
        },
    );
    let out = options.out.as_path();
    let seed = options.seed;
    let mut recorder = Recorder::begin(out, options.arguments.clone(), seed);

    let hands: Vec<HandData> = hand_folder::hand_folders(&options.hands)?
        .iter()
        .map(|f| HandData::read(f))
        .collect::<Result<_, _>>()?;
    let names: Vec<String> = hands.iter().map(|h| h.hand.name().to_owned()).collect();
    let networks = NamedNetwork::read_folder(&options.networks)?;
    let objects = read_objects(options, watch)?;
    let experiments = read_experiments(options, &objects, &names, on_screen)?;

    let shapes = recorder.stage(
        "decompose",
        || decompose::run(objects, out, watch),
        |shapes| {
            let n: usize = shapes.iter().map(|s| s.decomposition.boxes.len()).sum();
            format!("{} objects, {n} boxes", shapes.len())
        },
    )?;

    let synthesis: BTreeMap<String, SynthesisOptions> = names
        .iter()
        .map(|name| {
            let effort = match options.quick {
                true => QUICK,
                false if *name == experiments.demonstrator => DEMONSTRATOR,
                false => IMITATOR,
            };
            let tries = options.tries.unwrap_or(effort.tries);
            let enough = options.tries.is_none().then_some(effort.enough);
            (
                name.clone(),
                SynthesisOptions {
                    tries,
                    enough,
                    seed,
                    ..SynthesisOptions::default()
                },
            )
        })
        .collect();
    let grasp_files = recorder.stage(
        "synthesize",
        || synthesize::run(&hands, &shapes, &synthesis, out, watch),
        |files| {
            let sum = |f: &dyn Fn(&synthesize::GraspFile) -> usize| files.iter().map(f).sum::<usize>();
            format!(
                "{} force-closure grasps of {} tries",
                sum(&|f| f.tries.kept),
                sum(&|f| f.tries.tried)
            )
        },
    )?;

    let labels = recorder.stage(
        "label",
        || label::run(&hands, &shapes, &grasp_files, seed, out, watch),
        |labels| format!("{} grasps, {} personas", labels.n_grasps, labels.n_personas),
    )?;

    let trainer = Trainer {
        seed,
        out: out.to_owned(),
    };
    let datasets = recorder.stage(
        "learn",
        || {
            learn::run(
                &hands,
                &grasp_files,
                &labels,
                &experiments,
                &networks,
                &trainer,
                watch,
            )
        },
        |learned| format!("{} models", learned.models.len()),
    )?;

    let objects: Vec<Object> = shapes.iter().map(|s| s.object.clone()).collect();
    let answers = recorder.stage(
        "ask",
        || {
            ask::run(
                &datasets.datasets,
                &objects,
                &experiments,
                &networks,
                &trainer,
                out,
                watch,
            )
        },
        |answers| {
            format!(
                "{} maps, {} confusion matrices",
                answers.maps.len(),
                answers.classifications.len()
            )
        },
    )?;

    let imitations = recorder.stage(
        "imitate",
        || imitate::run(&datasets.datasets, &experiments, &networks, &trainer, out, watch),
        |runs| format!("{} networks", runs.len()),
    )?;

    let n_grasps = grasp_files.iter().map(|f| f.tries.kept).sum();
    let (n_objects, n_hands) = (shapes.len(), hands.len());
    let so_far = recorder.record().clone();
    let warnings = noted.warnings();
    let inputs = report::Inputs {
        run: &so_far,
        hands: &hands,
        shapes: &shapes,
        grasp_files: &grasp_files,
        labels: &labels,
        learned: &datasets,
        experiments: &experiments,
        answers: &answers,
        imitations: &imitations,
        warnings: &warnings,
    };
    let page = recorder.stage(
        "report",
        || report::run(&inputs, out, watch),
        |page| format!("{} figures", page.n_figures),
    )?;
    let stages = recorder.record().stages.clone();
    Ok(PipelineSummary {
        report: page.path,
        n_objects,
        n_hands,
        n_grasps,
        stages,
    })
}

fn read_objects(options: &PipelineOptions, watch: Watch) -> Result<Vec<Object>, Error> {
    let folder = Object::read_folder(&options.objects, ObjectOptions::default())?;
    for error in &folder.left_out {
        watch.progress.warn(&format!("left out: {error}"));
    }
    let mut objects = folder.objects;
    if options.quick {
        let mut seen: BTreeMap<String, usize> = BTreeMap::new();
        objects.retain(|o| {
            let n = seen.entry(o.kind.clone()).or_insert(0);
            *n += 1;
            *n <= QUICK_OBJECTS
        });
    }
    Ok(objects)
}

fn read_experiments(
    options: &PipelineOptions,
    objects: &[Object],
    hands: &[String],
    watch: Watch,
) -> Result<Experiments, Error> {
    let beside = options.objects.join("experiments.toml");
    let path = match &options.experiments {
        Some(path) => Some(path.clone()),
        None if beside.is_file() && !options.quick => Some(beside),
        None => None,
    };
    let Some(path) = path else {
        let derived = Experiments::derive(objects, hands)?;
        let text = toml::to_string(&derived).map_err(Error::input)?;
        files::write(
            &options.out.join("experiments").join("experiments.toml"),
            text.as_bytes(),
        )?;
        watch
            .progress
            .warn(&format!("experiments derived from the objects:\n{text}"));
        return Ok(derived);
    };
    Experiments::parse(&files::read_text(&path)?, objects, hands).map_err(|e| Error::file(&path, e))
}
