//! Bad inputs: the exit status, and a message that says which file, which place, what was found and what to do.

mod common;

use common::{CUBE, keys, prehend, put};

#[test]
fn bad_usage_ends_with_two() {
    for arguments in [
        &["mesh"][..],
        &["mesh", "a.off", "--scale", "-1"],
        &["decompose", "a.off", "--gain", "2"],
        &["fly"],
        &["hand", "hands/human", "--posture", "{"],
        &["label", "x.parquet", "--persona", "nobody"],
        &["imitate", "--demonstrator", "networks/paper.toml"],
        &[
            "train",
            "-",
            "--network",
            "networks/paper.toml",
            "--labels",
            "nowhere.sqlite",
        ],
    ] {
        let run = prehend(arguments, "task\n");
        assert_eq!(run.status, 2, "{arguments:?}: {}", run.stderr);
        assert!(run.stdout.is_empty(), "{arguments:?}: {}", run.stdout);
        assert!(run.stderr.starts_with("error: "), "{arguments:?}: {}", run.stderr);
    }
}

#[test]
fn a_mesh_that_fails_leaves_the_others_alone() {
    let folder = tempfile::tempdir().unwrap();
    let files = [
        put(folder.path(), "cube.off", CUBE),
        put(
            folder.path(),
            "nan.off",
            &CUBE.replacen("2 0 0\n", "nan 0 0\n", 1),
        ),
        put(folder.path(), "empty.stl", ""),
        put(
            folder.path(),
            "index.off",
            "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n",
        ),
        put(folder.path(), "letters.xyz", "0 0 0\n1 0 x\n"),
        folder.path().join("missing.ply").to_str().unwrap().to_owned(),
        put(folder.path(), "notes.txt", "none"),
        folder.path().to_str().unwrap().to_owned() + "/folder.obj",
        put(folder.path(), "last.off", CUBE),
    ];
    std::fs::create_dir(&files[7]).unwrap();
    for command in ["mesh", "decompose"] {
        let mut arguments = vec![command, "--json"];
        arguments.extend(files.iter().map(String::as_str));
        let run = prehend(&arguments, "");
        assert_eq!(run.status, 1);
        assert!(run.stderr.is_empty(), "{}", run.stderr);
        let lines = run.lines();
        assert_eq!(lines.len(), files.len());
        assert!(lines[0]["error"].is_null() && lines[8]["error"].is_null());
        for (i, said) in [
            (1, "line 4: found `nan`, expected a finite number"),
            (2, "found 0 bytes"),
            (3, "line 6: found `7`, expected a vertex index from 0 to 2"),
            (4, "line 2: found `x`, expected a finite number"),
            (5, "is not there; check the path"),
            (6, "`txt` is no shape"),
            (7, "is a folder; expected a file"),
        ] {
            assert_eq!(keys(&lines[i]), ["error", "file"]);
            let error = lines[i]["error"].as_str().unwrap();
            assert!(error.contains(said), "{error}");
            assert_eq!(
                error.matches(files[i].as_str()).count(),
                1,
                "the file once: {error}"
            );
        }
    }
}

#[test]
fn a_flat_mesh_is_measured_and_not_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let flat = put(
        folder.path(),
        "flat.off",
        "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    );
    let answer = prehend(&["mesh", &flat, "--json"], "").answer();
    assert_eq!(answer["volume"], serde_json::json!(0.0));
    assert_eq!(answer["watertight"], serde_json::json!(false));
    prehend(&["decompose", &flat, "--json"], "").answer();
}

#[test]
fn messages_name_the_thing_and_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let table = put(folder.path(), "t.csv", "a,b\n1,2\nfoo,3\n");
    let ragged = put(folder.path(), "ragged.csv", "a,b\n1,2\n3\n");
    let network = put(
        folder.path(),
        "n.toml",
        "[[node]]\nname = \"a\"\nkind = \"gaussian_mixture\"\nmixture = { components = 1 }\n",
    );
    let wrong_network = put(
        folder.path(),
        "wrong.toml",
        "[[node]]\nname = \"a\"\nkind = \"wavelet\"\n",
    );
    let other = put(
        folder.path(),
        "other.toml",
        "[[node]]\nname = \"z\"\nkind = \"gaussian_mixture\"\n",
    );
    let model = put(
        folder.path(),
        "m.json",
        r#"{"format":"prehend-model","version":1,"nodes":[{"name":"task","kind":"discrete","states":["lift","push"],"parents":[],"table":[[0.5,0.5]]}]}"#,
    );
    let broken = put(folder.path(), "broken.json", "{");
    let unsure = put(
        folder.path(),
        "unsure.json",
        r#"{"format":"prehend-model","version":1,"nodes":[{"name":"task","kind":"discrete","states":["lift","push"],"parents":[],"table":[[0.5,0.6]]}]}"#,
    );
    let mug = "objects/mug/coffee_mug.ply";
    let cases: &[(&[&str], &[&str])] = &[
        (
            &["train", &table, "--network", &network],
            &["column `a`, row 2", "found `foo`"],
        ),
        (
            &["train", &ragged, "--network", &network],
            &["ragged.csv", "line: 3"],
        ),
        (
            &["train", &table, "--network", &wrong_network],
            &["wrong.toml", "line 3", "wavelet", "gaussian_mixture"],
        ),
        (
            &["train", &table, "--network", &other],
            &["column `z`", "its columns are `a`, `b`"],
        ),
        (
            &["train", "nowhere", "--network", &network],
            &["nowhere: is not there; check the path"],
        ),
        (
            &["query", &model, "--target", "size"],
            &["no node `size`", "`task`"],
        ),
        (
            &[
                "query",
                &model,
                "--target",
                "task",
                "--prior",
                r#"{"task":{"pull":1}}"#,
            ],
            &["no state `pull`", "lift, push"],
        ),
        (
            &["query", &broken, "--target", "task"],
            &["broken.json", "line 1 column 1"],
        ),
        (
            &["query", &unsure, "--target", "task"],
            &["unsure.json", "`task`", "sum 1.1"],
        ),
        (
            &["query", mug, "--target", "task"],
            &["`.ply` is no model", ".bin, .json"],
        ),
        (
            &[
                "plan",
                "--hand",
                "hands/schunk_sdh",
                "--object",
                mug,
                "--task",
                "pouring",
                "--model",
                &model,
                "--tries",
                "1",
            ],
            &["no task `pouring`", "lift, push"],
        ),
        (
            &["hand", "hands/human", "--posture", r#"{"elbow":1}"#],
            &["`elbow`", "it has"],
        ),
        (
            &["hand", "hands/human", "--posture", r#"{"index_pip":9}"#],
            &["index_pip", "9"],
        ),
        (&["hand", "nowhere"], &["nowhere: is not there; check the path"]),
        (&["hand", mug], &["coffee_mug.ply"]),
        (
            &[
                "synthesize",
                "--hand",
                "hands/human",
                "--object",
                mug,
                "--out",
                "g.txt",
            ],
            &["g.txt", ".parquet"],
        ),
        (&["label", &table], &["t.csv", "column `hand_path`"]),
        (&["grasps", "hands"], &["no tables found"]),
        (&["quality", "nowhere.jsonl"], &["nowhere.jsonl: is not there"]),
        (&["model", "convert", &model, "m.xyz"], &["m.xyz", ".bin, .json"]),
        (
            &["pipeline", "--objects", "nowhere", "--out", "nowhere-out"],
            &["nowhere: is not there"],
        ),
    ];
    for (arguments, said) in cases {
        let run = prehend(&[arguments, &["--json"][..]].concat(), "");
        assert_eq!(run.status, 1, "{arguments:?}: {}", run.stderr);
        assert!(run.stdout.is_empty(), "{arguments:?}: {}", run.stdout);
        for part in *said {
            assert!(
                run.stderr.contains(part),
                "{arguments:?} should say `{part}`: {}",
                run.stderr
            );
        }
        assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
    }
}
