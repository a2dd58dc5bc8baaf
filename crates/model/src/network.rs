//! A network that is to be trained: which nodes there are, which arcs, and how each is to be trained.

use crate::arcs::topological_order;
use crate::cpd::{Sign, Weights};
use crate::error::ModelError;
use crate::structure::StructureRules;

/// Structure and training settings of a network, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    pub(crate) nodes: Vec<NodeSpec>,
    pub(crate) group: Option<String>,
    pub(crate) order: Vec<usize>,
    pub(crate) structure: StructureRules,
}

/// One node of a [`Network`].
#[derive(Debug, Clone, PartialEq)]
pub struct NodeSpec {
    /// Name, unique.
    pub name: String,
    /// Discrete or continuous, with its settings.
    pub kind: NodeKind,
    /// Positions of the parents, in the file's order.
    pub parents: Vec<usize>,
}

/// Discrete or continuous, with its settings.
#[derive(Debug, Clone, PartialEq)]
pub enum NodeKind {
    /// A node with states.
    Discrete {
        /// Names of the states.
        states: Vec<String>,
        /// Pseudo-count of each state (Dirichlet prior), at least 0.
        prior: f64,
    },
    /// A vector with a mixture of linear regressions per configuration of its discrete parents.
    Mixture(MixtureSpec),
    /// A unit vector with a mixture of von Mises–Fisher distributions per configuration of its parents.
    VonMisesFisher(VonMisesFisherSpec),
}

/// Settings of a continuous node.
#[derive(Debug, Clone, PartialEq)]
pub struct MixtureSpec {
    /// Column of each dimension.
    pub columns: Vec<String>,
    /// How many components.
    pub order: MixtureOrder,
    /// Which configurations share components or weights.
    pub weights: Weights,
    /// Whether all components of all configurations have one covariance.
    pub shared_covariance: bool,
    /// Smallest standard deviation of each column, in its unit; 0 for none.
    pub noise_floor: Vec<f64>,
    /// Whether q and −q are the same value.
    pub sign: Sign,
    /// Whether the values are unit vectors.
    pub sphere: bool,
}

/// Settings of a node of unit vectors.
#[derive(Debug, Clone, PartialEq)]
pub struct VonMisesFisherSpec {
    /// Column of each coordinate, at least two.
    pub columns: Vec<String>,
    /// How many components; without a guard.
    pub order: MixtureOrder,
    /// Smallest spread in radians: no concentration is above its inverse square.
    pub noise_floor: f64,
}

/// How many components a mixture gets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MixtureOrder {
    /// Exactly this many, fewer only where a cell has too few rows.
    Fixed(usize),
    /// Between 1 and `max`, by the least BIC; with `guard`, no more than cross-validation over groups bears out.
    Bic {
        /// Most components to try.
        max: usize,
        /// Whether cross-validation over groups has a say.
        guard: bool,
    },
}

impl Network {
    /// The same nodes with other arcs: positions of the parents, one list per node.
    ///
    /// # Errors
    ///
    /// The lists do not fit the nodes, a discrete node gets a continuous parent, or the arcs form a cycle.
    pub fn with_parents(&self, parents: &[Vec<usize>]) -> Result<Self, ModelError> {
        let n = self.nodes.len();
        if parents.len() != n || parents.iter().flatten().any(|&parent| parent >= n) {
            return Err(ModelError::Length {
                what: "the lists of parents".into(),
                found: parents.len(),
                expected: n,
            });
        }
        for (node, parents) in self.nodes.iter().zip(parents) {
            let continuous = parents.iter().find(|&&parent| !self.nodes[parent].is_discrete());
            if let (NodeKind::Discrete { .. }, Some(&parent)) = (&node.kind, continuous) {
                return Err(ModelError::ContinuousParent {
                    node: node.name.clone(),
                    parent: self.nodes[parent].name.clone(),
                });
            }
        }
        let names: Vec<&str> = self.nodes.iter().map(|node| node.name.as_str()).collect();
        let order = topological_order(&names, parents)?;
        let mut network = self.clone();
        network.order = order;
        for (node, parents) in network.nodes.iter_mut().zip(parents) {
            node.parents.clone_from(parents);
        }
        Ok(network)
    }

    /// What the search for arcs must respect.
    pub fn structure(&self) -> &StructureRules {
        &self.structure
    }

    /// The nodes, in the file's order.
    pub fn nodes(&self) -> &[NodeSpec] {
        &self.nodes
    }

    /// Column whose values mark rows that belong together (`group` in the file), for example the object.
    pub fn group(&self) -> Option<&str> {
        self.group.as_deref()
    }

    /// Positions of the nodes such that parents come first.
    pub fn order(&self) -> &[usize] {
        &self.order
    }

    /// All columns that training reads.
    pub fn columns(&self) -> Vec<String> {
        self.nodes.iter().flat_map(NodeSpec::columns).collect()
    }
}

impl NodeSpec {
    /// Whether the node has states.
    pub fn is_discrete(&self) -> bool {
        matches!(self.kind, NodeKind::Discrete { .. })
    }

    /// Columns of a table that hold this node's values: a discrete node's column has its name.
    pub fn columns(&self) -> Vec<String> {
        match &self.kind {
            NodeKind::Discrete { .. } => vec![self.name.clone()],
            NodeKind::Mixture(spec) => spec.columns.clone(),
            NodeKind::VonMisesFisher(spec) => spec.columns.clone(),
        }
    }
}
