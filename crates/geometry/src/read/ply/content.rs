//! What the elements of a PLY file add up to.

use nalgebra::Point3;

use super::FORMAT;
use crate::GeometryError;
use crate::read::polygon::Faces;
use crate::read::text::{error, index_range};
use crate::read::{Shape, cloud};

/// Whether a list holds the corners of faces.
pub(super) fn is_corners(property: &str) -> bool {
    matches!(property, "vertex_indices" | "vertex_index")
}

/// One element: a vertex's coordinates or a face's corners.
#[derive(Debug, Default)]
pub(super) struct Record {
    pub point: [f64; 3],
    pub corners: Vec<i64>,
}

impl Record {
    pub fn clear(&mut self) {
        self.corners.clear();
    }

    pub fn coordinate(&mut self, property: &str) -> Option<&mut f64> {
        let axis = ["x", "y", "z"].iter().position(|axis| *axis == property)?;
        Some(&mut self.point[axis])
    }
}

/// Where an element stands, for errors.
#[derive(Debug, Clone, Copy)]
pub(super) enum Spot<'a> {
    Line(usize),
    Element {
        name: &'a str,
        index: usize,
        offset: usize,
    },
}

impl std::fmt::Display for Spot<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Element { name, index, offset } => write!(f, "{name} {index} (byte {offset})"),
        }
    }
}

#[derive(Default)]
pub(super) struct Content<'a> {
    vertices: Vec<Point3<f64>>,
    faces: Faces,
    polygon: Vec<u32>,
    has_faces: bool,
    /// The largest index and where it stands: faces may come before vertices, so this is judged at the end.
    largest: Option<(u32, Spot<'a>)>,
}

impl<'a> Content<'a> {
    pub fn add(&mut self, element: &str, record: &Record, spot: Spot<'a>) -> Result<(), GeometryError> {
        match element {
            "vertex" => {
                if let Some(value) = record.point.iter().find(|c| !c.is_finite()) {
                    return Err(error(
                        FORMAT,
                        spot.to_string(),
                        format!("the coordinate {value}"),
                        "a finite number",
                    ));
                }
                self.vertices.push(record.point.into());
            }
            "face" => {
                self.has_faces = true;
                self.polygon.clear();
                for &corner in &record.corners {
                    let corner = self.index(corner, spot)?;
                    self.polygon.push(corner);
                }
                self.faces.push(&self.polygon);
            }
            "tristrips" => {
                self.has_faces = true;
                // −1 starts a new strip; every second triangle of a strip is wound the other way.
                for strip in record.corners.split(|&corner| corner == -1) {
                    let strip: Vec<u32> = strip
                        .iter()
                        .map(|&c| self.index(c, spot))
                        .collect::<Result<_, _>>()?;
                    self.faces.push_strip(&strip);
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn index(&mut self, corner: i64, spot: Spot<'a>) -> Result<u32, GeometryError> {
        let index = u32::try_from(corner).map_err(|_| {
            error(
                FORMAT,
                spot.to_string(),
                corner.to_string(),
                "a vertex index from 0",
            )
        })?;
        if self.largest.as_ref().is_none_or(|(largest, _)| index > *largest) {
            self.largest = Some((index, spot));
        }
        Ok(index)
    }

    pub fn finish(self) -> Result<Shape, GeometryError> {
        match self.largest {
            Some((index, spot)) if index as usize >= self.vertices.len() => Err(error(
                FORMAT,
                spot.to_string(),
                index.to_string(),
                index_range(self.vertices.len()),
            )),
            _ if self.has_faces => self.faces.into_mesh(self.vertices).map(Shape::Mesh),
            _ => cloud(self.vertices).map(Shape::Cloud),
        }
    }
}
