//! OFF: a keyword, three counts, a line per vertex, a line per face.
//!
//! ```text
//! OFF                    or no keyword, or one glued to the counts: OFF3 1 0
//! 3 1 0                  vertices, faces, edges (the last one is passed over and may be missing)
//! 0 0 0                  then colours or normals, which are passed over
//! 1 0 0
//! 0 1 0
//! 3 0 1 2                corners, then perhaps a colour
//! ```

use super::polygon::Faces;
use super::text::{Place, decode, records, truncated};
use crate::{GeometryError, TriMesh};

const FORMAT: &str = "OFF";
const KEYWORD: &str = "the keyword OFF (or COFF, NOFF, STOFF) or three counts";
const COUNTS: &str = "the counts of vertices, faces and edges";

pub(super) fn read(bytes: &[u8]) -> Result<TriMesh, GeometryError> {
    let text = decode(bytes);
    let mut records = records(&text);
    let end = |what: String, expected: String| truncated(FORMAT, what, expected);

    let (line, first) = records
        .next()
        .ok_or_else(|| end("nothing".into(), KEYWORD.into()))?;
    let mut place = Place { format: FORMAT, line };
    let mut counts = after_keyword(place, first)?;
    if counts.is_empty() {
        (place.line, counts) = records
            .next()
            .ok_or_else(|| end("no counts".into(), COUNTS.into()))?;
    }
    let mut words = counts.split_whitespace();
    let n_vertices = place.count(place.word(words.next(), COUNTS)?, "the number of vertices")?;
    let n_faces = place.count(place.word(words.next(), COUNTS)?, "the number of faces")?;

    // Counts are claims: what is set aside never exceeds what the bytes could hold.
    let mut vertices = Vec::with_capacity(n_vertices.min(bytes.len() / 6));
    while vertices.len() < n_vertices {
        let Some((line, record)) = records.next() else {
            return Err(end(
                format!("{} vertices", vertices.len()),
                format!("{n_vertices}, as declared"),
            ));
        };
        vertices.push(Place { format: FORMAT, line }.point(&mut record.split_whitespace())?);
    }

    let mut faces = Faces::with_capacity(n_faces.min(bytes.len() / 8));
    let mut polygon = Vec::new();
    for face in 0..n_faces {
        let Some((line, record)) = records.next() else {
            return Err(end(format!("{face} faces"), format!("{n_faces}, as declared")));
        };
        let place = Place { format: FORMAT, line };
        let mut words = record.split_whitespace();
        let n_corners = place.count(place.word(words.next(), "a face")?, "a number of corners")?;
        polygon.clear();
        for corner in 0..n_corners {
            let expected = || format!("{n_corners} vertex indices, not {corner}");
            let word = words.next().ok_or_else(|| place.error(record, expected()))?;
            polygon.push(place.index(word, n_vertices)?);
        }
        faces.push(&polygon);
    }
    faces.into_mesh(vertices)
}

/// What follows the keyword on its line; everything where there is none.
fn after_keyword(place: Place, record: &str) -> Result<&str, GeometryError> {
    if record.starts_with(|c: char| c.is_ascii_digit()) {
        return match record.strip_prefix("4OFF").or(record.strip_prefix("4nOFF")) {
            Some(_) => Err(place.error(record, "three coordinates per vertex, not four")),
            None => Ok(record),
        };
    }
    let prefixes = ["", "ST", "C", "N", "STC", "STN", "CN", "STCN", "NC"];
    let rest = prefixes
        .iter()
        .find_map(|prefix| record.strip_prefix(prefix)?.strip_prefix("OFF"))
        .ok_or_else(|| place.error(record, KEYWORD))?
        .trim_start();
    match rest.split_whitespace().next() {
        Some(word) if word.eq_ignore_ascii_case("BINARY") => {
            Err(place.error(record, "the ASCII variant of OFF"))
        }
        Some(word) if !word.starts_with(|c: char| c.is_ascii_digit()) => Err(place.error(record, KEYWORD)),
        _ => Ok(rest),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BODY: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";

    fn message(text: &str) -> String {
        read(text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn the_keyword_may_be_glued_to_the_counts_or_missing() {
        for head in [
            "OFF\n4 1 0\n",
            "OFF4 1 4\n",
            "OFF 4 1\n",
            "4 1 0\n",
            "# made by hand\nOFF # yes\n\n4 1 0\n",
        ] {
            let mesh = read((head.to_owned() + BODY).as_bytes()).unwrap();
            assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 2, 3]], "{head}");
        }
    }

    #[test]
    fn colours_and_normals_are_passed_over() {
        let text =
            "COFF\n3 1 0\n0 0 0 255 0 0 255\n1 0 0 255 0 0 255\n0 1 0 255 0 0 255\n3 0 1 2 0.5 0.5 0.5\n";
        assert_eq!(read(text.as_bytes()).unwrap().n_triangles(), 1);
        assert_eq!(
            read(text.replace("COFF", "NOFF").as_bytes()).unwrap().vertices()[1].x,
            1.0
        );
    }

    #[test]
    fn a_concave_polygon_is_cut_inside() {
        let text = "OFF 5 1 0\n0 0 0\n4 0 0\n4 4 0\n2 1 0\n0 4 0\n5 0 1 2 3 4\n";
        let mesh = read(text.as_bytes()).unwrap();
        assert!((crate::surface_area(&mesh) - 10.0).abs() < 1e-12);
    }

    #[test]
    fn messages_name_line_found_and_expected() {
        assert_eq!(
            message(""),
            format!("OFF, end of file: found nothing, expected {KEYWORD}")
        );
        assert_eq!(
            message("ply\n"),
            format!("OFF, line 1: found `ply`, expected {KEYWORD}")
        );
        assert_eq!(
            message("OFF\n4 x 0\n"),
            "OFF, line 2: found `x`, expected the number of faces"
        );
        assert_eq!(
            message("OFF\n3 1 0\n0 0 0\n"),
            "OFF, end of file: found 1 vertices, expected 3, as declared"
        );
        assert_eq!(
            message("OFF\n1 1 0\n0 nan 0\n"),
            "OFF, line 3: found `nan`, expected a finite number"
        );
        assert_eq!(
            message(&format!("OFF\n4 1 0\n{BODY}").replace("4 0 1 2 3", "5 0 1 2 3")),
            "OFF, line 7: found `5 0 1 2 3`, expected 5 vertex indices, not 4"
        );
        assert_eq!(
            message("OFF BINARY\n"),
            "OFF, line 1: found `OFF BINARY`, expected the ASCII variant of OFF"
        );
    }

    #[test]
    fn a_huge_declared_count_costs_nothing() {
        assert_eq!(
            message("OFF\n18446744073709551615 1 0\n0 0 0\n"),
            "OFF, end of file: found 1 vertices, expected 18446744073709551615, as declared"
        );
    }
}
