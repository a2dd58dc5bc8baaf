//! The elements of a PLY file that is text.

use ply_rs_bw::ply::{Header, PropertyType};

use super::FORMAT;
use super::content::{Content, Record, Spot, is_corners};
use crate::GeometryError;
use crate::read::text::{Place, decode, lines, truncated};

/// Elements in the order of the head, word by word.
pub(super) fn read(
    head: &Header,
    body: &[u8],
    first_line: usize,
    content: &mut Content,
) -> Result<(), GeometryError> {
    let text = decode(body);
    let mut words = lines(&text).flat_map(|(line, record)| {
        record
            .split_whitespace()
            .map(move |word| (first_line + line - 1, word))
    });
    let mut record = Record::default();
    for (name, element) in &head.elements {
        if element.properties.is_empty() {
            continue;
        }
        for index in 0..element.count {
            record.clear();
            let mut line = 0;
            let mut next = || {
                let (at, word) = words.next().ok_or_else(|| {
                    truncated(
                        FORMAT,
                        format!("{index} of element {name}"),
                        format!("{}, as declared", element.count),
                    )
                })?;
                line = at;
                Ok((
                    Place {
                        format: FORMAT,
                        line: at,
                    },
                    word,
                ))
            };
            for (property, definition) in &element.properties {
                let (place, word) = next()?;
                match definition.data_type {
                    // What is not used is not judged: a colour may be anything.
                    PropertyType::Scalar(_) => {
                        if let Some(slot) = record.coordinate(property) {
                            *slot = place.number(word)?;
                        }
                    }
                    PropertyType::List(..) => {
                        let wanted = is_corners(property);
                        for _ in 0..place.count(word, "the length of a list")? {
                            let (place, word) = next()?;
                            if wanted {
                                let corner = word.parse().map_err(|_| place.error(word, "a vertex index"))?;
                                record.corners.push(corner);
                            }
                        }
                    }
                }
            }
            content.add(name, &record, Spot::Line(line))?;
        }
    }
    Ok(())
}
