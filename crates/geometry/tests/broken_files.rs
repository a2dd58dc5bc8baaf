//! Readers that meet broken bytes answer with an error or a sound shape, and never panic.

use nalgebra::Point3;
use prehend_geometry::{MeshFormat, Shape, TriMesh, inspect, mass_properties, read_shape, repair, write_ply};
use proptest::prelude::*;

/// A small valid file of every format and kind.
fn files() -> Vec<(MeshFormat, Vec<u8>)> {
    let corners = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(Point3::from);
    let mesh = TriMesh::new(corners.to_vec(), vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).unwrap();
    let mut stl = b"solid, but binary".to_vec();
    stl.resize(80, 0);
    stl.extend(2_u32.to_le_bytes());
    for corners in mesh.corners().take(2) {
        stl.extend([0; 12]);
        stl.extend(
            corners
                .iter()
                .flat_map(|p| p.iter().flat_map(|&x| (x as f32).to_le_bytes())),
        );
        stl.extend([0; 2]);
    }
    let head = "VERSION .7\nFIELDS x y z i\nSIZE 4 4 4 2\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\n";
    let mut pcd = format!("{head}DATA binary\n").into_bytes();
    pcd.extend([0x3f; 28]);
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_index\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let big = ply.replace("ascii", "binary_big_endian");
    let mut big = big.as_bytes()[..big.find("0 0 0").unwrap()].to_vec();
    big.extend(
        [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
            .map(f32::to_be_bytes)
            .concat(),
    );
    big.push(3);
    big.extend([0, 1, 2].map(u32::to_be_bytes).concat());
    let facet =
        "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    vec![
        (
            MeshFormat::Off,
            b"OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3 255 0 0\n3 0 1 2\n".to_vec(),
        ),
        (
            MeshFormat::Obj,
            b"mtllib x\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvn 0 0 1\ng a\nf 1//1 2//1 3//1\nf -1 -2 \\\n-3\n"
                .to_vec(),
        ),
        (
            MeshFormat::Stl,
            format!("solid a\n{facet}endsolid a\n").into_bytes(),
        ),
        (MeshFormat::Stl, stl),
        (MeshFormat::Ply, ply.into()),
        (MeshFormat::Ply, big),
        (MeshFormat::Ply, write_ply(&mesh)),
        (MeshFormat::Xyz, b"x y z\n0 0 0\n1, 2, 3\n".to_vec()),
        (
            MeshFormat::Pcd,
            format!("{head}DATA ascii\n1 2 3 4\n5 6 7 8\n").into_bytes(),
        ),
        (MeshFormat::Pcd, pcd),
        #[cfg(feature = "gltf")]
        (
            MeshFormat::Gltf,
            include_bytes!("corpus/gltf/two_nodes.gltf").to_vec(),
        ),
        #[cfg(feature = "gltf")]
        (
            MeshFormat::Glb,
            include_bytes!("corpus/glb/tetrahedron.glb").to_vec(),
        ),
        #[cfg(feature = "dae")]
        (
            MeshFormat::Dae,
            include_bytes!("corpus/dae/mirrored_node.dae").to_vec(),
        ),
    ]
}

#[test]
fn the_files_to_be_broken_are_valid() {
    for (format, bytes) in files() {
        assert!(
            read_shape(&bytes, format).is_ok(),
            "{format:?}: {:?}",
            read_shape(&bytes, format)
        );
    }
}

/// What a reader makes of any bytes must be a shape that keeps its promises, or an error.
fn check(bytes: &[u8], format: MeshFormat) {
    if let Ok(shape) = read_shape(bytes, format) {
        assert!(!shape.points().is_empty());
        assert!(shape.points().iter().all(|p| p.iter().all(|c| c.is_finite())));
        if let Shape::Mesh(mesh) = shape {
            let _ = mass_properties(&mesh);
            let (repaired, _) = repair(mesh);
            let _ = inspect(&repaired);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(5000))]

    #[test]
    fn no_mutation_of_bytes_makes_a_reader_panic(
        which in any::<prop::sample::Index>(),
        edits in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..4_u8), 1..6),
    ) {
        let files = files();
        let (format, mut bytes) = files[which.index(files.len())].clone();
        for (at, value, kind) in edits {
            let at = at.index(bytes.len().max(1)).min(bytes.len());
            match kind {
                0 if at < bytes.len() => bytes[at] = value,
                1 => bytes.insert(at, value),
                2 => bytes.truncate(at),
                // Digits and signs go further into a reader than other bytes.
                _ if at < bytes.len() => bytes[at] = b"0123456789-.einf \n"[usize::from(value) % 18],
                _ => {}
            }
        }
        check(&bytes, format);
    }

    #[test]
    fn no_bytes_at_all_make_a_reader_panic(
        bytes in proptest::collection::vec(any::<u8>(), 0..200), which in 0..MeshFormat::EXTENSIONS.len(),
    ) {
        check(&bytes, MeshFormat::from_extension(MeshFormat::EXTENSIONS[which]).unwrap());
    }
}
