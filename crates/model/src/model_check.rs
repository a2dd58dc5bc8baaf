//! What a model's tables and components must be: the right shape, sums of 1, covariances that are some.

use crate::cpd::{Component, Cpd, MixtureCpd};
use crate::double_double::{Root, covariance_root};
use crate::error::{ModelError, list};
use crate::model::Node;
use crate::von_mises_fisher::{MAX_CONCENTRATION, VonMisesFisherCpd};

/// Why a direction is nobody's continuous parent, and what to do.
const NO_DIRECTION_PARENT: &str =
    "is a von_mises_fisher_mixture, which is no continuous parent; make it a gaussian_mixture with `sphere`";
/// Rows of tables and of mixture weights sum to 1 within this: what six printed digits of each entry allow.
const SUM_TOLERANCE: f64 = 1e-5;
/// Asymmetry and negative eigenvalues of a covariance up to this share of its largest entry are rounding.
const SYMMETRY_TOLERANCE: f64 = 1e-9;

/// The roots of all covariances: per node, configuration and component. Nodes with no covariance have none.
pub(crate) fn check_nodes(nodes: &[Node]) -> Result<Vec<Vec<Vec<Root>>>, ModelError> {
    let mut roots = Vec::with_capacity(nodes.len());
    for node in nodes {
        roots.push(match &node.cpd {
            Cpd::Discrete(_) => {
                check_table(node, nodes)?;
                Vec::new()
            }
            Cpd::Mixture(cpd) => check_mixture(node, cpd, nodes)?,
            Cpd::VonMisesFisher(cpd) => {
                check_directions(node, cpd, nodes)?;
                Vec::new()
            }
        });
    }
    Ok(roots)
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
    check_rows(node, "table", cpd.table.len(), n_rows)?;
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
    check_rows(node, "components", cpd.components.len(), n_rows)?;
    let mut factors = Vec::with_capacity(n_rows);
    for (configuration, row) in cpd.components.iter().enumerate() {
        let bad = |component: usize, problem: String| ModelError::BadComponent {
            node: node.name.clone(),
            configuration,
            component,
            problem,
        };
        let mut row_factors = Vec::with_capacity(row.len());
        for (k, component) in row.iter().enumerate() {
            row_factors.push(check_component(component, cpd.dim(), q).map_err(|problem| bad(k, problem))?);
        }
        check_sum(row.iter().map(|component| component.weight))
            .map_err(|problem| bad(row.len().saturating_sub(1), problem))?;
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
    check_rows(node, "components", cpd.components.len(), n_rows)?;
    for (configuration, row) in cpd.components.iter().enumerate() {
        let bad = |component: usize, problem: String| ModelError::BadComponent {
            node: node.name.clone(),
            configuration,
            component,
            problem,
        };
        for (k, component) in row.iter().enumerate() {
            check_weight(component.weight).map_err(|problem| bad(k, problem))?;
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
        check_sum(row.iter().map(|component| component.weight))
            .map_err(|problem| bad(row.len().saturating_sub(1), problem))?;
    }
    Ok(())
}

fn check_component(component: &Component, d: usize, q: usize) -> Result<Root, String> {
    let covariance = &component.covariance;
    check_weight(component.weight)?;
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

fn check_rows(node: &Node, key: &str, found: usize, expected: usize) -> Result<(), ModelError> {
    if found == expected {
        return Ok(());
    }
    Err(ModelError::Length {
        what: format!("`{key}` of `{}`", node.name),
        found,
        expected,
    })
}

fn check_weight(weight: f64) -> Result<(), String> {
    if weight >= 0.0 && weight.is_finite() {
        return Ok(());
    }
    Err(format!("the weight is {weight}; expected a number of at least 0"))
}

/// A row of no components sums to 0.
fn check_sum(weights: impl Iterator<Item = f64>) -> Result<(), String> {
    let sum: f64 = weights.sum();
    if (sum - 1.0).abs() <= SUM_TOLERANCE {
        return Ok(());
    }
    Err(format!("the weights of this row sum to {sum}; expected 1"))
}
