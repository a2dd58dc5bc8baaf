//! Training: rows, likelihoods, and how many components each node took.

use maud::{Markup, html};

use crate::charts::{Curve, curves};
use crate::figure::slug;
use crate::page::Sheet;

/// One network trained on one hand's grasps.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NetworkTraining {
    /// The hand.
    pub hand: String,
    /// The network.
    pub network: String,
    /// Rows after balancing, per task.
    pub rows: Vec<usize>,
    /// Mean log-likelihood a row, nats.
    pub log_likelihood: f64,
    /// The same on held-out rows.
    pub holdout_log_likelihood: Option<f64>,
    /// One entry a continuous node.
    pub nodes: Vec<NodeTraining>,
}

/// One node's fit.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NodeTraining {
    /// The node.
    pub node: String,
    /// Its parents.
    pub parents: Vec<String>,
    /// Components chosen (the largest, where configurations differ).
    pub components: usize,
    /// Number of components and BIC (nats, larger is better) of every order tried; may be empty.
    pub bic: Vec<(usize, f64)>,
    /// Steps of EM.
    pub steps: usize,
    /// What the guard did: a spike refused, a floor touched; empty where nothing.
    pub note: String,
}

pub(crate) fn render(networks: &[NetworkTraining], out: &mut Sheet) -> Markup {
    let tasks = out.tasks.to_vec();
    html! {
        p { "Every continuous node is a mixture of linear Gaussians given its parents, fitted by EM on a set balanced per task; the number of components is BIC's, or fewer where objects held out of training do not bear it out." }
        @if networks.is_empty() { p.muted { "No network was trained in this run." } } @else {
            div.wide { table {
                caption { "Trained networks: rows after balancing, and the mean log-likelihood a row in nats." }
                thead { tr { th { "Hand" } th { "Network" } @for task in &tasks { th.n { (task) } }
                    th.n { "Training" } th.n { "Held out" } th { "Components" } } }
                tbody { @for n in networks { tr {
                    td { (n.hand) } td { (n.network) } @for rows in &n.rows { td.n { (rows) } }
                    td.n { (format!("{:.2}", n.log_likelihood)) }
                    td.n { @match n.holdout_log_likelihood { Some(l) => (format!("{l:.2}")), None => "–" } }
                    td { (n.nodes.iter().map(|n| format!("{} {}", n.node, n.components)).collect::<Vec<_>>().join(", ")) }
                } } }
            } }
        }
        div.pair { @for network in networks { (bic(network, out)) } }
        @for network in networks { (nodes(network)) }
    }
}

fn bic(network: &NetworkTraining, out: &mut Sheet) -> Markup {
    // Nodes have different units and dimensions, so each curve is drawn as the loss against its own best order.
    let lines: Vec<Curve> = network
        .nodes
        .iter()
        .filter(|n| n.bic.len() > 1)
        .map(|n| {
            let best = n.bic.iter().map(|(_, b)| *b).fold(f64::NEG_INFINITY, f64::max);
            let rows = network.rows.iter().sum::<usize>().max(1) as f64;
            Curve {
                label: n.node.clone(),
                points: n
                    .bic
                    .iter()
                    .map(|(k, b)| (*k as f64, (b - best) / rows))
                    .collect(),
            }
        })
        .collect();
    if lines.is_empty() {
        return html! {};
    }
    let name = format!("bic-{}-{}", slug(&network.hand), slug(&network.network));
    let alt = format!(
        "{}, network {}: BIC by number of components for {} nodes; BIC's choice for each is where its curve meets 0.",
        network.hand,
        network.network,
        lines.len()
    );
    let figure = curves(&name, &alt, "components", "BIC − best, nats a row", &lines);
    out.figure(&figure, &html! {
        strong { (network.hand) ", " (network.network) } ": BIC by number of components, less each node's own best and divided by the number of rows. A curve meets 0 at BIC's choice; the table above has the number taken."
    })
}

fn nodes(network: &NetworkTraining) -> Markup {
    html! {
        details {
            summary { (network.hand) ", " (network.network) ": nodes" }
            div.wide { table {
                thead { tr { th { "Node" } th { "Parents" } th.n { "Components" } th.n { "Best BIC" } th.n { "Steps" } th { "Note" } } }
                tbody { @for n in &network.nodes { tr {
                    td { code { (n.node) } } td { (n.parents.join(", ")) } td.n { (n.components) }
                    td.n { @match n.bic.iter().map(|(_, b)| *b).max_by(f64::total_cmp) { Some(b) => (format!("{b:.0}")), None => "–" } }
                    td.n { (n.steps) } td { (n.note) }
                } } }
            } }
        }
    }
}
