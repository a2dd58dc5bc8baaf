//! Tables of logarithms over discrete nodes, and variables summed (or maximised) out of their product.
//!
//! −∞ is impossible. NaN marks what has no density: it spoils every sum that it takes part in, unless what it is
//! multiplied with is impossible anyway.

use std::collections::BTreeSet;

use crate::block::Latent;
use crate::cpd::NodeIdx;
use crate::error::ModelError;

/// Entries of the largest table that a query may need.
const MAX_ENTRIES: f64 = 4e6;

/// A function of the states of some nodes, the last one varying fastest.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LogTable {
    pub scope: Vec<NodeIdx>,
    pub sizes: Vec<usize>,
    pub logs: Vec<f64>,
}

impl LogTable {
    /// Fills a table by calling `entry` with the state of every node of the scope, written into `states`.
    pub fn fill(
        scope: Vec<NodeIdx>,
        sizes: Vec<usize>,
        states: &mut [usize],
        mut entry: impl FnMut(&[usize]) -> Result<f64, ModelError>,
    ) -> Result<Self, ModelError> {
        check_size(sizes.iter().map(|&n| n as f64).product())?;
        let n: usize = sizes.iter().product();
        let mut logs = Vec::with_capacity(n);
        for number in 0..n {
            let mut left = number;
            for (idx, size) in scope.iter().zip(&sizes).rev() {
                states[idx.0] = left % size;
                left /= size;
            }
            logs.push(entry(states)?);
        }
        Ok(Self { scope, sizes, logs })
    }

    /// The product of tables with everything but `keep` joined out, as a table over `keep`. Nodes are taken in the
    /// order of the smallest table that each leaves behind.
    pub fn joined(
        mut tables: Vec<Self>,
        keep: &[NodeIdx],
        sizes: &dyn Fn(NodeIdx) -> usize,
        how: Latent,
    ) -> Result<Self, ModelError> {
        let mut left: BTreeSet<NodeIdx> = tables
            .iter()
            .flat_map(|table| table.scope.iter().copied())
            .filter(|idx| !keep.contains(idx))
            .collect();
        while !left.is_empty() {
            let cost = |idx: NodeIdx| -> f64 {
                let touched = tables.iter().filter(|table| table.scope.contains(&idx));
                let union: BTreeSet<NodeIdx> =
                    touched.flat_map(|table| table.scope.iter().copied()).collect();
                union.into_iter().map(|idx| sizes(idx) as f64).product()
            };
            let mut best: Option<(f64, NodeIdx)> = None;
            for &idx in &left {
                let cost = cost(idx);
                if best.is_none_or(|(least, _)| cost < least) {
                    best = Some((cost, idx));
                }
            }
            let Some((_, idx)) = best else { break };
            left.remove(&idx);
            let (touched, others): (Vec<Self>, Vec<Self>) =
                tables.into_iter().partition(|table| table.scope.contains(&idx));
            let union: BTreeSet<NodeIdx> = touched
                .iter()
                .flat_map(|table| table.scope.iter().copied())
                .filter(|&other| other != idx)
                .collect();
            tables = others;
            tables.push(product(
                &touched,
                union.into_iter().collect(),
                Some(idx),
                sizes,
                how,
            )?);
        }
        product(&tables, keep.to_vec(), None, sizes, how)
    }
}

/// The product of tables over `scope`, with one node more joined out.
fn product(
    tables: &[LogTable],
    scope: Vec<NodeIdx>,
    out: Option<NodeIdx>,
    sizes: &dyn Fn(NodeIdx) -> usize,
    how: Latent,
) -> Result<LogTable, ModelError> {
    let shape: Vec<usize> = scope.iter().map(|&idx| sizes(idx)).collect();
    let n_out = out.map_or(1, sizes);
    check_size(shape.iter().map(|&n| n as f64).product::<f64>() * n_out as f64)?;
    // How far a step of each node of the scope (and of `out`, the last) goes in each table.
    let strides: Vec<Vec<usize>> = tables
        .iter()
        .map(|table| {
            let stride = |idx: NodeIdx| {
                let position = table.scope.iter().position(|&other| other == idx);
                position.map_or(0, |p| table.sizes[p + 1..].iter().product())
            };
            scope.iter().copied().chain(out).map(stride).collect()
        })
        .collect();
    let n: usize = shape.iter().product();
    let mut logs = Vec::with_capacity(n);
    let mut terms = vec![0.0; n_out];
    for number in 0..n {
        terms.fill(0.0);
        for (table, strides) in tables.iter().zip(&strides) {
            let (mut left, mut place) = (number, 0);
            for (size, stride) in shape.iter().zip(strides).rev() {
                place += (left % size) * stride;
                left /= size;
            }
            let step = if out.is_some() { strides[scope.len()] } else { 0 };
            for (state, term) in terms.iter_mut().enumerate() {
                *term = times(*term, table.logs[place + state * step]);
            }
        }
        logs.push(if terms.iter().any(|term| term.is_nan()) {
            f64::NAN
        } else {
            how.join(&terms)
        });
    }
    Ok(LogTable {
        scope,
        sizes: shape,
        logs,
    })
}

/// The logarithm of a product; impossible times anything is impossible.
pub(crate) fn times(a: f64, b: f64) -> f64 {
    if a == f64::NEG_INFINITY || b == f64::NEG_INFINITY {
        f64::NEG_INFINITY
    } else {
        a + b
    }
}

fn check_size(n_terms: f64) -> Result<(), ModelError> {
    if n_terms > MAX_ENTRIES {
        return Err(ModelError::TooManyTerms {
            n_terms,
            limit: MAX_ENTRIES,
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chain_sums_to_what_its_matrices_multiply_to() {
        let table = |scope: &[usize], logs: &[f64]| LogTable {
            scope: scope.iter().map(|&i| NodeIdx(i)).collect(),
            sizes: vec![2; scope.len()],
            logs: logs.iter().map(|p: &f64| p.ln()).collect(),
        };
        let tables = vec![
            table(&[0], &[0.3, 0.7]),
            table(&[0, 1], &[0.9, 0.1, 0.4, 0.6]),
            table(&[1, 2], &[0.5, 0.5, 0.0, 1.0]),
        ];
        let last = LogTable::joined(tables.clone(), &[NodeIdx(2)], &|_| 2, Latent::Summed).unwrap();
        // P(1 = 0) = 0.27 + 0.28 = 0.55; P(2 = 0) = 0.275.
        assert!((last.logs[0].exp() - 0.275).abs() < 1e-15);
        let best = LogTable::joined(tables, &[], &|_| 2, Latent::Maximised).unwrap();
        // 0.7 · 0.6 · 1.
        assert!((best.logs[0].exp() - 0.42).abs() < 1e-15);
    }

    #[test]
    fn what_has_no_density_spoils_a_sum_unless_it_is_impossible() {
        let node = |logs: [f64; 2]| LogTable {
            scope: vec![NodeIdx(0)],
            sizes: vec![2],
            logs: logs.to_vec(),
        };
        let density = node([f64::NAN, 0.0]);
        let sum = |prior: [f64; 2]| {
            LogTable::joined(vec![node(prior), density.clone()], &[], &|_| 2, Latent::Summed)
                .unwrap()
                .logs[0]
        };
        assert!(sum([0.5f64.ln(), 0.5f64.ln()]).is_nan());
        assert_eq!(sum([f64::NEG_INFINITY, 0.0]), 0.0);
    }
}
