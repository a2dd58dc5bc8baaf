//! Which triangles meet along which edges, by position rather than by index.

use std::collections::BTreeMap;

use nalgebra::Point3;

use crate::TriMesh;

/// Per vertex, the first vertex with the same coordinates (0 and −0 are the same).
pub(crate) fn position_ids(vertices: &[Point3<f64>]) -> Vec<u32> {
    let key = |v: u32| {
        let p = vertices[v as usize].coords;
        [p.x, p.y, p.z].map(|c| if c == 0.0 { 0 } else { c.to_bits() })
    };
    // Sorted by a mixture of the coordinates' bits: equal positions have equal ones, and one number is quickly compared.
    let mix = |[x, y, z]: [u64; 3]| {
        let step = |sum: u64, part: u64| (sum ^ part).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
        step(step(step(0, x), y), z)
    };
    let mut order: Vec<(u64, u32)> = (0..vertices.len() as u32).map(|v| (mix(key(v)), v)).collect();
    order.sort_unstable();
    let mut ids = vec![0; vertices.len()];
    for alike in order.chunk_by_mut(|a, b| a.0 == b.0) {
        // The lowest vertex comes first. Different positions of one mixture are next to impossible, but allowed for.
        if alike.iter().any(|a| key(a.1) != key(alike[0].1)) {
            alike.sort_unstable_by_key(|a| (key(a.1), a.1));
        }
        let mut first = alike[0].1;
        for (_, vertex) in alike {
            if key(*vertex) != key(first) {
                first = *vertex;
            }
            ids[*vertex as usize] = first;
        }
    }
    ids
}

/// The mesh's triangles by position ids, and whether two corners of each coincide.
pub(crate) fn position_triangles(mesh: &TriMesh) -> Vec<[u32; 3]> {
    let ids = position_ids(mesh.vertices());
    mesh.triangles()
        .iter()
        .map(|t| t.map(|v| ids[v as usize]))
        .collect()
}

/// Whether two corners are one: such a triangle has no area and no normal, and takes part in no edge.
pub(crate) fn is_collapsed([a, b, c]: [u32; 3]) -> bool {
    a == b || b == c || c == a
}

/// One triangle at an edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Side {
    pub triangle: usize,
    /// Whether the triangle runs along the edge from its lower vertex to its higher one.
    pub upward: bool,
}

/// Edges from lower to higher vertex, in order, with the triangles along each; collapsed triangles left out.
pub(crate) struct Edges {
    ends: Vec<[u32; 2]>,
    starts: Vec<usize>,
    sides: Vec<Side>,
}

impl Edges {
    pub fn new(triangles: &[[u32; 3]]) -> Self {
        let sides = || {
            let whole = triangles.iter().enumerate().filter(|(_, t)| !is_collapsed(**t));
            whole.flat_map(|(triangle, corners)| {
                (0..3).map(move |k| {
                    let (from, to) = (corners[k], corners[(k + 1) % 3]);
                    let upward = from < to;
                    (from.min(to), from.max(to), Side { triangle, upward })
                })
            })
        };
        // Each vertex's few edges to higher ones get a place of their own, in which they are sorted.
        let n_vertices = triangles.iter().flatten().max().map_or(0, |v| *v as usize + 1);
        let mut first = vec![0; n_vertices + 1];
        for (low, ..) in sides() {
            first[low as usize + 1] += 1;
        }
        for v in 0..n_vertices {
            first[v + 1] += first[v];
        }
        let none = Side {
            triangle: 0,
            upward: false,
        };
        let mut all = vec![(0, none); first[n_vertices]];
        let mut next = first.clone();
        for (low, high, side) in sides() {
            all[next[low as usize]] = (high, side);
            next[low as usize] += 1;
        }
        let mut ends: Vec<[u32; 2]> = Vec::with_capacity(all.len() / 2 + 1);
        let mut starts = Vec::with_capacity(all.len() / 2 + 2);
        for low in 0..n_vertices {
            let range = first[low]..first[low + 1];
            all[range.clone()].sort_unstable();
            for index in range {
                let edge = [low as u32, all[index].0];
                if ends.last() != Some(&edge) {
                    ends.push(edge);
                    starts.push(index);
                }
            }
        }
        starts.push(all.len());
        Self {
            ends,
            starts,
            sides: all.into_iter().map(|(_, side)| side).collect(),
        }
    }

    /// Each edge's lower and higher vertex, and the triangles along it.
    pub fn iter(&self) -> impl Iterator<Item = ([u32; 2], &[Side])> {
        self.ends
            .iter()
            .zip(self.starts.windows(2))
            .map(|(&ends, range)| (ends, &self.sides[range[0]..range[1]]))
    }
}

/// Groups of items that links join, directly or through others; numbered in the order of their first item.
pub(crate) struct Groups {
    parent: Vec<usize>,
}

impl Groups {
    pub fn new(n_items: usize) -> Self {
        Self {
            parent: (0..n_items).collect(),
        }
    }

    pub fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        // The lower item stays root, so that numbering does not depend on the order of the links.
        self.parent[a.max(b)] = a.min(b);
    }

    /// The lowest item of the group.
    pub fn root(&mut self, item: usize) -> usize {
        let mut item = item;
        while self.parent[item] != item {
            self.parent[item] = self.parent[self.parent[item]];
            item = self.parent[item];
        }
        item
    }

    /// Items by group, groups and items in order; items for which `keep` is false are left out.
    pub fn members(&mut self, keep: impl Fn(usize) -> bool) -> Vec<Vec<usize>> {
        let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for item in (0..self.parent.len()).filter(|&item| keep(item)) {
            let root = self.root(item);
            groups.entry(root).or_default().push(item);
        }
        groups.into_values().collect()
    }
}

/// Triangles joined by shared edges; collapsed ones belong nowhere.
pub(crate) fn components(triangles: &[[u32; 3]], edges: &Edges) -> Vec<Vec<usize>> {
    let mut groups = Groups::new(triangles.len());
    for (_, sides) in edges.iter() {
        for pair in sides.windows(2) {
            groups.join(pair[0].triangle, pair[1].triangle);
        }
    }
    groups.members(|triangle| !is_collapsed(triangles[triangle]))
}

/// Edges by the chain that they hang together in, in the order of each chain's first edge.
pub(crate) fn chains(edges: &[[u32; 2]]) -> Vec<Vec<[u32; 2]>> {
    let mut first_edge_at = BTreeMap::new();
    let mut groups = Groups::new(edges.len());
    for (edge, ends) in edges.iter().enumerate() {
        for end in ends {
            groups.join(edge, *first_edge_at.entry(end).or_insert(edge));
        }
    }
    groups
        .members(|_| true)
        .into_iter()
        .map(|chain| chain.into_iter().map(|edge| edges[edge]).collect())
        .collect()
}

/// The rim of what an edge leaves open: its ends, in the direction of the surplus, once for each triangle that has no
/// counterpart. Sides that run up and down in equal number close the surface.
pub(crate) fn rim(ends: [u32; 2], sides: &[Side]) -> impl Iterator<Item = [u32; 2]> + use<> {
    let surplus: i64 = sides.iter().map(|side| if side.upward { 1 } else { -1 }).sum();
    let rim = if surplus > 0 { ends } else { [ends[1], ends[0]] };
    std::iter::repeat_n(rim, surplus.unsigned_abs() as usize)
}
