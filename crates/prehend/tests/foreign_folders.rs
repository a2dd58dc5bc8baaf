//! Folders that the experiments were not made for: few types, few objects, one hand, broken files.

mod common;

use std::fs;
use std::path::Path;

use common::{Listener, options, run_on, workplace};
use prehend::{Object, ObjectOptions};

/// Runs the pipeline, and gives its warnings and the page.
fn warnings_and_page(place: &Path, hands: &str, tries: usize) -> (Vec<String>, String) {
    let listener = Listener::default();
    let summary = run_on(2, &options(place, hands, "out", tries), &listener).unwrap();
    let page = fs::read_to_string(summary.report).unwrap();
    let warnings = listener.warnings.lock().unwrap().clone();
    (warnings, page)
}

fn any(warnings: &[String], words: &str) -> bool {
    warnings.iter().any(|w| w.contains(words))
}

#[test]
fn mugs_alone_teach_no_tool_use_and_the_report_says_so() {
    let place = workplace(&["mug/camping_cup", "mug/cappuccino_cup", "mug/coffee_mug"]);
    let (warnings, page) = warnings_and_page(place.path(), "hands/schunk_sdh", 60);
    assert!(
        any(&warnings, "no training grasp is labelled tool-use"),
        "{warnings:#?}"
    );
    assert!(page.contains("no training grasp is labelled tool-use"));
    assert!(place.path().join("out/models/schunk_sdh/paper.json").is_file());
}

#[test]
fn one_object_and_one_hand_are_enough_for_a_report() {
    let place = workplace(&["mug/coffee_mug"]);
    let (warnings, page) = warnings_and_page(place.path(), "hands/schunk_sdh", 60);
    for experiment in ["experiment A", "experiment B", "experiment C"] {
        assert!(any(&warnings, experiment), "{experiment}: {warnings:#?}");
        assert!(page.contains(&format!("{experiment} ")), "{experiment}");
    }
}

#[test]
fn without_any_force_closure_there_is_still_a_report() {
    let place = workplace(&["knife/table_knife"]);
    let (warnings, page) = warnings_and_page(place.path(), "hands/schunk_sdh", 1);
    assert!(any(&warnings, "no object in force closure"), "{warnings:#?}");
    assert!(page.contains("no object in force closure"));
}

#[test]
fn a_broken_file_is_left_out_and_named() {
    let place = workplace(&["mug/coffee_mug"]);
    let objects = place.path().join("objects");
    fs::write(objects.join("broken.off"), "OFF\n3 1 0\n0 0 0\n1 0 0\nnonsense\n").unwrap();
    fs::write(
        objects.join("flat.off"),
        "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    )
    .unwrap();
    let (warnings, page) = warnings_and_page(place.path(), "hands/schunk_sdh", 20);
    assert!(any(&warnings, "broken.off"), "{warnings:#?}");
    assert!(page.contains("broken.off"));

    fs::remove_dir_all(objects.join("mug")).unwrap();
    fs::remove_file(objects.join("flat.off")).unwrap();
    let message = Object::read_folder(&objects, ObjectOptions::default())
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("none of its 1 meshes can be used; the first: "),
        "{message}"
    );
    assert!(message.contains("broken.off"), "{message}");
}

#[test]
fn equal_names_are_told_apart_by_type_and_number() {
    let place = workplace(&["mug/coffee_mug"]);
    let objects = place.path().join("objects");
    for folder in ["glass", "more", "most"] {
        fs::create_dir_all(objects.join(folder)).unwrap();
        fs::copy(
            objects.join("mug/coffee_mug.ply"),
            objects.join(folder).join("coffee_mug.ply"),
        )
        .unwrap();
    }
    let folder = Object::read_folder(&objects, ObjectOptions::default()).unwrap();
    let names: Vec<&str> = folder.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(
        names,
        [
            "coffee_mug",
            "unknown_coffee_mug",
            "unknown_coffee_mug_2",
            "mug_coffee_mug"
        ]
    );
}

#[test]
fn meshes_of_other_collections_go_through_all_stages() {
    let folder = Path::new(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../../shared/data/objects"
    ));
    if !folder.is_dir() {
        eprintln!("skipped: meshes of other collections needs ../shared/data");
        return;
    }
    let found = Object::read_folder(folder, ObjectOptions::default()).unwrap();
    assert!(found.left_out.is_empty(), "{:?}", found.left_out);
    for object in &found.objects {
        let (low, high) = object.mesh.axis_aligned_bounds();
        let largest = (high - low).max();
        assert!((0.03..0.6).contains(&largest), "{}: {largest} m", object.name);
    }

    let place = tempfile::tempdir().unwrap();
    let listener = Listener::default();
    let mut settings = options(place.path(), "hands/schunk_sdh", "out", 6);
    settings.objects = folder.to_owned();
    let summary = run_on(2, &settings, &listener).unwrap();
    let warnings = listener.warnings.lock().unwrap();
    assert_eq!(summary.n_objects, found.objects.len(), "{warnings:#?}");
    let page = fs::read_to_string(summary.report).unwrap();
    for object in &found.objects {
        assert!(
            page.contains(&object.name),
            "{} is not in the report",
            object.name
        );
    }
}
