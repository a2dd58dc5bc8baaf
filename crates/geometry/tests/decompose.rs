//! The decomposition on bodies with known parts.

mod shapes;

use std::fmt::Write;

use nalgebra::{Isometry3, Point3, Vector3};
use prehend_geometry::{
    DecomposeOptions, Decomposition, GeometryError, TriMesh, decompose, signed_volume, union_volume,
};
use shapes::{bottle, boxes, hammer, mug};

fn decomposed(mesh: &TriMesh) -> Decomposition {
    decompose(mesh, &DecomposeOptions::default()).unwrap()
}

fn turned(mesh: &TriMesh, k: u32) -> TriMesh {
    let k = f64::from(k);
    mesh.transformed(&Isometry3::new(
        Vector3::new(0.3, -k, 2.0),
        Vector3::new(0.7 * k, 1.3 - 0.4 * k, 0.2 * k),
    ))
}

#[test]
fn a_hammer_of_two_boxes_becomes_these_two() {
    let found = decomposed(&hammer());
    assert_eq!(found.boxes.len(), 2);
    // 120 × 30 × 330 over 120 × 30 × 30 + 30 × 20 × 300.
    assert!(
        (found.cvex - 1188.0 / (108.0 + 180.0)).abs() < 0.01,
        "{}",
        found.cvex
    );
    assert!((found.root.extents() - Vector3::new(0.12, 0.03, 0.33)).amax() < 1e-9);
}

#[test]
fn the_boxes_cover_every_triangle_and_the_inside() {
    for mesh in [hammer(), mug(), bottle()] {
        let found = decomposed(&mesh);
        for [a, b, c] in mesh.corners() {
            for i in 0..=10 {
                for j in 0..=10 - i {
                    let p: Point3<f64> = a + (b - a) * f64::from(i) / 10.0 + (c - a) * f64::from(j) / 10.0;
                    assert!(
                        found.boxes.iter().any(|bx| bx.contains(&p, 1e-9)),
                        "{p} is in no box"
                    );
                }
            }
        }
        assert!(union_volume(&found.boxes) >= signed_volume(&mesh).abs() * (1.0 - 1e-9));
    }
}

#[test]
fn cvex_ignores_motion_and_scale() {
    for (name, mesh) in [("hammer", hammer()), ("mug", mug()), ("bottle", bottle())] {
        let cvex = decomposed(&mesh).cvex;
        for k in 1..7 {
            let other = decomposed(&turned(&mesh, k)).cvex;
            assert!(
                (other / cvex - 1.0).abs() < 0.01,
                "{name} turned by {k}: {other} instead of {cvex}"
            );
        }
        let scaled = decomposed(&mesh.scaled(1000.0)).cvex;
        assert!(
            (scaled / cvex - 1.0).abs() < 1e-6,
            "{name} in millimetres: {scaled} instead of {cvex}"
        );
    }
}

#[test]
fn the_tree_holds_the_leaves_in_order() {
    let found = decomposed(&mug());
    let leaves: Vec<_> = found.leaves().map(|node| found.tree[node].region).collect();
    assert_eq!(leaves, found.boxes);
    assert_eq!(found.tree[0].region, found.root);
    for (node, entry) in found.tree.iter().enumerate() {
        for child in entry.children.into_iter().flatten() {
            assert_eq!(found.tree[child].parent, Some(node));
        }
    }
}

#[test]
fn a_smaller_gain_gives_fewer_boxes_and_the_cap_holds() {
    let counts: Vec<usize> = [0.2, 0.9, 0.94, 0.99]
        .map(|gain| DecomposeOptions {
            gain,
            ..Default::default()
        })
        .map(|options| decompose(&mug(), &options).unwrap().boxes.len())
        .to_vec();
    assert_eq!(counts[0], 1);
    assert!(counts.is_sorted(), "{counts:?}");
    let capped = DecomposeOptions {
        gain: 1.0,
        max_boxes: 3,
        ..Default::default()
    };
    assert!(decompose(&mug(), &capped).unwrap().boxes.len() <= 3);
}

#[test]
fn flat_and_open_meshes_are_decomposed_too() {
    let triangle = [[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.0, 0.1, 0.0]].map(Point3::from);
    let flat = decomposed(&TriMesh::new(triangle.to_vec(), vec![[0, 1, 2]]).unwrap());
    // The smallest rectangle has the area 0.2 × 0.1 on whichever edge; its thickness is raised to 0.5 %.
    assert_eq!(flat.boxes.len(), 1);
    assert!(flat.root.extents().min() > 0.0009);
    let whole = hammer();
    let open = TriMesh::new(whole.vertices().to_vec(), whole.triangles()[2..].to_vec()).unwrap();
    assert!((decomposed(&open).cvex / decomposed(&whole).cvex - 1.0).abs() < 0.01);
}

#[test]
fn bad_options_and_a_mesh_without_size_are_errors_that_help() {
    let error = decompose(
        &hammer(),
        &DecomposeOptions {
            gain: 1.5,
            ..Default::default()
        },
    )
    .unwrap_err();
    assert_eq!(
        error.to_string(),
        "`gain` is 1.5, expected a number above 0 and at most 1"
    );
    let point = TriMesh::new(vec![Point3::origin()], vec![[0, 0, 0]]).unwrap();
    let error = decompose(&point, &DecomposeOptions::default()).unwrap_err();
    assert_eq!(error, GeometryError::BadExtents { extents: [0.0; 3] });
}

#[test]
fn json_has_volumes_and_reads_back() {
    let found = decomposed(&boxes(&[([0.0; 3], [0.1, 0.2, 0.3])]));
    let json = serde_json::to_value(&found).unwrap();
    for region in [&json["root"], &json["boxes"][0]] {
        let volume = region["volume"].as_f64().unwrap();
        assert!((volume - 0.006).abs() < 1e-12);
    }
    assert_eq!(json["cvex"], 1.0);
    assert_eq!(serde_json::from_value::<Decomposition>(json).unwrap(), found);
}

#[test]
fn known_bodies_give_the_boxes_on_record() {
    let mut text = String::new();
    for (name, mesh) in [("hammer", hammer()), ("mug", mug()), ("bottle", bottle())] {
        let found = decomposed(&mesh);
        let _ = writeln!(text, "{name}: cvex {:.2}", found.cvex);
        for b in std::iter::once(&found.root).chain(&found.boxes) {
            let mm = |v: Vector3<f64>| v.map(|x| (x * 1000.0).round() as i64);
            let (center, extents) = (mm(b.center().coords), mm(b.extents()));
            let _ = writeln!(text, "  {:?} mm at {:?}", extents.as_slice(), center.as_slice());
        }
    }
    assert_eq!(text, include_str!("golden/boxes.txt"), "found:\n{text}");
}
