//! From `synthesize` to `label`, `train`, `plan` and `imitate` on two objects.

use serde_json::{Value, json};

mod common;

use common::{assert_close, keys, number, prehend, put};

#[test]
fn grasps_become_labels_a_model_a_plan_and_an_imitation() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let hand = "hands/schunk_sdh";
    let mut tables = Vec::new();
    for (object, name) in [
        ("objects/mug/coffee_mug.ply", "mug"),
        ("objects/hammer/claw_hammer.ply", "hammer"),
    ] {
        let table = file(&format!("{name}.parquet"));
        prehend(
            &[
                "synthesize",
                "--hand",
                hand,
                "--object",
                object,
                "--tries",
                "150",
                "--out",
                &table,
                "--json",
            ],
            "",
        )
        .answer();
        tables.push(table);
    }
    let labels = file("labels.sqlite");
    prehend(
        &[
            "label",
            &tables[0],
            &tables[1],
            "--persona",
            "lenient",
            "--out",
            &labels,
            "--json",
        ],
        "",
    )
    .answer();
    let network = put(
        folder.path(),
        "small.toml",
        "[[node]]\nname = \"task\"\nkind = \"discrete\"\nstates = [\"hand-over\", \"pouring\", \"tool-use\"]\n\
         [[node]]\nname = \"size\"\nkind = \"gaussian_mixture\"\ncolumns = [\"size_x\", \"size_y\", \"size_z\"]\nparents = [\"task\"]\n\
         mixture = { components = 1 }\nnoise_floor = 0.01\n\
         [[node]]\nname = \"fvol\"\nkind = \"gaussian_mixture\"\nparents = [\"task\"]\nmixture = { components = 1 }\nnoise_floor = 0.05\n",
    );
    let out = file("models");
    let without = prehend(&["train", &tables[0], "--network", &network, "--json"], "");
    assert_eq!(without.status, 1);
    assert!(without.stderr.contains("--labels"), "{}", without.stderr);
    prehend(
        &[
            "train",
            &tables[0],
            &tables[1],
            "--network",
            &network,
            "--labels",
            &labels,
            "--persona",
            "lenient",
            "--out",
            &out,
            "--json",
        ],
        "",
    )
    .answer();
    let model = format!("{out}/small.bin");

    let arguments = [
        "plan",
        "--hand",
        hand,
        "--object",
        "objects/mug/coffee_mug.ply",
        "--task",
        "pouring",
        "--model",
        &model,
    ];
    let plan = prehend(
        &[&arguments[..], &["--tries", "100", "--top", "3", "--json"]].concat(),
        "",
    )
    .answer();
    let grasps = plan["grasps"].as_array().unwrap();
    assert_eq!(grasps.len(), 3);
    assert_eq!(
        keys(&grasps[0]),
        [
            "contacts", "epsilon", "grasp_id", "joints", "p_task", "pose", "pregrasp"
        ]
    );
    let p: Vec<f64> = grasps.iter().map(|g| number(&g["p_task"])).collect();
    assert!(p[0] >= p[1] && p[1] >= p[2] && p[0] <= 1.0, "{p:?}");
    let none = prehend(
        &[
            &arguments[..],
            &["--tries", "2", "--support-plane", "1", "--json"],
        ]
        .concat(),
        "",
    )
    .answer();
    assert_eq!(none["grasps"], json!([]));
    assert!(none["reason"].as_str().unwrap().contains("none of 2 tries"));

    let first: Value = prehend(&["grasps", &tables[0], "--limit", "1", "--json"], "").answer();
    let demonstration = format!("{}:{}", tables[0], first["grasp_id"].as_str().unwrap());
    let imitation = prehend(
        &[
            "imitate",
            "--demonstrator",
            &model,
            "--imitator",
            &model,
            "--demonstration",
            &demonstration,
            "--candidates",
            &tables[0],
            &tables[1],
            "--top",
            "5",
            "--json",
        ],
        "",
    )
    .answer();
    let posterior = imitation["task"]["posterior"].as_object().unwrap();
    assert!((posterior.values().map(number).sum::<f64>() - 1.0).abs() < 1e-9);
    assert_eq!(imitation["objects"].as_array().unwrap().len(), 2);
    assert_eq!(
        keys(&imitation["objects"][0]),
        ["object", "p_task", "similarity", "similarity_raw", "total"]
    );
    assert_eq!(
        imitation["objects"][0]["object"],
        json!("coffee_mug"),
        "the object that was shown is the likest"
    );
    let grasps = imitation["grasps"].as_array().unwrap();
    assert_eq!(grasps.len(), 5);
    assert_eq!(
        keys(&grasps[0]),
        [
            "grasp_id",
            "object",
            "p_task",
            "similarity",
            "similarity_raw",
            "total"
        ]
    );
    assert_eq!(
        grasps[0]["grasp_id"], first["grasp_id"],
        "the grasp that was shown is the likest"
    );
    for g in grasps {
        assert_close(
            &g["total"],
            0.8 * number(&g["p_task"]) + 0.2 * number(&g["similarity"]),
        );
    }
}
