use nalgebra::Point3;

use super::*;
use crate::{signed_volume, surface_area};

const HEAD: &str = r#"<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset>
"#;

/// A tetrahedron with legs of 1 as triangles with normals, and a dart as a polygon: 8 numbers of positions more.
const GEOMETRIES: &str = r##"<library_geometries>
<geometry id="tetra"><mesh>
 <source id="p"><float_array id="p-array" count="12">0 0 0 1 0 0 0 1 0 0 0 1</float_array>
  <technique_common><accessor source="#p-array" count="4" stride="3"><param name="X" type="float"/></accessor></technique_common></source>
 <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
 <lines count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1</p></lines>
 <triangles count="4"><input semantic="VERTEX" source="#v" offset="1"/><input semantic="NORMAL" source="#p" offset="0"/>
  <p>0 0 0 2 0 1  0 0 0 1 0 3  0 0 0 3 0 2  0 1 0 2 0 3</p></triangles>
</mesh></geometry>
<geometry id="dart"><mesh>
 <source id="q"><float_array id="q-array" count="12">0 0 0 4 0 0 1 1 0 0 4 0</float_array>
  <technique_common><accessor source="#q-array" count="4" stride="3"/></technique_common></source>
 <vertices id="w"><input semantic="POSITION" source="#q"/></vertices>
 POLYGONS
</mesh></geometry>
</library_geometries>
"##;

const POLYLIST: &str = r##"<polylist count="2"><input semantic="VERTEX" source="#w" offset="0"/><vcount>4 3</vcount><p>1 2 3 0 0 1 2</p></polylist>"##;

fn file(scene: &str) -> String {
    format!(
        "{HEAD}{}{scene}</COLLADA>",
        GEOMETRIES.replace("POLYGONS", POLYLIST)
    )
}

fn scene(nodes: &str) -> String {
    file(&format!(
        "<library_visual_scenes><visual_scene id=\"other\"/><visual_scene id=\"s\">{nodes}</visual_scene></library_visual_scenes>\
         <scene><instance_visual_scene url=\"#s\"/></scene>"
    ))
}

fn mesh(text: &str) -> TriMesh {
    read(text.as_bytes()).unwrap().0
}

fn message(text: &str) -> String {
    read(text.as_bytes()).unwrap_err().to_string()
}

#[test]
fn unit_and_upward_axis_are_reported_not_applied() {
    let (mesh, stated) = read(file("").as_bytes()).unwrap();
    assert_eq!(stated.metres_per_unit, Some(0.01));
    assert_eq!(stated.up, Some(Vector3::z_axis()));
    assert_eq!(mesh.vertices()[1], Point3::new(1.0, 0.0, 0.0));
    let silent = file("").replace("<asset>", "<!--").replace("</asset>", "-->");
    assert_eq!(read(silent.as_bytes()).unwrap().1, Stated::default());
}

#[test]
fn without_a_scene_all_geometries_come_as_they_stand() {
    let mesh = mesh(&file(""));
    assert_eq!(mesh.n_triangles(), 4 + 3);
    assert_eq!(mesh.triangles()[..2], [[0, 2, 1], [0, 1, 3]]);
    // The dart has the area 4, its half 2.
    let tetra = 1.5 + 3.0_f64.sqrt() / 2.0;
    assert!((surface_area(&mesh) - tetra - 6.0).abs() < 1e-12);
}

#[test]
fn nodes_move_their_geometries_step_by_step() {
    let nodes = r##"<node><translate>0 0 5</translate><rotate>0 0 1 90</rotate><scale>2 1 1</scale>
        <node><instance_geometry url="#tetra"/></node></node>
        <node><matrix>1 0 0 7 0 1 0 0 0 0 1 0 0 0 0 1</matrix><instance_geometry url="#tetra"/></node>"##;
    let mesh = mesh(&scene(nodes));
    assert!((mesh.vertices()[1] - Point3::new(0.0, 2.0, 5.0)).norm() < 1e-12);
    assert_eq!(mesh.vertices()[5], Point3::new(8.0, 0.0, 0.0));
    assert!((signed_volume(&mesh) - 0.5).abs() < 1e-12);
}

#[test]
fn a_mirror_keeps_the_mesh_outward_and_nodes_may_stand_for_others() {
    let library = r##"<library_nodes><node id="n"><scale>-1 1 1</scale><instance_geometry url="#tetra"/></node></library_nodes>"##;
    let nodes = r##"<node><instance_node url="#n"/></node><node><translate>3 0 0</translate><instance_node url="#n"/></node>"##;
    let mesh = mesh(&scene(nodes).replace("<library_geometries>", &format!("{library}<library_geometries>")));
    assert_eq!(mesh.n_triangles(), 8);
    assert_eq!(mesh.vertices()[5], Point3::new(2.0, 0.0, 0.0));
    assert!((signed_volume(&mesh) - 2.0 / 6.0).abs() < 1e-12);
}

#[test]
fn a_skin_comes_as_it_was_bound() {
    let library = r##"<library_controllers><controller id="c"><skin source="#tetra">
        <bind_shape_matrix>1 0 0 2 0 1 0 0 0 0 1 0 0 0 0 1</bind_shape_matrix></skin></controller></library_controllers>"##;
    let nodes = r##"<node><instance_controller url="#c"/></node>"##;
    let mesh = mesh(&scene(nodes).replace("<library_geometries>", &format!("{library}<library_geometries>")));
    assert_eq!(mesh.vertices()[0], Point3::new(2.0, 0.0, 0.0));
}

#[test]
fn polygons_strips_and_fans() {
    let input = r##"<input semantic="VERTEX" source="#w" offset="0"/>"##;
    for (polygons, area) in [
        (
            format!("<polygons count=\"2\">{input}<p>0 1 2 3</p><p>1 2 3 0</p></polygons>"),
            8.0,
        ),
        (
            format!("<tristrips count=\"1\">{input}<p>1 2 0 3</p></tristrips>"),
            4.0,
        ),
        (
            format!("<trifans count=\"1\">{input}<p>0 1 2 3</p></trifans>"),
            4.0,
        ),
    ] {
        let text = format!("{HEAD}{}</COLLADA>", GEOMETRIES.replace("POLYGONS", &polygons));
        let tetra = 1.5 + 3.0_f64.sqrt() / 2.0;
        assert!(
            (surface_area(&mesh(&text)) - tetra - area).abs() < 1e-12,
            "{polygons}"
        );
    }
}

#[test]
fn messages_name_line_found_and_expected() {
    assert_eq!(
        message("<COLLADA>\n<a></COLLADA>"),
        "DAE, line 2: found expected 'a' tag, not 'COLLADA' at 2:4, expected well-formed XML"
    );
    assert_eq!(
        message("<a/>"),
        "DAE, line 1: found `a`, expected the element COLLADA"
    );
    assert_eq!(
        message(&file("").replace("0.01", "-1")),
        "DAE, line 3: found `-1`, expected a positive number of metres"
    );
    assert_eq!(
        message(&file("").replace("Z_UP", "UP")),
        "DAE, line 3: found `UP`, expected X_UP, Y_UP or Z_UP"
    );
    assert_eq!(
        message(&file("").replace("0 2 0 3</p>", "0 2 0 9</p>")),
        "DAE, line 11: found 9, expected a vertex index from 0 to 3"
    );
    assert_eq!(
        message(&file("").replace("<vcount>4 3", "<vcount>4 4")),
        "DAE, line 17: found a polygon of 4 corners where 3 are left, expected as many corners in <p> as <vcount> says"
    );
    assert_eq!(
        message(&file("").replace(
            "count=\"4\" stride=\"3\"><param",
            "count=\"5\" stride=\"3\"><param"
        )),
        "DAE, line 7: found 5 elements of 3 numbers from 0 on, of 12, expected elements of three numbers or more, all of them in the array"
    );
    assert_eq!(
        message(&scene("<node><instance_geometry url=\"#none\"/></node>")),
        "DAE, line 20: found url `#none`, expected the id of an element in this file"
    );
    assert_eq!(
        message(&scene("<node><skew>1</skew></node>")),
        "DAE, line 20: found `skew`, expected matrix, translate, rotate or scale"
    );
    assert_eq!(
        message(&scene("<node><matrix>1 2</matrix></node>")),
        "DAE, line 20: found 2 numbers in <matrix>, expected 16"
    );
}

#[test]
fn nodes_that_stand_for_themselves_are_an_error() {
    assert_eq!(
        message(&scene("<node id=\"n\"><instance_node url=\"#n\"/></node>")),
        "DAE, line 20: found more than 100000 nodes or 500 levels, expected a scene without cycles"
    );
    let twice = "<node id=\"n\"><instance_node url=\"#n\"/><instance_node url=\"#n\"/></node>";
    assert!(message(&scene(twice)).contains("without cycles"));
}
