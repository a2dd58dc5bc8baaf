//! What probabilities from few labels are worth: trained parameters, means over draws, means over Bayesian resamples.
//!
//! ```text
//! cargo run --release -p prehend-benches --example few_labels -- [LABELS] [SETS]
//! ```
//!
//! Prints log-loss, expected calibration error (ten bins of the largest probability) and accuracy of the task, on 1,000
//! new rows of the paper's network, for sets of LABELS rows (50).

use prehend::model::{BatchQuery, Model, ModelError, Network, Table, TrainOptions};
use prehend_benches::paper_network::{network, truth};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const ROWS: usize = 1000;
const MEMBERS: usize = 50;
const O: [&str; 2] = ["size", "cvex"];
const A: [&str; 3] = ["egpc", "upos", "dir"];
const C: [&str; 2] = ["fvol", "qeps"];
const WAYS: [&str; 6] = [
    "trained parameters",
    "draws, mean",
    "draws, by density of the evidence",
    "bootstrap, mean",
    "bootstrap, by density of the evidence",
    "the model itself",
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1).map(|word| word.parse::<usize>());
    let labels = arguments.next().transpose()?.unwrap_or(50);
    let sets = arguments.next().transpose()?.unwrap_or(3);
    let truth = truth()?;
    let test = truth.sample(ROWS, 77);
    let tasks = truth.nodes()[0].states();
    let right: Vec<usize> = test
        .texts("task", "task")?
        .iter()
        .map(|cell| {
            tasks
                .iter()
                .position(|task| Some(task) == cell.as_ref())
                .unwrap_or(0)
        })
        .collect();
    let network = Network::from_toml(&network(Some("{ max = 6, choose = \"bic\" }")))?;
    let mut sums = vec![[[0.0; 3]; WAYS.len()]; 3];
    for set in 0..sets as u64 {
        let rows = truth.sample(labels, 1000 + set);
        let model = Model::fit(&network, &rows, &TrainOptions::default())?.model;
        let draws = model.draws(MEMBERS, 3)?;
        let resamples = (0..MEMBERS as u64)
            .map(|seed| resampled(&network, &rows, seed))
            .collect::<Result<Vec<Model>, _>>()?;
        for (sums, seen) in sums
            .iter_mut()
            .zip([&O[..], &[&O[..], &A].concat(), &[&O[..], &A, &C].concat()])
        {
            let answers = [
                mean(std::slice::from_ref(&model), seen, &test, false)?,
                mean(&draws, seen, &test, false)?,
                mean(&draws, seen, &test, true)?,
                mean(&resamples, seen, &test, false)?,
                mean(&resamples, seen, &test, true)?,
                mean(std::slice::from_ref(&truth), seen, &test, false)?,
            ];
            for (sums, answers) in sums.iter_mut().zip(answers) {
                for (sum, score) in sums.iter_mut().zip(scores(&answers, &right)) {
                    *sum += score / sets as f64;
                }
            }
        }
    }
    for (seen, sums) in ["O", "O, A", "O, A, C"].iter().zip(&sums) {
        for (way, [loss, error, accuracy]) in WAYS.iter().zip(sums) {
            println!("{seen:8} {way:38} log-loss {loss:.3}  ECE {error:.3}  accuracy {accuracy:.3}");
        }
    }
    Ok(())
}

/// Trained on rows that weigh as much as exponential draws.
fn resampled(network: &Network, rows: &Table, seed: u64) -> Result<Model, ModelError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let weights = (0..rows.n_rows())
        .map(|_| -(1.0 - rng.random::<f64>()).ln())
        .collect();
    let options = TrainOptions {
        weights: Some(weights),
        ..TrainOptions::default()
    };
    Ok(Model::fit(network, rows, &options)?.model)
}

/// The mean of the members' posteriors of the task, by row; `weighted` by the density of the evidence.
fn mean(members: &[Model], seen: &[&str], test: &Table, weighted: bool) -> Result<Vec<Vec<f64>>, ModelError> {
    let mut sums = vec![vec![0.0; 3]; ROWS];
    let mut answers = Vec::with_capacity(members.len());
    for member in members {
        let query = BatchQuery::new(member, "task", seen)?;
        answers.push(
            query
                .run_table(test)?
                .into_iter()
                .collect::<Result<Vec<_>, _>>()?,
        );
    }
    for (row, sum) in sums.iter_mut().enumerate() {
        let most = answers
            .iter()
            .map(|answer| answer[row].log_evidence)
            .fold(f64::NEG_INFINITY, f64::max);
        let mut total = 0.0;
        for answer in &answers {
            let weight = if weighted {
                (answer[row].log_evidence - most).exp()
            } else {
                1.0
            };
            total += weight;
            for (sum, p) in sum.iter_mut().zip(&answer[row].posterior) {
                *sum += weight * p;
            }
        }
        for p in sum.iter_mut() {
            *p /= total;
        }
    }
    Ok(sums)
}

/// Log-loss, expected calibration error, accuracy.
fn scores(answers: &[Vec<f64>], right: &[usize]) -> [f64; 3] {
    let (mut loss, mut hits) = (0.0, 0.0);
    let mut bins = [0.0; 10];
    for (p, &right) in answers.iter().zip(right) {
        let best = (0..p.len()).fold(0, |best, i| if p[i] > p[best] { i } else { best });
        let hit = if best == right { 1.0 } else { 0.0 };
        loss -= p[right].max(f64::MIN_POSITIVE).ln();
        hits += hit;
        bins[((p[best] * 10.0) as usize).min(9)] += p[best] - hit;
    }
    let n = right.len() as f64;
    [
        loss / n,
        bins.iter().map(|away| away.abs()).sum::<f64>() / n,
        hits / n,
    ]
}
