//! Learning arcs: a search over the paper's nodes with its tiers, and the same without.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use prehend::model::{Network, StructureOptions, learn_structure};
use prehend_benches::paper_network;

const TIERS: &str = "[structure]\n\
    tiers = [[\"task\"], [\"size\", \"cvex\"], [\"fvol\", \"qeps\"], [\"egpc\", \"upos\", \"dir\"]]\n";

fn searches(c: &mut Criterion) {
    let mut group = c.benchmark_group("structure");
    group.sample_size(10);
    let table = paper_network::truth()
        .expect("the model is legal")
        .sample(1000, 1);
    let options = StructureOptions {
        restarts: 0,
        ..StructureOptions::default()
    };
    let one_thread = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread");
    for (name, rules) in [
        ("8 nodes, 1000 rows, tiers", TIERS),
        ("8 nodes, 1000 rows, free", ""),
    ] {
        let text = paper_network::network(Some("{ max = 4, choose = \"bic\" }")) + rules;
        let network = Network::from_toml(&text).expect("the network is legal");
        group.bench_function(name, |b| {
            b.iter(|| one_thread.install(|| learn_structure(black_box(&network), &table, &options)));
        });
    }
    group.finish();
}

criterion_group!(benches, searches);
criterion_main!(benches);
