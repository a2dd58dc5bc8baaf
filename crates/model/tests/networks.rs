//! The bundled networks have the arcs that they say.

use prehend_model::{Network, NodeKind};

fn parents(network: &Network, name: &str) -> Vec<String> {
    let node = network.nodes().iter().find(|node| node.name == name).unwrap();
    node.parents
        .iter()
        .map(|&parent| network.nodes()[parent].name.clone())
        .collect()
}

#[test]
fn in_the_papers_network_the_hand_depends_on_the_task_through_the_constraints_only() {
    let network = Network::from_toml(include_str!("../../../networks/paper.toml")).unwrap();
    assert_eq!(network.group(), Some("object"));
    assert_eq!(network.columns().len(), 1 + 3 + 1 + 2 + 3 + 4 + 2);
    assert_eq!(parents(&network, "qeps"), ["task", "size", "cvex"]);
    assert_eq!(parents(&network, "dir"), ["fvol", "qeps", "egpc", "upos"]);
    let n_mixtures = network
        .nodes()
        .iter()
        .filter(|node| matches!(node.kind, NodeKind::Mixture(_)))
        .count();
    assert_eq!(n_mixtures, 7);
}

#[test]
fn the_other_network_adds_arcs_from_task_and_object_to_the_action() {
    let network = Network::from_toml(include_str!("../../../networks/task-action.toml")).unwrap();
    for node in ["egpc", "upos", "dir"] {
        let parents = parents(&network, node);
        assert!(
            ["task", "size", "cvex"]
                .iter()
                .all(|name| parents.iter().any(|parent| parent == name))
        );
    }
}
