//! Learning arcs: known networks come back, rules hold, the score falls apart into families, threads do not matter.

use std::collections::BTreeSet;

use prehend_model::{
    Model, Network, StructureOptions, StructureScore, Table, learn_structure, score_structure,
};

/// `t` and `s` are discrete; `x` depends on `t`, `y` is a regression on `x`, `z` a mixture of two regressions on `y`,
/// `w` depends on `s` and on `x`.
const TRUTH: &str = r#"{ "format": "prehend-model", "version": 1, "nodes": [
    { "name": "t", "kind": "discrete", "states": ["a", "b"], "table": [[0.4, 0.6]] },
    { "name": "s", "kind": "discrete", "states": ["a", "b"], "parents": ["t"], "table": [[0.8, 0.2], [0.25, 0.75]] },
    { "name": "x", "kind": "gaussian_mixture", "discrete_parents": ["t"], "components": [
        [{ "weight": 1.0, "mean": [0.0], "covariance": [[1.0]] }],
        [{ "weight": 1.0, "mean": [2.0], "covariance": [[0.5]] }]] },
    { "name": "y", "kind": "gaussian_mixture", "continuous_parents": ["x"], "components": [
        [{ "weight": 1.0, "mean": [0.0], "coefficients": [[0.9]], "covariance": [[0.4]] }]] },
    { "name": "z", "kind": "gaussian_mixture", "continuous_parents": ["y"], "components": [
        [{ "weight": 0.5, "mean": [3.0], "coefficients": [[1.0]], "covariance": [[0.2]] },
         { "weight": 0.5, "mean": [-3.0], "coefficients": [[-0.5]], "covariance": [[0.3]] }]] },
    { "name": "w", "kind": "gaussian_mixture", "discrete_parents": ["s"], "continuous_parents": ["x"], "components": [
        [{ "weight": 1.0, "mean": [0.0], "coefficients": [[0.8]], "covariance": [[0.3]] }],
        [{ "weight": 1.0, "mean": [1.5], "coefficients": [[-0.8]], "covariance": [[0.3]] }]] } ] }"#;

const ARCS: [(&str, &str); 6] = [
    ("t", "s"),
    ("t", "x"),
    ("x", "y"),
    ("y", "z"),
    ("s", "w"),
    ("x", "w"),
];

fn nodes(rules: &str) -> Network {
    let mut text = String::new();
    for name in ["t", "s"] {
        text += &format!("[[node]]\nname = \"{name}\"\nkind = \"discrete\"\nstates = [\"a\", \"b\"]\n");
    }
    for name in ["x", "y", "z", "w"] {
        text += &format!("[[node]]\nname = \"{name}\"\nkind = \"gaussian_mixture\"\n");
    }
    Network::from_toml(&(text + rules)).unwrap()
}

/// One climb.
fn quick() -> StructureOptions {
    StructureOptions {
        restarts: 0,
        orders: false,
        tabu: 3,
        ..StructureOptions::default()
    }
}

fn rows(n: usize) -> Table {
    Model::from_json(TRUTH).unwrap().sample(n, 11)
}

fn arcs(network: &Network) -> BTreeSet<(String, String)> {
    let nodes = network.nodes();
    nodes
        .iter()
        .flat_map(|node| {
            node.parents
                .iter()
                .map(|&p| (nodes[p].name.clone(), node.name.clone()))
        })
        .collect()
}

fn undirected(arcs: &BTreeSet<(String, String)>) -> BTreeSet<(String, String)> {
    arcs.iter()
        .map(|(a, b)| (a.clone().min(b.clone()), a.clone().max(b.clone())))
        .collect()
}

#[test]
fn a_known_mixed_network_comes_back() {
    let learned = learn_structure(&nodes(""), &rows(800), &StructureOptions::default()).unwrap();
    let truth: BTreeSet<(String, String)> = ARCS.iter().map(|(a, b)| ((*a).into(), (*b).into())).collect();
    let found = arcs(&learned.network);
    assert_eq!(undirected(&found), undirected(&truth), "{found:?}");
    // t – s may point either way; everything else is compelled by kinds, or by what mixtures tell.
    let differ = found
        .symmetric_difference(&truth)
        .filter(|(a, b)| !(a.len() + b.len() == 2 && "ts".contains(a.as_str()) && "ts".contains(b.as_str())));
    assert_eq!(differ.count(), 0, "{found:?}");
    assert!(learned.score > learned.given_score);
    assert!(
        learned
            .arcs
            .iter()
            .all(|arc| arc.gain > 0.0 && arc.confidence.is_none())
    );
}

#[test]
fn the_score_is_the_sum_of_its_families_and_of_each_family_alone() {
    let table = rows(400);
    let empty = nodes("");
    let whole = empty
        .with_parents(&[vec![], vec![0], vec![0], vec![2], vec![3], vec![1, 2]])
        .unwrap();
    let options = StructureOptions::default();
    let families = score_structure(&whole, &table, &options).unwrap();
    // Each family in a network that has no other arc.
    for (node, parents) in [vec![], vec![0], vec![0], vec![2], vec![3], vec![1, 2]]
        .into_iter()
        .enumerate()
    {
        let mut alone = vec![vec![]; 6];
        alone[node] = parents;
        let scores = score_structure(&empty.with_parents(&alone).unwrap(), &table, &options).unwrap();
        assert_eq!(scores[node].to_bits(), families[node].to_bits());
    }
    let learned = learn_structure(&whole, &table, &quick()).unwrap();
    assert!((learned.given_score - families.iter().sum::<f64>()).abs() < 1e-9);
    let again = score_structure(&learned.network, &table, &options).unwrap();
    assert!((learned.score - again.iter().sum::<f64>()).abs() < 1e-9);
}

#[test]
fn one_component_or_a_table_scores_equivalent_graphs_alike() {
    let table = rows(1000);
    let options = StructureOptions {
        max_components: 1,
        ..StructureOptions::default()
    };
    let total = |parents: &[Vec<usize>]| -> f64 {
        let network = nodes("").with_parents(parents).unwrap();
        score_structure(&network, &table, &options).unwrap().iter().sum()
    };
    let none = vec![vec![]; 6];
    let with = |node: usize, parents: &[usize]| {
        let mut all = none.clone();
        all[node] = parents.to_vec();
        all
    };
    // Two discrete nodes: exactly alike. Two Gaussians: up to the weak prior that keeps a covariance off zero.
    assert!((total(&with(0, &[1])) - total(&with(1, &[0]))).abs() < 1e-8);
    assert!((total(&with(2, &[3])) - total(&with(3, &[2]))).abs() < 0.05);
    // The Gaussian's worth in closed form: −½ N log(1 − r²) − ½ log N for one arc.
    let column = |name: &str| table.numbers(name, name).unwrap();
    let (x, y) = (column("x"), column("y"));
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (mx, my) = (mean(&x), mean(&y));
    let product = |f: &dyn Fn(usize) -> f64| (0..x.len()).map(f).sum::<f64>();
    let r = product(&|i| (x[i] - mx) * (y[i] - my))
        / (product(&|i| (x[i] - mx).powi(2)) * product(&|i| (y[i] - my).powi(2))).sqrt();
    let expected = -500.0 * (1.0 - r * r).ln() - 0.5 * 1000f64.ln();
    let found = total(&with(3, &[2])) - total(&none);
    assert!((found - expected).abs() < 0.5, "{found} against {expected}");
}

#[test]
fn tiers_required_and_forbidden_arcs_hold() {
    let rules = "[structure]\ntiers = [[\"t\"], [\"z\", \"y\"], [\"x\", \"s\"]]\nrequired = [[\"t\", \"z\"]]\n\
                 forbidden = [[\"y\", \"x\"], [\"t\", \"s\"]]\nmax_parents = 2\n";
    let network = nodes(rules);
    let options = StructureOptions {
        bootstrap: 4,
        ..quick()
    };
    let learned = learn_structure(&network, &rows(400), &options).unwrap();
    let found = arcs(&learned.network);
    let has = |a: &str, b: &str| found.contains(&(a.to_string(), b.to_string()));
    assert!(has("t", "z"));
    assert!(!has("y", "x") && !has("t", "s"));
    assert!(!has("x", "y") && !has("x", "z") && !has("s", "y") && !has("s", "z"));
    assert!(!has("s", "t"));
    assert!(learned.network.nodes().iter().all(|node| node.parents.len() <= 2));
    assert!(
        learned
            .arcs
            .iter()
            .all(|arc| arc.confidence.is_some_and(|c| (0.0..=1.0).contains(&c)))
    );
    let required = learned
        .arcs
        .iter()
        .find(|arc| arc.to == "z" && arc.from == "t")
        .unwrap();
    assert_eq!(required.confidence, Some(1.0));
}

#[test]
fn threads_do_not_matter() {
    let table = rows(200);
    let options = StructureOptions {
        bootstrap: 3,
        restarts: 1,
        seed: 5,
        ..StructureOptions::default()
    };
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| learn_structure(&nodes(""), &table, &options).unwrap())
    };
    let (one, three) = (run(1), run(3));
    assert_eq!(one, three);
    assert_eq!(one.score.to_bits(), three.score.to_bits());
}

#[test]
fn held_out_rows_find_the_strong_arcs_too() {
    let options = StructureOptions {
        score: StructureScore::CrossValidated { folds: 4 },
        ..quick()
    };
    let learned = learn_structure(&nodes(""), &rows(400), &options).unwrap();
    let found = undirected(&arcs(&learned.network));
    for (a, b) in ARCS {
        let arc = (a.min(b).to_string(), a.max(b).to_string());
        assert!(found.contains(&arc), "{arc:?} is missing in {found:?}");
    }
}

#[test]
fn rows_with_an_empty_cell_are_left_out_and_told() {
    let table = rows(300);
    let mut x = table.numbers("x", "x").unwrap();
    x[7] = f64::NAN;
    let table = table.with_numbers("x", x).unwrap();
    let options = quick();
    let learned = learn_structure(&nodes(""), &table, &options).unwrap();
    assert_eq!(learned.n_rows, 299);
    assert!(
        learned.warnings[0].starts_with("1 of 300 rows lack a column"),
        "{:?}",
        learned.warnings
    );
    let none = Table::new(0);
    assert!(learn_structure(&nodes(""), &none, &options).is_err());
}
