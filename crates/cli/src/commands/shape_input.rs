//! Meshes and clouds as commands take them: any file, with the scale that the user or the file beside it states.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use nalgebra::Point3;
use prehend::geometry::{FileShape, MeshFormat, Repairs, Shape, Stated, TriMesh};
use prehend::object::{
    Origin, Origins, Placement, is_in_millimetres, looks_like_millimetres, read_with_files_beside,
};
use prehend::{Object, ObjectOptions};
use serde_json::{Value, json};

use crate::output::shown;

/// How a mesh's coordinates are to be taken: options of every command that takes an object.
#[derive(clap::Args)]
pub struct PlacementOptions {
    /// Metres per unit of the file; overrides the .toml beside it and the file itself
    #[arg(long, value_parser = positive, allow_negative_numbers = true, conflicts_with = "units")]
    pub scale: Option<f64>,

    /// Unit of the file, in place of --scale: m, dm, cm, mm, um, in or ft
    #[arg(long, value_parser = unit)]
    pub units: Option<f64>,

    /// The file's direction that is up: x, -x, y, … or three numbers such as 0,1,0
    #[arg(long, value_parser = direction, allow_hyphen_values = true)]
    pub up: Option<Direction>,

    /// The file's direction to the front: a mug's handle, a hammer's face, a knife's edge
    #[arg(long, value_parser = direction, allow_hyphen_values = true)]
    pub front: Option<Direction>,

    /// Ignore the .toml beside a mesh, guess nothing: coordinates are metres
    #[arg(long)]
    pub as_is: bool,
}

impl PlacementOptions {
    /// For reading an object.
    pub fn object_options(&self) -> ObjectOptions {
        ObjectOptions {
            as_is: self.as_is,
            scale: self.scale.or(self.units),
            up: self.up.map(|d| d.0),
            front: self.front.map(|d| d.0),
        }
    }
}

/// Options of every command that reads shapes.
#[derive(clap::Args)]
pub struct ShapeOptions {
    #[command(flatten)]
    pub placement: PlacementOptions,

    /// Format of standard input (`-`), which has no extension: off, obj, stl, ply, xyz, pcd, gltf, glb or dae
    #[arg(long, value_parser = format)]
    pub format: Option<MeshFormat>,
}

fn unit(name: &str) -> Result<f64, String> {
    Ok(match name {
        "m" => 1.0,
        "dm" => 0.1,
        "cm" => 0.01,
        "mm" => 0.001,
        "um" => 1e-6,
        "in" => 0.0254,
        "ft" => 0.3048,
        _ => return Err(format!("found `{name}`, expected m, dm, cm, mm, um, in or ft")),
    })
}

/// A direction, for arguments.
#[derive(Debug, Clone, Copy)]
pub struct Direction([f64; 3]);

fn direction(text: &str) -> Result<Direction, String> {
    let wrong = || format!("found `{text}`, expected x, -x, y, -y, z, -z or three numbers such as 0,1,0");
    let (sign, axis) = match text.strip_prefix('-') {
        Some(axis) => (-1.0, axis),
        None => (1.0, text.strip_prefix('+').unwrap_or(text)),
    };
    if let Some(k) = ["x", "y", "z"].iter().position(|name| *name == axis) {
        let mut direction = [0.0; 3];
        direction[k] = sign;
        return Ok(Direction(direction));
    }
    let numbers: Vec<f64> = text
        .split(',')
        .map(|word| word.trim().parse().map_err(|_| wrong()))
        .collect::<Result<_, _>>()?;
    match <[f64; 3]>::try_from(numbers) {
        Ok(v) if v.iter().all(|c| c.is_finite()) && v.iter().any(|c| c.abs() > 1e-9) => Ok(Direction(v)),
        _ => Err(wrong()),
    }
}

/// A positive number, for arguments.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if v.is_finite() && v > 0.0 => Ok(v),
        _ => Err(format!("found `{text}`, expected a positive number")),
    }
}

fn format(name: &str) -> Result<MeshFormat, String> {
    MeshFormat::from_extension(name)
        .ok_or_else(|| format!("found `{name}`, expected off, obj, stl, ply, xyz, pcd, gltf, glb or dae"))
}

/// A shape and how it was taken.
pub struct Input {
    /// Mesh or cloud.
    pub shape: Shape,
    /// Vertices in the file; repair may have merged some.
    pub n_vertices: usize,
    /// Triangles in the file, polygons cut; 0 for a cloud.
    pub n_triangles: usize,
    /// `scale`, `up`, `front`, who said so (`scale_from`, …: flag, toml, file, guessed or assumed) and `notes`.
    pub placement: Value,
    /// What was mended on reading; `None` where the shape is as in the file.
    pub repairs: Option<Repairs>,
}

/// Reads a shape. Flags, the `.toml` beside a mesh and the file itself give scale, up and front, in this order; without a
/// `.toml`, what is missing stays as the file has it, except that a mug (bottle, …) of 30 to 600 units is in millimetres.
pub fn read(path: &Path, options: &ShapeOptions) -> Result<Input> {
    let format = format_of(path, options)?;
    let FileShape { shape, stated } = read_with_files_beside(path, format)?;
    let (n_vertices, n_triangles) = match &shape {
        Shape::Mesh(mesh) => (mesh.vertices().len(), mesh.n_triangles()),
        Shape::Cloud(points) => (points.len(), 0),
    };
    let placed = |shape: Shape, placement: &Placement, origins: &Origins, notes: &[String]| {
        let placement = json!({ "scale": placement.scale, "scale_from": origins.scale, "up": placement.up,
            "up_from": origins.up, "front": placement.front, "front_from": origins.front, "notes": notes });
        Input {
            shape,
            n_vertices,
            n_triangles,
            placement,
            repairs: None,
        }
    };
    let flags = options.placement.object_options();
    if matches!(shape, Shape::Mesh(_)) && !flags.as_is && path.with_extension("toml").is_file() {
        let object = Object::of_shape(path, FileShape { shape, stated }, flags)?;
        let input = placed(
            Shape::Mesh(object.mesh),
            &object.placement,
            &object.origins,
            &object.notes,
        );
        return Ok(Input {
            repairs: Some(object.repairs),
            ..input
        });
    }
    let stated = if flags.as_is { Stated::default() } else { stated };
    let mut notes = Vec::new();
    let scale = (flags.scale.map(|s| (s, Origin::Flag)))
        .or(stated.metres_per_unit.map(|s| (s, Origin::File)))
        .unwrap_or_else(|| {
            if flags.as_is || !looks_like_millimetres(shape.points()) {
                (1.0, Origin::Assumed)
            } else if is_in_millimetres(shape.points(), path) {
                notes.push("guessed: millimetres, since the largest extent is 30 to 600 units; --units says otherwise".to_owned());
                (0.001, Origin::Guessed)
            } else {
                notes.push("assumed: metres, though the largest extent is 30 to 600 units; --units mm says otherwise".to_owned());
                (1.0, Origin::Assumed)
            }
        });
    for note in &notes {
        tracing::warn!("{}: {note}", shown(path));
    }
    let file_up = stated.up.map(|v| (v.into_inner().into(), Origin::File));
    let up: ([f64; 3], Origin) = (flags.up.map(|v| (v, Origin::Flag)))
        .or(file_up)
        .unwrap_or(([0.0, 0.0, 1.0], Origin::Assumed));
    let across = if up.0[0].abs() < 0.9 * up.0[1].hypot(up.0[2]) {
        [1.0, 0.0, 0.0]
    } else {
        [0.0, 1.0, 0.0]
    };
    let front = flags
        .front
        .map_or((across, Origin::Assumed), |v| (v, Origin::Flag));
    let placement = Placement::new(scale.0, up.0, front.0).with_context(|| shown(path))?;
    let origins = Origins {
        scale: scale.1,
        up: up.1,
        front: front.1,
    };
    let place = |points: &[Point3<f64>]| points.iter().map(|p| placement.point(p)).collect();
    let shape = match shape {
        Shape::Mesh(mesh) => Shape::Mesh(TriMesh::new(place(mesh.vertices()), mesh.triangles().to_vec())?),
        Shape::Cloud(points) => Shape::Cloud(place(&points)),
    };
    Ok(placed(shape, &placement, &origins, &notes))
}

fn format_of(path: &Path, options: &ShapeOptions) -> Result<MeshFormat> {
    if path == Path::new("-") {
        return options.format.context(
            "standard input: its format is not known; give --format off, obj, stl, ply, xyz, pcd, gltf, glb or dae",
        );
    }
    let extension = prehend::files::extension(path).unwrap_or_default();
    MeshFormat::from_extension(&extension).with_context(|| {
        format!(
            "{}: the extension `{extension}` is no shape; use .off .obj .stl .ply .xyz .pcd .gltf .glb or .dae",
            path.display()
        )
    })
}

/// Files as names for answers.
pub fn named(files: &[PathBuf]) -> impl Iterator<Item = (Value, PathBuf)> + '_ {
    files.iter().map(|f| (json!(f.to_string_lossy()), f.clone()))
}
