//! PCD clouds: a head that names fields, then rows as text or bytes.
//!
//! ```text
//! FIELDS x y z rgb       SIZE 4 4 4 4       TYPE F F F U       COUNT 1 1 1 1
//! WIDTH 640   HEIGHT 480   POINTS 307200   DATA ascii | binary | binary_compressed
//! ```
//!
//! Compressed bytes hold field after field in place of row after row, packed by LZF (`lzf.rs`).
//!
//! The format marks missing points with NaN in all three coordinates; those are left out. Any other coordinate that is
//! not finite is an error. The viewpoint is passed over.

use nalgebra::Point3;

use super::text::{Place, decode, error, lines, quoted, truncated};
use super::{cloud, lzf};
use crate::GeometryError;

const FORMAT: &str = "PCD";
const DATA: &str = "DATA ascii, binary or binary_compressed";

pub(super) fn read(bytes: &[u8]) -> Result<Vec<Point3<f64>>, GeometryError> {
    let head = Head::read(bytes)?;
    match head.data {
        Data::Ascii => read_ascii(&head, bytes),
        Data::Binary => read_binary(&head, &bytes[head.body..]),
        Data::Compressed => read_binary(&head, &unpacked(&head, &bytes[head.body..])?),
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Data {
    Ascii,
    Binary,
    Compressed,
}

/// One of x, y, z: where it stands in a row, and how it is written.
#[derive(Clone, Copy, Default)]
struct Coordinate {
    column: usize,
    offset: usize,
    size: usize,
    /// Bytes of the whole field, of which the coordinate is the first number.
    width: usize,
    kind: char,
}

struct Head {
    coordinates: [Coordinate; 3],
    n_points: usize,
    row_size: usize,
    data: Data,
    /// Where the rows start, and on which line.
    body: usize,
    line: usize,
}

impl Head {
    fn read(bytes: &[u8]) -> Result<Self, GeometryError> {
        let (mut fields, mut sizes, mut kinds, mut counts) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let (mut width, mut height, mut points) = (None, 1, None);
        let mut body = 0;
        for (index, raw) in bytes.split_inclusive(|&b| b == b'\n').enumerate() {
            let place = Place {
                format: FORMAT,
                line: index + 1,
            };
            body += raw.len();
            let record = decode(raw);
            let record = record.trim();
            let mut words = record.split_whitespace();
            let whole = |word: &str| place.count(word, "a whole number");
            match words.next().map(str::to_ascii_uppercase).as_deref() {
                Some("FIELDS" | "COLUMNS") => fields = words.map(str::to_owned).collect(),
                Some("SIZE") => sizes = words.map(whole).collect::<Result<_, _>>()?,
                Some("TYPE") => kinds = words.filter_map(|word| word.chars().next()).collect(),
                Some("COUNT") => counts = words.map(whole).collect::<Result<_, _>>()?,
                Some("WIDTH") => width = Some(whole(place.word(words.next(), "a width")?)?),
                Some("HEIGHT") => height = whole(place.word(words.next(), "a height")?)?,
                Some("POINTS") => points = Some(whole(place.word(words.next(), "a number of points")?)?),
                Some("DATA") => {
                    let data = match words.next().map(str::to_ascii_lowercase).as_deref() {
                        Some("ascii") => Data::Ascii,
                        Some("binary") => Data::Binary,
                        Some("binary_compressed") => Data::Compressed,
                        _ => return Err(place.error(record, DATA)),
                    };
                    let n_points = points
                        .or_else(|| width?.checked_mul(height))
                        .ok_or_else(|| place.error(record, "POINTS, or WIDTH and HEIGHT, before"))?;
                    let (coordinates, row_size) = layout(place, &fields, &sizes, &kinds, &counts)?;
                    return Ok(Self {
                        coordinates,
                        n_points,
                        row_size,
                        data,
                        body,
                        line: place.line,
                    });
                }
                None | Some("VERSION" | "VIEWPOINT") => {}
                Some(word) if word.starts_with('#') => {}
                Some(_) => return Err(place.error(record, "a line of a PCD head, such as FIELDS x y z")),
            }
        }
        Err(truncated(FORMAT, "no line DATA".into(), DATA))
    }
}

/// Where x, y and z stand in a row, and how many bytes a row has.
fn layout(
    place: Place,
    fields: &[String],
    sizes: &[usize],
    kinds: &[char],
    counts: &[usize],
) -> Result<([Coordinate; 3], usize), GeometryError> {
    let mut coordinates = [None; 3];
    let (mut offset, mut column) = (0_usize, 0_usize);
    for (field, name) in fields.iter().enumerate() {
        let size = sizes.get(field).copied().unwrap_or(4);
        let kind = kinds.get(field).copied().unwrap_or('F').to_ascii_uppercase();
        let count = counts.get(field).copied().unwrap_or(1);
        let total = size.checked_mul(count);
        if let Some(axis) = ["x", "y", "z"].iter().position(|axis| name == axis) {
            if count == 0 {
                return Err(place.error(
                    &format!("{name}, counted 0 times"),
                    "x, y and z, each counted once",
                ));
            }
            coordinates[axis] = Some(Coordinate {
                column,
                offset,
                size,
                width: total.unwrap_or(0),
                kind,
            });
        }
        let end = total.and_then(|total| offset.checked_add(total));
        (offset, column) = end.zip(column.checked_add(count)).ok_or_else(|| {
            place.error(
                &format!("{name}: {count} × {size} bytes"),
                "a field of sensible size",
            )
        })?;
    }
    let [Some(x), Some(y), Some(z)] = coordinates else {
        let found = error(
            FORMAT,
            "head".into(),
            format!("the fields {}", quoted(&fields.join(" "))),
            "x, y and z",
        );
        return Err(found);
    };
    Ok(([x, y, z], offset))
}

fn read_ascii(head: &Head, bytes: &[u8]) -> Result<Vec<Point3<f64>>, GeometryError> {
    let text = decode(&bytes[head.body..]);
    let rows = lines(&text).filter(|(_, row)| !row.trim().is_empty());
    let mut points = Vec::with_capacity(head.n_points.min(bytes.len() / 6));
    let mut n_rows = 0;
    for (line, row) in rows.take(head.n_points) {
        let place = Place {
            format: FORMAT,
            line: head.line + line,
        };
        let mut point = Point3::origin();
        for (axis, coordinate) in head.coordinates.iter().enumerate() {
            let word = row.split_whitespace().nth(coordinate.column);
            let word = place.word(word, "a column for each field")?;
            point[axis] = word.parse().map_err(|_| place.error(word, "a number"))?;
        }
        keep(&mut points, point, || format!("line {}", place.line))?;
        n_rows += 1;
    }
    if n_rows < head.n_points {
        return Err(truncated(
            FORMAT,
            format!("{n_rows} points"),
            format!("{}, as declared", head.n_points),
        ));
    }
    cloud(points)
}

/// The body of a compressed file: its packed and its true length (u32 each), then that many packed bytes.
fn unpacked(head: &Head, body: &[u8]) -> Result<Vec<u8>, GeometryError> {
    let lengths = body.get(..8).map(|raw| {
        let length =
            |at: usize| u32::from_le_bytes([raw[at], raw[at + 1], raw[at + 2], raw[at + 3]]) as usize;
        (length(0), length(4))
    });
    let Some((packed, length)) = lengths else {
        return Err(truncated(
            FORMAT,
            format!("{} bytes", body.len()),
            "two lengths, then packed bytes",
        ));
    };
    let Some(bytes) = body[8..].get(..packed) else {
        let found = format!("{} packed bytes", body.len() - 8);
        return Err(truncated(
            FORMAT,
            found,
            format!("{packed}, as declared at byte {}", head.body),
        ));
    };
    lzf::unpack(bytes, length).ok_or_else(|| {
        let place = format!("byte {}", head.body + 8);
        error(
            FORMAT,
            place,
            "bytes that do not unpack".into(),
            format!("LZF of {length} bytes"),
        )
    })
}

/// Points from the bytes of the body, unpacked where they were packed.
fn read_binary(head: &Head, body: &[u8]) -> Result<Vec<Point3<f64>>, GeometryError> {
    let available = body.len().checked_div(head.row_size).unwrap_or(0);
    if available < head.n_points {
        return Err(truncated(
            FORMAT,
            format!("{available} whole points"),
            format!("{}, as declared", head.n_points),
        ));
    }
    let mut points = Vec::with_capacity(head.n_points);
    for index in 0..head.n_points {
        let mut point = Point3::origin();
        for (axis, coordinate) in head.coordinates.iter().enumerate() {
            let start = match head.data {
                Data::Compressed => head.n_points * coordinate.offset + index * coordinate.width,
                _ => index * head.row_size + coordinate.offset,
            };
            let raw = &body[start..start + coordinate.size];
            point[axis] = decode_number(coordinate.kind, raw).ok_or_else(|| {
                let found = format!("type {} of {} bytes", coordinate.kind, coordinate.size);
                error(
                    FORMAT,
                    "head".into(),
                    found,
                    "x, y and z of type F (4 or 8 bytes), I or U (1, 2, 4 or 8 bytes)",
                )
            })?;
        }
        keep(&mut points, point, || match head.data {
            Data::Compressed => format!("point {index}"),
            _ => format!("point {index} (byte {})", head.body + index * head.row_size),
        })?;
    }
    cloud(points)
}

/// A little-endian number.
fn decode_number(kind: char, raw: &[u8]) -> Option<f64> {
    Some(match (kind, raw.len()) {
        ('F', 4) => f64::from(f32::from_le_bytes(raw.try_into().ok()?)),
        ('F', 8) => f64::from_le_bytes(raw.try_into().ok()?),
        ('I', 1) => f64::from(i8::from_le_bytes(raw.try_into().ok()?)),
        ('I', 2) => f64::from(i16::from_le_bytes(raw.try_into().ok()?)),
        ('I', 4) => f64::from(i32::from_le_bytes(raw.try_into().ok()?)),
        ('I', 8) => i64::from_le_bytes(raw.try_into().ok()?) as f64,
        ('U', 1) => f64::from(raw[0]),
        ('U', 2) => f64::from(u16::from_le_bytes(raw.try_into().ok()?)),
        ('U', 4) => f64::from(u32::from_le_bytes(raw.try_into().ok()?)),
        ('U', 8) => u64::from_le_bytes(raw.try_into().ok()?) as f64,
        _ => return None,
    })
}

/// Adds a point, unless it is marked as missing.
fn keep(
    points: &mut Vec<Point3<f64>>,
    point: Point3<f64>,
    place: impl Fn() -> String,
) -> Result<(), GeometryError> {
    if point.iter().all(|c| c.is_nan()) {
        return Ok(());
    }
    if let Some(value) = point.iter().find(|c| !c.is_finite()) {
        return Err(error(
            FORMAT,
            place(),
            format!("the coordinate {value}"),
            "a finite number",
        ));
    }
    points.push(point);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "# .PCD v0.7\nVERSION 0.7\nFIELDS rgb x y z\nSIZE 4 4 8 2\nTYPE U F F I\nCOUNT 2 1 1 1\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\n";

    fn message(bytes: &[u8]) -> String {
        read(bytes).unwrap_err().to_string()
    }

    fn binary() -> Vec<u8> {
        let mut bytes = format!("{HEAD}DATA binary\n").into_bytes();
        for [x, y, z] in [[0.5, 1.5, -2.0], [1.0, 2.0, 3.0]] {
            bytes.extend([7; 8]);
            bytes.extend((x as f32).to_le_bytes());
            bytes.extend(f64::to_le_bytes(y));
            bytes.extend((z as i16).to_le_bytes());
        }
        bytes
    }

    #[test]
    fn text_and_bytes_hold_the_same_points() {
        let expected = [Point3::new(0.5, 1.5, -2.0), Point3::new(1.0, 2.0, 3.0)];
        let ascii = format!("{HEAD}DATA ascii\n7 7 0.5 1.5 -2\n7 7 1 2 3\n");
        assert_eq!(read(ascii.as_bytes()).unwrap(), expected);
        assert_eq!(read(&binary()).unwrap(), expected);
    }

    /// The same two points, field after field, as LZF without a repetition: runs of at most 32 bytes.
    fn compressed() -> Vec<u8> {
        let (plain, head) = (binary(), format!("{HEAD}DATA binary\n").len());
        let (rows, _) = plain[head..].as_chunks::<22>();
        let columns: Vec<u8> = [0..8, 8..12, 12..20, 20..22]
            .into_iter()
            .flat_map(|field| rows.iter().flat_map(move |row| row[field.clone()].to_vec()))
            .collect();
        let packed: Vec<u8> = columns
            .chunks(32)
            .flat_map(|run| [&[run.len() as u8 - 1], run].concat())
            .collect();
        let lengths = [packed.len() as u32, columns.len() as u32]
            .map(u32::to_le_bytes)
            .concat();
        [
            format!("{HEAD}DATA binary_compressed\n").as_bytes(),
            &lengths,
            &packed,
        ]
        .concat()
    }

    #[test]
    fn packed_bytes_hold_the_same_points() {
        assert_eq!(read(&compressed()).unwrap(), read(&binary()).unwrap());
        let bytes = compressed();
        let start = format!("{HEAD}DATA binary_compressed\n").len();
        assert_eq!(
            message(&bytes[..bytes.len() - 1]),
            format!("PCD, end of file: found 45 packed bytes, expected 46, as declared at byte {start}")
        );
        assert_eq!(
            message(&bytes[..start + 4]),
            "PCD, end of file: found 4 bytes, expected two lengths, then packed bytes"
        );
        let mut wrong = bytes.clone();
        wrong[start + 4] = 45;
        assert_eq!(
            message(&wrong),
            format!(
                "PCD, byte {}: found bytes that do not unpack, expected LZF of 45 bytes",
                start + 8
            )
        );
        let many = String::from_utf8_lossy(&bytes[..start]).replace("POINTS 2", "POINTS 3");
        assert_eq!(
            message(&[many.as_bytes(), &bytes[start..]].concat()),
            "PCD, end of file: found 2 whole points, expected 3, as declared"
        );
    }

    #[test]
    fn missing_points_are_left_out() {
        let ascii = format!("{HEAD}DATA ascii\n7 7 nan nan nan\n7 7 1 2 3\n");
        assert_eq!(read(ascii.as_bytes()).unwrap().len(), 1);
        let half = format!("{HEAD}DATA ascii\n7 7 nan 1 1\n7 7 1 2 3\n");
        assert_eq!(
            message(half.as_bytes()),
            "PCD, line 12: found the coordinate NaN, expected a finite number"
        );
    }

    #[test]
    fn messages_name_place_found_and_expected() {
        let short = &binary()[..binary().len() - 1];
        assert_eq!(
            message(short),
            "PCD, end of file: found 1 whole points, expected 2, as declared"
        );
        let fields = HEAD.replace("rgb x y z", "rgb x y w") + "DATA ascii\n";
        assert_eq!(
            message(fields.as_bytes()),
            "PCD, head: found the fields `rgb x y w`, expected x, y and z"
        );
        assert_eq!(
            message(format!("{HEAD}DATA zipped\n").as_bytes()),
            "PCD, line 11: found `DATA zipped`, expected DATA ascii, binary or binary_compressed"
        );
        let none = HEAD.replace("COUNT 2 1 1 1", "COUNT 2 1 0 1") + "DATA binary\n";
        assert_eq!(
            message(none.as_bytes()),
            "PCD, line 11: found `y, counted 0 times`, expected x, y and z, each counted once"
        );
        assert_eq!(
            message(b"FIELDS x y z\n"),
            "PCD, end of file: found no line DATA, expected DATA ascii, binary or binary_compressed"
        );
    }

    #[test]
    fn a_huge_declared_count_costs_nothing() {
        let bytes = HEAD.replace("POINTS 2", "POINTS 99999999999999") + "DATA binary\n";
        assert_eq!(
            message(bytes.as_bytes()),
            "PCD, end of file: found 0 whole points, expected 99999999999999, as declared"
        );
    }
}
