//! PLY, ASCII and binary of either byte order: vertices, and faces or triangle strips where there are any.
//!
//! The crate `ply-rs-bw` reads the head and binary elements. Text bodies are read here, word by word, since that crate
//! refuses numbers such as `1.` and `.5`.

mod binary_body;
mod content;
mod text_body;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{Encoding, Header, PropertyType};

use self::content::{Content, Record};
use super::Shape;
use super::text::{Place, decode, error, lines, quoted, truncated};
use crate::GeometryError;

const FORMAT: &str = "PLY";

pub(super) fn read(bytes: &[u8]) -> Result<Shape, GeometryError> {
    let (head, body, first_line) = read_head(bytes)?;
    check_vertices(&head)?;
    let mut content = Content::default();
    match head.encoding {
        Encoding::Ascii => text_body::read(&head, &bytes[body..], first_line, &mut content)?,
        Encoding::BinaryBigEndian | Encoding::BinaryLittleEndian => {
            binary_body::read(&head, bytes, body, &mut content)?;
        }
    }
    content.finish()
}

/// The head, where the body starts, and on which line.
fn read_head(bytes: &[u8]) -> Result<(Header, usize, usize), GeometryError> {
    const END: &[u8] = b"end_header";
    if !bytes.starts_with(b"ply") {
        let found = quoted(&decode(&bytes[..bytes.len().min(20)]));
        return Err(error(FORMAT, "line 1".into(), found, "`ply`"));
    }
    let end = bytes
        .windows(END.len() + 1)
        .position(|window| matches!(window[0], b'\n' | b'\r') && &window[1..] == END)
        .ok_or_else(|| {
            truncated(
                FORMAT,
                "no line end_header".into(),
                "a head that ends with end_header",
            )
        })?
        + END.len()
        + 1;
    let rest = &bytes[end..];
    let after = rest.iter().take_while(|&&b| b == b' ').count();
    let line_end = match &rest[after..] {
        [b'\r', b'\n', ..] => 2,
        [b'\r' | b'\n', ..] => 1,
        _ => 0,
    };
    // Comments may be in any encoding, and line ends of any kind.
    let text = decode(&bytes[..end]);
    let n_lines = lines(&text).count();
    let clean: String = lines(&text)
        .flat_map(|(_, line)| [line.trim_end(), "\n"])
        .collect();
    let head = Parser::<Record>::new()
        .read_header(&mut Reader::new(clean.as_bytes()))
        .map_err(|cause| {
            let line = cause.line().unwrap_or(1);
            let found = lines(&clean)
                .nth(line.saturating_sub(1))
                .map_or("", |(_, line)| line);
            Place { format: FORMAT, line }.error(found, "a line of a PLY head, such as `element vertex 8`")
        })?;
    Ok((head, end + after + line_end, n_lines + 1))
}

/// Vertices must have the scalars x, y and z.
fn check_vertices(head: &Header) -> Result<(), GeometryError> {
    let missing = |found: String, expected: &str| Err(error(FORMAT, "head".into(), found, expected));
    let Some(vertex) = head.elements.get("vertex") else {
        let names: Vec<&str> = head.elements.keys().map(String::as_str).collect();
        return missing(
            format!("the elements {}", quoted(&names.join(" "))),
            "the element vertex",
        );
    };
    for axis in ["x", "y", "z"] {
        if !vertex
            .properties
            .get(axis)
            .is_some_and(|p| matches!(p.data_type, PropertyType::Scalar(_)))
        {
            return missing(
                format!("vertices without {axis}"),
                "the scalar properties x, y and z",
            );
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::TriMesh;

    const HEAD: &str = "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\nproperty double y\nproperty float z\nproperty uchar red\nelement face 1\nproperty uchar flags\nproperty list uchar int vertex_indices\nend_header\n";
    const BODY: &str = "0. 0 0 255\n1 0 0 255\n1 1 0 255\n.0 1 .5 255\n7 4 0 1 2 3\n";

    fn text() -> String {
        format!("{HEAD}{BODY}")
    }

    fn mesh(bytes: &[u8]) -> TriMesh {
        match read(bytes) {
            Ok(Shape::Mesh(mesh)) => mesh,
            other => panic!("{other:?}"),
        }
    }

    fn message(bytes: impl AsRef<[u8]>) -> String {
        read(bytes.as_ref()).unwrap_err().to_string()
    }

    fn binary(big: bool, index_type: &str) -> Vec<u8> {
        let order = if big {
            "binary_big_endian"
        } else {
            "binary_little_endian"
        };
        let mut bytes = HEAD
            .replace("ascii", order)
            .replace("uchar int", index_type)
            .into_bytes();
        let mut push = |value: &[u8]| {
            let mut value = value.to_vec();
            if big {
                value.reverse();
            }
            bytes.extend(value);
        };
        for [x, y, z] in [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.5]] {
            push(&(x as f32).to_le_bytes());
            push(&f64::to_le_bytes(y));
            push(&(z as f32).to_le_bytes());
            push(&[255]);
        }
        push(&[7]);
        match index_type {
            "uchar int" | "uchar uint" => {
                push(&[4]);
                (0..4_u32).for_each(|i| push(&i.to_le_bytes()));
            }
            _ => {
                push(&4_u32.to_le_bytes());
                (0..4_u16).for_each(|i| push(&i.to_le_bytes()));
            }
        }
        bytes
    }

    #[test]
    fn text_and_bytes_of_both_orders_hold_the_same_mesh() {
        let expected = mesh(text().as_bytes());
        assert_eq!(expected.triangles(), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(expected.vertices()[3], Point3::new(0.0, 1.0, 0.5));
        for big in [false, true] {
            for index_type in ["uchar int", "uchar uint", "uint ushort"] {
                assert_eq!(mesh(&binary(big, index_type)), expected, "{big} {index_type}");
            }
        }
    }

    #[test]
    fn line_ends_spelling_and_encodings_of_the_head_do_not_matter() {
        let expected = mesh(text().as_bytes());
        assert_eq!(mesh(text().replace('\n', "\r\n").as_bytes()), expected);
        assert_eq!(
            mesh(text().replace("vertex_indices", "vertex_index").as_bytes()),
            expected
        );
        let mut bytes = binary(false, "uchar int");
        let at = bytes.windows(4).position(|w| w == b"made").unwrap();
        bytes[at + 1] = 0xe9;
        assert_eq!(mesh(&bytes), expected);
    }

    #[test]
    fn without_faces_it_is_a_cloud() {
        let cloud = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n4 5 6\n";
        assert_eq!(
            read(cloud.as_bytes()).unwrap(),
            Shape::Cloud(vec![Point3::new(1.0, 2.0, 3.0), Point3::new(4.0, 5.0, 6.0)])
        );
    }

    #[test]
    fn further_properties_lists_and_elements_do_not_matter_nor_does_the_order_of_elements() {
        let text = "ply\nformat ascii 1.0\nobj_info made elsewhere\nelement material 1\nproperty list uint double weights\n\
            property char kind\nelement face 2\nproperty list uchar float texcoord\n\
            property list short uchar vertex_indices\nproperty ushort flags\nelement vertex 4\n\
            property list uchar int near\nproperty double z\nproperty int8 x\nproperty uint16 y\nend_header\n\
            2 0.5 nan -3\n6 0 0 1 0 0 1 3 0 1 2 9\n0 4 0 1 2 3 9\n2 1 2 0.5 0 0\n0 .5 4 0\n0 .5 1 1\n1 7 .5 0 4\n";
        let mesh = mesh(text.as_bytes());
        assert_eq!(mesh.vertices()[1], Point3::new(4.0, 0.0, 0.5));
        // The second face is a dart: it is cut from its inner corner.
        assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn strips_turn_every_second_triangle() {
        let strips = text()
            .replace("element face 1\nproperty uchar flags", "element tristrips 1")
            .replace("7 4 0 1 2 3", "8 0 1 2 3 -1 0 1 2");
        assert_eq!(
            mesh(strips.as_bytes()).triangles(),
            [[0, 1, 2], [2, 1, 3], [0, 1, 2]]
        );
    }

    #[test]
    fn messages_name_place_found_and_expected() {
        assert_eq!(message("OFF\n"), "PLY, line 1: found `OFF�`, expected `ply`");
        assert_eq!(
            message("ply\nformat ascii 1.0\n"),
            "PLY, end of file: found no line end_header, expected a head that ends with end_header"
        );
        assert_eq!(
            message(text().replace("property uchar red", "property colour red")),
            "PLY, line 8: found `property colour red`, expected a line of a PLY head, such as `element vertex 8`"
        );
        assert_eq!(
            message(text().replace("double y", "double why")),
            "PLY, head: found vertices without y, expected the scalar properties x, y and z"
        );
        assert_eq!(
            message(text().replace("1 1 0 255", "1 nan 0 255")),
            "PLY, line 15: found `nan`, expected a finite number"
        );
        assert_eq!(
            message(text().replace("4 0 1 2 3", "4 0 1 2 9")),
            "PLY, line 17: found 9, expected a vertex index from 0 to 3"
        );
        assert_eq!(
            message(text().replace("7 4 0 1 2 3\n", "")),
            "PLY, end of file: found 0 of element face, expected 1, as declared"
        );
        let bytes = binary(true, "uchar int");
        assert_eq!(
            message(&bytes[..bytes.len() - 1]),
            format!(
                "PLY, face 0 (byte {}): found the end of the file, expected the rest of the element",
                bytes.len() - 18
            )
        );
    }

    #[test]
    fn a_huge_declared_count_costs_nothing() {
        let head = HEAD.replace("ascii", "binary_little_endian");
        let many = head.replace("vertex 4", "vertex 4000000000") + "some bytes";
        assert_eq!(
            message(many),
            "PLY, end of file: found 10 bytes for element vertex, expected at least 17 for each of 4000000000"
        );
        // Elements without properties take no bytes at all.
        let nothing = "element nothing 18446744073709551615\nelement vertex";
        let bytes = binary(false, "uchar int");
        let with_nothing = [
            head.replace("element vertex", nothing).as_bytes(),
            &bytes[head.len()..],
        ]
        .concat();
        assert_eq!(mesh(&with_nothing), mesh(&bytes));
    }
}
