//! The same surface with fewer triangles: enough to choose cuts on.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use nalgebra::{Matrix3, Point3, Vector3};

/// A corner may move by no more than this (root mean square distance from the planes that it stood for).
const TOLERANCE: f64 = 2e-3;

/// How much the planes that hold rims count, relative to surface as wide as the edge is long.
const RIM: f64 = 10.0;

/// A triangle that turns by more than this (cosine) folds over.
const FOLD: f64 = 0.2;

/// At most about `wanted` of the triangles' corners moved onto others, the least changes first; fewer triangles are kept
/// as they are. Lengths are relative to a body of a size near 1.
///
/// Edges are contracted to one of their ends, so that every corner left is one of those given. What a contraction costs
/// is the sum of squared distances to the planes of the triangles that went before, weighted by their areas, and of
/// planes upright on rims.
///
/// # Source
///
/// Garland and Heckbert, "Surface simplification using quadric error metrics" (1997).
pub(super) fn simplified(
    points: &[Point3<f64>],
    triangles: &[[u32; 3]],
    wanted: usize,
) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    if triangles.len() <= wanted {
        return (points.to_vec(), triangles.to_vec());
    }
    let mut surface = Surface::new(points, triangles);
    surface.contract(wanted);
    let mut new_index = vec![u32::MAX; points.len()];
    let mut kept = Vec::new();
    let mut corners_left = Vec::new();
    for (triangle, _) in surface
        .triangles
        .iter()
        .zip(&surface.is_alive)
        .filter(|(_, alive)| **alive)
    {
        corners_left.push(triangle.map(|v| {
            let index = &mut new_index[v as usize];
            if *index == u32::MAX {
                *index = kept.len() as u32;
                kept.push(points[v as usize]);
            }
            *index
        }));
    }
    (kept, corners_left)
}

/// Σ w (n · x − d)², and Σ w.
#[derive(Clone, Copy)]
struct Quadric {
    squares: Matrix3<f64>,
    linear: Vector3<f64>,
    constant: f64,
    weight: f64,
}

impl Quadric {
    const ZERO: Self = Self {
        squares: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        linear: Vector3::new(0.0, 0.0, 0.0),
        constant: 0.0,
        weight: 0.0,
    };

    fn add_plane(&mut self, normal: &Vector3<f64>, through: &Point3<f64>, weight: f64) {
        let d = normal.dot(&through.coords);
        self.squares += normal * normal.transpose() * weight;
        self.linear += normal * (d * weight);
        self.constant += d * d * weight;
        self.weight += weight;
    }

    fn sum(&self, other: &Self) -> Self {
        Self {
            squares: self.squares + other.squares,
            linear: self.linear + other.linear,
            constant: self.constant + other.constant,
            weight: self.weight + other.weight,
        }
    }

    fn at(&self, p: &Point3<f64>) -> f64 {
        (p.coords.dot(&(self.squares * p.coords - self.linear * 2.0)) + self.constant).max(0.0)
    }
}

/// Moving one corner onto another; the cheaper comes first, then the lower indices.
#[derive(PartialEq)]
struct Contraction {
    cost: f64,
    from: u32,
    to: u32,
    /// How often either end had changed.
    changes: u32,
}

impl Eq for Contraction {}

impl PartialOrd for Contraction {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Contraction {
    fn cmp(&self, other: &Self) -> Ordering {
        let order = self.cost.total_cmp(&other.cost);
        order.then((self.from, self.to, self.changes).cmp(&(other.from, other.to, other.changes)))
    }
}

struct Surface<'a> {
    points: &'a [Point3<f64>],
    triangles: Vec<[u32; 3]>,
    is_alive: Vec<bool>,
    n_alive: usize,
    /// Triangles at each corner; some may be gone.
    around: Vec<Vec<u32>>,
    edges: Vec<[u32; 2]>,
    quadrics: Vec<Quadric>,
    changes: Vec<u32>,
}

impl<'a> Surface<'a> {
    fn new(points: &'a [Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        let first = first_of_equal(points);
        let triangles: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(|v| first[v as usize])).collect();
        let mut surface = Self {
            points,
            is_alive: triangles
                .iter()
                .map(|[a, b, c]| a != b && b != c && c != a)
                .collect(),
            n_alive: 0,
            around: vec![Vec::new(); points.len()],
            edges: Vec::new(),
            quadrics: vec![Quadric::ZERO; points.len()],
            changes: vec![0; points.len()],
            triangles,
        };
        let mut edges: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * surface.triangles.len());
        for (i, &[a, b, c]) in surface.triangles.iter().enumerate() {
            if !surface.is_alive[i] {
                continue;
            }
            surface.n_alive += 1;
            let area_vector = surface.area_vector([a, b, c]);
            for v in [a, b, c] {
                surface.around[v as usize].push(i as u32);
                if let Some(normal) = area_vector.try_normalize(0.0) {
                    let weight = area_vector.norm() / 2.0;
                    surface.quadrics[v as usize].add_plane(&normal, &points[a as usize], weight);
                }
            }
            edges.extend([[a, b], [b, c], [c, a]].map(|[p, q]| ([p.min(q), p.max(q)], i as u32)));
        }
        edges.sort_unstable();
        for shared in edges.chunk_by(|e, f| e.0 == f.0) {
            if let &[([p, q], triangle)] = shared {
                surface.hold_rim(p, q, triangle);
            }
            surface.edges.push(shared[0].0);
        }
        surface
    }

    /// A plane through an edge at a hole keeps the hole's outline.
    fn hold_rim(&mut self, p: u32, q: u32, triangle: u32) {
        let along = self.points[q as usize] - self.points[p as usize];
        let upright = self.area_vector(self.triangles[triangle as usize]).cross(&along);
        if let Some(normal) = upright.try_normalize(0.0) {
            for v in [p, q] {
                let through = self.points[p as usize];
                self.quadrics[v as usize].add_plane(&normal, &through, RIM * along.norm_squared());
            }
        }
    }

    fn area_vector(&self, triangle: [u32; 3]) -> Vector3<f64> {
        let [a, b, c] = triangle.map(|v| self.points[v as usize]);
        (b - a).cross(&(c - a))
    }

    /// The cheaper way to contract an edge.
    fn contraction(&self, p: u32, q: u32) -> Contraction {
        let both = self.quadrics[p as usize].sum(&self.quadrics[q as usize]);
        let [at_p, at_q] = [p, q].map(|v| both.at(&self.points[v as usize]));
        let (cost, from, to) = if at_p < at_q { (at_p, q, p) } else { (at_q, p, q) };
        Contraction {
            cost,
            from,
            to,
            changes: self.changes[p as usize] + self.changes[q as usize],
        }
    }

    fn contract(&mut self, wanted: usize) {
        let mut queue: BinaryHeap<Reverse<Contraction>> = self
            .edges
            .iter()
            .map(|&[p, q]| Reverse(self.contraction(p, q)))
            .collect();
        while self.n_alive > wanted {
            let Some(Reverse(next)) = queue.pop() else { break };
            let (from, to) = (next.from as usize, next.to as usize);
            let is_stale = next.changes != self.changes[from] + self.changes[to];
            let both = self.quadrics[from].sum(&self.quadrics[to]);
            if is_stale || next.cost > TOLERANCE * TOLERANCE * both.weight || self.folds(next.from, next.to) {
                continue;
            }
            self.quadrics[to] = both;
            for triangle in std::mem::take(&mut self.around[from]) {
                let corners = &mut self.triangles[triangle as usize];
                if !self.is_alive[triangle as usize] {
                    continue;
                }
                if corners.contains(&next.to) {
                    self.is_alive[triangle as usize] = false;
                    self.n_alive -= 1;
                } else {
                    *corners = corners.map(|v| if v == next.from { next.to } else { v });
                    self.around[to].push(triangle);
                }
            }
            self.changes[from] += 1;
            self.changes[to] += 1;
            let (triangles, is_alive) = (&self.triangles, &self.is_alive);
            self.around[to].retain(|&t| is_alive[t as usize]);
            let mut neighbours: Vec<u32> = self.around[to]
                .iter()
                .flat_map(|&t| triangles[t as usize])
                .filter(|&v| v != next.to)
                .collect();
            neighbours.sort_unstable();
            neighbours.dedup();
            queue.extend(neighbours.iter().map(|&v| Reverse(self.contraction(v, next.to))));
        }
    }

    /// Whether moving a corner onto another turns a triangle over.
    fn folds(&self, from: u32, to: u32) -> bool {
        self.around[from as usize].iter().any(|&t| {
            let triangle = self.triangles[t as usize];
            if !self.is_alive[t as usize] || triangle.contains(&to) {
                return false;
            }
            let before = self.area_vector(triangle);
            let after = self.area_vector(triangle.map(|v| if v == from { to } else { v }));
            before.dot(&after) < FOLD * before.norm() * after.norm()
        })
    }
}

/// For each point the first one at the same place.
fn first_of_equal(points: &[Point3<f64>]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    let at = |i: u32| points[i as usize];
    let compare = |p: Point3<f64>, q: Point3<f64>| {
        let by_axis = (0..3).map(|k| p[k].total_cmp(&q[k]));
        by_axis.fold(Ordering::Equal, Ordering::then)
    };
    order.sort_unstable_by(|&i, &j| compare(at(i), at(j)).then(i.cmp(&j)));
    let mut first = vec![0; points.len()];
    for equal in order.chunk_by(|&i, &j| at(i) == at(j)) {
        for &i in equal {
            first[i as usize] = equal[0];
        }
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of `n` × `n` cells with a lid at a right angle along one side.
    fn bent_sheet(n: u32) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        let step = 1.0 / f64::from(n);
        let mut points = Vec::new();
        for i in 0..=2 * n {
            for j in 0..=n {
                let along = f64::from(i) * step;
                points.push(Point3::new(
                    along.min(1.0),
                    f64::from(j) * step,
                    (along - 1.0).max(0.0),
                ));
            }
        }
        let mut triangles = Vec::new();
        for i in 0..2 * n {
            for j in 0..n {
                let a = i * (n + 1) + j;
                let b = a + n + 1;
                triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
            }
        }
        (points, triangles)
    }

    fn area(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> f64 {
        let corners = triangles.iter().map(|t| t.map(|v| points[v as usize]));
        corners
            .map(|[a, b, c]| (b - a).cross(&(c - a)).norm() / 2.0)
            .sum()
    }

    #[test]
    fn flat_parts_lose_their_triangles_and_the_outline_stays() {
        let (points, triangles) = bent_sheet(20);
        let (fewer, left) = simplified(&points, &triangles, 12);
        assert!(left.len() <= 12, "{}", left.len());
        assert!((area(&fewer, &left) - 2.0).abs() < 1e-9);
        assert!(fewer.iter().all(|p| points.contains(p)));
    }

    #[test]
    fn few_triangles_and_loose_ones_are_left_alone() {
        let (points, triangles) = bent_sheet(2);
        assert_eq!(simplified(&points, &triangles, 16).1, triangles);
        let loose: Vec<Point3<f64>> = (0..9)
            .map(|i| Point3::new(f64::from(i % 3 / 2), f64::from(i % 3 % 2), f64::from(i / 3)))
            .collect();
        let (_, left) = simplified(&loose, &[[0, 1, 2], [3, 4, 5], [6, 7, 8]], 1);
        assert_eq!(left.len(), 3);
    }
}
