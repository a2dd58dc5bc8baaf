//! Planes that a piece may be cut at, and what they leave.

use nalgebra::{Rotation3, Unit, Vector3};

use super::groups::Group;
use super::widths::{Widths, spread};
use crate::OrientedBox;
use crate::decompose::body::Body;
use crate::decompose::cut::promising_cuts;
use crate::decompose::fit::Cloud;
use crate::decompose::region::{Plane, Region};

/// Planes of facets at concave edges that are kept for a body.
const N_CONCAVE: usize = 16;
/// Cuts that are tried of those seen from the box's own faces, and from each turned box; places tried close to each.
const N_SEEN: [usize; 2] = [4, 1];
const N_NEAR: usize = 9;
/// Planes whose sides are boxed, of those that look best by sampled boxes; rounds in which each is moved to its best.
const N_TRIED: usize = 5;
const N_ROUNDS: usize = 3;
/// An edge is concave where its facets turn inwards by more than this (sine of the angle).
const CONCAVE: f64 = 0.2;
/// Cuts whose halves are boxed with care.
const N_CAREFUL: usize = 2;
/// Places tried in each round when a cut is moved, and how far to either side, relative to the extent along its normal.
const N_SLIDES: usize = 12;
const SLIDE: f64 = 0.08;
/// Pairs of boxes that are cut anew at most, and the least share of their volume that counts as better.
const N_RECUTS: usize = 48;
const BETTER: f64 = 2e-3;

/// A plane, and the boxes on its sides (in the body's own frame).
#[derive(Clone)]
pub(super) struct Halves {
    pub(super) plane: Plane,
    pub(super) boxes: [OrientedBox; 2],
}

impl Halves {
    pub(super) fn volume(&self) -> f64 {
        self.boxes[0].volume() + self.boxes[1].volume()
    }
}

/// Where planes for cuts come from.
pub(super) struct Candidates {
    n_cells: usize,
    concave: Vec<Plane>,
}

impl Candidates {
    pub(super) fn new(body: &Body, n_cells: usize) -> Self {
        Self {
            n_cells: n_cells.div_ceil(2).max(4),
            concave: planes_at_concave_edges(&body.thought().region),
        }
    }

    /// The cut of a region that leaves the least volume.
    ///
    /// Candidates are the middles of the box, the best places of the images on its faces and on faces turned by 45°,
    /// facets at concave edges and, where `sweeping`, all planes across the axes or halfway between two of them. What
    /// looks best by sampled boxes is boxed with care.
    pub(super) fn best(
        &self,
        body: &Body,
        region: &Region,
        fitted: &OrientedBox,
        sweeping: bool,
    ) -> Option<Halves> {
        let axes = [0, 1, 2].map(|k| fitted.axis(k));
        let widths = Widths::new(region, &axes, body.min_extent);
        let mut tried: Vec<(f64, Plane, [Cloud; 2])> = Vec::new();
        for plane in self.planes(body, region, fitted, &widths, sweeping) {
            let sides = region.points_beside(&plane);
            if sides.iter().any(|side| side.len() < body.min_points.max(3)) {
                continue;
            }
            let clouds = sides.map(Cloud::new);
            let directions = [axes[0], axes[1], axes[2], plane.normal];
            let volume = clouds
                .iter()
                .map(|c| c.rough_volume(&directions, body.min_extent))
                .sum();
            tried.push((volume, plane, clouds));
        }
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut best: Option<Halves> = None;
        for (_, plane, clouds) in tried.into_iter().take(N_CAREFUL) {
            let boxes = clouds.map(|c| c.fit(&axes, body.min_extent));
            let found = Halves { plane, boxes };
            if best
                .as_ref()
                .is_none_or(|b| found.volume() < b.volume() * (1.0 - 1e-6))
            {
                best = Some(found);
            }
        }
        best
    }

    /// The least volume that some swept plane leaves, by sampled boxes.
    pub(super) fn least_volume(&self, body: &Body, region: &Region, fitted: &OrientedBox) -> f64 {
        let axes = [0, 1, 2].map(|k| fitted.axis(k));
        let widths = Widths::new(region, &axes, body.min_extent);
        let swept = self.swept(body, &widths, 1);
        swept
            .iter()
            .map(|(volume, _)| *volume)
            .fold(f64::INFINITY, f64::min)
    }

    /// The best planes, by sampled boxes.
    fn planes(
        &self,
        body: &Body,
        region: &Region,
        fitted: &OrientedBox,
        widths: &Widths,
        sweeping: bool,
    ) -> Vec<Plane> {
        let mut found = if sweeping {
            self.swept(body, widths, N_ROUNDS)
        } else {
            Vec::new()
        };
        for around in [None, Some(0), Some(1), Some(2)] {
            let seen_from = around.map_or(*fitted, |axis| turned(region, fitted, axis));
            let mut cuts = promising_cuts(region, &seen_from, self.n_cells, body.min_slab, 0);
            cuts.sort_by(|a, b| b.freed.total_cmp(&a.freed));
            for cut in cuts.into_iter().take(N_SEEN[usize::from(around.is_some())]) {
                let normal = seen_from.axis(cut.axis);
                let here = normal.dot(&seen_from.center().coords) + cut.position;
                let step = seen_from.extents()[cut.axis] / self.n_cells as f64;
                let (place, volume) = widths.best_place(&normal, (here - step, here + step), N_NEAR, 2);
                let origin = (normal * place).into();
                found.push((volume, Plane { normal, origin }));
            }
        }
        for k in (0..3).filter(|&k| fitted.extents()[k] > 2.0 * body.min_slab) {
            let plane = Plane {
                normal: fitted.axis(k),
                origin: fitted.center(),
            };
            found.push((widths.volume_beside(&plane), plane));
        }
        let fits = |plane: &&Plane| {
            let (low, high) = widths.span(&plane.normal);
            let place = plane.normal.dot(&plane.origin.coords);
            low < place - body.min_slab && high > place + body.min_slab
        };
        let concave = self.concave.iter().filter(fits);
        found.extend(concave.map(|plane| (widths.volume_beside(plane), *plane)));
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut planes: Vec<Plane> = Vec::new();
        for (_, plane) in found {
            let is_known = |p: &Plane| {
                p.normal.dot(&plane.normal).abs() > 0.9999
                    && p.normal.dot(&(plane.origin - p.origin)).abs() < 0.2 * body.min_slab
            };
            if planes.len() < N_TRIED && !planes.iter().any(is_known) {
                planes.push(plane);
            }
        }
        planes
    }

    /// The best plane of each swept normal, with the volume on both sides.
    fn swept(&self, body: &Body, widths: &Widths, n_rounds: usize) -> Vec<(f64, Plane)> {
        let mut found = Vec::new();
        for normal in widths.normals() {
            let (low, high) = widths.span(&normal);
            let range = (low + body.min_slab, high - body.min_slab);
            if range.0 < range.1 {
                let (place, volume) = widths.best_place(&normal, range, self.n_cells, n_rounds);
                let origin = (normal * place).into();
                found.push((volume, Plane { normal, origin }));
            }
        }
        found
    }

    /// Cuts neighbouring groups anew, two at a time, largest first, where that leaves less volume.
    pub(super) fn improve(&self, body: &Body, groups: &mut [Group]) {
        let mut n_left = N_RECUTS;
        let mut settled: Vec<[u32; 2]> = Vec::new();
        let mut version: Vec<u32> = (0..groups.len() as u32).collect();
        let mut next_version = groups.len() as u32;
        while n_left > 0 {
            let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
            for i in 0..groups.len() {
                for j in 0..i {
                    let is_new = !settled.contains(&[version[i], version[j]]);
                    if is_new && groups[i].touches(&groups[j], body.min_slab) {
                        pairs.push((groups[i].fitted.volume() + groups[j].fitted.volume(), i, j));
                    }
                }
            }
            let largest = pairs.into_iter().reduce(|a, b| if b.0 > a.0 { b } else { a });
            let Some((volume, i, j)) = largest else { break };
            n_left -= 1;
            settled.push([version[i], version[j]]);
            let both = Group::joined(body, &groups[i], &groups[j]);
            let region = both.region();
            let halves = self
                .best(body, &region, &both.fitted, true)
                .map(|found| slide(body, &region, found));
            let Some(halves) = halves.filter(|h| h.volume() < volume * (1.0 - BETTER)) else {
                continue;
            };
            if let Some([below, above]) = both.cut(body, &halves) {
                groups[i] = below;
                groups[j] = above;
                version[i] = next_version;
                version[j] = next_version + 1;
                next_version += 2;
            }
        }
    }
}

/// Moves a plane along its normal to where the boxes with the axes of its two are smallest.
fn slide(body: &Body, region: &Region, found: Halves) -> Halves {
    let normal = found.plane.normal;
    let axes = found.boxes.map(|b| [0, 1, 2].map(|k| b.axis(k)));
    let [below, above] = axes
        .each_ref()
        .map(|axes| Widths::new(region, axes, body.min_extent));
    let (low, high) = below.span(&normal);
    let here = normal.dot(&found.plane.origin.coords);
    let reach = SLIDE * (high - low);
    let (from, to) = (
        (low + body.min_slab).max(here - reach),
        (high - body.min_slab).min(here + reach),
    );
    if from >= to {
        return found;
    }
    let (mut best, mut range) = ((f64::INFINITY, here), (from, to));
    for _ in 0..N_ROUNDS {
        let places = spread(range.0, range.1, N_SLIDES);
        let (left, right) = (
            below.sides(&normal, &places).below,
            above.sides(&normal, &places).above,
        );
        for ((&place, left), right) in places.iter().zip(left).zip(right) {
            if left + right < best.0 {
                best = (left + right, place);
            }
        }
        let step = (range.1 - range.0) / (N_SLIDES - 1) as f64;
        range = ((best.1 - step).max(from), (best.1 + step).min(to));
    }
    let plane = Plane {
        normal,
        origin: (normal * best.1).into(),
    };
    let sides = region.points_beside(&plane);
    if sides.iter().any(|side| side.len() < body.min_points.max(3)) {
        return found;
    }
    let clouds = sides.map(Cloud::new);
    let fit = |side: usize| clouds[side].fit(&axes[side], body.min_extent);
    let moved = Halves {
        plane,
        boxes: [fit(0), fit(1)],
    };
    if moved.volume() < found.volume() {
        moved
    } else {
        found
    }
}

/// The box around a region with the axes of another turned by 45° about one of them.
fn turned(region: &Region, fitted: &OrientedBox, axis: usize) -> OrientedBox {
    let turn = Rotation3::from_axis_angle(
        &Unit::new_unchecked(fitted.axis(axis)),
        std::f64::consts::FRAC_PI_4,
    );
    let axes = turn * fitted.axes();
    let local = region.vertices().iter().map(|p| axes.inverse() * p.coords);
    let (low, high) = local.fold(
        (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)),
        |(low, high), p| (low.inf(&p), high.sup(&p)),
    );
    let extents = (high - low).map(|e| e.max(f64::MIN_POSITIVE));
    OrientedBox::new((axes * ((low + high) / 2.0)).into(), axes, extents).unwrap_or(*fitted)
}

/// Planes of the facets at concave edges, the longest edges first, nearly equal planes once.
fn planes_at_concave_edges(whole: &Region) -> Vec<Plane> {
    let at = |v: u32| whole.vertices()[v as usize];
    let mut edges: Vec<([u32; 2], usize)> = Vec::with_capacity(3 * whole.triangles().len());
    for (facet, &[a, b, c]) in whole.triangles().iter().enumerate() {
        edges.extend([[a, b], [b, c], [c, a]].map(|[p, q]| ([p.min(q), p.max(q)], facet)));
    }
    edges.sort_unstable();
    let normal = |facet: usize| {
        let [a, b, c] = whole.triangles()[facet].map(at);
        (b - a).cross(&(c - a)).try_normalize(0.0)
    };
    let six_volumes: f64 = whole
        .triangles()
        .iter()
        .map(|t| t.map(|v| at(v).coords))
        .map(|[a, b, c]| a.cross(&b).dot(&c))
        .sum();
    let outwards = if six_volumes < 0.0 { -1.0 } else { 1.0 };
    let mut weighted: Vec<(f64, Plane)> = Vec::new();
    for pair in edges.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        let ([p, q], first, second) = (pair[0].0, pair[0].1, pair[1].1);
        let (Some(n), Some(m)) = (normal(first), normal(second)) else {
            continue;
        };
        let bend = n.cross(&m).norm();
        let apex = whole.triangles()[second].into_iter().find(|&v| v != p && v != q);
        let is_concave = apex.is_some_and(|apex| outwards * n.dot(&(at(apex) - at(p))) > 0.0);
        if bend > CONCAVE && is_concave {
            let weight = (at(q) - at(p)).norm() * bend;
            for normal in [n, m] {
                let origin = at(p);
                let is_same = |(_, plane): &(f64, Plane)| {
                    plane.normal.dot(&normal).abs() > 0.999
                        && plane.normal.dot(&(origin - plane.origin)).abs() < 0.01
                };
                match weighted.iter().position(is_same) {
                    Some(known) => weighted[known].0 += weight,
                    None if weighted.len() < 8 * N_CONCAVE => {
                        weighted.push((weight, Plane { normal, origin }));
                    }
                    None => {}
                }
            }
        }
    }
    weighted.sort_by(|a, b| b.0.total_cmp(&a.0));
    weighted
        .into_iter()
        .take(N_CONCAVE)
        .map(|(_, plane)| plane)
        .collect()
}
