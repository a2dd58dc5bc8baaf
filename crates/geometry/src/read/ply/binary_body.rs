//! The elements of a PLY file that is bytes of either order.

use ply_rs_bw::parser::{ParseError, Parser};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType,
};

use super::FORMAT;
use super::content::{Content, Record, Spot, is_corners};
use crate::GeometryError;
use crate::read::text::{error, truncated};

/// Elements in the order of the head, byte by byte.
pub(super) fn read<'a>(
    head: &'a Header,
    bytes: &[u8],
    body: usize,
    content: &mut Content<'a>,
) -> Result<(), GeometryError> {
    let parser = Parser::<Record>::new();
    let mut rest = &bytes[body..];
    for (name, element) in &head.elements {
        let least = least_size(element);
        if least == 0 {
            continue;
        }
        if element.count > rest.len() / least {
            let found = format!("{} bytes for element {name}", rest.len());
            return Err(truncated(
                FORMAT,
                found,
                format!("at least {least} for each of {}", element.count),
            ));
        }
        for index in 0..element.count {
            let offset = bytes.len() - rest.len();
            let spot = Spot::Element { name, index, offset };
            let record = match head.encoding {
                Encoding::BinaryBigEndian => parser.read_big_endian_element(&mut rest, element),
                _ => parser.read_little_endian_element(&mut rest, element),
            }
            .map_err(|cause| binary_error(spot, &cause))?;
            content.add(name, &record, spot)?;
        }
    }
    Ok(())
}

fn binary_error(spot: Spot, cause: &ParseError) -> GeometryError {
    let (found, expected) = match cause.kind() {
        std::io::ErrorKind::UnexpectedEof => ("the end of the file", "the rest of the element"),
        std::io::ErrorKind::InvalidData => {
            ("vertex indices that are not whole numbers", "a list of integers")
        }
        _ => ("a list of negative or impossible length", "a length of 0 or more"),
    };
    error(FORMAT, spot.to_string(), found.into(), expected)
}

/// The fewest bytes that one element can have: lists may be empty.
fn least_size(element: &ElementDef) -> usize {
    let size = |scalar: &ScalarType| match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    };
    element
        .properties
        .values()
        .map(|property| match &property.data_type {
            PropertyType::Scalar(scalar) | PropertyType::List(scalar, _) => size(scalar),
        })
        .sum()
}

impl PropertyAccess for Record {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let value = match property {
            Property::Char(v) => f64::from(v),
            Property::UChar(v) => f64::from(v),
            Property::Short(v) => f64::from(v),
            Property::UShort(v) => f64::from(v),
            Property::Int(v) => f64::from(v),
            Property::UInt(v) => f64::from(v),
            Property::Float(v) => f64::from(v),
            Property::Double(v) => v,
            list if is_corners(name) => {
                self.corners = match list {
                    Property::ListChar(v) => v.into_iter().map(i64::from).collect(),
                    Property::ListUChar(v) => v.into_iter().map(i64::from).collect(),
                    Property::ListShort(v) => v.into_iter().map(i64::from).collect(),
                    Property::ListUShort(v) => v.into_iter().map(i64::from).collect(),
                    Property::ListInt(v) => v.into_iter().map(i64::from).collect(),
                    Property::ListUInt(v) => v.into_iter().map(i64::from).collect(),
                    _ => return PropertyAccessResult::UnsupportedType,
                };
                return PropertyAccessResult::Set;
            }
            _ => return PropertyAccessResult::Ignored,
        };
        match self.coordinate(name) {
            Some(slot) => {
                *slot = value;
                PropertyAccessResult::Set
            }
            None => PropertyAccessResult::Ignored,
        }
    }
}
