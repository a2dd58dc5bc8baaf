//! Posteriors of a small mixed network by writing out everything: each joint state of the discrete nodes, each
//! combination of components and signs, and for each of them the joint Gaussian of all continuous nodes, conditioned in
//! one go. No pruning, no factorization, nothing clever.

use nalgebra::{DMatrix, DVector};

use crate::random_network::{RandomNode, RandomObservation, RandomQuery};

/// One joint state with one combination of components: its share of the evidence, and a Gaussian over all continuous
/// nodes given the evidence.
#[derive(Debug, Clone)]
pub struct Piece {
    /// State of each node, 0 for continuous ones.
    pub states: Vec<usize>,
    /// log of prior probability times density of the evidence.
    pub log_weight: f64,
    /// Mean over the continuous nodes' values, one node behind the other.
    pub mean: DVector<f64>,
    /// Covariance of the same.
    pub covariance: DMatrix<f64>,
}

/// Everything that a posterior can be asked for.
#[derive(Debug, Clone)]
pub struct BruteForce {
    /// Natural logarithm of the density of the evidence.
    pub log_evidence: f64,
    /// All pieces with a positive share.
    pub pieces: Vec<Piece>,
    /// Where each continuous node's values start.
    starts: Vec<usize>,
    dims: Vec<usize>,
}

impl BruteForce {
    /// Writes everything out; `None` where the evidence is impossible.
    pub fn of(query: &RandomQuery) -> Option<Self> {
        let nodes = &query.nodes;
        let mut starts = Vec::new();
        let mut n = 0;
        for node in nodes {
            starts.push(n);
            n += node.dim();
        }
        let dims = nodes.iter().map(RandomNode::dim).collect();
        let sizes: Vec<usize> = nodes.iter().map(|node| node.n_states().max(1)).collect();
        let mut pieces = Vec::new();
        for number in 0..sizes.iter().product() {
            let states = digits(number, &sizes);
            let log_prior = log_prior(query, &states);
            if log_prior > f64::NEG_INFINITY {
                let empty = (DVector::zeros(0), DMatrix::zeros(0, 0));
                add(query, &starts, &states, 0, log_prior, empty, &mut pieces);
            }
        }
        let most = pieces
            .iter()
            .map(|p: &Piece| p.log_weight)
            .fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = pieces.iter().map(|piece| (piece.log_weight - most).exp()).sum();
        (sum > 0.0).then(|| Self {
            log_evidence: most + sum.ln(),
            pieces,
            starts,
            dims,
        })
    }

    /// Probability of each state of a discrete node.
    pub fn probabilities(&self, node: usize, n_states: usize) -> Vec<f64> {
        let mut out = vec![0.0; n_states];
        for piece in &self.pieces {
            out[piece.states[node]] += self.share(piece);
        }
        out
    }

    /// Mean and covariance of a continuous node.
    pub fn moments(&self, node: usize) -> (DVector<f64>, DMatrix<f64>) {
        let (start, d) = (self.starts[node], self.dims[node]);
        let mut mean = DVector::zeros(d);
        for piece in &self.pieces {
            mean += self.share(piece) * piece.mean.rows(start, d);
        }
        let mut covariance = DMatrix::zeros(d, d);
        for piece in &self.pieces {
            let away = piece.mean.rows(start, d) - &mean;
            let within = piece.covariance.view((start, start), (d, d));
            covariance += self.share(piece) * (within + &away * away.transpose());
        }
        (mean, covariance)
    }

    /// log density of a continuous node that was not observed at all.
    pub fn log_density(&self, node: usize, at: &[f64]) -> f64 {
        let (start, d) = (self.starts[node], self.dims[node]);
        let at = DVector::from_column_slice(at);
        let density: f64 = self
            .pieces
            .iter()
            .map(|piece| {
                let covariance = piece.covariance.view((start, start), (d, d)).into_owned();
                let away = &at - piece.mean.rows(start, d);
                self.share(piece) * log_normal(&away, &covariance).exp()
            })
            .sum();
        density.ln()
    }

    fn share(&self, piece: &Piece) -> f64 {
        (piece.log_weight - self.log_evidence).exp()
    }
}

/// Adds every combination of components of the nodes from `node` on.
fn add(
    query: &RandomQuery,
    starts: &[usize],
    states: &[usize],
    node: usize,
    log_weight: f64,
    (mean, covariance): (DVector<f64>, DMatrix<f64>),
    pieces: &mut Vec<Piece>,
) {
    let Some(here) = query.nodes.get(node) else {
        pieces.extend(condition(query, starts, states, log_weight, &mean, &covariance));
        return;
    };
    let RandomNode::Continuous {
        discrete,
        continuous,
        components,
        latent_sign,
        ..
    } = here
    else {
        add(
            query,
            starts,
            states,
            node + 1,
            log_weight,
            (mean, covariance),
            pieces,
        );
        return;
    };
    let row = discrete.iter().fold(0, |row, &parent| {
        row * query.nodes[parent].n_states() + states[parent]
    });
    let signs: &[f64] = if *latent_sign { &[1.0, -1.0] } else { &[1.0] };
    for component in components[row].iter().filter(|c| c.weight > 0.0) {
        for sign in signs {
            let (n, d) = (mean.len(), here.dim());
            // Coefficients over all values so far.
            let mut b = DMatrix::zeros(d, n);
            let mut column = 0;
            for &parent in continuous {
                for i in 0..query.nodes[parent].dim() {
                    b.set_column(
                        starts[parent] + i,
                        &(*sign * component.coefficients.column(column)),
                    );
                    column += 1;
                }
            }
            let mut longer = DVector::zeros(n + d);
            longer.rows_mut(0, n).copy_from(&mean);
            longer
                .rows_mut(n, d)
                .copy_from(&(*sign * &component.mean + &b * &mean));
            let mut joint = DMatrix::zeros(n + d, n + d);
            let cross = &b * &covariance;
            joint.view_mut((0, 0), (n, n)).copy_from(&covariance);
            joint.view_mut((n, 0), (d, n)).copy_from(&cross);
            joint.view_mut((0, n), (n, d)).copy_from(&cross.transpose());
            joint
                .view_mut((n, n), (d, d))
                .copy_from(&(&cross * b.transpose() + &component.covariance));
            let log_share = component.weight.ln() - (signs.len() as f64).ln();
            add(
                query,
                starts,
                states,
                node + 1,
                log_weight + log_share,
                (longer, joint),
                pieces,
            );
        }
    }
}

fn log_prior(query: &RandomQuery, states: &[usize]) -> f64 {
    let mut log = 0.0;
    for (i, node) in query.nodes.iter().enumerate() {
        let RandomNode::Discrete { parents, table } = node else {
            continue;
        };
        let row = parents.iter().fold(0, |row, &parent| {
            row * query.nodes[parent].n_states() + states[parent]
        });
        log += table[row][states[i]].ln();
        log += match &query.evidence[i] {
            RandomObservation::State(state) if *state != states[i] => f64::NEG_INFINITY,
            RandomObservation::Likelihood(likelihood) => likelihood[states[i]].ln(),
            _ => 0.0,
        };
    }
    log
}

/// Conditions on all continuous evidence at once.
fn condition(
    query: &RandomQuery,
    starts: &[usize],
    states: &[usize],
    log_weight: f64,
    mean: &DVector<f64>,
    covariance: &DMatrix<f64>,
) -> Option<Piece> {
    let mut picked = Vec::new();
    let mut value = Vec::new();
    let mut errors = Vec::new();
    for (observation, &start) in query.evidence.iter().zip(starts) {
        match observation {
            RandomObservation::Value(values) => {
                for (i, v) in values.iter().enumerate().filter(|(_, v)| !v.is_nan()) {
                    picked.push(start + i);
                    value.push(*v);
                }
            }
            RandomObservation::Uncertain(values, error) => {
                errors.push((picked.len(), error));
                for (i, v) in values.iter().enumerate() {
                    picked.push(start + i);
                    value.push(*v);
                }
            }
            _ => {}
        }
    }
    let m = picked.len();
    let mut seen = DMatrix::from_fn(m, m, |i, j| covariance[(picked[i], picked[j])]);
    for (start, error) in errors {
        let d = error.nrows();
        let sum = seen.view((start, start), (d, d)) + error;
        seen.view_mut((start, start), (d, d)).copy_from(&sum);
    }
    let away = DVector::from_fn(m, |i, _| value[i] - mean[picked[i]]);
    let cross = DMatrix::from_fn(mean.len(), m, |i, j| covariance[(i, picked[j])]);
    let inverse = seen.clone().cholesky()?.inverse();
    Some(Piece {
        states: states.to_vec(),
        log_weight: log_weight + log_normal(&away, &seen),
        mean: mean + &cross * &inverse * &away,
        covariance: covariance - &cross * &inverse * cross.transpose(),
    })
}

/// log N(away; 0, covariance); 0 in no dimensions.
fn log_normal(away: &DVector<f64>, covariance: &DMatrix<f64>) -> f64 {
    let Some(factor) = covariance.clone().cholesky() else {
        return f64::NAN;
    };
    let log_det: f64 = 2.0 * factor.l().diagonal().iter().map(|v| v.ln()).sum::<f64>();
    -0.5 * (away.dot(&factor.solve(away)) + log_det + away.len() as f64 * std::f64::consts::TAU.ln())
}

fn digits(mut number: usize, sizes: &[usize]) -> Vec<usize> {
    let mut out = vec![0; sizes.len()];
    for (slot, size) in out.iter_mut().zip(sizes).rev() {
        *slot = number % size;
        number /= size;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random_network::{RandomComponent, Reading};

    #[test]
    fn two_states_with_one_gaussian_each_are_bayes_rule() {
        let component = |mean: f64| RandomComponent {
            weight: 1.0,
            mean: DVector::from_element(1, mean),
            coefficients: DMatrix::zeros(1, 0),
            covariance: DMatrix::identity(1, 1),
        };
        let query = RandomQuery {
            nodes: vec![
                RandomNode::Discrete {
                    parents: vec![],
                    table: vec![vec![0.25, 0.75]],
                },
                RandomNode::Continuous {
                    discrete: vec![0],
                    continuous: vec![],
                    components: vec![vec![component(0.0)], vec![component(2.0)]],
                    reading: Reading::Own,
                    latent_sign: false,
                },
            ],
            evidence: vec![RandomObservation::Hidden, RandomObservation::Value(vec![0.0])],
        };
        let brute = BruteForce::of(&query).unwrap();
        // Odds 3 e⁻² to 1.
        let odds = 3.0 * (-2.0f64).exp();
        assert!((brute.probabilities(0, 2)[1] - odds / (1.0 + odds)).abs() < 1e-15);
    }
}
