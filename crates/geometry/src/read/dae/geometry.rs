//! One geometry of a COLLADA file.

use nalgebra::Point3;
use roxmltree::Node;

use super::xml::{Xml, child, children};
use crate::read::polygon::Faces;
use crate::read::text::{index_range, quoted};
use crate::{GeometryError, TriMesh};

/// The triangles of a geometry; `None` where it has none, such as lines and splines.
pub(super) fn read<'a>(xml: &Xml<'a, '_>, geometry: Node<'a, '_>) -> Result<Option<TriMesh>, GeometryError> {
    let Some(mesh) = child(geometry, "mesh").or_else(|| child(geometry, "convex_mesh")) else {
        return Ok(None);
    };
    let mut points = Vec::new();
    let mut faces = Faces::default();
    let mut read = Vec::new();
    for primitive in mesh.children().filter(Node::is_element) {
        let kind = primitive.tag_name().name();
        if !matches!(
            kind,
            "triangles" | "polylist" | "polygons" | "tristrips" | "trifans"
        ) {
            continue;
        }
        let Some(layout) = Layout::read(xml, primitive)? else {
            continue;
        };
        // Primitives of one mesh mostly share their positions; others follow behind.
        let known = read.iter().find(|(source, _)| *source == layout.positions.id());
        let first = if let Some((_, first)) = known {
            *first
        } else {
            let first = points.len();
            points.extend(positions(xml, layout.positions)?);
            read.push((layout.positions.id(), first));
            first
        };
        let n_points = points.len() - first;
        let corners = |element| layout.corners(xml, element, first, n_points);
        match kind {
            "triangles" => {
                for p in children(primitive, "p") {
                    corners(p)?
                        .as_chunks()
                        .0
                        .iter()
                        .for_each(|t| faces.push_triangle(*t));
                }
            }
            "polylist" => {
                let counts: Vec<usize> = match child(primitive, "vcount") {
                    Some(counts) => xml.whole_numbers(counts)?,
                    None => Vec::new(),
                };
                let all = match child(primitive, "p") {
                    Some(p) => corners(p)?,
                    None => Vec::new(),
                };
                let mut rest = all.as_slice();
                for count in counts {
                    let Some((polygon, after)) = rest.split_at_checked(count) else {
                        let found = format!("a polygon of {count} corners where {} are left", rest.len());
                        return Err(xml.error(primitive, found, "as many corners in <p> as <vcount> says"));
                    };
                    faces.push(polygon);
                    rest = after;
                }
            }
            "polygons" => {
                if let Some(holes) = child(primitive, "ph") {
                    return Err(xml.error(
                        holes,
                        "a polygon with holes".into(),
                        "polygons without; export triangles",
                    ));
                }
                for p in children(primitive, "p") {
                    faces.push(&corners(p)?);
                }
            }
            "tristrips" => {
                for p in children(primitive, "p") {
                    faces.push_strip(&corners(p)?);
                }
            }
            _ => {
                for p in children(primitive, "p") {
                    let fan = corners(p)?;
                    fan.windows(2)
                        .skip(1)
                        .for_each(|edge| faces.push_triangle([fan[0], edge[0], edge[1]]));
                }
            }
        }
    }
    if faces.is_empty() {
        return Ok(None);
    }
    faces.into_mesh(points).map(Some)
}

/// How the numbers of a primitive's `<p>` are to be taken.
struct Layout<'a, 'i> {
    /// The `<source>` of the positions.
    positions: Node<'a, 'i>,
    /// Which of the numbers of a corner is the position's index, and how many numbers a corner has.
    offset: usize,
    stride: usize,
}

impl<'a, 'i> Layout<'a, 'i> {
    /// `None` for a primitive without vertices.
    fn read(xml: &Xml<'a, 'i>, primitive: Node<'a, 'i>) -> Result<Option<Self>, GeometryError> {
        let mut stride = 0;
        let mut vertex = None;
        for input in children(primitive, "input") {
            let offset = xml.count(input, "offset", 0)?;
            stride = stride.max(offset.saturating_add(1));
            if matches!(input.attribute("semantic"), Some("VERTEX" | "POSITION")) {
                vertex = Some((input, offset));
            }
        }
        let Some((input, offset)) = vertex else {
            return Ok(None);
        };
        let mut source = xml.named(input, "source")?;
        if source.tag_name().name() == "vertices" {
            let position =
                children(source, "input").find(|input| input.attribute("semantic") == Some("POSITION"));
            let Some(position) = position else {
                return Err(xml.error(source, "vertices without positions".into(), "an input POSITION"));
            };
            source = xml.named(position, "source")?;
        }
        Ok(Some(Self {
            positions: source,
            offset,
            stride,
        }))
    }

    /// The corners in a `<p>`, as indices of points from `first` on.
    fn corners(&self, xml: &Xml, p: Node, first: usize, n_points: usize) -> Result<Vec<u32>, GeometryError> {
        let numbers: Vec<i64> = xml.whole_numbers(p)?;
        let corner = |numbers: &[i64]| {
            let index = numbers[self.offset];
            usize::try_from(index)
                .ok()
                .filter(|&index| index < n_points)
                .map(|index| (first + index) as u32)
                .ok_or_else(|| xml.error(p, index.to_string(), index_range(n_points)))
        };
        numbers.chunks_exact(self.stride).map(corner).collect()
    }
}

/// The points of a `<source>`.
fn positions<'a>(xml: &Xml<'a, '_>, source: Node<'a, '_>) -> Result<Vec<Point3<f64>>, GeometryError> {
    let missing = |what: &str| xml.error(source, format!("a source without {what}"), "positions");
    let accessor = child(source, "technique_common")
        .and_then(|technique| child(technique, "accessor"))
        .ok_or_else(|| missing("<accessor>"))?;
    let array = match accessor.attribute("source") {
        Some(_) => xml.named(accessor, "source")?,
        None => child(source, "float_array").ok_or_else(|| missing("<float_array>"))?,
    };
    if !matches!(array.tag_name().name(), "float_array" | "int_array") {
        return Err(xml.error(array, quoted(array.tag_name().name()), "a float_array"));
    }
    let numbers = xml.numbers(array)?;
    let (offset, stride) = (
        xml.count(accessor, "offset", 0)?,
        xml.count(accessor, "stride", 1)?,
    );
    let count = xml.count(accessor, "count", 0)?;
    let fits = stride >= 3
        && count
            .checked_mul(stride)
            .and_then(|n| n.checked_add(offset))
            .is_some_and(|n| n <= numbers.len());
    if !fits {
        let found = format!(
            "{count} elements of {stride} numbers from {offset} on, of {}",
            numbers.len()
        );
        return Err(xml.error(
            accessor,
            found,
            "elements of three numbers or more, all of them in the array",
        ));
    }
    let points = numbers[offset..].chunks_exact(stride).take(count);
    Ok(points.map(|p| Point3::new(p[0], p[1], p[2])).collect())
}
