//! Experiments A, B and C as the report shows them.

use nalgebra::Vector3;
use prehend_report::{
    Account, Candidate, Confusion, Confusions, ExperimentA, ExperimentB, ExperimentC, Icosphere,
    ImitationRun, NetworkMaps, ObjectMaps, SphereMap, paper_recall, sphere_sheet,
};

use super::{Inputs, Stand, tasks_of};
use crate::Error;
use crate::stages::ask::MAP_LEVEL;
use crate::stages::imitate::{Imitation, RankedGrasp, RankedObject};
use crate::training::TASKS;

/// Pixels of one map.
const MAP_PIXELS: usize = 150;

/// Labelled grasps marked on one map at most.
const MARKS: usize = 150;

pub(super) fn maps(inputs: &Inputs, stand: &Stand) -> Result<Option<ExperimentA>, Error> {
    if inputs.answers.maps.is_empty() {
        return Ok(None);
    }
    let grid = Icosphere::new(MAP_LEVEL);
    let mut networks: Vec<NetworkMaps> = Vec::new();
    let mut likeliest = Vec::new();
    for map in &inputs.answers.maps {
        let Some(shape) = inputs.shapes.iter().find(|s| s.object.name == map.object) else {
            continue;
        };
        let rows: Vec<SphereMap> = TASKS
            .iter()
            .zip(&map.densities)
            .map(|(task, density)| {
                Ok(SphereMap {
                    task: (*task).to_owned(),
                    density: density.clone(),
                    marks: marks(inputs, &map.object, task)?,
                })
            })
            .collect::<Result<_, Error>>()?;
        let center = shape.decomposition.root.center();
        let sheet = sphere_sheet(
            &stand.meshes[map.object.as_str()],
            &center,
            &grid,
            &rows,
            MAP_PIXELS,
        )
        .map_err(Error::input)?;
        for row in &sheet.rows {
            likeliest.push(format!(
                "{}, {}, {}: {:.0} % above the middle",
                map.network,
                map.object,
                row.task,
                row.above * 100.0
            ));
        }
        let entry = ObjectMaps {
            object: map.object.clone(),
            object_type: shape.object.kind.clone(),
            sheet,
        };
        match networks.iter_mut().find(|n| n.network == map.network) {
            Some(network) => network.objects.push(entry),
            None => networks.push(NetworkMaps {
                network: map.network.clone(),
                objects: vec![entry],
            }),
        }
    }
    let account = Account {
        answer: format!(
            "Maps for {} objects that {} had not seen, three tasks each, with both networks.",
            inputs.experiments.a.held_out.len(),
            inputs.experiments.imitator
        ),
        measured: vec![format!(
            "Trained on the grasps of {} on the other {} objects; held out: {}.",
            inputs.experiments.imitator,
            inputs.shapes.len() - inputs.experiments.a.held_out.len(),
            inputs.experiments.a.held_out.join(", ")
        )],
        not_shown: vec![
            "A map shows a direction, not a distance, and not whether the hand fits there.".into(),
            "In the network of the paper the position depends on the task only through the constraints, so its maps differ little between tasks.".into(),
            "A task that an object does not afford still has a map: the network gives the position that such a grasp would have.".into(),
        ],
    };
    Ok(Some(ExperimentA { account, networks }))
}

/// Unified positions of labelled grasps on the held-out object.
fn marks(inputs: &Inputs, object: &str, task: &str) -> Result<Vec<Vector3<f64>>, Error> {
    let Some(dataset) = inputs
        .learned
        .datasets
        .iter()
        .find(|d| d.hand == inputs.experiments.imitator)
    else {
        return Ok(Vec::new());
    };
    let (names, tasks) = (dataset.copies.texts("object")?, dataset.copies.texts("task")?);
    let upos: Vec<Vec<f64>> = ["upos_x", "upos_y", "upos_z"]
        .iter()
        .map(|c| dataset.copies.numbers(c))
        .collect::<Result<_, _>>()?;
    let rows: Vec<usize> = (0..names.len())
        .filter(|&r| names[r] == object && tasks[r] == task)
        .collect();
    let step = rows.len().div_ceil(MARKS).max(1);
    Ok(rows
        .iter()
        .step_by(step)
        .map(|&r| Vector3::new(upos[0][r], upos[1][r], upos[2][r]))
        .collect())
}

pub(super) fn classification(inputs: &Inputs) -> Option<ExperimentB> {
    if inputs.answers.classifications.is_empty() {
        return None;
    }
    let mut results: Vec<Confusions> = Vec::new();
    for c in &inputs.answers.classifications {
        let matrix = Confusion {
            evidence: c.evidence.clone(),
            counts: c.counts.clone(),
            paper: TASKS.iter().map(|task| paper_recall(&c.evidence, task)).collect(),
        };
        match results
            .iter_mut()
            .find(|r| r.hand == c.hand && r.network == c.network)
        {
            Some(result) => result.matrices.push(matrix),
            None => results.push(Confusions {
                hand: c.hand.clone(),
                network: c.network.clone(),
                ceiling: inputs.answers.ceilings.get(&c.hand).copied(),
                matrices: vec![matrix],
            }),
        }
    }
    let line = |c: &crate::stages::ask::Classification| {
        format!(
            "{} with {}: {:.0} %",
            c.hand,
            c.network,
            c.mean_recall().unwrap_or(f64::NAN) * 100.0
        )
    };
    let best: Vec<String> = inputs
        .answers
        .classifications
        .iter()
        .filter(|c| c.evidence == "O, A, C")
        .map(line)
        .collect();
    let in_set: Vec<String> = inputs
        .answers
        .classifications
        .iter()
        .filter(|c| c.evidence == "O, A, C")
        .map(|c| format!("{} with {}: {:.0} %", c.hand, c.network, c.in_label_set * 100.0))
        .collect();
    let folds: Vec<String> = inputs.experiments.b.folds.iter().map(|f| f.join(", ")).collect();
    Some(ExperimentB {
        account: Account {
            answer: format!("Mean recall of the task given O, A, C: {}.", best.join("; ")),
            measured: vec![
                format!("Held out, one object a type: {}.", folds.join(" | ")),
                "A grasp with several labels is tested once per label, as in training; the answer is the most probable task under the trained prior, which is uniform.".into(),
                format!("Counting a grasp as right when the most probable task is any of its labels: {}.", in_set.join("; ")),
            ],
            not_shown: vec![
                "Grasps that serve no task are left out, as in the paper.".into(),
                "The paper's figures come from a person's labels on other objects.".into(),
            ],
        },
        results,
    })
}

pub(super) fn imitation(inputs: &Inputs, stand: &Stand) -> Result<Option<ExperimentC>, Error> {
    let Some(first) = inputs.imitations.first() else {
        return Ok(None);
    };
    let id = &first.demonstration;
    let demonstrator = &inputs.experiments.demonstrator;
    let labels = inputs
        .learned
        .datasets
        .iter()
        .find(|d| d.hand == *demonstrator)
        .map_or(Vec::new(), |d| tasks_of(&d.answers, id));
    let caption = format!("{id}, labelled {}", labels.join(", "));
    let demonstration = stand.grasp_picture(id, 640, "demonstration", &caption)?;
    let runs = inputs
        .imitations
        .iter()
        .map(|r| one_run(stand, r))
        .collect::<Result<Vec<_>, _>>()?;
    let chosen: Vec<String> = inputs
        .imitations
        .iter()
        .map(|r| {
            format!(
                "{} reads {} and takes {}",
                r.network,
                r.recognised,
                r.chosen_object()
            )
        })
        .collect();
    Ok(Some(ExperimentC {
        account: Account {
            answer: format!("{}.", chosen.join("; ")),
            measured: vec![
                format!(
                    "Both hands' networks were trained without {} and the candidates {}.",
                    inputs.experiments.c.demonstration,
                    inputs.experiments.c.candidates.join(", ")
                ),
                format!(
                    "The demonstration is the {} grasp on {} with the largest ε; λ = {}.",
                    inputs.experiments.c.task, inputs.experiments.c.demonstration, inputs.experiments.c.lambda
                ),
            ],
            not_shown: vec![
                "One demonstration is an example, not a success rate.".into(),
                "Similarity of actions compares two different hands in unified terms; it does not say that fingers match.".into(),
            ],
        },
        demonstration,
        demonstration_caption: caption,
        runs,
    }))
}

fn one_run(stand: &Stand, run: &Imitation) -> Result<ImitationRun, Error> {
    let object = |o: &RankedObject| {
        Ok(Candidate {
            name: o.object.clone(),
            picture: stand.object_picture(&o.object, 160)?,
            p_task: o.p_task,
            similarity: Some(o.similarity),
            total: Some(o.total),
        })
    };
    let grasp = |g: &RankedGrasp| {
        Ok(Candidate {
            name: g.grasp_id.clone(),
            picture: stand.grasp_picture(&g.grasp_id, 160, "", &g.grasp_id)?,
            p_task: g.p_task,
            similarity: Some(g.similarity),
            total: Some(g.total),
        })
    };
    Ok(ImitationRun {
        network: run.network.clone(),
        task_posterior: run.task_posterior.to_vec(),
        recognised: run.recognised.clone(),
        objects: run.objects.iter().map(object).collect::<Result<_, Error>>()?,
        grasps: run
            .grasps
            .iter()
            .take(6)
            .map(grasp)
            .collect::<Result<_, Error>>()?,
        joint: run.joint.as_ref().map(grasp).transpose()?,
        joint_similar: run.joint_similar.as_ref().map(grasp).transpose()?,
        lambda: run.lambda,
    })
}
