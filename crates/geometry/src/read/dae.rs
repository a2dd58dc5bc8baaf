//! COLLADA (DAE) 1.4 and 1.5: the triangles and polygons of the scene, placed by its nodes.
//!
//! Materials, lights, cameras, animations and physics are passed over. A skinned geometry comes as it was bound. The
//! unit and the upward axis are reported beside the mesh, not applied: coordinates stay the file's own.
//!
//! The XML is `roxmltree`'s work; `docs/decisions/mesh-readers.md` says why no COLLADA crate is used.

mod geometry;
mod scene;
mod xml;

use nalgebra::Vector3;

use self::xml::Xml;
use super::Stated;
use super::text::{decode, error, quoted};
use crate::{GeometryError, TriMesh};

const FORMAT: &str = "DAE";

pub(super) fn read(bytes: &[u8]) -> Result<(TriMesh, Stated), GeometryError> {
    let text = decode(bytes);
    let document = roxmltree::Document::parse(text.trim_start_matches('\u{feff}')).map_err(|cause| {
        let place = format!("line {}", cause.pos().row);
        error(FORMAT, place, cause.to_string(), "well-formed XML")
    })?;
    let xml = Xml::new(&document);
    let root = document.root_element();
    if root.tag_name().name() != "COLLADA" {
        return Err(xml.error(root, quoted(root.tag_name().name()), "the element COLLADA"));
    }
    let stated = asset(&xml, root)?;
    Ok((scene::read(&xml, root)?, stated))
}

/// The unit, 1 m where the file gives none, and the upward axis.
fn asset(xml: &Xml, root: roxmltree::Node) -> Result<Stated, GeometryError> {
    let asset = xml::child(root, "asset");
    let unit = asset.and_then(|asset| xml::child(asset, "unit"));
    let metres_per_unit = match unit.and_then(|unit| Some((unit, unit.attribute("meter")?))) {
        None => None,
        Some((unit, meter)) => match meter.trim().parse::<f64>() {
            Ok(value) if value.is_finite() && value > 0.0 => Some(value),
            _ => return Err(xml.error(unit, quoted(meter), "a positive number of metres")),
        },
    };
    let up = match asset.and_then(|asset| xml::child(asset, "up_axis")) {
        None => None,
        Some(axis) => match axis.text().unwrap_or("").trim() {
            "X_UP" => Some(Vector3::x_axis()),
            "Y_UP" => Some(Vector3::y_axis()),
            "Z_UP" => Some(Vector3::z_axis()),
            other => return Err(xml.error(axis, quoted(other), "X_UP, Y_UP or Z_UP")),
        },
    };
    Ok(Stated { metres_per_unit, up })
}

#[cfg(test)]
mod tests;
