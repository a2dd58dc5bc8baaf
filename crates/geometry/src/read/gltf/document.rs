//! The parts of a glTF document that say where triangles are.

use std::collections::BTreeSet;

use serde::Deserialize;

use super::FORMAT;
use crate::GeometryError;
use crate::read::text::{error, quoted};

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Document {
    asset: Asset,
    #[serde(default)]
    extensions_required: Vec<String>,
    scene: Option<usize>,
    #[serde(default)]
    scenes: Vec<Scene>,
    #[serde(default)]
    pub nodes: Vec<Node>,
    #[serde(default)]
    pub meshes: Vec<Mesh>,
    #[serde(default)]
    pub accessors: Vec<Accessor>,
    #[serde(default)]
    pub buffer_views: Vec<View>,
    #[serde(default)]
    pub buffers: Vec<Buffer>,
}

#[derive(Deserialize)]
struct Asset {
    version: String,
}

#[derive(Deserialize)]
struct Scene {
    #[serde(default)]
    nodes: Vec<usize>,
}

#[derive(Deserialize)]
pub(super) struct Node {
    #[serde(default)]
    pub children: Vec<usize>,
    pub mesh: Option<usize>,
    /// Column by column.
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    /// x y z w.
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
}

#[derive(Deserialize)]
pub(super) struct Mesh {
    pub primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    pub attributes: Attributes,
    pub indices: Option<usize>,
    #[serde(default = "triangles")]
    pub mode: u32,
}

fn triangles() -> u32 {
    4
}

#[derive(Deserialize)]
pub(super) struct Attributes {
    #[serde(rename = "POSITION")]
    pub position: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub buffer_view: Option<usize>,
    #[serde(default)]
    pub byte_offset: usize,
    pub component_type: u32,
    #[serde(default)]
    pub normalized: bool,
    pub count: usize,
    #[serde(rename = "type")]
    pub kind: String,
    pub sparse: Option<Sparse>,
}

/// Elements that replace some of an accessor's.
#[derive(Deserialize)]
pub(super) struct Sparse {
    pub count: usize,
    pub indices: SparseIndices,
    pub values: SparseValues,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    pub buffer_view: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub component_type: u32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    pub buffer_view: usize,
    #[serde(default)]
    pub byte_offset: usize,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct View {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub byte_length: usize,
    pub byte_stride: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub uri: Option<String>,
    pub byte_length: usize,
}

/// Extensions that leave positions as they are, or that are read here.
const HARMLESS: [&str; 7] = [
    "KHR_mesh_quantization",
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "KHR_lights_",
    "KHR_xmp",
    "KHR_animation_pointer",
];

impl Document {
    pub fn parse(json: &[u8]) -> Result<Self, GeometryError> {
        let document: Self = serde_json::from_slice(json).map_err(|cause| {
            let place = match cause.line() {
                0 => "the document".to_owned(),
                line => format!("line {line}, column {}", cause.column()),
            };
            let whole = cause.to_string();
            let found = whole.split(" at line ").next().unwrap_or(&whole);
            error(FORMAT, place, found.to_owned(), "the JSON of a glTF 2.0 file")
        })?;
        if document.asset.version.split('.').next() != Some("2") {
            let found = quoted(&document.asset.version);
            return Err(error(FORMAT, "asset.version".into(), found, "2.0"));
        }
        for extension in &document.extensions_required {
            if !HARMLESS.iter().any(|known| extension.starts_with(known)) {
                return Err(error(
                    FORMAT,
                    "extensionsRequired".into(),
                    quoted(extension),
                    "plain or quantised positions; export without compression",
                ));
            }
        }
        Ok(document)
    }

    /// The nodes at the top of the default scene, else of the first one, else those that are nobody's child.
    pub fn roots(&self) -> Result<Vec<usize>, GeometryError> {
        if !self.scenes.is_empty() {
            let scene = self.scene.unwrap_or(0);
            return Ok(of(&self.scenes, scene, "scenes")?.nodes.clone());
        }
        let children: BTreeSet<usize> = self.nodes.iter().flat_map(|n| &n.children).copied().collect();
        Ok((0..self.nodes.len()).filter(|n| !children.contains(n)).collect())
    }

    pub fn node(&self, index: usize) -> Result<&Node, GeometryError> {
        of(&self.nodes, index, "nodes")
    }

    pub fn mesh(&self, index: usize) -> Result<&Mesh, GeometryError> {
        of(&self.meshes, index, "meshes")
    }

    pub fn accessor(&self, index: usize) -> Result<&Accessor, GeometryError> {
        of(&self.accessors, index, "accessors")
    }

    pub fn view(&self, index: usize) -> Result<&View, GeometryError> {
        of(&self.buffer_views, index, "bufferViews")
    }
}

/// An item, or an error that says how many there are.
fn of<'a, T>(items: &'a [T], index: usize, what: &str) -> Result<&'a T, GeometryError> {
    items.get(index).ok_or_else(|| {
        let expected = format!("one of {} {what}", items.len());
        error(
            FORMAT,
            "the document".into(),
            format!("{what}[{index}]"),
            expected,
        )
    })
}
