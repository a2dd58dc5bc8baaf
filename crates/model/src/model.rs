//! A trained or hand-written network: nodes with their distributions, checked as a whole.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use crate::cpd::{Cpd, MixtureCpd, NodeIdx};
use crate::double_double::{Root, covariance_root};
use crate::error::{ModelError, list};
use crate::extra::Extra;
use crate::von_mises_fisher::{MAX_CONCENTRATION, VonMisesFisherCpd};

/// Rows of tables and of mixture weights sum to 1 within this: what six printed digits of each entry allow.
const SUM_TOLERANCE: f64 = 1e-5;
/// Why a direction is nobody's continuous parent, and what to do.
pub(crate) const NO_DIRECTION_PARENT: &str =
    "is a von_mises_fisher_mixture, which is no continuous parent; make it a gaussian_mixture with `sphere`";
/// Asymmetry and negative eigenvalues of a covariance up to this share of its largest entry are rounding.
const SYMMETRY_TOLERANCE: f64 = 1e-9;

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
        let mut factors = Vec::with_capacity(nodes.len());
        for node in &nodes {
            factors.push(match &node.cpd {
                Cpd::Discrete(_) => {
                    check_table(node, &nodes)?;
                    Vec::new()
                }
                Cpd::Mixture(cpd) => check_mixture(node, cpd, &nodes)?,
                Cpd::VonMisesFisher(cpd) => {
                    check_directions(node, cpd, &nodes)?;
                    Vec::new()
                }
            });
        }
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

/// Node positions such that parents come first; ties keep the given order.
pub(crate) fn topological_order(names: &[&str], parents: &[Vec<usize>]) -> Result<Vec<usize>, ModelError> {
    let mut placed = vec![false; names.len()];
    let mut order = Vec::with_capacity(names.len());
    while order.len() < names.len() {
        let next = (0..names.len()).find(|&i| !placed[i] && parents[i].iter().all(|&parent| placed[parent]));
        let Some(next) = next else {
            return Err(ModelError::Cycle {
                node: names[on_a_cycle(&placed, parents)].into(),
            });
        };
        placed[next] = true;
        order.push(next);
    }
    Ok(order)
}

/// Walks from any unplaced node to unplaced parents until one repeats: that one lies on a cycle.
fn on_a_cycle(placed: &[bool], parents: &[Vec<usize>]) -> usize {
    let mut node = placed.iter().position(|&done| !done).unwrap_or(0);
    let mut seen = vec![false; placed.len()];
    while !seen[node] {
        seen[node] = true;
        node = parents[node]
            .iter()
            .copied()
            .find(|&parent| !placed[parent])
            .unwrap_or(node);
    }
    node
}

/// Refuses a column that two nodes, or two dimensions of one, share.
pub(crate) fn check_columns<'a>(
    nodes: impl Iterator<Item = (&'a str, Vec<String>)>,
) -> Result<(), ModelError> {
    let mut owners: BTreeMap<String, &str> = BTreeMap::new();
    for (node, columns) in nodes {
        for column in columns {
            if let Some(first) = owners.insert(column.clone(), node) {
                return Err(ModelError::DuplicateColumn {
                    column,
                    first: first.into(),
                    second: node.into(),
                });
            }
        }
    }
    Ok(())
}

/// Product of the parents' numbers of states. A continuous parent among them is an error.
fn n_configurations(node: &Node, nodes: &[Node]) -> Result<usize, ModelError> {
    let mut product = 1usize;
    for parent in node.discrete_parents() {
        let parent = &nodes[parent.0];
        match &parent.cpd {
            Cpd::Discrete(cpd) => product = product.saturating_mul(cpd.states.len()),
            Cpd::Mixture(_) | Cpd::VonMisesFisher(_) => {
                return Err(match &node.cpd {
                    Cpd::Discrete(_) => ModelError::ContinuousParent {
                        node: node.name.clone(),
                        parent: parent.name.clone(),
                    },
                    Cpd::VonMisesFisher(_) => ModelError::ModelFile {
                        place: format!("node `{}`", node.name),
                        problem: format!(
                            "`{}` stands in discrete_parents but is continuous; a von_mises_fisher_mixture has discrete \
                             parents only, a gaussian_mixture with `sphere` takes both",
                            parent.name
                        ),
                    },
                    Cpd::Mixture(_) => ModelError::ModelFile {
                        place: format!("node `{}`", node.name),
                        problem: format!(
                            "`{}` stands in discrete_parents but is continuous; move it to continuous_parents",
                            parent.name
                        ),
                    },
                });
            }
        }
    }
    Ok(product)
}

fn check_table(node: &Node, nodes: &[Node]) -> Result<(), ModelError> {
    let Cpd::Discrete(cpd) = &node.cpd else {
        return Ok(());
    };
    let n_rows = n_configurations(node, nodes)?;
    let mut states: Vec<&str> = cpd.states.iter().map(String::as_str).collect();
    states.sort_unstable();
    states.dedup();
    if cpd.states.is_empty() || states.len() < cpd.states.len() {
        return Err(ModelError::BadSetting {
            node: node.name.clone(),
            key: "states".into(),
            found: list(cpd.states.iter().map(String::as_str)),
            expected: "at least one state, each with its own name".into(),
        });
    }
    if cpd.table.len() != n_rows {
        return Err(ModelError::Length {
            what: format!("`table` of `{}`", node.name),
            found: cpd.table.len(),
            expected: n_rows,
        });
    }
    for (row, entries) in cpd.table.iter().enumerate() {
        let sum: f64 = entries.iter().sum();
        let bad = entries.len() != cpd.states.len()
            || entries.iter().any(|p| !p.is_finite() || *p < 0.0)
            || (sum - 1.0).abs() > SUM_TOLERANCE;
        if bad {
            return Err(ModelError::BadTable {
                node: node.name.clone(),
                row,
                found: format!("{entries:?} (sum {sum})"),
                expected: format!("{} probabilities that sum to 1", cpd.states.len()),
            });
        }
    }
    Ok(())
}

fn check_mixture(node: &Node, cpd: &MixtureCpd, nodes: &[Node]) -> Result<Vec<Vec<Root>>, ModelError> {
    let n_rows = n_configurations(node, nodes)?;
    let place = || format!("node `{}`", node.name);
    let mut q = 0;
    for parent in &cpd.continuous_parents {
        match &nodes[parent.0].cpd {
            Cpd::Mixture(parent) => q += parent.dim(),
            Cpd::VonMisesFisher(_) => {
                return Err(ModelError::ModelFile {
                    place: place(),
                    problem: format!("`{}` {}", nodes[parent.0].name, NO_DIRECTION_PARENT),
                });
            }
            Cpd::Discrete(_) => {
                return Err(ModelError::ModelFile {
                    place: place(),
                    problem: format!(
                        "`{}` stands in continuous_parents but is discrete; move it to discrete_parents",
                        nodes[parent.0].name
                    ),
                });
            }
        }
    }
    if cpd.columns.is_empty() {
        return Err(ModelError::ModelFile {
            place: place(),
            problem: "`columns` is empty".into(),
        });
    }
    if let Some(scaling) = &cpd.scaling {
        let d = cpd.dim();
        let positive = scaling
            .standard_deviation
            .iter()
            .all(|s| *s > 0.0 && s.is_finite());
        if scaling.mean.len() != d || scaling.standard_deviation.len() != d || !positive {
            let problem = format!("`scaling` needs {d} means and {d} positive standard deviations");
            return Err(ModelError::ModelFile {
                place: place(),
                problem,
            });
        }
    }
    if cpd.components.len() != n_rows {
        return Err(ModelError::Length {
            what: format!("`components` of `{}`", node.name),
            found: cpd.components.len(),
            expected: n_rows,
        });
    }
    let mut factors = Vec::with_capacity(n_rows);
    for (configuration, row) in cpd.components.iter().enumerate() {
        let bad = |component: usize, problem: String| ModelError::BadComponent {
            node: node.name.clone(),
            configuration,
            component,
            problem,
        };
        let sum: f64 = row.iter().map(|component| component.weight).sum();
        let mut row_factors = Vec::with_capacity(row.len());
        for (k, component) in row.iter().enumerate() {
            row_factors.push(check_component(component, cpd.dim(), q).map_err(|problem| bad(k, problem))?);
        }
        if row.is_empty() || (sum - 1.0).abs() > SUM_TOLERANCE {
            let problem = format!("the weights of this row sum to {sum}; expected 1");
            return Err(bad(row.len().saturating_sub(1), problem));
        }
        factors.push(row_factors);
    }
    if let Some((configuration, component, problem)) = cpd.unshared() {
        return Err(ModelError::BadComponent {
            node: node.name.clone(),
            configuration,
            component,
            problem,
        });
    }
    Ok(factors)
}

fn check_directions(node: &Node, cpd: &VonMisesFisherCpd, nodes: &[Node]) -> Result<(), ModelError> {
    let n_rows = n_configurations(node, nodes)?;
    let d = cpd.dim();
    if d < 2 {
        return Err(ModelError::ModelFile {
            place: format!("node `{}`", node.name),
            problem: format!("`columns` has {d} entries; a direction needs at least 2"),
        });
    }
    if cpd.components.len() != n_rows {
        return Err(ModelError::Length {
            what: format!("`components` of `{}`", node.name),
            found: cpd.components.len(),
            expected: n_rows,
        });
    }
    for (configuration, row) in cpd.components.iter().enumerate() {
        let bad = |component: usize, problem: String| ModelError::BadComponent {
            node: node.name.clone(),
            configuration,
            component,
            problem,
        };
        for (k, component) in row.iter().enumerate() {
            if !(component.weight >= 0.0 && component.weight.is_finite()) {
                let problem = format!(
                    "the weight is {}; expected a number of at least 0",
                    component.weight
                );
                return Err(bad(k, problem));
            }
            if component.direction.len() != d
                || (component.direction.norm() - 1.0).abs() > SUM_TOLERANCE
                || component.direction.iter().any(|v| !v.is_finite())
            {
                let problem = format!(
                    "`direction` is {:?}; expected a unit vector of {d} numbers",
                    component.direction.as_slice()
                );
                return Err(bad(k, problem));
            }
            if !(0.0..=MAX_CONCENTRATION).contains(&component.concentration) {
                let problem = format!(
                    "`concentration` is {}; expected a number from 0 to {MAX_CONCENTRATION}",
                    component.concentration
                );
                return Err(bad(k, problem));
            }
        }
        let sum: f64 = row.iter().map(|component| component.weight).sum();
        if row.is_empty() || (sum - 1.0).abs() > SUM_TOLERANCE {
            let problem = format!("the weights of this row sum to {sum}; expected 1");
            return Err(bad(row.len().saturating_sub(1), problem));
        }
    }
    Ok(())
}

fn check_component(component: &crate::cpd::Component, d: usize, q: usize) -> Result<Root, String> {
    let covariance = &component.covariance;
    if !(component.weight >= 0.0 && component.weight.is_finite()) {
        return Err(format!(
            "the weight is {}; expected a number of at least 0",
            component.weight
        ));
    }
    if component.mean.len() != d {
        return Err(format!(
            "`mean` has {} entries; expected {d}, one per column",
            component.mean.len()
        ));
    }
    if component.coefficients.nrows() != d || component.coefficients.ncols() != q {
        return Err(format!(
            "`coefficients` is {} × {}; expected {d} × {q} (columns × values of the continuous parents)",
            component.coefficients.nrows(),
            component.coefficients.ncols()
        ));
    }
    if covariance.nrows() != d || covariance.ncols() != d {
        let (rows, columns) = covariance.shape();
        return Err(format!("`covariance` is {rows} × {columns}; expected {d} × {d}"));
    }
    let numbers = component
        .mean
        .iter()
        .chain(component.coefficients.iter())
        .chain(covariance.iter());
    if numbers.into_iter().any(|value| !value.is_finite()) {
        return Err("a number is NaN or infinite".into());
    }
    let largest = covariance.amax();
    if (covariance - covariance.transpose()).amax() > SYMMETRY_TOLERANCE * largest {
        return Err("`covariance` is not symmetric".into());
    }
    let factor = covariance_root(covariance);
    if factor.singular {
        let least = covariance.clone().symmetric_eigenvalues().min();
        if least < -SYMMETRY_TOLERANCE * largest {
            return Err(format!("`covariance` has the negative eigenvalue {least:.3e}"));
        }
    }
    Ok(factor)
}
