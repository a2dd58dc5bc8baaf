use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::*;
use crate::signed_volume;

/// A tetrahedron with legs of 1 from the origin: positions as floats, indices as u16; 48 + 24 bytes.
fn buffer() -> Vec<u8> {
    let positions = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].concat();
    let indices = [0_u16, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];
    let mut bytes = positions
        .iter()
        .flat_map(|x: &f32| x.to_le_bytes())
        .collect::<Vec<u8>>();
    bytes.extend(indices.iter().flat_map(|i| i.to_le_bytes()));
    bytes
}

fn text(buffers: &str, scene: &str) -> String {
    format!(
        r#"{{"asset": {{"version": "2.0"}}, {scene}
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, "NORMAL": 0}}, "indices": 1}}]}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4}},
            {{"bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": 12}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 48}}, {{"buffer": 0, "byteOffset": 48, "byteLength": 24}}],
        "buffers": [{{{buffers} "byteLength": 72}}]}}"#
    )
}

fn embedded(scene: &str) -> String {
    let data = STANDARD.encode(buffer());
    text(
        &format!(r#""uri": "data:application/octet-stream;base64,{data}","#),
        scene,
    )
}

fn glb(json: &str, data: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF".to_vec();
    for word in [2, 12 + 8 + json.len() + 8 + data.len(), json.len()] {
        bytes.extend((word as u32).to_le_bytes());
    }
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.extend((data.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(data);
    bytes
}

fn alone(bytes: impl AsRef<[u8]>) -> Result<TriMesh, GeometryError> {
    read(bytes.as_ref(), &|_| Err("is not at hand".to_owned()))
}

fn message(bytes: impl AsRef<[u8]>) -> String {
    alone(bytes).unwrap_err().to_string()
}

#[test]
fn buffers_come_from_text_from_the_binary_chunk_and_from_further_files() {
    let expected = alone(embedded("")).unwrap();
    assert_eq!(expected.vertices()[2], Point3::new(0.0, 1.0, 0.0));
    assert_eq!(expected.triangles()[0], [0, 2, 1]);
    assert!((signed_volume(&expected) - 1.0 / 6.0).abs() < 1e-12);
    assert_eq!(alone(glb(&text("", ""), &buffer())).unwrap(), expected);
    let resolve = |name: &str| match name {
        "a part.bin" => Ok(buffer()),
        _ => Err("is missing".to_owned()),
    };
    let beside = text(r#""uri": "a%20part.bin","#, "");
    assert_eq!(read(beside.as_bytes(), &resolve).unwrap(), expected);
    assert_eq!(
        message(beside),
        "glTF, buffers[0]: found `a%20part.bin`, which is not at hand, expected a file that can be read"
    );
}

#[test]
fn nodes_place_meshes_and_mirrors_keep_them_outward() {
    let scene = r#""scene": 1, "scenes": [{"nodes": [3]}, {"nodes": [0, 2]}], "nodes": [
        {"translation": [0, 0, 5], "children": [1]},
        {"mesh": 0, "rotation": [0, 0, 0.7071067811865476, 0.7071067811865476], "scale": [2, 1, 1]},
        {"mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 7, 0, 0, 1]},
        {"mesh": 0}],"#;
    let mesh = alone(embedded(scene)).unwrap();
    assert_eq!(mesh.n_triangles(), 8);
    // x becomes twice as long, then turns to y.
    assert!((mesh.vertices()[1] - Point3::new(0.0, 2.0, 5.0)).norm() < 1e-12);
    assert_eq!(mesh.vertices()[5], Point3::new(6.0, 0.0, 0.0));
    assert!((signed_volume(&mesh) - 3.0 / 6.0).abs() < 1e-12);
}

#[test]
fn strips_fans_lists_without_indices_and_points() {
    let with = |primitive: &str| {
        embedded("").replace(
            r#""attributes": {"POSITION": 0, "NORMAL": 0}, "indices": 1"#,
            primitive,
        )
    };
    let triangles = |primitive: &str| alone(with(primitive)).unwrap().triangles().to_vec();
    let position = r#""attributes": {"POSITION": 0}"#;
    assert_eq!(triangles(position), [[0, 1, 2]]);
    assert_eq!(
        triangles(&format!("{position}, \"mode\": 5")),
        [[0, 1, 2], [2, 1, 3]]
    );
    assert_eq!(
        triangles(&format!("{position}, \"mode\": 6")),
        [[0, 1, 2], [0, 2, 3]]
    );
    assert_eq!(
        message(with(&format!("{position}, \"mode\": 0"))),
        "the shape has no triangles; check that the file is complete"
    );
}

#[test]
fn sparse_and_quantised_positions() {
    // Vertex 3 is replaced by the position of vertex 1; its index 3 is the u16 at byte 58.
    let sparse = embedded("").replacen(
        r#""count": 4}"#,
        r#""count": 4, "sparse": {"count": 1, "indices": {"bufferView": 1, "byteOffset": 10, "componentType": 5123},
            "values": {"bufferView": 0, "byteOffset": 12}}}"#,
        1,
    );
    assert_eq!(alone(sparse).unwrap().vertices()[3], Point3::new(1.0, 0.0, 0.0));
    let bytes: Vec<u8> = [[0_i16, 0, 0, 9], [i16::MAX, 0, 0, 9], [0, -i16::MAX, 0, 9]]
        .concat()
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let quantised = format!(
        r#"{{"asset": {{"version": "2.1"}}, "extensionsRequired": ["KHR_mesh_quantization"],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}],
        "accessors": [{{"bufferView": 0, "componentType": 5122, "normalized": true, "type": "VEC3", "count": 3}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 24, "byteStride": 8}}],
        "buffers": [{{"uri": "data:;base64,{}", "byteLength": 24}}]}}"#,
        STANDARD.encode(bytes)
    );
    assert_eq!(
        alone(quantised).unwrap().vertices()[2],
        Point3::new(0.0, -1.0, 0.0)
    );
}

#[test]
fn messages_name_place_found_and_expected() {
    assert_eq!(
        message("{\n\"asset\": 1}"),
        "glTF, line 2, column 10: found invalid type: integer `1`, expected struct Asset, expected the JSON of a glTF 2.0 file"
    );
    assert_eq!(
        message(embedded("").replace("2.0", "1.0")),
        "glTF, asset.version: found `1.0`, expected 2.0"
    );
    assert_eq!(
        message(embedded(
            r#""extensionsRequired": ["KHR_draco_mesh_compression"],"#
        )),
        "glTF, extensionsRequired: found `KHR_draco_mesh_compression`, expected plain or quantised positions; export without compression"
    );
    assert_eq!(
        message(embedded("").replace("\"count\": 4", "\"count\": 5")),
        "glTF, accessors[0]: found 5 elements of 12 bytes, 12 apart, at byte 0 of bufferViews[0], expected elements inside the view, and the view inside its buffer"
    );
    assert_eq!(
        message(embedded("").replace("\"count\": 4", "\"count\": 3")),
        "glTF, meshes[0].primitives[0]: found 3, expected a vertex index from 0 to 2"
    );
    assert_eq!(
        message(embedded(r#""nodes": [{"mesh": 7}],"#)),
        "glTF, the document: found meshes[7], expected one of 1 meshes"
    );
    assert_eq!(
        message(embedded(
            r#""scenes": [{"nodes": [0]}], "nodes": [{"children": [0]}],"#
        )),
        "glTF, nodes[0]: found a node with two parents, expected a tree"
    );
    let file = glb(&text("", ""), &buffer());
    assert_eq!(
        message(&file[..file.len() - 1]),
        format!(
            "GLB, end of file: found 71 bytes in the chunk at byte {}, expected 72, as declared",
            file.len() - 80
        )
    );
    assert_eq!(
        message(b"glTF\x01\0\0\0"),
        "GLB, byte 4: found version 1, expected version 2"
    );
    assert_eq!(
        message(text("", "")),
        "glTF, buffers[0]: found no uri, expected a uri, or a GLB file's binary chunk"
    );
}

#[test]
fn claims_cost_nothing() {
    let zeros = r#"{"asset": {"version": "2.0"}, "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"componentType": 5126, "type": "VEC3", "count": 99999999999}]}"#;
    assert_eq!(
        message(zeros),
        "glTF, accessors[0]: found 99999999999 elements `VEC3` of component type 5126, expected a bufferView"
    );
    let often: Vec<String> = (0..9).map(|_| r#"{"mesh": 0}"#.to_owned()).collect();
    let nodes = format!("\"nodes\": [{}],", often.join(","));
    assert_eq!(alone(embedded(&nodes)).unwrap().n_triangles(), 36);
}
