//! Objects: a mesh file and the `NAME.toml` beside it, brought into the object's frame.

use std::path::{Component, Path, PathBuf};

use nalgebra::{Matrix3, Point3, Rotation3, Unit, Vector3};
use prehend_geometry::{
    FileShape, MeshFormat, MeshReport, OrientedBox, Repairs, Shape, Stated, TriMesh, inspect,
    read_shape_with, repair,
};
use prehend_quality::Material;
use prehend_tutor::{Opening, Parts};
use serde::{Deserialize, Serialize};

use crate::{Error, files};

mod annotation;
mod guess;

pub use annotation::{Annotation, PartBox, Rim};
pub use guess::{is_in_millimetres, looks_like_millimetres};

/// Extensions of the meshes that an objects folder may hold.
pub const MESH_EXTENSIONS: [&str; 7] = ["off", "obj", "stl", "ply", "gltf", "glb", "dae"];

/// An object in its own frame: metres, up is +z, front is +x, origin as in its file.
#[derive(Debug, Clone)]
pub struct Object {
    /// The file's name without extension; unique within a run.
    pub name: String,
    /// `mug`, `hammer`, …; `unknown` where neither the file beside it nor its folder says.
    pub kind: String,
    /// The mesh file as given.
    pub path: PathBuf,
    /// The surface, repaired where that is safe.
    pub mesh: TriMesh,
    /// What the surface is like after repair.
    pub report: MeshReport,
    /// What was repaired.
    pub repairs: Repairs,
    /// How the file's coordinates became the object's.
    pub placement: Placement,
    /// Who said so.
    pub origins: Origins,
    /// Mass (kg), where the file beside it says.
    pub mass: Option<f64>,
    /// Centre of mass, where the file beside it says.
    pub center_of_mass: Option<Point3<f64>>,
    /// What it is made of; plastic where nothing says.
    pub material: Material,
    /// Parts for the tutor; guessed ones are listed in `notes`.
    pub parts: Parts,
    /// What was repaired, assumed or guessed, in words.
    pub notes: Vec<String>,
}

/// How a file's coordinates became the object's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Placement {
    /// Metres per unit of the file.
    pub scale: f64,
    /// The file's direction that became +z.
    pub up: [f64; 3],
    /// The file's direction that became +x.
    pub front: [f64; 3],
}

/// Where scale, up and front come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Origins {
    /// Of the scale.
    pub scale: Origin,
    /// Of the upward direction.
    pub up: Origin,
    /// Of the direction to the front.
    pub front: Origin,
}

/// Who says how a file's coordinates are to be taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// The caller ([`ObjectOptions`], a flag).
    Flag,
    /// The `.toml` beside the mesh.
    Toml,
    /// The file itself, or its format.
    File,
    /// The shape; what led to the guess is among the notes.
    Guessed,
    /// Nobody: the file's own coordinates.
    Assumed,
}

impl Placement {
    /// The placement with these directions, made unit and perpendicular.
    ///
    /// # Errors
    ///
    /// [`Error::Input`](crate::Error) where a direction has no length or both are parallel.
    pub fn new(scale: f64, up: [f64; 3], front: [f64; 3]) -> Result<Self, Error> {
        let wrong = || {
            Error::input(format!(
                "up {up:?} and front {front:?}: expected two different directions"
            ))
        };
        let unit = |v: [f64; 3]| {
            let unit = Vector3::from(v).try_normalize(1e-9)?;
            unit.iter().all(|c| c.is_finite()).then_some(unit)
        };
        let (z, x) = unit(up).zip(unit(front)).ok_or_else(wrong)?;
        if z.cross(&x).norm() < 1e-3 {
            return Err(wrong());
        }
        Ok(Self {
            scale,
            up: z.into(),
            front: (x - z * z.dot(&x)).normalize().into(),
        })
    }

    /// A point of the file in the object's frame.
    pub fn point(&self, p: &Point3<f64>) -> Point3<f64> {
        self.apply(p.coords.into())
    }

    fn object_from_file(&self) -> Rotation3<f64> {
        let z = Vector3::from(self.up);
        let x = Vector3::from(self.front);
        Rotation3::from_matrix_unchecked(Matrix3::from_rows(&[
            x.transpose(),
            z.cross(&x).transpose(),
            z.transpose(),
        ]))
    }

    fn apply(&self, p: [f64; 3]) -> Point3<f64> {
        self.object_from_file() * Point3::from(p) * self.scale
    }
}

/// How a mesh file is to be taken.
#[derive(Debug, Clone, Copy, Default)]
pub struct ObjectOptions {
    /// Ignore the file beside the mesh and guess nothing: coordinates are metres in the object's frame.
    pub as_is: bool,
    /// Metres per unit; overrides what file and annotation say.
    pub scale: Option<f64>,
    /// The file's direction that becomes +z; overrides what file and annotation say.
    pub up: Option<[f64; 3]>,
    /// The file's direction that becomes +x; overrides what the annotation says.
    pub front: Option<[f64; 3]>,
}

impl Object {
    /// Reads a mesh and the `.toml` beside it, and guesses what neither says, except parts that need boxes
    /// ([`Object::guess_parts`]).
    ///
    /// # Errors
    ///
    /// [`Error::File`] with the place in the mesh or the key in the annotation that is wrong.
    pub fn read(path: &Path, options: ObjectOptions) -> Result<Self, Error> {
        let extension = files::extension(path).unwrap_or_default();
        let format = MeshFormat::from_extension(&extension).ok_or_else(|| {
            Error::file(
                path,
                format!(
                    "the extension `{extension}` is no mesh; use .off, .obj, .stl, .ply, .gltf, .glb or .dae"
                ),
            )
        })?;
        Self::of_shape(path, read_with_files_beside(path, format)?, options)
    }

    /// [`Object::read`] of a file whose shape has been read already.
    ///
    /// # Errors
    ///
    /// Those of [`Object::read`].
    pub fn of_shape(path: &Path, read: FileShape, options: ObjectOptions) -> Result<Self, Error> {
        let FileShape { shape, stated } = read;
        let Shape::Mesh(raw) = shape else {
            return Err(Error::file(
                path,
                "is a point cloud without triangles; a grasp needs a surface",
            ));
        };
        let beside = path.with_extension("toml");
        let annotation = if !options.as_is && beside.is_file() {
            Annotation::parse(&files::read_text(&beside)?).map_err(|e| Error::file(&beside, e))?
        } else {
            Annotation::default()
        };
        Self::assemble(path, raw, stated, &annotation, options).map_err(|e| Error::file(path, e))
    }

    fn assemble(
        path: &Path,
        raw: TriMesh,
        stated: Stated,
        annotation: &Annotation,
        options: ObjectOptions,
    ) -> Result<Self, Error> {
        let mut notes = Vec::new();
        let (mesh, repairs) = repair(raw);
        let folder = path.parent().and_then(Path::file_name).and_then(|n| n.to_str());
        let kind = match (&annotation.kind, folder) {
            (Some(kind), _) => kind.clone(),
            (None, Some(folder)) if guess::KNOWN_KINDS.contains(&folder) => {
                notes.push(format!("guessed: type {folder}, from its folder's name"));
                folder.to_owned()
            }
            _ => "unknown".to_owned(),
        };
        let (placement, origins) = guess::placement(&mesh, &options, annotation, stated, &kind, &mut notes)?;
        let mesh = TriMesh::new(
            mesh.vertices()
                .iter()
                .map(|p| placement.apply(p.coords.into()))
                .collect(),
            mesh.triangles().to_vec(),
        )
        .map_err(Error::input)?;
        let report = inspect(&mesh);
        notes.extend(describe(&report, &repairs));
        let material = match annotation.material.as_deref() {
            Some(name) => name.parse().map_err(Error::input)?,
            None => Material::Plastic,
        };
        let parts = Parts {
            opening: annotation.opening.as_ref().map(|rim| Opening {
                center: placement.apply(rim.center),
                normal: Unit::new_normalize(placement.object_from_file() * Vector3::from(rim.normal)),
                radius: rim.radius * placement.scale,
            }),
            handle: place_boxes(&annotation.handle, &placement)?,
            functional: place_boxes(&annotation.functional, &placement)?,
            sharp: place_boxes(&annotation.sharp, &placement)?,
        };
        let name = path
            .file_stem()
            .and_then(|n| n.to_str())
            .unwrap_or("object")
            .to_owned();
        let mut object = Self {
            name,
            kind,
            path: path.to_owned(),
            mesh,
            report,
            repairs,
            placement,
            origins,
            mass: annotation.mass,
            center_of_mass: annotation.center_of_mass.map(|p| placement.apply(p)),
            material,
            parts,
            notes,
        };
        if !options.as_is {
            guess::opening(&mut object);
        }
        Ok(object)
    }

    /// Fills in parts that the file beside the mesh does not give, from the boxes of the decomposition; every guess is noted.
    pub fn guess_parts(&mut self, root: &OrientedBox, boxes: &[OrientedBox]) {
        guess::parts(self, root, boxes);
    }

    /// Whether the type is one that holds liquid, so that pouring from it makes sense.
    pub fn is_container(&self) -> bool {
        guess::CONTAINERS.contains(&self.kind.as_str())
    }

    /// All objects of a folder, sorted by path, with names that are unique: of two equal ones the second gets its type
    /// in front, or a number behind. A file that cannot be read is left out, and its error kept.
    ///
    /// # Errors
    ///
    /// [`Error::File`] where the folder holds no mesh that can be read.
    pub fn read_folder(folder: &Path, options: ObjectOptions) -> Result<ObjectFolder, Error> {
        let paths = files::list(folder, &MESH_EXTENSIONS)?;
        if paths.is_empty() {
            return Err(Error::file(
                folder,
                "holds no mesh; expected .off, .obj, .stl or .ply files at any depth",
            ));
        }
        let (mut objects, mut left_out): (Vec<Self>, Vec<Error>) = (Vec::new(), Vec::new());
        for path in &paths {
            match Self::read(path, options) {
                Ok(mut object) => {
                    object.name = unused_name(&object, &objects);
                    objects.push(object);
                }
                Err(e) => left_out.push(e),
            }
        }
        match left_out.first() {
            Some(first) if objects.is_empty() => Err(Error::file(
                folder,
                format!(
                    "none of its {} meshes can be used; the first: {first}",
                    paths.len()
                ),
            )),
            _ => Ok(ObjectFolder { objects, left_out }),
        }
    }
}

/// A shape, read with the further files that it names: those beside it.
///
/// # Errors
///
/// [`Error::File`] with the place in the file that is wrong.
pub fn read_with_files_beside(path: &Path, format: MeshFormat) -> Result<FileShape, Error> {
    let beside = |name: &str| {
        let further = Path::new(name);
        let inside = further
            .components()
            .all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        if !inside {
            return Err("does not stand beside the mesh".to_owned());
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        files::read(&folder.join(further)).map_err(|e| format!("cannot be had: {e}"))
    };
    read_shape_with(&files::read(path)?, format, &beside).map_err(|e| Error::file(path, e))
}

/// What a folder of meshes gave.
#[derive(Debug)]
pub struct ObjectFolder {
    /// The objects, sorted by path.
    pub objects: Vec<Object>,
    /// Why the other files are no objects; each error names its file.
    pub left_out: Vec<Error>,
}

fn unused_name(object: &Object, others: &[Object]) -> String {
    let free = |name: &String| others.iter().all(|o| o.name != *name);
    let typed = format!("{}_{}", object.kind, object.name);
    let numbered = (2..).map(|n| format!("{typed}_{n}"));
    [object.name.clone(), typed.clone()]
        .into_iter()
        .chain(numbered)
        .find(free)
        .unwrap_or(typed)
}

fn place_boxes(boxes: &[PartBox], placement: &Placement) -> Result<Vec<OrientedBox>, Error> {
    let turn = placement.object_from_file();
    boxes
        .iter()
        .map(|part| {
            let axes = turn * part.rotation();
            OrientedBox::new(
                placement.apply(part.center),
                axes,
                Vector3::from(part.extents) * placement.scale,
            )
            .map_err(Error::input)
        })
        .collect()
}

fn describe(report: &MeshReport, repairs: &Repairs) -> Vec<String> {
    let mut notes = Vec::new();
    for (count, what) in [
        (repairs.merged_vertices, "duplicate vertices merged"),
        (repairs.dropped_triangles, "degenerate triangles dropped"),
        (
            repairs.flipped_triangles,
            "triangles turned to agree with their neighbours",
        ),
        (repairs.inverted, "closed part turned inside out, mended"),
    ] {
        if count > 0 {
            notes.push(format!("repaired: {count} {what}"));
        }
    }
    if !report.watertight {
        notes.push(format!(
            "not closed: {} boundary and {} non-manifold edges, {} holes of {:.3e} m² in all left as they are; inside and outside are told by the winding number",
            report.boundary_edges,
            report.non_manifold_edges,
            report.n_holes,
            report.holes.iter().fold(0.0, |sum, hole| sum + hole.area)
        ));
    }
    notes
}
