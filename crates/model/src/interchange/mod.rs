//! Files of other programs: BIF and XMLBIF hold discrete networks, Hugin's NET scalar conditional Gaussians too, DOT a
//! picture of the arcs.

mod bif;
mod dot;
mod lexer;
mod names;
mod net;
mod scalar;
mod xmlbif;

use crate::cpd::{Cpd, DiscreteCpd, NodeIdx};
use crate::error::{ModelError, list};
use crate::extra::Extra;
use crate::model::{Model, Node};

/// A model as text in another program's format.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Export {
    /// The file's text.
    pub text: String,
    /// What the format cannot hold and the text therefore lacks or says otherwise, one sentence each.
    pub losses: Vec<String>,
}

/// Rows of probabilities of foreign files are divided by their sum where it is within this of 1: printed digits.
const PRINTED_SUM: f64 = 1e-2;
/// Numbers in the largest table that is read.
const MAX_NUMBERS: usize = 20_000_000;

/// A discrete node as a foreign file gives it.
struct Foreign {
    name: String,
    states: Vec<String>,
    line: usize,
    parents: Vec<String>,
    /// Row by row, one row per configuration of the parents.
    table: Option<Vec<f64>>,
}

/// Discrete nodes of a model, and a sentence for each node that is left out.
type DiscretePart<'a> = (Vec<(NodeIdx, &'a DiscreteCpd)>, Vec<String>);

/// Where a reader found something it did not expect.
#[derive(Clone, Copy)]
struct At {
    format: &'static str,
    line: usize,
}

impl At {
    fn error(self, found: impl Into<String>, expected: impl Into<String>) -> ModelError {
        ModelError::TextFile {
            format: self.format.into(),
            line: self.line,
            found: found.into(),
            expected: expected.into(),
        }
    }
}

/// Number of configurations of nodes with so many states; an error where a table over them would be too large.
fn n_configurations(at: At, sizes: impl Iterator<Item = usize>, states: usize) -> Result<usize, ModelError> {
    let mut n = 1usize;
    for size in sizes {
        n = n.saturating_mul(size);
    }
    if n.saturating_mul(states) > MAX_NUMBERS {
        return Err(at.error(
            format!("a table of {n} rows"),
            format!("at most {MAX_NUMBERS} numbers in a table"),
        ));
    }
    Ok(n)
}

/// Probabilities that a program printed, as a distribution.
fn distribution(at: At, row: &[f64]) -> Result<Vec<f64>, ModelError> {
    let sum: f64 = row.iter().sum();
    let legal = row.iter().all(|p| *p >= 0.0 && p.is_finite()) && (sum - 1.0).abs() <= PRINTED_SUM;
    if !legal {
        return Err(at.error(
            format!("the probabilities {row:?} (sum {sum})"),
            "numbers of at least 0 that sum to 1",
        ));
    }
    // What sums to 1 but for rounding stays as it is, so that our own files come back bit for bit.
    Ok(if (sum - 1.0).abs() <= 1e-9 {
        row.to_vec()
    } else {
        row.iter().map(|p| p / sum).collect()
    })
}

/// The discrete network of a foreign file.
fn discrete_model(format: &'static str, nodes: Vec<Foreign>) -> Result<Model, ModelError> {
    let names: Vec<String> = nodes.iter().map(|node| node.name.clone()).collect();
    let sizes: Vec<usize> = nodes.iter().map(|node| node.states.len()).collect();
    let mut out = Vec::with_capacity(nodes.len());
    for node in nodes {
        let at = At {
            format,
            line: node.line,
        };
        let parents = find(&node.name, &node.parents, &names)?;
        let n_states = node.states.len();
        let n_rows = n_configurations(at, parents.iter().map(|p| sizes[p.0]), n_states)?;
        let Some(table) = node.table else {
            return Err(at.error(
                format!("no probabilities of `{}`", node.name),
                "a table for each variable",
            ));
        };
        if n_states == 0 || table.len() != n_rows * n_states {
            return Err(at.error(
                format!("{} probabilities of `{}`", table.len(), node.name),
                format!("{n_rows} rows of {n_states}"),
            ));
        }
        let table = table
            .chunks(n_states)
            .map(|row| distribution(at, row))
            .collect::<Result<_, _>>()?;
        out.push(Node {
            name: node.name,
            cpd: Cpd::Discrete(DiscreteCpd {
                states: node.states,
                parents,
                table,
            }),
            extra: Extra::default(),
        });
    }
    Model::new(out, Extra::default())
}

/// Positions of the named parents.
fn find(node: &str, parents: &[String], names: &[String]) -> Result<Vec<NodeIdx>, ModelError> {
    let position = |parent: &String| {
        let found = names.iter().position(|name| name == parent).map(NodeIdx);
        found.ok_or_else(|| ModelError::UnknownParent {
            node: node.into(),
            parent: parent.clone(),
            known: list(names.iter().map(String::as_str)),
        })
    };
    parents.iter().map(position).collect()
}

impl Model {
    /// What a discrete format can hold.
    fn discrete_part(&self, format: &str) -> Result<DiscretePart<'_>, ModelError> {
        let mut kept = Vec::new();
        let mut losses = Vec::new();
        for (i, node) in self.nodes().iter().enumerate() {
            match &node.cpd {
                Cpd::Discrete(cpd) => kept.push((NodeIdx(i), cpd)),
                Cpd::Mixture(_) | Cpd::VonMisesFisher(_) => {
                    losses.push(format!("`{}` is continuous and left out", node.name));
                }
            }
        }
        if kept.is_empty() {
            return Err(ModelError::Export {
                format: format.into(),
                problem: "no node is discrete; .net holds continuous nodes too".into(),
            });
        }
        Ok((kept, losses))
    }

    /// States of discrete parents, configuration by configuration, in the order of the table's rows.
    fn parent_states(&self, parents: &[NodeIdx], mut row: usize) -> Vec<usize> {
        let mut states = vec![0; parents.len()];
        for (state, &parent) in states.iter_mut().zip(parents).rev() {
            let n = self.n_states(parent);
            *state = row % n;
            row /= n;
        }
        states
    }
}
