//! Hugin's NET: discrete nodes, and continuous ones of one dimension with linear Gaussians.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::lexer::{Style, Tokens};
use super::names::legal_names;
use super::{At, Export, distribution, find, n_configurations};
use crate::cpd::{Component, Cpd, DiscreteCpd, MixtureCpd, Sign, Weights};
use crate::error::ModelError;
use crate::extra::Extra;
use crate::model::{Model, Node};

const STYLE: Style = Style {
    format: "NET",
    in_words: "",
    comment: Some('%'),
};

/// A node as declared.
struct Declared {
    name: String,
    /// None for a continuous node.
    states: Option<Vec<String>>,
    line: usize,
    potential: Option<Potential>,
}

struct Potential {
    parents: Vec<String>,
    data: Data,
    at: At,
}

enum Data {
    Numbers(Vec<f64>),
    Normals(Vec<Normal>),
}

/// mean + Σ coefficient · parent, and the variance.
struct Normal {
    mean: f64,
    slopes: BTreeMap<String, f64>,
    variance: f64,
}

impl Model {
    /// Reads Hugin's NET: `node`, `discrete node`, `continuous node` and `potential`; other settings are passed over.
    /// Utility and decision nodes are errors.
    ///
    /// # Errors
    ///
    /// [`ModelError::TextFile`] with the line; otherwise what [`Model::new`] finds.
    pub fn from_net(text: &str) -> Result<Self, ModelError> {
        let mut tokens = Tokens::read(text, STYLE)?;
        let mut nodes: Vec<Declared> = Vec::new();
        while tokens.peek().is_some() {
            if tokens.pass("net") || tokens.pass("class") {
                while !tokens.pass("{") {
                    tokens.name("a name or `{`")?;
                }
                tokens.skip_past("}")?;
            } else if tokens.pass("potential") {
                potential(&mut tokens, &mut nodes)?;
            } else {
                let continuous = tokens.pass("continuous");
                if !continuous {
                    tokens.pass("discrete");
                }
                tokens.expect("node").map_err(|_| {
                    tokens.unexpected("`net`, `node`, `continuous node` or `potential` (decisions and utilities are not read)")
                })?;
                let node = declaration(&mut tokens, continuous)?;
                if nodes.iter().any(|other| other.name == node.name) {
                    return Err(ModelError::DuplicateNode { node: node.name });
                }
                nodes.push(node);
            }
        }
        build(nodes)
    }

    /// Writes the model as Hugin's NET. A mixture gets a discrete node for its component, a vector becomes a chain of
    /// scalars: the joint distribution is the same. Changed names and what else is not in the file are listed as losses.
    ///
    /// # Errors
    ///
    /// [`ModelError::Export`] where two names become one.
    pub fn to_net(&self) -> Result<Export, ModelError> {
        let is_direction = |node: &&Node| matches!(node.cpd, Cpd::VonMisesFisher(_));
        if let Some(node) = self.nodes().iter().find(is_direction) {
            return Err(ModelError::Export {
                format: STYLE.format.into(),
                problem: format!(
                    "`{}` is a von_mises_fisher_mixture, which it cannot hold; write .json or .bin, or train it as a \
                     gaussian_mixture",
                    node.name
                ),
            });
        }
        let (model, mut losses) = self.in_scalars().map_err(|e| ModelError::Export {
            format: STYLE.format.into(),
            problem: format!("{e}; rename a column or a node"),
        })?;
        let legal = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let all = model.nodes().iter().map(|node| node.name.as_str());
        let names = legal_names(STYLE.format, "node", all, legal, &mut losses)?;
        let mut text = String::from("net\n{\n}\n\n");
        for (node, name) in model.nodes().iter().zip(&names) {
            let label = node.name.replace(['"', '\n'], "'");
            match &node.cpd {
                Cpd::Discrete(cpd) => {
                    let states: Vec<String> = cpd
                        .states
                        .iter()
                        .map(|state| format!("\"{}\"", state.replace(['"', '\n'], "'")))
                        .collect();
                    text += &format!(
                        "node {name}\n{{\n  label = \"{label}\";\n  states = ( {} );\n}}\n\n",
                        states.join(" ")
                    );
                }
                Cpd::Mixture(_) | Cpd::VonMisesFisher(_) => {
                    text += &format!("continuous node {name}\n{{\n  label = \"{label}\";\n}}\n\n");
                }
            }
        }
        for (node, name) in model.nodes().iter().zip(&names) {
            let parents: Vec<&str> = node
                .parents()
                .iter()
                .map(|parent| names[parent.0].as_str())
                .collect();
            let given = if parents.is_empty() {
                String::new()
            } else {
                format!(" | {}", parents.join(" "))
            };
            let sizes: Vec<usize> = node
                .discrete_parents()
                .iter()
                .map(|&parent| model.n_states(parent))
                .collect();
            let entries: Vec<String> = match &node.cpd {
                Cpd::Discrete(cpd) => cpd
                    .table
                    .iter()
                    .map(|row| {
                        format!(
                            "( {} )",
                            row.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
                        )
                    })
                    .collect(),
                // Refused above.
                Cpd::VonMisesFisher(_) => Vec::new(),
                Cpd::Mixture(cpd) => {
                    let of: Vec<&str> = cpd
                        .continuous_parents
                        .iter()
                        .map(|parent| names[parent.0].as_str())
                        .collect();
                    cpd.components.iter().map(|row| normal(&row[0], &of)).collect()
                }
            };
            let data = match (&node.cpd, sizes.is_empty()) {
                (Cpd::Mixture(_), true) => format!("( {} )", entries[0]),
                _ => nested(&entries, &sizes),
            };
            text += &format!("potential ( {name}{given} )\n{{\n  data = {data};\n}}\n\n");
        }
        let kept_apart =
            |node: &Node| matches!(&node.cpd, Cpd::Mixture(cpd) if cpd.scaling.is_some() || cpd.sphere);
        for node in self.nodes().iter().filter(|node| kept_apart(node)) {
            losses.push(format!(
                "`{}`: its scaling, and whether its values are unit vectors, are left out",
                node.name
            ));
        }
        Ok(Export { text, losses })
    }
}

/// `normal ( mean + slope * PARENT …, variance )`
fn normal(component: &Component, parents: &[&str]) -> String {
    let mut mean = component.mean[0].to_string();
    for (slope, parent) in component.coefficients.iter().zip(parents) {
        if *slope != 0.0 {
            let sign = if slope.is_sign_negative() { '-' } else { '+' };
            mean += &format!(" {sign} {} * {parent}", slope.abs());
        }
    }
    format!("normal ( {mean}, {} )", component.covariance[0])
}

/// Entries in brackets, one level per parent.
fn nested(entries: &[String], sizes: &[usize]) -> String {
    match sizes.split_first() {
        None => entries[0].clone(),
        Some((n, rest)) => {
            let parts: Vec<String> = entries
                .chunks(entries.len() / n)
                .map(|part| nested(part, rest))
                .collect();
            format!("( {} )", parts.join("\n    "))
        }
    }
}

/// `NAME { states = ( "a" "b" ); … }`
fn declaration(tokens: &mut Tokens, continuous: bool) -> Result<Declared, ModelError> {
    let line = tokens.at().line;
    let name = tokens.name("a node's name")?;
    tokens.expect("{")?;
    let mut states = None;
    while !tokens.pass("}") {
        let key = tokens.name("a setting or `}`")?;
        tokens.expect("=")?;
        if key == "states" {
            tokens.expect("(")?;
            let mut all = Vec::new();
            while !tokens.pass(")") {
                all.push(tokens.name("a state")?);
            }
            tokens.expect(";")?;
            states = Some(all);
        } else {
            tokens.skip_past(";")?;
        }
    }
    if !continuous && states.is_none() {
        let at = At {
            format: STYLE.format,
            line,
        };
        return Err(at.error(
            format!("`{name}` without `states`"),
            "states = ( … ); or `continuous node`",
        ));
    }
    Ok(Declared {
        name,
        states: states.filter(|_| !continuous),
        line,
        potential: None,
    })
}

/// `( CHILD | PARENTS ) { data = …; }`
fn potential(tokens: &mut Tokens, nodes: &mut [Declared]) -> Result<(), ModelError> {
    let at = tokens.at();
    tokens.expect("(")?;
    let child = tokens.name("a node")?;
    let mut parents = Vec::new();
    tokens.pass("|");
    while !tokens.pass(")") {
        parents.push(tokens.name("a parent")?);
    }
    let Some(node) = nodes.iter_mut().find(|node| node.name == child) else {
        return Err(at.error(
            format!("a potential of `{child}`"),
            "one of a node declared before",
        ));
    };
    if node.potential.is_some() {
        return Err(at.error(format!("a second potential of `{child}`"), "one"));
    }
    tokens.expect("{")?;
    let mut data = None;
    while !tokens.pass("}") {
        let key = tokens.name("`data`")?;
        tokens.expect("=")?;
        if key == "data" {
            data = Some(if node.states.is_some() {
                Data::Numbers(numbers(tokens)?)
            } else {
                Data::Normals(normals(tokens, &parents)?)
            });
        } else if key == "model_data" || key == "model_nodes" {
            return Err(tokens.at().error(
                format!("`{key}`"),
                "`data`: expressions are not read; save it with tables",
            ));
        } else {
            tokens.skip_past(";")?;
        }
    }
    let Some(data) = data else {
        return Err(at.error(
            format!("a potential of `{child}` without `data`"),
            "data = ( … );",
        ));
    };
    node.potential = Some(Potential { parents, data, at });
    Ok(())
}

/// Numbers up to `;`; brackets say nothing that the sizes do not.
fn numbers(tokens: &mut Tokens) -> Result<Vec<f64>, ModelError> {
    let mut out = Vec::new();
    while !tokens.pass(";") {
        if !tokens.pass("(") && !tokens.pass(")") {
            out.push(number(tokens)?);
        }
    }
    Ok(out)
}

/// `normal ( expression, variance )` up to `;`.
fn normals(tokens: &mut Tokens, parents: &[String]) -> Result<Vec<Normal>, ModelError> {
    let mut out = Vec::new();
    while !tokens.pass(";") {
        if tokens.pass("(") || tokens.pass(")") {
            continue;
        }
        tokens.expect("normal")?;
        tokens.expect("(")?;
        let mut mean = 0.0;
        let mut slopes = BTreeMap::new();
        while !tokens.pass(",") {
            let at = tokens.at();
            let sign = if tokens.pass("-") { -1.0 } else { 1.0 };
            tokens.pass("+");
            let first = tokens.name("a number or a parent")?;
            let second = if tokens.pass("*") {
                Some(tokens.name("a number or a parent")?)
            } else {
                None
            };
            let value = |word: &str| word.parse::<f64>().ok().filter(|x| x.is_finite());
            let parent = |word: &str| parents.iter().find(|parent| *parent == word).cloned();
            let (slope, of) = match (value(&first), parent(&first), second) {
                (Some(x), _, None) => (x, None),
                (None, Some(of), None) => (1.0, Some(of)),
                (Some(x), _, Some(word)) if parent(&word).is_some() => (x, parent(&word)),
                (None, Some(of), Some(word)) if value(&word).is_some() => {
                    (value(&word).unwrap_or(0.0), Some(of))
                }
                _ => return Err(at.error(format!("`{first}`"), "mean + slope * PARENT + …")),
            };
            match of {
                None => mean += sign * slope,
                Some(of) => *slopes.entry(of).or_insert(0.0) += sign * slope,
            }
        }
        let at = tokens.at();
        let variance = number(tokens)?;
        if variance < 0.0 {
            return Err(at.error(variance.to_string(), "a variance of at least 0"));
        }
        tokens.expect(")")?;
        out.push(Normal {
            mean,
            slopes,
            variance,
        });
    }
    Ok(out)
}

fn number(tokens: &mut Tokens) -> Result<f64, ModelError> {
    let at = tokens.at();
    let sign = if tokens.pass("-") { -1.0 } else { 1.0 };
    let word = tokens.name("a number")?;
    let value: Option<f64> = word.parse().ok();
    let value = value.filter(|x| x.is_finite());
    Ok(sign * value.ok_or_else(|| at.error(format!("`{word}`"), "a number"))?)
}

fn build(nodes: Vec<Declared>) -> Result<Model, ModelError> {
    let names: Vec<String> = nodes.iter().map(|node| node.name.clone()).collect();
    let sizes: Vec<Option<usize>> = nodes
        .iter()
        .map(|node| node.states.as_ref().map(Vec::len))
        .collect();
    let mut out = Vec::with_capacity(nodes.len());
    for node in nodes {
        let at = At {
            format: STYLE.format,
            line: node.line,
        };
        let Some(Potential { parents, data, at }) = node.potential else {
            return Err(at.error(
                format!("`{}` without potential", node.name),
                "a potential for each node",
            ));
        };
        let places = find(&node.name, &parents, &names)?;
        let discrete: Vec<_> = places.iter().copied().filter(|p| sizes[p.0].is_some()).collect();
        let n_states = node.states.as_ref().map_or(1, Vec::len);
        let n_rows = n_configurations(at, discrete.iter().filter_map(|p| sizes[p.0]), n_states)?;
        let wrong = |found: usize| {
            at.error(
                format!("{found} entries in the data of `{}`", node.name),
                format!("{} for its configurations", n_rows * n_states),
            )
        };
        let cpd = match (node.states, data) {
            (Some(states), Data::Numbers(numbers)) => {
                if states.is_empty() || numbers.len() != n_rows * states.len() {
                    return Err(wrong(numbers.len()));
                }
                let rows = numbers.chunks(states.len()).map(|row| distribution(at, row));
                Cpd::Discrete(DiscreteCpd {
                    parents: places,
                    table: rows.collect::<Result<_, _>>()?,
                    states,
                })
            }
            (_, Data::Normals(normals)) => {
                if normals.len() != n_rows {
                    return Err(wrong(normals.len()));
                }
                let continuous: Vec<_> = places.iter().copied().filter(|p| sizes[p.0].is_none()).collect();
                let component = |normal: Normal| {
                    let slope = |j: usize| normal.slopes.get(&names[continuous[j].0]).copied().unwrap_or(0.0);
                    vec![Component {
                        weight: 1.0,
                        mean: DVector::from_element(1, normal.mean),
                        coefficients: DMatrix::from_fn(1, continuous.len(), |_, j| slope(j)),
                        covariance: DMatrix::from_element(1, 1, normal.variance),
                    }]
                };
                Cpd::Mixture(MixtureCpd {
                    columns: vec![node.name.clone()],
                    discrete_parents: discrete,
                    components: normals.into_iter().map(component).collect(),
                    continuous_parents: continuous.clone(),
                    weights: Weights::PerConfiguration,
                    sign: Sign::Fixed,
                    sphere: false,
                    scaling: None,
                })
            }
            (None, Data::Numbers(numbers)) => return Err(wrong(numbers.len())),
        };
        out.push(Node {
            name: node.name,
            cpd,
            extra: Extra::default(),
        });
    }
    Model::new(out, Extra::default())
}
