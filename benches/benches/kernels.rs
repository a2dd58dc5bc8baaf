//! Boxes, ε, one hand's tries on one object, and answers of a trained model, on the bundled data.

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{Point3, Vector3};
use prehend::ObjectOptions;
use prehend::geometry::{DecomposeOptions, OrientedBox, Tetrahedron, decompose, minimum_volume_box};
use prehend::grasp::{SynthesisOptions, synthesize};
use prehend::quality::{Contact, EpsilonSolver, GraspWrenchSpace, QualityOptions};
use prehend::stages::decompose::{Shape, shape_of};
use prehend::stages::synthesize::HandData;

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

fn mug() -> Shape {
    shape_of(
        &root().join("objects/mug/coffee_mug.ply"),
        ObjectOptions::default(),
    )
    .expect("the bundled mug is there")
}

/// `n` contacts spread over a unit ball by the golden angle, normals inwards.
fn contacts(n: usize) -> Vec<Contact> {
    let at = |i: usize| {
        let z = 1.0 - (2 * i + 1) as f64 / n as f64;
        let turn = i as f64 * 2.399_963_229_728_653;
        let r = (1.0 - z * z).sqrt();
        Vector3::new(r * turn.cos(), r * turn.sin(), z)
    };
    let contact = |i| Contact::new(i, Point3::from(at(i)), -at(i), 0.5, 0.0).expect("a unit normal");
    (0..n).map(contact).collect()
}

fn geometry(c: &mut Criterion) {
    let mesh = mug().object.mesh;
    c.bench_function("minimum_volume_box/coffee_mug", |b| {
        b.iter(|| minimum_volume_box(black_box(mesh.vertices())));
    });
    let mut slow = c.benchmark_group("decompose");
    slow.sample_size(20);
    slow.bench_function("coffee_mug", |b| {
        b.iter(|| decompose(black_box(&mesh), &DecomposeOptions::default()));
    });
    slow.finish();
    let region = OrientedBox::centered([0.1, 0.08, 0.12]);
    let corners = [
        [0.1, 0.0, 0.02],
        [-0.03, 0.05, 0.0],
        [-0.02, -0.06, 0.01],
        [0.0, 0.01, 0.09],
    ];
    let enclosure = Tetrahedron(corners.map(Point3::from));
    c.bench_function("tetrahedron_in_box", |b| {
        b.iter(|| black_box(&enclosure).intersection_volume(black_box(&region)));
    });
}

fn quality(c: &mut Criterion) {
    let options = QualityOptions::new(Point3::origin(), 1.0);
    for n in [4, 8, 12] {
        let space = GraspWrenchSpace::new(&contacts(n), &options).expect("sound contacts");
        let mut solver = EpsilonSolver::default();
        c.bench_function(&format!("epsilon/{n}x8"), |b| {
            b.iter(|| solver.epsilon(black_box(&space)));
        });
    }
}

fn grasp(c: &mut Criterion) {
    let object = mug().grasp_object().expect("the mug can be grasped");
    let mut group = c.benchmark_group("synthesize/100_tries");
    group.sample_size(10);
    for name in ["human", "schunk_sdh"] {
        let hand = HandData::read(&root().join("hands").join(name)).expect("the bundled hands are there");
        let options = SynthesisOptions {
            tries: 100,
            seed: 1,
            ..SynthesisOptions::default()
        };
        group.bench_function(name, |b| {
            b.iter(|| synthesize(&hand.hand, &object, &options, &|_| true));
        });
    }
    group.finish();
}

criterion_group!(kernels, geometry, quality, grasp);
criterion_main!(kernels);
