//! The labels: how often, how far personas agree, and which feature comes nearest to each rule.

use std::borrow::Cow;
use std::collections::BTreeMap;

use prehend_report::{Agreement, HandLabels, LabelSection, Prevalence, Rule as RuleRow};
use prehend_tutor::{Persona, Rule};
use rayon::prelude::*;

use super::Inputs;
use crate::Error;
use crate::frame::Frame;
use crate::labels::Answer;
use crate::stages::learn::Dataset;
use crate::training::TASKS;

/// Features that a rule may be a likeness of.
const FEATURES: [&str; 14] = [
    "egpc_1", "egpc_2", "upos_x", "upos_y", "upos_z", "dir_w", "dir_x", "dir_y", "dir_z", "fvol", "qeps",
    "size_z", "size_x", "cvex",
];

type Answers = BTreeMap<String, Vec<Answer>>;

pub(super) fn section(inputs: &Inputs) -> Result<LabelSection, Error> {
    let mut section = LabelSection {
        personas: Persona::ALL
            .iter()
            .map(|p| (p.name().to_owned(), words(*p, &inputs.experiments.persona)))
            .collect(),
        ..LabelSection::default()
    };
    let mut decided: BTreeMap<String, usize> = BTreeMap::new();
    for dataset in &inputs.learned.datasets {
        let (ids, kinds) = (
            dataset.grasps.texts("grasp_id")?,
            dataset.grasps.texts("object_type")?,
        );
        let mut by_kind: BTreeMap<&str, Prevalence> = BTreeMap::new();
        let mut whole = HandLabels {
            hand: dataset.hand.clone(),
            n_grasps: 0,
            yes: vec![0; TASKS.len()],
            n_none: 0,
            n_several: 0,
            ceiling: Some(
                dataset.label_ceiling(
                    &inputs
                        .shapes
                        .iter()
                        .map(|s| s.object.name.clone())
                        .collect::<Vec<_>>(),
                ),
            ),
        };
        for (id, kind) in ids.iter().zip(&kinds) {
            let said = yes(&dataset.answers, id);
            let entry = by_kind.entry(kind).or_insert_with(|| Prevalence {
                hand: dataset.hand.clone(),
                object_type: kind.clone(),
                n_grasps: 0,
                yes: vec![0; TASKS.len()],
            });
            entry.n_grasps += 1;
            whole.n_grasps += 1;
            for (t, yes) in said.iter().enumerate() {
                entry.yes[t] += usize::from(*yes);
                whole.yes[t] += usize::from(*yes);
            }
            match said.iter().filter(|y| **y).count() {
                0 => whole.n_none += 1,
                1 => {}
                _ => whole.n_several += 1,
            }
        }
        section.prevalence.extend(by_kind.into_values());
        section.hands.push(whole);
        section.agreement.extend(agreement(inputs, dataset)?);
        for answer in dataset.answers.values().flatten() {
            *decided.entry(answer.rule.clone()).or_insert(0) += 1;
        }
    }
    section.rules = rules(inputs, &decided)?;
    Ok(section)
}

fn words(persona: Persona, learned: &str) -> String {
    let what = match persona {
        Persona::Strict => "asks for one softness more of every rule, with half the doubt",
        Persona::Lenient => "forgives one softness of every rule, with half as much doubt again",
        Persona::ReceiverFirst => {
            "takes the rules as they are, and wants handles free for the receiver of a hand-over"
        }
    };
    let role = if persona.name() == learned {
        "; its labels are the ones that are learned"
    } else {
        ""
    };
    format!("{what}{role}")
}

fn yes(answers: &Answers, id: &str) -> [bool; 3] {
    let answers = answers.get(id).map_or(&[][..], Vec::as_slice);
    TASKS.map(|task| answers.iter().any(|a| a.task == task && a.yes))
}

/// Agreement of every pair of personas; only on grasps of objects that afford the task, since all agree on the others.
fn agreement(inputs: &Inputs, dataset: &Dataset) -> Result<Vec<Agreement>, Error> {
    let hand = &dataset.hand;
    let answers = |persona: Persona| {
        let known = persona.name() == inputs.experiments.persona;
        let found = if known {
            Cow::Borrowed(&dataset.answers)
        } else {
            Cow::Owned(inputs.labels.answers(hand, persona.name())?)
        };
        Ok((persona, found))
    };
    let all: Vec<(Persona, Cow<Answers>)> = Persona::ALL
        .into_par_iter()
        .map(answers)
        .collect::<Result<_, Error>>()?;
    let mut rows = Vec::new();
    for (i, (first, a)) in all.iter().enumerate() {
        for (second, b) in &all[i + 1..] {
            for (t, task) in TASKS.iter().enumerate() {
                let mut counts = [0; 4];
                for (id, answers) in a.iter() {
                    if answers
                        .iter()
                        .any(|x| x.task == *task && x.rule != "not afforded")
                    {
                        let (x, y) = (yes(a, id)[t], yes(b, id)[t]);
                        counts[usize::from(!x) * 2 + usize::from(!y)] += 1;
                    }
                }
                rows.push(Agreement {
                    hand: hand.to_owned(),
                    task: (*task).to_owned(),
                    personas: [first.name().into(), second.name().into()],
                    counts,
                });
            }
        }
    }
    Ok(rows)
}

fn rules(inputs: &Inputs, decided: &BTreeMap<String, usize>) -> Result<Vec<RuleRow>, Error> {
    let mut margins: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    let mut features: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for file in inputs.grasp_files.iter().filter(|f| f.tries.kept > 0) {
        let Some(table) = inputs.labels.margins_of(file)? else {
            continue;
        };
        let grasps = Frame::read(&file.path)?;
        for rule in Rule::ALL {
            margins
                .entry(rule.name())
                .or_default()
                .extend(table.numbers(rule.name())?);
        }
        for feature in FEATURES {
            features
                .entry(feature)
                .or_default()
                .extend(grasps.numbers(feature)?);
        }
    }
    Ok(Rule::ALL
        .into_iter()
        .map(|rule| {
            let margin = margins.get(rule.name()).map_or(&[][..], Vec::as_slice);
            let nearest = FEATURES
                .iter()
                .map(|f| {
                    (
                        *f,
                        rank_correlation(margin, features.get(f).map_or(&[][..], Vec::as_slice)),
                    )
                })
                .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
                .unwrap_or(("none", 0.0));
            RuleRow {
                task: rule.task().name().into(),
                rule: format!("{} ({})", rule.name(), rule.margin_in_words()),
                decided: decided.get(rule.name()).copied().unwrap_or(0),
                feature: nearest.0.into(),
                correlation: nearest.1,
            }
        })
        .collect())
}

/// Spearman's rank correlation over the rows where both are numbers; 0 where one of them is constant.
fn rank_correlation(a: &[f64], b: &[f64]) -> f64 {
    let pairs: Vec<(f64, f64)> = a
        .iter()
        .copied()
        .zip(b.iter().copied())
        .filter(|(x, y)| x.is_finite() && y.is_finite())
        .collect();
    let x = ranks(&pairs.iter().map(|p| p.0).collect::<Vec<_>>());
    let y = ranks(&pairs.iter().map(|p| p.1).collect::<Vec<_>>());
    let n = x.len() as f64;
    let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let product: f64 = x.iter().zip(&y).map(|(a, b)| (a - mx) * (b - my)).sum();
    let spread = |v: &[f64], m: f64| v.iter().map(|a| (a - m).powi(2)).sum::<f64>();
    let scale = (spread(&x, mx) * spread(&y, my)).sqrt();
    if scale > 0.0 { product / scale } else { 0.0 }
}

/// Ranks from 1; ties share their mean.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.0; values.len()];
    let mut start = 0;
    while start < order.len() {
        let mut end = start;
        while end + 1 < order.len() && values[order[end + 1]] == values[order[start]] {
            end += 1;
        }
        let mean = (start + end) as f64 / 2.0 + 1.0;
        order[start..=end].iter().for_each(|&i| ranks[i] = mean);
        start = end + 1;
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rank_correlation_agrees_with_scipy() {
        // scipy.stats.spearmanr([1, 2, 2, 4, 0], [3, 1, 4, 4, 0]) of scipy 1.17.1: 0.7631578947368421.
        let r = rank_correlation(&[1.0, 2.0, 2.0, 4.0, 0.0], &[3.0, 1.0, 4.0, 4.0, 0.0]);
        assert!((r - 0.763_157_894_736_842_1).abs() < 1e-12, "{r}");
        assert_eq!(rank_correlation(&[1.0, 1.0], &[1.0, 2.0]), 0.0);
        assert_eq!(rank_correlation(&[1.0, f64::NAN, 3.0], &[1.0, 2.0, 9.0]), 1.0);
    }
}
