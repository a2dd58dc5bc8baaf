//! Quickhull with exact orientation tests.

use nalgebra::Vector3;
use robust::{Coord3D, orient3d};

/// Below this distance (points fill the cube from −1 to 1) points count as coplanar, collinear or equal.
const RANK_TOLERANCE: f64 = 1e-10;

/// Of points equally far away, one inside a face or an edge of the hull would make a poor corner. This share of the
/// squared distance from the origin, added to distances, prefers true corners: the sum is strictly convex.
const CONVEXITY: f64 = 1e-9;

/// A corner that stands out from its neighbours by less than this is redundant; well below any tolerance for hulls.
const REDUNDANT: f64 = 1e-11;

/// As many of the points as are needed to span them: the largest simplex found greedily.
pub(super) enum Simplex {
    Solid([u32; 4]),
    Flat([u32; 3]),
    Segment([u32; 2]),
    Point(u32),
}

/// Finds far apart points that span all others. `points` lie in the cube from −1 to 1 and are not empty.
pub(super) fn initial_simplex(points: &[Vector3<f64>]) -> Simplex {
    let far = |distance: &dyn Fn(&Vector3<f64>) -> f64| {
        let mut best = (0, 0.0);
        for (i, p) in points.iter().enumerate() {
            let d = distance(p);
            if d > best.1 {
                best = (i, d);
            }
        }
        (best.0 as u32, best.1)
    };
    let start = (0..points.len())
        .min_by(|&i, &j| points[i].x.total_cmp(&points[j].x))
        .unwrap_or(0);
    let (a, _) = far(&|p| (p - points[start]).norm_squared());
    let pa = points[a as usize];
    let (b, squared) = far(&|p| (p - pa).norm_squared());
    if squared.sqrt() <= RANK_TOLERANCE {
        return Simplex::Point(a);
    }
    let along = (points[b as usize] - pa).normalize();
    let from_line = |p: &Vector3<f64>| along.cross(&(p - pa)).norm();
    let (_, width) = far(&from_line);
    if width <= RANK_TOLERANCE {
        return Simplex::Segment([a, b]);
    }
    let (c, _) = far(&|p| from_line(p) + CONVEXITY * width * p.norm_squared());
    let normal = along.cross(&(points[c as usize] - pa)).normalize();
    let from_plane = |p: &Vector3<f64>| normal.dot(&(p - pa)).abs();
    let (_, height) = far(&from_plane);
    let (d, _) = far(&|p| from_plane(p) + CONVEXITY * height * p.norm_squared());
    if height <= RANK_TOLERANCE {
        return Simplex::Flat([a, b, c]);
    }
    // The fourth point lies behind the triangle of the first three.
    if is_beyond(points, [a, b, c], d) {
        Simplex::Solid([a, c, b, d])
    } else {
        Simplex::Solid([a, b, c, d])
    }
}

/// Whether a point lies strictly on the outer side of a triangle; exact.
fn is_beyond(points: &[Vector3<f64>], triangle: [u32; 3], point: u32) -> bool {
    let [a, b, c, d] = [triangle[0], triangle[1], triangle[2], point].map(|i| {
        let p = points[i as usize];
        Coord3D {
            x: p.x,
            y: p.y,
            z: p.z,
        }
    });
    orient3d(a, b, c, d) < 0.0
}

struct Facet {
    corners: [u32; 3],
    /// Facet across the edge from corner `i` to corner `i + 1`.
    neighbours: [u32; 3],
    normal: Vector3<f64>,
    offset: f64,
    outside: Vec<u32>,
    /// The point of `outside` that is farthest, and how far, with a preference for corners.
    farthest: (u32, f64),
    alive: bool,
}

impl Facet {
    fn new(points: &[Vector3<f64>], corners: [u32; 3]) -> Self {
        let [a, b, c] = corners.map(|i| points[i as usize]);
        let normal = (b - a)
            .cross(&(c - a))
            .try_normalize(0.0)
            .unwrap_or_else(Vector3::zeros);
        let offset = normal.dot(&a);
        let neighbours = [u32::MAX; 3];
        Self {
            corners,
            neighbours,
            normal,
            offset,
            outside: Vec::new(),
            farthest: (0, 0.0),
            alive: true,
        }
    }

    /// Takes the point where it lies outside by more than the tolerance.
    fn take(&mut self, points: &[Vector3<f64>], point: u32, tolerance: f64) -> bool {
        let p = &points[point as usize];
        let distance = self.normal.dot(p) - self.offset;
        if distance <= tolerance {
            return false;
        }
        let preference = distance + CONVEXITY * p.norm_squared();
        if preference > self.farthest.1 {
            self.farthest = (point, preference);
        }
        self.outside.push(point);
        true
    }
}

/// One edge of the horizon, seen from the facet that goes: start, end, the facet that stays and its edge.
struct HorizonEdge {
    start: u32,
    end: u32,
    beyond: u32,
    beyond_edge: usize,
}

/// The hull's triangles as indices of `points`, which lie in the cube from −1 to 1.
///
/// Which facets see a point is decided exactly, so the visible ones always form a disc and the new facets a closed
/// surface; only which points are worth adding goes by the (rounded) distance.
pub(super) fn quickhull(points: &[Vector3<f64>], simplex: [u32; 4], tolerance: f64) -> Vec<[u32; 3]> {
    let [a, b, c, d] = simplex;
    let mut facets: Vec<Facet> = [[a, b, c], [a, d, b], [b, d, c], [c, d, a]]
        .map(|t| Facet::new(points, t))
        .into();
    for (facet, neighbours) in facets
        .iter_mut()
        .zip([[1, 2, 3], [3, 2, 0], [1, 3, 0], [2, 1, 0]])
    {
        facet.neighbours = neighbours;
    }
    for i in (0..points.len() as u32).filter(|i| !simplex.contains(i)) {
        let _ = facets.iter_mut().any(|f| f.take(points, i, tolerance));
    }

    let mut pending: Vec<u32> = vec![0, 1, 2, 3];
    let mut visible = Vec::new();
    let mut horizon = Vec::new();
    let mut new_facet_from = vec![u32::MAX; points.len()];
    while let Some(seed) = pending.pop() {
        let facet = &facets[seed as usize];
        if !facet.alive || facet.outside.is_empty() {
            continue;
        }
        let apex = facet.farthest.0;
        if !is_beyond(points, facet.corners, apex) {
            // Only rounding had put it outside.
            facets[seed as usize].outside.clear();
            continue;
        }
        find_horizon(points, &mut facets, seed, apex, &mut visible, &mut horizon);

        let first_new = facets.len() as u32;
        for edge in &horizon {
            let new = facets.len() as u32;
            let mut facet = Facet::new(points, [edge.start, edge.end, apex]);
            facet.neighbours[0] = edge.beyond;
            facets[edge.beyond as usize].neighbours[edge.beyond_edge] = new;
            new_facet_from[edge.start as usize] = new;
            facets.push(facet);
        }
        for new in first_new..facets.len() as u32 {
            let next = new_facet_from[facets[new as usize].corners[1] as usize];
            facets[new as usize].neighbours[1] = next;
            facets[next as usize].neighbours[2] = new;
        }
        for &old in &visible {
            for point in std::mem::take(&mut facets[old as usize].outside) {
                if point != apex {
                    let _ = facets[first_new as usize..]
                        .iter_mut()
                        .any(|f| f.take(points, point, tolerance));
                }
            }
        }
        pending.extend((first_new..facets.len() as u32).rev());
    }
    facets.iter().filter(|f| f.alive).map(|f| f.corners).collect()
}

/// Corners of a hull that lie inside a face or an edge of it up to rounding; no two of them neighbours.
///
/// A true corner is the only farthest point in the mean direction of its facets' normals.
pub(super) fn redundant_corners(points: &[Vector3<f64>], triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut mean = vec![Vector3::<f64>::zeros(); points.len()];
    for t in triangles {
        let [a, b, c] = t.map(|i| points[i as usize]);
        if let Some(normal) = (b - a).cross(&(c - a)).try_normalize(0.0) {
            for &i in t {
                mean[i as usize] += normal;
            }
        }
    }
    let mut least = vec![f64::INFINITY; points.len()];
    let edges = || triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    for [a, b] in edges() {
        let a = a as usize;
        let height = mean[a].dot(&(points[a] - points[b as usize])) / mean[a].norm();
        least[a] = least[a].min(height);
    }
    let is_suspect = |i: u32| least[i as usize] <= REDUNDANT;
    let mut suspects: Vec<[u32; 2]> = edges().filter(|[a, _]| is_suspect(*a)).collect();
    suspects.sort_unstable();
    let mut is_kept = vec![false; points.len()];
    let mut redundant = Vec::new();
    for group in suspects.chunk_by(|e, f| e[0] == f[0]) {
        let corner = group[0][0];
        if !is_kept[corner as usize] {
            redundant.push(corner);
            for &[_, neighbour] in group {
                is_kept[neighbour as usize] = true;
            }
        }
    }
    redundant
}

/// Marks the facets that see `apex` as gone and collects the edges around them.
fn find_horizon(
    points: &[Vector3<f64>],
    facets: &mut [Facet],
    seed: u32,
    apex: u32,
    visible: &mut Vec<u32>,
    horizon: &mut Vec<HorizonEdge>,
) {
    visible.clear();
    horizon.clear();
    visible.push(seed);
    facets[seed as usize].alive = false;
    let mut next = 0;
    while next < visible.len() {
        let facet = visible[next];
        next += 1;
        for edge in 0..3 {
            let beyond = facets[facet as usize].neighbours[edge];
            let other = &facets[beyond as usize];
            if other.alive && is_beyond(points, other.corners, apex) {
                facets[beyond as usize].alive = false;
                visible.push(beyond);
            }
        }
    }
    for &facet in visible.iter() {
        let Facet {
            corners, neighbours, ..
        } = &facets[facet as usize];
        for edge in 0..3 {
            let (beyond, start) = (neighbours[edge], corners[edge]);
            if facets[beyond as usize].alive {
                let other = &facets[beyond as usize].corners;
                let beyond_edge =
                    (0..3).find(|&k| other[(k + 1) % 3] == start && other[k] == corners[(edge + 1) % 3]);
                let beyond_edge = beyond_edge.expect("neighbouring facets share an edge");
                horizon.push(HorizonEdge {
                    start,
                    end: corners[(edge + 1) % 3],
                    beyond,
                    beyond_edge,
                });
            }
        }
    }
}
