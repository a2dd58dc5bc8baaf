//! Objects: their boxes drawn over the mesh, what was guessed about them, and a sheet of grasps.

use maud::{Markup, html};

use crate::compositions::PARTS_LEGEND;
use crate::page::Sheet;
use crate::picture::Picture;

/// One object.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ObjectSection {
    /// Its name, unique among the objects.
    pub name: String,
    /// Its type.
    pub object_type: String,
    /// Triangles of its mesh.
    pub n_triangles: usize,
    /// Extents of its root box along x, y and z, metres.
    pub size: [f64; 3],
    /// Root box's volume over the sum of the boxes' volumes.
    pub cvex: f64,
    /// Boxes of its decomposition.
    pub n_boxes: usize,
    /// What was done about holes, scale, orientation: one sentence each.
    pub notes: Vec<String>,
    /// What was guessed rather than given; each stands in the page with a mark.
    pub guesses: Vec<String>,
    /// The boxes over the mesh (`Scene::boxes`), drawn 220 pixels wide.
    pub boxes: Picture,
    /// Directions and parts over the mesh (`Scene::parts`), where something was guessed; may be empty.
    pub parts: Picture,
    /// A sheet of grasps a hand.
    pub grasps: Vec<GraspSheet>,
}

/// Some grasps of one hand on one object.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GraspSheet {
    /// The hand.
    pub hand: String,
    /// Tries.
    pub tried: usize,
    /// Force-closure grasps among them.
    pub kept: usize,
    /// The grasps shown, chosen to spread over poses and labels.
    pub grasps: Vec<GraspPicture>,
}

/// One rendered grasp.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GraspPicture {
    /// The picture (`Scene::grasp`), drawn 112 pixels wide.
    pub picture: Picture,
    /// Tasks that the tutor said it affords; none is a legal answer.
    pub tasks: Vec<String>,
    /// ε of the L₁ grasp wrench space.
    pub qeps: f64,
}

pub(crate) fn render(objects: &[ObjectSection], out: &mut Sheet) -> Markup {
    html! {
        p {
            "Each object with the boxes that approximate it, and up to a handful of its force-closure grasps a hand. "
            "Under each grasp stand the tasks that the tutor says it affords ("
            @for (i, task) in out.tasks.to_vec().iter().enumerate() { @if i > 0 { ", " } (out.task(task)) }
            "; – for none) and its ε. Sizes are those of the root box; "
            "cvex is its volume over the sum of the boxes' volumes."
            @if objects.iter().any(|o| !o.parts.is_empty()) { " The second picture of an object shows its directions and parts (" (PARTS_LEGEND) "); what was guessed rather than given is listed as such." }
        }
        @if objects.is_empty() { p.muted { "No objects were in this run." } }
        @for (i, object) in objects.iter().enumerate() {
            @if i == 0 || objects[i - 1].object_type != object.object_type { h3 { (object.object_type) } }
            article.object {
                div.facts {
                    h4 { (object.name) }
                    p.muted {
                        (object.size.map(|s| format!("{:.0}", s * 1000.0)).join(" × ")) " mm · "
                        (object.n_triangles) " triangles · " (object.n_boxes)
                        @if object.n_boxes == 1 { " box" } @else { " boxes" } " · cvex " (format!("{:.2}", object.cvex))
                    }
                    div.pictures {
                        (out.picture(&object.boxes, 220))
                        @if !object.parts.is_empty() { (out.picture(&object.parts, 180)) }
                    }
                    @if !object.notes.is_empty() || !object.guesses.is_empty() {
                        ul.notes {
                            @for guess in &object.guesses { li { span.guess { "guessed" } " " (guess) } }
                            @for note in &object.notes { li { (note) } }
                        }
                    }
                }
                div.sheets { @for sheet in &object.grasps { (grasp_sheet(sheet, out)) } }
            }
        }
    }
}

fn grasp_sheet(sheet: &GraspSheet, out: &mut Sheet) -> Markup {
    html! {
        h5 {
            (sheet.hand) " "
            span.muted { (sheet.kept) " of " (sheet.tried) " tries kept" }
        }
        ul.grasps {
            @for grasp in &sheet.grasps {
                li {
                    (out.picture(&grasp.picture, 112))
                    span.labels { (labels(&grasp.tasks, out)) " " span.muted { (format!("ε {:.3}", grasp.qeps)) } }
                }
            }
        }
    }
}

/// The shapes of the tasks, each with its name for those who cannot see it.
fn labels(tasks: &[String], out: &Sheet) -> Markup {
    html! {
        @if tasks.is_empty() { span.muted title="no task" { "–" } }
        @for task in tasks {
            @let i = out.tasks.iter().position(|t| t == task).unwrap_or(usize::MAX);
            span class={ "task t" (i.min(3)) } title=(task) role="img" aria-label=(task) { (crate::palette::task_shape(i)) }
        }
    }
}
