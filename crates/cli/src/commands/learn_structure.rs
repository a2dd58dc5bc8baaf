//! `prehend learn-structure DATA…`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use prehend::model::{
    LearnedArc, LearnedStructure, Network, StructureOptions, StructureScore, learn_structure,
};
use prehend::report::{NetworkArc, NetworkNode, network_dot, network_figure};
use prehend::stages::learn::NamedNetwork;
use prehend::training::to_table;
use serde_json::{Value, json};

use super::training_rows::TrainingRows;
use crate::output::{self, Outcome, Usage};

/// Learn the arcs of a network from tables
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  prehend learn-structure out/grasps/human --labels out/labels.sqlite --network networks/tiers.toml --balance task \\\n      --bootstrap 50 --out learned.toml --picture learned.svg\n\
  prehend learn-structure data.csv --network nodes.toml --json"
)]
pub struct Arguments {
    #[command(flatten)]
    rows: TrainingRows,

    /// The nodes, with `[structure]` tiers, required and forbidden arcs where wanted; its own arcs are one start
    #[arg(long)]
    network: PathBuf,

    /// Where the learned network goes (.toml), ready for `prehend train`
    #[arg(long)]
    out: Option<PathBuf>,

    /// Where a picture of it goes (.svg or .dot)
    #[arg(long)]
    picture: Option<PathBuf>,

    /// Resamples of the rows (of whole groups, where there is a group column) for the arcs' confidence
    #[arg(long, default_value_t = 0)]
    bootstrap: usize,

    /// What is maximised
    #[arg(long, value_enum, default_value_t = Score::Bic)]
    score: Score,

    /// Parts of the rows that are held out in turn with `--score held-out`
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(2..=1000))]
    folds: u64,

    /// Shaken graphs to climb from anew
    #[arg(long, default_value_t = 3)]
    restarts: usize,

    /// Most components of a mixture while searching
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u64).range(1..=100))]
    max_components: u64,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Score {
    /// Log-likelihood less ½ parameters · log rows
    Bic,
    /// Log density of held-out rows, or groups
    HeldOut,
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        let network = NamedNetwork::read(&self.network)?;
        let picture = match &self.picture {
            Some(path) => Some((path, Drawing::of(path)?)),
            None => None,
        };
        let asks_for_task = network.network.nodes().iter().any(|node| node.name == "task");
        let rows = self.rows.balanced(self.rows.read(asks_for_task)?, "")?;
        let options = StructureOptions {
            seed: self.rows.seed,
            group: self.rows.group.clone(),
            score: match self.score {
                Score::Bic => StructureScore::Bic,
                Score::HeldOut => StructureScore::CrossValidated {
                    folds: self.folds as usize,
                },
            },
            bootstrap: self.bootstrap,
            restarts: self.restarts,
            max_components: self.max_components as usize,
            ..StructureOptions::default()
        };
        let learned =
            learn_structure(&network.network, &to_table(&rows)?, &options).map_err(|e| self.rows.blame(e))?;
        if let Some(out) = &self.out {
            prehend::files::write(out, learned.network.to_toml().as_bytes())?;
        }
        if let Some((path, drawing)) = picture {
            let text = drawing.draw(&learned);
            prehend::files::write(path, text.as_bytes())?;
        }
        let answer = json!({
            "rows": learned.n_rows,
            "score": learned.score,
            "given_score": learned.given_score,
            "arcs": learned.arcs,
            "rivals": learned.rivals,
            "families": learned.n_families,
            "warnings": learned.warnings,
        });
        output::answer(json, &answer, text).context("writing the answer")?;
        Ok(Outcome::Done)
    }
}

enum Drawing {
    Svg,
    Dot,
}

impl Drawing {
    fn of(path: &Path) -> Result<Self> {
        match prehend::files::extension(path).as_deref() {
            Some("svg") => Ok(Self::Svg),
            Some("dot" | "gv") => Ok(Self::Dot),
            _ => bail!(Usage(format!(
                "--picture {}: expected a file name that ends in .svg or .dot",
                path.display()
            ))),
        }
    }

    fn draw(&self, learned: &LearnedStructure) -> String {
        let nodes: Vec<NetworkNode> = learned
            .network
            .nodes()
            .iter()
            .map(|node| NetworkNode {
                name: node.name.clone(),
                discrete: node.is_discrete(),
            })
            .collect();
        let arcs: Vec<NetworkArc> = learned
            .arcs
            .iter()
            .map(|arc| drawn(&learned.network, arc))
            .collect();
        match self {
            Self::Dot => network_dot(&nodes, &arcs),
            Self::Svg => {
                let meaning = if learned.arcs.iter().any(|arc| arc.confidence.is_some()) {
                    "numbers are the share of resamples that have the arc"
                } else {
                    "numbers are what the score loses without the arc, nats"
                };
                network_figure("network", &format!("Learned arcs; {meaning}"), &nodes, &arcs).svg
            }
        }
    }
}

fn drawn(network: &Network, arc: &LearnedArc) -> NetworkArc {
    let position = |name: &str| {
        network
            .nodes()
            .iter()
            .position(|node| node.name == name)
            .unwrap_or(0)
    };
    let label = match arc.confidence {
        Some(confidence) => format!("{confidence:.2}"),
        None => format!("{:.0}", arc.gain),
    };
    NetworkArc {
        from: position(&arc.from),
        to: position(&arc.to),
        label,
        strength: arc.confidence.unwrap_or(1.0),
    }
}

fn text(answer: &Value) -> String {
    let number = |value: &Value| value.as_f64().map_or("–".into(), |v| format!("{v:.2}"));
    let mut out = format!(
        "{} rows, score {} ({} with the arcs given)\n",
        answer["rows"],
        number(&answer["score"]),
        number(&answer["given_score"])
    );
    let mut list = |title: &str, key: &str| {
        let arcs = answer[key].as_array().map_or(&[][..], Vec::as_slice);
        if arcs.is_empty() {
            return;
        }
        out += &format!("{title:32} gain, nats  confidence  either way\n");
        for arc in arcs {
            let name = format!(
                "{} → {}",
                arc["from"].as_str().unwrap_or(""),
                arc["to"].as_str().unwrap_or("")
            );
            let (gain, confidence) = (number(&arc["gain"]), number(&arc["confidence"]));
            out += &format!(
                "{name:32} {gain:>10}  {confidence:>10}  {:>10}\n",
                number(&arc["either_direction"])
            );
        }
    };
    list("arc", "arcs");
    list("in half of the resamples, not here", "rivals");
    for warning in answer["warnings"].as_array().map_or(&[][..], Vec::as_slice) {
        out += &format!("warning: {}\n", warning.as_str().unwrap_or(""));
    }
    out
}
