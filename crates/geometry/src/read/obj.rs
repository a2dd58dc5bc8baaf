//! Wavefront OBJ: `v` and `f` lines; all others (materials, groups, normals, curves) are passed over.
//!
//! The crate `tobj` was tried first; `docs/decisions/mesh-readers.md` lists the legal files that it refuses.

use nalgebra::Point3;

use super::polygon::Faces;
use super::text::{Place, decode, lines};
use crate::{GeometryError, TriMesh};

const FORMAT: &str = "OBJ";

pub(super) fn read(bytes: &[u8]) -> Result<TriMesh, GeometryError> {
    let text = decode(bytes);
    let mut content = Content::default();
    let mut joined = String::new();
    let mut first_line = None;
    for (line, record) in lines(&text) {
        // A backslash at its end continues a line on the next one.
        if let Some(start) = record.trim_end().strip_suffix('\\') {
            joined.push_str(start);
            joined.push(' ');
            first_line.get_or_insert(line);
            continue;
        }
        let place = Place {
            format: FORMAT,
            line: first_line.take().unwrap_or(line),
        };
        if joined.is_empty() {
            content.add(place, record)?;
        } else {
            joined.push_str(record);
            content.add(place, &joined)?;
            joined.clear();
        }
    }
    if let Some(line) = first_line {
        content.add(Place { format: FORMAT, line }, &joined)?;
    }
    content.finish()
}

#[derive(Default)]
struct Content {
    vertices: Vec<Point3<f64>>,
    faces: Faces,
    polygon: Vec<u32>,
    /// The largest index and its line: a face may name vertices that come later, so this is judged at the end.
    largest: Option<(u32, usize)>,
}

impl Content {
    fn add(&mut self, place: Place, record: &str) -> Result<(), GeometryError> {
        let mut words = record.split('#').next().unwrap_or("").split_whitespace();
        match words.next() {
            // A fourth number is a weight for curves, six are a point and its colour.
            Some("v") => self.vertices.push(place.point(&mut words)?),
            Some("f" | "fo") => {
                self.polygon.clear();
                for word in words {
                    let index = self.index(place, word)?;
                    self.polygon.push(index);
                    if self.largest.is_none_or(|(largest, _)| index > largest) {
                        self.largest = Some((index, place.line));
                    }
                }
                if self.polygon.is_empty() {
                    return Err(place.error(record.trim(), "a face's vertices, for example `f 1 2 3`"));
                }
                self.faces.push(&self.polygon);
            }
            _ => {}
        }
        Ok(())
    }

    /// The vertex of a corner such as `3`, `3/1`, `3//2`, `3/1/2` or `-1`, from 0.
    fn index(&self, place: Place, word: &str) -> Result<u32, GeometryError> {
        let number = word.split('/').next().unwrap_or("");
        let n_vertices = self.vertices.len();
        let index = match number.parse::<i64>() {
            Ok(i) if i > 0 => u32::try_from(i - 1).ok(),
            Ok(i) if i < 0 => (n_vertices as i64)
                .checked_add(i)
                .and_then(|i| u32::try_from(i).ok()),
            _ => None,
        };
        index.ok_or_else(|| {
            let expected = "a vertex number from 1, or a negative one that counts back from the last of";
            place.error(word, format!("{expected} {n_vertices} vertices"))
        })
    }

    fn finish(self) -> Result<TriMesh, GeometryError> {
        match self.largest {
            Some((index, line)) if index as usize >= self.vertices.len() => {
                Err(Place { format: FORMAT, line }.error(
                    &(u64::from(index) + 1).to_string(),
                    format!("a vertex number up to {}", self.vertices.len()),
                ))
            }
            _ => self.faces.into_mesh(self.vertices),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VERTICES: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    fn triangles(faces: &str) -> Vec<[u32; 3]> {
        read((VERTICES.to_owned() + faces).as_bytes())
            .unwrap()
            .triangles()
            .to_vec()
    }

    fn message(text: &str) -> String {
        read((VERTICES.to_owned() + text).as_bytes())
            .unwrap_err()
            .to_string()
    }

    #[test]
    fn corners_come_in_all_spellings() {
        for faces in [
            "f 1 2 3\n",
            "f 1/9 2/9 3/9",
            "f 1//7 2//7 3//7\n",
            "f 1/9/7 2/9/7 3/9/7\r\n",
            "f -4 -3 -2\n",
        ] {
            assert_eq!(triangles(faces), [[0, 1, 2]], "{faces}");
        }
    }

    #[test]
    fn polygons_become_fans() {
        assert_eq!(triangles("f 1 2 3 4"), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(
            triangles("v 0 0 1\nf 1 2 3 4 5"),
            [[0, 1, 2], [0, 2, 3], [0, 3, 4]]
        );
    }

    #[test]
    fn a_concave_polygon_is_cut_inside() {
        let dart = b"v 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\nf 2 3 4 1\nf -3 -2 -1 -4\n";
        let mesh = read(dart).unwrap();
        assert!((crate::surface_area(&mesh) - 2.0 * 4.0).abs() < 1e-12);
    }

    #[test]
    fn groups_materials_and_other_lines_do_not_matter() {
        let faces = "mtllib no such file.mtl\no cup\ng body\nusemtl\ns 1\nvn 0 0 1\nvt 0.5\nf 1 2 3\ng rim\nf 1 3 4\nl 1 2\np 1\n";
        assert_eq!(triangles(faces), [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn lines_go_on_after_a_backslash() {
        assert_eq!(triangles("f 1 2 \\\n 3 \\\r\n4\n"), [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn names_in_other_encodings_colours_and_weights_do_not_matter() {
        let text = b"# caf\xe9\nv 0 0 0 1\nv 1 0 0 0.5 0.5 0.5\nv 0 1 0\ng bo\xeete\nf 1 2 3\n";
        assert_eq!(read(text).unwrap().vertices()[1], Point3::new(1.0, 0.0, 0.0));
    }

    #[test]
    fn a_face_may_come_before_its_vertices() {
        assert_eq!(
            read(b"f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n")
                .unwrap()
                .n_triangles(),
            1
        );
    }

    #[test]
    fn messages_name_line_found_and_expected() {
        assert_eq!(
            message("v 1 2\n"),
            "OBJ, line 5: found the end of the line, expected three coordinates"
        );
        assert_eq!(
            message("v 1 inf 2\n"),
            "OBJ, line 5: found `inf`, expected a finite number"
        );
        assert_eq!(
            message("\nf 1 2 9\n"),
            "OBJ, line 6: found `9`, expected a vertex number up to 4"
        );
        let expected =
            "expected a vertex number from 1, or a negative one that counts back from the last of 4 vertices";
        assert_eq!(
            message("f 0 1 2\n"),
            format!("OBJ, line 5: found `0`, {expected}")
        );
        assert_eq!(
            message("f -5 1 2\n"),
            format!("OBJ, line 5: found `-5`, {expected}")
        );
        assert_eq!(
            message("f\n"),
            "OBJ, line 5: found `f`, expected a face's vertices, for example `f 1 2 3`"
        );
        assert_eq!(
            message(""),
            "the shape has no triangles; check that the file is complete"
        );
    }
}
