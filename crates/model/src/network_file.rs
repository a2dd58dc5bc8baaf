//! `network.toml` as it is read: which keys there are, and what they must be.

use std::collections::BTreeSet;

use serde::Deserialize;

use crate::arcs::{check_columns, topological_order};
use crate::cpd::{Sign, Weights};
use crate::error::{ModelError, list};
use crate::network::{MixtureOrder, MixtureSpec, Network, NodeKind, NodeSpec, VonMisesFisherSpec};
use crate::structure::RawRules;

/// Components tried where a node has no `mixture` key.
const DEFAULT_MAX: usize = 8;
/// Pseudo-count of each state where a discrete node has no `prior` key: Laplace's rule, so that no state is impossible.
const DEFAULT_PRIOR: f64 = 1.0;

impl Network {
    /// Reads `network.toml` (keys: `docs/model-format.md`).
    ///
    /// # Errors
    ///
    /// [`ModelError::NetworkFile`] with the line where the text is not TOML or a key is unknown; otherwise what is wrong
    /// with which node: unknown parents, cycles, a continuous parent of a discrete node, a column used twice, settings
    /// out of range.
    pub fn from_toml(text: &str) -> Result<Self, ModelError> {
        let raw: RawNetwork = toml::from_str(text).map_err(|e| ModelError::NetworkFile {
            problem: e.to_string().trim_end().to_string(),
        })?;
        if raw.node.is_empty() {
            return Err(ModelError::NetworkFile {
                problem: "there is no [[node]]".into(),
            });
        }
        let names: Vec<String> = raw.node.iter().map(|node| node.name.clone()).collect();
        let mut seen = BTreeSet::new();
        if let Some(node) = names.iter().find(|name| !seen.insert(name.as_str())) {
            return Err(ModelError::DuplicateNode { node: node.clone() });
        }
        let structure = raw.structure.build(&names)?;
        let kinds: Vec<Kind> = raw.node.iter().map(|node| node.kind).collect();
        let mut nodes = Vec::with_capacity(names.len());
        for node in raw.node {
            nodes.push(node.build(&names, &kinds)?);
        }
        let labels: Vec<&str> = names.iter().map(String::as_str).collect();
        let parents: Vec<Vec<usize>> = nodes.iter().map(|node| node.parents.clone()).collect();
        let order = topological_order(&labels, &parents)?;
        check_columns(nodes.iter().map(|node| (node.name.as_str(), node.columns())))?;
        Ok(Self {
            nodes,
            group: raw.group,
            order,
            structure,
        })
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawNetwork {
    group: Option<String>,
    #[serde(default)]
    structure: RawRules,
    #[serde(default)]
    node: Vec<RawNode>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawNode {
    name: String,
    kind: Kind,
    states: Option<Vec<String>>,
    prior: Option<f64>,
    columns: Option<Vec<String>>,
    #[serde(default)]
    parents: Vec<String>,
    mixture: Option<RawMixture>,
    weights: Option<Weights>,
    covariance: Option<Covariance>,
    noise_floor: Option<Floor>,
    sign: Option<Sign>,
    sphere: Option<bool>,
}

#[derive(Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    Discrete,
    GaussianMixture,
    VonMisesFisherMixture,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawMixture {
    components: Option<usize>,
    max: Option<usize>,
    choose: Option<Choose>,
    weights: Option<Weights>,
}

#[derive(Clone, Copy, PartialEq, Deserialize)]
enum Choose {
    #[serde(rename = "bic")]
    Bic,
    #[serde(rename = "bic+cv")]
    BicCv,
}

#[derive(Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Covariance {
    Own,
    Shared,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Floor {
    One(f64),
    Each(Vec<f64>),
}

impl RawNode {
    fn build(self, names: &[String], kinds: &[Kind]) -> Result<NodeSpec, ModelError> {
        let mut parents = Vec::with_capacity(self.parents.len());
        for parent in &self.parents {
            let Some(position) = names.iter().position(|name| name == parent) else {
                return Err(ModelError::UnknownParent {
                    node: self.name.clone(),
                    parent: parent.clone(),
                    known: list(names.iter().map(String::as_str)),
                });
            };
            if parents.contains(&position) {
                return Err(self.bad("parents", &format!("`{parent}` twice"), "each parent once"));
            }
            if self.kind != Kind::Discrete && kinds[position] == Kind::VonMisesFisherMixture {
                let found = format!("`{parent}`, a von_mises_fisher_mixture");
                return Err(self.bad(
                    "parents",
                    &found,
                    "discrete nodes and gaussian mixtures; make it a gaussian_mixture with `sphere = true`",
                ));
            }
            if self.kind == Kind::VonMisesFisherMixture && kinds[position] != Kind::Discrete {
                let expected =
                    "discrete parents only; a gaussian_mixture with `sphere = true` takes continuous ones";
                return Err(self.bad("parents", &format!("`{parent}`, a continuous node"), expected));
            }
            if self.kind == Kind::Discrete && kinds[position] != Kind::Discrete {
                return Err(ModelError::ContinuousParent {
                    node: self.name.clone(),
                    parent: parent.clone(),
                });
            }
            parents.push(position);
        }
        let kind = match self.kind {
            Kind::Discrete => self.discrete()?,
            Kind::GaussianMixture => NodeKind::Mixture(self.mixture_spec()?),
            Kind::VonMisesFisherMixture => NodeKind::VonMisesFisher(self.direction_spec()?),
        };
        Ok(NodeSpec {
            name: self.name,
            kind,
            parents,
        })
    }

    fn bad(&self, key: &str, found: &str, expected: &str) -> ModelError {
        ModelError::BadSetting {
            node: self.name.clone(),
            key: key.into(),
            found: found.into(),
            expected: expected.into(),
        }
    }

    fn discrete(&self) -> Result<NodeKind, ModelError> {
        let foreign = [
            ("columns", self.columns.is_some()),
            ("mixture", self.mixture.is_some()),
            ("weights", self.weights.is_some()),
            ("covariance", self.covariance.is_some()),
            ("noise_floor", self.noise_floor.is_some()),
            ("sign", self.sign.is_some()),
            ("sphere", self.sphere.is_some()),
        ];
        if let Some((key, _)) = foreign.iter().find(|(_, given)| *given) {
            return Err(self.bad(key, "given", "no such key in a discrete node"));
        }
        let states = self.states.clone().unwrap_or_default();
        let distinct: BTreeSet<&String> = states.iter().collect();
        if states.is_empty() || distinct.len() < states.len() {
            let found = list(states.iter().map(String::as_str));
            return Err(self.bad("states", &found, "at least one state, each with its own name"));
        }
        let prior = self.prior.unwrap_or(DEFAULT_PRIOR);
        if !(prior >= 0.0 && prior.is_finite()) {
            return Err(self.bad("prior", &prior.to_string(), "a pseudo-count of at least 0"));
        }
        Ok(NodeKind::Discrete { states, prior })
    }

    fn mixture_spec(&self) -> Result<MixtureSpec, ModelError> {
        let foreign = [("states", self.states.is_some()), ("prior", self.prior.is_some())];
        if let Some((key, _)) = foreign.iter().find(|(_, given)| *given) {
            return Err(self.bad(key, "given", "no such key in a continuous node"));
        }
        let columns = self.columns.clone().unwrap_or_else(|| vec![self.name.clone()]);
        if columns.is_empty() {
            return Err(self.bad("columns", "empty", "one column per dimension"));
        }
        let noise_floor = match &self.noise_floor {
            None => vec![0.0; columns.len()],
            Some(Floor::One(floor)) => vec![*floor; columns.len()],
            Some(Floor::Each(floors)) => floors.clone(),
        };
        if noise_floor.len() != columns.len() || noise_floor.iter().any(|f| !(*f >= 0.0 && f.is_finite())) {
            let expected = "one number of at least 0, or one per column";
            return Err(self.bad("noise_floor", &format!("{noise_floor:?}"), expected));
        }
        let sign = self.sign.unwrap_or_default();
        let sphere = self.sphere.unwrap_or(false);
        if sphere && columns.len() < 2 {
            return Err(self.bad("sphere", "true for one column", "a node of at least two columns"));
        }
        let in_mixture = self.mixture.as_ref().and_then(|mixture| mixture.weights);
        let weights = self.weights.or(in_mixture).unwrap_or_default();
        Ok(MixtureSpec {
            columns,
            order: self.mixture_order()?,
            weights,
            shared_covariance: self.covariance == Some(Covariance::Shared),
            noise_floor,
            sign,
            sphere,
        })
    }

    fn direction_spec(&self) -> Result<VonMisesFisherSpec, ModelError> {
        let foreign = [
            ("states", self.states.is_some()),
            ("prior", self.prior.is_some()),
            (
                "weights",
                self.weights.is_some() || self.mixture.as_ref().is_some_and(|m| m.weights.is_some()),
            ),
            ("covariance", self.covariance.is_some()),
            ("sign", self.sign.is_some()),
            ("sphere", self.sphere.is_some()),
        ];
        if let Some((key, _)) = foreign.iter().find(|(_, given)| *given) {
            return Err(self.bad(key, "given", "no such key in a von_mises_fisher_mixture"));
        }
        let columns = self.columns.clone().unwrap_or_default();
        if columns.len() < 2 {
            let found = format!("{} columns", columns.len());
            return Err(self.bad(
                "columns",
                &found,
                "one per coordinate of the unit vector, at least two",
            ));
        }
        let noise_floor = match &self.noise_floor {
            None => 0.0,
            Some(Floor::One(floor)) if *floor >= 0.0 && floor.is_finite() => *floor,
            Some(_) => {
                return Err(self.bad(
                    "noise_floor",
                    "no such number",
                    "one angle in radians, at least 0",
                ));
            }
        };
        let order = self.mixture_order()?;
        if let MixtureOrder::Bic { guard: true, .. } = order {
            let expected = "\"bic\" or a fixed number of components for a von_mises_fisher_mixture";
            return Err(self.bad("mixture", "chosen by \"bic+cv\"", expected));
        }
        Ok(VonMisesFisherSpec {
            columns,
            order,
            noise_floor,
        })
    }

    fn mixture_order(&self) -> Result<MixtureOrder, ModelError> {
        let guarded = |max, choose| MixtureOrder::Bic {
            max,
            guard: choose == Choose::BicCv,
        };
        let Some(raw) = &self.mixture else {
            return Ok(guarded(DEFAULT_MAX, Choose::Bic));
        };
        match (raw.components, raw.max, raw.choose) {
            (Some(k), None, None) if k >= 1 => Ok(MixtureOrder::Fixed(k)),
            (None, max, choose) if max.unwrap_or(DEFAULT_MAX) >= 1 => {
                Ok(guarded(max.unwrap_or(DEFAULT_MAX), choose.unwrap_or(Choose::Bic)))
            }
            _ => Err(self.bad(
                "mixture",
                "neither of its two forms",
                "{ components = K } or { max = K, choose = \"bic\" | \"bic+cv\" } with K of at least 1",
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problem(text: &str) -> String {
        Network::from_toml(text).unwrap_err().to_string()
    }

    #[test]
    fn a_scalar_node_takes_its_name_as_column() {
        let network = Network::from_toml(
            "[[node]]\nname = \"task\"\nkind = \"discrete\"\nstates = [\"a\", \"b\"]\n\
             [[node]]\nname = \"cvex\"\nkind = \"gaussian_mixture\"\nparents = [\"task\"]\n\
             mixture = { max = 4, choose = \"bic\" }\nnoise_floor = 0.02\n",
        )
        .unwrap();
        assert_eq!(network.columns(), ["task", "cvex"]);
        let NodeKind::Mixture(spec) = &network.nodes()[1].kind else {
            panic!("cvex is continuous")
        };
        assert_eq!(spec.order, MixtureOrder::Bic { max: 4, guard: false });
        assert_eq!(spec.noise_floor, [0.02]);
    }

    #[test]
    fn a_wrong_network_is_refused_with_what_to_change() {
        let node = |name: &str, rest: &str| format!("[[node]]\nname = \"{name}\"\nkind = {rest}\n");
        let gauss =
            |name: &str, parents: &str| node(name, &format!("\"gaussian_mixture\"\nparents = [{parents}]"));
        assert_eq!(
            problem(&(gauss("a", "\"b\"") + &gauss("b", "\"a\""))),
            "arcs form a cycle through `a`; remove one of its incoming arcs"
        );
        assert_eq!(
            problem(&gauss("a", "\"z\"")),
            "`a` names the parent `z`, which is not a node; the nodes are `a`"
        );
        let task = node("task", "\"discrete\"\nstates = [\"x\"]\nparents = [\"a\"]");
        assert!(
            problem(&(task + &gauss("a", "")))
                .starts_with("`task` is discrete and has the continuous parent `a`")
        );
        let twice = gauss("a", "") + &node("b", "\"gaussian_mixture\"\ncolumns = [\"a\"]");
        assert!(problem(&twice).starts_with("the column `a` is used by `a` and by `b`"));
        let zero = node("a", "\"gaussian_mixture\"\nmixture = { components = 0 }");
        assert!(problem(&zero).contains("`mixture` is neither of its two forms"));
        let direction = |rest: &str| {
            node(
                "a",
                &format!("\"von_mises_fisher_mixture\"\ncolumns = [\"x\", \"y\"]\n{rest}"),
            )
        };
        for key in [
            "covariance = \"shared\"",
            "weights = \"root\"",
            "mixture = { max = 3, weights = \"root\" }",
        ] {
            assert!(
                problem(&direction(key)).contains("no such key in a von_mises_fisher_mixture"),
                "{key}"
            );
        }
        assert!(
            problem("[[node]]\nname = \"a\"\nkind = \"gaussian_mixture\"\ncolour = 3\n").contains("colour")
        );
        assert_eq!(problem(""), "network file: there is no [[node]]");
    }
}
