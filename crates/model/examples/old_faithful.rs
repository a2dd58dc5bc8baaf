//! Old Faithful: how long until the next eruption? Learned from 272 of them.
//!
//! Minutes that an eruption lasted, and minutes until the next one: the data set `faithful` of R, after Azzalini and
//! Bowman, "A look at some data on the Old Faithful geyser", Applied Statistics 39 (1990).

use prehend_model::{Ensemble, Evidence, Model, Network, Table, TrainOptions};

const ROWS: &str = include_str!("old_faithful.csv");

const NETWORK: &str = r#"
[[node]]
name = "eruptions"
kind = "gaussian_mixture"
[[node]]
name = "waiting"
kind = "gaussian_mixture"
parents = ["eruptions"]
"#;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut eruptions, mut waiting) = (Vec::new(), Vec::new());
    for line in ROWS.lines().skip(1) {
        let (a, b) = line.split_once(',').ok_or("two numbers a line")?;
        eruptions.push(a.parse()?);
        waiting.push(b.parse()?);
    }
    let table = Table::new(eruptions.len())
        .with_numbers("eruptions", eruptions)?
        .with_numbers("waiting", waiting)?;
    let trained = Model::fit(&Network::from_toml(NETWORK)?, &table, &TrainOptions::default())?;
    for node in &trained.report.nodes {
        println!("{}: components {:?}", node.name, node.components());
    }
    let model = trained.model;
    for minutes in [2.0, 4.5] {
        let evidence = Evidence::new().with_value(&model, "eruptions", &[minutes])?;
        let next = model.query(&["waiting"], &evidence)?.joint_mixture();
        let (mean, deviation) = (next.mean()[0], next.covariance()[0].sqrt());
        println!("after {minutes} minutes: wait {mean:.1} ± {deviation:.1}");
    }
    // Twenty eruptions leave more open than 272.
    let few = Model::fit(
        &Network::from_toml(NETWORK)?,
        &table.select(&(0..20).collect::<Vec<_>>()),
        &TrainOptions::default(),
    )?;
    let ensemble = Ensemble::drawn(&few.model, 200, 1)?;
    let answer = ensemble
        .query(&["waiting"], &Evidence::new())?
        .mean
        .joint_mixture();
    println!(
        "from 20 rows: wait {:.1} ± {:.1}",
        answer.mean()[0],
        answer.covariance()[0].sqrt()
    );
    Ok(())
}
