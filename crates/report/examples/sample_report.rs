//! A report on made-up numbers: `cargo run -p prehend-report --example sample_report -- index.html` writes it, without an
//! argument its size is printed.

use std::sync::Arc;

use nalgebra::Point3;
use prehend_geometry::{OrientedBox, Solid};
use prehend_report::{
    Confusion, Confusions, DisplayMesh, ExperimentA, ExperimentB, Icosphere, NetworkMaps, ObjectMaps,
    ObjectSection, ReportData, Scene, SphereMap, Summary, View, paper_recall, render_page, sphere_sheet,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let tasks = ["hand-over", "pouring", "tool-use"];
    let can = Arc::new(DisplayMesh::new(
        &Solid::Cylinder {
            half_length: 0.06,
            radius: 0.03,
        }
        .display_mesh(),
    ));
    let in_box = Scene::boxes(&can, &[OrientedBox::centered([0.06, 0.06, 0.12])]);

    // A map a task: the hand comes from the side, the more so the later the task.
    let grid = Icosphere::new(4);
    let map = |(i, task): (usize, &&str)| {
        let log: Vec<f64> = grid
            .directions()
            .iter()
            .map(|d| -2.0 * i as f64 * d.z * d.z)
            .collect();
        SphereMap {
            task: (*task).into(),
            density: grid.normalized(&log),
            marks: vec![],
        }
    };
    let maps: Vec<SphereMap> = tasks.iter().enumerate().map(map).collect();
    let sheet = sphere_sheet(&can, &Point3::origin(), &grid, &maps, 112)?;
    println!(
        "densest direction of {}: {:.1} times uniform",
        tasks[2], sheet.rows[2].peak
    );

    let evidence = ["O", "O, A", "O, A, C"];
    let matrix = |evidence: &str| Confusion {
        evidence: evidence.into(),
        counts: vec![vec![56, 24, 20], vec![12, 78, 10], vec![10, 15, 75]],
        paper: tasks.iter().map(|task| paper_recall(evidence, task)).collect(),
    };
    let confusions = Confusions {
        hand: "made up".into(),
        network: "paper".into(),
        ceiling: Some(0.85),
        matrices: evidence.map(matrix).to_vec(),
    };
    let objects = vec![ObjectMaps {
        object: "can".into(),
        object_type: "cylinder".into(),
        sheet,
    }];
    let page = render_page(&ReportData {
        tasks: tasks.map(String::from).to_vec(),
        summary: Summary {
            sentences: vec!["Nothing here was measured.".into()],
            ..Summary::default()
        },
        objects: vec![ObjectSection {
            name: "can".into(),
            object_type: "cylinder".into(),
            boxes: in_box.picture(View::Oblique, 360, "can", "A cylinder in its box.")?,
            ..ObjectSection::default()
        }],
        experiment_a: Some(ExperimentA {
            networks: vec![NetworkMaps {
                network: "paper".into(),
                objects,
            }],
            ..Default::default()
        }),
        experiment_b: Some(ExperimentB {
            results: vec![confusions],
            ..Default::default()
        }),
        ..ReportData::default()
    });
    println!("{} kB, {} figures", page.html.len() / 1000, page.figures.len());
    if let Some(path) = std::env::args().nth(1) {
        std::fs::write(path, page.html)?;
    }
    Ok(())
}
