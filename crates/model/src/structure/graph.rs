//! A directed acyclic graph as the sorted parents of each node, and the moves from one to the next.

use std::collections::BTreeSet;

use super::rules::Legal;

/// Sorted parents of each node.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Graph(pub Vec<Vec<usize>>);

/// One change of a graph.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Move {
    Delete(usize, usize),
    Reverse(usize, usize),
    Add(usize, usize),
}

impl Graph {
    /// Only the required arcs.
    pub fn least(legal: &Legal) -> Self {
        Self(
            (0..legal.n_nodes())
                .map(|node| legal.required_parents(node))
                .collect(),
        )
    }

    pub fn has(&self, from: usize, to: usize) -> bool {
        self.0[to].binary_search(&from).is_ok()
    }

    /// All arcs (from, to), by `to` and then by `from`.
    pub fn arcs(&self) -> impl Iterator<Item = (usize, usize)> {
        self.0
            .iter()
            .enumerate()
            .flat_map(|(to, parents)| parents.iter().map(move |&from| (from, to)))
    }

    /// Every move that the rules allow and that leaves no cycle, in a fixed order: deletions first, so that of equally
    /// good moves the one with fewer arcs comes first.
    pub fn moves(&self, legal: &Legal) -> Vec<Move> {
        let n = self.0.len();
        let above: Vec<BTreeSet<usize>> = (0..n).map(|node| self.ancestors(node)).collect();
        let room = |to: usize| self.0[to].len() < legal.max_parents;
        let (mut deletions, mut reversals, mut additions) = (Vec::new(), Vec::new(), Vec::new());
        for from in 0..n {
            for to in 0..n {
                if self.has(from, to) {
                    if legal.requires(from, to) {
                        continue;
                    }
                    deletions.push(Move::Delete(from, to));
                    // Turning the arc round closes a cycle where another way leads from `from` to `to`.
                    let other_way = self.0[to]
                        .iter()
                        .any(|&parent| parent != from && above[parent].contains(&from));
                    if legal.allows(to, from) && room(from) && !other_way {
                        reversals.push(Move::Reverse(from, to));
                    }
                } else if from != to && legal.allows(from, to) && room(to) && !above[from].contains(&to) {
                    additions.push(Move::Add(from, to));
                }
            }
        }
        deletions.extend(reversals);
        deletions.extend(additions);
        deletions
    }

    /// The families that a move changes.
    pub fn after(&self, change: Move) -> Vec<(usize, Vec<usize>)> {
        match change {
            Move::Delete(from, to) => vec![(to, without(&self.0[to], from))],
            Move::Add(from, to) => vec![(to, with(&self.0[to], from))],
            Move::Reverse(from, to) => {
                vec![(to, without(&self.0[to], from)), (from, with(&self.0[from], to))]
            }
        }
    }

    pub fn apply(&mut self, change: Move) {
        for (node, parents) in self.after(change) {
            self.0[node] = parents;
        }
    }

    fn ancestors(&self, node: usize) -> BTreeSet<usize> {
        let mut found = BTreeSet::new();
        let mut open = vec![node];
        while let Some(node) = open.pop() {
            for &parent in &self.0[node] {
                if found.insert(parent) {
                    open.push(parent);
                }
            }
        }
        found
    }

    /// Nodes such that parents come first; of several that could come next, the lowest.
    pub fn order(&self) -> Vec<usize> {
        let n = self.0.len();
        let mut placed = vec![false; n];
        let mut order = Vec::with_capacity(n);
        while let Some(next) =
            (0..n).find(|&node| !placed[node] && self.0[node].iter().all(|&parent| placed[parent]))
        {
            placed[next] = true;
            order.push(next);
        }
        order
    }
}

/// The sorted set with one more element.
pub(crate) fn with(set: &[usize], element: usize) -> Vec<usize> {
    let mut out = set.to_vec();
    if let Err(place) = out.binary_search(&element) {
        out.insert(place, element);
    }
    out
}

/// The sorted set with one element less.
pub(crate) fn without(set: &[usize], element: usize) -> Vec<usize> {
    set.iter().copied().filter(|&other| other != element).collect()
}
