//! One file a command.

use anyhow::Result;
use clap::Subcommand;

use crate::output::Outcome;

mod close;
mod decompose;
mod export;
mod free_volume;
mod grasps;
mod hand;
mod imitate;
mod label;
mod learn_structure;
mod mesh;
mod model;
mod partial_view;
mod pipeline;
mod plan;
mod quality;
mod query;
mod shape_input;
mod synthesize;
mod train;
mod training_rows;

/// What `prehend` can be asked to do.
#[derive(Subcommand)]
pub enum Command {
    /// Run every stage on a folder of objects and a folder of hands, and write the report
    Pipeline(pipeline::Arguments),
    /// Rank grasps of this hand on this object for this task
    Plan(plan::Arguments),
    /// Facts about meshes and clouds: volume, hull, minimum-volume box
    Mesh(mesh::Arguments),
    /// Boxes that an object is made of
    Decompose(decompose::Arguments),
    /// Share of a decomposition that a grasp leaves free
    FreeVolume(free_volume::Arguments),
    /// How well contacts hold: epsilon of the grasp wrench space
    Quality(quality::Arguments),
    /// What a hand is made of, and where its links are in a posture
    Hand(hand::Arguments),
    /// Plan and close grasps of a hand on an object
    Synthesize(synthesize::Arguments),
    /// Close a user's own grasp candidates
    Close(close::Arguments),
    /// Let the scripted tutor say which tasks each grasp affords
    Label(label::Arguments),
    /// Learn a network from tables
    Train(train::Arguments),
    /// Learn the arcs of a network from tables
    LearnStructure(learn_structure::Arguments),
    /// Ask a model: any nodes given any others
    Query(query::Arguments),
    /// Choose object and grasp that best imitate a demonstration
    Imitate(imitate::Arguments),
    /// List, filter and convert grasps
    Grasps(grasps::Arguments),
    /// Write grasps in the formats of other programs
    Export(export::Arguments),
    /// Size and cvex, with their uncertainty, of an object seen from one side only
    PartialView(partial_view::Arguments),
    /// Convert models
    Model(model::Arguments),
}

impl Command {
    /// Runs the command.
    pub fn run(self, json: bool) -> Result<Outcome> {
        match self {
            Self::Pipeline(a) => a.run(json),
            Self::Plan(a) => a.run(json),
            Self::Mesh(a) => a.run(json),
            Self::Decompose(a) => a.run(json),
            Self::FreeVolume(a) => a.run(json),
            Self::Quality(a) => a.run(json),
            Self::Hand(a) => a.run(json),
            Self::Synthesize(a) => a.run(json),
            Self::Close(a) => a.run(json),
            Self::Label(a) => a.run(json),
            Self::Train(a) => a.run(json),
            Self::LearnStructure(a) => a.run(json),
            Self::Query(a) => a.run(json),
            Self::Imitate(a) => a.run(json),
            Self::Grasps(a) => a.run(json),
            Self::Export(a) => a.run(json),
            Self::PartialView(a) => a.run(json),
            Self::Model(a) => a.run(json),
        }
    }
}

/// Sets the number of threads for the whole process.
fn use_threads(threads: usize) -> Result<()> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()?;
    Ok(())
}
