//! Everything becomes one page: `report/index.html` and its figures.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::Point3;
use prehend_report::{DisplayMesh, HandShape, Picture, ReportData, Scene, render_page};
use rayon::prelude::*;

use super::ask::Answers;
use super::decompose::Shape;
use super::imitate::Imitation;
use super::label::Labels;
use super::learn::Learned;
use super::synthesize::{GraspFile, HandData};
use crate::experiments::Experiments;
use crate::frame::Frame;
use crate::grasp_table::{GraspRecord, records};
use crate::labels::Answer;
use crate::progress::{Watch, side_by_side};
use crate::run_record::RunRecord;
use crate::training::TASKS;
use crate::{Error, files};

mod experiments;
mod labels;
mod objects;
mod overview;

/// Everything that the report tells of.
pub struct Inputs<'a> {
    /// Times so far.
    pub run: &'a RunRecord,
    /// The hands.
    pub hands: &'a [HandData],
    /// The objects and their boxes.
    pub shapes: &'a [Shape],
    /// The grasp tables.
    pub grasp_files: &'a [GraspFile],
    /// The labels.
    pub labels: &'a Labels,
    /// Datasets and models.
    pub learned: &'a Learned,
    /// The experiments' settings.
    pub experiments: &'a Experiments,
    /// Experiments A and B.
    pub answers: &'a Answers,
    /// Experiment C.
    pub imitations: &'a [Imitation],
    /// What the run warned of: files and experiments that were left out, and why.
    pub warnings: &'a [String],
}

/// The page that was written.
pub struct WrittenPage {
    /// `report/index.html`.
    pub path: PathBuf,
    /// Figures beside it.
    pub n_figures: usize,
}

/// Draws, lays out and writes the report.
///
/// # Errors
///
/// Where a table cannot be read, a picture not drawn, or a file not written; or [`Error::Stopped`].
pub fn run(inputs: &Inputs, out: &Path, watch: Watch) -> Result<WrittenPage, Error> {
    watch.progress.begin("report", inputs.shapes.len() as u64 + 3);
    let stand = Stand::new(inputs)?;
    let mut data = ReportData {
        title: "What a task asks of a grasp".into(),
        tasks: TASKS.map(str::to_owned).to_vec(),
        ..ReportData::default()
    };
    data.objects = side_by_side(watch, inputs.shapes, |shape, watch| {
        let section = objects::section(inputs, &stand, shape)?;
        watch.progress.advance(1);
        Ok(section)
    })?;
    data.run = overview::run_section(inputs);
    data.tries = overview::tries(inputs);
    data.training = overview::training(inputs);
    let (labels, (maps, imitation)) = rayon::join(
        || labels::section(inputs),
        || {
            rayon::join(
                || experiments::maps(inputs, &stand),
                || experiments::imitation(inputs, &stand),
            )
        },
    );
    (data.labels, data.experiment_a, data.experiment_c) = (labels?, maps?, imitation?);
    data.experiment_b = experiments::classification(inputs);
    watch.check()?;
    watch.progress.advance(2);
    data.summary = overview::summary(inputs, &stand)?;
    data.limits = overview::limits(inputs);
    data.files = overview::files();
    let page = render_page(&data);
    let folder = out.join("report");
    let write = |(name, bytes): &(String, Vec<u8>)| files::write(&folder.join("figures").join(name), bytes);
    page.figures.par_iter().try_for_each(write)?;
    let path = folder.join("index.html");
    files::write(&path, page.html.as_bytes())?;
    watch.progress.advance(1);
    watch.progress.end();
    Ok(WrittenPage {
        path,
        n_figures: page.figures.len(),
    })
}

/// Hands, objects and grasps, ready to be drawn.
struct Stand<'a> {
    hands: BTreeMap<&'a str, (&'a HandData, HandShape)>,
    meshes: BTreeMap<&'a str, Arc<DisplayMesh>>,
    grasps: BTreeMap<(String, String), Vec<GraspRecord>>,
}

impl<'a> Stand<'a> {
    fn new(inputs: &Inputs<'a>) -> Result<Self, Error> {
        let hands = inputs
            .hands
            .iter()
            .map(|h| (h.hand.name(), (h, HandShape::new(&h.hand))))
            .collect();
        let mesh = |s: &Shape| Arc::new(DisplayMesh::new(&s.object.mesh));
        let meshes = inputs
            .shapes
            .iter()
            .map(|s| (s.object.name.as_str(), mesh(s)))
            .collect();
        let mut grasps = BTreeMap::new();
        for file in inputs.grasp_files {
            let hand = inputs.hands.iter().find(|h| h.hand.name() == file.hand);
            if let (Some(hand), true) = (hand, file.tries.kept > 0) {
                let found =
                    records(&Frame::read(&file.path)?, &hand.hand).map_err(|e| Error::file(&file.path, e))?;
                grasps.insert((file.hand.clone(), file.object.clone()), found);
            }
        }
        Ok(Self {
            hands,
            meshes,
            grasps,
        })
    }

    /// The grasps of a hand on an object.
    fn grasps(&self, hand: &str, object: &str) -> &[GraspRecord] {
        self.grasps
            .get(&(hand.to_owned(), object.to_owned()))
            .map_or(&[], Vec::as_slice)
    }

    /// A grasp by its identifier, `HAND/OBJECT/TRY`.
    fn grasp(&self, grasp_id: &str) -> Option<(&str, &GraspRecord)> {
        let mut parts = grasp_id.splitn(3, '/');
        let (hand, object) = (parts.next()?, parts.next()?);
        let ((_, object), grasps) = self.grasps.get_key_value(&(hand.to_owned(), object.to_owned()))?;
        Some((object, grasps.iter().find(|g| g.grasp_id == grasp_id)?))
    }

    /// A rendered grasp; an empty picture where it is not known.
    fn grasp_picture(&self, grasp_id: &str, size: usize, name: &str, alt: &str) -> Result<Picture, Error> {
        let (Some((object, grasp)), Some(hand_name)) = (self.grasp(grasp_id), grasp_id.split('/').next())
        else {
            return Ok(Picture::default());
        };
        let (Some(mesh), Some((hand, shape))) = (self.meshes.get(object), self.hands.get(hand_name)) else {
            return Ok(Picture::default());
        };
        let contacts: Vec<Point3<f64>> = grasp.contacts.iter().map(|(_, at)| at.point).collect();
        let scene = Scene::grasp(
            mesh,
            &hand.hand,
            shape,
            &grasp.joints,
            &grasp.object_from_root,
            &contacts,
        );
        scene.telling_picture(size, name, alt).map_err(Error::input)
    }

    /// An object drawn alone.
    fn object_picture(&self, object: &str, size: usize) -> Result<Picture, Error> {
        let Some(mesh) = self.meshes.get(object) else {
            return Ok(Picture::default());
        };
        Scene::object(mesh)
            .telling_picture(size, "", &format!("{object}, drawn from its mesh"))
            .map_err(Error::input)
    }
}

/// The tasks that a grasp is labelled with.
fn tasks_of(answers: &BTreeMap<String, Vec<Answer>>, grasp_id: &str) -> Vec<String> {
    let answers = answers.get(grasp_id).map_or(&[][..], Vec::as_slice);
    TASKS
        .iter()
        .filter(|t| answers.iter().any(|a| a.task == **t && a.yes))
        .map(|t| (*t).to_owned())
        .collect()
}
