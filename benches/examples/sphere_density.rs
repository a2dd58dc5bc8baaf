//! Held-out density on the sphere: von Mises–Fisher mixtures beside Gaussian mixtures of ℝ³ renormalised there.
//!
//! ```text
//! cargo run --release -p prehend-benches --example sphere_density -- out/grasps/human
//! ```
//!
//! Directions are `upos` of the grasp tables; every fifth row is held out, and, apart from that, every fifth object.

use std::path::Path;

use prehend::frame::Frame;
use prehend::model::{Evidence, Model, Network, Table, TrainOptions};
use prehend::training::to_table;

const COLUMNS: &str = "columns = [\"upos_x\", \"upos_y\", \"upos_z\"]\nmixture = { max = 10 }\n";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args()
        .nth(1)
        .ok_or("expected a folder of grasp tables")?;
    let mut frame = Frame::new();
    for file in prehend::files::list(Path::new(&folder), &["parquet"])? {
        frame.append(&Frame::read(&file)?);
    }
    let objects = frame.texts("object")?;
    let mut names = objects.clone();
    names.sort_unstable();
    names.dedup();
    let by_row = |row: usize| row.is_multiple_of(5);
    let by_object = |row: usize| {
        names
            .binary_search(&objects[row])
            .is_ok_and(|place| place.is_multiple_of(5))
    };
    println!(
        "{} rows of {} objects; uniform is {:.3}",
        frame.n_rows(),
        names.len(),
        -(4.0 * std::f64::consts::PI).ln()
    );
    println!(
        "{:34} {:>4} {:>12} {:>15}",
        "model", "K", "held-out row", "held-out object"
    );
    let mut kinds = vec![(
        "von Mises–Fisher".to_string(),
        format!("kind = \"von_mises_fisher_mixture\"\n{COLUMNS}"),
    )];
    for floor in ["0.1", "0.01", "0.0001"] {
        let text = format!("kind = \"gaussian_mixture\"\nsphere = true\nnoise_floor = {floor}\n{COLUMNS}");
        kinds.push((format!("Gaussian of R3, noise floor {floor}"), text));
    }
    for (name, text) in kinds {
        let network = Network::from_toml(&format!("[[node]]\nname = \"upos\"\n{text}"))?;
        let mut shown = Vec::new();
        let mut k = 0;
        for held in [&by_row as &dyn Fn(usize) -> bool, &by_object] {
            let (test, kept): (Vec<usize>, Vec<usize>) = (0..frame.n_rows()).partition(|&row| held(row));
            let trained = Model::fit(
                &network,
                &to_table(&frame.select(&kept))?,
                &TrainOptions::default(),
            )?;
            k = trained.report.nodes[0].components()[0];
            shown.push(on_sphere(&trained.model, &to_table(&frame.select(&test))?)?);
        }
        println!("{name:34} {k:4} {:12.3} {:15.3}", shown[0], shown[1]);
    }
    Ok(())
}

/// Mean log density on the sphere over the rows of a table.
fn on_sphere(model: &Model, table: &Table) -> Result<f64, Box<dyn std::error::Error>> {
    let axis = |name: &str| table.numbers(name, "upos");
    let (x, y, z) = (axis("upos_x")?, axis("upos_y")?, axis("upos_z")?);
    let at: Vec<Vec<f64>> = (0..x.len()).map(|i| vec![x[i], y[i], z[i]]).collect();
    let nothing = Evidence::new();
    let answer = if matches!(model.nodes()[0].cpd, prehend::model::Cpd::VonMisesFisher(_)) {
        model.query_direction("upos", &nothing)?.to_json_at(&at)?
    } else {
        model.query(&["upos"], &nothing)?.to_json_at(&at)?
    };
    let answer: serde_json::Value = serde_json::from_str(&answer)?;
    let densities = answer["log_density_sphere"].as_array().ok_or("no densities")?;
    Ok(densities
        .iter()
        .filter_map(serde_json::Value::as_f64)
        .sum::<f64>()
        / at.len() as f64)
}
