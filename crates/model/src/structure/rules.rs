//! Which arcs a search may draw: tiers, required and forbidden arcs of the network file, and what a mixed network forbids.

use serde::Deserialize;

use crate::arcs::topological_order;
use crate::error::{ModelError, list};
use crate::network::{Network, NodeKind};

/// What the table `[structure]` of a network file says, by position of the nodes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StructureRules {
    /// Groups of nodes; no arc leads from a later group to an earlier one. Nodes in no group are free.
    pub tiers: Vec<Vec<usize>>,
    /// Arcs (from, to) that stay.
    pub required: Vec<(usize, usize)>,
    /// Arcs (from, to) that never come.
    pub forbidden: Vec<(usize, usize)>,
    /// Most parents of a node; `None` for no limit.
    pub max_parents: Option<usize>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawRules {
    #[serde(default)]
    tiers: Vec<Vec<String>>,
    #[serde(default)]
    required: Vec<(String, String)>,
    #[serde(default)]
    forbidden: Vec<(String, String)>,
    max_parents: Option<usize>,
}

impl RawRules {
    pub fn build(self, names: &[String]) -> Result<StructureRules, ModelError> {
        let find = |key: &str, name: &String| {
            names.iter().position(|known| known == name).ok_or_else(|| {
                let nodes = list(names.iter().map(String::as_str));
                broken(format!(
                    "`{key}` names `{name}`, which is not a node; the nodes are {nodes}"
                ))
            })
        };
        let arcs = |key: &str, arcs: &[(String, String)]| {
            arcs.iter()
                .map(|(from, to)| Ok((find(key, from)?, find(key, to)?)))
                .collect::<Result<Vec<_>, ModelError>>()
        };
        let mut tiers = Vec::with_capacity(self.tiers.len());
        let mut placed = vec![false; names.len()];
        for tier in &self.tiers {
            let mut out = Vec::with_capacity(tier.len());
            for name in tier {
                let node = find("tiers", name)?;
                if std::mem::replace(&mut placed[node], true) {
                    return Err(broken(format!(
                        "`{name}` stands in `tiers` twice; each node has one tier"
                    )));
                }
                out.push(node);
            }
            tiers.push(out);
        }
        Ok(StructureRules {
            tiers,
            required: arcs("required", &self.required)?,
            forbidden: arcs("forbidden", &self.forbidden)?,
            max_parents: self.max_parents,
        })
    }
}

fn broken(problem: String) -> ModelError {
    ModelError::NetworkFile {
        problem: format!("[structure]: {problem}"),
    }
}

/// The rules of one network as a search asks for them.
pub(crate) struct Legal {
    allowed: Vec<Vec<bool>>,
    required: Vec<Vec<bool>>,
    pub max_parents: usize,
}

impl Legal {
    /// # Errors
    ///
    /// A required arc that another rule forbids, or required arcs in a cycle.
    pub fn new(network: &Network) -> Result<Self, ModelError> {
        let nodes = network.nodes();
        let n = nodes.len();
        let rules = network.structure();
        let mut tier_of = vec![None; n];
        for (tier, members) in rules.tiers.iter().enumerate() {
            for &node in members {
                tier_of[node] = Some(tier);
            }
        }
        let why_not = |from: usize, to: usize| -> Option<&'static str> {
            if from == to {
                Some("an arc needs two nodes")
            } else if matches!(nodes[from].kind, NodeKind::VonMisesFisher(_)) {
                Some("a von_mises_fisher_mixture has no children; make it a gaussian_mixture with `sphere`")
            } else if matches!(nodes[to].kind, NodeKind::VonMisesFisher(_)) && !nodes[from].is_discrete() {
                Some("a von_mises_fisher_mixture has discrete parents only")
            } else if nodes[to].is_discrete() && !nodes[from].is_discrete() {
                Some("a discrete node has no continuous parent; turn the arc round")
            } else if matches!((tier_of[from], tier_of[to]), (Some(a), Some(b)) if a > b) {
                Some("`tiers` forbid it")
            } else if rules.forbidden.contains(&(from, to)) {
                Some("`forbidden` names it too")
            } else {
                None
            }
        };
        let mut required = vec![vec![false; n]; n];
        let mut parents = vec![Vec::new(); n];
        for &(from, to) in &rules.required {
            if let Some(why) = why_not(from, to) {
                return Err(broken(format!(
                    "`required` names the arc from `{}` to `{}`: {why}",
                    nodes[from].name, nodes[to].name
                )));
            }
            if !std::mem::replace(&mut required[from][to], true) {
                parents[to].push(from);
            }
        }
        let names: Vec<&str> = nodes.iter().map(|node| node.name.as_str()).collect();
        topological_order(&names, &parents)?;
        let max_parents = rules.max_parents.unwrap_or(n);
        if let Some(node) = (0..n).find(|&node| parents[node].len() > max_parents) {
            return Err(broken(format!(
                "`required` gives `{}` {} parents, `max_parents` allows {max_parents}",
                names[node],
                parents[node].len()
            )));
        }
        let allowed = (0..n)
            .map(|from| (0..n).map(|to| why_not(from, to).is_none()).collect())
            .collect();
        Ok(Self {
            allowed,
            required,
            max_parents,
        })
    }

    pub fn n_nodes(&self) -> usize {
        self.allowed.len()
    }

    pub fn allows(&self, from: usize, to: usize) -> bool {
        self.allowed[from][to]
    }

    pub fn requires(&self, from: usize, to: usize) -> bool {
        self.required[from][to]
    }

    /// The required parents of a node.
    pub fn required_parents(&self, to: usize) -> Vec<usize> {
        (0..self.n_nodes())
            .filter(|&from| self.required[from][to])
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODES: &str = "[[node]]\nname = \"t\"\nkind = \"discrete\"\nstates = [\"x\", \"y\"]\n\
         [[node]]\nname = \"a\"\nkind = \"gaussian_mixture\"\n[[node]]\nname = \"b\"\nkind = \"gaussian_mixture\"\n";

    fn problem(rules: &str) -> String {
        let text = format!("{NODES}[structure]\n{rules}\n");
        match Network::from_toml(&text) {
            Err(error) => error.to_string(),
            Ok(network) => match Legal::new(&network) {
                Err(error) => error.to_string(),
                Ok(_) => String::new(),
            },
        }
    }

    #[test]
    fn rules_that_contradict_each_other_are_refused_with_the_reason() {
        assert_eq!(
            problem("tiers = [[\"t\"], [\"c\"]]"),
            "network file: [structure]: `tiers` names `c`, which is not a node; the nodes are `t`, `a`, `b`"
        );
        assert_eq!(
            problem("tiers = [[\"t\"], [\"a\", \"t\"]]"),
            "network file: [structure]: `t` stands in `tiers` twice; each node has one tier"
        );
        assert_eq!(
            problem("required = [[\"a\", \"t\"]]"),
            "network file: [structure]: `required` names the arc from `a` to `t`: \
             a discrete node has no continuous parent; turn the arc round"
        );
        assert_eq!(
            problem("tiers = [[\"a\"], [\"b\"]]\nrequired = [[\"b\", \"a\"]]"),
            "network file: [structure]: `required` names the arc from `b` to `a`: `tiers` forbid it"
        );
        assert_eq!(
            problem("required = [[\"b\", \"a\"]]\nforbidden = [[\"b\", \"a\"]]"),
            "network file: [structure]: `required` names the arc from `b` to `a`: `forbidden` names it too"
        );
        assert_eq!(
            problem("required = [[\"a\", \"b\"], [\"b\", \"a\"]]"),
            "arcs form a cycle through `a`; remove one of its incoming arcs"
        );
        assert!(problem("colour = 3").contains("colour"));
        assert_eq!(
            problem("tiers = [[\"t\"], [\"a\", \"b\"]]\nrequired = [[\"t\", \"a\"]]"),
            ""
        );
    }
}
