//! A trained or hand-written network: nodes with their distributions, checked as a whole.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use crate::arcs::{check_columns, topological_order};
use crate::cpd::{Cpd, MixtureCpd, NodeIdx};
use crate::double_double::Root;
use crate::error::{ModelError, list};
use crate::extra::Extra;
use crate::model_check::check_nodes;

/// A node: a name and its distribution given its parents.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// Name, unique in the model.
    pub name: String,
    /// Distribution given the parents.
    pub cpd: Cpd,
    /// Further keys of the file, kept as they are.
    pub extra: Extra,
}

/// A mixed Bayesian network (Eq. 1): P(x) = Π P(xᵢ | parents of xᵢ), checked as a whole.
#[derive(Debug, Clone)]
pub struct Model {
    pub(crate) nodes: Vec<Node>,
    extra: Extra,
    order: Vec<NodeIdx>,
    names: BTreeMap<String, NodeIdx>,
    /// Per node, configuration and component: the root of the covariance.
    factors: Vec<Vec<Vec<Root>>>,
}

impl PartialEq for Model {
    fn eq(&self, other: &Self) -> bool {
        self.nodes == other.nodes && self.extra == other.extra
    }
}

impl Model {
    /// Checks the nodes and puts them in order. `extra` are keys that stand beside `nodes` in the file.
    ///
    /// # Errors
    ///
    /// Duplicate names or columns, cycles, a continuous parent of a discrete node, tables and components of the wrong
    /// shape, rows that do not sum to 1, covariances that are not symmetric or have a negative eigenvalue.
    pub fn new(nodes: Vec<Node>, extra: Extra) -> Result<Self, ModelError> {
        let mut names = BTreeMap::new();
        for (i, node) in nodes.iter().enumerate() {
            if names.insert(node.name.clone(), NodeIdx(i)).is_some() {
                return Err(ModelError::DuplicateNode {
                    node: node.name.clone(),
                });
            }
        }
        check_columns(nodes.iter().map(|node| (node.name.as_str(), node.columns())))?;
        let parents: Vec<Vec<usize>> = nodes
            .iter()
            .map(|node| node.parents().iter().map(|parent| parent.0).collect())
            .collect();
        let labels: Vec<&str> = nodes.iter().map(|node| node.name.as_str()).collect();
        let order = topological_order(&labels, &parents)?
            .into_iter()
            .map(NodeIdx)
            .collect();
        let factors = check_nodes(&nodes)?;
        Ok(Self {
            nodes,
            extra,
            order,
            names,
            factors,
        })
    }

    /// All nodes, in the file's order.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Keys that stand beside `nodes` in the file, for example `provenance`.
    pub fn extra(&self) -> &Extra {
        &self.extra
    }

    /// The same model with one more key beside `nodes`, its value as JSON text.
    ///
    /// # Errors
    ///
    /// As [`Extra::with`].
    pub fn with_extra(mut self, key: &str, json: &str) -> Result<Self, ModelError> {
        self.extra = self.extra.with(key, json)?;
        Ok(self)
    }

    /// The node of this name.
    ///
    /// # Errors
    ///
    /// [`ModelError::UnknownNode`] with the names that there are.
    pub fn index(&self, name: &str) -> Result<NodeIdx, ModelError> {
        self.names
            .get(name)
            .copied()
            .ok_or_else(|| ModelError::UnknownNode {
                node: name.into(),
                known: list(self.nodes.iter().map(|node| node.name.as_str())),
            })
    }

    /// The node at this position.
    pub fn node(&self, idx: NodeIdx) -> &Node {
        &self.nodes[idx.0]
    }

    /// Nodes such that parents come first.
    pub(crate) fn order(&self) -> &[NodeIdx] {
        &self.order
    }

    /// Cholesky factor of a component's covariance, `None` where singular.
    pub(crate) fn factor(
        &self,
        idx: NodeIdx,
        configuration: usize,
        component: usize,
    ) -> Option<&DMatrix<f64>> {
        let root = &self.factors[idx.0][configuration][component];
        (!root.singular).then_some(&root.lower)
    }

    /// Lower triangular square root of a component's covariance, singular or not.
    pub(crate) fn root(&self, idx: NodeIdx, configuration: usize, component: usize) -> &DMatrix<f64> {
        &self.factors[idx.0][configuration][component].lower
    }

    /// The mixture of a continuous node.
    pub(crate) fn mixture(&self, idx: NodeIdx) -> Option<&MixtureCpd> {
        match &self.nodes[idx.0].cpd {
            Cpd::Mixture(cpd) => Some(cpd),
            Cpd::Discrete(_) | Cpd::VonMisesFisher(_) => None,
        }
    }

    /// Number of states, 0 for a continuous node.
    pub(crate) fn n_states(&self, idx: NodeIdx) -> usize {
        match &self.nodes[idx.0].cpd {
            Cpd::Discrete(cpd) => cpd.states.len(),
            Cpd::Mixture(_) | Cpd::VonMisesFisher(_) => 0,
        }
    }

    /// Row of the table or of the components, from the states of all nodes (only the discrete parents' are read).
    pub(crate) fn configuration(&self, idx: NodeIdx, states: &[usize]) -> usize {
        let parents = self.nodes[idx.0].discrete_parents();
        parents
            .iter()
            .fold(0, |row, &parent| row * self.n_states(parent) + states[parent.0])
    }

    /// Free parameters of all nodes together.
    pub fn n_parameters(&self) -> usize {
        self.nodes
            .iter()
            .map(|node| match &node.cpd {
                Cpd::Discrete(cpd) => cpd.n_parameters(),
                Cpd::Mixture(cpd) => cpd.n_parameters(),
                Cpd::VonMisesFisher(cpd) => cpd.n_parameters(),
            })
            .sum()
    }
}

impl Node {
    /// All parents, the discrete ones first.
    pub fn parents(&self) -> Vec<NodeIdx> {
        match &self.cpd {
            Cpd::Discrete(cpd) => cpd.parents.clone(),
            Cpd::VonMisesFisher(cpd) => cpd.discrete_parents.clone(),
            Cpd::Mixture(cpd) => [&cpd.discrete_parents[..], &cpd.continuous_parents[..]].concat(),
        }
    }

    /// The parents whose configurations number the rows.
    pub fn discrete_parents(&self) -> &[NodeIdx] {
        match &self.cpd {
            Cpd::Discrete(cpd) => &cpd.parents,
            Cpd::Mixture(cpd) => &cpd.discrete_parents,
            Cpd::VonMisesFisher(cpd) => &cpd.discrete_parents,
        }
    }

    /// The parents whose values enter the regressions.
    pub fn continuous_parents(&self) -> &[NodeIdx] {
        match &self.cpd {
            Cpd::Discrete(_) | Cpd::VonMisesFisher(_) => &[],
            Cpd::Mixture(cpd) => &cpd.continuous_parents,
        }
    }

    /// Columns of a table that hold this node's values.
    pub fn columns(&self) -> Vec<String> {
        match &self.cpd {
            Cpd::Discrete(_) => vec![self.name.clone()],
            Cpd::Mixture(cpd) => cpd.columns.clone(),
            Cpd::VonMisesFisher(cpd) => cpd.columns.clone(),
        }
    }

    /// Names of the states, none for a continuous node.
    pub fn states(&self) -> &[String] {
        match &self.cpd {
            Cpd::Discrete(cpd) => &cpd.states,
            Cpd::Mixture(_) | Cpd::VonMisesFisher(_) => &[],
        }
    }
}
