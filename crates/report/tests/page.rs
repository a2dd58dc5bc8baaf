//! The page as a reader's browser gets it: whole, closed, and made of nothing but its data.

use std::collections::BTreeSet;
use std::sync::Arc;

use nalgebra::Point3;
use prehend_geometry::Solid;
use prehend_report::{
    Account, Agreement, Candidate, Confusion, Confusions, DisplayMesh, ExperimentA, ExperimentB, ExperimentC,
    GraspPicture, GraspSheet, HandLabels, Icosphere, ImitationRun, KeyNumber, LabelSection, NetworkMaps,
    NetworkTraining, NodeTraining, ObjectMaps, ObjectSection, Picture, Prevalence, ReportData, Rule,
    RunSection, Scene, SphereMap, Stage, Summary, TriesRow, View, paper_recall, render_page, sphere_sheet,
};

const TASKS: [&str; 3] = ["hand-over", "pouring", "tool-use"];
/// A name that would break out of text and attributes were it not escaped.
const HOSTILE: &str = "\"><script>alert(1)</script>&'";

fn picture(name: &str) -> Picture {
    let ball = Arc::new(DisplayMesh::new(&Solid::Sphere { radius: 0.03 }.display_mesh()));
    Scene::object(&ball)
        .picture(View::Oblique, 24, name, HOSTILE)
        .unwrap()
}

fn maps() -> ExperimentA {
    let ball = Arc::new(DisplayMesh::new(&Solid::Sphere { radius: 0.03 }.display_mesh()));
    let grid = Icosphere::new(2);
    let density = vec![1.0; grid.directions().len()];
    let map = |task: &str| SphereMap {
        task: task.into(),
        density: density.clone(),
        marks: vec![],
    };
    let sheet = sphere_sheet(&ball, &Point3::origin(), &grid, &TASKS.map(map), 24).unwrap();
    let objects = vec![ObjectMaps {
        object: HOSTILE.into(),
        object_type: "mug".into(),
        sheet,
    }];
    ExperimentA {
        account: Account::default(),
        networks: vec![NetworkMaps {
            network: "paper".into(),
            objects,
        }],
    }
}

fn full() -> ReportData {
    let hand = || "human".to_owned();
    let candidate = |p_task| Candidate {
        name: HOSTILE.into(),
        picture: picture("candidate"),
        p_task,
        similarity: Some(f64::NAN),
        total: None,
    };
    let bic = (1..=4).map(|k| (k, -10.0 * k as f64)).collect();
    let node = NodeTraining {
        node: "upos".into(),
        components: 1,
        bic,
        ..NodeTraining::default()
    };
    let grasp = GraspPicture {
        picture: picture("grasp"),
        tasks: vec!["pouring".into()],
        qeps: 0.1,
    };
    ReportData {
        title: HOSTILE.into(),
        tasks: TASKS.map(String::from).to_vec(),
        summary: Summary {
            sentences: vec![HOSTILE.into()],
            numbers: vec![KeyNumber {
                value: "82 %".into(),
                label: "recall".into(),
                detail: HOSTILE.into(),
            }],
            picture: picture("lead"),
            caption: HOSTILE.into(),
        },
        run: RunSection {
            command: HOSTILE.into(),
            stages: ["a", "b"]
                .map(|n| Stage {
                    name: n.into(),
                    seconds: Some(1.0),
                    detail: HOSTILE.into(),
                })
                .to_vec(),
            ..RunSection::default()
        },
        objects: vec![ObjectSection {
            name: HOSTILE.into(),
            object_type: "mug".into(),
            guesses: vec![HOSTILE.into()],
            boxes: picture("boxes"),
            parts: picture("parts"),
            grasps: vec![GraspSheet {
                hand: hand(),
                tried: 9,
                kept: 1,
                grasps: vec![grasp],
            }],
            ..ObjectSection::default()
        }],
        tries: vec![TriesRow {
            hand: hand(),
            object: HOSTILE.into(),
            tried: 9,
            kept: 1,
            rejected: [(HOSTILE.to_owned(), 8)].into(),
            ..TriesRow::default()
        }],
        labels: LabelSection {
            personas: vec![(HOSTILE.into(), HOSTILE.into())],
            prevalence: vec![Prevalence {
                hand: hand(),
                object_type: "mug".into(),
                n_grasps: 0,
                yes: vec![0; 3],
            }],
            hands: vec![HandLabels {
                hand: hand(),
                yes: vec![0; 3],
                ceiling: Some(f64::NAN),
                ..HandLabels::default()
            }],
            agreement: vec![Agreement {
                hand: hand(),
                task: "pouring".into(),
                ..Agreement::default()
            }],
            rules: vec![Rule {
                rule: HOSTILE.into(),
                correlation: f64::NAN,
                ..Rule::default()
            }],
        },
        training: vec![NetworkTraining {
            hand: hand(),
            network: "paper".into(),
            nodes: vec![node],
            ..NetworkTraining::default()
        }],
        experiment_a: Some(maps()),
        experiment_b: Some(ExperimentB {
            account: Account {
                answer: HOSTILE.into(),
                measured: vec![HOSTILE.into()],
                not_shown: vec![HOSTILE.into()],
            },
            results: vec![Confusions {
                hand: hand(),
                network: "paper".into(),
                ceiling: None,
                matrices: vec![Confusion {
                    evidence: "O".into(),
                    counts: vec![vec![2, 1, 0], vec![0; 3], vec![0, 0, 3]],
                    paper: TASKS.map(|t| paper_recall("O", t)).to_vec(),
                }],
            }],
        }),
        experiment_c: Some(ExperimentC {
            demonstration: picture("demonstration"),
            runs: vec![ImitationRun {
                network: "paper".into(),
                task_posterior: vec![0.2, 0.8, 0.0],
                recognised: "pouring".into(),
                objects: vec![candidate(0.1), candidate(0.9)],
                grasps: vec![candidate(f64::NAN)],
                joint: Some(candidate(0.5)),
                joint_similar: None,
                lambda: 0.8,
            }],
            ..ExperimentC::default()
        }),
        limits: vec![HOSTILE.into()],
        files: vec![("tables/b.csv".into(), HOSTILE.into())],
    }
}

/// The tags of a page, without what they enclose.
fn tags(html: &str) -> Vec<&str> {
    html.split('<')
        .skip(1)
        .filter_map(|rest| rest.split_once('>').map(|(tag, _)| tag))
        .collect()
}

#[test]
fn no_data_gives_a_page_that_says_so() {
    let page = render_page(&ReportData::default());
    assert!(page.html.contains("No objects were in this run."));
    assert_eq!(page.html.matches("This run did not include it").count(), 3);
    assert!(page.figures.is_empty());
}

#[test]
fn names_cannot_leave_their_text_and_nothing_is_fetched() {
    let page = render_page(&full());
    assert!(!page.html.contains("<script"));
    assert!(page.html.contains("default-src 'none'"));
    for tag in tags(&page.html) {
        assert!(
            !tag.contains("http-equiv=\"refresh\"") && !tag.starts_with("link") && !tag.starts_with("iframe")
        );
        for source in tag.split("src=\"").skip(1) {
            assert!(source.starts_with("data:image/png;base64,"), "{}", &source[..40]);
        }
        for target in tag.split(" href=\"").skip(1) {
            assert!(
                ["#", "tables/b.csv\"", "data:image/png;base64,"]
                    .iter()
                    .any(|s| target.starts_with(s)),
                "{tag}"
            );
        }
    }
}

#[test]
fn every_picture_has_words_and_a_size_and_every_figure_a_name() {
    let page = render_page(&full());
    for tag in tags(&page.html) {
        if tag.starts_with("img ") {
            assert!(
                tag.contains(" alt=") && tag.contains(" width=") && tag.contains(" height="),
                "{tag}"
            );
        }
        if tag.contains("role=\"img\"") {
            assert!(tag.contains("aria-label="), "{tag}");
        }
    }
    let ids: Vec<&str> = page
        .html
        .split(" id=\"")
        .skip(1)
        .filter_map(|s| s.split('"').next())
        .collect();
    assert_eq!(ids.len(), ids.iter().collect::<BTreeSet<_>>().len(), "{ids:?}");
}

#[test]
fn every_tag_is_closed_in_order() {
    let page = render_page(&full());
    let mut open = Vec::new();
    for tag in tags(&page.html) {
        let name = tag
            .trim_start_matches('/')
            .split([' ', '/', '\n'])
            .next()
            .unwrap_or_default();
        let alone = tag.ends_with('/') || tag.starts_with('!') || ["meta", "img", "br"].contains(&name);
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !alone {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

#[test]
fn figures_have_names_of_their_own_that_are_plain_file_names() {
    let page = render_page(&full());
    let names: BTreeSet<&str> = page.figures.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names.len(), page.figures.len());
    for (name, bytes) in &page.figures {
        assert!(
            name.chars()
                .all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c)),
            "{name}"
        );
        let start: &[u8] = match name.rsplit_once('.') {
            Some((_, "svg")) => b"<svg",
            Some((_, "png")) => b"\x89PNG",
            _ => panic!("{name} is neither SVG nor PNG"),
        };
        assert!(bytes.starts_with(start), "{name}");
        assert!(
            !String::from_utf8_lossy(bytes).contains("var(--"),
            "{name} has colours that only the page knows"
        );
    }
    for part in [
        "stage-times.svg",
        "tries-human.svg",
        "bic-human-paper.svg",
        "experiment-b-human-paper-o.svg",
        "lead.png",
    ] {
        assert!(names.contains(part), "{part} is missing among {names:?}");
    }
}

#[test]
fn the_same_data_give_the_same_page() {
    assert!(render_page(&full()) == render_page(&full()));
}
