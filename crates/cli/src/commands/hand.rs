//! `prehend hand PATH` and `prehend hand init FILE.urdf --out DIR`

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::{Context, Result};
use nalgebra::Isometry3;
use prehend::hand::{Hand, JointKind};
use prehend::hand_folder::read_hand;
use prehend::hand_init::init;
use serde_json::{Map, Value, json};

use crate::output::{self, Outcome, Usage};

/// What a hand is made of, and where its links are in a posture
#[derive(clap::Args)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "Example:\n  prehend hand hands/schunk_sdh --posture '{}' --json"
)]
pub struct Arguments {
    #[command(subcommand)]
    action: Option<Action>,

    /// A folder under hands/, or a .urdf
    #[arg(required = true)]
    path: Option<PathBuf>,

    /// Joint positions by name, as JSON; missing joints 0, mimic joints follow
    #[arg(long, conflicts_with = "postures")]
    posture: Option<String>,

    /// JSON lines of postures; - is standard input
    #[arg(long)]
    postures: Option<PathBuf>,
}

#[derive(clap::Subcommand)]
enum Action {
    /// Write a hand folder for any hand's URDF: palm, fingers, closing and pre-shapes are worked out from its shape
    Init(InitArguments),
}

#[derive(clap::Args)]
#[command(after_help = "Example:\n  prehend hand init my_gripper.urdf --out hands/my_gripper")]
struct InitArguments {
    /// The hand's URDF; meshes beside it, or as package://NAME/… in a folder above it
    urdf: PathBuf,

    /// The folder to write: hand.toml, the URDF and its meshes
    #[arg(long)]
    out: PathBuf,

    /// The link that the hand begins with, where the URDF has more than a hand and this is not found [an arm of more
    /// than two joints below the palm is left out]
    #[arg(long, value_name = "LINK")]
    root: Option<String>,

    /// Write hand.toml anew where the folder has one
    #[arg(long)]
    force: bool,
}

impl InitArguments {
    fn run(self, json: bool) -> Result<Outcome> {
        let made = init(&self.urdf, &self.out, self.root.as_deref(), self.force)?;
        let guesses: Vec<Value> = made
            .proposal
            .guesses
            .iter()
            .map(|g| json!({ "key": g.key, "found": g.found, "because": g.because, "confidence": g.confidence.as_str() }))
            .collect();
        let link = |l: prehend::hand::LinkIdx| made.hand.link(l).name.clone();
        let exempt: Vec<Value> = made
            .proposal
            .exempt
            .iter()
            .map(|(a, b, because)| json!({ "links": [link(*a), link(*b)], "because": because }))
            .collect();
        if !json {
            for guess in &made.proposal.guesses {
                eprintln!(
                    "{}: {}\n  {} confidence: {}",
                    guess.key,
                    guess.found,
                    guess.confidence.as_str(),
                    guess.because
                );
            }
            for note in &made.notes {
                eprintln!("note: {note}");
            }
        }
        let answer = json!({
            "out": self.out.to_string_lossy(),
            "files": made.files,
            "hand": describe(&made.hand),
            "guesses": guesses,
            "self_collision_exempt": exempt,
            "notes": made.notes,
        });
        output::answer(json, &answer, |a| {
            format!(
                "{}: {} written; look at {}/hand.toml",
                a["out"].as_str().unwrap_or(""),
                a["files"].as_array().map_or(0, Vec::len),
                a["out"].as_str().unwrap_or("")
            )
        })?;
        Ok(Outcome::Done)
    }
}

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        if let Some(Action::Init(init)) = self.action {
            return init.run(json);
        }
        let path = self
            .path
            .ok_or_else(|| Usage("give a hand's folder or a .urdf".to_owned()))?;
        let hand = read_hand(&path)?;
        let mut facts = describe(&hand);
        if let Some(file) = &self.postures {
            let run = |value: Value| Ok(json!({ "poses": poses(&hand, value)? }));
            return output::each_json_line(json, file, run, output::plain);
        }
        if let Some(text) = &self.posture {
            let value = serde_json::from_str(text)
                .map_err(|e| Usage(format!("--posture: {e}; expected '{{\"JOINT\": value}}'")))?;
            facts["poses"] = poses(&hand, value)?;
        }
        output::answer(json, &facts, text)?;
        Ok(Outcome::Done)
    }
}

fn describe(hand: &Hand) -> Value {
    let joints: Vec<Value> = hand
        .joints()
        .iter()
        .map(|j| {
            let bounded = j.kind != JointKind::Continuous;
            json!({
                "name": j.name,
                "type": j.kind.as_str(),
                "lower": bounded.then_some(j.lower),
                "upper": bounded.then_some(j.upper),
                "mimic": j.mimic.map(|m| json!({ "joint": hand.joint(m.joint).name, "multiplier": m.multiplier, "offset": m.offset })),
            })
        })
        .collect();
    let link = |i: &prehend::hand::LinkIdx| hand.link(*i).name.clone();
    let free: Vec<_> = hand.free_joints().map(|j| hand.joint(j).name.clone()).collect();
    let fingers = hand.description().map_or(json!([]), |d| {
        json!(
            d.fingers
                .iter()
                .map(|f| json!({
                    "name": f.name,
                    "joints": f.joints.iter().map(|j| hand.joint(*j).name.clone()).collect::<Vec<_>>(),
                    "links": f.links.iter().map(link).collect::<Vec<_>>(),
                }))
                .collect::<Vec<_>>()
        )
    });
    let eigengrasps = hand.description().map_or(json!([]), |d| {
        json!(
            d.eigengrasps
                .iter()
                .map(|e| {
                    let direction: Map<String, Value> = free
                        .iter()
                        .zip(&e.direction)
                        .filter(|(_, v)| **v != 0.0)
                        .map(|(n, v)| (n.clone(), json!(v)))
                        .collect();
                    json!({ "name": e.name, "direction": direction, "lower": e.lower, "upper": e.upper })
                })
                .collect::<Vec<_>>()
        )
    });
    json!({
        "name": hand.name(),
        "dof": hand.n_dof(),
        "joints": joints,
        "links": hand.links().iter().map(|l| l.name.clone()).collect::<Vec<_>>(),
        "fingers": fingers,
        "eigengrasps": eigengrasps,
        "warnings": hand.warnings(),
    })
}

fn poses(hand: &Hand, posture: Value) -> Result<Value> {
    let posture: BTreeMap<String, f64> = serde_json::from_value(posture)
        .context("expected a posture: an object from joint names to numbers (rad, m)")?;
    let poses = hand.link_poses(&hand.positions(&posture)?);
    let named = hand
        .links()
        .iter()
        .zip(poses.as_slice())
        .map(|(l, p)| (l.name.clone(), pose_json(p)));
    Ok(Value::Object(named.collect()))
}

/// A pose as answers give it: translation (m) and quaternion w x y z, w ≥ 0.
pub fn pose_json(pose: &Isometry3<f64>) -> Value {
    let (t, q) = (pose.translation.vector, pose.rotation);
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    // Adding 0 turns -0 into 0.
    let [w, x, y, z] = [q.w, q.i, q.j, q.k].map(|v| sign * v + 0.0);
    json!({ "translation": [t.x, t.y, t.z], "quaternion_wxyz": [w, x, y, z] })
}

fn text(facts: &Value) -> String {
    let mut out = format!(
        "{}: {} degrees of freedom\n",
        facts["name"].as_str().unwrap_or(""),
        facts["dof"]
    );
    for j in facts["joints"].as_array().into_iter().flatten() {
        out += &format!(
            "  joint {:28} {:10} {} … {}{}\n",
            j["name"].as_str().unwrap_or(""),
            j["type"].as_str().unwrap_or(""),
            j["lower"],
            j["upper"],
            j["mimic"]["joint"]
                .as_str()
                .map_or(String::new(), |m| format!("  follows {m}"))
        );
    }
    for (name, pose) in facts["poses"].as_object().into_iter().flatten() {
        out += &format!(
            "  link {name:28} {} {}\n",
            pose["translation"], pose["quaternion_wxyz"]
        );
    }
    out
}
