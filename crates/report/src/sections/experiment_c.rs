//! Experiment C: imitation. What was shown, which object and which grasp answer it.

use maud::{Markup, html};

use crate::figure::{Anchor, Figure, Pen, slug};
use crate::page::Sheet;
use crate::palette::{ACCENT, INK, MUTED, RULE, task_color};
use crate::picture::Picture;
use crate::sections::account::{Account, absent};

/// A demonstration and how the imitator answers it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ExperimentC {
    /// In words.
    pub account: Account,
    /// The demonstrated grasp.
    pub demonstration: Picture,
    /// Its caption: hand, object, label.
    pub demonstration_caption: String,
    /// One entry a network.
    pub runs: Vec<ImitationRun>,
}

/// One network's answers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ImitationRun {
    /// The network.
    pub network: String,
    /// Step 1: the demonstrator's P(T | o, a, c), per task.
    pub task_posterior: Vec<f64>,
    /// The recognised task t̂.
    pub recognised: String,
    /// Step 2.1: the objects, in a fixed order.
    pub objects: Vec<Candidate>,
    /// Step 2.2: grasps on the chosen object, best first.
    pub grasps: Vec<Candidate>,
    /// The joint argmax of Eq. 3: its name, and P(t̂ | o, a, c).
    pub joint: Option<Candidate>,
    /// The joint argmax of Eq. 5.
    pub joint_similar: Option<Candidate>,
    /// λ of Eq. 5.
    pub lambda: f64,
}

/// An object or a grasp to choose from.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Candidate {
    /// Its name: an object, or a grasp and its object.
    pub name: String,
    /// Its picture.
    pub picture: Picture,
    /// P(t̂ | …) of the imitator, in [0, 1].
    pub p_task: f64,
    /// Similarity with the demonstration, scaled to [0, 1] over the candidates, where it was computed.
    pub similarity: Option<f64>,
    /// λ P + (1 − λ) S of Eq. 5, where it was computed.
    pub total: Option<f64>,
}

const QUESTION: &str = "One hand shows a grasp. For which task does the other take it, which object does it choose for that \
    task, and how does it grasp the one it chose?";
const PROTOCOL: &str = "Both networks are trained without the objects of this experiment. Step 1 reads the demonstrator's \
    P(T | o, a, c) of the shown grasp and takes its largest as t̂. Step 2.1 ranks the objects by the imitator's P(t̂ | o), step \
    2.2 the grasps on the chosen one by P(t̂ | o, a, c). Beside them stand the joint argmax over all grasps on all objects \
    (Eq. 3) and the same with similarity (Eq. 5).";

pub(crate) fn render(experiment: Option<&ExperimentC>, out: &mut Sheet) -> Markup {
    let Some(experiment) = experiment else {
        return absent(QUESTION);
    };
    let content = html! {
        @if !experiment.demonstration.is_empty() {
            figure.demonstration { (out.picture(&experiment.demonstration, 260)) figcaption { (experiment.demonstration_caption) } }
        }
        @for run in &experiment.runs { (network(run, out)) }
    };
    experiment.account.render(QUESTION, PROTOCOL, &content)
}

fn network(run: &ImitationRun, out: &mut Sheet) -> Markup {
    let slug = slug(&run.network);
    let posterior = posterior(&format!("experiment-c-{slug}-task"), run, out.tasks);
    let task = &run.recognised;
    html! {
        h3 { "Network " (run.network) }
        (out.figure(&posterior, &html! { "Step 1. Posterior of the task given the demonstrated grasp’s object, action and constraints; recognised: " (out.task(task)) "." }))
        @if !run.objects.is_empty() {
            @let figure = candidates(&format!("experiment-c-{slug}-objects"), &run.objects, &format!("P({task} | o)"));
            (out.figure(&figure, &html! { "Step 2.1. The imitator’s probability that each object affords " (task) ", and each object’s similarity with the demonstrated one (its own axis). The frame marks the choice, by Eq. 5." }))
        }
        @if !run.grasps.is_empty() {
            @let figure = candidates(&format!("experiment-c-{slug}-grasps"), &run.grasps, &format!("P({task} | o, a, c)"));
            (out.figure(&figure, &html! { "Step 2.2. Grasps on the chosen object by the probability of " (task) ", with their similarity to the demonstrated grasp. The frame marks the choice, by Eq. 5." }))
        }
        @if run.joint.is_some() || run.joint_similar.is_some() {
            div.pair {
                @if let Some(joint) = &run.joint {
                    (choice(joint, "Eq. 3, joint argmax of P(t̂ | o, a, c) over all grasps on all objects", out))
                }
                @if let Some(joint) = &run.joint_similar {
                    (choice(joint, &format!("Eq. 5, joint argmax of λ P + (1 − λ) S with λ = {}", run.lambda), out))
                }
            }
        }
    }
}

fn choice(candidate: &Candidate, what: &str, out: &mut Sheet) -> Markup {
    html! {
        figure.choice {
            (out.picture(&candidate.picture, 200))
            figcaption {
                (what) ": " strong { (candidate.name) } ", P = " (format!("{:.3}", candidate.p_task))
                @if let Some(s) = candidate.similarity { ", S = " (format!("{s:.3}")) }
                @if let Some(t) = candidate.total { ", total " (format!("{t:.3}")) }
                "."
            }
        }
    }
}

/// Horizontal bars from 0 to 1 with the number at their end.
fn posterior(name: &str, run: &ImitationRun, tasks: &[String]) -> Figure {
    let (left, width, row) = (90.0, 300.0, 26.0);
    let n = run.task_posterior.len();
    let mut pen = Pen::new(left + width + 60.0, n as f64 * row + 8.0);
    for (t, p) in run.task_posterior.iter().enumerate() {
        let y = 4.0 + t as f64 * row;
        let task = tasks.get(t).map_or("?", String::as_str);
        pen.text([left - 8.0, y + 16.0], Anchor::End, 12.0, INK, task);
        pen.rect([left, y + 4.0, width, row - 8.0], RULE, 0.5);
        pen.rect(
            [left, y + 4.0, width * p.clamp(0.0, 1.0), row - 8.0],
            task_color(t),
            1.0,
        );
        pen.text(
            [left + width + 8.0, y + 16.0],
            Anchor::Start,
            12.0,
            INK,
            &format!("{p:.3}"),
        );
    }
    let alt = format!(
        "Bars: posterior of the task, network {}; the largest is {}.",
        run.network, run.recognised
    );
    pen.finish(name, &alt)
}

/// Pictures over two rows of bars from 0 to 1, one column a candidate: probability, and similarity on its own axis.
/// Pictures inside are why this is not the chart crate's bar plot.
fn candidates(name: &str, candidates: &[Candidate], p_label: &str) -> Figure {
    let (left, column, picture, bar) = (166.0, 112.0, 96.0, 70.0);
    let with_similarity = candidates.iter().any(|c| c.similarity.is_some());
    let bars_top = picture + 40.0;
    let height = bars_top + bar + 12.0 + if with_similarity { bar + 26.0 } else { 0.0 };
    let mut pen = Pen::new(left + candidates.len() as f64 * column + 6.0, height);
    // The choice is by Eq. 5 where it was computed; ties go to the first.
    let score = |i: usize| candidates[i].total.unwrap_or(candidates[i].p_task);
    let best = (0..candidates.len()).max_by(|&a, &b| score(a).total_cmp(&score(b)).then(b.cmp(&a)));
    let axis = |pen: &mut Pen, top: f64, label: &str| {
        for (at, tick) in [(0.0, "1"), (1.0, "0")] {
            let y = top + at * bar;
            pen.text([left - 6.0, y + 4.0], Anchor::End, 10.0, MUTED, tick);
            pen.line([left, y], [left + candidates.len() as f64 * column, y], RULE, 1.0);
        }
        pen.text([0.0, top + bar / 2.0 + 4.0], Anchor::Start, 11.0, MUTED, label);
    };
    axis(&mut pen, bars_top, p_label);
    let similarity_top = bars_top + bar + 26.0;
    if with_similarity {
        axis(&mut pen, similarity_top, "similarity");
    }
    for (i, candidate) in candidates.iter().enumerate() {
        let x = left + i as f64 * column;
        pen.picture([x + 6.0, 4.0, picture, picture], &candidate.picture);
        pen.text(
            [x + column / 2.0, picture + 16.0],
            Anchor::Middle,
            11.0,
            INK,
            &shortened(&candidate.name),
        );
        if best == Some(i) {
            pen.frame([x + 3.0, 1.5, column - 6.0, height - 3.0], INK, 2.0);
        }
        value_bar(&mut pen, x, column, bars_top, bar, candidate.p_task, ACCENT);
        if let Some(similarity) = candidate.similarity {
            value_bar(&mut pen, x, column, similarity_top, bar, similarity, MUTED);
        }
    }
    let alt = best.map_or_else(String::new, |b| {
        format!(
            "Bars under pictures: {p_label}; the choice is {} with {:.3}.",
            candidates[b].name, candidates[b].p_task
        )
    });
    pen.finish(name, &alt)
}

fn value_bar(pen: &mut Pen, x: f64, column: f64, top: f64, full: f64, value: f64, color: &str) {
    let height = full
        * if value.is_finite() {
            value.clamp(0.0, 1.0)
        } else {
            0.0
        };
    pen.rect(
        [x + column / 2.0 - 20.0, top + full - height, 40.0, height],
        color,
        1.0,
    );
    pen.text(
        [x + column / 2.0, top + full - height - 4.0],
        Anchor::Middle,
        11.0,
        INK,
        &format!("{value:.2}"),
    );
}

/// A name that fits under a picture: of a grasp its object and try, of anything its first 15 characters.
fn shortened(name: &str) -> String {
    let name = match name.split('/').collect::<Vec<_>>()[..] {
        [_, object, attempt] => format!("{object} {}", attempt.trim_start_matches('0')),
        _ => name.to_owned(),
    };
    let length = name.chars().count();
    if length <= 16 {
        return name;
    }
    // The end tells grasps apart.
    let start: String = name.chars().take(9).collect();
    let end: String = name.chars().skip(length - 6).collect();
    format!("{start}…{end}")
}
