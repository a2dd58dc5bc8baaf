//! A network as text again: what a search learned, for training and for people.

use std::fmt::Write as _;

use toml::Value;

use crate::cpd::{Sign, Weights};
use crate::network::{MixtureOrder, MixtureSpec, Network, NodeKind};

impl Network {
    /// The network as `network.toml`; reading it gives the same network. Comments of a file that it came from are lost.
    pub fn to_toml(&self) -> String {
        let mut out = String::new();
        if let Some(group) = self.group() {
            put(&mut out, "group", &text(group));
        }
        let name = |node: usize| text(&self.nodes()[node].name);
        for node in self.nodes() {
            out += "\n[[node]]\n";
            put(&mut out, "name", &text(&node.name));
            match &node.kind {
                NodeKind::Discrete { states, prior } => {
                    put(&mut out, "kind", "\"discrete\"");
                    put(&mut out, "states", &array(states.iter().map(|state| text(state))));
                    put(&mut out, "prior", &Value::from(*prior).to_string());
                }
                NodeKind::VonMisesFisher(spec) => {
                    put(&mut out, "kind", "\"von_mises_fisher_mixture\"");
                    put(
                        &mut out,
                        "columns",
                        &array(spec.columns.iter().map(|column| text(column))),
                    );
                    put(&mut out, "mixture", &order(spec.order));
                    if spec.noise_floor > 0.0 {
                        put(
                            &mut out,
                            "noise_floor",
                            &Value::from(spec.noise_floor).to_string(),
                        );
                    }
                }
                NodeKind::Mixture(spec) => {
                    put(&mut out, "kind", "\"gaussian_mixture\"");
                    mixture(&mut out, spec);
                }
            }
            if !node.parents.is_empty() {
                put(
                    &mut out,
                    "parents",
                    &array(node.parents.iter().map(|&parent| name(parent))),
                );
            }
        }
        let rules = self.structure();
        let arcs = |arcs: &[(usize, usize)]| array(arcs.iter().map(|&(a, b)| array([name(a), name(b)])));
        if *rules != crate::structure::StructureRules::default() {
            out += "\n[structure]\n";
            if !rules.tiers.is_empty() {
                let tiers = rules
                    .tiers
                    .iter()
                    .map(|tier| array(tier.iter().map(|&node| name(node))));
                put(&mut out, "tiers", &array(tiers));
            }
            if !rules.required.is_empty() {
                put(&mut out, "required", &arcs(&rules.required));
            }
            if !rules.forbidden.is_empty() {
                put(&mut out, "forbidden", &arcs(&rules.forbidden));
            }
            if let Some(most) = rules.max_parents {
                put(&mut out, "max_parents", &most.to_string());
            }
        }
        out.trim_start().to_string()
    }
}

fn mixture(out: &mut String, spec: &MixtureSpec) {
    put(
        out,
        "columns",
        &array(spec.columns.iter().map(|column| text(column))),
    );
    put(out, "mixture", &order(spec.order));
    match spec.weights {
        Weights::PerConfiguration => {}
        Weights::Shared => put(out, "weights", "\"shared\""),
        Weights::Root => put(out, "weights", "\"root\""),
    }
    if spec.shared_covariance {
        put(out, "covariance", "\"shared\"");
    }
    if spec.noise_floor.iter().any(|floor| *floor > 0.0) {
        let floors = spec
            .noise_floor
            .iter()
            .map(|floor| Value::from(*floor).to_string());
        put(out, "noise_floor", &array(floors));
    }
    if spec.sign == Sign::Latent {
        put(out, "sign", "\"latent\"");
    }
    if spec.sphere {
        put(out, "sphere", "true");
    }
}

fn order(order: MixtureOrder) -> String {
    match order {
        MixtureOrder::Fixed(k) => format!("{{ components = {k} }}"),
        MixtureOrder::Bic { max, guard } => {
            let choose = if guard { "bic+cv" } else { "bic" };
            format!("{{ max = {max}, choose = \"{choose}\" }}")
        }
    }
}

fn put(out: &mut String, key: &str, value: &str) {
    let _ = writeln!(out, "{key} = {value}");
}

fn text(value: &str) -> String {
    Value::from(value).to_string()
}

fn array(entries: impl IntoIterator<Item = String>) -> String {
    format!("[{}]", entries.into_iter().collect::<Vec<_>>().join(", "))
}

#[cfg(test)]
mod tests {
    use crate::network::Network;

    #[test]
    fn a_network_reads_back_from_its_text() {
        let network = Network::from_toml(
            r#"group = "object"
            [structure]
            tiers = [["ta\"sk"], ["size", "dir"]]
            required = [["ta\"sk", "size"]]
            forbidden = [["dir", "size"]]
            max_parents = 3
            [[node]]
            name = "ta\"sk"
            kind = "discrete"
            states = ["a\nb", "c"]
            prior = 0.5
            [[node]]
            name = "size"
            kind = "gaussian_mixture"
            columns = ["x", "y"]
            parents = ["ta\"sk"]
            mixture = { components = 3 }
            weights = "shared"
            covariance = "shared"
            noise_floor = [0.0, 1e-5]
            [[node]]
            name = "dir"
            kind = "gaussian_mixture"
            columns = ["w", "z"]
            parents = ["size"]
            mixture = { max = 5, choose = "bic+cv" }
            sign = "latent"
            sphere = true
            [[node]]
            name = "upos"
            kind = "von_mises_fisher_mixture"
            columns = ["p", "q", "r"]
            noise_floor = 0.01"#,
        )
        .unwrap();
        let written = network.to_toml();
        assert_eq!(Network::from_toml(&written).unwrap(), network, "{written}");
        let fewer = network
            .with_parents(&[vec![], vec![], vec![0, 1], vec![0]])
            .unwrap();
        assert_eq!(Network::from_toml(&fewer.to_toml()).unwrap(), fewer);
    }
}
