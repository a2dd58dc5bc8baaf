//! A page with confusion matrices of made-up counts. `cargo run -p prehend-report --example sample_report -- index.html`
//! writes it.

use prehend_report::{Confusion, Confusions, ExperimentB, ReportData, paper_recall, render_page};

const TASKS: [&str; 3] = ["hand-over", "pouring", "tool-use"];

fn matrix(evidence: &str, right: usize) -> Confusion {
    let wrong = (100 - right) / 2;
    let row = |t: usize| (0..3).map(|p| if p == t { right } else { wrong }).collect();
    Confusion {
        evidence: evidence.into(),
        counts: (0..3).map(row).collect(),
        paper: TASKS.iter().map(|task| paper_recall(evidence, task)).collect(),
    }
}

fn main() -> std::io::Result<()> {
    let result = Confusions {
        hand: "made up".into(),
        network: "made up".into(),
        ceiling: Some(0.85),
        matrices: vec![matrix("O", 60), matrix("O, A", 70), matrix("O, A, C", 80)],
    };
    for matrix in &result.matrices {
        let recall = matrix.mean_recall().unwrap_or(f64::NAN);
        println!("given {}: mean recall {recall:.2}", matrix.evidence);
    }
    let page = render_page(&ReportData {
        title: "Nothing here was measured".into(),
        tasks: TASKS.map(String::from).to_vec(),
        experiment_b: Some(ExperimentB {
            results: vec![result],
            ..ExperimentB::default()
        }),
        ..ReportData::default()
    });
    println!("{} figures stand beside the page:", page.figures.len());
    for (name, bytes) in &page.figures {
        println!("{name}, {} bytes", bytes.len());
    }
    if let Some(path) = std::env::args().nth(1) {
        std::fs::write(path, page.html)?;
    }
    Ok(())
}
