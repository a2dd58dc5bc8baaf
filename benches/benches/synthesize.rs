//! What a try costs, stage by stage: both bundled hands on an object of 10,088 triangles.
//!
//! A try is a pre-shape, an approach, a closing, contacts, ε and features. Stages are taken from grasps that hold, 64 of
//! each hand: `arriving` is the whole of it from 0.1 m outside, `closing` starts where the hand has arrived,
//! `standing` closes a hand that is closed already: contacts, ε, `fvol` and the confirmation remain.

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{Isometry3, Translation3, Vector3};
use prehend::ObjectOptions;
use prehend::grasp::{
    CloseOptions, Grasp, GraspObject, ReadyHand, SynthesisOptions, free_volume, hypotheses, palm_orientation,
    synthesize, unified_position,
};
use prehend::hand::{Hand, JointPositions};
use prehend::quality::{Contact, EpsilonSolver, GraspWrenchSpace};
use prehend::stages::decompose::shape_of;
use prehend::stages::synthesize::HandData;

/// Tries of one measurement of the whole.
const TRIES: usize = 500;

fn options() -> SynthesisOptions {
    SynthesisOptions {
        tries: TRIES,
        seed: 1,
        ..SynthesisOptions::default()
    }
}

fn stages(c: &mut Criterion) {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let shape = shape_of(&root.join("objects/mug/beer_stein.ply"), ObjectOptions::default())
        .expect("a bundled object");
    let object = shape.grasp_object().expect("it has boxes");
    for name in ["human", "schunk_sdh"] {
        let data = HandData::read(&root.join("hands").join(name)).expect("a bundled hand");
        of_hand(c, name, &data.hand, &object);
    }
}

fn of_hand(c: &mut Criterion, name: &str, hand: &Hand, object: &GraspObject) {
    let found = synthesize(hand, object, &options(), &|_| true).expect("a hand that can grasp");
    let grasps: Vec<&Grasp> = found.grasps.iter().cycle().take(64).collect();
    let mut group = c.benchmark_group(name);
    group.sample_size(10);
    group.throughput(Throughput::Elements(TRIES as u64));
    group.bench_function("tries", |b| {
        b.iter(|| synthesize(hand, object, &options(), &|_| true).expect("as before"));
    });
    group.throughput(Throughput::Elements(grasps.len() as u64));
    let description = hand.description().expect("a bundled hand");
    group.bench_function("hypotheses", |b| {
        b.iter(|| hypotheses(black_box(object), description.opening_width, 0.08));
    });
    let ready = ReadyHand::new(hand).expect("a hand that can grasp");
    let close = |pose: &Isometry3<f64>, joints: &JointPositions, approach: bool| {
        let options = CloseOptions {
            approach,
            ..CloseOptions::default()
        };
        ready
            .close(object, pose, joints, &options)
            .expect("finite numbers")
    };
    let preshapes: Vec<JointPositions> = grasps.iter().map(|g| hand.preshape(g.features.egpc)).collect();
    let with_preshapes = || grasps.iter().zip(&preshapes);
    let outside: Vec<Isometry3<f64>> = with_preshapes()
        .map(|(grasp, preshape)| {
            let approach = (grasp.object_from_root * hand.root_from_palm(preshape)).rotation * Vector3::z();
            Translation3::from(approach * -0.1) * grasp.object_from_root
        })
        .collect();
    group.bench_function("arriving", |b| {
        b.iter(|| -> f64 {
            let all = outside.iter().zip(&preshapes);
            all.map(|(pose, preshape)| close(pose, preshape, true).epsilon)
                .sum()
        });
    });
    group.bench_function("closing", |b| {
        b.iter(|| -> f64 {
            with_preshapes()
                .map(|(g, preshape)| close(&g.object_from_root, preshape, false).epsilon)
                .sum()
        });
    });
    group.bench_function("standing", |b| {
        b.iter(|| -> f64 {
            let all = grasps.iter();
            all.map(|g| close(&g.object_from_root, &g.joints, false).epsilon)
                .sum()
        });
    });
    let contacts: Vec<Vec<Contact>> = grasps
        .iter()
        .map(|g| {
            let contact = |k: &prehend::grasp::LinkContact| Contact {
                at: k.at,
                mu: k.mu,
                torsion: k.torsion,
            };
            g.contacts.iter().map(contact).collect()
        })
        .collect();
    group.bench_function("epsilon", |b| {
        let mut solver = EpsilonSolver::default();
        b.iter(|| -> f64 {
            let epsilon = |contacts: &Vec<Contact>| {
                let space = GraspWrenchSpace::new(contacts, &object.quality_options()).expect("contacts");
                solver.epsilon(&space).expect("they hold")
            };
            contacts.iter().map(epsilon).sum()
        });
    });
    group.bench_function("features", |b| {
        b.iter(|| -> f64 {
            let features = |g: &&Grasp| {
                let object_from_palm = g.object_from_root * hand.root_from_palm(&g.joints);
                let points: Vec<_> = g.contacts.iter().map(|k| k.at.point).collect();
                let palm = object_from_palm.translation.vector.into();
                let upos = unified_position(&object_from_palm, &object.root().center());
                free_volume(&palm, &points, object.leaves()).fvol
                    + upos.map_or(0.0, |u| u[0])
                    + palm_orientation(&object_from_palm.rotation)[0]
            };
            grasps.iter().map(features).sum()
        });
    });
    group.finish();
}

criterion_group!(benches, stages);
criterion_main!(benches);
