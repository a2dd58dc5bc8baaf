//! The rims of a surface's holes, and how far a winding number may be from a whole one for their sake.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use crate::winding::solid_angle;

/// A lid that takes up less of the view (steradians, of 4π) is not looked at closely.
const SMALL_VIEW: f64 = 0.05;

/// Loops of edges that triangles on one side only have.
#[derive(Debug, Clone, Default)]
pub(crate) struct Holes {
    rims: Vec<Rim>,
}

#[derive(Debug, Clone)]
struct Rim {
    middle: Point3<f64>,
    /// No edge's end is farther from the middle.
    radius: f64,
    /// Area of the lid: triangles from the middle to each edge.
    lid_area: f64,
    edges: Vec<[Point3<f64>; 2]>,
}

impl Holes {
    /// Finds the edges that are not run through once in each direction; corners at the same place count as one.
    pub(crate) fn of(triangles: &[[Point3<f64>; 3]]) -> Self {
        let key = |p: &Point3<f64>| [p.x + 0.0, p.y + 0.0, p.z + 0.0].map(f64::to_bits);
        let mut ids = BTreeMap::new();
        let mut points = Vec::new();
        let mut net: Vec<(u64, i32)> = Vec::with_capacity(triangles.len() * 3);
        let mut id_of = |p: &Point3<f64>| {
            *ids.entry(key(p)).or_insert_with(|| {
                points.push(*p);
                points.len() as u64 - 1
            })
        };
        for t in triangles {
            let ids = [id_of(&t[0]), id_of(&t[1]), id_of(&t[2])];
            for k in 0..3 {
                let (a, b) = (ids[k], ids[(k + 1) % 3]);
                if a != b {
                    net.push((a.min(b) << 32 | a.max(b), if a < b { 1 } else { -1 }));
                }
            }
        }
        net.sort_unstable();
        let open = net.chunk_by(|a, b| a.0 == b.0).flat_map(|chunk| {
            let sum: i32 = chunk.iter().map(|c| c.1).sum();
            let (low, high) = (chunk[0].0 >> 32, chunk[0].0 & 0xffff_ffff);
            let edge = if sum > 0 { [low, high] } else { [high, low] };
            std::iter::repeat_n(edge, sum.unsigned_abs() as usize)
        });
        // Edges that share corners make one rim.
        let mut parent: BTreeMap<u64, u64> = BTreeMap::new();
        let open: Vec<[u64; 2]> = open.collect();
        for [a, b] in &open {
            let (a, b) = (root(&mut parent, *a), root(&mut parent, *b));
            parent.insert(a.max(b), a.min(b));
            parent.insert(a.min(b), a.min(b));
        }
        let mut rims: BTreeMap<u64, Vec<[Point3<f64>; 2]>> = BTreeMap::new();
        for edge in &open {
            let rim = rims.entry(root(&mut parent, edge[0])).or_default();
            rim.push(edge.map(|i| points[i as usize]));
        }
        let rim = |edges: Vec<[Point3<f64>; 2]>| {
            let sum: Vector3<f64> = edges.iter().map(|[a, _]| a.coords).sum();
            let middle = Point3::from(sum / edges.len() as f64);
            let ends = edges.iter().flatten().map(|p| (p - middle).norm());
            Rim {
                middle,
                radius: ends.fold(0.0, f64::max),
                lid_area: edges
                    .iter()
                    .map(|[a, b]| (a - middle).cross(&(b - middle)).norm() / 2.0)
                    .sum(),
                edges,
            }
        };
        Self {
            rims: rims.into_values().map(rim).collect(),
        }
    }

    /// Whether the winding number stays within 0.4 or so of one whole number in the ball around `p`, as far as no surface
    /// is met: lids on all holes take up less than a quarter of the view, and all rims are two radii away.
    pub(crate) fn are_far_from(&self, p: &Point3<f64>, radius: f64) -> bool {
        let mut view = 0.0;
        for rim in &self.rims {
            // Seen from afar, a lid takes up no more than its area over its distance squared.
            let clear = (rim.middle - p).norm() - rim.radius;
            let most = rim.lid_area / (clear * clear);
            if clear >= 2.0 * radius && clear > 0.0 && most < SMALL_VIEW {
                view += most;
                continue;
            }
            let mut lid = 0.0;
            for [a, b] in &rim.edges {
                let middle = nalgebra::center(a, b);
                let clear = (middle - p).norm() - (b - a).norm() / 2.0;
                if clear < 2.0 * radius {
                    return false;
                }
                lid += solid_angle(&[rim.middle, *b, *a], p);
            }
            view += lid.abs();
        }
        view < std::f64::consts::PI
    }
}

/// The least corner of the rim that a corner belongs to.
fn root(parent: &mut BTreeMap<u64, u64>, mut i: u64) -> u64 {
    while let Some(&up) = parent.get(&i).filter(|up| **up != i) {
        let above = parent.get(&up).copied().unwrap_or(up);
        parent.insert(i, above);
        i = above;
    }
    i
}
