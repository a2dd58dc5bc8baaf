//! Bars and curves, drawn by the chart crate behind an interface of our own, so that it can be exchanged.
//!
//! Pictures under bars and text in matrix cells are beyond it; `figure.rs` draws those.

use kuva::plot::{BarPlot, LegendPosition, LinePlot};
use kuva::render::layout::Layout;
use kuva::render::plots::Plot;
use kuva::render::theme::Theme;

use crate::figure::{Figure, Pen, escape};
use crate::palette::{ACCENT, INK, MUTED, PAPER, RULE, TASKS};

/// One horizontal bar.
pub(crate) struct Bar {
    pub label: String,
    pub value: f64,
    pub color: &'static str,
}

/// One series of a grouped bar chart: a value a group.
pub(crate) struct Series {
    pub label: String,
    pub color: &'static str,
    pub values: Vec<f64>,
}

/// One line.
pub(crate) struct Curve {
    pub label: String,
    pub points: Vec<(f64, f64)>,
}

/// Horizontal bars from 0, the first on top.
pub(crate) fn bars(name: &str, alt: &str, unit: &str, bars: &[Bar]) -> Figure {
    if bars.is_empty() {
        return Pen::new(480.0, 40.0).finish(name, alt);
    }
    let plot = bars.iter().rev().fold(
        BarPlot::new().with_horizontal(true).with_width(0.62),
        |plot, bar| plot.with_colored_bar(bar.label.clone(), finite(bar.value), bar.color),
    );
    let plots = vec![Plot::Bar(plot)];
    let layout = Layout::auto_from_plots(&plots)
        .with_x_label(unit)
        .with_x_axis_min(0.0);
    draw(name, alt, plots, layout, (460.0, 60.0 + 24.0 * bars.len() as f64))
}

/// Vertical bars from 0 to 1, side by side within each group.
pub(crate) fn grouped_bars(
    name: &str,
    alt: &str,
    unit: &str,
    groups: &[String],
    series: &[Series],
) -> Figure {
    if groups.is_empty() || series.is_empty() {
        return Pen::new(480.0, 40.0).finish(name, alt);
    }
    let plot = groups
        .iter()
        .enumerate()
        .fold(BarPlot::new().with_width(0.75), |plot, (g, group)| {
            let value = |s: &Series| (finite(s.values.get(g).copied().unwrap_or(0.0)), s.color);
            plot.with_group(group.clone(), series.iter().map(value))
        });
    let plots = vec![Plot::Bar(
        plot.with_legend(series.iter().map(|s| s.label.as_str()).collect()),
    )];
    let layout = Layout::auto_from_plots(&plots)
        .with_y_label(unit)
        .with_y_axis_min(0.0)
        .with_y_axis_max(1.0)
        .with_legend_position(LegendPosition::OutsideBottomColumns)
        .with_legend_box(false);
    draw(name, alt, plots, layout, (480.0, 250.0))
}

/// Lines with a dash of their own each, and a legend.
pub(crate) fn curves(name: &str, alt: &str, x: &str, y: &str, curves: &[Curve]) -> Figure {
    let colors = [TASKS[0], TASKS[1], TASKS[2], TASKS[3], INK, ACCENT, MUTED];
    let plots: Vec<Plot> = curves
        .iter()
        .enumerate()
        .map(|(i, curve)| {
            let points: Vec<(f64, f64)> = curve
                .points
                .iter()
                .copied()
                .filter(|(x, y)| x.is_finite() && y.is_finite())
                .collect();
            let line = LinePlot::new()
                .with_data(points)
                .with_color(colors[i % colors.len()])
                .with_stroke_width(1.8)
                .with_legend(curve.label.clone());
            Plot::Line(match i % 4 {
                0 => line,
                1 => line.with_dashed(),
                2 => line.with_dashdot(),
                _ => line.with_dotted(),
            })
        })
        .collect();
    let layout = Layout::auto_from_plots(&plots)
        .with_x_label(x)
        .with_y_label(y)
        .with_legend_position(LegendPosition::OutsideRightTop)
        .with_legend_box(false);
    draw(name, alt, plots, layout, (480.0, 300.0))
}

fn finite(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
}

fn draw(name: &str, alt: &str, plots: Vec<Plot>, layout: Layout, (width, height): (f64, f64)) -> Figure {
    let theme = Theme {
        background: "none".into(),
        axis_color: MUTED.into(),
        grid_color: RULE.into(),
        tick_color: MUTED.into(),
        text_color: INK.into(),
        legend_bg: PAPER.into(),
        legend_border: "none".into(),
        font_family: Some("system-ui, Roboto, DejaVu Sans, sans-serif".into()),
        ..Theme::light()
    };
    let layout = layout
        .with_theme(theme)
        .with_width(width)
        .with_height(height)
        .with_tick_size(11)
        .with_label_size(12)
        .with_body_size(11)
        .with_axis_line_width(1.0);
    let svg = own_ids(&kuva::render_to_svg(plots, layout), name);
    let (width, height) = size(&svg).unwrap_or((width, height));
    let view_box = format!(r#"<svg viewBox="0 0 {width} {height}""#);
    let svg = svg.replacen("<svg", &view_box, 1);
    let after_tag = svg.find('>').map_or(0, |at| at + 1);
    let svg = format!(
        "{}<title>{}</title>{}",
        &svg[..after_tag],
        escape(alt),
        &svg[after_tag..]
    );
    Figure {
        name: name.into(),
        alt: alt.into(),
        svg,
        width,
        height,
    }
}

/// The SVG with ids of its own. The chart crate numbers its clip paths by a counter that all charts of a process share,
/// so its bytes would depend on what else was drawn before, and in which order.
fn own_ids(svg: &str, name: &str) -> String {
    const PREFIX: &str = "kuva-clip-";
    let mut pieces = svg.split(PREFIX);
    let mut seen: Vec<&str> = Vec::new();
    let mut own = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        let digits = piece.find(|c: char| !c.is_ascii_digit()).unwrap_or(piece.len());
        let (number, rest) = piece.split_at(digits);
        let position = seen.iter().position(|n| *n == number).unwrap_or_else(|| {
            seen.push(number);
            seen.len() - 1
        });
        own.extend([name, "-clip-", &position.to_string(), rest]);
    }
    own
}

/// Width and height from the first tag: the chart crate adds room for axes and legend.
fn size(svg: &str) -> Option<(f64, f64)> {
    let value = |key: &str| -> Option<f64> {
        let from = svg.find(key)? + key.len();
        svg[from..].split('"').next()?.parse().ok()
    };
    Some((value(r#" width=""#)?, value(r#" height=""#)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_chart_names_its_bars_and_scales_with_its_box() {
        let list = [
            Bar {
                label: "no force closure".into(),
                value: 12.0,
                color: ACCENT,
            },
            Bar {
                label: "a<b".into(),
                value: f64::NAN,
                color: ACCENT,
            },
        ];
        let figure = bars("x", "twelve", "tries", &list);
        assert!(figure.svg.contains("no force closure") && figure.svg.contains("a&lt;b"));
        assert!(figure.svg.starts_with("<svg viewBox=\"0 0 "));
        assert!(figure.svg.contains("<title>twelve</title>"));
        assert!(figure.width >= 460.0);
        assert!(
            figure.svg.contains(&format!("\"{ACCENT}\"")),
            "colours stay whole attributes"
        );
    }

    #[test]
    fn clip_paths_are_numbered_within_their_chart() {
        let svg = r#"<clipPath id="kuva-clip-41"/><g clip-path="url(#kuva-clip-41)"/><g clip-path="url(#kuva-clip-9)"/>"#;
        let own =
            r#"<clipPath id="x-clip-0"/><g clip-path="url(#x-clip-0)"/><g clip-path="url(#x-clip-1)"/>"#;
        assert_eq!(own_ids(svg, "x"), own);
    }

    #[test]
    fn empty_charts_are_drawn_empty() {
        assert!(bars("x", "", "", &[]).svg.ends_with("</svg>"));
        assert!(grouped_bars("x", "", "", &[], &[]).svg.ends_with("</svg>"));
        assert!(curves("x", "", "", "", &[]).svg.ends_with("</svg>"));
        let nowhere = Curve {
            label: String::new(),
            points: vec![(1.0, f64::NAN)],
        };
        assert!(curves("x", "", "", "", &[nowhere]).svg.ends_with("</svg>"));
        let zero = Bar {
            label: String::new(),
            value: 0.0,
            color: ACCENT,
        };
        assert!(bars("x", "", "", &[zero]).svg.ends_with("</svg>"));
        let flat = Curve {
            label: "flat".into(),
            points: vec![(1.0, 0.0), (1.0, 0.0)],
        };
        assert!(curves("x", "", "", "", &[flat]).svg.ends_with("</svg>"));
    }
}
