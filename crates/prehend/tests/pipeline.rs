//! Real hands and objects through all stages, from meshes to the report.

mod common;

use std::fs;

use common::{BASELINE, Listener, TRIES, assert_same, options, repository, run_on, workplace, written};
use nalgebra::Point3;
use prehend::frame::Frame;
use prehend::grasp_table::records;
use prehend::hand_folder::read_described_hand;
use prehend::plan::{Request, plan};
use prehend::progress::unwatched;
use prehend::stages::decompose::shape_of;
use prehend::{Error, ObjectOptions, files};
use prehend_grasp::SynthesisOptions;
use prehend_model::Model;
use prehend_quality::{Contact, QualityOptions, grasp_quality};

#[test]
fn one_thread_and_two_write_the_same_bytes() {
    let place = BASELINE.path();
    run_on(2, &options(place, "hands", "two", TRIES), &Listener::default()).unwrap();
    assert_same(&place.join("one"), &place.join("two"));
}

#[test]
fn a_run_that_was_stopped_twice_ends_like_one_that_was_not() {
    let place = BASELINE.path();
    let settings = options(place, "hands", "stopped", TRIES);
    let out = &settings.out;
    let stop = |part, steps| {
        let listener = Listener::stopping_in(part, steps);
        assert!(matches!(run_on(2, &settings, &listener), Err(Error::Stopped)));
    };
    stop("decompose", 6);
    let shapes = written(&out.join("shapes"));
    assert_eq!(shapes.len(), 6);
    assert!(!out.join("grasps").exists());

    stop("grasp", TRIES * 7);
    let grasps = written(&out.join("grasps"));
    assert!(
        !grasps.is_empty(),
        "some objects are done, others were stopped half way"
    );

    run_on(2, &settings, &Listener::default()).unwrap();
    assert_eq!(
        written(&out.join("shapes")),
        shapes,
        "finished boxes are taken over"
    );
    let later = written(&out.join("grasps"));
    assert!(
        grasps.iter().all(|(path, time)| later[path] == *time),
        "finished grasps are taken over"
    );
    assert!(later.len() > grasps.len());
    assert_same(&place.join("one"), out);
}

#[test]
fn a_changed_annotation_redoes_only_its_object() {
    let place = workplace(&["mug/coffee_mug", "hammer/ball_hammer"]);
    let settings = options(place.path(), "hands/schunk_sdh", "out", 30);
    run_on(2, &settings, &Listener::default()).unwrap();
    let of = |folder: &str| written(&settings.out.join(folder));
    let (shapes, grasps) = (of("shapes"), of("grasps"));

    let annotation = settings.objects.join("mug/coffee_mug.toml");
    let text = files::read_text(&annotation).unwrap();
    let changed = text.replace("material = \"glass\"", "material = \"wood\"");
    assert_ne!(text, changed);
    fs::write(&annotation, changed).unwrap();
    run_on(2, &settings, &Listener::default()).unwrap();
    for (before, after) in [(shapes, of("shapes")), (grasps, of("grasps"))] {
        assert_eq!(before.len(), after.len());
        for (path, time) in before {
            let is_mug = path.to_string_lossy().contains("coffee_mug");
            assert_eq!(after[&path] != time, is_mug, "{}", path.display());
        }
    }
}

#[test]
fn from_its_row_a_grasp_is_rebuilt_exactly() {
    // A link may stand this far (m) from the surface where it counts as touching.
    const TOUCHING: f64 = 0.2e-3;
    let out = BASELINE.path().join("one");
    let mut n_contacts = 0;
    for hand in ["human", "schunk_sdh"] {
        let hand = read_described_hand(&repository("hands").join(hand)).unwrap();
        for path in files::list(&out.join("grasps").join(hand.name()), &["parquet"]).unwrap() {
            let frame = Frame::read(&path).unwrap();
            let row = |name: &str, r: usize| frame.numbers(name).unwrap()[r];
            for (r, grasp) in records(&frame, &hand).unwrap().iter().enumerate().step_by(3) {
                let poses = hand.link_poses(&grasp.joints);
                for (link, at) in &grasp.contacts {
                    let object_from_link = grasp.object_from_root * poses.root_from_link(*link);
                    let gap = hand.links()[link.0]
                        .collision
                        .iter()
                        .map(|s| {
                            let object_from_solid = object_from_link * s.link_from_solid;
                            s.solid
                                .distance_to_point(&object_from_solid.inverse_transform_point(&at.point))
                        })
                        .fold(f64::INFINITY, f64::min);
                    assert!(gap <= TOUCHING, "{}: {gap} m", grasp.grasp_id);
                    n_contacts += 1;
                }
                let contacts: Vec<Contact> = grasp
                    .contacts
                    .iter()
                    .zip(&grasp.contact_records)
                    .map(|((_, at), record)| Contact {
                        at: *at,
                        mu: record.mu,
                        torsion: record.torsion,
                    })
                    .collect();
                let center = Point3::new(row("center_x", r), row("center_y", r), row("center_z", r));
                let quality =
                    grasp_quality(&contacts, &QualityOptions::new(center, row("torque_scale", r))).unwrap();
                assert!(
                    (quality.epsilon - grasp.epsilon).abs() < 1e-9,
                    "{}",
                    grasp.grasp_id
                );
            }
        }
    }
    assert!(n_contacts > 50, "only {n_contacts} contacts were looked at");
}

#[test]
fn a_plan_ranks_grasps_by_the_probability_of_the_task() {
    let bytes = files::read(&BASELINE.path().join("one/models/schunk_sdh/task-action.bin")).unwrap();
    let model = Model::from_bytes(&bytes).unwrap();
    let hand = read_described_hand(&repository("hands/schunk_sdh")).unwrap();
    let glass = shape_of(&repository("objects/glass/tumbler.ply"), ObjectOptions::default()).unwrap();
    let options = SynthesisOptions {
        tries: 60,
        seed: 3,
        ..SynthesisOptions::default()
    };
    let request = |task| Request {
        task,
        model: &model,
        top: 5,
        proposals: false,
    };
    let answer = plan(&hand, &glass, &request("pouring"), &options, unwatched()).unwrap();
    assert!(answer.kept >= answer.grasps.len() && answer.tried == 60);
    assert!(!answer.grasps.is_empty() && answer.grasps.len() <= 5);
    assert!(answer.reason.is_none());
    let p: Vec<f64> = answer.grasps.iter().map(|g| g.p_task).collect();
    assert!(
        p.iter().all(|p| (0.0..=1.0).contains(p)) && p.is_sorted_by(|a, b| a >= b),
        "{p:?}"
    );

    let proposed = Request {
        proposals: true,
        ..request("pouring")
    };
    let drawn = plan(&hand, &glass, &proposed, &options, unwatched()).unwrap();
    assert!(drawn.closed <= 60 && drawn.tried >= drawn.closed && drawn.kept > 0);
    let share = |suitable: usize, kept: usize| suitable as f64 / kept as f64;
    assert!(share(drawn.suitable, drawn.kept) >= share(answer.suitable, answer.kept));

    let unknown = plan(&hand, &glass, &request("juggling"), &options, unwatched()).unwrap_err();
    assert_eq!(
        unknown.to_string(),
        "the model knows no task `juggling`; it knows hand-over, pouring, tool-use"
    );
    let nowhere = SynthesisOptions {
        support_plane: Some(1.0),
        ..options
    };
    let none = plan(&hand, &glass, &request("pouring"), &nowhere, unwatched()).unwrap();
    assert!(none.grasps.is_empty() && none.reason.is_some());
}
