//! The search over orientations.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};

use super::body::{Body, Scratch, perpendicular};
use super::canonical::Candidate;
use super::descent::descend;
use crate::ConvexHull;
use crate::planar::{flush_rectangles, planar_hull};

/// Hull facets whose normals are tried, largest first.
const N_FACETS: usize = 32;
/// So many boxes are turned downhill in any case, and so many at most.
const MIN_STARTS: usize = 12;
const MAX_STARTS: usize = 60;
/// Between the two, boxes up to this factor above the smallest so far are: on round clouds, nearly all lead far down.
const START_WINDOW: f64 = 1.2;
/// With at most so many corners, normals of planes that touch an edge are tried as well, so many in all.
const SMALL_HULL: usize = 24;
const N_EDGE_NORMALS: usize = 240;
/// Longest first turns (rad) of a descent, and what a step must promise (share of the volume): first to tell the basins
/// apart, then to reach the bottom of the best.
const START_REACH: f64 = 0.1;
const ROUGH: f64 = 1e-3;
const END_REACH: f64 = 0.02;
const FINE: f64 = 1e-11;
/// Boxes up to this factor above the smallest are followed to the bottom.
const END_WINDOW: f64 = 1.01;

/// Facets at a smaller angle (rad) are one.
const FLAT_EDGE: f64 = 1e-6;

/// Corners and triangles of a hull, moved to the origin and scaled to a size near 1.
pub(super) struct UnitHull {
    pub(super) points: Vec<Vector3<f64>>,
    triangles: Vec<[u32; 3]>,
}

impl UnitHull {
    /// Twice the area of a triangle, along its outward normal.
    fn area_vector(&self, triangle: &[u32; 3]) -> Vector3<f64> {
        let [a, b, c] = triangle.map(|v| self.points[v as usize]);
        (b - a).cross(&(c - a))
    }
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
    // Every other triangle is a back side. Single triangles may be slivers, with normals of rounding.
    let normal: Vector3<f64> = hull
        .triangles
        .iter()
        .step_by(2)
        .map(|t| hull.area_vector(t))
        .sum();
    let normal = normal.normalize();
    let (u, v) = perpendicular(&normal);
    let plane: Vec<[f64; 2]> = hull.points.iter().map(|p| [u.dot(p), v.dot(p)]).collect();
    let polygon: Vec<[f64; 2]> = planar_hull(&plane).iter().map(|&i| plane[i as usize]).collect();
    let mut candidates = Vec::new();
    flush_rectangles(&polygon, |d, [width, height]| {
        let along = u * d[0] + v * d[1];
        candidates.push(Candidate {
            axes: Matrix3::from_columns(&[normal, along, normal.cross(&along)]),
            size: width * height,
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
    let body = Body::new(hull.points.clone(), &hull.triangles);
    let mut scratch = Scratch::default();
    let frame = own_frame(hull);
    let mut directions: Vec<Vector3<f64>> = hints.to_vec();
    let area_vectors = hull.triangles.iter().map(|t| hull.area_vector(t));
    directions.extend(largest_normals(area_vectors, N_FACETS));
    directions.extend(lattice().map(|d| frame * d));
    if hull.points.len() <= SMALL_HULL {
        directions.extend(edge_normals(hull));
    }

    let mut candidates = vec![Candidate {
        axes: Matrix3::identity(),
        size: body.size_along(&Matrix3::identity()),
    }];
    for k in 0..3 {
        body.boxes_about(&Vector3::ith(k, 1.0), &mut scratch, |c| candidates.push(c));
    }
    let mut all: Vec<Candidate> = directions
        .iter()
        .map(|d| body.best_about(d, &mut scratch))
        .collect();
    all.extend(candidates.iter().copied().min_by(by_size));
    all.sort_by(by_size);
    let mut tried: Vec<Candidate> = Vec::new();
    let mut ends: Vec<Candidate> = Vec::new();
    let mut least = f64::INFINITY;
    for candidate in all {
        if tried.iter().any(|known| is_near(known, &candidate)) {
            continue;
        }
        tried.push(candidate);
        if ends.len() >= MIN_STARTS && candidate.size > least * START_WINDOW || ends.len() == MAX_STARTS {
            break;
        }
        let end = descend(&body, &candidate.axes, START_REACH, ROUGH);
        least = least.min(end.size);
        ends.push(end);
    }
    ends.retain(|end| end.size <= least * END_WINDOW);
    for end in &mut ends {
        *end = descend(&body, &end.axes, END_REACH, FINE);
    }
    ends.sort_by(by_size);
    // Where several boxes about one axis are equally small, all of them are wanted.
    for k in 0..3 {
        let axis = ends[0].axes.column(k).into();
        body.boxes_about(&axis, &mut scratch, |c| candidates.push(c));
    }
    candidates.extend(ends);
    candidates
}

/// Whether the axes are within about 3° of one another.
fn is_near(a: &Candidate, b: &Candidate) -> bool {
    let cosines = (a.axes.transpose() * b.axes).abs();
    (0..3).all(|k| cosines.column(k).max() > 0.9986)
}

/// Unit normals of the `n` largest facets with these area vectors, leaving out nearly parallel ones.
pub(crate) fn largest_normals(
    area_vectors: impl Iterator<Item = Vector3<f64>>,
    n: usize,
) -> Vec<Vector3<f64>> {
    let mut facets: Vec<(f64, Vector3<f64>)> = area_vectors
        .filter_map(|n| Some((n.norm(), n.try_normalize(0.0)?)))
        .collect();
    facets.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut normals: Vec<Vector3<f64>> = Vec::new();
    for (_, normal) in facets {
        if normals.len() == n {
            break;
        }
        if normals.iter().all(|n| n.dot(&normal).abs() < 1.0 - 1e-4) {
            normals.push(normal);
        }
    }
    normals
}

/// Directions spread over the arcs from facet normal to facet normal across each edge.
///
/// In a box of least volume two faces that meet hold an edge of the hull each (O'Rourke 1985). One edge gives an arc of
/// normals, and calipers about such a normal find the other edge: these arcs are all that has to be searched.
fn edge_normals(hull: &UnitHull) -> Vec<Vector3<f64>> {
    let sides = hull.triangles.iter().filter_map(|t| {
        let normal = hull.area_vector(t).try_normalize(0.0)?;
        Some([[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]].map(|edge| (edge, normal)))
    });
    let of_edge: BTreeMap<[u32; 2], Vector3<f64>> = sides.flatten().collect();
    let n_steps = (N_EDGE_NORMALS / (of_edge.len() / 2).max(1)).max(1);
    let mut normals = Vec::new();
    for (&[a, b], here) in of_edge.iter().filter(|([a, b], _)| a < b) {
        let Some(there) = of_edge.get(&[b, a]) else {
            continue;
        };
        let angle = here.cross(there).norm().atan2(here.dot(there));
        let axis = here.cross(there);
        if angle < FLAT_EDGE {
            continue;
        }
        let aside = axis.cross(here).normalize();
        normals.extend((0..n_steps).map(|i| {
            let (sine, cosine) = (angle * (i as f64 + 0.5) / n_steps as f64).sin_cos();
            here * cosine + aside * sine
        }));
    }
    normals
}

/// Principal axes of the hull's surface.
fn own_frame(hull: &UnitHull) -> Matrix3<f64> {
    let mut area = 0.0;
    let mut first = Vector3::zeros();
    let mut second = Matrix3::zeros();
    for t in &hull.triangles {
        let [a, b, c] = t.map(|v| hull.points[v as usize]);
        let weight = (b - a).cross(&(c - a)).norm();
        let sum = a + b + c;
        area += weight;
        first += sum * (weight / 3.0);
        let squares = a * a.transpose() + b * b.transpose() + c * c.transpose();
        second += (squares + sum * sum.transpose()) * (weight / 12.0);
    }
    let covariance = second / area - first * first.transpose() / (area * area);
    covariance.symmetric_eigen().eigenvectors
}

/// Directions to small integer points, the same about each axis: 73 over half of the sphere.
fn lattice() -> impl Iterator<Item = Vector3<f64>> {
    const KINDS: [[i32; 3]; 7] = [
        [1, 0, 0],
        [1, 1, 0],
        [1, 1, 1],
        [2, 1, 0],
        [2, 1, 1],
        [2, 2, 1],
        [3, 2, 1],
    ];
    let all = (-3..=3_i32).flat_map(|x| (-3..=3_i32).flat_map(move |y| (-3..=3_i32).map(move |z| [x, y, z])));
    all.filter(|p| p.iter().find(|c| **c != 0).is_some_and(|c| *c > 0))
        .filter(|p| {
            let mut kind = p.map(i32::abs);
            kind.sort_unstable_by(|a, b| b.cmp(a));
            KINDS.contains(&kind)
        })
        .map(|p| Vector3::from(p.map(f64::from)).normalize())
}

fn by_size(a: &Candidate, b: &Candidate) -> std::cmp::Ordering {
    a.size.total_cmp(&b.size)
}
