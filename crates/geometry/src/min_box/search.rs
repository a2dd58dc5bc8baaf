//! The search over orientations.

use nalgebra::{Matrix3, Point3, Vector3};

use super::canonical::Candidate;
use super::silhouette::{Silhouette, perpendicular};
use crate::ConvexHull;
use crate::hull::hull_within;
use crate::planar::{flush_rectangles, planar_hull};

/// Directions spread over the half sphere.
const N_LATTICE: usize = 100;
/// Hull facets whose normals are tried, largest first.
const N_FACETS: usize = 64;
/// Boxes that are measured again about their own axes.
const N_STARTS: usize = 6;
/// Of those, boxes whose axes are polished.
const N_POLISHED: usize = 4;
/// Hulls with more corners are scanned in a simplified form.
const LARGE_HULL: usize = 100;
/// How far inside the hull its simplified form may lie, relative to half of each extent of a first box.
const SIMPLIFIED: f64 = 4e-3;
/// Rounds of measuring a box about its own axes; each is cheap, and more than a few only creep.
const MAX_ROUNDS: usize = 12;
/// A box counts as smaller where it is smaller by this share.
const IMPROVEMENT: f64 = 1e-10;

/// Corners and triangles of a hull, moved to the origin and scaled to a size near 1.
pub(super) struct UnitHull {
    pub(super) points: Vec<Vector3<f64>>,
    triangles: Vec<[u32; 3]>,
}

pub(super) fn to_unit_size(hull: &ConvexHull) -> UnitHull {
    let base = hull.points()[0];
    let reach = hull
        .points()
        .iter()
        .map(|p| (p / 2.0 - base / 2.0).amax())
        .fold(0.0, f64::max);
    let scale = if reach > 0.0 { reach } else { 1.0 };
    let points = hull
        .points()
        .iter()
        .map(|p| (p / 2.0 - base / 2.0) / scale)
        .collect();
    UnitHull {
        points,
        triangles: hull.triangles().to_vec(),
    }
}

/// Candidates for flat points: the rectangles flush with an edge, and the one along the frame where that is possible.
pub(super) fn flat(hull: &UnitHull) -> Vec<Candidate> {
    let [a, b, c] = hull.triangles[0].map(|v| hull.points[v as usize]);
    let normal = (b - a).cross(&(c - a)).normalize();
    let (u, v) = perpendicular(&normal);
    let plane: Vec<[f64; 2]> = hull.points.iter().map(|p| [u.dot(p), v.dot(p)]).collect();
    let polygon: Vec<[f64; 2]> = planar_hull(&plane).iter().map(|&i| plane[i as usize]).collect();
    let mut candidates = Vec::new();
    flush_rectangles(&polygon, |d, size| {
        let along = u * d[0] + v * d[1];
        candidates.push(Candidate {
            axes: Matrix3::from_columns(&[normal, along, normal.cross(&along)]),
            size,
        });
    });
    if normal.amax() >= 1.0 - 1e-15 {
        let span = |k: usize| {
            let values = hull.points.iter().map(|p| p[k]);
            values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
        };
        let size = (0..3).filter(|&k| k != normal.iamax()).map(span).product();
        candidates.push(Candidate {
            axes: Matrix3::identity(),
            size,
        });
    }
    candidates
}

/// Candidates for a solid hull: the best boxes found, and those along the frame.
pub(super) fn solid(hull: &UnitHull, hints: &[Vector3<f64>]) -> Vec<Candidate> {
    let mut full = Silhouette::new(&hull.points, &hull.triangles);
    let mut directions: Vec<Vector3<f64>> = (0..3).map(|k| Vector3::ith(k, 1.0)).collect();
    directions.extend(hints);
    let facets = facet_normals(hull);
    let first = directions
        .iter()
        .chain(facets.iter().take(8))
        .map(|d| full.best_about(d))
        .min_by(by_size);
    directions.extend(facets);
    directions.extend(lattice(N_LATTICE));

    // The coarse part of the search sees a large hull in simplified form.
    let simple = first
        .filter(|_| hull.points.len() > LARGE_HULL)
        .map(|first| simplified(hull, &first.axes));
    let is_simplified = simple.is_some();
    let mut rough = simple.unwrap_or_else(|| full.clone());
    let mut starts = scan(&mut rough, &directions);
    for start in &mut starts {
        *start = settle(&mut rough, start.axes);
    }
    starts.sort_by(by_size);
    starts.truncate(N_POLISHED);
    for start in &mut starts {
        *start = polish(&mut rough, *start, &[0.03], 50);
        if is_simplified {
            *start = settle(&mut full, start.axes);
        }
    }
    starts.sort_by(by_size);
    let best = polish(&mut full, starts[0], &[3e-3, 1e-5], 80);

    let mut candidates = vec![Candidate {
        axes: Matrix3::identity(),
        size: full.size_along(&Matrix3::identity()),
    }];
    for k in 0..3 {
        full.boxes_about(&Vector3::ith(k, 1.0), |c| candidates.push(c));
    }
    candidates.extend(starts);
    candidates.push(best);
    for k in 0..3 {
        full.boxes_about(&best.axes.column(k).into(), |c| candidates.push(c));
    }
    candidates
}

/// The best few of the boxes about each direction, no two with nearly the same axes.
fn scan(body: &mut Silhouette, directions: &[Vector3<f64>]) -> Vec<Candidate> {
    let mut all: Vec<Candidate> = directions.iter().map(|d| body.best_about(d)).collect();
    all.sort_by(by_size);
    let mut starts: Vec<Candidate> = Vec::new();
    for candidate in all {
        // Axes within about 3° of one another lead to the same box.
        let is_known = |known: &Candidate| {
            let cosines = (known.axes.transpose() * candidate.axes).abs();
            (0..3).all(|k| cosines.column(k).max() > 0.9986)
        };
        if !starts.iter().any(is_known) {
            starts.push(candidate);
            if starts.len() == N_STARTS {
                break;
            }
        }
    }
    starts
}

/// Measures a box again about each of its own axes until it no longer shrinks.
fn settle(body: &mut Silhouette, axes: Matrix3<f64>) -> Candidate {
    let mut best = Candidate {
        axes,
        size: f64::INFINITY,
    };
    for _ in 0..MAX_ROUNDS {
        let size_before = best.size;
        let axes = best.axes;
        for k in 0..3 {
            let candidate = body.best_about(&axes.column(k).into());
            if candidate.size < best.size * (1.0 - IMPROVEMENT) || best.size.is_infinite() {
                best = candidate;
            }
        }
        if best.size >= size_before * (1.0 - IMPROVEMENT) || !best.size.is_finite() {
            break;
        }
    }
    best
}

/// Turns each axis of a box a little, by Nelder and Mead's method at each scale (rad), keeping what shrinks it.
fn polish(body: &mut Silhouette, start: Candidate, scales: &[f64], max_calipers: usize) -> Candidate {
    let mut best = start;
    for &scale in scales {
        for k in 0..3 {
            let axis: Vector3<f64> = best.axes.column(k).into();
            let (u, v) = perpendicular(&axis);
            let turned = |[s, t]: [f64; 2]| (axis + u * s + v * t).normalize();
            let at = nelder_mead(scale, max_calipers, |offset| {
                body.best_about(&turned(offset)).size
            });
            let candidate = body.best_about(&turned(at));
            if candidate.size < best.size * (1.0 - IMPROVEMENT) {
                best = settle(body, candidate.axes);
            }
        }
    }
    best
}

/// Least point of a function of two variables near 0, starting from a triangle of the given scale.
fn nelder_mead(scale: f64, max_calls: usize, mut f: impl FnMut([f64; 2]) -> f64) -> [f64; 2] {
    let mut simplex = [[0.0, 0.0], [scale, 0.0], [-0.5 * scale, 0.87 * scale]].map(|x| (x, f(x)));
    let mut calls = 3;
    while calls < max_calls {
        simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
        let [best, second, worst] = simplex;
        let width = (best.0[0] - worst.0[0]).abs().max((best.0[1] - worst.0[1]).abs());
        if width < 1e-4 * scale || worst.1 - best.1 <= 1e-12 * best.1.abs() {
            break;
        }
        let middle = [0, 1].map(|k| f64::midpoint(best.0[k], second.0[k]));
        let mut at = |step: f64| {
            let x = [0, 1].map(|k| middle[k] + step * (worst.0[k] - middle[k]));
            calls += 1;
            (x, f(x))
        };
        let reflected = at(-1.0);
        if reflected.1 < best.1 {
            let expanded = at(-2.0);
            simplex[2] = if expanded.1 < reflected.1 {
                expanded
            } else {
                reflected
            };
        } else if reflected.1 < second.1 {
            simplex[2] = reflected;
        } else {
            let contracted = if reflected.1 < worst.1 { at(-0.5) } else { at(0.5) };
            if contracted.1 < worst.1.min(reflected.1) {
                simplex[2] = contracted;
            } else {
                for vertex in &mut simplex[1..] {
                    let x = [0, 1].map(|k| f64::midpoint(vertex.0[k], best.0[k]));
                    *vertex = (x, f(x));
                    calls += 1;
                }
            }
        }
    }
    simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
    simplex[0].0
}

/// Unit normals of the largest facets, leaving out nearly parallel ones.
fn facet_normals(hull: &UnitHull) -> Vec<Vector3<f64>> {
    let mut facets: Vec<(f64, Vector3<f64>)> = hull
        .triangles
        .iter()
        .map(|t| t.map(|v| hull.points[v as usize]))
        .map(|[a, b, c]| (b - a).cross(&(c - a)))
        .filter_map(|n| Some((n.norm(), n.try_normalize(0.0)?)))
        .collect();
    facets.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut normals: Vec<Vector3<f64>> = Vec::new();
    for (_, normal) in facets {
        if normals.len() == N_FACETS {
            break;
        }
        if normals.iter().all(|n| n.dot(&normal).abs() < 1.0 - 1e-8) {
            normals.push(normal);
        }
    }
    normals
}

/// `n` unit vectors spread evenly over half of the sphere.
fn lattice(n: usize) -> impl Iterator<Item = Vector3<f64>> {
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..n).map(move |i| {
        let z = (i as f64 + 0.5) / n as f64;
        let (sin, cos) = (golden_angle * i as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vector3::new(r * cos, r * sin, z)
    })
}

/// A hull with fewer corners, a little inside the given one, in proportion to the body's own three extents.
fn simplified(hull: &UnitHull, axes: &Matrix3<f64>) -> Silhouette {
    let inverse = axes.transpose();
    let local: Vec<Vector3<f64>> = hull.points.iter().map(|p| inverse * p).collect();
    let low = local
        .iter()
        .fold(Vector3::repeat(f64::INFINITY), |low, p| low.inf(p));
    let high = local
        .iter()
        .fold(Vector3::repeat(f64::NEG_INFINITY), |high, p| high.sup(p));
    let extents = high - low;
    let scaled: Vec<Point3<f64>> = local.iter().map(|p| p.component_div(&extents).into()).collect();
    let simple = hull_within(&scaled, SIMPLIFIED);
    let points: Vec<Vector3<f64>> = simple
        .points()
        .iter()
        .map(|p| axes * p.coords.component_mul(&extents))
        .collect();
    Silhouette::new(&points, simple.triangles())
}

fn by_size(a: &Candidate, b: &Candidate) -> std::cmp::Ordering {
    a.size.total_cmp(&b.size)
}
