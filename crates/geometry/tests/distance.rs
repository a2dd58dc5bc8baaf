//! Signed distances: beside exact ones (`oracle/distances.py`), the grid beside them, signs on scans with holes.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use prehend_geometry::{Collider, MeshFormat, Solid, Surface, TriMesh, inspect, read_mesh, repair};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;

#[derive(Deserialize)]
struct Oracle {
    vertices: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    points: Vec<Measured>,
}

#[derive(Deserialize)]
struct Measured {
    point: [f64; 3],
    distance: f64,
}

fn oracle() -> (Surface, Vec<Measured>) {
    let oracle: Oracle = serde_json::from_str(include_str!("oracle/distances.json")).unwrap();
    let vertices = oracle.vertices.into_iter().map(Point3::from).collect();
    (
        Surface::new(TriMesh::new(vertices, oracle.triangles).unwrap()),
        oracle.points,
    )
}

#[test]
fn signed_distances_of_points_and_balls_agree_with_exact_arithmetic() {
    let (bar, points) = oracle();
    let ball = Collider::new(&Solid::Sphere { radius: 0.003 }).unwrap();
    for Measured { point, distance } in points {
        let p = Point3::from(point);
        assert!(
            (bar.signed_distance(&p) - distance).abs() < 1e-15,
            "{p}: {distance}"
        );
        let at = Isometry3::translation(p.x, p.y, p.z);
        assert!(
            (bar.signed_gap(&ball, &at, 1e-4) - (distance - 0.003)).abs() < 1e-15,
            "{p}"
        );
        let bounds = bar.gap_bounds(&ball, &at);
        assert!(
            bounds.low <= distance - 0.003 && distance - 0.003 <= bounds.high,
            "{p}: {bounds:?}"
        );
    }
}

#[test]
fn signed_gaps_of_capsules_and_convex_pieces_are_the_least_over_their_points() {
    let (bar, _) = oracle();
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let half = Vector3::new(0.004, 0.006, 0.008);
    let corners: Vec<_> = (0..8)
        .map(|i| {
            Point3::from(Vector3::from_fn(
                |k, _| if i >> k & 1 == 1 { half[k] } else { -half[k] },
            ))
        })
        .collect();
    let solids = [
        (
            Solid::Capsule {
                half_length: 0.008,
                radius: 0.002,
            },
            Vector3::new(0.0, 0.0, 0.008),
            0.002,
        ),
        (Solid::Cuboid { half_extents: half }, half, 0.0),
        (Solid::Hull(std::sync::Arc::new(corners)), half, 0.0),
    ];
    let tolerance = 2e-4;
    let mut n_inside = 0;
    for (solid, half, radius) in solids {
        let collider = Collider::new(&solid).unwrap();
        for _ in 0..25 {
            let mut random = |low: f64, high: f64| rng.random_range(low..high);
            let at = Vector3::new(random(-0.01, 0.07), random(-0.01, 0.055), random(-0.02, 0.035));
            let turn = UnitQuaternion::from_scaled_axis(Vector3::from_fn(|_, _| random(-3.0, 3.0)));
            let pose = Isometry3::from_parts(at.into(), turn);
            // A grid of the core's points: their spacing bounds what it misses.
            let n = half.map(|h| if h > 0.0 { 12_i32 } else { 0 });
            let mut least = f64::INFINITY;
            let step = half.z / 12.0;
            for i in -n.x..=n.x {
                for j in -n.y..=n.y {
                    let mut k = -n.z;
                    while k <= n.z {
                        let share = Vector3::new(i, j, k).map(|i| f64::from(i) / 12.0);
                        let distance =
                            bar.signed_distance(&(pose * Point3::from(share.component_mul(&half))));
                        least = least.min(distance);
                        // Distances fall by no more than the way: points before that cannot be the least.
                        k += 1 + ((distance - least) / step).floor() as i32;
                    }
                }
            }
            let missed = half.norm() / 12.0;
            let gap = bar.signed_gap(&collider, &pose, tolerance);
            let over = gap + radius - least;
            assert!(
                over < tolerance + 1e-9 && over > -missed,
                "{solid:?} {pose}: {gap} {least}"
            );
            let bounds = bar.gap_bounds(&collider, &pose);
            assert!(
                bounds.low <= gap + 1e-9 && gap - tolerance <= bounds.high,
                "{solid:?}: {bounds:?} {gap}"
            );
            n_inside += usize::from(gap < -0.001);
        }
    }
    assert!((10..65).contains(&n_inside), "both cases are seen: {n_inside}");
}

/// Points within twice the grid's spacing of a surface, and points anywhere around it.
fn points_around(surface: &Surface, n: usize) -> [Vec<Point3<f64>>; 2] {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let (low, high) = surface.axis_aligned_bounds();
    let reach = surface.grid_spacing() * 2.0 / 3.0_f64.sqrt();
    let near = (0..n).map(|_| {
        let [a, b, c] = surface
            .mesh()
            .triangle(rng.random_range(0..surface.mesh().n_triangles()));
        let (u, v): (f64, f64) = (rng.random(), rng.random());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        a + (b - a) * u + (c - a) * v + Vector3::from_fn(|_, _| rng.random_range(-reach..reach))
    });
    let near = near.collect();
    let around =
        (0..n).map(|_| low + Vector3::from_fn(|k, _| rng.random_range(-0.6..1.6) * (high[k] - low[k])));
    [near, around.collect()]
}

/// The stated bound holds everywhere, with its stated size in the band; sides are those of the sum over all triangles.
fn check(name: &str, surface: &Surface) {
    let (low, high) = surface.axis_aligned_bounds();
    let [near, around] = points_around(surface, 1500);
    let mut n_looked_up = 0;
    for (i, p) in near.iter().chain(&around).enumerate() {
        let exact = surface.signed_distance(p);
        let found = surface.estimated_distance(p);
        let off = (found.distance - exact).abs();
        assert!(
            off <= found.error + 1e-12,
            "{name} {p}: {found:?}, exactly {exact}"
        );
        assert!(
            surface.distance_lower_bound(p) <= exact.abs() + 1e-12,
            "{name} {p}"
        );
        if i < near.len() {
            let bound = 0.75_f64.sqrt() * surface.grid_spacing();
            assert!(found.error <= bound * 1.0001, "{name} {p}: {found:?}");
            n_looked_up += usize::from(found.error == 0.0);
        }
        if i % 10 == 0 {
            let within = (0..3).all(|k| p[k] >= low[k] && p[k] <= high[k]);
            let inside = within && surface.winding_number(p).abs() > 0.5;
            assert_eq!(surface.is_inside(p), inside, "{name} {p}");
        }
    }
    assert!(n_looked_up < near.len() / 3, "{name}: {n_looked_up} looked up");
}

fn load(path: &str) -> Surface {
    let format = if path.ends_with("obj") {
        MeshFormat::Obj
    } else {
        MeshFormat::Ply
    };
    Surface::new(repair(read_mesh(&std::fs::read(path).unwrap(), format).unwrap()).0)
}

#[test]
fn the_grid_is_no_farther_off_than_it_says_on_closed_objects() {
    check("bar", &oracle().0);
    check(
        "hammer",
        &load(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../objects/hammer/claw_hammer.ply"
        )),
    );
}

#[test]
fn the_grid_is_no_farther_off_than_it_says_and_sides_are_right_on_scans_with_holes() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/objects");
    for (name, middle_is_inside) in [
        ("bottle/ycb_006_mustard_bottle", true),
        ("mug/ycb_025_mug", false),
        ("bottle/psb_m482", true),
    ] {
        let path = format!("{folder}/{name}.obj");
        if !std::path::Path::new(&path).exists() {
            eprintln!("skipped: distances to {name} needs ../shared/data");
            continue;
        }
        let surface = load(&path);
        assert!(!inspect(surface.mesh()).watertight, "{name} is open");
        check(name, &surface);
        let (low, high) = surface.axis_aligned_bounds();
        let middle = nalgebra::center(&low, &high);
        assert_eq!(surface.is_inside(&middle), middle_is_inside, "{name}");
    }
}
