//! Where to cut a box, by what is seen of its content on its faces.

use nalgebra::Vector3;

use super::region::Region;
use crate::OrientedBox;
use crate::planar::turn;

/// Steps that the neighbourhood of a promising cut is divided into in each round.
const N_REFINED: usize = 16;

/// A cut that frees less than this share of a face sees no dent, only the corners of a polygonised curve.
const LEAST_FREED: f64 = 0.005;

/// A plane across a box.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cut {
    /// The box's axis (0, 1, 2) that is normal to the plane.
    pub(super) axis: usize,
    /// Coordinate of the plane along it, from the box's centre.
    pub(super) position: f64,
    /// Share of the face's area that is freed, 1 − α.
    pub(super) freed: f64,
}

/// The promising cuts: of each image along each of its axes the one with the least α, where it sees a dent.
///
/// In the order of axes and images, the first of equal places; those that free less than half as much as the best
/// are left out. No cut takes off a slab thinner than `min_slab`. The place of each is looked for again, `n_rounds` times,
/// between its neighbours.
pub(super) fn promising_cuts(
    region: &Region,
    fitted: &OrientedBox,
    n_cells: usize,
    min_slab: f64,
    n_rounds: usize,
) -> Vec<Cut> {
    let local: Vec<Vector3<f64>> = region.vertices().iter().map(|p| fitted.local(p)).collect();
    let extents = fitted.extents();
    let mut cuts: Vec<Cut> = Vec::new();
    for axis in 0..3 {
        let half = extents[axis] / 2.0;
        let slab = min_slab.max(extents[axis] / n_cells as f64);
        if half <= slab {
            continue;
        }
        let profile = Profile::new(&local, region.triangles(), axis);
        let places = spread(slab - half, half - slab, n_cells - 2);
        let step = (places[1] - places[0]).abs();
        for (image, side) in [(axis + 1) % 3, (axis + 2) % 3].into_iter().enumerate() {
            let face = extents[axis] * extents[side];
            let mut found = profile.most_freed(&places, image);
            let mut width = step;
            for _ in 0..n_rounds {
                let (low, high) = (
                    (found.0 - width).max(slab - half),
                    (found.0 + width).min(half - slab),
                );
                let refined = profile.most_freed(&spread(low, high, N_REFINED), image);
                if refined.1 > found.1 {
                    found = refined;
                }
                width *= 2.0 / N_REFINED as f64;
            }
            let cut = Cut {
                axis,
                position: found.0,
                freed: found.1 / face,
            };
            // Two images often see the same cut.
            let is_seen = |c: &Cut| c.axis == axis && (c.position - cut.position).abs() < 0.1 * step;
            if cut.freed > LEAST_FREED && !cuts.iter().any(is_seen) {
                cuts.push(cut);
            }
        }
    }
    let most = cuts.iter().map(|c| c.freed).fold(0.0, f64::max);
    cuts.retain(|c| c.freed >= most / 2.0);
    cuts
}

/// `n + 1` numbers (at least two) from `low` to `high`.
fn spread(low: f64, high: f64, n: usize) -> Vec<f64> {
    let n = n.max(1);
    (0..=n)
        .map(|i| low + (high - low) * i as f64 / n as f64)
        .collect()
}

/// The content of a box along one of its axes, in its two images (u, v), u along the axis.
struct Profile {
    /// Coordinate along the axis, sorted, and along the two other axes.
    vertices: Vec<[f64; 3]>,
    /// Ends of the triangles' edges, lower end first.
    edges: Vec<[[f64; 3]; 2]>,
}

impl Profile {
    fn new(local: &[Vector3<f64>], triangles: &[[u32; 3]], axis: usize) -> Self {
        let at = |p: &Vector3<f64>| [p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]];
        let mut vertices: Vec<[f64; 3]> = local.iter().map(at).collect();
        let mut edges = Vec::with_capacity(3 * triangles.len());
        for &[a, b, c] in triangles {
            for [p, q] in [[a, b], [b, c], [c, a]] {
                let (p, q) = (vertices[p as usize], vertices[q as usize]);
                edges.push(if p[0] <= q[0] { [p, q] } else { [q, p] });
            }
        }
        vertices.sort_unstable_by(|p, q| p[0].total_cmp(&q[0]));
        Self { vertices, edges }
    }

    /// The place where a cut frees the most area in an image (0 or 1), and that area; the first of equals.
    fn most_freed(&self, places: &[f64], image: usize) -> (f64, f64) {
        let spans = self.spans_at(places, image);
        let below = self.hull_areas(places, &spans, image, false);
        let above = self.hull_areas(places, &spans, image, true);
        let whole = below[places.len()];
        let mut best = (places[0], f64::NEG_INFINITY);
        for (i, &place) in places.iter().enumerate() {
            let freed = whole - below[i] - above[i];
            if freed > best.1 {
                best = (place, freed);
            }
        }
        best
    }

    /// Lowest and highest point of the edges that cross each place.
    fn spans_at(&self, places: &[f64], image: usize) -> Vec<[f64; 2]> {
        let mut spans = vec![[f64::INFINITY, f64::NEG_INFINITY]; places.len()];
        for [p, q] in &self.edges {
            if q[0] <= places[0] || p[0] >= places[places.len() - 1] {
                continue;
            }
            let first = places.partition_point(|&s| s <= p[0]);
            for (span, &s) in spans[first..].iter_mut().zip(&places[first..]) {
                if s >= q[0] {
                    break;
                }
                let t = (s - p[0]) / (q[0] - p[0]);
                let height = p[1 + image] + t * (q[1 + image] - p[1 + image]);
                *span = [span[0].min(height), span[1].max(height)];
            }
        }
        spans
    }

    /// Areas of the convex hulls of what lies below (or above) each place, and last of the whole image.
    fn hull_areas(&self, places: &[f64], spans: &[[f64; 2]], image: usize, above: bool) -> Vec<f64> {
        let sign = if above { -1.0 } else { 1.0 };
        let n = self.vertices.len();
        let vertex = |i: usize| {
            let p = self.vertices[if above { n - 1 - i } else { i }];
            [sign * p[0], p[1 + image]]
        };
        let mut areas = vec![0.0; places.len() + 1];
        let mut hull = SweptHull::default();
        let mut next = 0;
        for k in 0..places.len() {
            let i = if above { places.len() - 1 - k } else { k };
            let place = sign * places[i];
            while next < n && vertex(next)[0] <= place {
                hull.push(vertex(next));
                next += 1;
            }
            if spans[i][0] <= spans[i][1] {
                hull.push([place, spans[i][0]]);
                hull.push([place, spans[i][1]]);
            }
            areas[i] = hull.area();
        }
        for i in next..n {
            hull.push(vertex(i));
        }
        areas[places.len()] = hull.area();
        areas
    }
}

/// The convex hull of plane points that come in the order of their first coordinate (Andrew's chains).
#[derive(Default)]
struct SweptHull {
    lower: Chain,
    upper: Chain,
}

impl SweptHull {
    fn push(&mut self, p: [f64; 2]) {
        self.lower.push(p, 1.0);
        self.upper.push(p, -1.0);
    }

    fn area(&self) -> f64 {
        (self.lower.swept() - self.upper.swept()) / 2.0
    }
}

/// One side of the hull; beside each corner twice the area between the chain up to it and the origin.
#[derive(Default)]
struct Chain(Vec<([f64; 2], f64)>);

impl Chain {
    fn push(&mut self, p: [f64; 2], side: f64) {
        let chain = &mut self.0;
        while let [.., (a, _), (b, _)] = chain[..] {
            if side * turn(a, b, p) > 0.0 {
                break;
            }
            chain.pop();
        }
        let swept = chain
            .last()
            .map_or(0.0, |(q, swept)| swept + q[0] * p[1] - q[1] * p[0]);
        chain.push((p, swept));
    }

    fn swept(&self) -> f64 {
        self.0.last().map_or(0.0, |(_, swept)| *swept)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_swept_hull_knows_its_area_after_every_point() {
        let mut hull = SweptHull::default();
        let mut areas = Vec::new();
        for p in [
            [0.0, 1.0],
            [0.0, 0.0],
            [1.0, 0.5],
            [2.0, 2.0],
            [2.0, 0.0],
            [2.0, 1.0],
        ] {
            hull.push(p);
            areas.push(hull.area());
        }
        assert_eq!(areas, [0.0, 0.0, 0.5, 1.5, 3.0, 3.0]);
    }
}
