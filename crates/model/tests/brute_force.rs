//! Random mixed networks under every kind of evidence against everything written out.

use prehend_model::{
    BatchQuery, Component, Cpd, DiscreteCpd, Evidence, Extra, MixtureCpd, Model, ModelError, Node, NodeIdx,
    Observation, Sign, Weights,
};
use prehend_testkit::{BruteForce, RandomNode, RandomObservation, RandomQuery, Reading, random_query};
use proptest::prelude::*;

fn name(node: usize) -> String {
    format!("n{node}")
}

fn model_of(query: &RandomQuery) -> Model {
    let indices = |parents: &[usize]| parents.iter().map(|&parent| NodeIdx(parent)).collect();
    let nodes = query.nodes.iter().enumerate().map(|(i, node)| Node {
        name: name(i),
        cpd: match node {
            RandomNode::Discrete { parents, table } => Cpd::Discrete(DiscreteCpd {
                states: (0..node.n_states()).map(|s| format!("s{s}")).collect(),
                parents: indices(parents),
                table: table.clone(),
            }),
            RandomNode::Continuous {
                discrete,
                continuous,
                components,
                reading,
                latent_sign,
            } => Cpd::Mixture(MixtureCpd {
                columns: (0..node.dim()).map(|d| format!("n{i}_{d}")).collect(),
                discrete_parents: indices(discrete),
                continuous_parents: indices(continuous),
                components: components
                    .iter()
                    .map(|row| {
                        row.iter()
                            .map(|c| Component {
                                weight: c.weight,
                                mean: c.mean.clone(),
                                coefficients: c.coefficients.clone(),
                                covariance: c.covariance.clone(),
                            })
                            .collect()
                    })
                    .collect(),
                weights: match reading {
                    Reading::Own => Weights::PerConfiguration,
                    Reading::SharedComponents => Weights::Shared,
                    Reading::RootWeights => Weights::Root,
                },
                sign: if *latent_sign { Sign::Latent } else { Sign::Fixed },
                sphere: false,
                scaling: None,
            }),
        },
        extra: Extra::default(),
    });
    Model::new(nodes.collect(), Extra::default()).unwrap()
}

fn evidence_of(model: &Model, query: &RandomQuery) -> Evidence {
    let entries = query.evidence.iter().enumerate();
    entries.fold(Evidence::new(), |evidence, (i, known)| {
        let observation = match known {
            RandomObservation::Hidden => return evidence,
            RandomObservation::State(state) => Observation::State(*state),
            RandomObservation::Likelihood(likelihood) => Observation::Likelihood(likelihood.clone()),
            RandomObservation::Value(value) => Observation::Value(value.clone()),
            RandomObservation::Uncertain(mean, covariance) => Observation::Uncertain {
                mean: mean.iter().copied().collect(),
                covariance: covariance.clone(),
            },
        };
        evidence.with(model, &name(i), observation).unwrap()
    })
}

fn close(found: f64, expected: f64) -> bool {
    (found - expected).abs() <= 1e-9 * expected.abs().max(1.0)
}

/// Every node as a target, all at once where there are several, and the compiled form where the evidence has whole values.
fn agrees(query: &RandomQuery) {
    let model = model_of(query);
    let evidence = evidence_of(&model, query);
    let Some(brute) = BruteForce::of(query) else {
        assert!(matches!(
            model.query(&[], &evidence),
            Err(ModelError::ImpossibleEvidence { .. })
        ));
        return;
    };
    assert!(close(model.log_evidence(&evidence).unwrap(), brute.log_evidence));
    for (i, node) in query.nodes.iter().enumerate() {
        let answer = model.query(&[&name(i)], &evidence).unwrap();
        assert!(close(answer.log_evidence, brute.log_evidence));
        if node.n_states() > 0 {
            let expected = brute.probabilities(i, node.n_states());
            let found = answer.probabilities(&name(i)).unwrap();
            assert!(
                found.iter().zip(&expected).all(|(f, e)| close(*f, *e)),
                "{found:?} {expected:?}"
            );
            as_batch(&model, query, i, &brute);
            continue;
        }
        let mixture = answer.mixture(&name(i)).unwrap();
        let (mean, covariance) = brute.moments(i);
        assert!((mixture.mean() - &mean).amax() <= 1e-9 * mean.amax().max(1.0));
        assert!((mixture.covariance() - &covariance).amax() <= 1e-9 * covariance.amax().max(1.0));
        if matches!(query.evidence[i], RandomObservation::Hidden) {
            let at: Vec<f64> = mean.iter().map(|m| m + 0.3).collect();
            assert!(close(
                mixture.log_density(&at).unwrap(),
                brute.log_density(i, &at)
            ));
        }
    }
}

fn as_batch(model: &Model, query: &RandomQuery, target: usize, brute: &BruteForce) {
    let mut names = Vec::new();
    let mut row = Vec::new();
    for (i, known) in query.evidence.iter().enumerate() {
        match known {
            RandomObservation::Hidden => continue,
            RandomObservation::State(state) => row.push(*state as f64),
            RandomObservation::Value(value) if value.iter().all(|v| !v.is_nan()) => row.extend(value),
            _ => return,
        }
        names.push(name(i));
    }
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let batch = BatchQuery::new(model, &name(target), &names).unwrap();
    assert!(batch.is_compiled());
    // Other rows beside it change nothing.
    let other: Vec<f64> = row
        .iter()
        .map(|v| if v.fract() == 0.0 { *v } else { v + 5.0 })
        .collect();
    let rows = [vec![other; 5], vec![row; 6]].concat();
    let expected = brute.probabilities(target, query.nodes[target].n_states());
    for answer in &batch.run(&rows)[5..] {
        let answer = answer.as_ref().unwrap();
        assert!(close(answer.log_evidence, brute.log_evidence));
        assert!(answer.posterior.iter().zip(&expected).all(|(f, e)| close(*f, *e)));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    #[test]
    fn every_query_of_a_random_network_gives_what_writing_it_out_gives(seed: u64, n_discrete in 0..4usize, n_continuous in 0..4usize) {
        agrees(&random_query(seed, n_discrete, n_continuous));
    }
}

#[test]
fn compiled_queries_of_random_networks_meet_every_kind_of_node() {
    // Whole values only, so that each of these runs compiled.
    for seed in 0..60 {
        let mut query = random_query(seed, 2, 3);
        for (known, node) in query.evidence.iter_mut().zip(&query.nodes) {
            let whole = match known {
                RandomObservation::Value(value) => value.iter().all(|v| !v.is_nan()),
                RandomObservation::Likelihood(_) | RandomObservation::Uncertain(..) => false,
                _ => true,
            };
            if !whole {
                *known = if node.n_states() > 0 {
                    RandomObservation::Hidden
                } else {
                    RandomObservation::Value(vec![0.4; node.dim()])
                };
            }
        }
        agrees(&query);
    }
}
