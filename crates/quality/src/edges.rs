//! A facet's plane and the planes at the ends of its edges, all measured at once.
//!
//! All planes through a ridge are a positive combination of the planes of the two facets there: an *edge*, as in the
//! polar polytope, whose corners are the planes of this one.

use crate::hyperplane::Hyperplane;

/// A plane as (normal, −offset): its height at a point is the dot product with (point, 1).
pub(crate) type Row = [f64; 7];

/// Eight planes side by side, one a column; in the last row, the cosine of each plane's angle to the facet's own.
pub(crate) type Planes = [[f64; 8]; 8];

/// Column of a facet's own plane; those before it are the ends of its edges.
pub(crate) const OWN: usize = 6;

pub(crate) fn row(plane: Hyperplane<6>) -> Row {
    std::array::from_fn(|k| if k < 6 { plane.normal[k] } else { -plane.offset })
}

pub(crate) fn column(planes: &Planes, k: usize) -> Row {
    std::array::from_fn(|r| planes[r][k])
}

/// Puts a plane at the end of an edge.
pub(crate) fn set_end(planes: &mut Planes, slot: usize, plane: &Row) {
    let mut cosine = 0.0;
    for r in 0..6 {
        cosine += planes[r][OWN] * plane[r];
    }
    set_column(planes, slot, plane);
    planes[7][slot] = cosine;
}

pub(crate) fn set_column(planes: &mut Planes, k: usize, plane: &Row) {
    for r in 0..7 {
        planes[r][k] = plane[r];
    }
}

/// Height of a point over a plane.
#[inline]
pub(crate) fn height(plane: &Row, point: &[f64; 6]) -> f64 {
    let even = plane[0] * point[0] + plane[2] * point[2] + plane[4] * point[4];
    let odd = plane[1] * point[1] + plane[3] * point[3] + plane[5] * point[5];
    even + odd + plane[6]
}

/// Heights of a point over eight planes.
#[inline]
pub(crate) fn end_heights(planes: &Planes, point: &[f64; 6]) -> [f64; 8] {
    let mut sums = planes[6];
    for r in 0..6 {
        for k in 0..8 {
            sums[k] += planes[r][k] * point[r];
        }
    }
    sums
}

/// The plane between `seen` and `unseen` that holds a point at heights `h_seen` > 0 ≥ `h_unseen` over them.
#[inline]
pub(crate) fn pencil(seen: &Row, h_seen: f64, unseen: &Row, h_unseen: f64) -> Row {
    // A height inside the tolerance may be a little above 0; the point then counts as on the unseen plane.
    let below = (-h_unseen).max(0.0);
    let sum: Row = std::array::from_fn(|k| h_seen * unseen[k] + below * seen[k]);
    let squared: f64 = (0..6).map(|k| sum[k] * sum[k]).sum();
    if squared == 0.0 {
        return *unseen;
    }
    let inverse = 1.0 / squared.sqrt();
    sum.map(|c| c * inverse)
}

/// One bit a column: whether the plane where the point's height is 0, between the column's and the facet's own, is
/// nearer to the origin than `radius`. From heights, offsets and the angle alone:
/// |h n' − h' n|² = h² + h'² − 2 h h' cos.
#[inline]
pub(crate) fn near(planes: &Planes, heights: &[f64; 8], radius: f64) -> u32 {
    let (own, offset) = (heights[OWN], planes[6][OWN]);
    let mut bits = 0;
    for k in 0..8 {
        let h = heights[k];
        // Of the two heights one is above 0 and the other below, or up to the tolerance above.
        let (a, b) = if own > h {
            (own, (-h).max(0.0))
        } else {
            ((-own).max(0.0), h)
        };
        let below = a * planes[6][k] + b * offset;
        let squared = a * a + b * b + 2.0 * a * b * planes[7][k];
        let signed = below * below.abs();
        bits |= u32::from(-signed < radius * radius * squared) << k;
    }
    bits
}

/// A far plane of the edge that leaves a new facet's plane p in a ridge of its base. The edge lies in the span of the
/// seen plane b and of the base's own end e there, where the point's height is 0, on the side of e: h_b e − h_e b. The
/// part of that at right angles to p shows the way. None where rounding hides it, or where it does not lead far.
#[inline]
pub(crate) fn end_beside(
    plane: &Row,
    seen: &Row,
    h_seen: f64,
    end: &Row,
    point: &[f64; 6],
    radius: f64,
) -> Option<Row> {
    let h_end = height(end, point);
    let mut across: Row = std::array::from_fn(|r| h_seen * end[r] - h_end * seen[r]);
    let along: f64 = (0..6).map(|r| across[r] * plane[r]).sum();
    for r in 0..7 {
        across[r] -= along * plane[r];
    }
    let length = (0..6).map(|r| across[r] * across[r]).sum::<f64>().sqrt();
    if length <= CLEAR * (h_seen + h_end.abs()) {
        return None;
    }
    far_end(plane, &across.map(|c| c / length), radius)
}

/// Below this share, the difference of two planes does not tell where their edge leads.
const CLEAR: f64 = 1e-3;

/// The farthest plane of the edge that runs from the plane `own` towards `across`, at right angles to it: with both
/// normals of length 1, the planes are cos θ own + sin θ across, and the farthest is at tan θ = o_across / o_own.
pub(crate) fn far_end(own: &Row, across: &Row, radius: f64) -> Option<Row> {
    let (o, v) = (-own[6], -across[6]);
    let farthest = (o * o + v * v).sqrt();
    (v > 0.0 && farthest >= radius - MARGIN)
        .then(|| std::array::from_fn(|r| (o * own[r] + v * across[r]) / farthest))
}

/// How much higher, for a point of length 1, the planes of an edge can get than the facet's own before they are farther
/// than `radius`: the chord between the two normals. The plane at the end must be at least that far.
pub(crate) fn rise(planes: &Planes, slot: usize, radius: f64) -> f64 {
    let (own, end, cosine) = (-planes[6][OWN], -planes[6][slot], planes[7][slot]);
    let sine = 1.0 - cosine * cosine;
    // The square of the largest offset on the edge's line.
    let farthest = (own * own + end * end - 2.0 * own * end * cosine) / sine;
    let turned = own * radius
        + ((farthest - own * own) * (farthest - radius * radius))
            .max(0.0)
            .sqrt();
    let chord = (2.0 - 2.0 * turned / farthest).max(0.0).sqrt();
    if sine > 1e-9 && chord < 2.0 {
        chord + 1e-9
    } else {
        2.0
    }
}

/// Rounding may leave the end of an edge this much too near.
const MARGIN: f64 = 1e-10;

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(seed: f64) -> Row {
        let raw: Row = std::array::from_fn(|k| (seed + 1.7 * k as f64 * seed).sin());
        let length = raw[..6].iter().map(|c| c * c).sum::<f64>().sqrt();
        std::array::from_fn(|k| if k < 6 { raw[k] / length } else { 0.5 * raw[k] })
    }

    #[test]
    fn what_is_near_is_known_without_the_plane() {
        for case in 0..50 {
            let case = f64::from(case);
            let mut planes = [[0.0; 8]; 8];
            set_column(&mut planes, OWN, &plane(1.0 + case));
            for slot in 0..6 {
                set_end(&mut planes, slot, &plane(0.3 + case + 0.1 * slot as f64));
            }
            let point = std::array::from_fn(|k| (2.0 * case + k as f64).cos());
            let heights = end_heights(&planes, &point);
            let bits = near(&planes, &heights, 0.2);
            for slot in (0..6).filter(|&k| (heights[k] > 0.0) != (heights[OWN] > 0.0)) {
                let (seen, unseen) = if heights[OWN] > 0.0 {
                    (OWN, slot)
                } else {
                    (slot, OWN)
                };
                let between = pencil(
                    &column(&planes, seen),
                    heights[seen],
                    &column(&planes, unseen),
                    heights[unseen],
                );
                assert!(height(&between, &point).abs() < 1e-14);
                assert_eq!(bits >> slot & 1 == 1, -between[6] < 0.2);
            }
        }
    }

    #[test]
    fn an_edge_ends_at_its_farthest_plane_and_rises_up_to_the_radius() {
        let mut planes = [[0.0; 8]; 8];
        let own = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.3];
        let across = [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -0.4];
        set_column(&mut planes, OWN, &own);
        let end = far_end(&own, &across, 0.45).unwrap();
        assert!((end[0] - 0.6).abs() < 1e-15 && (end[1] - 0.8).abs() < 1e-15 && (end[6] + 0.5).abs() < 1e-15);
        assert_eq!(far_end(&own, &across, 0.55), None);
        set_end(&mut planes, 0, &end);
        // The offset is 0.5 cos(φ − θ) with cos φ = 0.6.
        let turn = 0.6_f64.acos() - (0.45_f64 / 0.5).acos();
        assert!((rise(&planes, 0, 0.45) - 2.0 * (turn / 2.0).sin()).abs() < 1e-8);
    }
}
