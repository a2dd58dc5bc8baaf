//! Distances to a bundled mug: the exact tree, the grid beside it, and parry's own tree.

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use parry3d_f64::math::{Pose, Rotation, Vector};
use parry3d_f64::query::{self, PointQuery};
use parry3d_f64::shape;
use prehend::ObjectOptions;
use prehend::geometry::{Collider, Solid, Surface};
use prehend::stages::decompose::shape_of;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Poses with their origin at most `reach` (m) from the surface, on either side.
fn poses(surface: &Surface, reach: f64, n: usize) -> Vec<Isometry3<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    (0..n)
        .map(|_| {
            let [a, b, c] = surface
                .mesh()
                .triangle(rng.random_range(0..surface.mesh().n_triangles()));
            let off = Vector3::from_fn(|_, _| rng.random_range(-reach..reach));
            let turn = Vector3::from_fn(|_, _| rng.random_range(-3.0..3.0));
            let at = (a.coords + b.coords + c.coords) / 3.0 + off;
            Isometry3::from_parts(at.into(), UnitQuaternion::from_scaled_axis(turn))
        })
        .collect()
}

fn parry_pose(pose: &Isometry3<f64>) -> Pose {
    let (q, t) = (pose.rotation.coords, pose.translation.vector);
    Pose::from_parts(
        Vector::new(t.x, t.y, t.z),
        Rotation::from_xyzw(q.x, q.y, q.z, q.w),
    )
}

fn distance(c: &mut Criterion) {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("objects/mug/coffee_mug.ply");
    let shape = shape_of(&path, ObjectOptions::default()).expect("the bundled objects are there");
    let object = shape.grasp_object().expect("it can be grasped");
    let surface = object.surface();
    let mesh = surface.mesh();
    c.bench_function(&format!("build/{}_triangles", mesh.n_triangles()), |b| {
        b.iter(|| Surface::new(black_box(mesh.clone())));
    });
    let vertices = || {
        let of_vertex = |p: &Point3<f64>| Vector::new(p.x, p.y, p.z);
        mesh.vertices().iter().map(of_vertex).collect()
    };
    c.bench_function("build/parry_trimesh", |b| {
        b.iter(|| shape::TriMesh::new(vertices(), mesh.triangles().to_vec()));
    });
    let parry = shape::TriMesh::new(vertices(), mesh.triangles().to_vec()).expect("the mesh has triangles");
    let fresh = Surface::new(mesh.clone()).grid_bytes();

    let cube: Vec<Point3<f64>> = (0..8)
        .map(|i| {
            Point3::from(Vector3::new(i & 1, i >> 1 & 1, i >> 2 & 1).map(|b| f64::from(b) * 0.02 - 0.01))
        })
        .collect();
    let corners: Vec<Vector> = cube.iter().map(|p| Vector::new(p.x, p.y, p.z)).collect();
    let solids: [(&str, Solid, Box<dyn shape::Shape>); 3] = [
        (
            "ball",
            Solid::Sphere { radius: 0.01 },
            Box::new(shape::Ball::new(0.01)),
        ),
        (
            "capsule",
            Solid::Capsule {
                half_length: 0.015,
                radius: 0.008,
            },
            Box::new(shape::Capsule::new_z(0.015, 0.008)),
        ),
        (
            "convex_piece",
            Solid::Hull(std::sync::Arc::new(cube)),
            Box::new(shape::ConvexPolyhedron::from_convex_hull(&corners).expect("a cube has a hull")),
        ),
    ];
    for (near, reach) in [("within_5_mm", 0.005), ("within_50_mm", 0.05)] {
        let poses = poses(surface, reach, 500);
        let points: Vec<Point3<f64>> = poses.iter().map(|p| p.translation.vector.into()).collect();
        // The first pass measures the bricks that are then asked.
        for p in &points {
            black_box(surface.estimated_distance(p));
        }
        let mut group = c.benchmark_group(format!("point/{near}"));
        let mut next = points.iter().cycle();
        let mut point = move || *next.next().expect("cycles do not end");
        group.bench_function("grid", |b| b.iter(|| surface.estimated_distance(&point())));
        group.bench_function("grid_lower_bound", |b| {
            b.iter(|| surface.distance_lower_bound(&point()));
        });
        group.bench_function("tree_unsigned", |b| b.iter(|| surface.closest_point(&point())));
        group.bench_function("tree_signed", |b| b.iter(|| surface.signed_distance(&point())));
        group.bench_function("parry", |b| {
            b.iter(|| {
                let p = point();
                parry.project_local_point(Vector::new(p.x, p.y, p.z), false)
            });
        });
        group.finish();
        for (name, solid, parry_solid) in &solids {
            let collider = Collider::new(solid).expect("the solid has a size");
            let mut group = c.benchmark_group(format!("{name}/{near}"));
            let mut next = poses.iter().cycle();
            let mut pose = move || *next.next().expect("cycles do not end");
            for pose in &poses {
                black_box(surface.gap_bounds(&collider, pose));
            }
            group.bench_function("grid", |b| b.iter(|| surface.gap_bounds(&collider, &pose())));
            group.bench_function("tree", |b| {
                b.iter(|| surface.gap(&collider, &pose(), f64::INFINITY));
            });
            group.bench_function("tree_below_2.5_mm", |b| {
                b.iter(|| surface.gap(&collider, &pose(), 0.0025));
            });
            group.bench_function("parry", |b| {
                b.iter(|| query::distance(&Pose::IDENTITY, &parry, &parry_pose(&pose()), &**parry_solid));
            });
            group.finish();
        }
    }
    println!(
        "grid: {fresh} bytes when made, {} after these queries, spacing {:.2} mm",
        surface.grid_bytes(),
        surface.grid_spacing() * 1e3
    );
}

criterion_group!(benches, distance);
criterion_main!(benches);
