//! Labels: what the tutor said, how often, how surely, and what no learner can beat.

use maud::{Markup, html};

use crate::charts::{Series, grouped_bars};
use crate::figure::slug;
use crate::page::Sheet;
use crate::palette::task_color;

/// Everything about the labels.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LabelSection {
    /// Who labelled: persona, and what it stands for.
    pub personas: Vec<(String, String)>,
    /// One row a hand and object type.
    pub prevalence: Vec<Prevalence>,
    /// One row a hand.
    pub hands: Vec<HandLabels>,
    /// One row a hand, task and pair of personas.
    pub agreement: Vec<Agreement>,
    /// One row a rule.
    pub rules: Vec<Rule>,
}

/// How often each task was affirmed among the force-closure grasps of one hand on one type of object.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Prevalence {
    /// The hand.
    pub hand: String,
    /// The objects' type.
    pub object_type: String,
    /// Grasps labelled.
    pub n_grasps: usize,
    /// Grasps with a yes, per task.
    pub yes: Vec<usize>,
}

/// One hand's labels over all objects.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HandLabels {
    /// The hand.
    pub hand: String,
    /// Grasps labelled.
    pub n_grasps: usize,
    /// Grasps with a yes, per task.
    pub yes: Vec<usize>,
    /// Grasps with no task.
    pub n_none: usize,
    /// Grasps with two tasks or more.
    pub n_several: usize,
    /// The label ceiling: the best mean per-class recall on copies of multi-label grasps, in [0, 1].
    pub ceiling: Option<f64>,
}

/// How far two personas agree on one task.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Agreement {
    /// The hand.
    pub hand: String,
    /// The task.
    pub task: String,
    /// The two personas.
    pub personas: [String; 2],
    /// Counts: both yes, only the first, only the second, both no.
    pub counts: [usize; 4],
}

impl Agreement {
    /// Share of equal answers.
    pub fn observed(&self) -> f64 {
        let [a, b, c, d] = self.counts.map(|n| n as f64);
        (a + d) / (a + b + c + d)
    }

    /// Cohen's κ = (p_o − p_e) / (1 − p_e); NaN where both personas give one and the same answer throughout.
    pub fn kappa(&self) -> f64 {
        let [a, b, c, d] = self.counts.map(|n| n as f64);
        let n = a + b + c + d;
        let expected = ((a + b) * (a + c) + (c + d) * (b + d)) / (n * n);
        (self.observed() - expected) / (1.0 - expected)
    }

    /// Agreement on yes, 2a / (2a + b + c).
    pub fn on_yes(&self) -> f64 {
        let [a, b, c, _] = self.counts.map(|n| n as f64);
        2.0 * a / (2.0 * a + b + c)
    }

    /// Agreement on no, 2d / (2d + b + c).
    pub fn on_no(&self) -> f64 {
        let [_, b, c, d] = self.counts.map(|n| n as f64);
        2.0 * d / (2.0 * d + b + c)
    }
}

/// One of the tutor's rules beside the network's feature that is nearest to it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rule {
    /// The task that it speaks on.
    pub task: String,
    /// What it asks, in words.
    pub rule: String,
    /// How many grasps it decided.
    pub decided: usize,
    /// The feature with the largest correlation with the rule's margin.
    pub feature: String,
    /// That rank correlation, in [−1, 1].
    pub correlation: f64,
}

pub(crate) fn render(labels: &LabelSection, out: &mut Sheet) -> Markup {
    let tasks = out.tasks.to_vec();
    html! {
        p { "Labels come from a scripted tutor that sees the mesh, the parts of the object and the links of the hand, and none of the features that the networks learn from. A grasp may afford several tasks, or none." }
        @if !labels.personas.is_empty() {
            dl.personas { @for (name, what) in &labels.personas { dt { (name) } dd { (what) } } }
        }
        @if labels.hands.is_empty() { p.muted { "No labels were drawn in this run." } }
        @else { (hands(&labels.hands, &tasks)) }
        div.pair { @for hand in &labels.hands { (prevalence(&hand.hand, &labels.prevalence, &tasks, out)) } }
        @if !labels.agreement.is_empty() { (agreement(&labels.agreement, out)) }
        @if !labels.rules.is_empty() { (rules(&labels.rules, out)) }
    }
}

fn hands(rows: &[HandLabels], tasks: &[String]) -> Markup {
    let percent = |n: usize, of: usize| format!("{:.0} %", 100.0 * n as f64 / of.max(1) as f64);
    html! {
        div.wide { table {
            caption { "Labels per hand. The label ceiling is the best mean per-class recall that anyone could reach on copies of grasps that carry several labels, from the tutor's own probabilities." }
            thead { tr { th { "Hand" } th.n { "Grasps" } @for task in tasks { th.n { (task) } }
                th.n { "No task" } th.n { "Several" } th.n { "Label ceiling" } } }
            tbody { @for row in rows { tr {
                td { (row.hand) } td.n { (row.n_grasps) }
                @for yes in &row.yes { td.n { (yes) " " span.muted { (percent(*yes, row.n_grasps)) } } }
                td.n { (percent(row.n_none, row.n_grasps)) } td.n { (percent(row.n_several, row.n_grasps)) }
                td.n { @match row.ceiling { Some(c) => (format!("{:.0} %", c * 100.0)), None => "–" } }
            } } }
        } }
    }
}

fn prevalence(hand: &str, rows: &[Prevalence], tasks: &[String], out: &mut Sheet) -> Markup {
    let rows: Vec<&Prevalence> = rows.iter().filter(|r| r.hand == hand).collect();
    if rows.is_empty() {
        return html! {};
    }
    let series: Vec<Series> = tasks
        .iter()
        .enumerate()
        .map(|(t, task)| Series {
            label: task.clone(),
            color: task_color(t),
            values: rows
                .iter()
                .map(|r| r.yes.get(t).copied().unwrap_or(0) as f64 / r.n_grasps.max(1) as f64)
                .collect(),
        })
        .collect();
    let groups: Vec<String> = rows.iter().map(|r| r.object_type.clone()).collect();
    let alt = format!(
        "{hand}: share of grasps that afford each task, by object type; the table below has the numbers."
    );
    let figure = grouped_bars(
        &format!("prevalence-{}", slug(hand)),
        &alt,
        "share of grasps with a yes",
        &groups,
        &series,
    );
    let shown = out.figure(
        &figure,
        &html! { strong { (hand) } ": share of the force-closure grasps that the tutor affirms, per type of object and task." },
    );
    html! {
        div {
            (shown)
            details {
                summary { (hand) ": counts" }
                div.wide { table {
                    thead { tr { th { "Type" } th.n { "Grasps" } @for task in tasks { th.n { (task) } } } }
                    tbody { @for r in rows { tr {
                        td { (r.object_type) } td.n { (r.n_grasps) } @for yes in &r.yes { td.n { (yes) } }
                    } } }
                } }
            }
        }
    }
}

fn agreement(rows: &[Agreement], out: &Sheet) -> Markup {
    let two = |x: f64| {
        if x.is_finite() {
            format!("{x:.2}")
        } else {
            "–".into()
        }
    };
    html! {
        h3 { "Agreement between personas" }
        div.wide { table {
            caption { "Two personas answer for the same grasps. κ falls for rare tasks even where people agree, so agreement on yes and on no stand beside it; – where one answer never occurs." }
            thead { tr { th { "Hand" } th { "Task" } th { "Personas" } th.n { "n" } th.n { "Equal answers" } th.n { "κ" }
                th.n { "On yes" } th.n { "On no" } } }
            tbody { @for row in rows { tr {
                td { (row.hand) } td { (out.task(&row.task)) } td { (row.personas.join(" / ")) }
                td.n { (row.counts.iter().sum::<usize>()) } td.n { (two(row.observed())) } td.n { (two(row.kappa())) }
                td.n { (two(row.on_yes())) } td.n { (two(row.on_no())) }
            } } }
        } }
    }
}

fn rules(rows: &[Rule], out: &Sheet) -> Markup {
    html! {
        h3 { "The tutor's rules beside the nearest feature" }
        div.wide { table {
            caption { "Each rule with how many grasps it decided and the network's feature that goes with its margin most closely (rank correlation). A correlation near ±1 would mean that the network only learns the rule back." }
            thead { tr { th { "Task" } th { "Rule" } th.n { "Decided" } th { "Nearest feature" } th.n { "Correlation" } } }
            tbody { @for row in rows { tr {
                td { (out.task(&row.task)) } td { (row.rule) } td.n { (row.decided) }
                td { code { (row.feature) } } td.n { (signed(row.correlation)) }
            } } }
        } }
    }
}

/// A signed number with a true minus.
fn signed(x: f64) -> String {
    format!("{x:+.2}").replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kappa_of_a_worked_table() {
        // p_o = 35/50; p_e = (25·30 + 25·20)/50² = 0.5; κ = (0.7 − 0.5)/0.5.
        let agreement = Agreement {
            counts: [20, 5, 10, 15],
            ..Agreement::default()
        };
        assert!((agreement.observed() - 0.7).abs() < 1e-12);
        assert!((agreement.kappa() - 0.4).abs() < 1e-12);
        assert!((agreement.on_yes() - 40.0 / 55.0).abs() < 1e-12);
        assert!((agreement.on_no() - 30.0 / 45.0).abs() < 1e-12);
    }

    #[test]
    fn kappa_is_undefined_where_everyone_always_says_no() {
        assert!(
            Agreement {
                counts: [0, 0, 0, 9],
                ..Agreement::default()
            }
            .kappa()
            .is_nan()
        );
    }
}
