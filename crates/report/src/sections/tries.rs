//! Accepted and rejected tries, by reason.

use std::collections::BTreeMap;

use maud::{Markup, html};

use crate::charts::{Bar, bars};
use crate::figure::slug;
use crate::page::Sheet;
use crate::palette::{ACCENT, REJECTED};

/// The tries of one hand on one object.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TriesRow {
    /// The hand.
    pub hand: String,
    /// The object.
    pub object: String,
    /// Its type.
    pub object_type: String,
    /// Tries in all: kept and rejected.
    pub tried: usize,
    /// Kept: force closure.
    pub kept: usize,
    /// Rejected tries by reason.
    pub rejected: BTreeMap<String, usize>,
}

pub(crate) fn render(rows: &[TriesRow], out: &mut Sheet) -> Markup {
    let mut hands: BTreeMap<&str, Vec<&TriesRow>> = BTreeMap::new();
    for row in rows {
        hands.entry(&row.hand).or_default().push(row);
    }
    html! {
        p { "A try is one hypothesis (a face of a box, a roll, a position) with one pre-shape, closed on the object. It is kept where the contacts are in force closure." }
        @if rows.is_empty() { p.muted { "No grasps were planned in this run." } }
        div.pair { @for (hand, rows) in &hands { (chart(hand, rows, out)) } }
        @for (hand, rows) in &hands { (table(hand, rows)) }
    }
}

fn chart(hand: &str, rows: &[&TriesRow], out: &mut Sheet) -> Markup {
    let tried: usize = rows.iter().map(|r| r.tried).sum();
    let kept: usize = rows.iter().map(|r| r.kept).sum();
    let mut reasons: Vec<(&str, usize)> = totals(rows).into_iter().collect();
    reasons.sort_by_key(|&(reason, n)| (std::cmp::Reverse(n), reason));
    let mut list = vec![Bar {
        label: "kept".into(),
        value: kept as f64,
        color: ACCENT,
    }];
    list.extend(reasons.iter().map(|(reason, n)| Bar {
        label: (*reason).to_owned(),
        value: *n as f64,
        color: REJECTED,
    }));
    let share = 100.0 * kept as f64 / tried.max(1) as f64;
    let alt = format!("{hand}: {kept} of {tried} tries kept, {share:.1} percent; the rest by reason.");
    let figure = bars(&format!("tries-{}", slug(hand)), &alt, "tries", &list);
    out.figure(
        &figure,
        &html! { strong { (hand) } ": what became of " (grouped(tried)) " tries on " (rows.len()) " objects. "
        (grouped(kept)) " (" (format!("{share:.1}")) " %) were kept; the grey bars count the others by the first reason that ruled them out." },
    )
}

/// A count with commas between thousands.
fn grouped(n: usize) -> String {
    let digits = n.to_string();
    let groups: Vec<&str> = digits
        .as_bytes()
        .rchunks(3)
        .rev()
        .map(|g| std::str::from_utf8(g).unwrap_or_default())
        .collect();
    groups.join(",")
}

fn totals<'a>(rows: &[&'a TriesRow]) -> BTreeMap<&'a str, usize> {
    let mut totals = BTreeMap::new();
    for (reason, n) in rows.iter().flat_map(|r| &r.rejected) {
        *totals.entry(reason.as_str()).or_default() += n;
    }
    totals
}

fn table(hand: &str, rows: &[&TriesRow]) -> Markup {
    let reasons = totals(rows);
    html! {
        details {
            summary { (hand) ": tries by object" }
            div.wide { table {
                thead { tr { th { "Object" } th { "Type" } th.n { "Tried" } th.n { "Kept" } th.n { "%" }
                    @for reason in reasons.keys() { th.n { (reason) } } } }
                tbody { @for row in rows { tr {
                    td { (row.object) } td { (row.object_type) } td.n { (row.tried) } td.n { (row.kept) }
                    td.n { (format!("{:.1}", 100.0 * row.kept as f64 / row.tried.max(1) as f64)) }
                    @for reason in reasons.keys() { td.n { (row.rejected.get(*reason).copied().unwrap_or(0)) } }
                } } }
            } }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_grouped_by_thousands() {
        assert_eq!(
            [0, 999, 1000, 1_234_567].map(grouped),
            ["0", "999", "1,000", "1,234,567"]
        );
    }
}
