//! The frame in which every experiment is told: question, answer, figures, how it was measured, what it does not show.

use maud::{Markup, html};

/// What an experiment says in words; its figures and tables come beside it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Account {
    /// The answer in one line, with its numbers.
    pub answer: String,
    /// How this run measured it: sample sizes, objects held out, seeds; one sentence each.
    pub measured: Vec<String>,
    /// What it does not show, one sentence each.
    pub not_shown: Vec<String>,
}

impl Account {
    pub(crate) fn render(&self, question: &str, protocol: &str, content: &Markup) -> Markup {
        html! {
            p.question { (question) }
            @if !self.answer.is_empty() { p.answer { (self.answer) } }
            (content)
            div.account {
                div { h4 { "How it was measured" } p { (protocol) } @for line in &self.measured { p { (line) } } }
                @if !self.not_shown.is_empty() {
                    div { h4 { "What it does not show" } @for line in &self.not_shown { p { (line) } } }
                }
            }
        }
    }
}

/// What stands in place of an experiment that did not run.
pub(crate) fn absent(question: &str) -> Markup {
    html! { p.question { (question) } p.muted { "This run did not include it: the objects or hands that it needs were not there, or the run was stopped before it." } }
}
