//! A scan of 200,000 triangles in every format: reading alone, and loading as every command does it (reading, welding,
//! mending, looking over). The volume inside is measured apart: the scan is open, so it follows the winding number.
//!
//! `cargo bench -p prehend-benches --bench readers`

use std::fmt::Write;
use std::hint::black_box;
use std::time::Duration;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use nalgebra::Point3;
use prehend::geometry::{MeshFormat, Shape, TriMesh, enclosed_volume, inspect, read_shape, repair};

/// Rings and sides of the scan: 2 × 250 × 400 triangles.
const N_RINGS: u32 = 250;
const N_SIDES: u32 = 400;

/// A bumpy vessel (mm) with an open top, as single-precision numbers as scanners write them.
fn scan() -> TriMesh {
    let mut vertices = Vec::new();
    for i in 0..=N_RINGS {
        let height = f64::from(i) / f64::from(N_RINGS);
        for j in 0..N_SIDES {
            let turn = f64::from(j) / f64::from(N_SIDES) * std::f64::consts::TAU;
            let radius = (40.0 + 3.0 * (7.0 * turn + 9.0 * height).sin()) * (height * 2.6).sin().max(0.02);
            let p = [radius * turn.cos(), radius * turn.sin(), 120.0 * height];
            vertices.push(Point3::from(p.map(|c| f64::from(c as f32))));
        }
    }
    let at = |i: u32, j: u32| i * N_SIDES + j % N_SIDES;
    let quads = (0..N_RINGS).flat_map(|i| (0..N_SIDES).map(move |j| (i, j)));
    let triangles = quads.flat_map(|(i, j)| {
        [
            [at(i, j), at(i, j + 1), at(i + 1, j + 1)],
            [at(i, j), at(i + 1, j + 1), at(i + 1, j)],
        ]
    });
    TriMesh::new(vertices, triangles.collect()).expect("a sound mesh")
}

fn single(p: &Point3<f64>) -> [f32; 3] {
    [p.x as f32, p.y as f32, p.z as f32]
}

fn lines<T>(items: &[T], line: impl Fn(&mut String, &T)) -> String {
    let mut text = String::new();
    for item in items {
        line(&mut text, item);
        text.push('\n');
    }
    text
}

fn vertex_lines(mesh: &TriMesh, start: &str) -> String {
    lines(mesh.vertices(), |text, p| {
        let [x, y, z] = single(p);
        let _ = write!(text, "{start}{x} {y} {z}");
    })
}

fn face_lines(mesh: &TriMesh, start: &str, first: u32) -> String {
    lines(mesh.triangles(), |text, t| {
        let [a, b, c] = t.map(|v| v + first);
        let _ = write!(text, "{start}{a} {b} {c}");
    })
}

fn off(mesh: &TriMesh) -> Vec<u8> {
    let head = format!("OFF\n{} {} 0\n", mesh.vertices().len(), mesh.n_triangles());
    (head + &vertex_lines(mesh, "") + &face_lines(mesh, "3 ", 0)).into_bytes()
}

fn obj(mesh: &TriMesh) -> Vec<u8> {
    ("o scan\n".to_owned() + &vertex_lines(mesh, "v ") + &face_lines(mesh, "f ", 1)).into_bytes()
}

fn stl_text(mesh: &TriMesh) -> Vec<u8> {
    let corners: Vec<_> = mesh.corners().collect();
    let facets = lines(&corners, |text, t| {
        text.push_str("facet normal 0 0 0\n outer loop\n");
        for [x, y, z] in t.map(|p| single(&p)) {
            let _ = writeln!(text, "  vertex {x:e} {y:e} {z:e}");
        }
        text.push_str(" endloop\nendfacet");
    });
    format!("solid scan\n{facets}endsolid scan\n").into_bytes()
}

fn stl_binary(mesh: &TriMesh) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((mesh.n_triangles() as u32).to_le_bytes());
    for t in mesh.corners() {
        bytes.extend([0; 12]);
        bytes.extend(t.iter().flat_map(single).flat_map(f32::to_le_bytes));
        bytes.extend([0; 2]);
    }
    bytes
}

fn ply_head(mesh: &TriMesh, format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.vertices().len(),
        mesh.n_triangles()
    )
}

fn ply_text(mesh: &TriMesh) -> Vec<u8> {
    (ply_head(mesh, "ascii") + &vertex_lines(mesh, "") + &face_lines(mesh, "3 ", 0)).into_bytes()
}

fn ply_binary(mesh: &TriMesh, little: bool) -> Vec<u8> {
    let format = if little {
        "binary_little_endian"
    } else {
        "binary_big_endian"
    };
    let order = |mut word: [u8; 4]| {
        if !little {
            word.reverse();
        }
        word
    };
    let mut bytes = ply_head(mesh, format).into_bytes();
    for p in mesh.vertices() {
        bytes.extend(single(p).into_iter().flat_map(|c| order(c.to_le_bytes())));
    }
    for t in mesh.triangles() {
        bytes.push(3);
        bytes.extend(t.iter().flat_map(|v| order(v.to_le_bytes())));
    }
    bytes
}

fn glb(mesh: &TriMesh) -> Vec<u8> {
    let (n_vertices, n_indices) = (mesh.vertices().len(), 3 * mesh.n_triangles());
    let (positions, indices) = (12 * n_vertices, 4 * n_indices);
    let mut json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"type":"VEC3","count":{n_vertices}}},
{{"bufferView":1,"componentType":5125,"type":"SCALAR","count":{n_indices}}}],
"bufferViews":[{{"buffer":0,"byteOffset":0,"byteLength":{positions}}},
{{"buffer":0,"byteOffset":{positions},"byteLength":{indices}}}],
"buffers":[{{"byteLength":{}}}]}}"#,
        positions + indices
    );
    while json.len() % 4 != 0 {
        json.push(' ');
    }
    let mut bytes = b"glTF".to_vec();
    let total = 12 + 8 + json.len() + 8 + positions + indices;
    for word in [2, total as u32, json.len() as u32, 0x4e4f_534a] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(json.as_bytes());
    for word in [(positions + indices) as u32, 0x004e_4942] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(mesh.vertices().iter().flat_map(single).flat_map(f32::to_le_bytes));
    bytes.extend(mesh.triangles().iter().flatten().flat_map(|v| v.to_le_bytes()));
    bytes
}

fn dae(mesh: &TriMesh) -> Vec<u8> {
    let positions = vertex_lines(mesh, "").replace('\n', " ");
    let corners = face_lines(mesh, "", 0).replace('\n', " ");
    let n = mesh.vertices().len();
    format!(
        r##"<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="0.001"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="{}">{positions}</float_array><technique_common>
<accessor source="#a" count="{n}" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor>
</technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="{}"><input semantic="VERTEX" source="#v" offset="0"/><p>{corners}</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"##,
        3 * n,
        mesh.n_triangles()
    )
    .into_bytes()
}

fn pcd_binary(mesh: &TriMesh) -> Vec<u8> {
    let n = mesh.vertices().len();
    let mut bytes = format!(
        "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {n}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA binary\n"
    )
    .into_bytes();
    bytes.extend(mesh.vertices().iter().flat_map(single).flat_map(f32::to_le_bytes));
    bytes
}

/// The mesh as it is used, after all that is looked at.
fn load(bytes: &[u8], format: MeshFormat) -> usize {
    match read_shape(bytes, format).expect("the file is sound") {
        Shape::Mesh(mesh) => {
            let (mesh, _) = repair(mesh);
            let report = inspect(&mesh);
            assert!(report.n_holes > 0, "the top is open");
            mesh.n_triangles()
        }
        Shape::Cloud(points) => points.len(),
    }
}

fn readers(c: &mut Criterion) {
    let mesh = scan();
    let files = [
        ("off", MeshFormat::Off, off(&mesh)),
        ("obj", MeshFormat::Obj, obj(&mesh)),
        ("stl_ascii", MeshFormat::Stl, stl_text(&mesh)),
        ("stl_binary", MeshFormat::Stl, stl_binary(&mesh)),
        ("ply_ascii", MeshFormat::Ply, ply_text(&mesh)),
        ("ply_little_endian", MeshFormat::Ply, ply_binary(&mesh, true)),
        ("ply_big_endian", MeshFormat::Ply, ply_binary(&mesh, false)),
        ("glb", MeshFormat::Glb, glb(&mesh)),
        ("dae", MeshFormat::Dae, dae(&mesh)),
        ("xyz_cloud", MeshFormat::Xyz, vertex_lines(&mesh, "").into_bytes()),
        ("pcd_cloud", MeshFormat::Pcd, pcd_binary(&mesh)),
    ];
    for (name, format, bytes) in &files {
        println!("{name}: {} triangles, {} bytes", mesh.n_triangles(), bytes.len());
        let mut group = c.benchmark_group(*name);
        group
            .sample_size(10)
            .warm_up_time(Duration::from_millis(100))
            .measurement_time(Duration::from_secs(1));
        group.bench_function("read", |b| b.iter(|| read_shape(black_box(bytes), *format)));
        group.bench_function("load", |b| b.iter(|| load(black_box(bytes), *format)));
        group.finish();
    }
    let mut group = c.benchmark_group("welded");
    group.sample_size(10).measurement_time(Duration::from_secs(1));
    group.bench_function("repair", |b| {
        b.iter_batched(|| mesh.clone(), repair, BatchSize::LargeInput);
    });
    group.bench_function("inspect", |b| b.iter(|| inspect(black_box(&mesh))));
    group.bench_function("enclosed_volume", |b| {
        b.iter(|| enclosed_volume(black_box(&mesh)));
    });
    group.finish();
}

criterion_group!(benches, readers);
criterion_main!(benches);
