//! Labelled grasps become models: `models/HAND/NETWORK.{bin,json}`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use prehend_model::{Model, Network, TrainOptions};
use prehend_report::NodeTraining;
use prehend_tutor::label_ceiling;
use serde_json::{Value, json};

use super::label::Labels;
use super::synthesize::{GraspFile, HandData};
use crate::Error;
use crate::experiments::Experiments;
use crate::files::{self, Fingerprint};
use crate::frame::Frame;
use crate::labels::Answer;
use crate::progress::{Watch, side_by_side};
use crate::training::{TASKS, balanced_rows, labelled_copies, to_table};

/// A network and its name.
#[derive(Debug, Clone)]
pub struct NamedNetwork {
    /// The file's name without extension.
    pub name: String,
    /// Structure and settings.
    pub network: Network,
    text: String,
}

impl NamedNetwork {
    /// Reads one `network.toml`.
    ///
    /// # Errors
    ///
    /// [`Error::File`] with what the model crate says of it.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = files::read_text(path)?;
        let network = Network::from_toml(&text).map_err(|e| Error::file(path, e))?;
        let name = path
            .file_stem()
            .and_then(|n| n.to_str())
            .unwrap_or("network")
            .to_owned();
        Ok(Self { name, network, text })
    }

    /// All networks of a folder, by name.
    ///
    /// # Errors
    ///
    /// [`Error::File`] where one cannot be read or there is none.
    pub fn read_folder(folder: &Path) -> Result<Vec<Self>, Error> {
        let found = files::list(folder, &["toml"])?
            .iter()
            .map(|p| Self::read(p))
            .collect::<Result<Vec<_>, _>>()?;
        if found.is_empty() {
            return Err(Error::file(
                folder,
                "holds no network; expected .toml files such as networks/paper.toml",
            ));
        }
        Ok(found)
    }
}

/// One hand's grasps with one persona's labels.
pub struct Dataset {
    /// The hand's name.
    pub hand: String,
    /// All force-closure grasps.
    pub grasps: Frame,
    /// The labelled ones, once per task, with the column `task`.
    pub copies: Frame,
    /// The labels, by grasp.
    pub answers: BTreeMap<String, Vec<Answer>>,
    fingerprint: String,
}

/// Features of an object, equal in all its rows.
#[derive(Debug, Clone, Copy)]
pub struct ObjectFeatures {
    /// `size`.
    pub size: [f64; 3],
    /// `cvex`.
    pub cvex: f64,
}

impl Dataset {
    /// Reads one hand's tables and joins the labels.
    ///
    /// # Errors
    ///
    /// Where a table cannot be read.
    pub fn read(
        hand: &str,
        grasp_files: &[GraspFile],
        answers: BTreeMap<String, Vec<Answer>>,
    ) -> Result<Self, Error> {
        let mut grasps = Frame::new();
        let mut print = Fingerprint::of_stage("dataset");
        for file in grasp_files.iter().filter(|f| f.hand == hand) {
            let frame = Frame::read(&file.path)?;
            if frame.n_rows() > 0 {
                grasps.append(&frame);
            }
            print = print.with(file.fingerprint.as_bytes());
        }
        if grasps.n_rows() == 0 {
            return Err(Error::input(format!(
                "{hand} holds no object in force closure; give more tries, or see grasps/{hand}/*.rejected.json for why tries fail"
            )));
        }
        for (grasp, answers) in &answers {
            for answer in answers {
                print = print
                    .with(grasp.as_bytes())
                    .with(answer.task.as_bytes())
                    .with(&[u8::from(answer.yes)]);
            }
        }
        let copies = labelled_copies(&grasps, &answers)?;
        Ok(Self {
            hand: hand.to_owned(),
            grasps,
            copies,
            answers,
            fingerprint: print.finish(),
        })
    }

    /// The labelled copies of grasps on these objects.
    ///
    /// # Errors
    ///
    /// Where the table has no column `object`.
    pub fn copies_on(&self, objects: &[String]) -> Result<Frame, Error> {
        let names = self.copies.texts("object")?;
        let rows: Vec<usize> = (0..names.len())
            .filter(|&r| objects.contains(&names[r]))
            .collect();
        Ok(self.copies.select(&rows))
    }

    /// Size and cvex of an object.
    ///
    /// # Errors
    ///
    /// Where there is no grasp on it, since its features stand in its grasps' rows.
    pub fn object_features(&self, object: &str) -> Result<ObjectFeatures, Error> {
        let names = self.grasps.texts("object")?;
        let row = names.iter().position(|n| n == object).ok_or_else(|| {
            Error::input(format!(
                "{} has no force-closure grasp on {object}, so its features are not known",
                self.hand
            ))
        })?;
        let value = |column: &str| self.grasps.numbers(column).map(|v| v[row]);
        Ok(ObjectFeatures {
            size: [value("size_x")?, value("size_y")?, value("size_z")?],
            cvex: value("cvex")?,
        })
    }

    /// The best mean per-class recall that anyone could reach on the copies of these objects' grasps.
    pub fn label_ceiling(&self, objects: &[String]) -> f64 {
        let on: BTreeSet<String> = match (self.grasps.texts("grasp_id"), self.grasps.texts("object")) {
            (Ok(ids), Ok(names)) => ids
                .into_iter()
                .zip(names)
                .filter(|(_, n)| objects.contains(n))
                .map(|(id, _)| id)
                .collect(),
            _ => BTreeSet::new(),
        };
        let probabilities: Vec<[f64; 3]> = self
            .answers
            .iter()
            .filter(|(grasp, _)| on.contains(*grasp))
            .map(|(_, answers)| {
                TASKS.map(|task| {
                    answers
                        .iter()
                        .find(|a| a.task == task)
                        .map_or(0.0, |a| a.probability)
                })
            })
            .collect();
        label_ceiling(&probabilities).map_or(f64::NAN, |c| c.mean_recall)
    }
}

/// A model with how it came about.
#[derive(Debug, Clone)]
pub struct Trained {
    /// The model.
    pub model: Model,
    /// Rows after balancing, per task.
    pub rows: [usize; 3],
    /// How training went, node by node, as `training` in the model's file.
    pub report: Value,
}

impl Trained {
    /// Log-likelihood of the training rows, nats.
    pub fn log_likelihood(&self) -> f64 {
        self.report["log_likelihood"].as_f64().unwrap_or(f64::NAN)
    }
}

/// Trains models, or takes them over from an earlier run.
#[derive(Debug, Clone)]
pub struct Trainer {
    /// Seed of balancing and of EM's starts.
    pub seed: u64,
    /// The run's folder.
    pub out: PathBuf,
}

impl Trainer {
    /// A network trained on a dataset without the objects held out. `purpose` names the model's place:
    /// `models/HAND/NETWORK` for the model that users ask, `models/HAND/PURPOSE/NETWORK` for an experiment's.
    ///
    /// A task without rows stays in the model, as likely as its pseudo-count says, with the features of all tasks.
    ///
    /// # Errors
    ///
    /// Where there is no row at all, or the model crate's own.
    pub fn train(
        &self,
        dataset: &Dataset,
        network: &NamedNetwork,
        held_out: &[String],
        purpose: &str,
    ) -> Result<Trained, Error> {
        let folder = self.out.join("models").join(&dataset.hand).join(purpose);
        let base = folder.join(&network.name);
        let fingerprint = held_out
            .iter()
            .fold(Fingerprint::of_stage("learn"), |f, o| f.with(o.as_bytes()))
            .with(dataset.fingerprint.as_bytes())
            .with(network.text.as_bytes())
            .with(&self.seed.to_le_bytes())
            .finish();
        if let Some(known) = read_known(&base, &fingerprint) {
            return Ok(known);
        }
        let names = dataset.copies.texts("object")?;
        let kept: Vec<usize> = (0..names.len())
            .filter(|&r| !held_out.contains(&names[r]))
            .collect();
        let copies = dataset.copies.select(&kept);
        let balanced = copies.select(&balanced_rows(&copies, "task", Some("object"), self.seed)?);
        let tasks = balanced.texts("task")?;
        let rows = TASKS.map(|task| tasks.iter().filter(|t| *t == task).count());
        if rows.iter().sum::<usize>() == 0 {
            return Err(Error::input(format!(
                "{}: no grasp on the training objects has a label; give more tries, or objects that afford a task",
                dataset.hand
            )));
        }
        let options = TrainOptions {
            seed: self.seed,
            group: Some("object".into()),
            ..TrainOptions::default()
        };
        let trained = Model::fit(&network.network, &to_table(&balanced)?, &options)?;
        let provenance = json!({
            "fingerprint": fingerprint,
            "hand": dataset.hand,
            "network": network.name,
            "held_out": held_out,
            "balanced_by": "task",
            "seed": self.seed,
            "rows": rows,
        });
        let report = serde_json::to_value(&trained.report).map_err(Error::input)?;
        let model = trained
            .model
            .with_extra("provenance", &provenance.to_string())?
            .with_extra("training", &report.to_string())?;
        write_model(&base, &model)?;
        Ok(Trained { model, rows, report })
    }

    /// [`Trainer::train`] inside a run: where there is nothing to learn from, `None` and a warning that `what` is left out;
    /// a warning also names tasks without rows.
    ///
    /// # Errors
    ///
    /// Where a file cannot be read or written.
    pub fn train_or_warn(
        &self,
        what: &str,
        dataset: &Dataset,
        network: &NamedNetwork,
        held_out: &[String],
        purpose: &str,
        watch: Watch,
    ) -> Result<Option<Trained>, Error> {
        let what = format!("{what} with {} and the network {}", dataset.hand, network.name);
        let trained = watch.or_left_out(&what, None, self.train(dataset, network, held_out, purpose))?;
        if let Some(trained) = &trained {
            let unseen: Vec<&str> = TASKS
                .into_iter()
                .zip(trained.rows)
                .filter_map(|(task, n)| (n == 0).then_some(task))
                .collect();
            if !unseen.is_empty() {
                watch.progress.warn(&format!(
                    "{what}: no training grasp is labelled {}, so what the model says of it is a guess from all grasps",
                    unseen.join(" or ")
                ));
            }
        }
        Ok(trained)
    }
}

fn read_known(base: &Path, fingerprint: &str) -> Option<Trained> {
    let bytes = files::read(&base.with_extension("bin")).ok()?;
    let model = Model::from_bytes(&bytes).ok()?;
    let provenance: Value = serde_json::from_str(&model.extra().get("provenance")?).ok()?;
    if provenance.get("fingerprint")?.as_str()? != fingerprint {
        return None;
    }
    let rows = serde_json::from_value(provenance.get("rows")?.clone()).ok()?;
    let report = serde_json::from_str(&model.extra().get("training")?).ok()?;
    Some(Trained { model, rows, report })
}

/// Writes `BASE.json` and `BASE.bin`.
///
/// # Errors
///
/// [`Error::File`].
pub fn write_model(base: &Path, model: &Model) -> Result<(), Error> {
    files::write(&base.with_extension("json"), model.to_json().as_bytes())?;
    files::write(&base.with_extension("bin"), &model.to_bytes())
}

/// Datasets of all hands, and the models trained on all objects.
pub struct Learned {
    /// One entry a hand.
    pub datasets: Vec<Dataset>,
    /// Hand, network and model, trained on all objects.
    pub models: Vec<(String, String, Trained)>,
}

/// Joins grasps and labels and trains every network for every hand. A hand without grasps or labels is left out with a
/// warning.
///
/// # Errors
///
/// Where a table cannot be read or a model not be written, or [`Error::Stopped`].
pub fn run(
    hands: &[HandData],
    grasp_files: &[GraspFile],
    labels: &Labels,
    experiments: &Experiments,
    networks: &[NamedNetwork],
    trainer: &Trainer,
    watch: Watch,
) -> Result<Learned, Error> {
    watch
        .progress
        .begin("learn", (hands.len() * networks.len()) as u64);
    let read = side_by_side(watch, hands, |hand, watch| {
        let name = hand.hand.name();
        let answers = labels.answers(name, &experiments.persona)?;
        let dataset = Dataset::read(name, grasp_files, answers);
        watch.or_left_out(&format!("learning with {name}"), None, dataset)
    })?;
    let datasets: Vec<Dataset> = read.into_iter().flatten().collect();
    let jobs: Vec<(&Dataset, &NamedNetwork)> = datasets
        .iter()
        .flat_map(|dataset| networks.iter().map(move |network| (dataset, network)))
        .collect();
    let trained = side_by_side(watch, &jobs, |(dataset, network), watch| {
        let trained = trainer.train_or_warn("learning", dataset, network, &[], "", watch)?;
        watch.progress.advance(1);
        Ok(trained.map(|t| (dataset.hand.clone(), network.name.clone(), t)))
    })?;
    let models = trained.into_iter().flatten().collect();
    watch.progress.end();
    Ok(Learned { datasets, models })
}

/// The continuous nodes of a trained model as the report shows them.
pub fn node_trainings(trained: &Trained) -> Vec<NodeTraining> {
    let cells = |node: &Value| node["cells"].as_array().cloned().unwrap_or_default();
    let whole = |v: &Value| v.as_u64().unwrap_or(0) as usize;
    trained.report["nodes"]
        .as_array()
        .into_iter()
        .flatten()
        .filter(|node| !cells(node).is_empty())
        .map(|node| {
            let name = node["name"].as_str().unwrap_or("").to_owned();
            let cells = cells(node);
            let sum = |key: &str| cells.iter().map(|c| whole(&c[key])).sum::<usize>();
            // BIC of one number of components, over the configurations that tried it; larger is better here.
            let mut bic: BTreeMap<usize, (f64, usize)> = BTreeMap::new();
            for score in cells
                .iter()
                .flat_map(|c| c["curve"].as_array().into_iter().flatten())
            {
                let entry = bic.entry(whole(&score["asked"])).or_insert((0.0, 0));
                entry.0 -= score["bic"].as_f64().unwrap_or(0.0) / 2.0;
                entry.1 += 1;
            }
            let parents = trained.model.index(&name).map_or(Vec::new(), |idx| {
                let parents = trained.model.node(idx).parents();
                parents
                    .iter()
                    .map(|p| trained.model.node(*p).name.clone())
                    .collect()
            });
            let (again, dropped) = (sum("reinitialized"), sum("dropped"));
            let mut notes = Vec::new();
            if cells
                .iter()
                .any(|c| c["constant_in_groups"].as_bool() == Some(true))
            {
                notes.push("counted by objects, since it is equal in all grasps of one".to_owned());
            }
            if again + dropped > 0 {
                notes.push(format!("{again} components started anew, {dropped} dropped"));
            }
            NodeTraining {
                node: name,
                parents,
                components: cells.iter().map(|c| whole(&c["components"])).max().unwrap_or(0),
                bic: bic
                    .into_iter()
                    .filter(|(_, (_, n))| *n == cells.len())
                    .map(|(k, (b, _))| (k, b))
                    .collect(),
                steps: cells.iter().map(|c| whole(&c["steps"])).max().unwrap_or(0),
                note: notes.join("; "),
            }
        })
        .collect()
}
