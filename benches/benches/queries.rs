//! Questions to a model of the paper's structure, one thread: `RAYON_NUM_THREADS=1 cargo bench -p prehend-benches --bench queries`.
//!
//! Times of a batch are per batch of 1,000 rows; the others per question.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use prehend::model::{BatchQuery, Evidence, Model};
use prehend_benches::paper_network::{truth, with_components};

const ROWS: usize = 1000;
const O: [&str; 2] = ["size", "cvex"];
const A: [&str; 3] = ["egpc", "upos", "dir"];
const C: [&str; 2] = ["fvol", "qeps"];

fn models() -> Vec<(String, Model)> {
    let mut models = vec![("paper".to_owned(), truth().expect("the parameters are legal"))];
    for k in [1, 2, 4, 6, 8] {
        models.push((
            format!("k{k}"),
            with_components(k).expect("the parameters are legal"),
        ));
    }
    models
}

/// Rows of the model as its own samples.
fn rows(model: &Model, query: &BatchQuery) -> Vec<Vec<f64>> {
    let table = model.sample(ROWS, 1);
    let columns: Vec<Vec<f64>> = query
        .columns()
        .iter()
        .map(|column| {
            table
                .numbers(column, "bench")
                .expect("continuous columns are observed")
        })
        .collect();
    (0..ROWS)
        .map(|row| columns.iter().map(|column| column[row]).collect())
        .collect()
}

fn batches(criterion: &mut Criterion) {
    let patterns = [
        ("t_given_o", O.to_vec()),
        ("t_given_oa", [&O[..], &A].concat()),
        ("t_given_oac", [&O[..], &A, &C].concat()),
        ("t_given_a", A.to_vec()),
    ];
    for (name, model) in models() {
        for (pattern, observed) in &patterns {
            let query = BatchQuery::new(&model, "task", observed).expect("the nodes are there");
            if !query.is_compiled() {
                continue;
            }
            let rows = rows(&model, &query);
            criterion.bench_function(&format!("{pattern}/{name}"), |b| {
                b.iter(|| query.run(black_box(&rows)));
            });
        }
    }
}

fn positions(criterion: &mut Criterion) {
    let directions: Vec<[f64; 3]> = (0..2000)
        .map(|i| {
            let z = 1.0 - (2.0 * i as f64 + 1.0) / 2000.0;
            let (r, phi) = ((1.0 - z * z).sqrt(), 2.399_963_229_728_653 * i as f64);
            [r * phi.cos(), r * phi.sin(), z]
        })
        .collect();
    for (name, model) in models() {
        let evidence = Evidence::new()
            .with_state(&model, "task", "pouring")
            .and_then(|e| e.with_value(&model, "size", &[0.1, 0.2, 0.0]))
            .and_then(|e| e.with_value(&model, "cvex", &[0.3]))
            .expect("the evidence fits");
        criterion.bench_function(&format!("upos_given_to_2000/{name}"), |b| {
            b.iter(|| {
                let answer = model
                    .query(&["upos"], black_box(&evidence))
                    .expect("there is a density");
                answer
                    .mixture("upos")
                    .and_then(|mixture| mixture.log_densities(&directions))
            });
        });
    }
}

criterion_group! {
    name = queries;
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(std::time::Duration::from_millis(100))
        .measurement_time(std::time::Duration::from_millis(500));
    targets = batches, positions
}
criterion_main!(queries);
