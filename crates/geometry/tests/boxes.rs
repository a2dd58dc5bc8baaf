//! Smallest boxes and hulls: beside other programs' numbers, and the laws that they obey on generated input.

use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::{Point3, UnitQuaternion, Vector3};
use prehend_geometry::{MeshFormat, MinimumBox, convex_hull, minimum_volume_box, read_mesh};
use proptest::prelude::*;
use serde_json::Value;

/// A generated shape, and what the programs named in `oracle/boxes.py` found for it.
struct Shape {
    family: String,
    points: Vec<Point3<f64>>,
    hull_volume: f64,
    least: f64,
}

fn shapes() -> Vec<Shape> {
    let table: Value = serde_json::from_str(include_str!("oracle/boxes.json")).unwrap();
    let rows = table["shapes"].as_array().unwrap().iter();
    rows.map(|row| {
        let numbers = row["points"].as_array().unwrap();
        let numbers: Vec<f64> = numbers.iter().map(|x| x.as_f64().unwrap()).collect();
        Shape {
            family: row["family"].as_str().unwrap().to_owned(),
            points: numbers.chunks(3).map(|p| Point3::new(p[0], p[1], p[2])).collect(),
            hull_volume: row["hull_volume"].as_f64().unwrap(),
            least: row["best"].as_f64().unwrap(),
        }
    })
    .collect()
}

fn volume(points: &[Point3<f64>]) -> f64 {
    minimum_volume_box(points).unwrap().volume()
}

fn encloses(smallest: &MinimumBox, points: &[Point3<f64>], rounding: f64) -> bool {
    points.iter().all(|p| {
        let local = smallest.axes.inverse() * (p - smallest.center);
        (0..3).all(|k| local[k].abs() <= smallest.extents[k] / 2.0 + rounding)
    })
}

/// The issue asks for 1e-3 on every shape and 2e-4 on average.
#[test]
fn boxes_are_as_small_as_the_smallest_that_any_program_found() {
    let shapes = shapes();
    assert_eq!(shapes.len(), 60);
    let mut sum = 0.0;
    for shape in &shapes {
        let excess = volume(&shape.points) / shape.least - 1.0;
        assert!(
            excess < 1e-6,
            "{}: {excess:e} above {}",
            shape.family,
            shape.least
        );
        sum += excess.max(0.0);
    }
    assert!(sum / 60.0 < 1e-7, "{}", sum / 60.0);
}

/// The mesh files below a folder; none where it is absent.
fn mesh_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .map(|entry| entry.path())
        .flat_map(|path| {
            if path.is_dir() {
                mesh_files(&path)
            } else {
                vec![path]
            }
        })
        .collect()
}

#[test]
fn boxes_of_objects_are_as_small_as_the_smallest_that_any_program_found() {
    let table: Value = serde_json::from_str(include_str!("oracle/box_objects.json")).unwrap();
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let mut files = mesh_files(&root.join("objects"));
    let shared = mesh_files(&root.join("../shared/data/objects"));
    if shared.is_empty() {
        eprintln!("skipped: boxes of the shared objects needs ../shared/data");
    }
    files.extend(shared);
    let mut excesses = Vec::new();
    for path in files {
        let name = path.file_name().unwrap().to_string_lossy();
        let Some(least) = table["objects"][&*name]["best"].as_f64() else {
            continue;
        };
        let format = path
            .extension()
            .and_then(|e| MeshFormat::from_extension(e.to_str()?));
        let mesh = read_mesh(&fs::read(&path).unwrap(), format.unwrap()).unwrap();
        let excess = volume(mesh.vertices()) / least - 1.0;
        assert!(excess < 1e-3, "{name}: {excess:e}");
        excesses.push(excess.max(0.0));
    }
    assert!(excesses.len() >= 25);
    let mean = excesses.iter().sum::<f64>() / excesses.len() as f64;
    assert!(mean < 2e-4, "{mean:e}");
}

#[test]
fn hulls_have_the_volumes_that_qhull_finds_and_hold_every_point() {
    for shape in shapes() {
        let hull = convex_hull(&shape.points).unwrap();
        let size = shape.points.iter().map(|p| p.coords.amax()).fold(0.0, f64::max);
        let error = (hull.volume() - shape.hull_volume).abs();
        assert!(error < 1e-9 * size * size * size, "{}: {error:e}", shape.family);
        for t in hull.triangles() {
            let [a, b, c] = t.map(|i| hull.points()[i as usize]);
            let normal = (b - a).cross(&(c - a));
            if normal.norm() < 1e-9 * size * size {
                // The normal of a sliver is rounding.
                continue;
            }
            let outside = |p: &Point3<f64>| normal.normalize().dot(&(p - a));
            assert!(
                shape.points.iter().all(|p| outside(p) < 1e-9 * size),
                "{}",
                shape.family
            );
        }
    }
}

#[test]
fn a_regular_tetrahedron_and_an_octahedron_need_the_known_volumes() {
    let cube = [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
    assert!((volume(&cube.map(Point3::from)) - 1.0).abs() < 1e-12);
    let octahedron: Vec<Point3<f64>> = (0..3)
        .flat_map(|k| [1.0, -1.0].map(|s| Point3::from(Vector3::ith(k, s))))
        .collect();
    assert!((volume(&octahedron) * 27.0 / 64.0 - 1.0).abs() < 1e-9);
}

#[test]
fn flat_straight_and_repeated_points_give_boxes_without_volume() {
    let turn = UnitQuaternion::from_euler_angles(0.4, 1.1, -0.7);
    let flat: Vec<Point3<f64>> = (0..40)
        .map(|i| f64::from(i) * 0.7)
        .map(|a| turn * Point3::new(a.sin() + 0.1 * a, (1.3 * a).cos(), 0.0))
        .collect();
    let straight: Vec<Point3<f64>> = (0..9)
        .map(|i| turn * Point3::new(f64::from(i * i), 0.0, 0.0))
        .collect();
    // So many corners that neighbours on the outline give no normal to rely on.
    let wheel: Vec<Point3<f64>> = (0..100_000)
        .map(|i| f64::from(i) * 1e-4)
        .map(|a| turn * Point3::new(a.sin(), a.cos(), 0.0))
        .collect();
    let single = vec![turn * Point3::new(3.0, 2.0, 1.0); 5];
    for (points, rank) in [(flat, 2), (wheel, 2), (straight, 1), (single, 0)] {
        let smallest = minimum_volume_box(&points).unwrap();
        assert_eq!(smallest.volume(), 0.0);
        assert_eq!(smallest.extents.iter().filter(|e| **e > 0.0).count(), rank);
        assert!(encloses(&smallest, &points, 1e-12));
    }
}

#[test]
fn hard_clouds_get_finite_boxes_around_them() {
    let spread = |i: u32, salt: f64| (f64::from(i) * (0.618_034 + 0.1 * salt) + salt).sin();
    let cloud = |n: u32, scale: [f64; 3], shift: f64| -> Vec<Point3<f64>> {
        let at =
            |i| Vector3::from_fn(|k, _| scale[k] * spread(i, k as f64 * 1.7 + f64::from(i % 97)) + shift);
        (0..n).map(|i| at(i).into()).collect()
    };
    let mut doubled = cloud(50, [1.0; 3], 0.0);
    doubled.extend_from_within(..);
    let clouds = [
        doubled,
        cloud(200, [1.0, 1.0, 1e-12], 0.0),
        cloud(200, [1.0, 1e-12, 1e-12], 0.0),
        cloud(200, [1.0, 0.7, 1e-8], 0.0),
        cloud(200, [1.0; 3], 1e9),
        cloud(200, [1e9, 2e9, 3e8], 0.0),
        cloud(1_000_000, [1.0, 0.5, 0.2], 0.0),
    ];
    for points in clouds {
        let size = points.iter().map(|p| p.coords.amax()).fold(0.0, f64::max);
        let smallest = minimum_volume_box(&points).unwrap();
        assert!(smallest.extents.iter().all(|e| e.is_finite()) && smallest.center.coords.amax().is_finite());
        assert!(encloses(&smallest, &points, 1e-9 * size));
    }
}

fn cloud() -> impl Strategy<Value = Vec<Point3<f64>>> {
    let point = [-1.0..1.0, -1.0..1.0, -1.0..1.0];
    (
        prop::collection::vec(point, 4..60),
        [0.05..1.0, 0.05..1.0, 0.05..1.0],
    )
        .prop_map(|(points, scale)| {
            let scaled = |p: [f64; 3]| Point3::from(Vector3::from(p).component_mul(&Vector3::from(scale)));
            points.into_iter().map(scaled).collect()
        })
}

fn rotation() -> impl Strategy<Value = UnitQuaternion<f64>> {
    [-3.0..3.0, -3.0..3.0, -3.0..3.0].prop_map(|v| UnitQuaternion::from_scaled_axis(Vector3::from(v)))
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: proptest::test_runner::RngSeed::Fixed(11), ..ProptestConfig::default() })]

    #[test]
    fn a_box_holds_its_points_and_touches_them_on_all_sides(points in cloud()) {
        let smallest = minimum_volume_box(&points).unwrap();
        prop_assert!(encloses(&smallest, &points, 1e-12));
        prop_assert!(!encloses(&smallest, &points, -1e-9));
        prop_assert_eq!(minimum_volume_box(&points).unwrap(), smallest);
    }

    #[test]
    fn turning_scaling_shuffling_and_moving_leave_the_volume_as_it_is(
        points in cloud(),
        turn in rotation(),
        scale in 1e-3..1e3,
        shift in [-1000.0..1000.0, -1000.0..1000.0, -1000.0..1000.0],
        first in 0_usize..60,
    ) {
        let before = volume(&points);
        let shift = Vector3::from(shift);
        let mut moved: Vec<Point3<f64>> = points.iter().map(|p| turn * (p * scale)).collect();
        let start = first % moved.len();
        moved.rotate_left(start);
        moved.swap(0, start);
        let after = volume(&moved) / (scale * scale * scale);
        prop_assert!((after / before - 1.0).abs() < 1e-6, "{before:e} {after:e}");
        let away: Vec<Point3<f64>> = points.iter().map(|p| turn * p + shift).collect();
        prop_assert!((volume(&away) / before - 1.0).abs() < 1e-6);
    }

    #[test]
    fn the_box_of_a_cuboid_is_that_cuboid(
        lengths in [0.1..1.0, 0.1..1.0, 0.1..1.0],
        turn in rotation(),
    ) {
        let corner = |i: u32| Vector3::from_fn(|k, _| lengths[k] * (f64::from(i >> k & 1) - 0.5));
        let corners: Vec<Point3<f64>> = (0..8).map(|i| turn * Point3::from(corner(i))).collect();
        let smallest = minimum_volume_box(&corners).unwrap();
        let mut found: [f64; 3] = smallest.extents.into();
        let mut expected = lengths;
        found.sort_by(f64::total_cmp);
        expected.sort_by(f64::total_cmp);
        for (f, e) in found.iter().zip(expected) {
            prop_assert!((f - e).abs() < 1e-9);
        }
        let cosines = smallest.axes.matrix().transpose() * turn.to_rotation_matrix().matrix();
        prop_assert!((0..3).all(|k| cosines.column(k).amax() > 1.0 - 1e-9));
    }

    #[test]
    fn a_prism_turned_about_its_axis_keeps_its_size(n_sides in 5_u32..40, turn in 0.0..7.0) {
        let prism = |turn: f64| -> Vec<Point3<f64>> {
            let at = |i: u32| std::f64::consts::TAU * f64::from(i) / f64::from(n_sides) + turn;
            let ring = |z: f64| (0..n_sides).map(move |i| Point3::new(at(i).cos(), at(i).sin(), z));
            ring(0.0).chain(ring(3.0)).collect()
        };
        let (still, turned) = (minimum_volume_box(&prism(0.0)).unwrap(), minimum_volume_box(&prism(turn)).unwrap());
        prop_assert!((still.extents.z - 3.0).abs() < 1e-12 && (turned.extents.z - 3.0).abs() < 1e-12);
        prop_assert!((still.volume() / turned.volume() - 1.0).abs() < 1e-6);
    }
}
