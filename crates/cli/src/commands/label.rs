//! `prehend label GRASPS… --tutor scripted`

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use prehend::frame::Frame;
use prehend::grasp_table::records;
use prehend::labels::{LabelStore, Session};
use prehend::stages::decompose::shape_of;
use prehend::stages::label::{label, observe_all, tutor_object};
use prehend::tutor::{Persona, TutorHand};
use prehend::{ObjectOptions, files, hand_folder, run_record};
use serde_json::{Value, json};

use crate::output::{self, Outcome};

/// Let the scripted tutor say which tasks each grasp affords
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  prehend label out/grasps/schunk_sdh --tutor scripted --persona strict --out labels.sqlite"
)]
pub struct Arguments {
    /// Grasp tables or folders of them; their meshes and hands are found through the columns `mesh` and `hand_path`
    #[arg(required = true)]
    grasps: Vec<PathBuf>,

    /// Who labels
    #[arg(long, value_enum, default_value = "scripted")]
    tutor: Tutor,

    /// strict, lenient or receiver-first
    #[arg(long, default_value = "strict", value_parser = persona)]
    persona: Persona,

    /// Seed of the draws
    #[arg(long, default_value_t = 1)]
    seed: u64,

    /// Share of answers turned round by mistake, 0 to 0.5
    #[arg(long, default_value_t = 0.0)]
    flip: f64,

    /// The store; created or appended to
    #[arg(long)]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Tutor {
    Scripted,
}

fn persona(name: &str) -> Result<Persona, String> {
    Persona::ALL
        .into_iter()
        .find(|p| p.name() == name)
        .ok_or_else(|| {
            let names: Vec<_> = Persona::ALL.iter().map(|p| p.name()).collect();
            format!("found `{name}`, expected one of {}", names.join(", "))
        })
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        let Tutor::Scripted = self.tutor;
        if !(0.0..=0.5).contains(&self.flip) {
            bail!(output::Usage(format!(
                "--flip {}: expected a share from 0 to 0.5",
                self.flip
            )));
        }
        let mut store = self.out.as_deref().map(LabelStore::open).transpose()?;
        let mut counts: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
        let mut n_grasps: BTreeMap<String, usize> = BTreeMap::new();
        for path in &self.grasps {
            for file in files::list(path, &["parquet", "csv", "jsonl"])? {
                self.one(&file, store.as_mut(), &mut counts, &mut n_grasps)?;
            }
        }
        let answer = json!({
            "tutor": "scripted", "persona": self.persona.name(), "grasps": n_grasps, "tasks": counts,
        });
        output::answer(json, &answer, text)?;
        Ok(Outcome::Done)
    }

    fn one(
        &self,
        file: &Path,
        store: Option<&mut LabelStore>,
        counts: &mut BTreeMap<String, BTreeMap<String, usize>>,
        n_grasps: &mut BTreeMap<String, usize>,
    ) -> Result<()> {
        let frame = Frame::read(file)?;
        if frame.n_rows() == 0 {
            return Ok(());
        }
        let name = || output::shown(file);
        let only = |column: &str| -> Result<String> {
            let mut values = frame.texts(column).with_context(name)?;
            values.dedup();
            match values.as_slice() {
                [one] => Ok(one.clone()),
                _ => bail!(
                    "{}: column `{column}` has several values; label the tables of one hand and object at a time",
                    name()
                ),
            }
        };
        let hand = hand_folder::read_described_hand(Path::new(&only("hand_path")?))?;
        let shape = shape_of(Path::new(&only("mesh")?), ObjectOptions::default())?;
        let grasps = records(&frame, &hand).with_context(name)?;
        let tutor_hand = TutorHand::new(&hand)?;
        let observations = observe_all(&tutor_hand, &tutor_object(&shape)?, &grasps);
        let labelled = label(&grasps, &observations, self.persona, self.seed, self.flip);
        let kind = shape.object.kind.clone();
        *n_grasps.entry(kind.clone()).or_insert(0) += labelled.len();
        for answer in labelled.iter().flat_map(|l| &l.answers) {
            let count = counts
                .entry(answer.task.clone())
                .or_default()
                .entry(kind.clone())
                .or_insert(0);
            *count += usize::from(answer.yes);
        }
        if let Some(store) = store {
            let fingerprint = frame.metadata.get("fingerprint").cloned();
            let dataset = match fingerprint {
                Some(fingerprint) => fingerprint,
                None => files::Fingerprint::of_stage("label")
                    .with(&files::read(file)?)
                    .finish(),
            };
            let session = Session {
                tutor: "scripted".into(),
                persona: self.persona.name().into(),
                seed: self.seed,
                dataset,
                hand: hand.name().into(),
                object: only("object")?,
                object_type: kind,
            };
            if !store.has(&session)? {
                store.append(&session, &labelled, &run_record::now())?;
            }
        }
        Ok(())
    }
}

fn text(answer: &Value) -> String {
    let mut out = String::new();
    for (kind, n) in answer["grasps"].as_object().into_iter().flatten() {
        out += &format!("{kind:14} {n:>6} grasps");
        for (task, counts) in answer["tasks"].as_object().into_iter().flatten() {
            out += &format!("   {task} {}", counts.get(kind).unwrap_or(&json!(0)));
        }
        out.push('\n');
    }
    out
}
