//! Cutting a body into more pieces than are wanted.

use super::candidates::{Candidates, Halves};
use super::groups::Group;
use crate::OrientedBox;
use crate::decompose::body::{Body, Part};
use crate::decompose::fit::Cloud;
use crate::decompose::region::{Plane, Region};

/// A cut that takes off less than this share is no better than one that lets the next cuts take off more.
const POOR: f64 = 0.1;

/// Pieces whose cut would take off less than this share of the whole are left alone.
const NOT_WORTH: f64 = 5e-4;

struct Piece {
    part: Part,
    fitted: OrientedBox,
    /// Whether its best cut was looked for, and that cut.
    was_seen: bool,
    cut: Option<Foreseen>,
}

/// A cut and what it takes off, itself or by the next cuts.
struct Foreseen {
    halves: Halves,
    saved: f64,
}

/// At most `n_pieces` pieces: always the one is cut whose cut, or whose halves' cuts, take off the most.
pub(super) fn cut_finely(body: &Body, candidates: &Candidates, n_pieces: usize) -> Vec<Group> {
    let piece = |part: Part, fitted: OrientedBox| Piece {
        part,
        fitted,
        was_seen: false,
        cut: None,
    };
    let mut pieces = vec![piece(body.whole(), body.quick_root)];
    let least = NOT_WORTH * body.quick_root.volume();
    while pieces.len() < n_pieces {
        let Some(i) = most_worth(body, candidates, &mut pieces, least) else {
            break;
        };
        let Some(Foreseen { halves, .. }) = pieces[i].cut.take() else {
            break;
        };
        let parts = body.cut(&pieces[i].part, &halves.plane);
        if parts.iter().any(|p| p.thought.is_empty() || p.real.is_empty()) {
            continue;
        }
        let [below, above] = parts;
        pieces[i] = piece(below, halves.boxes[0]);
        pieces.push(piece(above, halves.boxes[1]));
    }
    pieces
        .into_iter()
        .map(|piece| Group::new(vec![piece.part], piece.fitted))
        .collect()
}

/// The piece whose cut takes off the most, more than `least`. No cut takes off more than the whole box, so the pieces are
/// looked at from the largest on, until one has a cut that takes off more than any of the rest has.
fn most_worth(body: &Body, candidates: &Candidates, pieces: &mut [Piece], least: f64) -> Option<usize> {
    loop {
        let mut best: (f64, Option<usize>) = (least, None);
        let mut unknown: (f64, Option<usize>) = (least, None);
        for (i, piece) in pieces.iter().enumerate() {
            match &piece.cut {
                Some(cut) if cut.saved > best.0 => best = (cut.saved, Some(i)),
                None if !piece.was_seen && piece.fitted.volume() > unknown.0 => {
                    unknown = (piece.fitted.volume(), Some(i));
                }
                _ => {}
            }
        }
        match unknown {
            (volume, Some(i)) if volume > best.0 => {
                let piece = &mut pieces[i];
                piece.was_seen = true;
                piece.cut = foreseen(body, candidates, &piece.part.thought, &piece.fitted);
            }
            _ => return best.1,
        }
    }
}

fn foreseen(body: &Body, candidates: &Candidates, region: &Region, fitted: &OrientedBox) -> Option<Foreseen> {
    let halves = candidates.best(body, region, fitted, false);
    let saved = halves.as_ref().map_or(0.0, |h| fitted.volume() - h.volume());
    if saved < POOR * fitted.volume()
        && let Some((halves, left)) = ahead(body, candidates, region, fitted)
        && fitted.volume() - left > saved
    {
        let saved = (fitted.volume() - left) / 2.0;
        return Some(Foreseen { halves, saved });
    }
    halves.map(|halves| Foreseen { halves, saved })
}

/// The cut in the middle of the box whose halves, cut in turn, leave the least; and what they leave.
fn ahead(
    body: &Body,
    candidates: &Candidates,
    region: &Region,
    fitted: &OrientedBox,
) -> Option<(Halves, f64)> {
    let mut best: Option<(Halves, f64)> = None;
    for axis in (0..3).filter(|&k| fitted.extents()[k] > 2.0 * body.min_slab) {
        let Some((halves, sides)) = in_the_middle(body, region, fitted, axis) else {
            continue;
        };
        let left: f64 = sides
            .iter()
            .zip(&halves.boxes)
            .map(|(side, half)| candidates.least_volume(body, side, half).min(half.volume()))
            .sum();
        if best.as_ref().is_none_or(|(_, known)| left < known * (1.0 - 1e-6)) {
            best = Some((halves, left));
        }
    }
    best
}

fn in_the_middle(
    body: &Body,
    region: &Region,
    fitted: &OrientedBox,
    axis: usize,
) -> Option<(Halves, [Region; 2])> {
    let plane = Plane {
        normal: fitted.axis(axis),
        origin: fitted.center(),
    };
    let sides = region.cut(&plane, body.thought());
    if sides.iter().any(Region::is_empty) {
        return None;
    }
    let axes = [0, 1, 2].map(|k| fitted.axis(k));
    let boxes = sides
        .each_ref()
        .map(|side| Cloud::new(side.points()).fit(&axes, body.min_extent));
    Some((Halves { plane, boxes }, sides))
}
