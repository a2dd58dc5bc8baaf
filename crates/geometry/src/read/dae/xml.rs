//! Elements of an XML document: by name, by id, as numbers, and where they stand.

use std::collections::BTreeMap;
use std::str::FromStr;

use roxmltree::{Document, Node};

use super::FORMAT;
use crate::GeometryError;
use crate::read::text::{error, quoted};

/// A document whose elements can be found by id.
pub(super) struct Xml<'a, 'i> {
    document: &'a Document<'i>,
    by_id: BTreeMap<&'a str, Node<'a, 'i>>,
}

impl<'a, 'i> Xml<'a, 'i> {
    pub fn new(document: &'a Document<'i>) -> Self {
        let mut by_id = BTreeMap::new();
        for node in document.descendants() {
            if let Some(id) = node.attribute("id") {
                by_id.entry(id).or_insert(node);
            }
        }
        Self { document, by_id }
    }

    /// The element that an attribute such as `url="#id"` names.
    pub fn named(&self, node: Node<'a, 'i>, attribute: &str) -> Result<Node<'a, 'i>, GeometryError> {
        let reference = self.attribute(node, attribute)?;
        reference
            .strip_prefix('#')
            .and_then(|id| self.by_id.get(id).copied())
            .ok_or_else(|| {
                self.error(
                    node,
                    format!("{attribute} {}", quoted(reference)),
                    "the id of an element in this file",
                )
            })
    }

    pub fn attribute(&self, node: Node<'a, '_>, name: &str) -> Result<&'a str, GeometryError> {
        node.attribute(name).ok_or_else(|| {
            self.error(
                node,
                format!("<{}>", node.tag_name().name()),
                format!("the attribute {name}"),
            )
        })
    }

    /// A whole number in an attribute, or `default` where there is none.
    pub fn count(&self, node: Node, name: &str, default: usize) -> Result<usize, GeometryError> {
        match node.attribute(name) {
            None => Ok(default),
            Some(word) => word
                .trim()
                .parse()
                .map_err(|_| self.error(node, format!("{name} {}", quoted(word)), "a whole number")),
        }
    }

    /// The words of an element's text as whole numbers.
    pub fn whole_numbers<T: FromStr>(&self, node: Node) -> Result<Vec<T>, GeometryError> {
        let parse = |word: &str| {
            word.parse()
                .map_err(|_| self.error(node, quoted(word), "a whole number"))
        };
        words(node).map(parse).collect()
    }

    /// The words of an element's text as finite numbers.
    pub fn numbers(&self, node: Node) -> Result<Vec<f64>, GeometryError> {
        let parse = |word: &str| match word.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(self.error(node, quoted(word), "a finite number")),
        };
        words(node).map(parse).collect()
    }

    /// The words of an element's text as exactly N finite numbers.
    pub fn exactly<const N: usize>(&self, node: Node) -> Result<[f64; N], GeometryError> {
        let numbers = self.numbers(node)?;
        let n = numbers.len();
        numbers.try_into().map_err(|_| {
            self.error(
                node,
                format!("{n} numbers in <{}>", node.tag_name().name()),
                N.to_string(),
            )
        })
    }

    /// The error at an element.
    pub fn error(&self, node: Node, found: String, expected: impl Into<String>) -> GeometryError {
        let line = self.document.text_pos_at(node.range().start).row;
        error(FORMAT, format!("line {line}"), found, expected)
    }
}

fn words<'a>(node: Node<'a, '_>) -> impl Iterator<Item = &'a str> {
    node.children()
        .filter(Node::is_text)
        .flat_map(|text| text.text().unwrap_or("").split_ascii_whitespace())
}

/// The children with a name.
pub(super) fn children<'a, 'i>(node: Node<'a, 'i>, name: &str) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children()
        .filter(move |child| child.tag_name().name() == name)
}

/// The first child with a name.
pub(super) fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    children(node, name).next()
}
