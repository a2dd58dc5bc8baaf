//! A figure: an SVG with text and axes, and a small pen to draw one.

use std::fmt::Write as _;

use maud::{Markup, PreEscaped, html};

use crate::palette::{INK, follow_theme};
use crate::picture::{Picture, base64};

/// A finished SVG figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// File name without extension; unique within a page.
    pub name: String,
    /// The finding in a sentence, read out in place of the figure.
    pub alt: String,
    /// The SVG document, in the light theme's colours, so that any program shows it.
    pub svg: String,
    /// Width in CSS pixels.
    pub width: f64,
    /// Height in CSS pixels.
    pub height: f64,
}

impl Figure {
    /// The figure inside the page: it follows the page's theme and shrinks with a narrow screen, down to six tenths,
    /// at which its text is still readable.
    pub(crate) fn inline(&self) -> Markup {
        html! {
            div.figure role="img" aria-label=(self.alt) style=(format!("max-width:{:.0}px;min-width:{:.0}px", self.width, 0.6 * self.width)) {
                (PreEscaped(follow_theme(&self.svg)))
            }
        }
    }
}

/// A pen for figures made of rectangles, lines, text and pictures. Coordinates are pixels, y down.
pub(crate) struct Pen {
    body: String,
    width: f64,
    height: f64,
}

/// Where a text stands relative to its point.
#[derive(Clone, Copy)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

impl Pen {
    pub(crate) fn new(width: f64, height: f64) -> Self {
        Self {
            body: String::new(),
            width,
            height,
        }
    }

    pub(crate) fn rect(&mut self, [x, y, w, h]: [f64; 4], fill: &str, opacity: f64) {
        let _ = write!(
            self.body,
            r#"<rect x="{x:.1}" y="{y:.1}" width="{w:.1}" height="{h:.1}" fill="{fill}" fill-opacity="{opacity:.3}"/>"#
        );
    }

    pub(crate) fn frame(&mut self, [x, y, w, h]: [f64; 4], stroke: &str, width: f64) {
        let _ = write!(
            self.body,
            r#"<rect x="{x:.1}" y="{y:.1}" width="{w:.1}" height="{h:.1}" fill="none" stroke="{stroke}" stroke-width="{width}"/>"#
        );
    }

    pub(crate) fn line(&mut self, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2], stroke: &str, width: f64) {
        let _ = write!(
            self.body,
            r#"<line x1="{x1:.1}" y1="{y1:.1}" x2="{x2:.1}" y2="{y2:.1}" stroke="{stroke}" stroke-width="{width}"/>"#
        );
    }

    /// A rectangle with round corners of this radius.
    pub(crate) fn rounded(&mut self, [x, y, w, h]: [f64; 4], radius: f64, fill: &str, stroke: &str) {
        let _ = write!(
            self.body,
            r#"<rect x="{x:.1}" y="{y:.1}" width="{w:.1}" height="{h:.1}" rx="{radius}" fill="{fill}" stroke="{stroke}" stroke-width="1.4"/>"#
        );
    }

    /// A line along SVG path commands.
    pub(crate) fn path(&mut self, commands: &str, stroke: &str, width: f64, opacity: f64) {
        let _ = write!(
            self.body,
            r#"<path d="{commands}" fill="none" stroke="{stroke}" stroke-width="{width:.2}" stroke-opacity="{opacity:.2}"/>"#
        );
    }

    /// A filled polygon.
    pub(crate) fn polygon(&mut self, points: &[[f64; 2]], fill: &str, opacity: f64) {
        let corners: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        let _ = write!(
            self.body,
            r#"<polygon points="{}" fill="{fill}" fill-opacity="{opacity:.2}"/>"#,
            corners.join(" ")
        );
    }

    pub(crate) fn text(&mut self, [x, y]: [f64; 2], anchor: Anchor, size: f64, fill: &str, text: &str) {
        self.styled_text([x, y], anchor, size, fill, "", text);
    }

    pub(crate) fn bold(&mut self, [x, y]: [f64; 2], anchor: Anchor, size: f64, fill: &str, text: &str) {
        self.styled_text([x, y], anchor, size, fill, r#" font-weight="600""#, text);
    }

    fn styled_text(
        &mut self,
        [x, y]: [f64; 2],
        anchor: Anchor,
        size: f64,
        fill: &str,
        style: &str,
        text: &str,
    ) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let _ = write!(
            self.body,
            r#"<text x="{x:.1}" y="{y:.1}" text-anchor="{anchor}" font-size="{size}" fill="{fill}"{style}>{}</text>"#,
            escape(text)
        );
    }

    /// Puts a picture into the rectangle, whole, keeping its proportions.
    pub(crate) fn picture(&mut self, [x, y, w, h]: [f64; 4], picture: &Picture) {
        if !picture.is_empty() {
            let _ = write!(
                self.body,
                r#"<image x="{x:.1}" y="{y:.1}" width="{w:.1}" height="{h:.1}" href="data:image/png;base64,{}"/>"#,
                base64(&picture.png)
            );
        }
    }

    /// The finished figure.
    pub(crate) fn finish(self, name: &str, alt: &str) -> Figure {
        let Self { body, width, height } = self;
        let svg = format!(
            r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" font-family="system-ui, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif" fill="{INK}"><title>{}</title>{body}</svg>"#,
            escape(alt)
        );
        Figure {
            name: name.into(),
            alt: alt.into(),
            svg,
            width,
            height,
        }
    }
}

/// Text with XML's five special characters written as entities, and characters that XML forbids left out.
pub(crate) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            c if c.is_control() && !matches!(c, '\n' | '\t') => {}
            c => escaped.push(c),
        }
    }
    escaped
}

/// A file name made of a title: lower-case letters, digits and hyphens.
pub(crate) fn slug(title: &str) -> String {
    let mut slug = String::new();
    for c in title.chars() {
        if c.is_ascii_alphanumeric() {
            slug.push(c.to_ascii_lowercase());
        } else if !slug.is_empty() && !slug.ends_with('-') {
            slug.push('-');
        }
    }
    slug.trim_end_matches('-').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_from_data_cannot_leave_their_text() {
        let mut pen = Pen::new(10.0, 10.0);
        pen.text([0.0, 0.0], Anchor::Start, 10.0, INK, "</text><script>\u{0}'\"&");
        let figure = pen.finish("x", "a < b");
        assert!(figure.svg.contains("&lt;/text&gt;&lt;script&gt;&#39;&quot;&amp;"));
        assert!(figure.svg.contains("<title>a &lt; b</title>"));
    }

    #[test]
    fn slugs_are_file_names() {
        assert_eq!(slug("Schunk SDH / task → action!"), "schunk-sdh-task-action");
        assert_eq!(slug("../../etc"), "etc");
    }
}
