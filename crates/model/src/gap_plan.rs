//! What the E-step of a row with gaps has to sum, worked out once for each pattern of missing cells.
//!
//! Only what the gaps reach is summed: nodes that are neither seen nor ancestors of seen ones say nothing and are left
//! out, and families without a gap and with known discrete parents belong to the ordinary E-step.

use std::collections::BTreeSet;

use crate::family::Cells;
use crate::network::{Network, NodeKind};

/// What a pattern of missing cells leaves to sum.
pub(crate) struct GapPlan {
    /// Discrete nodes whose state is missing and matters.
    pub free: Vec<usize>,
    /// Discrete nodes whose tables those states enter.
    pub tables: Vec<usize>,
    /// Continuous families without a gap below a free discrete node.
    pub locals: Vec<usize>,
    /// Continuous families tied together by missing numbers.
    pub blocks: Vec<GapBlock>,
}

/// Families that share missing numbers.
pub(crate) struct GapBlock {
    /// Node and dimension of each missing number.
    pub hidden: Vec<(usize, usize)>,
    pub families: Vec<GapFamily>,
}

/// One of them: where each entry of its z = (y, 1, p) stands among the block's missing numbers.
pub(crate) struct GapFamily {
    pub node: usize,
    pub place: Vec<Option<usize>>,
}

/// Node and dimension of missing numbers.
type Hidden = BTreeSet<(usize, usize)>;

/// Where an entry of z comes from.
#[derive(Clone, Copy)]
pub(crate) enum Entry {
    One,
    Value(usize, usize),
}

/// Entries of a continuous node's z: its own dimensions, 1, its continuous parents' dimensions.
pub(crate) fn entries(network: &Network, cells: &Cells, node: usize) -> Vec<Entry> {
    let own = (0..cells.values[node].len()).map(|d| Entry::Value(node, d));
    let parents = network.nodes()[node]
        .parents
        .iter()
        .flat_map(|&parent| (0..cells.values[parent].len()).map(move |d| Entry::Value(parent, d)));
    own.chain([Entry::One]).chain(parents).collect()
}

/// Which cells of a row are missing, node after node; empty where none is.
pub(crate) fn pattern(cells: &Cells, row: usize) -> Vec<bool> {
    let mut out = Vec::new();
    for (values, states) in cells.values.iter().zip(&cells.states) {
        if states.is_empty() {
            out.extend(values.iter().map(|column| column[row].is_nan()));
        } else {
            out.push(states[row].is_none());
        }
    }
    if !out.iter().any(|missing| *missing) {
        out.clear();
    }
    out
}

impl GapPlan {
    /// The plan of all rows with the pattern of this one.
    pub fn new(network: &Network, cells: &Cells, row: usize) -> Self {
        let nodes = network.nodes();
        let is_discrete = |i: usize| matches!(nodes[i].kind, NodeKind::Discrete { .. });
        let seen = |i: usize| {
            if is_discrete(i) {
                cells.is_known(i, row)
            } else {
                cells.values[i].iter().any(|column| !column[row].is_nan())
            }
        };
        let mut relevant: Vec<bool> = (0..nodes.len()).map(seen).collect();
        for &i in network.order().iter().rev() {
            if relevant[i] {
                for &parent in &nodes[i].parents {
                    relevant[parent] = true;
                }
            }
        }
        let ordered: Vec<usize> = network.order().iter().copied().filter(|&i| relevant[i]).collect();
        let free: Vec<usize> = ordered
            .iter()
            .copied()
            .filter(|&i| is_discrete(i) && !cells.is_known(i, row))
            .collect();
        let reads_free = |i: usize| nodes[i].parents.iter().any(|parent| free.contains(parent));
        let tables = ordered
            .iter()
            .copied()
            .filter(|&i| is_discrete(i) && (free.contains(&i) || reads_free(i)))
            .collect();
        let mut locals = Vec::new();
        let mut groups: Vec<(Hidden, Vec<usize>)> = Vec::new();
        for &i in ordered.iter().filter(|&&i| !is_discrete(i)) {
            let hidden: Hidden = entries(network, cells, i)
                .into_iter()
                .filter_map(|entry| match entry {
                    Entry::Value(node, d) if cells.values[node][d][row].is_nan() => Some((node, d)),
                    _ => None,
                })
                .collect();
            if hidden.is_empty() {
                if reads_free(i) {
                    locals.push(i);
                }
                continue;
            }
            let (touched, rest): (Vec<_>, Vec<_>) = groups
                .into_iter()
                .partition(|(other, _)| !other.is_disjoint(&hidden));
            let mut merged = (hidden, Vec::new());
            for (other, members) in touched {
                merged.0.extend(other);
                merged.1.extend(members);
            }
            merged.1.push(i);
            groups = rest;
            groups.push(merged);
        }
        let blocks = groups
            .into_iter()
            .map(|(hidden, members)| {
                let hidden: Vec<(usize, usize)> = hidden.into_iter().collect();
                let families = members
                    .into_iter()
                    .map(|node| GapFamily {
                        node,
                        place: entries(network, cells, node)
                            .into_iter()
                            .map(|entry| match entry {
                                Entry::One => None,
                                Entry::Value(node, d) => hidden.iter().position(|other| *other == (node, d)),
                            })
                            .collect(),
                    })
                    .collect();
                GapBlock { hidden, families }
            })
            .collect();
        Self {
            free,
            tables,
            locals,
            blocks,
        }
    }
}
