//! The wet lawn: rain or the sprinkler? And a continuous child that tells how wet.

use prehend_model::{Evidence, Latent, Model};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let model = Model::from_json(
        r#"{ "format": "prehend-model", "version": 1, "nodes": [
        { "name": "rain", "kind": "discrete", "states": ["no", "yes"], "table": [[0.8, 0.2]] },
        { "name": "sprinkler", "kind": "discrete", "states": ["off", "on"], "parents": ["rain"],
          "table": [[0.6, 0.4], [0.99, 0.01]] },
        { "name": "moisture", "kind": "gaussian_mixture", "discrete_parents": ["rain", "sprinkler"], "components": [
          [{ "weight": 1.0, "mean": [0.1], "covariance": [[0.01]] }],
          [{ "weight": 1.0, "mean": [0.6], "covariance": [[0.04]] }],
          [{ "weight": 1.0, "mean": [0.7], "covariance": [[0.04]] }],
          [{ "weight": 1.0, "mean": [0.9], "covariance": [[0.02]] }]] } ] }"#,
    )?;
    let wet = Evidence::from_json(&model, r#"{ "moisture": 0.75 }"#)?;
    println!("{:?}", model.query(&["rain"], &wet)?.probabilities("rain"));
    println!("{}", model.query(&["rain", "sprinkler"], &wet)?.to_json()?);
    for sentence in model.explain("rain", &wet)?.words() {
        println!("{sentence}");
    }
    let off = Evidence::from_json(&model, r#"{ "sprinkler": "off" }"#)?;
    println!("{}", model.counterfactual("rain", &wet, &off)?.words()[0]);
    println!("{}", model.most_probable(&wet, Latent::Summed)?.to_json());
    Ok(())
}
