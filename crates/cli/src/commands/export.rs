//! `prehend export FILE…`

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use prehend::export::{
    GRIP, ServoGains, convex_pieces, exported, grasp_json, grasp_pictures, isaac_yaml, mjcf_scene,
    moveit_yaml,
};
use prehend::files;
use prehend::frame::Frame;
use prehend::hand_folder::read_described_hand;
use prehend::object::{Object, ObjectOptions};
use serde_json::{Map, Value, json};

use super::grasps::Filter;
use super::shape_input::positive;
use crate::output::{self, Outcome};

/// Write grasps in the formats of other programs
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  prehend export out/grasps/human --object coffee_mug --top 20 --format mjcf --out scenes"
)]
pub struct Arguments {
    /// Grasp tables (.parquet, .csv, .jsonl) or folders of them
    #[arg(required = true)]
    files: Vec<PathBuf>,

    #[command(flatten)]
    filter: Filter,

    /// What is written
    #[arg(long, value_enum)]
    format: Format,

    /// Sum of the normal forces of the squeeze, N
    #[arg(long, default_value_t = GRIP, value_parser = positive, allow_negative_numbers = true)]
    grip: f64,

    /// The folder that gets the files: one for each hand and object, with mjcf one and with png two for each grasp
    #[arg(long)]
    out: PathBuf,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum Format {
    /// All of it: pre-grasp, grasp, squeeze, contacts
    Json,
    /// The table's columns
    Csv,
    /// Scenes for MuJoCo, one for each grasp
    Mjcf,
    /// `isaac_grasp` files, version 1.0
    Isaac,
    /// Lists of `moveit_msgs/Grasp`
    Moveit,
    /// Pictures of each grasp, from the front and from the side
    Png,
}

/// Pixels along a side of a picture.
const PICTURE_SIZE: usize = 480;

impl Arguments {
    pub fn run(self, json: bool) -> Result<Outcome> {
        let (frame, rows) = self.filter.read(&self.files)?;
        if rows.is_empty() {
            bail!("no grasp is left by the filters; leave some out, or see `prehend grasps`");
        }
        // A file holds the grasps of one hand on one object.
        let mut groups: BTreeMap<(String, String), Vec<usize>> = BTreeMap::new();
        let (hands, meshes) = (frame.texts("hand_path")?, frame.texts("mesh")?);
        for row in rows {
            groups
                .entry((hands[row].clone(), meshes[row].clone()))
                .or_default()
                .push(row);
        }
        let (mut written, mut deviations) = (Vec::new(), Map::new());
        let (mut n_grasps, mut unbalanced) = (0, 0);
        for ((hand, mesh), rows) in groups {
            n_grasps += rows.len();
            // Joints of other hands are not of this group.
            let table = frame.select(&rows).without_empty_columns();
            let made = self.group(
                &table,
                Path::new(&hand),
                Path::new(&mesh),
                &mut deviations,
                &mut unbalanced,
            );
            written.extend(made.with_context(|| format!("grasps of {hand} on {mesh}"))?);
        }
        let mut answer = json!({ "grasps": n_grasps, "files": written });
        if self.format != Format::Csv {
            answer["unbalanced"] = json!(unbalanced);
        }
        if self.format == Format::Mjcf {
            answer["pieces"] = Value::Object(deviations);
        }
        output::answer(json, &answer, text)?;
        Ok(Outcome::Done)
    }

    fn group(
        &self,
        table: &Frame,
        hand: &Path,
        mesh: &Path,
        deviations: &mut Map<String, Value>,
        unbalanced: &mut usize,
    ) -> Result<Vec<String>> {
        let object = &table.texts("object")?[0];
        let name = format!("{}_{object}", table.texts("hand")?[0]);
        let mut written = Vec::new();
        let mut write = |name: String, text: &[u8]| -> Result<()> {
            files::write(&self.out.join(&name), text)?;
            written.push(name);
            Ok(())
        };
        if self.format == Format::Csv {
            write(format!("{name}.csv"), &table.to_csv()?)?;
            return Ok(written);
        }
        let hand = read_described_hand(hand)?;
        let grasps = exported(table, &hand, &ServoGains::default(), self.grip)?;
        *unbalanced += grasps.iter().filter(|g| g.squeeze.forces.is_none()).count();
        match self.format {
            Format::Json => {
                let list: Vec<Value> = grasps.iter().map(|g| grasp_json(&hand, g)).collect();
                let file = json!({
                    "format": "prehend-grasps", "version": 1, "object": object, "mesh": mesh, "grasps": list,
                });
                write(format!("{name}.json"), &serde_json::to_vec_pretty(&file)?)?;
            }
            Format::Isaac => write(
                format!("{name}.isaac.yaml"),
                isaac_yaml(&hand, object, &grasps)?.as_bytes(),
            )?,
            Format::Moveit => write(
                format!("{name}.moveit.yaml"),
                moveit_yaml(&hand, object, &grasps)?.as_bytes(),
            )?,
            Format::Mjcf => {
                let body = Object::read(mesh, ObjectOptions::default())?;
                let pieces = convex_pieces(&body.mesh);
                let figures = json!({
                    "count": pieces.pieces.len(),
                    "volume_deviation": pieces.volume_deviation,
                    "surface_deviation": pieces.surface_deviation,
                });
                deviations.insert(object.clone(), figures);
                for grasp in &grasps {
                    let scene = mjcf_scene(&hand, &body, &pieces, grasp, ServoGains::default())?;
                    let id = grasp.record.grasp_id.replace(['/', '\\'], "_");
                    write(format!("{id}.xml"), scene.as_bytes())?;
                }
            }
            Format::Png => {
                let body = Object::read(mesh, ObjectOptions::default())?;
                for grasp in &grasps {
                    for picture in grasp_pictures(&hand, &body.mesh, grasp, PICTURE_SIZE)? {
                        let name = picture.name.replace(['/', '\\'], "_");
                        write(format!("{name}.png"), &picture.png)?;
                    }
                }
            }
            Format::Csv => {}
        }
        Ok(written)
    }
}

fn text(answer: &Value) -> String {
    let mut out = format!(
        "{} grasps in {} files\n",
        answer["grasps"],
        answer["files"].as_array().map_or(0, Vec::len)
    );
    if let Some(n @ 1..) = answer["unbalanced"].as_u64() {
        out += &format!("  {n} of them: contact forces cannot balance; all closing joints squeeze alike\n");
    }
    for (object, figures) in answer["pieces"].as_object().into_iter().flatten() {
        let number = |key: &str| figures[key].as_f64().unwrap_or(0.0);
        out += &format!(
            "  {object}: {} convex pieces, {:.1} % more volume than the mesh, up to {:.2} mm off it\n",
            figures["count"],
            100.0 * number("volume_deviation"),
            1000.0 * number("surface_deviation")
        );
    }
    out
}
