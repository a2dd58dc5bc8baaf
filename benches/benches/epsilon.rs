//! ε of random contacts on a ball (μ 0.5, 8 edges; 60 sets a size) and of evenly spread ones, and what it is made of.
//!
//! Writes the wrenches of every set to `target/epsilon-inputs.jsonl`, for `benches/peers/epsilon.py` to time Qhull on.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use faer::linalg::solvers::Solve;
use nalgebra::{Matrix6, Point3, Vector3, Vector6};
use prehend::quality::{ConeShape, Contact, EpsilonSolver, GraspWrenchSpace, Norm, QualityOptions, epsilon};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SIZES: [usize; 5] = [4, 8, 12, 16, 20];

fn options() -> QualityOptions {
    QualityOptions::new(Point3::origin(), 1.0)
}

fn contact(i: usize, z: f64, turn: f64) -> Contact {
    let r = (1.0 - z * z).sqrt();
    let out = Vector3::new(r * turn.cos(), r * turn.sin(), z);
    Contact::new(i, Point3::from(out), -out, 0.5, 0.0).expect("a unit normal")
}

/// Spread over the unit ball by the golden angle, normals inwards.
fn even(n: usize) -> Vec<Contact> {
    let at = |i| {
        contact(
            i,
            1.0 - (2 * i + 1) as f64 / n as f64,
            i as f64 * 2.399_963_229_728_653,
        )
    };
    (0..n).map(at).collect()
}

/// 60 random sets that hold the ball, or that do not.
fn random(n: usize, holding: bool) -> Vec<Vec<Contact>> {
    let mut rng = ChaCha8Rng::seed_from_u64(n as u64);
    let mut sets = Vec::new();
    while sets.len() < 60 {
        let mut one = |i| {
            contact(
                i,
                rng.random_range(-1.0..1.0),
                rng.random_range(0.0..std::f64::consts::TAU),
            )
        };
        let set: Vec<Contact> = (0..n).map(&mut one).collect();
        let space = GraspWrenchSpace::new(&set, &options()).expect("sound contacts");
        if (epsilon(&space).expect("few facets") > 0.0) == holding {
            sets.push(set);
        }
    }
    sets
}

fn spaces(sets: &[Vec<Contact>], options: &QualityOptions) -> Vec<GraspWrenchSpace> {
    let space = |set: &Vec<Contact>| GraspWrenchSpace::new(set, options).expect("sound contacts");
    sets.iter().map(space).collect()
}

/// Runs `work` on one item after the other, round and round: the mean over all of them.
fn cycle<T>(b: &mut criterion::Bencher<'_>, items: &[T], mut work: impl FnMut(&T) -> f64) {
    let mut next = 0;
    b.iter(|| {
        next = (next + 1) % items.len();
        work(black_box(&items[next]))
    });
}

fn exact(c: &mut Criterion) {
    let mut inputs = String::new();
    let mut solver = EpsilonSolver::default();
    let mut group = c.benchmark_group("epsilon");
    for n in SIZES {
        let sets = random(n, true);
        for (kind, spaces) in [
            ("random", spaces(&sets, &options())),
            ("even", spaces(&[even(n)], &options())),
        ] {
            for space in &spaces {
                let wrenches: Vec<[f64; 6]> = space.wrenches().iter().map(|w| (*w).into()).collect();
                let epsilon = solver.epsilon(space).expect("few facets");
                let line = serde_json::json!({
                    "kind": kind, "contacts": n, "edges": 8, "epsilon": epsilon, "wrenches": wrenches,
                });
                writeln!(inputs, "{line}").expect("strings take all");
            }
            group.bench_function(BenchmarkId::new(kind, format!("{n}x8")), |b| {
                cycle(b, &spaces, |s| solver.epsilon(s).expect("few facets"));
            });
        }
        group.bench_function(BenchmarkId::new("random, from contacts", format!("{n}x8")), |b| {
            cycle(b, &sets, |s| {
                solver.epsilon_of(s, &options()).expect("few facets")
            });
        });
    }
    group.finish();
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../target/epsilon-inputs.jsonl");
    std::fs::create_dir_all(concat!(env!("CARGO_MANIFEST_DIR"), "/../target")).expect("target can be made");
    std::fs::write(path, inputs).expect("target can be written");
}

fn others(c: &mut Criterion) {
    let mut solver = EpsilonSolver::default();
    let mut group = c.benchmark_group("epsilon/other");
    let loose = spaces(&random(4, false), &options());
    group.bench_function("no force closure, 4x8", |b| {
        cycle(b, &loose, |s| solver.epsilon(s).expect("few facets"));
    });
    let sets = random(8, true);
    let held = spaces(&sets, &options());
    for bound in [0.05, 0.3] {
        group.bench_function(format!("at least {bound}, 8x8"), |b| {
            cycle(b, &held, |s| {
                f64::from(u8::from(solver.epsilon_at_least(s, bound).expect("few facets")))
            });
        });
    }
    group.bench_function("within 0.01, 8x8", |b| {
        cycle(b, &held, |s| {
            solver.epsilon_within(s, 0.01).expect("few facets").lower
        });
    });
    let variants = [
        (
            "smooth to 1e-4, 8",
            QualityOptions {
                cone: ConeShape::Smooth,
                ..options()
            },
        ),
        (
            "32 edges, 8x32",
            QualityOptions {
                cone: ConeShape::Edges(32),
                ..options()
            },
        ),
    ];
    for (name, options) in variants {
        let spaces = spaces(&sets, &options);
        group.bench_function(name, |b| {
            cycle(b, &spaces, |s| solver.epsilon(s).expect("few facets"));
        });
    }
    let sum = QualityOptions {
        norm: Norm::LInf,
        ..options()
    };
    let sums = spaces(&random(4, true), &sum);
    group.bench_function("sum of cones, 4x8", |b| {
        cycle(b, &sums, |s| solver.epsilon(s).expect("few facets"));
    });
    group.finish();
}

/// The plane 1 = y · w through six points: the linear system that a textbook hull solves for every facet.
type PlaneOf = fn(&[Vector6<f64>; 6]) -> Option<Vector6<f64>>;

fn plane_by_nalgebra(points: &[Vector6<f64>; 6]) -> Option<Vector6<f64>> {
    Matrix6::from_columns(points)
        .transpose()
        .lu()
        .solve(&Vector6::repeat(1.0))
}

fn plane_by_faer(points: &[Vector6<f64>; 6]) -> Option<Vector6<f64>> {
    let rows = faer::Mat::from_fn(6, 6, |r, c| points[r][c]);
    let solution = rows.partial_piv_lu().solve(faer::Mat::<f64>::full(6, 1, 1.0));
    let plane = Vector6::from_fn(|k, _| solution[(k, 0)]);
    plane.iter().all(|c| c.is_finite()).then_some(plane)
}

/// The same lazy growth as the crate's, written as plainly as it goes: planes by a solve, visible facets by looking at
/// all, the horizon by counting ridges. The origin must lie inside the first simplex.
fn plain_epsilon(wrenches: &[Vector6<f64>], simplex: &[Vector6<f64>], plane_of: PlaneOf) -> f64 {
    let mut points = simplex.to_vec();
    let mut facets: Vec<([usize; 6], Vector6<f64>)> = Vec::new();
    let add = |points: &[Vector6<f64>], corners: [usize; 6], facets: &mut Vec<_>| {
        if let Some(plane) = plane_of(&corners.map(|c| points[c])) {
            facets.push((corners, plane));
        }
    };
    for left_out in 0..7 {
        add(
            &points,
            std::array::from_fn(|i| i + usize::from(i >= left_out)),
            &mut facets,
        );
    }
    // 1/|y| is the distance of the plane y · w = 1.
    while let Some((_, plane)) = facets
        .iter()
        .max_by(|a, b| a.1.norm_squared().total_cmp(&b.1.norm_squared()))
    {
        let plane = *plane;
        let best = wrenches
            .iter()
            .max_by(|a, b| plane.dot(a).total_cmp(&plane.dot(b)));
        let Some(best) = best.filter(|w| plane.dot(w) > 1.0 + 1e-12) else {
            return 1.0 / plane.norm();
        };
        points.push(*best);
        let mut ridges: BTreeMap<[usize; 5], u32> = BTreeMap::new();
        facets.retain(|(corners, plane)| {
            let seen = plane.dot(best) > 1.0 + 1e-13;
            if seen {
                for skip in 0..6 {
                    let ridge = std::array::from_fn(|i| corners[i + usize::from(i >= skip)]);
                    *ridges.entry(ridge).or_insert(0) += 1;
                }
            }
            !seen
        });
        for (ridge, _) in ridges.into_iter().filter(|(_, count)| *count == 1) {
            let corners = std::array::from_fn(|i| if i < 5 { ridge[i] } else { points.len() - 1 });
            add(&points, corners, &mut facets);
        }
    }
    0.0
}

/// Seven wrenches of the set round the origin, found by trying; sets where that takes long are left out.
fn round_the_origin(wrenches: &[Vector6<f64>], rng: &mut ChaCha8Rng) -> Option<Vec<Vector6<f64>>> {
    (0..20_000).find_map(|_| {
        let chosen: Vec<Vector6<f64>> = (0..7)
            .map(|_| wrenches[rng.random_range(0..wrenches.len())])
            .collect();
        let lifted = nalgebra::SMatrix::<f64, 7, 7>::from_fn(|r, c| if r < 6 { chosen[c][r] } else { 1.0 });
        let mut one = nalgebra::SVector::<f64, 7>::zeros();
        one[6] = 1.0;
        let weights = lifted.lu().solve(&one)?;
        weights.iter().all(|&w| w > 1e-3).then_some(chosen)
    })
}

/// The wrenches of a set, and seven of them round the origin.
type Started = (Vec<Vector6<f64>>, Vec<Vector6<f64>>);

fn kernels(c: &mut Criterion) {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let cases: Vec<Started> = spaces(&random(4, true), &options())
        .iter()
        .filter_map(|s| Some((s.wrenches().to_vec(), round_the_origin(s.wrenches(), &mut rng)?)))
        .collect();
    let mut group = c.benchmark_group("epsilon/plain hull, 4x8");
    let kernels: [(&str, PlaneOf); 2] = [("faer", plane_by_faer), ("nalgebra", plane_by_nalgebra)];
    for (name, plane_of) in kernels {
        group.bench_function(name, |b| cycle(b, &cases, |(w, s)| plain_epsilon(w, s, plane_of)));
    }
    group.finish();
    let mut group = c.benchmark_group("epsilon/one plane");
    for (name, plane_of) in kernels {
        group.bench_function(name, |b| {
            cycle(b, &cases, |(_, s)| {
                plane_of(&std::array::from_fn(|i| s[i])).map_or(0.0, |p| p[0])
            });
        });
    }
    group.finish();
}

criterion_group!(benches, exact, others, kernels);
criterion_main!(benches);
