//! What ran, the tries, the training, the summary and the limits.

use prehend_report::{KeyNumber, NetworkTraining, RunSection, Stage, Summary, TriesRow, wilson_interval};

use super::{Inputs, Stand};
use crate::Error;
use crate::stages::learn::node_trainings;
use crate::training::TASKS;

pub(super) fn run_section(inputs: &Inputs) -> RunSection {
    let stage = |s: &crate::run_record::StageTime| Stage {
        name: s.name.clone(),
        seconds: Some(s.seconds),
        detail: s.detail.clone(),
    };
    RunSection {
        version: inputs.run.version.clone(),
        seed: inputs.run.seed,
        command: format!("prehend {}", inputs.run.arguments.join(" ")),
        stages: inputs.run.stages.iter().map(stage).collect(),
        notes: vec![
            format!(
                "Hands: {}.",
                inputs.hands.iter().map(|h| format!("{} ({} degrees of freedom)", h.hand.name(), h.hand.n_dof())).collect::<Vec<_>>().join(", ")
            ),
            "A stage whose inputs have not changed since an earlier run takes over its result; its seconds are then those of looking.".into(),
        ],
    }
}

pub(super) fn tries(inputs: &Inputs) -> Vec<TriesRow> {
    let kind = |name: &str| {
        inputs
            .shapes
            .iter()
            .find(|s| s.object.name == name)
            .map_or(String::new(), |s| s.object.kind.clone())
    };
    inputs
        .grasp_files
        .iter()
        .map(|f| TriesRow {
            hand: f.hand.clone(),
            object: f.object.clone(),
            object_type: kind(&f.object),
            tried: f.tries.tried,
            kept: f.tries.kept,
            rejected: f.tries.rejected.clone(),
        })
        .collect()
}

pub(super) fn training(inputs: &Inputs) -> Vec<NetworkTraining> {
    inputs
        .learned
        .models
        .iter()
        .map(|(hand, network, trained)| NetworkTraining {
            hand: hand.clone(),
            network: network.clone(),
            rows: trained.rows.to_vec(),
            log_likelihood: trained.log_likelihood() / trained.rows.iter().sum::<usize>().max(1) as f64,
            holdout_log_likelihood: None,
            nodes: node_trainings(trained),
        })
        .collect()
}

pub(super) fn summary(inputs: &Inputs, stand: &Stand) -> Result<Summary, Error> {
    let kept: usize = inputs.grasp_files.iter().map(|f| f.tries.kept).sum();
    let tried: usize = inputs.grasp_files.iter().map(|f| f.tries.tried).sum();
    let least: Vec<String> = inputs
        .learned
        .models
        .iter()
        .filter(|(_, network, _)| *network == inputs.learned.models[0].1)
        .map(|(hand, _, trained)| format!("{} for {hand}", trained.rows.iter().min().unwrap_or(&0)))
        .collect();
    let best = inputs
        .answers
        .classifications
        .iter()
        .filter(|c| c.evidence == "O, A, C")
        .max_by(|a, b| {
            a.mean_recall()
                .unwrap_or(0.0)
                .total_cmp(&b.mean_recall().unwrap_or(0.0))
        });
    let mut numbers = vec![
        KeyNumber {
            value: kept.to_string(),
            label: "force-closure grasps".into(),
            detail: format!(
                "of {tried} tries on {} objects with {} hands",
                inputs.shapes.len(),
                inputs.hands.len()
            ),
        },
        KeyNumber {
            value: least
                .first()
                .map_or("–".into(), |l| l.split(' ').next().unwrap_or("–").to_owned()),
            label: "labelled instances a task".into(),
            detail: format!("{}; the paper has 600 and 1,200", least.join(", ")),
        },
    ];
    let mut sentences = vec![format!(
        "{} objects were decomposed into boxes, {} hands tried {tried} grasps on them, and {kept} hold in force closure.",
        inputs.shapes.len(),
        inputs.hands.len()
    )];
    if let Some(best) = best {
        let correct: usize = (0..TASKS.len()).map(|t| best.counts[t][t]).sum();
        let total: usize = best.counts.iter().flatten().sum();
        let (low, high) = wilson_interval(correct, total);
        let recall = best.mean_recall().unwrap_or(0.0);
        let ceiling = inputs
            .answers
            .ceilings
            .get(&best.hand)
            .copied()
            .unwrap_or(f64::NAN);
        sentences.push(format!(
            "On objects never seen, the network {} recognises a grasp's task from object, action and constraint features with a mean \
             recall of {:.0} % ({}), where nobody could reach more than {:.0} % on these labels.",
            best.network,
            recall * 100.0,
            best.hand,
            ceiling * 100.0
        ));
        numbers.push(KeyNumber {
            value: format!("{:.0} %", recall * 100.0),
            label: "mean recall of the task given O, A, C".into(),
            detail: format!(
                "{} with {}; accuracy {:.0}–{:.0} % (95 %, n = {total}); the paper has 83 %",
                best.hand,
                best.network,
                low * 100.0,
                high * 100.0
            ),
        });
        numbers.push(KeyNumber {
            value: format!("{:.0} %", ceiling * 100.0),
            label: "label ceiling".into(),
            detail:
                "best mean recall that anyone could reach: a grasp may serve several tasks, the answer is one"
                    .into(),
        });
    }
    if let Some(run) = inputs.imitations.last() {
        sentences.push(format!(
            "Shown a {} grasp on {}, the imitator takes {} and the grasp {}.",
            run.recognised,
            inputs.experiments.c.demonstration,
            run.chosen_object(),
            run.grasps.first().map_or("none", |g| g.grasp_id.as_str())
        ));
    }
    let chosen = inputs.imitations.last().and_then(|r| r.grasps.first());
    let picture = match chosen {
        Some(grasp) => stand.grasp_picture(
            &grasp.grasp_id,
            800,
            "summary",
            &format!("The imitator's chosen grasp: {}", grasp.grasp_id),
        )?,
        None => prehend_report::Picture::default(),
    };
    let caption = chosen.map_or(String::new(), |g| {
        format!(
            "The grasp that the imitator chose: {}, P(task) {:.2}. Dots are contacts.",
            g.grasp_id, g.p_task
        )
    });
    Ok(Summary {
        sentences,
        numbers,
        picture,
        caption,
    })
}

pub(super) fn limits(inputs: &Inputs) -> Vec<String> {
    let mut limits = vec![
        "The tutor is a script with stated rules, not a person; its labels show that the chain works, not what people want.".into(),
        "Grasps are judged by geometry and static friction; nothing here simulates motion, weight or compliance.".into(),
        "The networks' arcs are given, not learned.".into(),
        "The paper used other objects, other hand shapes and a person's labels: figures are comparable in kind, not in digits.".into(),
    ];
    if inputs
        .shapes
        .iter()
        .any(|s| s.object.notes.iter().any(|n| n.starts_with("guessed")))
    {
        limits.push(
            "Some objects' scale, direction or parts were guessed; each guess stands with its object.".into(),
        );
    }
    limits.extend(inputs.warnings.iter().cloned());
    limits
}

pub(super) fn files() -> Vec<(String, String)> {
    [
        ("../run.json", "what ran, and how long"),
        (
            "../experiments/a_maps.csv",
            "densities behind the maps of experiment A",
        ),
        (
            "../experiments/b_confusion.csv",
            "counts behind the matrices of experiment B",
        ),
        (
            "../experiments/b_scores.csv",
            "recalls, label ceiling and log-loss of experiment B",
        ),
        (
            "../experiments/c_objects.csv",
            "the ranked objects of experiment C",
        ),
        ("../experiments/c_grasps.csv", "the ranked grasps of experiment C"),
        (
            "../labels.sqlite",
            "every label, who gave it, and the rule that decided",
        ),
    ]
    .map(|(path, what)| (path.to_owned(), what.to_owned()))
    .to_vec()
}
