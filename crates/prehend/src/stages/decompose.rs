//! Objects become boxes: `shapes/OBJECT.json`.

use std::path::Path;

use prehend_geometry::{DecomposeOptions, Decomposition, decompose};
use prehend_grasp::GraspObject;
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::files::{self, Fingerprint};
use crate::object::{Object, ObjectOptions, Placement};
use crate::progress::Watch;

/// An object with its boxes, ready to be grasped.
pub struct Shape {
    /// The object.
    pub object: Object,
    /// Its boxes.
    pub decomposition: Decomposition,
    /// Equal where mesh, annotation and options are equal.
    pub fingerprint: String,
}

impl Shape {
    /// The object as the planner sees it.
    ///
    /// # Errors
    ///
    /// What the planner says of the mesh, with its file.
    pub fn grasp_object(&self) -> Result<GraspObject, Error> {
        GraspObject::new(
            self.object.mesh.clone(),
            &self.decomposition,
            self.object.center_of_mass,
            self.object.material,
        )
        .map_err(|e| Error::file(&self.object.path, e))
    }
}

/// What stands in `shapes/OBJECT.json`.
#[derive(Serialize, Deserialize)]
struct ShapeFile {
    fingerprint: String,
    object: String,
    #[serde(rename = "type")]
    kind: String,
    file: String,
    placement: Placement,
    watertight: bool,
    notes: Vec<String>,
    #[serde(flatten)]
    decomposition: Decomposition,
}

/// Decomposes every object, or takes the boxes from an earlier run. An object that has no boxes is left out with a
/// warning.
///
/// # Errors
///
/// Where a file cannot be written, [`Error::Stopped`], or where no object is left.
pub fn run(objects: Vec<Object>, out: &Path, watch: Watch) -> Result<Vec<Shape>, Error> {
    watch.progress.begin("decompose", objects.len() as u64);
    let options = DecomposeOptions::default();
    let mut shapes = Vec::with_capacity(objects.len());
    for object in objects {
        watch.check()?;
        let path = out.join("shapes").join(format!("{}.json", object.name));
        let (name, file) = (object.name.clone(), object.path.clone());
        shapes.extend(watch.or_left_out(&name, Some(&file), shape(object, &options, Some(&path)))?);
        watch.progress.advance(1);
    }
    watch.progress.end();
    if shapes.is_empty() {
        return Err(Error::input(
            "no object can be decomposed; see the warnings above",
        ));
    }
    Ok(shapes)
}

/// One object with its boxes, without an output folder.
///
/// # Errors
///
/// As [`run`].
pub fn shape_of(path: &Path, options: ObjectOptions) -> Result<Shape, Error> {
    shape(Object::read(path, options)?, &DecomposeOptions::default(), None)
}

fn shape(mut object: Object, options: &DecomposeOptions, path: Option<&Path>) -> Result<Shape, Error> {
    let fingerprint = fingerprint(&object)?;
    let known = path
        .filter(|p| p.is_file())
        .and_then(|p| serde_json::from_slice::<ShapeFile>(&files::read(p).ok()?).ok())
        .filter(|file| file.fingerprint == fingerprint);
    let decomposition = match &known {
        Some(file) => file.decomposition.clone(),
        None => decompose(&object.mesh, options).map_err(|e| Error::file(&object.path, e))?,
    };
    object.guess_parts(&decomposition.root, &decomposition.boxes);
    if let (None, Some(path)) = (&known, path) {
        let file = ShapeFile {
            fingerprint: fingerprint.clone(),
            object: object.name.clone(),
            kind: object.kind.clone(),
            file: object.path.to_string_lossy().into_owned(),
            placement: object.placement,
            watertight: object.report.watertight,
            notes: object.notes.clone(),
            decomposition: decomposition.clone(),
        };
        let text = serde_json::to_vec_pretty(&file).map_err(Error::input)?;
        files::write(path, &text)?;
    }
    Ok(Shape {
        object,
        decomposition,
        fingerprint,
    })
}

fn fingerprint(object: &Object) -> Result<String, Error> {
    let beside = object.path.with_extension("toml");
    let annotation = if beside.is_file() {
        files::read(&beside)?
    } else {
        Vec::new()
    };
    Ok(Fingerprint::of_stage("decompose")
        .with(&files::read(&object.path)?)
        .with(&annotation)
        .with(object.name.as_bytes())
        .with(object.kind.as_bytes())
        .with(&object.placement.scale.to_le_bytes())
        .finish())
}
