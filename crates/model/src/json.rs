//! `model.json`: what training writes, what a person may write by hand.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::cpd::{Component, Cpd, DiscreteCpd, MixtureCpd, NodeIdx, Scaling, Sign, Weights};
use crate::error::{ModelError, list};
use crate::extra::Extra;
use crate::model::{Model, Node};
use crate::von_mises_fisher::{VonMisesFisher, VonMisesFisherCpd};

/// Value of the key `format`.
pub const FORMAT: &str = "prehend-model";
/// Value of the key `version`.
pub const VERSION: u64 = 1;

#[derive(Deserialize)]
struct RawDiscrete {
    states: Vec<String>,
    #[serde(default)]
    parents: Vec<String>,
    table: Vec<Vec<f64>>,
    #[serde(flatten)]
    extra: Map<String, Value>,
}

#[derive(Deserialize)]
struct RawMixture {
    columns: Option<Vec<String>>,
    #[serde(default)]
    discrete_parents: Vec<String>,
    #[serde(default)]
    continuous_parents: Vec<String>,
    components: Vec<Vec<RawComponent>>,
    #[serde(default)]
    weights: Weights,
    #[serde(default)]
    sign: Sign,
    #[serde(default)]
    sphere: bool,
    scaling: Option<Scaling>,
    #[serde(flatten)]
    extra: Map<String, Value>,
}

#[derive(Deserialize)]
struct RawDirections {
    columns: Vec<String>,
    #[serde(default)]
    discrete_parents: Vec<String>,
    components: Vec<Vec<RawDirection>>,
    #[serde(flatten)]
    extra: Map<String, Value>,
}

#[derive(Serialize, Deserialize)]
struct RawDirection {
    weight: f64,
    direction: Vec<f64>,
    concentration: f64,
}

#[derive(Serialize, Deserialize)]
pub(crate) struct RawComponent {
    weight: f64,
    mean: Vec<f64>,
    #[serde(default)]
    coefficients: Vec<Vec<f64>>,
    covariance: Vec<Vec<f64>>,
}

impl Model {
    /// Reads `model.json`. Keys that this program does not know are kept.
    ///
    /// # Errors
    ///
    /// [`ModelError::ModelFile`] with the node where the text is not as `docs/model-format.md` says, and all that
    /// [`Model::new`] finds.
    pub fn from_json(text: &str) -> Result<Self, ModelError> {
        let at = |place: &str, problem: String| ModelError::ModelFile {
            place: place.into(),
            problem,
        };
        let value: Value = serde_json::from_str(text).map_err(|e| at("JSON", e.to_string()))?;
        let Value::Object(mut top) = value else {
            return Err(at(
                "top level",
                "expected an object with `format`, `version` and `nodes`".into(),
            ));
        };
        match top.remove("format") {
            Some(Value::String(format)) if format == FORMAT => {}
            found => {
                let problem = format!("found {}, expected \"{FORMAT}\"", show(found.as_ref()));
                return Err(at("`format`", problem));
            }
        }
        match top.remove("version") {
            Some(version) if version.as_u64() == Some(VERSION) => {}
            found => {
                let problem = format!("found {}, expected {VERSION}", show(found.as_ref()));
                return Err(at("`version`", problem));
            }
        }
        let Some(Value::Array(raw_nodes)) = top.remove("nodes") else {
            return Err(at("`nodes`", "expected an array of nodes".into()));
        };
        let mut raw = Vec::with_capacity(raw_nodes.len());
        for (i, node) in raw_nodes.into_iter().enumerate() {
            let Value::Object(mut node) = node else {
                return Err(at(&format!("node {i}"), "expected an object".into()));
            };
            let Some(Value::String(name)) = node.remove("name") else {
                return Err(at(
                    &format!("node {i}"),
                    "expected the key `name` with a text".into(),
                ));
            };
            raw.push((name, node));
        }
        let names: Vec<String> = raw.iter().map(|(name, _)| name.clone()).collect();
        let nodes = raw
            .into_iter()
            .map(|(name, node)| read_node(name, node, &names))
            .collect::<Result<_, _>>()?;
        Self::new(nodes, Extra::new(top))
    }

    /// The model as JSON text: keys in a fixed order, numbers in the shortest form that reads back to the same bits.
    pub fn to_json(&self) -> String {
        let mut top = Ordered::default();
        top.text("format", FORMAT);
        top.put("version", &VERSION.to_string());
        let nodes: Vec<String> = self.nodes().iter().map(|node| write_node(self, node)).collect();
        top.put("nodes", &format!("[\n{}\n]", nodes.join(",\n")));
        top.extras(self.extra().keys());
        format!("{{{}\n}}\n", top.lines("\n  "))
    }
}

fn show(value: Option<&Value>) -> String {
    value.map_or("nothing".into(), Value::to_string)
}

fn read_node(name: String, mut node: Map<String, Value>, names: &[String]) -> Result<Node, ModelError> {
    let place = format!("node `{name}`");
    let at = |problem: String| ModelError::ModelFile {
        place: place.clone(),
        problem,
    };
    let find = |parents: &[String]| -> Result<Vec<NodeIdx>, ModelError> {
        parents
            .iter()
            .map(|parent| {
                names
                    .iter()
                    .position(|known| known == parent)
                    .map(NodeIdx)
                    .ok_or_else(|| ModelError::UnknownParent {
                        node: name.clone(),
                        parent: parent.clone(),
                        known: list(names.iter().map(String::as_str)),
                    })
            })
            .collect()
    };
    let kind = node.remove("kind");
    let body = Value::Object(node);
    let (cpd, extra) = match kind.as_ref().and_then(Value::as_str) {
        Some("discrete") => {
            let raw: RawDiscrete = serde_json::from_value(body).map_err(|e| at(e.to_string()))?;
            let parents = find(&raw.parents)?;
            (
                Cpd::Discrete(DiscreteCpd {
                    states: raw.states,
                    parents,
                    table: raw.table,
                }),
                raw.extra,
            )
        }
        Some("von_mises_fisher_mixture") => {
            let raw: RawDirections = serde_json::from_value(body).map_err(|e| at(e.to_string()))?;
            let cpd = VonMisesFisherCpd {
                discrete_parents: find(&raw.discrete_parents)?,
                columns: raw.columns,
                components: raw
                    .components
                    .into_iter()
                    .map(|row| row.into_iter().map(RawDirection::build).collect())
                    .collect(),
            };
            (Cpd::VonMisesFisher(cpd), raw.extra)
        }
        Some("gaussian_mixture") => {
            let raw: RawMixture = serde_json::from_value(body).map_err(|e| at(e.to_string()))?;
            let columns = raw.columns.unwrap_or_else(|| vec![name.clone()]);
            let mut components = Vec::with_capacity(raw.components.len());
            for (configuration, row) in raw.components.into_iter().enumerate() {
                let mut out = Vec::with_capacity(row.len());
                for (component, raw) in row.into_iter().enumerate() {
                    out.push(
                        raw.build(columns.len())
                            .map_err(|problem| ModelError::BadComponent {
                                node: name.clone(),
                                configuration,
                                component,
                                problem,
                            })?,
                    );
                }
                components.push(out);
            }
            let cpd = MixtureCpd {
                discrete_parents: find(&raw.discrete_parents)?,
                continuous_parents: find(&raw.continuous_parents)?,
                columns,
                components,
                weights: raw.weights,
                sign: raw.sign,
                sphere: raw.sphere,
                scaling: raw.scaling,
            };
            (Cpd::Mixture(cpd), raw.extra)
        }
        _ => {
            let problem = format!(
                "`kind` is {}; expected \"discrete\", \"gaussian_mixture\" or \"von_mises_fisher_mixture\"",
                show(kind.as_ref())
            );
            return Err(at(problem));
        }
    };
    Ok(Node {
        name,
        cpd,
        extra: Extra::new(extra),
    })
}

impl RawDirection {
    fn build(self) -> VonMisesFisher {
        VonMisesFisher {
            weight: self.weight,
            direction: DVector::from_vec(self.direction),
            concentration: self.concentration,
        }
    }
}

impl RawComponent {
    pub(crate) fn build(self, d: usize) -> Result<Component, String> {
        // A node without continuous parents may leave `coefficients` out.
        let coefficients = if self.coefficients.is_empty() {
            DMatrix::zeros(d, 0)
        } else {
            matrix(&self.coefficients, "coefficients")?
        };
        let covariance = matrix(&self.covariance, "covariance")?;
        Ok(Component {
            weight: self.weight,
            mean: DVector::from_vec(self.mean),
            coefficients,
            covariance,
        })
    }
}

impl From<&Component> for RawComponent {
    fn from(component: &Component) -> Self {
        Self {
            weight: component.weight,
            mean: component.mean.iter().copied().collect(),
            coefficients: rows(&component.coefficients),
            covariance: rows(&component.covariance),
        }
    }
}

fn matrix(rows: &[Vec<f64>], key: &str) -> Result<DMatrix<f64>, String> {
    let n = rows.first().map_or(0, Vec::len);
    if let Some(ragged) = rows.iter().position(|row| row.len() != n) {
        return Err(format!(
            "row {ragged} of `{key}` has {} entries, row 0 has {n}",
            rows[ragged].len()
        ));
    }
    Ok(DMatrix::from_fn(rows.len(), n, |i, j| rows[i][j]))
}

/// The rows of a matrix, as JSON shows it.
pub(crate) fn rows(matrix: &DMatrix<f64>) -> Vec<Vec<f64>> {
    matrix
        .row_iter()
        .map(|row| row.iter().copied().collect())
        .collect()
}

/// Key–text pairs in writing order: serde_json's map would sort them, and `format` should come first.
#[derive(Default)]
struct Ordered(Vec<String>);

impl Ordered {
    fn put(&mut self, key: &str, json: &str) {
        self.0.push(format!("{}: {json}", Value::from(key)));
    }
    fn text(&mut self, key: &str, value: &str) {
        self.put(key, &Value::from(value).to_string());
    }
    fn value(&mut self, key: &str, value: &impl Serialize) {
        // Only finite numbers and texts come here, which serde_json always writes.
        let json = serde_json::to_string(value).unwrap_or_else(|_| "null".into());
        self.put(key, &json);
    }
    fn extras(&mut self, extra: &Map<String, Value>) {
        for (key, value) in extra {
            self.put(key, &value.to_string());
        }
    }
    fn lines(&self, indent: &str) -> String {
        self.0
            .iter()
            .map(|line| format!("{indent}{line}"))
            .collect::<Vec<_>>()
            .join(",")
    }
}

fn write_node(model: &Model, node: &Node) -> String {
    let name_all = |parents: &[NodeIdx]| -> Vec<String> {
        parents
            .iter()
            .map(|&parent| model.node(parent).name.clone())
            .collect()
    };
    let mut out = Ordered::default();
    out.text("name", &node.name);
    match &node.cpd {
        Cpd::Discrete(cpd) => {
            out.text("kind", "discrete");
            out.value("states", &cpd.states);
            out.value("parents", &name_all(&cpd.parents));
            out.value("table", &cpd.table);
        }
        Cpd::VonMisesFisher(cpd) => {
            out.text("kind", "von_mises_fisher_mixture");
            out.value("columns", &cpd.columns);
            out.value("discrete_parents", &name_all(&cpd.discrete_parents));
            let rows: Vec<Vec<RawDirection>> = cpd
                .components
                .iter()
                .map(|row| {
                    row.iter()
                        .map(|c| RawDirection {
                            weight: c.weight,
                            direction: c.direction.iter().copied().collect(),
                            concentration: c.concentration,
                        })
                        .collect()
                })
                .collect();
            out.value("components", &rows);
        }
        Cpd::Mixture(cpd) => {
            out.text("kind", "gaussian_mixture");
            out.value("columns", &cpd.columns);
            out.value("discrete_parents", &name_all(&cpd.discrete_parents));
            out.value("continuous_parents", &name_all(&cpd.continuous_parents));
            if cpd.weights != Weights::PerConfiguration {
                out.value("weights", &cpd.weights);
            }
            if cpd.sign == Sign::Latent {
                out.text("sign", "latent");
            }
            if cpd.sphere {
                out.put("sphere", "true");
            }
            if let Some(scaling) = &cpd.scaling {
                out.value("scaling", scaling);
            }
            let configurations: Vec<String> = cpd
                .components
                .iter()
                .map(|row| {
                    let parts: Vec<String> = row
                        .iter()
                        .map(|c| serde_json::to_string(&RawComponent::from(c)).unwrap_or_default())
                        .collect();
                    format!("      [{}]", parts.join(",\n       "))
                })
                .collect();
            out.put(
                "components",
                &format!("[\n{}\n      ]", configurations.join(",\n")),
            );
        }
    }
    out.extras(node.extra.keys());
    format!("    {{{}\n    }}", out.lines("\n      "))
}
