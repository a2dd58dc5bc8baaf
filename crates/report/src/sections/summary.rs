//! The first screen: three sentences, four numbers, one picture.

use maud::{Markup, html};

use crate::page::Sheet;
use crate::picture::Picture;

/// What a reader who stops here should know.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Summary {
    /// Three sentences: what was done, what came out, what stands in the way.
    pub sentences: Vec<String>,
    /// Four numbers.
    pub numbers: Vec<KeyNumber>,
    /// One picture, drawn 400 pixels wide; 800 pixels keep it sharp on dense screens.
    pub picture: Picture,
    /// Its caption.
    pub caption: String,
}

/// A number with its name.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct KeyNumber {
    /// The number as text, with its unit: `89 %`.
    pub value: String,
    /// What it is.
    pub label: String,
    /// Its interval, its sample size, or what it should be compared with.
    pub detail: String,
}

pub(crate) fn render(summary: &Summary, out: &mut Sheet) -> Markup {
    html! {
        section #summary aria-label="Summary" {
            div.lead {
                div.sentences {
                    @for sentence in &summary.sentences { p { (sentence) } }
                    (numbers(&summary.numbers))
                }
                @if !summary.picture.is_empty() {
                    figure { (out.picture(&summary.picture, 400)) figcaption { (summary.caption) } }
                }
            }
        }
    }
}

fn numbers(numbers: &[KeyNumber]) -> Markup {
    html! {
        @if !numbers.is_empty() {
            dl.numbers {
                @for number in numbers {
                    div { dt { (number.label) } dd { strong { (number.value) } span.muted { (number.detail) } } }
                }
            }
        }
    }
}
