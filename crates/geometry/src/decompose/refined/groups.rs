//! Pieces that share a box, and merging them.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use super::candidates::Halves;
use crate::OrientedBox;
use crate::decompose::body::{Body, Part};
use crate::decompose::fit::Cloud;
use crate::decompose::region::Region;

/// Pieces and the quickly found box around them, in the body's own frame.
#[derive(Clone)]
pub(super) struct Group {
    parts: Vec<Arc<Part>>,
    corners: Vec<Point3<f64>>,
    low: Vector3<f64>,
    high: Vector3<f64>,
    pub(super) fitted: OrientedBox,
}

impl Group {
    pub(super) fn new(parts: Vec<Part>, fitted: OrientedBox) -> Self {
        let parts: Vec<Arc<Part>> = parts.into_iter().map(Arc::new).collect();
        let points: Vec<Point3<f64>> = parts.iter().flat_map(|p| p.thought.points()).collect();
        Self::with(parts, Cloud::new(points).corners(), fitted)
    }

    fn with(parts: Vec<Arc<Part>>, corners: Vec<Point3<f64>>, fitted: OrientedBox) -> Self {
        let low = corners
            .iter()
            .fold(Vector3::repeat(f64::INFINITY), |low, p| low.inf(&p.coords));
        let high = corners
            .iter()
            .fold(Vector3::repeat(f64::NEG_INFINITY), |high, p| high.sup(&p.coords));
        Self {
            parts,
            corners,
            low,
            high,
            fitted,
        }
    }

    /// Both in one.
    pub(super) fn joined(body: &Body, a: &Self, b: &Self) -> Self {
        let parts = a.parts.iter().chain(&b.parts).cloned().collect();
        let cloud = Self::cloud(a, b);
        let fitted = Self::fit(body, &cloud, a, b);
        Self::with(parts, cloud.corners(), fitted)
    }

    /// Volume of the box around both; `rough`: of the smallest with an axis along one of theirs.
    fn joined_volume(body: &Body, a: &Self, b: &Self, rough: bool) -> f64 {
        let cloud = Self::cloud(a, b);
        if rough {
            let axes = [0, 1, 2].map(|k| [a.fitted.axis(k), b.fitted.axis(k)]);
            cloud.rough_volume(axes.as_flattened(), body.min_extent)
        } else {
            Self::fit(body, &cloud, a, b).volume()
        }
    }

    fn cloud(a: &Self, b: &Self) -> Cloud {
        Cloud::new(a.corners.iter().chain(&b.corners).copied().collect())
    }

    fn fit(body: &Body, cloud: &Cloud, a: &Self, b: &Self) -> OrientedBox {
        let larger = if a.fitted.volume() >= b.fitted.volume() {
            a
        } else {
            b
        };
        cloud.fit(&[0, 1, 2].map(|k| larger.fitted.axis(k)), body.min_extent)
    }

    /// Whether the bounds along the axes come closer than a margin.
    pub(super) fn touches(&self, other: &Self, margin: f64) -> bool {
        (0..3).all(|k| self.low[k] <= other.high[k] + margin && other.low[k] <= self.high[k] + margin)
    }

    pub(super) fn region(&self) -> Region {
        Region::joined(&self.parts.iter().map(|p| &p.thought).collect::<Vec<_>>())
    }

    pub(super) fn real_regions(&self) -> Vec<&Region> {
        self.parts.iter().map(|p| &p.real).collect()
    }

    /// The two sides of a plane; none where one is empty.
    pub(super) fn cut(&self, body: &Body, halves: &Halves) -> Option<[Self; 2]> {
        let mut sides = [Vec::new(), Vec::new()];
        for part in &self.parts {
            for (side, piece) in sides.iter_mut().zip(body.cut(part, &halves.plane)) {
                // A sliver may be left in one frame and not in the other.
                if !piece.real.is_empty() || !piece.thought.is_empty() {
                    side.push(piece);
                }
            }
        }
        let has_all = |side: &Vec<Part>| {
            side.iter().any(|p| !p.thought.is_empty()) && side.iter().any(|p| !p.real.is_empty())
        };
        if !sides.iter().all(has_all) {
            return None;
        }
        let [below, above] = sides;
        Some([
            Self::new(below, halves.boxes[0]),
            Self::new(above, halves.boxes[1]),
        ])
    }
}

/// Groups merged two by two until one is left.
pub(super) struct Merges {
    /// The pieces first, then every merger.
    groups: Vec<Group>,
    /// What each merger was made of.
    sides: Vec<[usize; 2]>,
    n_pieces: usize,
}

impl Merges {
    pub(super) fn n_pieces(&self) -> usize {
        self.n_pieces
    }

    /// The groups when `n` of them were left, at least one.
    pub(super) fn groups(&self, n: usize) -> Vec<Group> {
        let n_merged = self.n_pieces.saturating_sub(n.max(1));
        let n_groups = self.n_pieces + n_merged;
        let gone: Vec<usize> = self.sides[..n_merged].iter().flatten().copied().collect();
        (0..n_groups)
            .filter(|i| !gone.contains(i))
            .map(|i| self.groups[i].clone())
            .collect()
    }

    pub(super) fn root(&self) -> usize {
        self.groups.len() - 1
    }

    pub(super) fn group(&self, i: usize) -> &Group {
        &self.groups[i]
    }

    /// What a merger was made of; none for a piece.
    pub(super) fn sides(&self, i: usize) -> Option<[usize; 2]> {
        i.checked_sub(self.n_pieces).map(|merger| self.sides[merger])
    }
}

/// What merging two groups adds.
#[derive(Clone, Copy)]
struct Pair {
    /// V(A ∪ B) − V(A) − V(B).
    added: f64,
    groups: [usize; 2],
    /// Whether V(A ∪ B) is of a box quickly looked for; it may be smaller then.
    is_rough: bool,
}

/// Merges the two groups whose common box adds the least, V(A ∪ B) − V(A) − V(B), again and again.
///
/// Groups apart from all others are merged last.
pub(super) fn agglomerate(body: &Body, pieces: Vec<Group>) -> Merges {
    let n_pieces = pieces.len();
    let mut groups = pieces;
    let mut sides = Vec::new();
    let mut open: Vec<usize> = (0..n_pieces).collect();
    let measured = |groups: &[Group], [i, j]: [usize; 2], is_rough: bool| {
        let [a, b] = [&groups[i], &groups[j]];
        Pair {
            added: Group::joined_volume(body, a, b, is_rough) - a.fitted.volume() - b.fitted.volume(),
            groups: [i, j],
            is_rough,
        }
    };
    let near = |groups: &[Group], i: usize, j: usize| {
        let is_near = groups[i].touches(&groups[j], 0.1 * body.min_slab);
        is_near.then(|| measured(groups, [i, j], true))
    };
    let mut pairs: Vec<Pair> = Vec::new();
    for i in 0..n_pieces {
        pairs.extend((0..i).filter_map(|j| near(&groups, i, j)));
    }
    while open.len() > 1 {
        if pairs.is_empty() {
            let all = open.iter().flat_map(|&i| open.iter().map(move |&j| [i, j]));
            pairs.extend(
                all.filter(|[i, j]| i > j)
                    .map(|pair| measured(&groups, pair, true)),
            );
        }
        let least = (0..pairs.len()).reduce(|a, b| if pairs[b].added < pairs[a].added { b } else { a });
        let Some(least) = least else { break };
        let [i, j] = pairs[least].groups;
        if pairs[least].is_rough {
            pairs[least] = measured(&groups, [i, j], false);
            continue;
        }
        let merged = Group::joined(body, &groups[i], &groups[j]);
        pairs.retain(|pair| !pair.groups.iter().any(|k| [i, j].contains(k)));
        open.retain(|&k| k != i && k != j);
        groups.push(merged);
        sides.push([i, j]);
        let new = groups.len() - 1;
        pairs.extend(open.iter().filter_map(|&k| near(&groups, new, k)));
        open.push(new);
    }
    Merges {
        groups,
        sides,
        n_pieces,
    }
}
