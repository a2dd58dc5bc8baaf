//! Boxes of the bundled hammer, mug and glass: the paper's, and refined ones.

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use prehend::ObjectOptions;
use prehend::geometry::{DecomposeMethod, DecomposeOptions, decompose};
use prehend::stages::decompose::shape_of;

fn decomposition(c: &mut Criterion) {
    let objects = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../objects"));
    let mut group = c.benchmark_group("decomposition");
    group.sample_size(10);
    for name in ["hammer/claw_hammer", "mug/coffee_mug", "glass/wine_glass"] {
        let path = objects.join(format!("{name}.ply"));
        let shape = shape_of(&path, ObjectOptions::default()).expect("the bundled objects are there");
        for (how, method) in [
            ("fit_and_split", DecomposeMethod::FitAndSplit),
            ("refined", DecomposeMethod::Refined { price: 0.02 }),
            ("four_boxes", DecomposeMethod::Exactly { boxes: 4 }),
        ] {
            let options = DecomposeOptions {
                method,
                ..DecomposeOptions::default()
            };
            group.bench_function(format!("{name}/{how}"), |b| {
                b.iter(|| decompose(black_box(&shape.object.mesh), &options));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, decomposition);
criterion_main!(benches);
