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
    halves: Option<Halves>,
    saved: f64,
}

/// At most `n_pieces` pieces: always the one is cut whose cut, or whose halves' cuts, take off the most.
pub(super) fn cut_finely(body: &Body, candidates: &Candidates, n_pieces: usize) -> Vec<Group> {
    let mut pieces = vec![piece(body, candidates, body.whole(), body.quick_root)];
    let least = NOT_WORTH * body.quick_root.volume();
    while pieces.len() < n_pieces {
        let mut best: Option<usize> = None;
        for (i, piece) in pieces.iter().enumerate() {
            if piece.halves.is_some()
                && piece.saved > least
                && best.is_none_or(|b| piece.saved > pieces[b].saved)
            {
                best = Some(i);
            }
        }
        let Some(i) = best else { break };
        let Some(halves) = pieces[i].halves.take() else {
            break;
        };
        let parts = body.cut(&pieces[i].part, &halves.plane);
        if parts.iter().any(|p| p.thought.is_empty() || p.real.is_empty()) {
            continue;
        }
        let [below, above] = parts;
        pieces[i] = piece(body, candidates, below, halves.boxes[0]);
        pieces.push(piece(body, candidates, above, halves.boxes[1]));
    }
    pieces
        .into_iter()
        .map(|piece| Group::new(vec![piece.part], piece.fitted))
        .collect()
}

fn piece(body: &Body, candidates: &Candidates, part: Part, fitted: OrientedBox) -> Piece {
    let halves = candidates.best(body, &part.thought, &fitted);
    let saved = halves.as_ref().map_or(0.0, |h| fitted.volume() - h.volume());
    let mut piece = Piece {
        part,
        fitted,
        halves,
        saved,
    };
    if saved < POOR * fitted.volume()
        && let Some((halves, left)) = ahead(body, &piece.part.thought, &fitted)
        && fitted.volume() - left > saved
    {
        piece.saved = (fitted.volume() - left) / 2.0;
        piece.halves = Some(halves);
    }
    piece
}

/// The cut in the middle of the box whose halves, cut in their middles, leave the least; and what they leave.
fn ahead(body: &Body, region: &Region, fitted: &OrientedBox) -> Option<(Halves, f64)> {
    let mut best: Option<(Halves, f64)> = None;
    for axis in (0..3).filter(|&k| fitted.extents()[k] > 2.0 * body.min_slab) {
        let Some((halves, sides)) = in_the_middle(body, region, fitted, axis) else {
            continue;
        };
        let mut left = 0.0;
        for (side, half) in sides.iter().zip(&halves.boxes) {
            let mut least = half.volume();
            for k in (0..3).filter(|&k| half.extents()[k] > 2.0 * body.min_slab) {
                let plane = middle(half, k);
                let parts = side.points_beside(&plane);
                if parts.iter().all(|part| part.len() >= 3) {
                    let axes = [0, 1, 2].map(|k| half.axis(k));
                    let volume = parts
                        .map(|part| Cloud::new(part).rough_volume(&axes, body.min_extent))
                        .iter()
                        .sum();
                    least = f64::min(least, volume);
                }
            }
            left += least;
        }
        if best.as_ref().is_none_or(|(_, known)| left < known * (1.0 - 1e-6)) {
            best = Some((halves, left));
        }
    }
    best
}

fn middle(fitted: &OrientedBox, axis: usize) -> Plane {
    Plane {
        normal: fitted.axis(axis),
        origin: fitted.center(),
    }
}

fn in_the_middle(
    body: &Body,
    region: &Region,
    fitted: &OrientedBox,
    axis: usize,
) -> Option<(Halves, [Region; 2])> {
    let plane = middle(fitted, axis);
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
