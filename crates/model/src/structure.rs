//! Learning the arcs of a network from rows: which families explain the data best?
//!
//! The score of a network is the sum over its families (node and parents) of what the fitted CPD is worth, mixtures
//! included ([`StructureScore`]). The search climbs from several starts with a tabu list, and over orders of the nodes;
//! every family is fitted once. What a mixed network forbids (a continuous parent of a discrete node) and what the network
//! file's table `[structure]` says ([`StructureRules`]) always holds, and the result never has a cycle.

mod family_score;
mod graph;
mod mixture_score;
mod rules;
mod scores;
mod search;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

pub use family_score::StructureScore;
pub(crate) use rules::RawRules;
pub use rules::StructureRules;

use crate::error::ModelError;
use crate::groups::read_groups;
use crate::network::Network;
use crate::table::Table;
use family_score::{FitEffort, Sample, Scorer};
use graph::{Graph, without};
use rules::Legal;
use scores::Scores;
use search::{Effort, search};

/// Settings of [`learn_structure`]. The paper learns no structure and gives none of them.
#[derive(Debug, Clone, PartialEq)]
pub struct StructureOptions {
    /// Every random choice follows from it.
    pub seed: u64,
    /// What is maximised.
    pub score: StructureScore,
    /// Steps that a climb goes on without a new best graph; as many graphs are not visited again.
    pub tabu: usize,
    /// Shaken graphs to climb from anew.
    pub restarts: usize,
    /// Whether to search over orders of the nodes too.
    pub orders: bool,
    /// Resamples of the rows (of whole groups, where a column names them) for the arcs' confidence; 0 for none.
    pub bootstrap: usize,
    /// Most components of a mixture while searching; training of the result tries more.
    pub max_components: usize,
    /// Starts of EM for each mixture.
    pub fit_restarts: usize,
    /// Column of rows that belong together; `None` takes the network's `group`.
    pub group: Option<String>,
}

impl Default for StructureOptions {
    fn default() -> Self {
        Self {
            seed: 0,
            score: StructureScore::Bic,
            tabu: 10,
            restarts: 3,
            orders: true,
            bootstrap: 0,
            max_components: 4,
            fit_restarts: 2,
            group: None,
        }
    }
}

/// A network whose arcs were learned.
#[derive(Debug, Clone, PartialEq)]
pub struct LearnedStructure {
    /// The nodes of the given network with the learned arcs.
    pub network: Network,
    /// Its score, in nats; greater is better.
    pub score: f64,
    /// The score of the arcs that the network came with.
    pub given_score: f64,
    /// The learned arcs, by `to` and then by `from`.
    pub arcs: Vec<LearnedArc>,
    /// Arcs that the result lacks though half of the resamples or more have them.
    pub rivals: Vec<LearnedArc>,
    /// Rows that had every column.
    pub n_rows: usize,
    /// Families that were fitted, without those of the resamples.
    pub n_families: usize,
    /// What a person should know.
    pub warnings: Vec<String>,
}

/// An arc and what speaks for it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct LearnedArc {
    /// The parent.
    pub from: String,
    /// The child.
    pub to: String,
    /// What the score loses without it, nats; for a rival what it would lose with it, as a negative number.
    pub gain: f64,
    /// Share of the resamples that have this arc.
    pub confidence: Option<f64>,
    /// Share of the resamples that have it or its reverse.
    pub either_direction: Option<f64>,
}

/// Learns the arcs of a network from rows.
///
/// The nodes' own `parents` are one of the starts, and their score is reported; they bind nothing. Only rows that have
/// every column count, so that all families speak of the same rows.
///
/// # Errors
///
/// As [`Model::fit`](crate::Model::fit); rules that contradict each other; [`ModelError::NoRows`] where no row is complete.
///
/// # Source
///
/// The paper draws its arcs by hand and names learning them as future work (section VII). Tabu climbing as in Glover
/// (1989), order search as in Teyssier and Koller (2005), arc confidence as in Friedman, Goldszmidt and Wyner (1999).
///
/// # Examples
///
/// ```
/// use prehend_model::{Network, StructureOptions, Table, learn_structure};
///
/// let network = Network::from_toml(r#"
///     [[node]]
///     name = "task"
///     kind = "discrete"
///     states = ["pour", "use"]
///     [[node]]
///     name = "width"
///     kind = "gaussian_mixture"
/// "#)?;
/// let (mut tasks, mut widths) = (vec![], vec![]);
/// for i in 0..100 {
///     tasks.push(if i % 2 == 0 { "pour".to_string() } else { "use".to_string() });
///     widths.push(f64::from(i % 2) + 0.01 * f64::from(i % 7));
/// }
/// let table = Table::new(100).with_text("task", tasks)?.with_numbers("width", widths)?;
/// let learned = learn_structure(&network, &table, &StructureOptions::default())?;
/// assert_eq!((learned.arcs[0].from.as_str(), learned.arcs[0].to.as_str()), ("task", "width"));
/// # Ok::<(), prehend_model::ModelError>(())
/// ```
pub fn learn_structure(
    network: &Network,
    table: &Table,
    options: &StructureOptions,
) -> Result<LearnedStructure, ModelError> {
    let legal = Legal::new(network)?;
    let Data {
        scorer,
        groups,
        n_rows,
        warnings,
    } = Data::read(network, table, options)?;
    let effort = Effort {
        tabu: options.tabu,
        restarts: options.restarts,
        orders: options.orders,
    };
    let given = Graph::of(network);
    let mut scores = Scores::new(&scorer, Sample(vec![1.0; n_rows]));
    let starts: Vec<Graph> = if given.arcs().all(|(from, to)| legal.allows(from, to)) {
        vec![given.joined(&Graph::least(&legal))]
            .into_iter()
            .flatten()
            .collect()
    } else {
        Vec::new()
    };
    let graph = search(&mut scores, &legal, &starts, effort, options.seed);
    let score = scores.total(&graph);
    let resampled = resample(&scorer, &legal, options, groups.as_deref(), n_rows);
    let name = |node: usize| network.nodes()[node].name.clone();
    let share = |count: usize| (options.bootstrap > 0).then(|| count as f64 / options.bootstrap as f64);
    let mut describe = |from: usize, to: usize| {
        let own = &graph.0[to];
        let other = if graph.has(from, to) {
            without(own, from)
        } else {
            graph::with(own, from)
        };
        let gain = scores.get(to, own) - scores.get(to, &other);
        LearnedArc {
            from: name(from),
            to: name(to),
            gain: if graph.has(from, to) { gain } else { -gain },
            confidence: share(resampled[from][to]),
            either_direction: share(resampled[from][to] + resampled[to][from]),
        }
    };
    let arcs = graph.arcs().map(|(from, to)| describe(from, to)).collect();
    let n = legal.n_nodes();
    let often = |&(from, to): &(usize, usize)| {
        !graph.has(from, to) && options.bootstrap > 0 && 2 * resampled[from][to] >= options.bootstrap
    };
    let rivals = (0..n)
        .flat_map(|to| (0..n).map(move |from| (from, to)))
        .filter(often)
        .map(|(from, to)| describe(from, to))
        .collect();
    Ok(LearnedStructure {
        network: network.with_parents(&graph.0)?,
        score,
        given_score: scores.total(&given),
        arcs,
        rivals,
        n_rows,
        n_families: scores.n_families(),
        warnings,
    })
}

/// The score of each family of a network, in its nodes' order: their sum is the network's score.
///
/// # Errors
///
/// As [`learn_structure`].
pub fn score_structure(
    network: &Network,
    table: &Table,
    options: &StructureOptions,
) -> Result<Vec<f64>, ModelError> {
    let data = Data::read(network, table, options)?;
    let mut scores = Scores::new(&data.scorer, Sample(vec![1.0; data.n_rows]));
    let graph = Graph::of(network);
    scores.total(&graph);
    Ok((0..graph.0.len())
        .map(|node| scores.get(node, &graph.0[node]))
        .collect())
}

/// Complete rows, ready to be scored.
struct Data {
    scorer: Scorer,
    groups: Option<Vec<usize>>,
    n_rows: usize,
    warnings: Vec<String>,
}

impl Data {
    fn read(network: &Network, table: &Table, options: &StructureOptions) -> Result<Self, ModelError> {
        let mut warnings = Vec::new();
        let groups = read_groups(network, table, options.group.as_deref(), &mut warnings)?;
        let rows = complete_rows(network, table)?;
        if rows.is_empty() {
            let node = network
                .nodes()
                .first()
                .map_or(String::new(), |node| node.name.clone());
            return Err(ModelError::NoRows {
                node,
                n_rows: table.n_rows(),
            });
        }
        if rows.len() < table.n_rows() {
            warnings.push(format!(
                "{} of {} rows lack a column and were left out, so that all families speak of the same rows",
                table.n_rows() - rows.len(),
                table.n_rows()
            ));
        }
        let groups: Option<Vec<usize>> =
            groups.map(|groups| rows.iter().map(|&row| groups.of_row[row]).collect());
        let score = match options.score {
            StructureScore::CrossValidated { folds } => {
                StructureScore::CrossValidated { folds: folds.max(2) }
            }
            StructureScore::Bic => StructureScore::Bic,
        };
        let effort = FitEffort {
            seed: options.seed,
            restarts: options.fit_restarts,
            max_steps: 100,
            max_components: options.max_components.max(1),
        };
        let scorer = Scorer::read(network, &table.select(&rows), groups.as_deref(), score, effort)?;
        Ok(Self {
            scorer,
            groups,
            n_rows: rows.len(),
            warnings,
        })
    }
}

/// Rows that have a value in every column of every node.
fn complete_rows(network: &Network, table: &Table) -> Result<Vec<usize>, ModelError> {
    let mut complete = vec![true; table.n_rows()];
    for node in network.nodes() {
        for column in node.columns() {
            for (known, cell) in complete.iter_mut().zip(table.texts(&column, &node.name)?) {
                *known &= cell.is_some();
            }
        }
    }
    Ok((0..complete.len()).filter(|&row| complete[row]).collect())
}

/// How many resamples have each arc: `[from][to]`.
fn resample(
    scorer: &Scorer,
    legal: &Legal,
    options: &StructureOptions,
    groups: Option<&[usize]>,
    n_rows: usize,
) -> Vec<Vec<usize>> {
    // Rows that are drawn together.
    let mut units: Vec<Vec<usize>> = Vec::new();
    match groups {
        None => units.extend((0..n_rows).map(|row| vec![row])),
        Some(groups) => {
            let mut members = std::collections::BTreeMap::<usize, Vec<usize>>::new();
            for (row, group) in groups.iter().enumerate() {
                members.entry(*group).or_default().push(row);
            }
            units.extend(members.into_values());
        }
    }
    let effort = Effort {
        tabu: options.tabu,
        restarts: 0,
        orders: false,
    };
    let graphs: Vec<Graph> = (0..options.bootstrap)
        .into_par_iter()
        .map(|number| {
            let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
            rng.set_stream(1 << 32 | number as u64);
            let mut weights = vec![0.0; n_rows];
            for _ in 0..units.len() {
                for &row in &units[rng.random_range(0..units.len())] {
                    weights[row] += 1.0;
                }
            }
            let mut scores = Scores::new(scorer, Sample(weights));
            search(&mut scores, legal, &[], effort, options.seed)
        })
        .collect();
    let n = legal.n_nodes();
    let mut counts = vec![vec![0; n]; n];
    for (from, to) in graphs.iter().flat_map(Graph::arcs) {
        counts[from][to] += 1;
    }
    counts
}

impl Graph {
    /// The arcs of a network.
    fn of(network: &Network) -> Self {
        Self(
            network
                .nodes()
                .iter()
                .map(|node| {
                    let mut parents = node.parents.clone();
                    parents.sort_unstable();
                    parents
                })
                .collect(),
        )
    }

    /// Both graphs' arcs; `None` where they close a cycle.
    fn joined(&self, other: &Self) -> Option<Self> {
        let mut both = self.clone();
        for (from, to) in other.arcs() {
            both.0[to] = graph::with(&both.0[to], from);
        }
        (both.order().len() == both.0.len()).then_some(both)
    }
}
