//! Volumes that tetrahedra share with boxes: grasps of the bundled hands on bundled objects, and random pairs.

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Point3;
use prehend::ObjectOptions;
use prehend::geometry::{OrientedBox, Tetrahedron, largest_tetrahedron, union_volume};
use prehend::grasp::{SynthesisOptions, synthesize};
use prehend::stages::decompose::shape_of;
use prehend::stages::synthesize::HandData;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A grasp's tetrahedron, its contacts with the palm first, and the boxes of its object.
struct Grasped {
    enclosure: Tetrahedron,
    palm_and_contacts: Vec<Point3<f64>>,
    boxes: Vec<OrientedBox>,
}

/// Grasps of both bundled hands on one object of each kind, seed 1.
fn grasps() -> Vec<Grasped> {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let options = SynthesisOptions {
        tries: 300,
        seed: 1,
        ..SynthesisOptions::default()
    };
    let mut all = Vec::new();
    for object in [
        "mug/coffee_mug",
        "hammer/claw_hammer",
        "bottle/handled_jug",
        "glass/wine_glass",
    ] {
        let path = root.join("objects").join(object).with_extension("ply");
        let shape = shape_of(&path, ObjectOptions::default()).expect("the bundled objects are there");
        let object = shape.grasp_object().expect("they can be grasped");
        for name in ["human", "schunk_sdh"] {
            let hand = HandData::read(&root.join("hands").join(name))
                .expect("the bundled hands are there")
                .hand;
            let found = synthesize(&hand, &object, &options, &|_| true).expect("the hand fits");
            for grasp in found.grasps {
                let palm = grasp.object_from_root * hand.root_from_palm(&grasp.joints);
                let contacts: Vec<_> = grasp.contacts.iter().map(|c| c.at.point).collect();
                let palm = Point3::from(palm.translation.vector);
                if let Some(enclosure) = largest_tetrahedron(palm, &contacts) {
                    all.push(Grasped {
                        enclosure,
                        palm_and_contacts: [vec![palm], contacts].concat(),
                        boxes: object.leaves().to_vec(),
                    });
                }
            }
        }
    }
    all
}

fn volumes(c: &mut Criterion) {
    let grasps = grasps();
    let pairs: Vec<(Tetrahedron, OrientedBox)> = grasps
        .iter()
        .flat_map(|g| g.boxes.iter().map(|b| (g.enclosure, *b)))
        .collect();
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let unit = OrientedBox::centered([1.0; 3]);
    let random: Vec<(Tetrahedron, OrientedBox)> = (0..2000)
        .map(|_| {
            let corner = |_| Point3::from([(); 3].map(|()| rng.random_range(-1.0..1.0)));
            (Tetrahedron([0; 4].map(corner)), unit)
        })
        .collect();
    // The same with the fourth corner brought near the plane of the others.
    let flattened = |share: f64| -> Vec<(Tetrahedron, OrientedBox)> {
        let flat = |(t, unit): &(Tetrahedron, OrientedBox)| {
            let [a, b, c, d] = t.0;
            let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
            (Tetrahedron([a, b, c, middle + (d - middle) * share]), *unit)
        };
        random.iter().map(flat).collect()
    };
    let (flat, very_flat) = (flattened(1e-3), flattened(1e-6));
    println!("{} grasps, {} pairs", grasps.len(), pairs.len());
    for (name, pairs) in [
        ("grasps_and_boxes", &pairs),
        ("random_and_unit_box", &random),
        ("flat_and_unit_box", &flat),
        ("very_flat_and_unit_box", &very_flat),
    ] {
        c.bench_function(&format!("intersection_volume/{name}/{}", pairs.len()), |b| {
            let mut next = pairs.iter().cycle();
            b.iter(|| {
                let (tetrahedron, oriented_box) = next.next().expect("cycles do not end");
                black_box(tetrahedron).intersection_volume(black_box(oriented_box))
            });
        });
    }
    c.bench_function("union_volume/grasps", |b| {
        let mut next = grasps.iter().cycle();
        b.iter(|| {
            let grasp = next.next().expect("cycles do not end");
            black_box(&grasp.enclosure).union_volume(black_box(&grasp.boxes))
        });
    });
    c.bench_function("union_volume/boxes", |b| {
        b.iter(|| union_volume(black_box(&grasps[0].boxes)));
    });
    c.bench_function("largest_tetrahedron/grasps", |b| {
        let mut next = grasps.iter().cycle();
        b.iter(|| {
            let points = &next.next().expect("cycles do not end").palm_and_contacts;
            largest_tetrahedron(black_box(points[0]), black_box(&points[1..]))
        });
    });
    let contacts: Vec<_> = random.iter().take(10).flat_map(|(t, _)| t.0).collect();
    c.bench_function("largest_tetrahedron/40_contacts", |b| {
        b.iter(|| largest_tetrahedron(black_box(Point3::origin()), black_box(&contacts)));
    });
}

criterion_group!(benches, volumes);
criterion_main!(benches);
