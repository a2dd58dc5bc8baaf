//! Per object: its boxes over the mesh, what was guessed, a sheet of grasps a hand.

use nalgebra::Vector3;
use prehend_grasp::object_size;
use prehend_report::{
    GraspPicture, GraspSheet, ObjectSection, PARTS_LEGEND, PartMarks, Picture, Scene, View,
};

use super::{Inputs, Stand, tasks_of};
use crate::Error;
use crate::grasp_table::GraspRecord;
use crate::stages::decompose::Shape;

/// Grasps on one sheet.
const GRASPS_SHOWN: usize = 4;

/// Pixels of a picture of boxes, and of a grasp: drawn at half that width.
const BOX_PIXELS: usize = 320;
const GRASP_PIXELS: usize = 168;

pub(super) fn section(inputs: &Inputs, stand: &Stand, shape: &Shape) -> Result<ObjectSection, Error> {
    let object = &shape.object;
    let mesh = &stand.meshes[object.name.as_str()];
    let n_boxes = shape.decomposition.boxes.len();
    let alt = format!("{}: its mesh with {n_boxes} boxes", object.name);
    let boxes = Scene::boxes(mesh, &shape.decomposition.boxes)
        .telling_picture(BOX_PIXELS, &format!("boxes-{}", object.name), &alt)
        .map_err(Error::input)?;
    let (guesses, notes): (Vec<String>, Vec<String>) = object
        .notes
        .iter()
        .cloned()
        .partition(|n| n.starts_with("guessed") || n.starts_with("assumed"));
    let parts = if guesses.is_empty() {
        Picture::default()
    } else {
        parts_picture(stand, shape)?
    };
    let grasps = inputs
        .hands
        .iter()
        .map(|h| sheet(inputs, stand, h.hand.name(), &object.name))
        .collect::<Result<_, _>>()?;
    Ok(ObjectSection {
        name: object.name.clone(),
        object_type: object.kind.clone(),
        n_triangles: object.mesh.n_triangles(),
        size: object_size(&shape.decomposition.root),
        cvex: shape.decomposition.cvex,
        n_boxes,
        notes,
        guesses,
        boxes,
        parts,
        grasps,
    })
}

fn parts_picture(stand: &Stand, shape: &Shape) -> Result<Picture, Error> {
    let parts = &shape.object.parts;
    let marks = PartMarks {
        up: Vector3::z(),
        front: Vector3::x(),
        opening: parts
            .opening
            .as_ref()
            .map(|o| (o.center, o.normal.into_inner(), o.radius)),
        handle: parts.handle.clone(),
        functional: parts.functional.clone(),
        sharp: parts.sharp.clone(),
    };
    let name = &shape.object.name;
    let alt = format!("{name}: up, front and parts as guessed. {PARTS_LEGEND:?}");
    Scene::parts(&stand.meshes[name.as_str()], &marks)
        .picture(View::Front, BOX_PIXELS, &format!("parts-{name}"), &alt)
        .map_err(Error::input)
}

fn sheet(inputs: &Inputs, stand: &Stand, hand: &str, object: &str) -> Result<GraspSheet, Error> {
    let file = inputs
        .grasp_files
        .iter()
        .find(|f| f.hand == hand && f.object == object);
    let tries = file.map(|f| f.tries.clone());
    let answers = inputs
        .learned
        .datasets
        .iter()
        .find(|d| d.hand == hand)
        .map(|d| &d.answers);
    let grasps = chosen(stand.grasps(hand, object), |g| {
        answers.map_or(Vec::new(), |a| tasks_of(a, &g.grasp_id))
    })
    .into_iter()
    .map(|(grasp, tasks)| {
        let said = if tasks.is_empty() {
            "no task".into()
        } else {
            tasks.join(", ")
        };
        let alt = format!("{hand} on {object}: {said}; ε {:.3}", grasp.epsilon);
        let picture = stand.grasp_picture(&grasp.grasp_id, GRASP_PIXELS, "", &alt)?;
        Ok(GraspPicture {
            picture,
            tasks,
            qeps: grasp.epsilon,
        })
    })
    .collect::<Result<_, Error>>()?;
    Ok(GraspSheet {
        hand: hand.to_owned(),
        tried: tries.as_ref().map_or(0, |t| t.tried),
        kept: tries.as_ref().map_or(0, |t| t.kept),
        grasps,
    })
}

/// The best grasp (by ε) of each set of labels in turn, until the sheet is full: a sheet shows what differs.
fn chosen(
    grasps: &[GraspRecord],
    tasks: impl Fn(&GraspRecord) -> Vec<String>,
) -> Vec<(&GraspRecord, Vec<String>)> {
    let mut by_label: std::collections::BTreeMap<Vec<String>, Vec<&GraspRecord>> =
        std::collections::BTreeMap::new();
    for grasp in grasps {
        by_label.entry(tasks(grasp)).or_default().push(grasp);
    }
    for group in by_label.values_mut() {
        group.sort_by(|a, b| b.epsilon.total_cmp(&a.epsilon));
    }
    let mut shown = Vec::new();
    let mut rank = 0;
    while shown.len() < GRASPS_SHOWN && by_label.values().any(|g| g.len() > rank) {
        for (label, group) in &by_label {
            if shown.len() < GRASPS_SHOWN
                && let Some(grasp) = group.get(rank)
            {
                shown.push((*grasp, label.clone()));
            }
        }
        // The next ones by ε would be near copies; a third further down the list looks different.
        rank += (grasps.len() / 12).max(1);
    }
    shown
}
