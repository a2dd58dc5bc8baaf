//! glTF 2.0, as JSON with buffers beside it and as GLB: the triangles of the default scene, placed by their nodes.
//!
//! Materials, skins, morph targets and animations are passed over: what comes is the shape at rest. Positions may be
//! quantised (`KHR_mesh_quantization`) and sparse. Compressed meshes (Draco, meshopt) are refused by name.
//!
//! The crate `gltf` was tried first; `docs/decisions/mesh-readers.md` says why it gave way.

mod accessor;
mod document;

use nalgebra::{Matrix4, Point3, Quaternion, UnitQuaternion, Vector3};

use self::accessor::{Buffers, read_indices, read_points};
use self::document::{Document, Node, Primitive};
use super::Resolve;
use super::assembly::Assembly;
use super::polygon::Faces;
use super::text::{error, truncated};
use crate::{GeometryError, TriMesh};

const FORMAT: &str = "glTF";

pub(super) fn read(bytes: &[u8], resolve: &Resolve) -> Result<TriMesh, GeometryError> {
    let (json, chunk) = if bytes.starts_with(b"glTF") {
        unwrap_glb(bytes)?
    } else {
        (bytes, None)
    };
    let document = Document::parse(json)?;
    let buffers = Buffers::load(&document, chunk, resolve)?;
    let mut assembly = Assembly::new(FORMAT);
    let mut parts = vec![None; document.meshes.len()];
    for (mesh, scene_from_mesh) in placements(&document)? {
        if parts.get(mesh).is_none_or(Option::is_none) {
            let primitives = &document.mesh(mesh)?.primitives;
            let read = primitives
                .iter()
                .enumerate()
                .map(|(nth, primitive)| read_primitive(&document, &buffers, primitive, mesh, nth))
                .collect::<Result<Vec<_>, _>>()?;
            parts[mesh] = Some(read);
        }
        for part in parts[mesh].iter().flatten().flatten() {
            assembly.place(part, &scene_from_mesh)?;
        }
    }
    assembly.into_mesh()
}

/// The JSON and the binary chunk of a GLB file.
fn unwrap_glb(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), GeometryError> {
    const JSON: u32 = 0x4e4f_534a;
    const BIN: u32 = 0x004e_4942;
    let word = |at: usize| {
        let raw = bytes.get(at..at + 4)?;
        Some(u32::from_le_bytes(raw.try_into().ok()?))
    };
    if word(4) != Some(2) {
        let found = word(4).map_or_else(|| format!("{} bytes", bytes.len()), |v| format!("version {v}"));
        return Err(error("GLB", "byte 4".into(), found, "version 2"));
    }
    let chunk = |at: usize| -> Result<Option<(u32, &[u8])>, GeometryError> {
        let (Some(length), Some(kind)) = (word(at), word(at + 4)) else {
            return Ok(None);
        };
        let data = bytes.get(at + 8..).and_then(|rest| rest.get(..length as usize));
        let data = data.ok_or_else(|| {
            let found = format!("{} bytes in the chunk at byte {at}", bytes.len() - at - 8);
            truncated("GLB", found, format!("{length}, as declared"))
        })?;
        Ok(Some((kind, data)))
    };
    let Some((JSON, json)) = chunk(12)? else {
        return Err(error(
            "GLB",
            "byte 12".into(),
            "no chunk JSON".into(),
            "the chunk JSON",
        ));
    };
    // Chunks are padded to four bytes; some programs leave the padding out of the length.
    let after = 20 + json.len().next_multiple_of(4);
    match chunk(after)? {
        Some((BIN, data)) => Ok((json, Some(data))),
        _ => Ok((json, None)),
    }
}

/// Meshes with the matrices that place them, in the order of the scene's tree.
fn placements(document: &Document) -> Result<Vec<(usize, Matrix4<f64>)>, GeometryError> {
    let roots = document.roots()?;
    if roots.is_empty() && document.nodes.is_empty() {
        return Ok((0..document.meshes.len())
            .map(|mesh| (mesh, Matrix4::identity()))
            .collect());
    }
    let mut placements = Vec::new();
    let mut seen = vec![false; document.nodes.len()];
    let mut open: Vec<(usize, Matrix4<f64>)> =
        roots.iter().rev().map(|&n| (n, Matrix4::identity())).collect();
    while let Some((index, scene_from_parent)) = open.pop() {
        let node = document.node(index)?;
        if std::mem::replace(&mut seen[index], true) {
            let place = format!("nodes[{index}]");
            return Err(error(FORMAT, place, "a node with two parents".into(), "a tree"));
        }
        let scene_from_node = scene_from_parent * parent_from_node(node);
        placements.extend(node.mesh.map(|mesh| (mesh, scene_from_node)));
        open.extend(node.children.iter().rev().map(|&child| (child, scene_from_node)));
    }
    Ok(placements)
}

fn parent_from_node(node: &Node) -> Matrix4<f64> {
    if let Some(matrix) = node.matrix {
        return Matrix4::from_column_slice(&matrix);
    }
    let [x, y, z, w] = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let turn = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 0.0).unwrap_or_default();
    let scale = Vector3::from(node.scale.unwrap_or([1.0; 3]));
    Matrix4::new_translation(&Vector3::from(node.translation.unwrap_or_default()))
        * turn.to_homogeneous()
        * Matrix4::new_nonuniform_scaling(&scale)
}

/// The triangles of a primitive; `None` for points, lines and primitives without positions.
fn read_primitive(
    document: &Document,
    buffers: &Buffers,
    primitive: &Primitive,
    mesh: usize,
    nth: usize,
) -> Result<Option<TriMesh>, GeometryError> {
    const TRIANGLES: u32 = 4;
    const STRIP: u32 = 5;
    const FAN: u32 = 6;
    let (Some(positions), TRIANGLES | STRIP | FAN) = (primitive.attributes.position, primitive.mode) else {
        return Ok(None);
    };
    let points: Vec<Point3<f64>> = read_points(document, buffers, positions)?;
    let corners = match primitive.indices {
        Some(indices) => read_indices(document, buffers, indices)?,
        None => (0..points.len() as u32).collect(),
    };
    if let Some(corner) = corners.iter().find(|&&corner| corner as usize >= points.len()) {
        let place = format!("meshes[{mesh}].primitives[{nth}]");
        return Err(error(
            FORMAT,
            place,
            corner.to_string(),
            super::text::index_range(points.len()),
        ));
    }
    let mut faces = Faces::with_capacity(corners.len() / 3);
    match primitive.mode {
        TRIANGLES => corners.as_chunks().0.iter().for_each(|t| faces.push_triangle(*t)),
        STRIP => faces.push_strip(&corners),
        _ => corners
            .windows(2)
            .skip(1)
            .for_each(|edge| faces.push_triangle([corners[0], edge[0], edge[1]])),
    }
    if faces.is_empty() {
        return Ok(None);
    }
    faces.into_mesh(points).map(Some)
}

#[cfg(test)]
mod tests;
