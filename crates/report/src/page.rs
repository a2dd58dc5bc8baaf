//! The page: its data, its order, and the files that stand beside it.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::figure::Figure;
use crate::palette::{css_variables, task_shape};
use crate::picture::Picture;
use crate::sections::experiment_a::{self, ExperimentA};
use crate::sections::experiment_b::{self, ExperimentB};
use crate::sections::experiment_c::{self, ExperimentC};
use crate::sections::labels::{self, LabelSection};
use crate::sections::objects::{self, ObjectSection};
use crate::sections::run::{self, RunSection};
use crate::sections::summary::{self, Summary};
use crate::sections::training::{self, NetworkTraining};
use crate::sections::tries::{self, TriesRow};

/// Everything that the page says. A part that is empty or `None` says that it did not run, and why it might not have.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReportData {
    /// Title of the page.
    pub title: String,
    /// The tasks, in the order of their states; every `Vec` "per task" below has this order.
    pub tasks: Vec<String>,
    /// The first screen.
    pub summary: Summary,
    /// What ran and how long.
    pub run: RunSection,
    /// One entry an object, in the order in which they are shown; neighbours of one type share a heading.
    pub objects: Vec<ObjectSection>,
    /// One row a hand and object.
    pub tries: Vec<TriesRow>,
    /// Labels, prevalence, agreement.
    pub labels: LabelSection,
    /// One entry a hand and network.
    pub training: Vec<NetworkTraining>,
    /// Experiment A.
    pub experiment_a: Option<ExperimentA>,
    /// Experiment B.
    pub experiment_b: Option<ExperimentB>,
    /// Experiment C.
    pub experiment_c: Option<ExperimentC>,
    /// What this run does not show, one sentence each.
    pub limits: Vec<String>,
    /// Files beside the page: relative path, and what is in it.
    pub files: Vec<(String, String)>,
}

/// The page and the figures beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    /// `index.html`: one file that needs no other.
    pub html: String,
    /// File name (`.svg`, `.png`) and bytes of every figure, in the order of the page; names are unique.
    pub figures: Vec<(String, Vec<u8>)>,
}

/// Lays out the page. The same data give the same bytes.
pub fn render_page(data: &ReportData) -> Page {
    let mut out = Sheet {
        tasks: &data.tasks,
        figures: Vec::new(),
    };
    let sections: Vec<(&str, &str, Markup)> = vec![
        ("run", "What ran", run::render(&data.run, &mut out)),
        (
            "experiment-a",
            "Experiment A",
            experiment_a::render(data.experiment_a.as_ref(), &mut out),
        ),
        (
            "experiment-b",
            "Experiment B",
            experiment_b::render(data.experiment_b.as_ref(), &mut out),
        ),
        (
            "experiment-c",
            "Experiment C",
            experiment_c::render(data.experiment_c.as_ref(), &mut out),
        ),
        ("labels", "Labels", labels::render(&data.labels, &mut out)),
        ("training", "Training", training::render(&data.training, &mut out)),
        ("tries", "Tries", tries::render(&data.tries, &mut out)),
        ("objects", "Objects", objects::render(&data.objects, &mut out)),
        ("limits", "Limits", limits(data)),
    ];
    let summary = summary::render(&data.summary, &mut out);
    let title = if data.title.is_empty() {
        "Learning task constraints for robot grasping"
    } else {
        &data.title
    };
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy"
                    content="default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="generator" content=(concat!("prehend ", env!("CARGO_PKG_VERSION")));
                title { (title) }
                style { (PreEscaped(css_variables())) (PreEscaped(include_str!("page.css"))) }
            }
            body {
                header {
                    h1 { (title) }
                    nav aria-label="Sections" {
                        @for (id, heading, _) in &sections { a href={ "#" (id) } { (heading) } " " }
                    }
                }
                main {
                    (summary)
                    @for (id, heading, content) in &sections {
                        section id=(id) { h2 { (heading) } (content) }
                    }
                }
                footer { p { "Made by prehend " (env!("CARGO_PKG_VERSION")) "." } }
            }
        }
    };
    Page {
        html: page.into_string(),
        figures: out.figures,
    }
}

fn limits(data: &ReportData) -> Markup {
    html! {
        @if data.limits.is_empty() { p { "None were recorded." } }
        @else { ul { @for limit in &data.limits { li { (limit) } } } }
        @if !data.files.is_empty() {
            h3 { "Files beside this page" }
            ul { @for (path, what) in &data.files { li { a href=(path) { (path) } ": " (what) } } }
        }
    }
}

/// What sections share while the page is laid out.
pub(crate) struct Sheet<'a> {
    pub(crate) tasks: &'a [String],
    figures: Vec<(String, Vec<u8>)>,
}

impl Sheet<'_> {
    /// Puts a figure into the page and beside it.
    pub(crate) fn figure(&mut self, figure: &Figure, caption: &Markup) -> Markup {
        self.keep(&figure.name, "svg", figure.svg.as_bytes());
        html! { figure { div.wide { (figure.inline()) } figcaption { (caption) } } }
    }

    /// Puts a figure without caption into the page, for use inside a `figure`, and beside it.
    pub(crate) fn panel(&mut self, figure: &Figure) -> Markup {
        self.keep(&figure.name, "svg", figure.svg.as_bytes());
        figure.inline()
    }

    /// Puts a picture into the page, and beside it where it has a name.
    pub(crate) fn picture(&mut self, picture: &Picture, css_width: u32) -> Markup {
        if !picture.name.is_empty() && !picture.is_empty() {
            self.keep(&picture.name, "png", &picture.png);
        }
        picture.img(css_width)
    }

    /// A task's name behind its shape, in its colour.
    pub(crate) fn task(&self, task: &str) -> Markup {
        let task_idx = self.tasks.iter().position(|t| t == task).unwrap_or(usize::MAX);
        html! { span class={ "task t" (task_idx.min(3)) } { (task_shape(task_idx)) } " " (task) }
    }

    /// Puts a figure beside the page only.
    pub(crate) fn keep_figure(&mut self, figure: &Figure) {
        self.keep(&figure.name, "svg", figure.svg.as_bytes());
    }

    fn keep(&mut self, name: &str, extension: &str, bytes: &[u8]) {
        let name: String = name
            .chars()
            .map(|c| {
                if c.is_ascii_alphanumeric() || "-_".contains(c) {
                    c
                } else {
                    '-'
                }
            })
            .collect();
        let file = format!("{name}.{extension}");
        match self.figures.iter().find(|(known, _)| *known == file) {
            Some((_, known)) if known == bytes => {}
            Some(_) => {
                let free = (2..).map(|n| format!("{name}-{n}.{extension}"));
                let taken = |file: &String| self.figures.iter().any(|(known, _)| known == file);
                let file = free.into_iter().find(|file| !taken(file)).unwrap_or(file);
                self.figures.push((file, bytes.to_vec()));
            }
            None => self.figures.push((file, bytes.to_vec())),
        }
    }
}
