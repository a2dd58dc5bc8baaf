//! A model as the two files that stand in `objects/`.

use super::model::{Model, PartBox};
use anyhow::{Context, Result};
use ply_rs_bw::ply::{
    Addable, DefaultElement, ElementDef, Encoding, Ply, Property, PropertyDef, PropertyType, ScalarType,
};
use ply_rs_bw::writer::Writer;
use std::fmt::Write;

/// The mesh as binary little-endian PLY: `float` positions in metres and triangles.
pub fn ply(model: &Model) -> Result<Vec<u8>> {
    let mut ply = Ply::<DefaultElement>::new();
    ply.header.encoding = Encoding::BinaryLittleEndian;
    ply.header.comments.push(format!(
        "{}, written by cargo xtask objects; metres, z up, x front",
        model.name
    ));

    let mut vertex = ElementDef::new("vertex".to_owned());
    for axis in ["x", "y", "z"] {
        vertex.properties.add(PropertyDef::new(
            axis.to_owned(),
            PropertyType::Scalar(ScalarType::Float),
        ));
    }
    ply.header.elements.add(vertex);
    let mut face = ElementDef::new("face".to_owned());
    let list = PropertyType::List(ScalarType::UChar, ScalarType::Int);
    face.properties
        .add(PropertyDef::new("vertex_indices".to_owned(), list));
    ply.header.elements.add(face);

    let points = model.shell.points.iter().map(|point| {
        let mut element = DefaultElement::new();
        for (axis, value) in ["x", "y", "z"].into_iter().zip(point.iter()) {
            element.insert(axis.to_owned(), Property::Float(*value as f32));
        }
        element
    });
    ply.payload.insert("vertex".to_owned(), points.collect());
    let triangles = model.shell.triangles.iter().map(|corners| {
        let mut element = DefaultElement::new();
        let corners = corners.iter().map(|&idx| idx as i32).collect();
        element.insert("vertex_indices".to_owned(), Property::ListInt(corners));
        element
    });
    ply.payload.insert("face".to_owned(), triangles.collect());

    let mut bytes = Vec::new();
    Writer::new()
        .write_ply(&mut bytes, &mut ply)
        .with_context(|| format!("{}: writing the mesh", model.name))?;
    Ok(bytes)
}

/// The description beside the mesh.
pub fn toml(model: &Model) -> String {
    let mut text = String::from("# Written by `cargo xtask objects`; change the generator, not this file.\n");
    let mut line = |key: &str, value: String| {
        writeln!(text, "{key} = {value}").expect("a string takes any text");
    };
    line("type", format!("\"{}\"", model.kind));
    line("metres_per_unit", "1.0".to_owned());
    line("up", "[0, 0, 1]".to_owned());
    line("front", "[1, 0, 0]".to_owned());
    line("mass", format!("{:.4}", model.mass));
    line("center_of_mass", vector(model.center_of_mass));
    line("material", format!("\"{}\"", model.material));
    if let Some(opening) = model.opening {
        let (center, radius) = (vector([0.0, 0.0, opening.z]), opening.radius);
        write!(
            text,
            "\n[opening]\ncenter = {center}\nnormal = [0, 0, 1]\nradius = {radius:.4}\n"
        )
        .expect("a string takes any text");
    }
    for (name, boxes) in [
        ("handle", &model.handle),
        ("functional", &model.functional),
        ("sharp", &model.sharp),
    ] {
        for PartBox { center, extents } in boxes {
            let (center, extents) = (vector(*center), vector(*extents));
            write!(text, "\n[[{name}]]\ncenter = {center}\nextents = {extents}\n")
                .expect("a string takes any text");
        }
    }
    text
}

/// Three numbers to 0.01 mm, without a negative zero.
fn vector(v: [f64; 3]) -> String {
    let [x, y, z] = v.map(|v| (v * 1e5).round() / 1e5 + 0.0);
    format!("[{x:.5}, {y:.5}, {z:.5}]")
}
