//! A model of the paper's structure to draw rows from: learning and queries are measured on them.
//!
//! Arcs as in `networks/paper.toml`; 3, 2, 2, 2, 2, 4, 3 components in `size cvex fvol qeps egpc upos dir`. Parameters are
//! drawn once from a fixed seed. Every continuous node has its own components for each task where the task is a parent.

use std::fmt::Write as _;

use nalgebra::{DMatrix, DVector};
use prehend::model::{
    Column, Component, Cpd, DiscreteCpd, Extra, MixtureCpd, Model, ModelError, Node, NodeIdx, Sign, Table,
    Weights,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Name, columns, continuous parents, components, and whether the task is a parent.
type Row = (
    &'static str,
    &'static [&'static str],
    &'static [usize],
    usize,
    bool,
);

/// The continuous nodes; parents count from the task, which is node 0.
const NODES: [Row; 7] = [
    ("size", &["size_x", "size_y", "size_z"], &[], 3, true),
    ("cvex", &["cvex"], &[1], 2, true),
    ("fvol", &["fvol"], &[1, 2], 2, true),
    ("qeps", &["qeps"], &[1, 2], 2, true),
    ("egpc", &["egpc_1", "egpc_2"], &[3, 4], 2, false),
    ("upos", &["upos_x", "upos_y", "upos_z"], &[3, 4, 5], 4, false),
    (
        "dir",
        &["dir_w", "dir_x", "dir_y", "dir_z"],
        &[3, 4, 5, 6],
        3,
        false,
    ),
];
const TASKS: [&str; 3] = ["hand-over", "pouring", "tool-use"];
const SEED: u64 = 7;

/// The model, the same on every call.
///
/// # Errors
///
/// None that is known: the parameters are legal by construction.
pub fn truth() -> Result<Model, ModelError> {
    model_with(None)
}

/// A model of the same structure with as many components in every node, for how queries grow with them.
///
/// # Errors
///
/// None that is known: the parameters are legal by construction.
pub fn with_components(k: usize) -> Result<Model, ModelError> {
    model_with(Some(k))
}

fn model_with(components: Option<usize>) -> Result<Model, ModelError> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let task = DiscreteCpd {
        states: TASKS.map(String::from).to_vec(),
        parents: vec![],
        table: vec![vec![0.4, 0.35, 0.25]],
    };
    let mut nodes = vec![node("task", Cpd::Discrete(task))];
    for (name, columns, parents, k, by_task) in NODES {
        let q = parents.iter().map(|&p| NODES[p - 1].1.len()).sum();
        let configurations = if by_task { TASKS.len() } else { 1 };
        let mixture = MixtureCpd {
            columns: columns.iter().map(ToString::to_string).collect(),
            discrete_parents: if by_task { vec![NodeIdx(0)] } else { vec![] },
            continuous_parents: parents.iter().copied().map(NodeIdx).collect(),
            components: (0..configurations)
                .map(|_| row(columns.len(), q, components.unwrap_or(k), &mut rng))
                .collect(),
            weights: Weights::PerConfiguration,
            sign: Sign::Fixed,
            sphere: false,
            scaling: None,
        };
        nodes.push(node(name, Cpd::Mixture(mixture)));
    }
    Model::new(nodes, Extra::default())
}

fn node(name: &str, cpd: Cpd) -> Node {
    Node {
        name: name.into(),
        cpd,
        extra: Extra::default(),
    }
}

fn row(d: usize, q: usize, k: usize, rng: &mut ChaCha8Rng) -> Vec<Component> {
    let normal = |rng: &mut ChaCha8Rng| -> f64 { StandardNormal.sample(rng) };
    let raw: Vec<f64> = (0..k).map(|_| rng.random_range(0.5..1.5)).collect();
    let total: f64 = raw.iter().sum();
    raw.iter()
        .map(|weight| {
            let mean = DVector::from_fn(d, |_, _| normal(rng));
            let coefficients = DMatrix::from_fn(d, q, |_, _| 0.6 * normal(rng) / (q as f64).sqrt());
            let root = DMatrix::from_fn(d, d, |i, j| {
                if i == j {
                    rng.random_range(0.15..0.4)
                } else {
                    0.06 * normal(rng)
                }
            });
            Component {
                weight: weight / total,
                mean,
                coefficients,
                covariance: &root * root.transpose(),
            }
        })
        .collect()
}

/// `network.toml` of the structure. `mixture` is the value of that key, or `None` for the true numbers of components.
pub fn network(mixture: Option<&str>) -> String {
    let mut out = format!("[[node]]\nname = \"task\"\nkind = \"discrete\"\nstates = {TASKS:?}\n");
    for (name, columns, parents, k, by_task) in NODES {
        let task = by_task.then_some("task");
        let names: Vec<&str> = task
            .into_iter()
            .chain(parents.iter().map(|&p| NODES[p - 1].0))
            .collect();
        let mixture = mixture.map_or_else(|| format!("{{ components = {k} }}"), str::to_owned);
        let _ = write!(
            out,
            "[[node]]\nname = \"{name}\"\nkind = \"gaussian_mixture\"\ncolumns = {columns:?}\nparents = {names:?}\nmixture = {mixture}\n"
        );
    }
    out
}

/// The table with each cell emptied with probability `share`, independently.
///
/// # Errors
///
/// None that is known: every column keeps its length.
pub fn with_gaps(table: &Table, share: f64, seed: u64) -> Result<Table, ModelError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut out = Table::new(table.n_rows());
    for name in table.names() {
        let column = match table.column(name) {
            Some(Column::Numbers(values)) => {
                let gap = |v: &f64| if rng.random::<f64>() < share { f64::NAN } else { *v };
                Column::Numbers(values.iter().map(gap).collect())
            }
            Some(Column::Text(values)) => {
                let gap = |v: &String| {
                    if rng.random::<f64>() < share {
                        String::new()
                    } else {
                        v.clone()
                    }
                };
                Column::Text(values.iter().map(gap).collect())
            }
            None => continue,
        };
        out = out.with(name, column)?;
    }
    Ok(out)
}
