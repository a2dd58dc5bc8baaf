//! Meshes and clouds as commands take them: any file, with the scale that the user or the file beside it states.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use prehend::geometry::{MeshFormat, Shape, TriMesh, read_shape};
use serde_json::{Value, json};

use crate::output::shown;

/// Options of every command that reads shapes.
#[derive(clap::Args)]
pub struct ShapeOptions {
    /// Metres per unit of the file; overrides the one in the .toml beside it
    #[arg(long, value_parser = positive, allow_negative_numbers = true)]
    pub scale: Option<f64>,

    /// Format of standard input (`-`), which has no extension: off, obj, stl, ply, xyz or pcd
    #[arg(long, value_parser = format)]
    pub format: Option<MeshFormat>,

    /// Ignore the .toml beside a mesh, guess nothing: coordinates are metres
    #[arg(long)]
    pub as_is: bool,
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
        .ok_or_else(|| format!("found `{name}`, expected off, obj, stl, ply, xyz or pcd"))
}

/// A shape and how it was taken.
pub struct Input {
    /// Mesh or cloud.
    pub shape: Shape,
    /// Vertices in the file; repair may have merged some.
    pub n_vertices: usize,
    /// Triangles in the file, polygons cut; 0 for a cloud.
    pub n_triangles: usize,
    /// `scale`, `up`, `front` and `notes`, for the answer.
    pub placement: Value,
}

/// Reads a shape. The `.toml` beside a mesh gives scale, up and front; what it leaves out stays as the file has it.
pub fn read(path: &Path, options: &ShapeOptions) -> Result<Input> {
    let format = format_of(path, options)?;
    let shape = read_shape(&prehend::files::read(path)?, format).with_context(|| shown(path))?;
    let (n_vertices, n_triangles) = match &shape {
        Shape::Mesh(mesh) => (mesh.vertices().len(), mesh.n_triangles()),
        Shape::Cloud(points) => (points.len(), 0),
    };
    let is_mesh = matches!(shape, Shape::Mesh(_));
    if is_mesh && !options.as_is && path.with_extension("toml").is_file() {
        let object = prehend::Object::read(path, prehend::ObjectOptions { as_is: false })?;
        let stated = object.placement.scale;
        let scale = options.scale.unwrap_or(stated);
        let placement = json!({ "scale": scale, "up": object.placement.up,
            "front": object.placement.front, "notes": object.notes });
        return Ok(Input {
            shape: Shape::Mesh(object.mesh.scaled(scale / stated)),
            n_vertices,
            n_triangles,
            placement,
        });
    }
    let scale = options.scale.unwrap_or(1.0);
    let shape = match shape {
        Shape::Mesh(mesh) => Shape::Mesh(mesh.scaled(scale)),
        Shape::Cloud(points) => Shape::Cloud(points.iter().map(|p| p * scale).collect()),
    };
    let placement = json!({ "scale": scale, "up": [0.0, 0.0, 1.0], "front": [1.0, 0.0, 0.0], "notes": [] });
    Ok(Input {
        shape,
        n_vertices,
        n_triangles,
        placement,
    })
}

fn format_of(path: &Path, options: &ShapeOptions) -> Result<MeshFormat> {
    if path == Path::new("-") {
        return options.format.context(
            "standard input: its format is not known; give --format off, obj, stl, ply, xyz or pcd",
        );
    }
    let extension = prehend::files::extension(path).unwrap_or_default();
    MeshFormat::from_extension(&extension).with_context(|| {
        format!(
            "{}: the extension `{extension}` is no shape; use .off .obj .stl .ply .xyz or .pcd",
            path.display()
        )
    })
}

/// A mesh, or an error where the file is a cloud.
pub fn read_mesh(path: &Path, options: &ShapeOptions) -> Result<(TriMesh, Value)> {
    let input = read(path, options)?;
    match input.shape {
        Shape::Mesh(mesh) => Ok((mesh, input.placement)),
        Shape::Cloud(points) => anyhow::bail!(
            "{}: is a cloud of {} points without triangles; this command needs a surface",
            path.display(),
            points.len()
        ),
    }
}

/// Files as names for answers.
pub fn named(files: &[PathBuf]) -> impl Iterator<Item = (Value, PathBuf)> + '_ {
    files.iter().map(|f| (json!(f.to_string_lossy()), f.clone()))
}
