//! A model of scalars: what formats without vectors and mixtures can hold of a mixed model, without loss.
//!
//! A mixture gets a discrete node for its component; a vector becomes a chain of scalars, each a regression on those
//! before it, which has the same joint Gaussian.

use nalgebra::{DMatrix, DVector};

use crate::cpd::{Component, Cpd, DiscreteCpd, MixtureCpd, NodeIdx, Sign, Weights};
use crate::error::ModelError;
use crate::extra::Extra;
use crate::model::{Model, Node};

impl Model {
    /// The same distribution with one Gaussian per configuration and one dimension per node, and what was done to the
    /// nodes. Nodes of one Gaussian and one dimension stay as they are.
    pub(super) fn in_scalars(&self) -> Result<(Self, Vec<String>), ModelError> {
        let mut nodes: Vec<Node> = Vec::new();
        let mut notes = Vec::new();
        // Positions of a node's scalars (a discrete node's: itself) in the new model.
        let mut places: Vec<Vec<NodeIdx>> = vec![Vec::new(); self.nodes().len()];
        for &idx in self.order() {
            let node = self.node(idx);
            let moved = |parents: &[NodeIdx]| -> Vec<NodeIdx> {
                parents
                    .iter()
                    .flat_map(|parent| places[parent.0].clone())
                    .collect()
            };
            match &node.cpd {
                Cpd::Discrete(cpd) => {
                    let cpd = DiscreteCpd {
                        parents: moved(&cpd.parents),
                        ..cpd.clone()
                    };
                    places[idx.0] = vec![NodeIdx(nodes.len())];
                    nodes.push(plain(&node.name, Cpd::Discrete(cpd)));
                }
                // The writers refuse such models before.
                Cpd::VonMisesFisher(_) => {}
                Cpd::Mixture(cpd) => {
                    let mut discrete = moved(&cpd.discrete_parents);
                    let continuous = moved(&cpd.continuous_parents);
                    let mut rows = signed_rows(cpd);
                    let most = rows.iter().map(Vec::len).max().unwrap_or(1);
                    if most > 1 {
                        let name = format!("{}_component", node.name);
                        notes.push(format!(
                            "the components of `{}` are the states of a new node `{name}`",
                            node.name
                        ));
                        nodes.push(plain(
                            &name,
                            Cpd::Discrete(components(&rows, most, discrete.clone())),
                        ));
                        discrete.push(NodeIdx(nodes.len() - 1));
                        rows = spread(rows, most);
                    }
                    if cpd.dim() > 1 || cpd.columns[0] != node.name {
                        notes.push(format!(
                            "`{}` is split into the scalar nodes {}",
                            node.name,
                            cpd.columns.join(", ")
                        ));
                    }
                    let first = nodes.len();
                    places[idx.0] = (first..first + cpd.dim()).map(NodeIdx).collect();
                    let chains: Vec<Vec<Component>> = rows.iter().map(|row| chain(&row[0])).collect();
                    for (d, column) in cpd.columns.iter().enumerate() {
                        let mut parents = continuous.clone();
                        parents.extend((first..first + d).map(NodeIdx));
                        nodes.push(plain(
                            column,
                            Cpd::Mixture(MixtureCpd {
                                columns: vec![column.clone()],
                                discrete_parents: discrete.clone(),
                                continuous_parents: parents,
                                components: chains.iter().map(|chain| vec![chain[d].clone()]).collect(),
                                weights: Weights::PerConfiguration,
                                sign: Sign::Fixed,
                                sphere: false,
                                scaling: None,
                            }),
                        ));
                    }
                }
            }
        }
        let model = Self::new(nodes, Extra::default())?;
        Ok((model, notes))
    }
}

fn plain(name: &str, cpd: Cpd) -> Node {
    Node {
        name: name.into(),
        cpd,
        extra: Extra::default(),
    }
}

/// The rows of components, a latent sign written out.
fn signed_rows(cpd: &MixtureCpd) -> Vec<Vec<Component>> {
    let written = |component: &Component| match cpd.sign {
        Sign::Fixed => vec![component.clone()],
        Sign::Latent => [1.0, -1.0]
            .into_iter()
            .map(|sign| Component {
                weight: 0.5 * component.weight,
                mean: sign * &component.mean,
                coefficients: sign * &component.coefficients,
                covariance: component.covariance.clone(),
            })
            .collect(),
    };
    cpd.components
        .iter()
        .map(|row| row.iter().flat_map(written).collect())
        .collect()
}

/// The node of the component: its table has the weights.
fn components(rows: &[Vec<Component>], most: usize, parents: Vec<NodeIdx>) -> DiscreteCpd {
    let table = rows
        .iter()
        .map(|row| {
            let total: f64 = row.iter().map(|component| component.weight).sum();
            (0..most)
                .map(|k| row.get(k).map_or(0.0, |component| component.weight / total))
                .collect()
        })
        .collect();
    DiscreteCpd {
        states: (0..most).map(|k| format!("c{k}")).collect(),
        parents,
        table,
    }
}

/// One row per configuration and component; where a configuration has fewer, the first stands in with weight 0.
fn spread(rows: Vec<Vec<Component>>, most: usize) -> Vec<Vec<Component>> {
    rows.into_iter()
        .flat_map(|row| {
            (0..most)
                .map(|k| vec![row.get(k).unwrap_or(&row[0]).clone()])
                .collect::<Vec<_>>()
        })
        .collect()
}

/// N(mean + C p, Σ) as scalars: with Σ = L D Lᵀ, x = mean + C p + L e, so that L⁻¹ gives each dimension as a
/// regression on p and on those before it, with the variance Dᵢᵢ.
fn chain(component: &Component) -> Vec<Component> {
    let (d, q) = component.coefficients.shape();
    let (lower, variances) = unit_lower(&component.covariance);
    // x = m + C p + L e  ⇒  xᵢ = (m + C p)ᵢ + Σⱼ<ᵢ Aᵢⱼ (xⱼ − (m + C p)ⱼ) + eᵢ with A = I − L⁻¹.
    let mut inverse = DMatrix::identity(d, d);
    for c in 0..d {
        for i in c + 1..d {
            let sum: f64 = (c..i).map(|k| lower[(i, k)] * inverse[(k, c)]).sum();
            inverse[(i, c)] = -sum;
        }
    }
    let mean = &inverse * &component.mean;
    let own = &inverse * &component.coefficients;
    (0..d)
        .map(|i| Component {
            weight: 1.0,
            mean: DVector::from_element(1, mean[i]),
            coefficients: DMatrix::from_fn(
                1,
                q + i,
                |_, j| if j < q { own[(i, j)] } else { -inverse[(i, j - q)] },
            ),
            covariance: DMatrix::from_element(1, 1, variances[i]),
        })
        .collect()
}

/// Unit lower triangular L and the diagonal of D; directions without variance get none.
fn unit_lower(covariance: &DMatrix<f64>) -> (DMatrix<f64>, Vec<f64>) {
    let root = crate::double_double::covariance_root(covariance).lower;
    let d = root.nrows();
    let lower = DMatrix::from_fn(d, d, |i, j| match (i == j, root[(j, j)] > 0.0) {
        (true, _) => 1.0,
        (false, true) => root[(i, j)] / root[(j, j)],
        (false, false) => 0.0,
    });
    (lower, (0..d).map(|i| root[(i, i)] * root[(i, i)]).collect())
}
