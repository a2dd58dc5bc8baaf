//! Training on rows of the paper's network, one thread: `cargo bench -p prehend-benches --bench training`.
//!
//! 3,600 rows with the true numbers of components, with BIC over 1 to 6, with every seventh cell missing; 3 starts each.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use prehend::model::{Model, Network, Table, TrainOptions};
use prehend_benches::paper_network::{network, truth, with_gaps};

const ROWS: usize = 3600;
const GAPS: f64 = 0.15;

fn trainings(c: &mut Criterion) {
    let one_thread = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread");
    let table = truth().expect("the model is legal").sample(ROWS, 1);
    let gaps = with_gaps(&table, GAPS, 1).expect("every column keeps its length");
    let options = TrainOptions {
        restarts: 3,
        ..TrainOptions::default()
    };
    let mut run = |name: &str, mixture: Option<&str>, table: &Table| {
        let network = Network::from_toml(&network(mixture)).expect("the network is legal");
        c.bench_function(name, |b| {
            b.iter(|| one_thread.install(|| Model::fit(black_box(&network), table, &options)));
        });
    };
    run("train/3600 rows, components given", None, &table);
    run(
        "train/3600 rows, BIC 1 to 6",
        Some("{ max = 6, choose = \"bic\" }"),
        &table,
    );
    run(
        "train/3600 rows, components given, 15 % of cells missing",
        None,
        &gaps,
    );
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(std::time::Duration::from_millis(200))
        .measurement_time(std::time::Duration::from_secs(2));
    targets = trainings
}
criterion_main!(benches);
