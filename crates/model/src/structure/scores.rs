//! Scores of families, each worked out once, many at a time.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::family_score::{Sample, Scorer};
use super::graph::Graph;

/// A cache of family scores on one sample of the rows.
pub(crate) struct Scores<'a> {
    scorer: &'a Scorer,
    sample: Sample,
    known: BTreeMap<(usize, Vec<usize>), f64>,
}

impl<'a> Scores<'a> {
    pub fn new(scorer: &'a Scorer, sample: Sample) -> Self {
        Self {
            scorer,
            sample,
            known: BTreeMap::new(),
        }
    }

    /// Works out the families that are not known yet, in parallel.
    pub fn prepare(&mut self, families: impl IntoIterator<Item = (usize, Vec<usize>)>) {
        let mut missing: Vec<(usize, Vec<usize>)> = families
            .into_iter()
            .filter(|family| !self.known.contains_key(family))
            .collect();
        missing.sort_unstable();
        missing.dedup();
        let (scorer, sample) = (self.scorer, &self.sample);
        let scores: Vec<f64> = missing
            .par_iter()
            .with_max_len(1)
            .map(|(node, parents)| scorer.score(sample, *node, parents))
            .collect();
        self.known.extend(missing.into_iter().zip(scores));
    }

    /// The score of a family, sorted parents; worked out now where it is not known.
    pub fn get(&mut self, node: usize, parents: &[usize]) -> f64 {
        let key = (node, parents.to_vec());
        if let Some(score) = self.known.get(&key) {
            return *score;
        }
        self.prepare([key.clone()]);
        self.known[&key]
    }

    /// The sum over all families of a graph.
    pub fn total(&mut self, graph: &Graph) -> f64 {
        self.prepare(graph.0.iter().cloned().enumerate());
        graph
            .0
            .iter()
            .enumerate()
            .map(|(node, parents)| self.get(node, parents))
            .sum()
    }

    /// Families worked out so far.
    pub fn n_families(&self) -> usize {
        self.known.len()
    }
}
