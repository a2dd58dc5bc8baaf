//! DOT, for pictures by Graphviz.

use super::Export;
use crate::cpd::Cpd;
use crate::model::Model;

impl Model {
    /// The arcs as a DOT graph: discrete nodes are boxes, continuous ones ellipses with their dimension and most
    /// components. The numbers are not in it.
    pub fn to_dot(&self) -> Export {
        let mut text = String::from("digraph model {\n  rankdir=TB;\n  node [fontname=\"Helvetica\"];\n");
        for node in self.nodes() {
            let (shape, note) = match &node.cpd {
                Cpd::Discrete(cpd) => ("box", format!("{} states", cpd.states.len())),
                Cpd::VonMisesFisher(cpd) => {
                    let k = cpd.components.iter().map(Vec::len).max().unwrap_or(0);
                    ("ellipse", format!("direction, dim {}, {k} comp.", cpd.dim()))
                }
                Cpd::Mixture(cpd) => {
                    let k = cpd.components.iter().map(Vec::len).max().unwrap_or(0);
                    ("ellipse", format!("dim {}, {k} comp.", cpd.dim()))
                }
            };
            let name = quote(&node.name);
            text += &format!("  \"{name}\" [shape={shape}, label=\"{name}\\n{note}\"];\n");
        }
        for node in self.nodes() {
            for parent in node.parents() {
                text += &format!(
                    "  \"{}\" -> \"{}\";\n",
                    quote(&self.node(parent).name),
                    quote(&node.name)
                );
            }
        }
        text += "}\n";
        Export {
            text,
            losses: vec!["DOT holds nodes and arcs, no distributions".into()],
        }
    }
}

fn quote(text: &str) -> String {
    text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', " ")
}
