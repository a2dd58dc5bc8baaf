//! Experiment B: which task is a grasp for, given the object, the action, the constraints?

use maud::{Markup, html};

use crate::figure::{Anchor, Figure, Pen, slug};
use crate::page::Sheet;
use crate::palette::{INK, MUTED, RULE, SHADE, SHADE_MOST};
use crate::sections::account::{Account, absent};
use crate::wilson::wilson_interval;

/// Confusion matrices of the task given three sets of evidence.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ExperimentB {
    /// In words.
    pub account: Account,
    /// One entry a hand and network.
    pub results: Vec<Confusions>,
}

/// The matrices of one hand and network.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Confusions {
    /// The hand.
    pub hand: String,
    /// The network.
    pub network: String,
    /// The label ceiling: the best mean per-class recall possible on these labels, in [0, 1].
    pub ceiling: Option<f64>,
    /// One matrix a set of evidence.
    pub matrices: Vec<Confusion>,
}

/// One confusion matrix.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Confusion {
    /// What was observed: `O`, `O, A` or `O, A, C`.
    pub evidence: String,
    /// Test rows by true task (rows) and most probable task (columns), in the order of the tasks.
    pub counts: Vec<Vec<usize>>,
    /// The paper's recall per true task, in [0, 1], where it gives one; see [`paper_recall`].
    pub paper: Vec<Option<f64>>,
}

impl Confusion {
    /// Share of a true task's rows that were recognised; `None` where it has no rows.
    pub fn recall(&self, task_idx: usize) -> Option<f64> {
        let row = self.counts.get(task_idx)?;
        let total: usize = row.iter().sum();
        (total > 0).then(|| row.get(task_idx).copied().unwrap_or(0) as f64 / total as f64)
    }

    /// Mean of the recalls of the tasks that have rows; `None` where there are none.
    pub fn mean_recall(&self) -> Option<f64> {
        let recalls: Vec<f64> = (0..self.counts.len()).filter_map(|t| self.recall(t)).collect();
        (!recalls.is_empty()).then(|| recalls.iter().sum::<f64>() / recalls.len() as f64)
    }
}

/// The paper's recall (section VI-B) of a task given a set of evidence, in [0, 1]; 56 % for hand-over given `O` is read
/// off a figure.
pub fn paper_recall(evidence: &str, task: &str) -> Option<f64> {
    let of_evidence = match evidence.replace([' ', '+', ','], "").as_str() {
        "O" => [0.78, 0.75, 0.56],
        "OA" => [0.87, 0.88, 0.56],
        "OAC" => [0.89, 0.89, 0.70],
        _ => return None,
    };
    let task_idx = ["pouring", "tool-use", "hand-over"]
        .iter()
        .position(|t| *t == task)?;
    Some(of_evidence[task_idx])
}

const QUESTION: &str = "Can the task be told from the object alone (O), from the object and the action (O, A), and with the grasp's \
    constraints as well (O, A, C)?";
const PROTOCOL: &str = "One object of each type is held out of training; its labelled grasps are the test rows, one row a label, so that a \
    grasp that affords two tasks counts once under each and cannot be right twice: the label ceiling says how far anyone \
    could get. The answer is the task with the largest posterior, with a uniform prior. Intervals are Wilson's at 95 % and take \
    rows as independent, which rows of one object are not: read them as the least uncertainty.";

pub(crate) fn render(experiment: Option<&ExperimentB>, out: &mut Sheet) -> Markup {
    let Some(experiment) = experiment else {
        return absent(QUESTION);
    };
    let content = html! {
        (overview(&experiment.results, out))
        @for result in &experiment.results { (matrices(result, out)) }
    };
    experiment.account.render(QUESTION, PROTOCOL, &content)
}

fn percent(x: Option<f64>) -> String {
    x.map_or_else(|| "–".into(), |x| format!("{:.0}", 100.0 * x))
}

fn overview(results: &[Confusions], out: &Sheet) -> Markup {
    html! {
        div.wide { table {
            caption { "Recall per task in percent, and beside each in grey what the paper reports for the same evidence. Mean is the mean over tasks; chance is 33." }
            thead { tr { th { "Hand" } th { "Network" } th { "Evidence" }
                @for task in out.tasks { th.n { (task) } } th.n { "Mean" } th.n { "Label ceiling" } } }
            tbody { @for result in results { @for (m, matrix) in result.matrices.iter().enumerate() { tr.group[m == 0] {
                td { @if m == 0 { (result.hand) } } td { @if m == 0 { (result.network) } } td { (matrix.evidence) }
                @for t in 0..out.tasks.len() { td.n {
                    (percent(matrix.recall(t))) " "
                    span.muted { (matrix.paper.get(t).copied().flatten().map_or_else(|| "–".into(), |p| format!("{:.0}", 100.0 * p))) }
                } }
                td.n { strong { (percent(matrix.mean_recall())) } " " span.muted { (percent(paper_mean(matrix))) } }
                td.n { @if m == 0 { (percent(result.ceiling)) } }
            } } } }
        } }
    }
}

fn paper_mean(matrix: &Confusion) -> Option<f64> {
    let given: Vec<f64> = matrix.paper.iter().copied().collect::<Option<_>>()?;
    (!given.is_empty()).then(|| given.iter().sum::<f64>() / given.len() as f64)
}

fn matrices(result: &Confusions, out: &mut Sheet) -> Markup {
    let n_rows: usize = result
        .matrices
        .first()
        .map_or(0, |m| m.counts.iter().flatten().sum());
    let panels: Vec<Markup> = result
        .matrices
        .iter()
        .map(|matrix| {
            let figure = draw(result, matrix, out.tasks);
            out.panel(&figure)
        })
        .collect();
    html! {
        figure {
            div.panels { @for panel in &panels { (panel) } }
            figcaption {
                strong { (result.hand) ", network " (result.network) }
                ": confusion of the task on held-out objects, " (n_rows) " rows. Rows are the tutor's label, columns the network's answer; each cell has the share "
                "of its row and the count, and is shaded by the share. At the right recall with its interval, and the paper's figure beneath it"
                @if let Some(c) = result.ceiling { "; the label ceiling for the mean is " (format!("{:.0} %", 100.0 * c)) }
                "."
            }
        }
    }
}

/// One matrix. Text in its cells is why this is not the chart crate's heat map, which prints one bare number a cell.
fn draw(result: &Confusions, matrix: &Confusion, tasks: &[String]) -> Figure {
    let n = matrix.counts.len();
    let (left, top, cell, right) = (74.0, 58.0, 58.0, 84.0);
    let edge = n as f64 * cell;
    let mut pen = Pen::new(left + edge + right, top + edge + 12.0);
    pen.bold(
        [left, 18.0],
        Anchor::Start,
        13.0,
        INK,
        &format!("given {}", matrix.evidence),
    );
    pen.text(
        [left + edge + 8.0, top - 10.0],
        Anchor::Start,
        11.0,
        MUTED,
        "recall",
    );
    let name = |t: usize| tasks.get(t).map_or("?", String::as_str);
    for t in 0..n {
        let middle = (t as f64 + 0.5) * cell;
        pen.text([left + middle, top - 10.0], Anchor::Middle, 11.0, MUTED, name(t));
        pen.text(
            [left - 8.0, top + middle + 4.0],
            Anchor::End,
            11.0,
            MUTED,
            name(t),
        );
        let total: usize = matrix.counts[t].iter().sum();
        for (p, &count) in matrix.counts[t].iter().enumerate().take(n) {
            let share = if total > 0 {
                count as f64 / total as f64
            } else {
                0.0
            };
            let (x, y) = (left + p as f64 * cell, top + t as f64 * cell);
            pen.rect(
                [x + 1.0, y + 1.0, cell - 2.0, cell - 2.0],
                SHADE,
                0.03 + (SHADE_MOST - 0.03) * share,
            );
            pen.bold(
                [x + cell / 2.0, y + 28.0],
                Anchor::Middle,
                15.0,
                INK,
                &format!("{:.0}", share * 100.0),
            );
            pen.text(
                [x + cell / 2.0, y + 44.0],
                Anchor::Middle,
                10.0,
                INK,
                &count.to_string(),
            );
        }
        let (x, y) = (left + edge + 8.0, top + middle);
        if let Some(recall) = matrix.recall(t) {
            let (low, high) = wilson_interval(matrix.counts[t][t], total);
            pen.bold(
                [x, y - 8.0],
                Anchor::Start,
                12.0,
                INK,
                &format!("{:.0} %", recall * 100.0),
            );
            pen.text(
                [x, y + 6.0],
                Anchor::Start,
                10.0,
                MUTED,
                &format!("{:.0}–{:.0}", low * 100.0, high * 100.0),
            );
        }
        if let Some(paper) = matrix.paper.get(t).copied().flatten() {
            pen.text(
                [x, y + 20.0],
                Anchor::Start,
                10.0,
                MUTED,
                &format!("paper {:.0}", paper * 100.0),
            );
        }
    }
    pen.line(
        [left, top + edge + 4.0],
        [left + edge, top + edge + 4.0],
        RULE,
        1.0,
    );
    let file = format!(
        "experiment-b-{}-{}-{}",
        slug(&result.hand),
        slug(&result.network),
        slug(&matrix.evidence)
    );
    let alt = format!(
        "Confusion matrix, {}, network {}, given {}: mean recall {} percent.",
        result.hand,
        result.network,
        matrix.evidence,
        percent(matrix.mean_recall())
    );
    pen.finish(&file, &alt)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recall_is_the_diagonal_over_its_row() {
        let matrix = Confusion {
            evidence: "O".into(),
            counts: vec![vec![3, 1, 0], vec![0, 0, 0], vec![2, 2, 4]],
            paper: vec![],
        };
        assert_eq!(matrix.recall(0), Some(0.75));
        assert_eq!(matrix.recall(1), None);
        assert_eq!(matrix.mean_recall(), Some(0.625));
        assert_eq!(Confusion::default().mean_recall(), None);
    }

    #[test]
    fn the_papers_figures_are_found_however_the_evidence_is_written() {
        assert_eq!(paper_recall("O+A", "tool-use"), Some(0.88));
        assert_eq!(paper_recall("O, A, C", "hand-over"), Some(0.70));
        assert_eq!(paper_recall("O", "sawing"), None);
        assert_eq!(paper_recall("C", "pouring"), None);
    }
}
