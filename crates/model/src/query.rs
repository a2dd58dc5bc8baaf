//! Exact posteriors by elimination.
//!
//! The tables of [`Elimination`] are multiplied and summed over every discrete node that is neither asked about nor a
//! parent of a block with targets; over the others the sum is written out, and each block with targets adds its
//! Gaussians. Everything is in the log domain; no sampling, no approximation. Where combinations of components are too
//! many to be summed, the answer says how far off it can be at most.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::DMatrix;

use crate::block::{BlockSum, Latent};
use crate::cpd::{Cpd, MixtureCpd, NodeIdx};
use crate::elimination::{Elimination, Tables, full_value};
use crate::error::ModelError;
use crate::evidence::Evidence;
use crate::gaussian::{log_add, log_sum_exp};
use crate::log_table::LogTable;
use crate::mixture::Term;
use crate::model::Model;
use crate::posterior::{Posterior, Target};
use crate::root_gaussian::RootGaussian;

/// Terms of an answer; the lightest beyond are left out, and count towards the error bound.
const MAX_TERMS: usize = 2_000_000;
/// A bound that leaves the answer without meaning.
const MEANINGLESS: f64 = 0.5;
/// A bound that one number may hide: what the sums are right to anyway.
const ROUNDING: f64 = 1e-9;

impl Model {
    /// The posterior of one or several nodes given evidence, jointly.
    ///
    /// # Errors
    ///
    /// Unknown or repeated targets, [`ModelError::NoDensity`] where the evidence meets a singular component,
    /// [`ModelError::ImpossibleEvidence`], [`ModelError::TooManyTerms`], [`ModelError::Pruned`].
    ///
    /// # Source
    ///
    /// Eq. 1 and section IV; conditional Gaussians as in Lauritzen (1992).
    pub fn query(&self, targets: &[&str], evidence: &Evidence) -> Result<Posterior, ModelError> {
        let mut asked = Vec::with_capacity(targets.len());
        for target in targets {
            let idx = self.index(target)?;
            if asked.contains(&idx) {
                return Err(ModelError::BadValue {
                    node: (*target).into(),
                    found: "the same target twice".into(),
                    expected: "each target once".into(),
                });
            }
            if let Cpd::VonMisesFisher(_) = self.node(idx).cpd {
                return Err(ModelError::BadValue {
                    node: (*target).into(),
                    found: "a von_mises_fisher_mixture as one of the targets".into(),
                    expected: "to be asked about alone, by `query_direction`".into(),
                });
            }
            asked.push(idx);
        }
        let elimination = Elimination::new(self, &asked, evidence, Latent::Summed);
        let answer = run(&elimination)?;
        if answer.error_bound > MEANINGLESS {
            return Err(ModelError::Pruned {
                error_bound: answer.error_bound,
            });
        }
        Ok(answer)
    }

    /// Natural logarithm of the density (and probability) of the evidence.
    ///
    /// # Errors
    ///
    /// As [`Model::query`]; [`ModelError::Pruned`] where it could only be bounded.
    pub fn log_evidence(&self, evidence: &Evidence) -> Result<f64, ModelError> {
        let answer = self.query(&[], evidence)?;
        answer.exact()?;
        Ok(answer.log_evidence)
    }
}

impl Posterior {
    /// Refuses an answer that is only bounded.
    pub(crate) fn exact(&self) -> Result<(), ModelError> {
        if self.error_bound > ROUNDING {
            return Err(ModelError::Pruned {
                error_bound: self.error_bound,
            });
        }
        Ok(())
    }
}

/// Sums of a block with targets, by the states of its scope.
type Sums = BTreeMap<Vec<usize>, BlockSum>;

fn run(query: &Elimination) -> Result<Posterior, ModelError> {
    let tables = query.tables(false)?;
    let mut written: BTreeSet<NodeIdx> = query.targets.iter().copied().collect();
    written.extend(
        query
            .blocks
            .iter()
            .filter(|b| !b.targets.is_empty())
            .flat_map(|b| b.scope.iter().copied()),
    );
    let written: Vec<NodeIdx> = query
        .free()
        .iter()
        .copied()
        .filter(|idx| written.contains(idx))
        .collect();
    let joined = LogTable::joined(
        tables.exact.clone(),
        &written,
        &|idx| query.size(idx),
        Latent::Summed,
    )?;
    if joined.logs.iter().any(|log| log.is_nan()) {
        return Err(query.culprit(&tables)?);
    }
    let mut sums: Vec<Sums> = query.blocks.iter().map(|_| Sums::new()).collect();
    let mut terms = Vec::new();
    let mut dropped = f64::NEG_INFINITY;
    let mut states = query.states.clone();
    for (number, &log_weight) in joined.logs.iter().enumerate() {
        if log_weight == f64::NEG_INFINITY {
            continue;
        }
        let mut left = number;
        for (idx, size) in joined.scope.iter().zip(&joined.sizes).rev() {
            states[idx.0] = left % size;
            left /= size;
        }
        let mut joint = vec![(log_weight, RootGaussian::empty(1))];
        for (block, sums) in query.blocks.iter().zip(&mut sums) {
            if block.targets.is_empty() {
                continue;
            }
            let key: Vec<usize> = block.scope.iter().map(|idx| states[idx.0]).collect();
            if !sums.contains_key(&key) {
                sums.insert(key.clone(), query.block_sum(block, &states, true)?);
            }
            let mut pieces: Vec<(f64, &RootGaussian)> = sums[&key]
                .pieces
                .iter()
                .map(|piece| (piece.log_weight, &piece.gaussian))
                .collect();
            shrink(&mut joint, &mut pieces, &mut dropped);
            joint = joint
                .iter()
                .flat_map(|(a, left)| pieces.iter().map(move |(b, right)| (a + b, left.beside(right))))
                .collect();
        }
        let target_states: Vec<usize> = query
            .targets
            .iter()
            .filter(|&&idx| query.size(idx) > 0)
            .map(|idx| states[idx.0])
            .collect();
        terms.extend(joint.into_iter().map(|(log_weight, gaussian)| {
            let mean = gaussian.mean.column(0).into_owned();
            Term::new(log_weight, target_states.clone(), mean, gaussian.root)
        }));
    }
    let logs: Vec<f64> = terms.iter().map(|term| term.log_weight).collect();
    let log_evidence = log_sum_exp(&logs);
    if !log_evidence.is_finite() {
        return Err(query.impossible());
    }
    let error_bound = error_bound(query, &tables, &sums, dropped, log_evidence)?;
    Ok(arrange(query, terms, log_evidence, error_bound))
}

/// Leaves out the lightest pieces where their products with the others would be too many. `dropped` grows by what they
/// weigh, all products together.
fn shrink(joint: &mut Vec<(f64, RootGaussian)>, pieces: &mut Vec<(f64, &RootGaussian)>, dropped: &mut f64) {
    while joint.len().saturating_mul(pieces.len()) > MAX_TERMS {
        let total = |logs: Vec<f64>| log_sum_exp(&logs);
        if joint.len() > pieces.len() {
            joint.sort_by(|a, b| b.0.total_cmp(&a.0));
            let rest = joint.split_off(joint.len() / 2);
            let lost =
                total(rest.iter().map(|r| r.0).collect()) + total(pieces.iter().map(|p| p.0).collect());
            *dropped = log_add(*dropped, lost);
        } else {
            pieces.sort_by(|a, b| b.0.total_cmp(&a.0));
            let rest = pieces.split_off(pieces.len() / 2);
            let lost = total(rest.iter().map(|r| r.0).collect()) + total(joint.iter().map(|j| j.0).collect());
            *dropped = log_add(*dropped, lost);
        }
    }
}

/// How far any probability of the answer can be off: the share of the density of the evidence that may be missing.
fn error_bound(
    query: &Elimination,
    tables: &Tables,
    sums: &[Sums],
    dropped: f64,
    log_evidence: f64,
) -> Result<f64, ModelError> {
    let some_lost = sums
        .iter()
        .flat_map(BTreeMap::values)
        .any(|sum| sum.lost > f64::NEG_INFINITY);
    if tables.upper.is_none() && !some_lost && dropped == f64::NEG_INFINITY {
        return Ok(0.0);
    }
    let mut upper = tables.upper.clone().unwrap_or_else(|| tables.exact.clone());
    for (block, sums) in query
        .blocks
        .iter()
        .zip(sums)
        .filter(|(block, _)| !block.targets.is_empty())
    {
        let sizes: Vec<usize> = block.scope.iter().map(|&idx| query.size(idx)).collect();
        let mut states = query.states.clone();
        upper.push(LogTable::fill(
            block.scope.clone(),
            sizes,
            &mut states,
            |states| {
                let key: Vec<usize> = block.scope.iter().map(|idx| states[idx.0]).collect();
                // A configuration that was never looked at is impossible.
                Ok(sums
                    .get(&key)
                    .map_or(f64::NEG_INFINITY, |sum| log_add(sum.total, sum.lost)))
            },
        )?);
    }
    let whole = LogTable::joined(upper, &[], &|idx| query.size(idx), Latent::Summed)?;
    let most = log_add(whole.logs[0], dropped);
    Ok(if most.is_finite() {
        (-(log_evidence - most).exp_m1()).clamp(0.0, 1.0)
    } else {
        1.0
    })
}

/// Where a dimension of the answer comes from.
enum Place {
    Hidden(usize),
    Observed(f64),
}

/// Normalizes, and puts the targets' dimensions into the order asked for.
fn arrange(query: &Elimination, mut terms: Vec<Term>, log_evidence: f64, error_bound: f64) -> Posterior {
    let mut start = BTreeMap::new();
    let mut n_hidden = 0;
    for &idx in query.blocks.iter().flat_map(|block| &block.targets) {
        start.insert(idx, n_hidden);
        n_hidden += query.model.mixture(idx).map_or(0, MixtureCpd::dim);
    }
    let mut targets = Vec::with_capacity(query.targets.len());
    let mut places = Vec::new();
    for &idx in &query.targets {
        let node = query.model.node(idx);
        targets.push(match &node.cpd {
            Cpd::Discrete(cpd) => Target::Discrete {
                name: node.name.clone(),
                states: cpd.states.clone(),
            },
            // Refused before: it is asked about alone.
            Cpd::VonMisesFisher(cpd) => Target::Continuous {
                name: node.name.clone(),
                columns: cpd.columns.clone(),
                sphere: true,
            },
            Cpd::Mixture(cpd) => {
                places.extend((0..cpd.dim()).map(|d| match start.get(&idx) {
                    Some(start) => Place::Hidden(start + d),
                    None => Place::Observed(full_value(query.evidence, idx).map_or(f64::NAN, |v| v[d])),
                }));
                Target::Continuous {
                    name: node.name.clone(),
                    columns: cpd.columns.clone(),
                    sphere: cpd.sphere,
                }
            }
        });
    }
    let in_order = places
        .iter()
        .enumerate()
        .all(|(i, place)| matches!(place, Place::Hidden(j) if *j == i));
    for term in &mut terms {
        term.log_weight -= log_evidence;
        if in_order {
            continue;
        }
        let mean = |place: &Place| match place {
            Place::Hidden(i) => term.mean[*i],
            Place::Observed(value) => *value,
        };
        let means: Vec<f64> = places.iter().map(mean).collect();
        let root = DMatrix::from_fn(places.len(), term.root().ncols(), |i, j| match places[i] {
            Place::Hidden(i) => term.root()[(i, j)],
            Place::Observed(_) => 0.0,
        });
        let states = std::mem::take(&mut term.states);
        *term = Term::new(term.log_weight, states, nalgebra::DVector::from_vec(means), root);
    }
    Posterior::new(log_evidence, targets, terms, error_bound)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of hidden nodes with four components each, observed at its end and asked about at its start.
    fn chain(seed: u64) -> (Model, Evidence) {
        let spread = |i: u64| ((seed * 31 + i * 17) % 23) as f64 / 5.0 - 2.0;
        let component = |i: u64, q: usize| {
            let slope = if q == 0 {
                String::new()
            } else {
                (0.6 + 0.1 * spread(i + 3)).to_string()
            };
            format!(
                r#"{{ "weight": {}, "mean": [{}], "coefficients": [[{slope}]], "covariance": [[{}]] }}"#,
                [0.1, 0.2, 0.3, 0.4][(i % 4) as usize],
                2.0 * spread(i),
                0.05 + 0.1 * spread(i + 5).abs()
            )
        };
        let row = |start: u64, q: usize| {
            let row: Vec<String> = (start..start + 4).map(|i| component(i, q)).collect();
            format!("[{}]", row.join(","))
        };
        let text = format!(
            r#"{{ "format": "prehend-model", "version": 1, "nodes": [
            {{ "name": "t", "kind": "discrete", "states": ["a", "b"], "table": [[0.3, 0.7]] }},
            {{ "name": "x", "kind": "gaussian_mixture", "discrete_parents": ["t"], "components": [{}, {}] }},
            {{ "name": "y", "kind": "gaussian_mixture", "continuous_parents": ["x"], "components": [{}] }},
            {{ "name": "z", "kind": "gaussian_mixture", "continuous_parents": ["y"], "components": [{}] }},
            {{ "name": "w", "kind": "gaussian_mixture", "continuous_parents": ["z"], "components": [{}] }}] }}"#,
            row(0, 0),
            row(4, 0),
            row(8, 1),
            row(12, 1),
            row(16, 1)
        );
        let model = Model::from_json(&text).unwrap();
        let evidence = Evidence::new().with_value(&model, "w", &[spread(7)]).unwrap();
        (model, evidence)
    }

    #[test]
    fn what_was_left_out_is_within_the_bound() {
        let mut n_useful = 0;
        for seed in 0..20 {
            let (model, evidence) = chain(seed);
            for target in ["t", "x"] {
                let asked = [model.index(target).unwrap()];
                let exact = model.query(&[target], &evidence).unwrap();
                assert_eq!(exact.error_bound, 0.0);
                for width in [1, 4, 16, 64, 200] {
                    let mut elimination = Elimination::new(&model, &asked, &evidence, Latent::Summed);
                    elimination.width = Some(width);
                    let found = run(&elimination).unwrap();
                    assert!((0.0..=1.0).contains(&found.error_bound));
                    let most = found.log_evidence - (-found.error_bound).ln_1p();
                    assert!(found.log_evidence <= exact.log_evidence + 1e-9);
                    assert!(exact.log_evidence <= most + 1e-9, "{seed} {target} {width}");
                    n_useful += usize::from(found.error_bound > 0.0 && found.error_bound < 0.5);
                    let Some(expected) = exact.probabilities("t") else {
                        continue;
                    };
                    let pairs = found.probabilities("t").unwrap().into_iter().zip(expected);
                    for (found_p, p) in pairs {
                        assert!((found_p - p).abs() <= found.error_bound + 1e-9, "{seed} {width}");
                    }
                }
            }
        }
        assert!(n_useful > 10, "{n_useful} bounds say something");
    }
}
