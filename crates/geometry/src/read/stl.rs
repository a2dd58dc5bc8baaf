//! STL, ASCII and binary: triangles with their corners spelled out, so vertices repeat from triangle to triangle.
//!
//! ```text
//! binary   80 bytes of anything, u32 count, then 50 bytes a triangle: normal, three corners (12 × f32), u16
//! ASCII    solid NAME
//!            facet normal 0 0 1
//!              outer loop
//!                vertex 0 0 0   …   vertex 0 1 0
//!              endloop
//!            endfacet
//!          endsolid NAME
//! ```
//!
//! Both kinds may start with `solid`; a length that fits the count at byte 80 settles it. Normals are passed over: the
//! order of the corners says the same. The crate `stl_io` was tried first; `docs/decisions/mesh-readers.md` says why
//! it gave way.

use nalgebra::Point3;

use super::polygon::Faces;
use super::text::{Place, decode, error, lines, truncated};
use crate::{GeometryError, TriMesh};

const FORMAT: &str = "STL";
/// Bytes before the first triangle of a binary file, and of each triangle.
const HEAD: usize = 84;
const TRIANGLE: usize = 50;

pub(super) fn read(bytes: &[u8]) -> Result<TriMesh, GeometryError> {
    if is_ascii(bytes) {
        read_ascii(bytes)
    } else {
        read_binary(bytes)
    }
}

fn is_ascii(bytes: &[u8]) -> bool {
    let start = &bytes[bytes.iter().take_while(|b| b.is_ascii_whitespace()).count()..];
    let says_solid = start.len() >= 5 && start[..5].eq_ignore_ascii_case(b"solid");
    let fits_binary =
        declared(bytes).is_some_and(|n| HEAD as u64 + n * TRIANGLE as u64 == bytes.len() as u64);
    // Text has no zero bytes; the count of a binary file of fewer than 2²⁴ triangles has.
    let has_zero = bytes.iter().take(HEAD).any(|&b| b == 0);
    says_solid && !fits_binary && !has_zero
}

/// The count in a binary file's head.
fn declared(bytes: &[u8]) -> Option<u64> {
    let count = bytes.get(HEAD - 4..HEAD)?;
    Some(u64::from(u32::from_le_bytes(count.try_into().ok()?)))
}

fn read_binary(bytes: &[u8]) -> Result<TriMesh, GeometryError> {
    let n_triangles = declared(bytes).ok_or_else(|| {
        truncated(
            FORMAT,
            format!("{} bytes", bytes.len()),
            "`solid …` or a binary head of 84 bytes",
        )
    })?;
    let (triangles, _) = bytes[HEAD..].as_chunks::<TRIANGLE>();
    if (triangles.len() as u64) < n_triangles {
        let found = format!("{} whole triangles", triangles.len());
        return Err(truncated(
            FORMAT,
            found,
            format!("{n_triangles}, as declared at byte 80"),
        ));
    }
    let triangles = &triangles[..n_triangles as usize];
    let mut vertices = Vec::with_capacity(triangles.len() * 3);
    for (index, triangle) in triangles.iter().enumerate() {
        let (numbers, _) = triangle[12..48].as_chunks::<4>();
        for corner in numbers.chunks_exact(3) {
            let point = Point3::from([0, 1, 2].map(|k| f64::from(f32::from_le_bytes(corner[k]))));
            if let Some(value) = point.iter().find(|c| !c.is_finite()) {
                let place = format!("triangle {index} (byte {})", HEAD + index * TRIANGLE);
                return Err(error(
                    FORMAT,
                    place,
                    format!("the coordinate {value}"),
                    "a finite number",
                ));
            }
            vertices.push(point);
        }
    }
    soup(vertices, n_triangles as usize)
}

fn soup(vertices: Vec<Point3<f64>>, n_triangles: usize) -> Result<TriMesh, GeometryError> {
    TriMesh::new(
        vertices,
        (0..n_triangles as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect(),
    )
}

fn read_ascii(bytes: &[u8]) -> Result<TriMesh, GeometryError> {
    const STATEMENT: &str = "facet, outer loop, vertex, endloop, endfacet or endsolid";
    let text = decode(bytes);
    let mut vertices: Vec<Point3<f64>> = Vec::new();
    let mut faces = Faces::default();
    let mut corners = Vec::new();
    let mut loop_start = None;
    for (line, record) in lines(&text) {
        let place = Place { format: FORMAT, line };
        let mut words = record.split_whitespace();
        while let Some(word) = words.next() {
            let is = |name: &str| word.eq_ignore_ascii_case(name);
            match loop_start {
                Some(_) if is("vertex") => vertices.push(place.point(&mut words)?),
                None if is("endfacet") => {}
                None if is("solid") || is("endsolid") => break, // the rest of the line is a name
                None if is("facet") => {
                    place.word(words.next(), "normal")?;
                    // Normals may be anything, also `nan`, since nothing depends on them.
                    for _ in 0..3 {
                        place.word(words.next(), "the facet's normal")?;
                    }
                }
                None if is("outer") => {
                    place.word(words.next(), "loop")?;
                    loop_start = Some(vertices.len());
                }
                Some(start) if is("endloop") => {
                    if vertices.len() - start < 3 {
                        let found = format!("endloop after {} vertices", vertices.len() - start);
                        return Err(place.error(&found, "three vertices"));
                    }
                    corners.clear();
                    corners.extend(start as u32..vertices.len() as u32);
                    faces.push(&corners);
                    loop_start = None;
                }
                Some(_) => return Err(place.error(word, "vertex or endloop")),
                None => return Err(place.error(word, STATEMENT)),
            }
        }
    }
    if loop_start.is_some() {
        return Err(truncated(
            FORMAT,
            "an open loop".into(),
            "endloop, endfacet and endsolid",
        ));
    }
    faces.into_mesh(vertices)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ASCII: &str = "solid a b\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e0 0\nendloop\nendfacet\nendsolid a b\n";

    fn binary(head: &[u8], corners: &[[f32; 9]]) -> Vec<u8> {
        let mut bytes = head.to_vec();
        bytes.resize(80, b' ');
        bytes.extend((corners.len() as u32).to_le_bytes());
        for triangle in corners {
            bytes.extend([0; 12]);
            bytes.extend(triangle.iter().flat_map(|x| x.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }

    const TRIANGLES: [[f32; 9]; 2] = [
        [0., 0., 0., 1., 0., 0., 0., 1., 0.],
        [0., 0., 0.5, 1., 0., 0., 0., 1., 0.],
    ];

    #[test]
    fn ascii_with_names_capitals_and_several_solids() {
        let twice = format!("{ASCII}{}", ASCII.to_uppercase());
        let mesh = read(twice.as_bytes()).unwrap();
        assert_eq!(mesh.triangles(), [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(mesh.vertices()[2], Point3::new(0.0, 1.0, 0.0));
        let on_one_line = ASCII
            .replace("a b", "")
            .replacen('\n', "\r", 1)
            .replace('\n', " ");
        assert_eq!(read(on_one_line.as_bytes()).unwrap().n_triangles(), 1);
    }

    #[test]
    fn binary_whatever_its_head_says() {
        for head in ["solid but binary", "made elsewhere", ""] {
            let mesh = read(&binary(head.as_bytes(), &TRIANGLES)).unwrap();
            assert_eq!(mesh.n_triangles(), 2, "{head}");
            assert_eq!(mesh.vertices()[3].z, 0.5);
        }
        let mut trailing = binary(b"solid", &TRIANGLES);
        trailing.extend([0; 7]);
        assert_eq!(read(&trailing).unwrap().n_triangles(), 2);
    }

    #[test]
    fn messages_name_place_found_and_expected() {
        let message = |bytes: &[u8]| read(bytes).unwrap_err().to_string();
        let cut = &binary(b"", &TRIANGLES)[..180];
        assert_eq!(
            message(cut),
            "STL, end of file: found 1 whole triangles, expected 2, as declared at byte 80"
        );
        let nan = binary(b"", &[TRIANGLES[0], [f32::NAN; 9]]);
        assert_eq!(
            message(&nan),
            "STL, triangle 1 (byte 134): found the coordinate NaN, expected a finite number"
        );
        assert_eq!(
            message(b"stl"),
            "STL, end of file: found 3 bytes, expected `solid …` or a binary head of 84 bytes"
        );
        let text = ASCII.replace("vertex 1 0 0\n", "");
        assert_eq!(
            message(text.as_bytes()),
            "STL, line 6: found `endloop after 2 vertices`, expected three vertices"
        );
        let text = ASCII.replace("vertex 1 0 0", "vertex 1 0 0,");
        assert_eq!(
            message(text.as_bytes()),
            "STL, line 5: found `0,`, expected a finite number"
        );
        assert_eq!(
            message(b"solid\n"),
            "the shape has no triangles; check that the file is complete"
        );
    }
}
