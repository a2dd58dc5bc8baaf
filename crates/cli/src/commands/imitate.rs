//! `prehend imitate --demonstrator M1 --imitator M2`

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use prehend::frame::Frame;
use prehend::imitation::{Candidate, Scales, Similarity, Weighing, rank_grasps, rank_objects, recognise};
use prehend::stages::imitate::features;
use serde_json::{Map, Value, json};

use super::grasps::{listed, read_tables};
use super::model::read_model;
use crate::output::{self, Outcome, Usage};

/// Choose object and grasp that best imitate a demonstration
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  F=out/grasps/human/camping_cup.parquet\n  prehend imitate --demonstrator out/models/human/task-action.bin --imitator out/models/schunk_sdh/task-action.bin \\\n      \
--demonstration $F:$(prehend grasps $F --limit 1 --format csv | tail -1 | cut -d, -f1) --candidates out/grasps/schunk_sdh"
)]
pub struct Arguments {
    /// The demonstrator's model
    #[arg(long)]
    demonstrator: PathBuf,

    /// The imitator's model
    #[arg(long)]
    imitator: PathBuf,

    /// The shown grasp: TABLE:GRASP_ID
    #[arg(long)]
    demonstration: String,

    /// Tables or folders of the imitator's grasps to choose from
    #[arg(long, required = true, num_args = 1..)]
    candidates: Vec<PathBuf>,

    /// Weight of the task against similarity, 0 to 1
    #[arg(long, default_value_t = 0.8)]
    lambda: f64,

    /// Similarity in Eq. 5: divided by its largest value, or as Eq. 4 has it
    #[arg(long, value_enum, default_value = "scaled")]
    similarity: SimilarityName,

    /// At most this many grasps in the answer
    #[arg(long)]
    top: Option<usize>,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum SimilarityName {
    Scaled,
    Raw,
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        let (teacher, pupil) = (read_model(&self.demonstrator)?, read_model(&self.imitator)?);
        let Some((file, grasp_id)) = self.demonstration.rsplit_once(':') else {
            bail!(Usage(format!(
                "--demonstration {}: expected TABLE:GRASP_ID",
                self.demonstration
            )));
        };
        let shown_table = read_tables(&[PathBuf::from(file)], Frame::append)?;
        let row = shown_table
            .texts("grasp_id")
            .with_context(|| file.to_owned())?
            .iter()
            .position(|id| id == grasp_id);
        let row = row
            .with_context(|| format!("{file}: no grasp `{grasp_id}`; `prehend grasps {file}` lists them"))?;
        let shown = features(&shown_table).with_context(|| file.to_owned())?[row];

        let table = read_tables(&self.candidates, Frame::append)?;
        let all = features(&table).with_context(|| listed(&self.candidates))?;
        let (ids, names) = (table.texts("grasp_id")?, table.texts("object")?);
        let candidates: Vec<Candidate> = (0..table.n_rows())
            .map(|r| Candidate {
                grasp_id: ids[r].clone(),
                object: names[r].clone(),
                features: all[r],
            })
            .collect();
        let mut objects: Vec<Candidate> = Vec::new();
        for candidate in &candidates {
            if !objects.iter().any(|o| o.object == candidate.object) {
                objects.push(candidate.clone());
            }
        }
        let weighing = Weighing {
            lambda: self.lambda,
            similarity: match self.similarity {
                SimilarityName::Scaled => Similarity::Scaled,
                SimilarityName::Raw => Similarity::Raw,
            },
        };
        let posterior = recognise(&teacher, &shown)?;
        let task = posterior.most_probable().to_owned();
        let scales = Scales::of_model(&pupil).unwrap_or_else(|error| {
            eprintln!("note: {error}; this answer takes them from the candidates");
            Scales::of(&all)
        });
        let ranked_objects = rank_objects(&pupil, &task, &shown, &objects, &scales, weighing)?;
        let ranked_grasps = rank_grasps(&pupil, &task, &shown, &candidates, &scales, weighing)?;
        let probabilities: Map<String, Value> = posterior
            .tasks
            .iter()
            .cloned()
            .zip(posterior.probabilities.iter().map(|p| json!(p)))
            .collect();
        let answer = json!({
            "task": { "posterior": probabilities, "recognised": task },
            "objects": ranked_objects.iter().map(|r| json!({
                "object": objects[r.candidate_idx].object, "p_task": r.p_task,
                "similarity": r.similarity, "similarity_raw": r.similarity_raw, "total": r.total,
            })).collect::<Vec<_>>(),
            "grasps": ranked_grasps.iter().take(self.top.unwrap_or(usize::MAX)).map(|r| json!({
                "grasp_id": candidates[r.candidate_idx].grasp_id, "object": candidates[r.candidate_idx].object,
                "p_task": r.p_task, "similarity": r.similarity, "similarity_raw": r.similarity_raw, "total": r.total,
            })).collect::<Vec<_>>(),
        });
        output::answer(json, &answer, text)?;
        Ok(Outcome::Done)
    }
}

fn text(answer: &Value) -> String {
    let number = |v: &Value| v.as_f64().unwrap_or(f64::NAN);
    let mut out = format!(
        "recognised: {}  {}\n",
        answer["task"]["recognised"], answer["task"]["posterior"]
    );
    for o in answer["objects"].as_array().into_iter().flatten() {
        out += &format!(
            "  object {:30} P {:.3}  S {:.3}  total {:.3}\n",
            o["object"].as_str().unwrap_or(""),
            number(&o["p_task"]),
            number(&o["similarity"]),
            number(&o["total"])
        );
    }
    for g in answer["grasps"].as_array().into_iter().flatten().take(10) {
        out += &format!(
            "  grasp  {:30} P {:.3}  S {:.3}  total {:.3}\n",
            g["grasp_id"].as_str().unwrap_or(""),
            number(&g["p_task"]),
            number(&g["similarity"]),
            number(&g["total"])
        );
    }
    out
}
