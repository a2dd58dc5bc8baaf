//! Experiment A: where would the hand be, given the task? Spherical maps of P(upos | task, size, cvex).

use maud::{Markup, html};

use crate::figure::{Anchor, Figure, Pen, slug};
use crate::page::Sheet;
use crate::palette::{INK, MUTED, css_gradient, viridis};
use crate::sections::account::{Account, absent};
use crate::sphere_sheet::{DISC_TITLES, SphereSheet};
use crate::view::View;

/// Maps of the hand's position for objects that the network has not seen.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ExperimentA {
    /// In words.
    pub account: Account,
    /// One entry a network.
    pub networks: Vec<NetworkMaps>,
}

/// The maps of one network.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NetworkMaps {
    /// The network.
    pub network: String,
    /// One entry a held-out object.
    pub objects: Vec<ObjectMaps>,
}

/// The maps over one object, one a task.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ObjectMaps {
    /// The object.
    pub object: String,
    /// Its type.
    pub object_type: String,
    /// The drawn maps, from [`crate::sphere_sheet`].
    pub sheet: SphereSheet,
}

const QUESTION: &str =
    "Where does a task want the hand, on an object that was never seen? P(upos | task, size, cvex)";
const PROTOCOL: &str = "The network is trained without the objects shown. The density of the hand's unified position given the \
    task and the object's size and cvex is read at the 2,562 directions of an icosphere and made to integrate to 1 over the \
    sphere. Colour is that density over the uniform one, on a logarithmic scale from ¼ to 16 that all maps share. The six \
    views look at the sphere from outside, along the object's axes, with the object inside; they shrink what lies near the \
    rim. The discs do not: areas on them are areas on the sphere. Lines enclose the densest half (solid) and nine tenths \
    (thin) of the probability; dots are labelled grasps of that task on that object, where there are any.";

pub(crate) fn render(experiment: Option<&ExperimentA>, out: &mut Sheet) -> Markup {
    let Some(experiment) = experiment else {
        return absent(QUESTION);
    };
    let content = html! {
        @for network in &experiment.networks {
            h3 { "Network " (network.network) }
            @for maps in &network.objects { (object(&network.network, maps, out)) }
        }
    };
    experiment.account.render(QUESTION, PROTOCOL, &content)
}

fn object(network: &str, maps: &ObjectMaps, out: &mut Sheet) -> Markup {
    let sheet = &maps.sheet;
    let figure = as_file(network, maps);
    out.keep_figure(&figure);
    html! {
        figure.maps {
            div.mapgrid {
                span.corner {}
                @for view in View::SIX { span.head { (view.title()) } }
                @for title in DISC_TITLES { span.head { (title) } }
                @for row in &sheet.rows {
                    span.rowname { (out.task(&row.task)) }
                    @for (view, heat) in row.views.iter().enumerate() {
                        span.stack { (heat.img(112)) @if let Some(p) = sheet.object.get(view) { (p.img(112)) } }
                    }
                    @for disc in &row.discs { span.stack { (disc.img(112)) } }
                }
            }
            (scale())
            figcaption {
                strong { (maps.object) " (" (maps.object_type) "), network " (network) }
                ": density of the hand's position on the sphere around the object, one row a task, relative to the uniform density. "
                "Seen from six sides, then as equal-area discs of the upper and the lower half. Lines enclose the densest half and nine tenths of the probability; dots are labelled grasps."
            }
        }
        details {
            summary { (maps.object) ", " (network) ": the maps in numbers" }
            div.wide { table {
                thead { tr { th { "Task" } th.n { "Peak ÷ uniform" } th { "Densest direction" } th.n { "Half of P on" } th.n { "90 % of P on" }
                    th.n { "P above the middle" } th.n { "P in front (+x)" } } }
                tbody { @for row in &sheet.rows { tr {
                    td { (out.task(&row.task)) } td.n { (format!("{:.1}", row.peak)) }
                    td { (format!("({:+.2}, {:+.2}, {:+.2})", row.peak_direction[0], row.peak_direction[1], row.peak_direction[2])) }
                    td.n { (percent(row.area_of_half)) } td.n { (percent(row.area_of_nine_tenths)) }
                    td.n { (percent(row.above)) } td.n { (percent(row.in_front)) }
                } } }
            } }
            p.muted { "“Half of P on” is the smallest share of the sphere that holds half of the probability; 50 % is a uniform map." }
        }
    }
}

fn percent(x: f64) -> String {
    format!("{:.0} %", 100.0 * x)
}

/// The colour scale as a row of steps with its ticks.
fn scale() -> Markup {
    html! {
        div.scale role="img" aria-label="Colour scale: density over uniform, from one quarter (violet) over 1 to 16 (yellow), logarithmic." {
            span { "¼" }
            i style={ "background:" (css_gradient()) } {}
            span { "16 × uniform" }
        }
    }
}

/// The same grid as one SVG, for the file beside the page.
fn as_file(network: &str, maps: &ObjectMaps) -> Figure {
    let (left, top, cell) = (110.0, 30.0, 112.0);
    let n_columns = View::SIX.len() + DISC_TITLES.len();
    let height = top + maps.sheet.rows.len() as f64 * cell + 40.0;
    let mut pen = Pen::new(left + n_columns as f64 * cell, height);
    let titles = View::SIX.iter().map(|v| v.title()).chain(DISC_TITLES);
    for (i, title) in titles.enumerate() {
        pen.text(
            [left + (i as f64 + 0.5) * cell, 18.0],
            Anchor::Middle,
            12.0,
            MUTED,
            title,
        );
    }
    for (r, row) in maps.sheet.rows.iter().enumerate() {
        let y = top + r as f64 * cell;
        pen.text([left - 8.0, y + cell / 2.0], Anchor::End, 13.0, INK, &row.task);
        for (i, picture) in row.views.iter().chain(&row.discs).enumerate() {
            let place = [left + i as f64 * cell + 2.0, y + 2.0, cell - 4.0, cell - 4.0];
            pen.picture(place, picture);
            if let Some(object) = maps.sheet.object.get(i) {
                pen.picture(place, object);
            }
        }
    }
    let y = height - 22.0;
    for i in 0..48 {
        let [r, g, b] = viridis(f64::from(i) / 47.0);
        pen.rect(
            [left + f64::from(i) * 5.0, y, 5.2, 10.0],
            &format!("#{r:02x}{g:02x}{b:02x}"),
            1.0,
        );
    }
    pen.text([left - 6.0, y + 9.0], Anchor::End, 11.0, MUTED, "¼");
    pen.text(
        [left + 246.0, y + 9.0],
        Anchor::Start,
        11.0,
        MUTED,
        "16 × uniform density",
    );
    let name = format!("experiment-a-{}-{}", slug(network), slug(&maps.object));
    pen.finish(
        &name,
        &format!(
            "Maps of P(upos | task, size, cvex) over {}, network {network}, one row a task.",
            maps.object
        ),
    )
}
