//! A network as a picture: parents above children, arcs as curves with a label and a strength.
//!
//! A node's layer is the length of the longest way to it. Arcs that pass layers get a bend in each, and bends and nodes
//! are put into an order with few crossings by sweeps of mean neighbour positions (Sugiyama, Tagawa and Toda, 1981).

use std::fmt::Write as _;

use crate::figure::{Anchor, Figure, Pen};
use crate::palette::{ACCENT, INK, MUTED, PAPER};

/// A node of a [`network_figure`].
#[derive(Debug, Clone, PartialEq)]
pub struct NetworkNode {
    /// What stands in it.
    pub name: String,
    /// Discrete nodes are boxes, continuous ones have round ends.
    pub discrete: bool,
}

/// An arc of a [`network_figure`].
#[derive(Debug, Clone, PartialEq)]
pub struct NetworkArc {
    /// Position of the parent.
    pub from: usize,
    /// Position of the child.
    pub to: usize,
    /// What stands beside it; empty for nothing.
    pub label: String,
    /// 0 to 1: faint and thin to dark and thick.
    pub strength: f64,
}

const LAYER: f64 = 108.0;
const GAP: f64 = 44.0;
const NODE_HEIGHT: f64 = 32.0;
const MARGIN: f64 = 24.0;
const SWEEPS: usize = 12;

/// Something that takes a place in a layer: a node, or the bend of an arc that passes.
struct Place {
    layer: usize,
    /// The node, `None` for a bend.
    node: Option<usize>,
    width: f64,
    x: f64,
}

/// The picture of a directed acyclic graph. Arcs that name no node, or lead from a node to itself, are left out.
///
/// # Examples
///
/// ```
/// use prehend_report::{NetworkArc, NetworkNode, network_figure};
///
/// let node = |name: &str, discrete| NetworkNode { name: name.into(), discrete };
/// let arc = NetworkArc { from: 0, to: 1, label: "0.98".into(), strength: 0.98 };
/// let figure = network_figure("net", "task leads to size", &[node("task", true), node("size", false)], &[arc]);
/// assert!(figure.svg.contains(">task<") && figure.svg.contains(">0.98<"));
/// ```
pub fn network_figure(name: &str, alt: &str, nodes: &[NetworkNode], arcs: &[NetworkArc]) -> Figure {
    let arcs: Vec<&NetworkArc> = arcs
        .iter()
        .filter(|arc| arc.from < nodes.len() && arc.to < nodes.len() && arc.from != arc.to)
        .collect();
    let layers = layers(nodes.len(), &arcs);
    let (places, ways) = lay_out(nodes, &arcs, &layers);
    let width = places.iter().map(|p| p.x + 0.5 * p.width).fold(0.0, f64::max) + MARGIN;
    let depth = layers.iter().copied().max().unwrap_or(0);
    let mut pen = Pen::new(
        width.max(2.0 * MARGIN),
        2.0 * MARGIN + NODE_HEIGHT + depth as f64 * LAYER,
    );
    let y = |layer: usize| MARGIN + 0.5 * NODE_HEIGHT + layer as f64 * LAYER;
    let mut labels = Vec::new();
    for (arc, way) in arcs.iter().zip(&ways) {
        let mut points: Vec<[f64; 2]> = way.iter().map(|&p| [places[p].x, y(places[p].layer)]).collect();
        let last = points.len() - 1;
        points[0] = [fan(&places, &ways, way, true), points[0][1] + 0.5 * NODE_HEIGHT];
        points[last] = [
            fan(&places, &ways, way, false),
            points[last][1] - 0.5 * NODE_HEIGHT,
        ];
        let strength = if arc.strength.is_finite() {
            arc.strength.clamp(0.0, 1.0)
        } else {
            0.0
        };
        draw_way(&mut pen, &points, 0.8 + 1.7 * strength, 0.3 + 0.7 * strength);
        // Labels stand near the head, where ways of different parents are told apart best.
        let ([x0, y0], [x1, y1]) = (points[last - 1], points[last]);
        labels.push(([0.42 * x0 + 0.58 * x1, 0.42 * y0 + 0.58 * y1], arc.label.as_str()));
    }
    for place in &places {
        let Some(node) = place.node else { continue };
        let corner = if nodes[node].discrete {
            3.0
        } else {
            0.5 * NODE_HEIGHT
        };
        let (left, top) = (place.x - 0.5 * place.width, y(place.layer) - 0.5 * NODE_HEIGHT);
        let stroke = if nodes[node].discrete { ACCENT } else { INK };
        pen.rounded([left, top, place.width, NODE_HEIGHT], corner, PAPER, stroke);
        pen.text(
            [place.x, y(place.layer) + 4.5],
            Anchor::Middle,
            13.0,
            INK,
            &nodes[node].name,
        );
    }
    for ([x, y], label) in labels.into_iter().filter(|(_, label)| !label.is_empty()) {
        let width = 6.2 * label.chars().count() as f64 + 4.0;
        pen.rect([x - 0.5 * width, y - 7.0, width, 14.0], PAPER, 0.85);
        pen.text([x, y + 3.8], Anchor::Middle, 10.5, MUTED, label);
    }
    pen.finish(name, alt)
}

/// The same graph in Graphviz's language.
pub fn network_dot(nodes: &[NetworkNode], arcs: &[NetworkArc]) -> String {
    let quoted = |text: &str| format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""));
    let mut out = String::from("digraph network {\n");
    for node in nodes {
        let shape = if node.discrete { "box" } else { "ellipse" };
        let _ = writeln!(out, "  {} [shape={shape}];", quoted(&node.name));
    }
    for arc in arcs
        .iter()
        .filter(|arc| arc.from < nodes.len() && arc.to < nodes.len())
    {
        let (from, to) = (quoted(&nodes[arc.from].name), quoted(&nodes[arc.to].name));
        let label = quoted(&arc.label);
        let _ = writeln!(
            out,
            "  {from} -> {to} [label={label}, penwidth={:.2}];",
            0.8 + 1.7 * arc.strength
        );
    }
    out + "}\n"
}

/// Longest way from a node without parents. A cycle ends the count.
fn layers(n: usize, arcs: &[&NetworkArc]) -> Vec<usize> {
    let mut layers = vec![0; n];
    for _ in 0..n {
        let mut moved = false;
        for arc in arcs {
            if layers[arc.to] <= layers[arc.from] && layers[arc.from] + 1 < n {
                layers[arc.to] = layers[arc.from] + 1;
                moved = true;
            }
        }
        if !moved {
            break;
        }
    }
    layers
}

/// Places of nodes and bends, and the places that each arc passes.
fn lay_out(nodes: &[NetworkNode], arcs: &[&NetworkArc], layers: &[usize]) -> (Vec<Place>, Vec<Vec<usize>>) {
    let mut places: Vec<Place> = nodes
        .iter()
        .enumerate()
        .map(|(node, shown)| Place {
            layer: layers[node],
            node: Some(node),
            width: 26.0 + 7.6 * shown.name.chars().count() as f64,
            x: 0.0,
        })
        .collect();
    let mut ways = Vec::with_capacity(arcs.len());
    for arc in arcs {
        let mut way = vec![arc.from];
        for layer in layers[arc.from] + 1..layers[arc.to] {
            way.push(places.len());
            places.push(Place {
                layer,
                node: None,
                width: 8.0,
                x: 0.0,
            });
        }
        way.push(arc.to);
        ways.push(way);
    }
    let mut above = vec![Vec::new(); places.len()];
    let mut below = vec![Vec::new(); places.len()];
    for pair in ways.iter().flat_map(|way| way.windows(2)) {
        above[pair[1]].push(pair[0]);
        below[pair[0]].push(pair[1]);
    }
    let depth = layers.iter().copied().max().unwrap_or(0);
    let mut rows: Vec<Vec<usize>> = (0..=depth)
        .map(|layer| (0..places.len()).filter(|&p| places[p].layer == layer).collect())
        .collect();
    for row in &rows {
        spread(&mut places, row);
    }
    for sweep in 0..SWEEPS {
        let down = sweep % 2 == 0;
        for step in 1..=depth {
            let layer = if down { step } else { depth - step };
            let neighbours = if down { &above } else { &below };
            let wish = |p: usize, places: &[Place]| {
                let near = &neighbours[p];
                if near.is_empty() {
                    places[p].x
                } else {
                    near.iter().map(|&q| places[q].x).sum::<f64>() / near.len() as f64
                }
            };
            let wishes: Vec<f64> = (0..places.len()).map(|p| wish(p, &places)).collect();
            let row = &mut rows[layer];
            row.sort_by(|&a, &b| wishes[a].total_cmp(&wishes[b]));
            for &p in row.iter() {
                places[p].x = wishes[p];
            }
            spread(&mut places, row);
        }
    }
    let left = places
        .iter()
        .map(|p| p.x - 0.5 * p.width)
        .fold(f64::INFINITY, f64::min);
    for place in &mut places {
        place.x += MARGIN - left;
    }
    (places, ways)
}

/// Keeps the order of a row, and moves its places apart, as little as the middle of the row allows.
fn spread(places: &mut [Place], row: &[usize]) {
    let Some(&first) = row.first() else { return };
    let wanted: f64 = row.iter().map(|&p| places[p].x).sum::<f64>() / row.len() as f64;
    let mut right = places[first].x;
    for pair in row.windows(2) {
        let apart = 0.5 * (places[pair[0]].width + places[pair[1]].width) + GAP;
        right = places[pair[1]].x.max(right + apart);
        places[pair[1]].x = right;
    }
    let found: f64 = row.iter().map(|&p| places[p].x).sum::<f64>() / row.len() as f64;
    for &p in row {
        places[p].x += wanted - found;
    }
}

/// Where a way leaves or meets its node: side by side with the others, by where they come from.
fn fan(places: &[Place], ways: &[Vec<usize>], way: &[usize], tail: bool) -> f64 {
    let end = |way: &[usize]| if tail { way[0] } else { way[way.len() - 1] };
    let next = |way: &[usize]| if tail { way[1] } else { way[way.len() - 2] };
    let node = &places[end(way)];
    let mut others: Vec<usize> = ways
        .iter()
        .filter(|other| end(other) == end(way))
        .map(|w| next(w))
        .collect();
    others.sort_by(|&a, &b| places[a].x.total_cmp(&places[b].x));
    let rank = others.iter().position(|&other| other == next(way)).unwrap_or(0);
    let n = others.len() as f64;
    node.x + (rank as f64 - 0.5 * (n - 1.0)) * (0.6 * node.width / n).min(14.0)
}

/// A curve through points from top to bottom, upright at each, with an arrow head.
fn draw_way(pen: &mut Pen, points: &[[f64; 2]], width: f64, opacity: f64) {
    let mut path = format!("M{:.1} {:.1}", points[0][0], points[0][1]);
    let last = points.len() - 1;
    for (i, pair) in points.windows(2).enumerate() {
        let ([x0, y0], [x1, y1]) = (pair[0], pair[1]);
        let y1 = if i + 1 == last { y1 - 6.0 } else { y1 };
        let bend = 0.42 * (y1 - y0);
        let _ = write!(
            path,
            " C{x0:.1} {:.1} {x1:.1} {:.1} {x1:.1} {y1:.1}",
            y0 + bend,
            y1 - bend
        );
    }
    pen.path(&path, INK, width, opacity);
    let [x, y] = points[last];
    let head = [[x, y], [x - 3.6, y - 8.0], [x + 3.6, y - 8.0]];
    pen.polygon(&head, INK, opacity);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(name: &str) -> NetworkNode {
        NetworkNode {
            name: name.into(),
            discrete: name == "t",
        }
    }

    fn arc(from: usize, to: usize) -> NetworkArc {
        NetworkArc {
            from,
            to,
            label: String::new(),
            strength: 1.0,
        }
    }

    #[test]
    fn children_stand_below_their_parents_and_places_of_a_row_apart() {
        let nodes = ["t", "a", "b", "c"].map(node);
        let arcs = [arc(0, 1), arc(1, 2), arc(0, 2), arc(0, 3)];
        let arcs: Vec<&NetworkArc> = arcs.iter().collect();
        let layers = layers(4, &arcs);
        assert_eq!(layers, [0, 1, 2, 1]);
        let (places, ways) = lay_out(&nodes, &arcs, &layers);
        // The arc t → b passes the layer of a and c.
        assert_eq!(ways[2].len(), 3);
        for (i, a) in places.iter().enumerate() {
            for b in places[..i].iter().filter(|b| b.layer == a.layer) {
                assert!((a.x - b.x).abs() >= 0.5 * (a.width + b.width) + GAP - 1e-9);
            }
        }
    }

    #[test]
    fn cycles_and_strange_arcs_still_give_a_picture() {
        let nodes = ["a", "b"].map(node);
        let figure = network_figure("x", "y", &nodes, &[arc(0, 1), arc(1, 0), arc(0, 0), arc(7, 0)]);
        assert!(figure.svg.starts_with("<svg"));
        assert!(network_figure("x", "nothing", &[], &[]).svg.contains("nothing"));
    }

    #[test]
    fn dot_quotes_names() {
        let text = network_dot(&[node("t"), node("a\"b")], &[arc(0, 1)]);
        assert_eq!(
            text,
            "digraph network {\n  \"t\" [shape=box];\n  \"a\\\"b\" [shape=ellipse];\n  \"t\" -> \"a\\\"b\" [label=\"\", penwidth=2.50];\n}\n"
        );
    }
}
