//! Laws of a network's arcs and columns, written or trained.

use std::collections::BTreeMap;

use crate::error::ModelError;

/// Node positions such that parents come first; ties keep the given order.
pub(crate) fn topological_order(names: &[&str], parents: &[Vec<usize>]) -> Result<Vec<usize>, ModelError> {
    let mut placed = vec![false; names.len()];
    let mut order = Vec::with_capacity(names.len());
    while order.len() < names.len() {
        let next = (0..names.len()).find(|&i| !placed[i] && parents[i].iter().all(|&parent| placed[parent]));
        let Some(next) = next else {
            return Err(ModelError::Cycle {
                node: names[on_a_cycle(&placed, parents)].into(),
            });
        };
        placed[next] = true;
        order.push(next);
    }
    Ok(order)
}

/// Walks from any unplaced node to unplaced parents until one repeats: that one lies on a cycle.
fn on_a_cycle(placed: &[bool], parents: &[Vec<usize>]) -> usize {
    let mut node = placed.iter().position(|&done| !done).unwrap_or(0);
    let mut seen = vec![false; placed.len()];
    while !seen[node] {
        seen[node] = true;
        node = parents[node]
            .iter()
            .copied()
            .find(|&parent| !placed[parent])
            .unwrap_or(node);
    }
    node
}

/// Refuses a column that two nodes, or two dimensions of one, share.
pub(crate) fn check_columns<'a>(
    nodes: impl Iterator<Item = (&'a str, Vec<String>)>,
) -> Result<(), ModelError> {
    let mut owners: BTreeMap<String, &str> = BTreeMap::new();
    for (node, columns) in nodes {
        for column in columns {
            if let Some(first) = owners.insert(column.clone(), node) {
                return Err(ModelError::DuplicateColumn {
                    column,
                    first: first.into(),
                    second: node.into(),
                });
            }
        }
    }
    Ok(())
}
