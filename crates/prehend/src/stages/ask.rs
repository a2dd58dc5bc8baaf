//! Experiments A and B: where does a task want the hand, and which task is a grasp good for?

use std::collections::BTreeMap;
use std::path::Path;

use prehend_model::{BatchQuery, Evidence, Model, Table};
use prehend_report::Icosphere;
use rayon::prelude::*;

use super::learn::{Dataset, NamedNetwork, Trainer};
use crate::experiments::Experiments;
use crate::frame::{Column, Frame};
use crate::progress::{Watch, side_by_side};
use crate::training::{TASKS, to_table};
use crate::{Error, Object};

/// The three sets of evidence of Table III: object, action, constraint nodes.
pub const EVIDENCE: [(&str, &[&str]); 3] = [
    ("O", &["size", "cvex"]),
    ("O, A", &["size", "cvex", "egpc", "upos", "dir"]),
    (
        "O, A, C",
        &["size", "cvex", "egpc", "upos", "dir", "fvol", "qeps"],
    ),
];

/// Level of the icosphere on which maps are computed: 2,562 directions.
pub const MAP_LEVEL: usize = 4;

/// Directions whose densities are one piece of parallel work.
const DIRECTIONS_TOGETHER: usize = 64;

/// Experiment A for one network and one object.
#[derive(Debug, Clone)]
pub struct TaskMaps {
    /// The network.
    pub network: String,
    /// The held-out object.
    pub object: String,
    /// Per task, the density on the unit sphere at each direction of the icosphere.
    pub densities: Vec<Vec<f64>>,
}

/// Experiment B for one hand, network and set of evidence, over all folds.
#[derive(Debug, Clone)]
pub struct Classification {
    /// The hand.
    pub hand: String,
    /// The network.
    pub network: String,
    /// `O`, `O, A` or `O, A, C`.
    pub evidence: String,
    /// Rows by true task and most probable task, one per copy of a grasp.
    pub counts: Vec<Vec<usize>>,
    /// Share of grasps whose most probable task is one of their labels, each grasp once.
    pub in_label_set: f64,
    /// Mean of −ln P(true task), over copies.
    pub log_loss: f64,
}

/// What the experiments found.
pub struct Answers {
    /// Experiment A.
    pub maps: Vec<TaskMaps>,
    /// Experiment B.
    pub classifications: Vec<Classification>,
    /// Per hand: the best mean per-class recall that anyone could reach on the test copies.
    pub ceilings: BTreeMap<String, f64>,
}

/// Runs both experiments and writes their tables to `out/experiments`. What the objects and labels do not allow is left
/// out with a warning.
///
/// # Errors
///
/// Where a table or a model cannot be written, or [`Error::Stopped`].
pub fn run(
    datasets: &[Dataset],
    objects: &[Object],
    experiments: &Experiments,
    networks: &[NamedNetwork],
    trainer: &Trainer,
    out: &Path,
    watch: Watch,
) -> Result<Answers, Error> {
    let n_steps = networks.len() * (1 + datasets.len() * experiments.b.folds.len());
    watch.progress.begin("ask", n_steps as u64);
    let run = Run {
        experiments,
        networks,
        trainer,
        watch,
    };
    let maps = run.maps(datasets)?;
    let classifications = run.classifications(datasets)?;
    let tested: Vec<String> = experiments.b.folds.iter().flatten().cloned().collect();
    let ceilings = datasets
        .iter()
        .map(|d| (d.hand.clone(), d.label_ceiling(&tested)))
        .collect();
    watch.progress.end();
    let answers = Answers {
        maps,
        classifications,
        ceilings,
    };
    write_tables(&answers, objects, out)?;
    Ok(answers)
}

/// What both experiments share.
struct Run<'a> {
    experiments: &'a Experiments,
    networks: &'a [NamedNetwork],
    trainer: &'a Trainer,
    watch: Watch<'a>,
}

impl Run<'_> {
    fn maps(&self, datasets: &[Dataset]) -> Result<Vec<TaskMaps>, Error> {
        let (held_out, watch) = (&self.experiments.a.held_out, self.watch);
        let imitator = datasets.iter().find(|d| d.hand == self.experiments.imitator);
        let Some(imitator) = imitator.filter(|_| !held_out.is_empty()) else {
            watch.progress.warn(&if held_out.is_empty() {
                "experiment A is left out: of none of hammer, bottle and mug are there two objects, one to hold out and one to learn from".to_owned()
            } else {
                format!("experiment A is left out: {} has no grasps", self.experiments.imitator)
            });
            return Ok(Vec::new());
        };
        let maps = side_by_side(watch, self.networks, |network, watch| {
            let (what, purpose) = ("experiment A", "experiment-a");
            let trained = self
                .trainer
                .train_or_warn(what, imitator, network, held_out, purpose, watch)?;
            let mut maps = Vec::new();
            for (trained, name) in trained
                .iter()
                .flat_map(|t| held_out.iter().map(move |name| (t, name)))
            {
                let map = task_maps(&trained.model, network, imitator, name);
                let what = format!("experiment A, network {}, {name}", network.name);
                maps.extend(watch.or_left_out(&what, None, map)?);
            }
            watch.progress.advance(1);
            Ok(maps)
        })?;
        Ok(maps.concat())
    }

    fn classifications(&self, datasets: &[Dataset]) -> Result<Vec<Classification>, Error> {
        let (folds, watch) = (&self.experiments.b.folds, self.watch);
        if folds.is_empty() {
            watch.progress.warn(
                "experiment B is left out: no type has two objects, one to hold out and one to learn from",
            );
        }
        let tables: Vec<(&Dataset, &NamedNetwork)> = datasets
            .iter()
            .flat_map(|dataset| self.networks.iter().map(move |network| (dataset, network)))
            .collect();
        let jobs: Vec<_> = tables
            .iter()
            .flat_map(|table| (0..folds.len()).map(move |fold| (*table, fold)))
            .collect();
        let answers = side_by_side(watch, &jobs, |((dataset, network), fold), watch| {
            let answer = self.fold(dataset, network, *fold, watch)?;
            watch.progress.advance(1);
            Ok(answer)
        })?;
        let merged = tables
            .iter()
            .zip(answers.chunks(folds.len().max(1)))
            .filter(|(_, answers)| answers.iter().any(Option::is_some))
            .flat_map(|((dataset, network), answers)| merge(&dataset.hand, &network.name, answers));
        Ok(merged.collect())
    }

    /// One fold's answers of one hand and network; `None` where it is left out.
    fn fold(
        &self,
        dataset: &Dataset,
        network: &NamedNetwork,
        fold: usize,
        watch: Watch,
    ) -> Result<Option<Vec<Fold>>, Error> {
        let held_out = &self.experiments.b.folds[fold];
        let (what, purpose) = (
            format!("experiment B, fold {}", fold + 1),
            format!("experiment-b-{fold}"),
        );
        let trained = self
            .trainer
            .train_or_warn(&what, dataset, network, held_out, &purpose, watch)?;
        let Some(trained) = trained else {
            return Ok(None);
        };
        let test = dataset.copies_on(held_out)?;
        if test.n_rows() == 0 {
            watch.progress.warn(&format!(
                "{what} with {} is left out: no grasp on {} has a label",
                dataset.hand,
                held_out.join(", ")
            ));
            return Ok(None);
        }
        watch.or_left_out(&what, None, classify(&trained.model, &test))
    }
}

/// The density of the unified position on the sphere, per task, given the object's features.
fn task_maps(
    model: &Model,
    network: &NamedNetwork,
    dataset: &Dataset,
    object: &str,
) -> Result<TaskMaps, Error> {
    let features = dataset.object_features(object)?;
    let grid = Icosphere::new(MAP_LEVEL);
    let directions: Vec<&[f64]> = grid.directions().iter().map(|d| d.as_slice()).collect();
    let densities = TASKS
        .iter()
        .map(|task| {
            let evidence = Evidence::new()
                .with_state(model, "task", task)?
                .with_value(model, "size", &features.size)?
                .with_value(model, "cvex", &[features.cvex])?;
            let mixture = model
                .query(&["upos"], &evidence)?
                .mixture("upos")
                .ok_or_else(|| Error::input("the network has no continuous node `upos`"))?;
            let log_densities: Vec<f64> = directions
                .par_chunks(DIRECTIONS_TOGETHER)
                .flat_map_iter(|some| {
                    let flat = || vec![f64::NEG_INFINITY; some.len()];
                    mixture.log_densities(some).unwrap_or_else(flat)
                })
                .collect();
            Ok(grid.normalized(&log_densities))
        })
        .collect::<Result<Vec<Vec<f64>>, Error>>()?;
    Ok(TaskMaps {
        network: network.name.clone(),
        object: object.to_owned(),
        densities,
    })
}

/// One fold's answers for one set of evidence.
struct Fold {
    evidence: &'static str,
    counts: [[usize; 3]; 3],
    log_loss: f64,
    n_copies: usize,
    n_hit: usize,
    n_grasps: usize,
}

fn classify(model: &Model, copies: &Frame) -> Result<Vec<Fold>, Error> {
    let table = to_table(copies)?;
    let tasks = copies.texts("task")?;
    let ids = copies.texts("grasp_id")?;
    EVIDENCE
        .iter()
        .map(|(name, nodes)| {
            let posteriors = task_posteriors(model, &table, nodes)?;
            let mut fold = Fold {
                evidence: name,
                counts: [[0; 3]; 3],
                log_loss: 0.0,
                n_copies: 0,
                n_hit: 0,
                n_grasps: 0,
            };
            let mut hits: BTreeMap<&str, bool> = BTreeMap::new();
            for ((posterior, task), id) in posteriors.iter().zip(&tasks).zip(&ids) {
                let Some(truth) = TASKS.iter().position(|t| t == task) else {
                    continue;
                };
                let best = (0..3)
                    .max_by(|&a, &b| posterior[a].total_cmp(&posterior[b]))
                    .unwrap_or(0);
                fold.counts[truth][best] += 1;
                fold.log_loss -= posterior[truth].max(f64::MIN_POSITIVE).ln();
                fold.n_copies += 1;
                *hits.entry(id).or_insert(false) |= truth == best;
            }
            fold.n_grasps = hits.len();
            fold.n_hit = hits.values().filter(|hit| **hit).count();
            Ok(fold)
        })
        .collect()
}

/// P(task | the named nodes) of every row, the tasks in the order of [`TASKS`].
pub(super) fn task_posteriors(model: &Model, table: &Table, nodes: &[&str]) -> Result<Vec<[f64; 3]>, Error> {
    let states = model.node(model.index("task")?).states();
    let place = TASKS.map(|task| states.iter().position(|s| s == task));
    BatchQuery::new(model, "task", nodes)?
        .run_table(table)?
        .into_iter()
        .map(|answer| {
            let posterior = answer?.posterior;
            Ok(place.map(|k| k.map_or(0.0, |k| posterior[k])))
        })
        .collect()
}

fn merge(hand: &str, network: &str, folds: &[Option<Vec<Fold>>]) -> Vec<Classification> {
    EVIDENCE
        .iter()
        .map(|(name, _)| {
            let mut counts = vec![vec![0; 3]; 3];
            let (mut loss, mut copies, mut hit, mut grasps) = (0.0, 0, 0, 0);
            for fold in folds.iter().flatten().flatten().filter(|f| f.evidence == *name) {
                for (sum, row) in counts.iter_mut().zip(&fold.counts) {
                    sum.iter_mut().zip(row).for_each(|(a, b)| *a += b);
                }
                loss += fold.log_loss;
                copies += fold.n_copies;
                hit += fold.n_hit;
                grasps += fold.n_grasps;
            }
            Classification {
                hand: hand.to_owned(),
                network: network.to_owned(),
                evidence: (*name).to_owned(),
                counts,
                in_label_set: hit as f64 / grasps.max(1) as f64,
                log_loss: loss / copies.max(1) as f64,
            }
        })
        .collect()
}

fn write_tables(answers: &Answers, objects: &[Object], out: &Path) -> Result<(), Error> {
    let folder = out.join("experiments");
    let mut maps = Frame::new();
    let grid = Icosphere::new(MAP_LEVEL);
    let directions = grid.directions();
    let cell = |f: &dyn Fn(&TaskMaps, usize, usize) -> Option<String>| {
        let mut column = Vec::new();
        for map in &answers.maps {
            for task in 0..TASKS.len() {
                column.extend((0..directions.len()).map(|d| f(map, task, d)));
            }
        }
        Column::Text(column)
    };
    maps.push("network", cell(&|m, _, _| Some(m.network.clone())));
    maps.push("object", cell(&|m, _, _| Some(m.object.clone())));
    let kind = |name: &str| objects.iter().find(|o| o.name == name).map(|o| o.kind.clone());
    maps.push("object_type", cell(&|m, _, _| kind(&m.object)));
    maps.push("task", cell(&|_, t, _| Some(TASKS[t].to_owned())));
    for (k, axis) in ["x", "y", "z"].iter().enumerate() {
        maps.push(
            format!("upos_{axis}"),
            cell(&|_, _, d| Some(directions[d][k].to_string())),
        );
    }
    maps.push("density", cell(&|m, t, d| Some(m.densities[t][d].to_string())));
    maps.write(&folder.join("a_maps.csv"))?;

    let mut rows: Vec<[String; 6]> = Vec::new();
    for c in &answers.classifications {
        for (truth, row) in c.counts.iter().enumerate() {
            for (predicted, n) in row.iter().enumerate() {
                rows.push([
                    c.hand.clone(),
                    c.network.clone(),
                    c.evidence.clone(),
                    TASKS[truth].into(),
                    TASKS[predicted].into(),
                    n.to_string(),
                ]);
            }
        }
    }
    text_frame(
        &["hand", "network", "evidence", "task", "predicted", "count"],
        &rows,
    )
    .write(&folder.join("b_confusion.csv"))?;

    let scores: Vec<[String; 9]> = answers
        .classifications
        .iter()
        .map(|c| {
            let recall = |t: usize| c.recall(t).map_or(String::new(), |r| r.to_string());
            [
                c.hand.clone(),
                c.network.clone(),
                c.evidence.clone(),
                recall(0),
                recall(1),
                recall(2),
                c.mean_recall().map_or(String::new(), |r| r.to_string()),
                answers
                    .ceilings
                    .get(&c.hand)
                    .map_or(String::new(), ToString::to_string),
                c.log_loss.to_string(),
            ]
        })
        .collect();
    let names = [
        "hand",
        "network",
        "evidence",
        TASKS[0],
        TASKS[1],
        TASKS[2],
        "mean_recall",
        "label_ceiling",
        "log_loss",
    ];
    text_frame(&names, &scores).write(&folder.join("b_scores.csv"))
}

/// A frame of text columns, for small result tables.
pub(super) fn text_frame<const N: usize>(names: &[&str; N], rows: &[[String; N]]) -> Frame {
    let mut frame = Frame::new();
    for (k, name) in names.iter().enumerate() {
        frame.push(
            *name,
            Column::Text(rows.iter().map(|r| Some(r[k].clone())).collect()),
        );
    }
    frame
}

impl Classification {
    /// Share of a task's copies that were recognised; `None` where there are none.
    pub fn recall(&self, task_idx: usize) -> Option<f64> {
        let total: usize = self.counts[task_idx].iter().sum();
        (total > 0).then(|| self.counts[task_idx][task_idx] as f64 / total as f64)
    }

    /// Mean of the recalls of the tasks that have copies.
    pub fn mean_recall(&self) -> Option<f64> {
        let recalls: Vec<f64> = (0..self.counts.len()).filter_map(|t| self.recall(t)).collect();
        (!recalls.is_empty()).then(|| recalls.iter().sum::<f64>() / recalls.len() as f64)
    }
}
