//! Which task is a grasp for? Learns from rows, then asks: one grasp at length, many at once, and one like none before.

use prehend_model::{BatchQuery, Evidence, Model, Network, TrainOptions};

/// Where the rows come from: pourers hold wide things from the side, users narrow ones from above.
const WORLD: &str = r#"{ "format": "prehend-model", "version": 1, "nodes": [
    { "name": "task", "kind": "discrete", "states": ["pour", "use"], "table": [[0.5, 0.5]] },
    { "name": "width", "kind": "gaussian_mixture", "discrete_parents": ["task"], "components": [
      [{ "weight": 1.0, "mean": [0.08], "covariance": [[2e-4]] }],
      [{ "weight": 0.6, "mean": [0.03], "covariance": [[1e-4]] }, { "weight": 0.4, "mean": [0.07], "covariance": [[1e-4]] }]] },
    { "name": "height", "kind": "gaussian_mixture", "discrete_parents": ["task"], "continuous_parents": ["width"], "components": [
      [{ "weight": 1.0, "mean": [0.02], "coefficients": [[0.5]], "covariance": [[1e-3]] }],
      [{ "weight": 1.0, "mean": [0.10], "coefficients": [[-0.5]], "covariance": [[1e-3]] }]] }] }"#;

const NETWORK: &str = r#"
    [[node]]
    name = "task"
    kind = "discrete"
    states = ["pour", "use"]

    [[node]]
    name = "width"
    kind = "gaussian_mixture"
    parents = ["task"]
    mixture = { max = 3, choose = "bic" }

    [[node]]
    name = "height"
    kind = "gaussian_mixture"
    parents = ["task", "width"]
    mixture = { components = 1 }
"#;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let rows = Model::from_json(WORLD)?.sample(600, 1);
    let model = Model::fit(&Network::from_toml(NETWORK)?, &rows, &TrainOptions::default())?.model;
    let grasp = Evidence::from_json(&model, r#"{ "width": 0.072, "height": 0.03 }"#)?;
    println!("{}", model.query(&["task"], &grasp)?.to_json()?);
    println!("{}", model.explain("task", &grasp)?.words()[0]);
    let higher = Evidence::from_json(&model, r#"{ "height": 0.12 }"#)?;
    println!("{}", model.counterfactual("task", &grasp, &higher)?.words()[0]);
    let strange = Evidence::from_json(&model, r#"{ "width": 0.5, "height": 0.03 }"#)?;
    println!("{}", model.surprise(&strange)?.words());
    let query = BatchQuery::new(&model, "task", &["width", "height"])?;
    let answers = query
        .run_table(&rows)?
        .into_iter()
        .collect::<Result<Vec<_>, _>>()?;
    let sure = answers
        .iter()
        .filter(|answer| answer.posterior.iter().any(|p| *p > 0.9))
        .count();
    println!("of 600 rows, {sure} are clear");
    Ok(())
}
