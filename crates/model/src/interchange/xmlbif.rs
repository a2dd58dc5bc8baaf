//! XMLBIF 0.3: the same networks as BIF, as XML.

use roxmltree::{Document, ParsingOptions};

use super::{At, Export, Foreign, discrete_model};
use crate::error::ModelError;
use crate::model::Model;

const FORMAT: &str = "XMLBIF";

const HEADER: &str =
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<BIF VERSION=\"0.3\">\n<NETWORK>\n<NAME>prehend</NAME>\n";

impl Model {
    /// Reads XMLBIF.
    ///
    /// # Errors
    ///
    /// [`ModelError::TextFile`] with the line; otherwise what [`Model::new`] finds.
    pub fn from_xmlbif(text: &str) -> Result<Self, ModelError> {
        let options = ParsingOptions {
            allow_dtd: true,
            ..ParsingOptions::default()
        };
        let document = Document::parse_with_options(text, options).map_err(|e| {
            let at = At {
                format: FORMAT,
                line: e.pos().row as usize,
            };
            at.error(e.to_string(), "well-formed XML")
        })?;
        let at = |node: &roxmltree::Node| At {
            format: FORMAT,
            line: document.text_pos_at(node.range().start).row as usize,
        };
        let root = document.root_element();
        let Some(network) = root.children().find(|node| node.has_tag_name("NETWORK")) else {
            return Err(at(&root).error(
                format!("<{}> without <NETWORK>", root.tag_name().name()),
                "<BIF><NETWORK>",
            ));
        };
        let mut nodes: Vec<Foreign> = Vec::new();
        for element in network.children().filter(|node| node.has_tag_name("VARIABLE")) {
            let texts = |tag: &str| child_texts(&element, tag);
            let kind = element.attribute("TYPE").unwrap_or("nature");
            if kind != "nature" {
                return Err(at(&element).error(format!("a variable of type \"{kind}\""), "\"nature\""));
            }
            let Some(name) = texts("NAME").into_iter().next() else {
                return Err(at(&element).error("a variable without <NAME>", "<NAME>"));
            };
            let states = texts("OUTCOME");
            if nodes.iter().any(|node| node.name == name) {
                return Err(ModelError::DuplicateNode { node: name });
            }
            nodes.push(Foreign {
                name,
                states,
                line: at(&element).line,
                parents: Vec::new(),
                table: None,
            });
        }
        let definitions = network
            .children()
            .filter(|node| node.has_tag_name("DEFINITION") || node.has_tag_name("PROBABILITY"));
        for element in definitions {
            let child = child_texts(&element, "FOR");
            let [child] = child.as_slice() else {
                return Err(at(&element).error(format!("{} <FOR>", child.len()), "one"));
            };
            let Some(node) = nodes.iter_mut().find(|node| node.name == *child) else {
                return Err(at(&element).error(format!("a definition of `{child}`"), "one of a <VARIABLE>"));
            };
            if node.table.is_some() {
                return Err(at(&element).error(format!("a second definition of `{child}`"), "one"));
            }
            let mut table = Vec::new();
            for word in child_texts(&element, "TABLE")
                .iter()
                .flat_map(|text| text.split_whitespace())
            {
                let number = word.parse().ok().filter(|p: &f64| p.is_finite());
                table.push(number.ok_or_else(|| at(&element).error(format!("`{word}`"), "a probability"))?);
            }
            node.parents = child_texts(&element, "GIVEN");
            (node.table, node.line) = (Some(table), at(&element).line);
        }
        discrete_model(FORMAT, nodes)
    }

    /// Writes the discrete nodes as XMLBIF. Nothing of them is lost; the continuous nodes are listed as losses.
    ///
    /// # Errors
    ///
    /// [`ModelError::Export`] where no node is discrete.
    pub fn to_xmlbif(&self) -> Result<Export, ModelError> {
        let (nodes, losses) = self.discrete_part(FORMAT)?;
        let mut text = String::from(HEADER);
        for (idx, cpd) in &nodes {
            text += &format!(
                "<VARIABLE TYPE=\"nature\">\n  <NAME>{}</NAME>\n",
                escape(&self.node(*idx).name)
            );
            for state in &cpd.states {
                text += &format!("  <OUTCOME>{}</OUTCOME>\n", escape(state));
            }
            text += "</VARIABLE>\n";
        }
        for (idx, cpd) in &nodes {
            text += &format!("<DEFINITION>\n  <FOR>{}</FOR>\n", escape(&self.node(*idx).name));
            for parent in &cpd.parents {
                text += &format!("  <GIVEN>{}</GIVEN>\n", escape(&self.node(*parent).name));
            }
            text += "  <TABLE>\n";
            for row in &cpd.table {
                let words: Vec<String> = row.iter().map(f64::to_string).collect();
                text += &format!("    {}\n", words.join(" "));
            }
            text += "  </TABLE>\n</DEFINITION>\n";
        }
        text += "</NETWORK>\n</BIF>\n";
        Ok(Export { text, losses })
    }
}

/// Texts of the children with this tag, without the blanks around them.
fn child_texts(element: &roxmltree::Node, tag: &str) -> Vec<String> {
    let text = |node: roxmltree::Node| -> String {
        node.children()
            .filter_map(|part| part.text())
            .collect::<String>()
            .trim()
            .to_owned()
    };
    element
        .children()
        .filter(|node| node.has_tag_name(tag))
        .map(text)
        .collect()
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
