//! Planes that a piece may be cut at, and what they leave.

use nalgebra::{Point3, Rotation3, Unit, Vector3};

use super::groups::Group;
use crate::OrientedBox;
use crate::decompose::body::Body;
use crate::decompose::cut::promising_cuts;
use crate::decompose::fit::Cloud;
use crate::decompose::region::{Plane, Region};

/// Planes of facets at concave edges that are kept for a body, and tried for a piece.
const N_CONCAVE: usize = 32;
const N_CONCAVE_TRIED: usize = 4;
/// Cuts that are tried of those seen from the box's own faces, and from each turned box.
const N_SEEN: [usize; 2] = [4, 1];
/// An edge is concave where its facets turn inwards by more than this (sine of the angle).
const CONCAVE: f64 = 0.2;
/// Cuts whose halves are boxed with care.
const N_CAREFUL: usize = 2;
/// Places tried when a cut is moved, and how far to either side, relative to the extent along its normal.
const N_SLIDES: usize = 8;
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
            concave: planes_at_concave_edges(body.thought()),
        }
    }

    /// The cut of a region that leaves the least volume.
    ///
    /// Candidates are the middles of the box, the best places of the images on its faces and on faces turned by 45°,
    /// and facets at concave edges.
    pub(super) fn best(&self, body: &Body, region: &Region, fitted: &OrientedBox) -> Option<Halves> {
        let axes = [0, 1, 2].map(|k| fitted.axis(k));
        let mut tried: Vec<(f64, Plane, [Cloud; 2])> = Vec::new();
        for plane in self.planes(body, region, fitted) {
            let sides = region.points_beside(&plane);
            if sides.iter().any(|side| side.len() < 3) {
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

    fn planes(&self, body: &Body, region: &Region, fitted: &OrientedBox) -> Vec<Plane> {
        let mut planes: Vec<Plane> = Vec::new();
        let mut add = |normal: Vector3<f64>, origin: Point3<f64>| {
            let is_known = |p: &Plane| {
                p.normal.dot(&normal).abs() > 0.9999
                    && p.normal.dot(&(origin - p.origin)).abs() < 0.2 * body.min_slab
            };
            if !planes.iter().any(is_known) {
                planes.push(Plane { normal, origin });
            }
        };
        for around in [None, Some(0), Some(1), Some(2)] {
            let seen_from = match around {
                None => *fitted,
                Some(axis) => turned(region, fitted, axis),
            };
            let mut cuts = promising_cuts(region, &seen_from, self.n_cells, body.min_slab);
            cuts.sort_by(|a, b| b.freed.total_cmp(&a.freed));
            for cut in cuts.into_iter().take(N_SEEN[usize::from(around.is_some())]) {
                let normal = seen_from.axis(cut.axis);
                add(normal, seen_from.center() + normal * cut.position);
            }
        }
        for k in (0..3).filter(|&k| fitted.extents()[k] > 2.0 * body.min_slab) {
            add(fitted.axis(k), fitted.center());
        }
        let fits = |plane: &&Plane| {
            let heights = region
                .vertices()
                .iter()
                .map(|p| plane.normal.dot(&(p - plane.origin)));
            let (low, high) = heights.fold((0.0_f64, 0.0_f64), |(low, high), h| (low.min(h), high.max(h)));
            low < -body.min_slab && high > body.min_slab
        };
        for plane in self.concave.iter().filter(fits).take(N_CONCAVE_TRIED) {
            add(plane.normal, plane.origin);
        }
        planes
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
                .best(body, &region, &both.fitted)
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

/// Moves a plane along its normal to where the two boxes are smallest, by golden section.
fn slide(body: &Body, region: &Region, found: Halves) -> Halves {
    let normal = found.plane.normal;
    let heights = region
        .vertices()
        .iter()
        .map(|p| normal.dot(&(p - found.plane.origin)));
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| {
        (l.min(x), h.max(x))
    });
    let reach = SLIDE * (high - low);
    let (mut from, mut to) = (
        (low + body.min_slab).max(-reach),
        (high - body.min_slab).min(reach),
    );
    let axes = found.boxes.map(|b| [0, 1, 2].map(|k| b.axis(k)));
    let sides_at = |shift: f64| {
        let plane = Plane {
            normal,
            origin: found.plane.origin + normal * shift,
        };
        let sides = region.points_beside(&plane);
        let has_points = sides.iter().all(|side| side.len() >= 3);
        has_points.then(|| (plane, sides.map(Cloud::new)))
    };
    let mut best = (f64::INFINITY, 0.0);
    let mut at = |shift: f64| {
        let rough = |(_, clouds): (Plane, [Cloud; 2])| -> f64 {
            let sides = clouds.iter().zip(&axes);
            sides
                .map(|(cloud, axes)| cloud.rough_volume(axes, body.min_extent))
                .sum()
        };
        let volume = sides_at(shift).map_or(f64::INFINITY, rough);
        if volume < best.0 {
            best = (volume, shift);
        }
        volume
    };
    if from < to {
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let (mut left, mut right) = (to - GOLDEN * (to - from), from + GOLDEN * (to - from));
        let (mut at_left, mut at_right) = (at(left), at(right));
        for _ in 2..N_SLIDES {
            if at_left <= at_right {
                (to, right, at_right) = (right, left, at_left);
                left = to - GOLDEN * (to - from);
                at_left = at(left);
            } else {
                (from, left, at_left) = (left, right, at_right);
                right = from + GOLDEN * (to - from);
                at_right = at(right);
            }
        }
    }
    let Some((plane, clouds)) = sides_at(best.1) else {
        return found;
    };
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
