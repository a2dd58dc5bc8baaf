//! The search for the best graph: hill climbing with a tabu list, restarts, and a search over orders.
//!
//! Climbing adds, deletes or turns one arc at a time, and takes the best step even where it goes down, as long as the
//! graph was not seen lately; the best graph on the way is kept. Restarts shake the best graph and climb again. The order
//! search swaps neighbours of an order of the nodes, each node taking its best parents among those before it: it leaves
//! peaks that no single arc leaves.

use std::collections::VecDeque;

use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::graph::{Graph, Move, with, without};
use super::rules::Legal;
use super::scores::Scores;

/// Moves that shake a graph before a restart, per node.
const SHAKES_PER_NODE: f64 = 0.5;
/// Gains below this share of the score are rounding.
const ROUNDING: f64 = 1e-12;

/// How long to search.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Effort {
    pub tabu: usize,
    pub restarts: usize,
    pub orders: bool,
}

/// The best graph from these starts.
pub(crate) fn search(
    scores: &mut Scores,
    legal: &Legal,
    starts: &[Graph],
    effort: Effort,
    seed: u64,
) -> Graph {
    let mut best = climb(scores, legal, Graph::least(legal), effort.tabu);
    for start in starts {
        let other = climb(scores, legal, start.clone(), effort.tabu);
        best = better(scores, best, other);
    }
    if effort.orders {
        let ordered = order_search(scores, legal, &best);
        let other = climb(scores, legal, ordered, effort.tabu);
        best = better(scores, best, other);
    }
    for restart in 0..effort.restarts {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(restart as u64 + 1);
        let other = climb(scores, legal, shake(&best, legal, &mut rng), effort.tabu);
        best = better(scores, best, other);
    }
    best
}

fn better(scores: &mut Scores, a: Graph, b: Graph) -> Graph {
    let (first, second) = (scores.total(&a), scores.total(&b));
    if second > first + ROUNDING * first.abs() {
        b
    } else {
        a
    }
}

fn shake(graph: &Graph, legal: &Legal, rng: &mut impl Rng) -> Graph {
    let mut graph = graph.clone();
    let n = (SHAKES_PER_NODE * legal.n_nodes() as f64).ceil() as usize;
    for _ in 0..n.max(2) {
        if let Some(&change) = graph.moves(legal).choose(rng) {
            graph.apply(change);
        }
    }
    graph
}

/// Climbs, with `tabu` steps of patience.
fn climb(scores: &mut Scores, legal: &Legal, start: Graph, tabu: usize) -> Graph {
    let mut here = start;
    let mut score = scores.total(&here);
    let (mut best, mut best_score) = (here.clone(), score);
    let mut seen: VecDeque<Graph> = VecDeque::from([here.clone()]);
    let mut patience = tabu;
    loop {
        let Some((gain, next)) = best_step(scores, legal, &here, &seen) else {
            return best;
        };
        score += gain;
        here = next;
        if score > best_score + ROUNDING * best_score.abs() {
            (best, best_score) = (here.clone(), score);
            patience = tabu;
        } else if patience == 0 {
            return best;
        } else {
            patience -= 1;
        }
        seen.push_back(here.clone());
        if seen.len() > tabu + 1 {
            seen.pop_front();
        }
    }
}

/// The move with the greatest gain to a graph that was not seen lately; of equal ones the first.
fn best_step(
    scores: &mut Scores,
    legal: &Legal,
    here: &Graph,
    seen: &VecDeque<Graph>,
) -> Option<(f64, Graph)> {
    let moves = here.moves(legal);
    scores.prepare(moves.iter().flat_map(|&change| here.after(change)));
    let own: Vec<f64> = here
        .0
        .iter()
        .enumerate()
        .map(|(node, parents)| scores.get(node, parents))
        .collect();
    let mut gains: Vec<(f64, Move)> = moves
        .into_iter()
        .map(|change| {
            let families = here.after(change);
            let gain = families
                .iter()
                .map(|(node, parents)| scores.get(*node, parents) - own[*node])
                .sum();
            (gain, change)
        })
        .collect();
    gains.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    gains.into_iter().find_map(|(gain, change)| {
        let mut next = here.clone();
        next.apply(change);
        (!seen.contains(&next)).then_some((gain, next))
    })
}

/// Swaps neighbours of the order while that gains, each node with its best parents among those before it.
fn order_search(scores: &mut Scores, legal: &Legal, start: &Graph) -> Graph {
    let mut order = start.order();
    let mut graph = Graph(vec![Vec::new(); order.len()]);
    for place in 0..order.len() {
        graph.0[order[place]] = best_parents(scores, legal, order[place], &order[..place]);
    }
    loop {
        let mut gained = false;
        for place in 1..order.len() {
            let (first, second) = (order[place - 1], order[place]);
            // Only a swap that lets `first` hang below `second`, or frees `second` of `first`, can change anything.
            if legal.requires(first, second) || !legal.allows(second, first) {
                continue;
            }
            let before = &order[..place - 1];
            let new_second = best_parents(scores, legal, second, before);
            let mut longer = before.to_vec();
            longer.push(second);
            let new_first = best_parents(scores, legal, first, &longer);
            let old = scores.get(first, &graph.0[first]) + scores.get(second, &graph.0[second]);
            let new = scores.get(first, &new_first) + scores.get(second, &new_second);
            if new > old + ROUNDING * old.abs() {
                order.swap(place - 1, place);
                graph.0[first] = new_first;
                graph.0[second] = new_second;
                gained = true;
            }
        }
        if !gained {
            return graph;
        }
    }
}

/// Parents among `before` by greedy growing, then shrinking.
fn best_parents(scores: &mut Scores, legal: &Legal, node: usize, before: &[usize]) -> Vec<usize> {
    let mut parents = legal.required_parents(node);
    scores.prepare([(node, parents.clone())]);
    let mut score = scores.get(node, &parents);
    loop {
        let larger: Vec<Vec<usize>> = if parents.len() < legal.max_parents {
            let fresh = |from: &&usize| legal.allows(**from, node) && !parents.contains(from);
            before
                .iter()
                .filter(fresh)
                .map(|&from| with(&parents, from))
                .collect()
        } else {
            Vec::new()
        };
        let smaller = parents
            .iter()
            .filter(|&&from| !legal.requires(from, node))
            .map(|&from| without(&parents, from));
        let sets: Vec<Vec<usize>> = smaller.chain(larger).collect();
        scores.prepare(sets.iter().map(|set| (node, set.clone())));
        let mut best: Option<(f64, Vec<usize>)> = None;
        for set in sets {
            let other = scores.get(node, &set);
            if other > score + ROUNDING * score.abs() && best.as_ref().is_none_or(|(most, _)| other > *most) {
                best = Some((other, set));
            }
        }
        let Some((more, set)) = best else { return parents };
        (score, parents) = (more, set);
    }
}
