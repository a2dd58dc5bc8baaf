//! Numbers out of the buffers of a glTF file.

use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use nalgebra::Point3;

use super::FORMAT;
use super::document::{Accessor, Document};
use crate::GeometryError;
use crate::read::Resolve;
use crate::read::text::{error, quoted};

/// Base64 with or without its padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The bytes of all buffers.
pub(super) struct Buffers {
    bytes: Vec<Vec<u8>>,
    total: usize,
}

impl Buffers {
    /// Buffers from data URIs, the binary chunk of a GLB file, or further files.
    pub fn load(document: &Document, chunk: Option<&[u8]>, resolve: &Resolve) -> Result<Self, GeometryError> {
        let mut bytes = Vec::with_capacity(document.buffers.len());
        for (nth, buffer) in document.buffers.iter().enumerate() {
            let place = || format!("buffers[{nth}]");
            let data = match (&buffer.uri, chunk) {
                (None, Some(chunk)) if nth == 0 => chunk.to_vec(),
                (None, _) => {
                    return Err(error(
                        FORMAT,
                        place(),
                        "no uri".into(),
                        "a uri, or a GLB file's binary chunk",
                    ));
                }
                (Some(uri), _) => match uri.strip_prefix("data:") {
                    Some(data) => decode_data(data)
                        .ok_or_else(|| error(FORMAT, place(), quoted(uri), "data:…;base64,…"))?,
                    None => resolve(&percent_decoded(uri)).map_err(|reason| {
                        error(
                            FORMAT,
                            place(),
                            format!("{}, which {reason}", quoted(uri)),
                            "a file that can be read",
                        )
                    })?,
                },
            };
            if data.len() < buffer.byte_length {
                let expected = format!("{}, as declared", buffer.byte_length);
                return Err(error(FORMAT, place(), format!("{} bytes", data.len()), expected));
            }
            bytes.push(data);
        }
        let total = bytes.iter().map(Vec::len).sum();
        Ok(Self { bytes, total })
    }

    /// `count` elements of `size` bytes in a view.
    fn elements<'a>(
        &'a self,
        document: &Document,
        view: usize,
        offset: usize,
        [count, size]: [usize; 2],
        place: &dyn Fn() -> String,
    ) -> Result<impl Iterator<Item = &'a [u8]> + use<'a>, GeometryError> {
        let spot = document.view(view)?;
        let stride = spot.byte_stride.unwrap_or(size);
        let missing = || {
            error(
                FORMAT,
                place(),
                format!(
                    "{count} elements of {size} bytes, {stride} apart, at byte {offset} of bufferViews[{view}]"
                ),
                "elements inside the view, and the view inside its buffer",
            )
        };
        let buffer = self.bytes.get(spot.buffer).ok_or_else(missing)?;
        let bytes = buffer
            .get(spot.byte_offset..)
            .and_then(|rest| rest.get(..spot.byte_length))
            .and_then(|bytes| bytes.get(offset..))
            .ok_or_else(missing)?;
        let needed = count
            .checked_sub(1)
            .map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size));
        // A stride below the size would make elements overlap, and a claim of many out of few bytes.
        if stride < size || needed.is_none_or(|needed| needed > bytes.len()) {
            return Err(missing());
        }
        Ok((0..count).map(move |i| &bytes[i * stride..i * stride + size]))
    }
}

fn decode_data(data: &str) -> Option<Vec<u8>> {
    let (kind, text) = data.split_once(',')?;
    kind.ends_with(";base64")
        .then(|| BASE64.decode(text.trim()).ok())?
}

/// `%20` and the like as the bytes that they stand for.
fn percent_decoded(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        let code = (byte == b'%')
            .then(|| after.get(..2))
            .flatten()
            .and_then(|hex| u8::from_str_radix(std::str::from_utf8(hex).ok()?, 16).ok());
        bytes.push(code.unwrap_or(byte));
        rest = if code.is_some() { &after[2..] } else { after };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// The positions of an accessor.
pub(super) fn read_points(
    document: &Document,
    buffers: &Buffers,
    index: usize,
) -> Result<Vec<Point3<f64>>, GeometryError> {
    let accessor = document.accessor(index)?;
    let place = || format!("accessors[{index}]");
    let component = Component::of(accessor.component_type)
        .filter(|_| accessor.kind == "VEC3")
        .ok_or_else(|| unfit(accessor, &place, "positions as VEC3 of numbers"))?;
    let decode = |raw: &[u8]| {
        let (numbers, _) = raw.split_at(component.size * 3);
        let mut numbers = numbers
            .chunks_exact(component.size)
            .map(|raw| component.number(raw, accessor.normalized));
        Point3::from([0, 1, 2].map(|_| numbers.next().unwrap_or(0.0)))
    };
    let mut points: Vec<Point3<f64>> = elements(document, buffers, accessor, component, 3, &place)?
        .map_or_else(
            || vec![Point3::origin(); accessor.count],
            |all| all.map(decode).collect(),
        );
    if let Some(sparse) = &accessor.sparse {
        let at = Component::of(sparse.indices.component_type)
            .filter(|c| !c.signed && !c.float)
            .ok_or_else(|| unfit(accessor, &place, "sparse indices as unsigned numbers"))?;
        let (from, to) = (&sparse.indices, &sparse.values);
        let size = component.size * 3;
        let which = buffers.elements(
            document,
            from.buffer_view,
            from.byte_offset,
            [sparse.count, at.size],
            &place,
        )?;
        let values = buffers.elements(
            document,
            to.buffer_view,
            to.byte_offset,
            [sparse.count, size],
            &place,
        )?;
        for (raw, value) in which.zip(values) {
            let index = at.number(raw, false) as usize;
            let n_points = points.len();
            *points.get_mut(index).ok_or_else(|| {
                let expected = format!("an element below {n_points}");
                error(FORMAT, place(), format!("the sparse index {index}"), expected)
            })? = decode(value);
        }
    }
    if let Some((vertex, point)) = points
        .iter()
        .enumerate()
        .find(|(_, p)| !p.iter().all(|c| c.is_finite()))
    {
        let found = format!("the position {:?} at {vertex}", point.coords.as_slice());
        return Err(error(FORMAT, place(), found, "finite numbers"));
    }
    Ok(points)
}

/// The indices of an accessor.
pub(super) fn read_indices(
    document: &Document,
    buffers: &Buffers,
    index: usize,
) -> Result<Vec<u32>, GeometryError> {
    let accessor = document.accessor(index)?;
    let place = || format!("accessors[{index}]");
    let component = Component::of(accessor.component_type)
        .filter(|c| accessor.kind == "SCALAR" && !c.signed && !c.float && accessor.sparse.is_none())
        .ok_or_else(|| unfit(accessor, &place, "indices as SCALAR of unsigned numbers"))?;
    let all = elements(document, buffers, accessor, component, 1, &place)?;
    Ok(all.map_or_else(
        || vec![0; accessor.count],
        |all| all.map(|raw| component.number(raw, false) as u32).collect(),
    ))
}

/// The elements of an accessor; `None` where it has no view: then all are zero.
fn elements<'a>(
    document: &Document,
    buffers: &'a Buffers,
    accessor: &Accessor,
    component: Component,
    width: usize,
    place: &dyn Fn() -> String,
) -> Result<Option<impl Iterator<Item = &'a [u8]> + use<'a>>, GeometryError> {
    let Some(view) = accessor.buffer_view else {
        // Zeros take no bytes in the file; a claim of more of them than the file has bytes is no mesh.
        if accessor.count > buffers.total {
            return Err(unfit(accessor, place, "a bufferView"));
        }
        return Ok(None);
    };
    let shape = [accessor.count, component.size * width];
    buffers
        .elements(document, view, accessor.byte_offset, shape, place)
        .map(Some)
}

fn unfit(accessor: &Accessor, place: &dyn Fn() -> String, expected: &str) -> GeometryError {
    let found = format!(
        "{} elements {} of component type {}",
        accessor.count,
        quoted(&accessor.kind),
        accessor.component_type
    );
    error(FORMAT, place(), found, expected)
}

/// How one number is written.
#[derive(Clone, Copy)]
struct Component {
    size: usize,
    signed: bool,
    float: bool,
}

impl Component {
    fn of(code: u32) -> Option<Self> {
        let (size, signed, float) = match code {
            5120 => (1, true, false),
            5121 => (1, false, false),
            5122 => (2, true, false),
            5123 => (2, false, false),
            5125 => (4, false, false),
            5126 => (4, true, true),
            _ => return None,
        };
        Some(Self { size, signed, float })
    }

    /// A little-endian number; whole ones that are `normalized` lie in [0, 1] or [−1, 1].
    fn number(self, raw: &[u8], normalized: bool) -> f64 {
        let mut wide = [0; 4];
        wide[..self.size].copy_from_slice(raw);
        let bits = u32::from_le_bytes(wide);
        if self.float {
            return f64::from(f32::from_bits(bits));
        }
        let unused = 32 - 8 * self.size as u32;
        let value = if self.signed {
            f64::from(((bits << unused) as i32) >> unused)
        } else {
            f64::from(bits)
        };
        let largest = f64::from(u32::MAX >> unused >> u32::from(self.signed));
        if normalized {
            (value / largest).max(-1.0)
        } else {
            value
        }
    }
}
