//! What must hold for every bundled object, measured on its triangles. For the generator's tests.

use super::all;
use super::model::{Model, PartBox};
use super::shell::Shell;
use nalgebra::{Point3, Vector3};
use std::collections::{BTreeMap, BTreeSet};

/// Binary tree of bounding boxes over triangles.
struct Tree<'a> {
    shell: &'a Shell,
    order: Vec<usize>,
    nodes: Vec<Node>,
}

struct Node {
    low: Point3<f64>,
    high: Point3<f64>,
    range: std::ops::Range<usize>,
    children: Option<[usize; 2]>,
}

impl<'a> Tree<'a> {
    fn new(shell: &'a Shell) -> Self {
        let mut tree = Self {
            shell,
            order: (0..shell.triangles.len()).collect(),
            nodes: Vec::new(),
        };
        tree.split(0..shell.triangles.len());
        tree
    }

    fn split(&mut self, range: std::ops::Range<usize>) -> usize {
        let (mut low, mut high) = (Point3::from([f64::MAX; 3]), Point3::from([f64::MIN; 3]));
        for &triangle in &self.order[range.clone()] {
            for corner in corners(self.shell, triangle) {
                low = low.inf(&corner);
                high = high.sup(&corner);
            }
        }
        let idx = self.nodes.len();
        self.nodes.push(Node {
            low,
            high,
            range: range.clone(),
            children: None,
        });
        if range.len() > 4 {
            let axis = (high - low).imax();
            let shell = self.shell;
            let middle = |t: usize| corners(shell, t).iter().map(|c| c[axis]).sum::<f64>();
            self.order[range.clone()].sort_by(|&a, &b| middle(a).total_cmp(&middle(b)));
            let half = range.start + range.len() / 2;
            let children = [self.split(range.start..half), self.split(half..range.end)];
            self.nodes[idx].children = Some(children);
        }
        idx
    }

    /// Calls `visit` with every triangle in a leaf whose box `meets`.
    fn visit(&self, meets: &dyn Fn(&Point3<f64>, &Point3<f64>) -> bool, visit: &mut dyn FnMut(usize)) {
        let mut stack = vec![0];
        while let Some(idx) = stack.pop() {
            let node = &self.nodes[idx];
            if !meets(&node.low, &node.high) {
                continue;
            }
            match node.children {
                Some(children) => stack.extend(children),
                None => self.order[node.range.clone()]
                    .iter()
                    .for_each(|&triangle| visit(triangle)),
            }
        }
    }

    /// Distances along the ray at which it crosses triangles, unsorted.
    fn crossings(&self, origin: &Point3<f64>, direction: &Vector3<f64>) -> Vec<f64> {
        let mut found = Vec::new();
        let meets = |low: &Point3<f64>, high: &Point3<f64>| {
            let (mut enter, mut leave) = (0.0_f64, f64::MAX);
            for k in 0..3 {
                let (a, b) = (
                    (low[k] - origin[k]) / direction[k],
                    (high[k] - origin[k]) / direction[k],
                );
                if a.is_nan() || b.is_nan() {
                    continue;
                }
                enter = enter.max(a.min(b));
                leave = leave.min(a.max(b));
            }
            enter <= leave + 1e-9
        };
        self.visit(&meets, &mut |triangle| {
            if let Some(at) = ray_meets(&corners(self.shell, triangle), origin, direction) {
                found.push(at);
            }
        });
        found
    }
}

fn corners(shell: &Shell, triangle: usize) -> [Point3<f64>; 3] {
    shell.triangles[triangle].map(|idx| shell.points[idx])
}

/// Distance along the ray to the triangle, where it lies ahead.
fn ray_meets([a, b, c]: &[Point3<f64>; 3], origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<f64> {
    let (ab, ac) = (b - a, c - a);
    let across = direction.cross(&ac);
    let det = ab.dot(&across);
    if det.abs() < 1e-18 {
        return None;
    }
    let from = origin - a;
    let u = from.dot(&across) / det;
    let q = from.cross(&ab);
    let v = direction.dot(&q) / det;
    let at = ac.dot(&q) / det;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && at > 0.0).then_some(at)
}

/// Whether the open segment from `a` to `b` passes through the triangle.
fn segment_meets(triangle: &[Point3<f64>; 3], a: &Point3<f64>, b: &Point3<f64>) -> bool {
    ray_meets(triangle, a, &(b - a)).is_some_and(|at| at < 1.0)
}

/// Directed edges of the surface, with how often each occurs.
fn edges(shell: &Shell) -> BTreeMap<(usize, usize), usize> {
    let mut edges = BTreeMap::new();
    for &[a, b, c] in &shell.triangles {
        for edge in [(a, b), (b, c), (c, a)] {
            *edges.entry(edge).or_insert(0) += 1;
        }
    }
    edges
}

/// Vertices whose triangles do not form one closed fan.
fn pinched_vertices(shell: &Shell) -> usize {
    let mut around: Vec<BTreeMap<usize, usize>> = vec![BTreeMap::new(); shell.points.len()];
    for &[a, b, c] in &shell.triangles {
        around[a].insert(b, c);
        around[b].insert(c, a);
        around[c].insert(a, b);
    }
    around
        .iter()
        .filter(|next| {
            let Some((&start, _)) = next.iter().next() else {
                return true;
            };
            let (mut at, mut steps) = (start, 0);
            while let Some(&after) = next.get(&at) {
                (at, steps) = (after, steps + 1);
                if at == start || steps > next.len() {
                    break;
                }
            }
            at != start || steps != next.len()
        })
        .count()
}

/// Pairs of triangles that pass through each other, or lie folded onto a neighbour.
fn self_intersections(shell: &Shell, tree: &Tree) -> Vec<(usize, usize)> {
    let mut found = BTreeSet::new();
    for first in 0..shell.triangles.len() {
        let own = corners(shell, first);
        let low = own[0].inf(&own[1]).inf(&own[2]);
        let high = own[0].sup(&own[1]).sup(&own[2]);
        let meets = |l: &Point3<f64>, h: &Point3<f64>| (0..3).all(|k| l[k] <= high[k] && low[k] <= h[k]);
        tree.visit(&meets, &mut |second| {
            if second > first && pierce(shell, first, second) {
                found.insert((first, second));
            }
        });
    }
    found.into_iter().collect()
}

/// Whether an edge of one triangle that shares no vertex with the other passes through it; for neighbours across an
/// edge, whether they lie folded onto each other.
fn pierce(shell: &Shell, first: usize, second: usize) -> bool {
    let shared: Vec<usize> = shell.triangles[first]
        .into_iter()
        .filter(|idx| shell.triangles[second].contains(idx))
        .collect();
    if shared.len() == 2 {
        let normal = |t: usize| {
            let [a, b, c] = corners(shell, t);
            (b - a).cross(&(c - a)).normalize()
        };
        return normal(first).dot(&normal(second)) < -0.999_99;
    }
    [(first, second), (second, first)]
        .into_iter()
        .any(|(from, into)| {
            let [a, b, c] = shell.triangles[from];
            let target = corners(shell, into);
            [(a, b), (b, c), (c, a)]
                .into_iter()
                .filter(|(i, j)| !shared.contains(i) && !shared.contains(j))
                .any(|(i, j)| segment_meets(&target, &shell.points[i], &shell.points[j]))
        })
}

/// Smallest distance from the middle of a triangle along its inward normal to the surface beyond, and where.
fn least_thickness(shell: &Shell, tree: &Tree) -> (f64, Point3<f64>) {
    let thickness = |triangle| {
        let [a, b, c] = corners(shell, triangle);
        let inward = -(b - a).cross(&(c - a)).normalize();
        let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
        let start = middle + 1e-7 * inward;
        (
            tree.crossings(&start, &inward)
                .into_iter()
                .fold(f64::MAX, f64::min),
            middle,
        )
    };
    (0..shell.triangles.len())
        .map(thickness)
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .expect("a surface has triangles")
}

fn extents(model: &Model) -> [f64; 3] {
    PartBox::around(&model.shell.points, 0.0).extents
}

fn each(mut check: impl FnMut(&Model)) {
    for model in all() {
        check(&model);
    }
}

#[test]
fn twenty_five_objects_of_six_types_at_least_four_of_each() {
    let mut counts = BTreeMap::new();
    for model in all() {
        *counts.entry(model.kind).or_insert(0) += 1;
    }
    assert_eq!(counts.values().sum::<i32>(), 25);
    assert_eq!(counts.len(), 6);
    assert!(counts.values().all(|&n| n >= 4), "{counts:?}");
}

#[test]
fn every_object_is_closed_manifold_and_outward() {
    each(|model| {
        let (name, shell) = (model.name, &model.shell);
        assert!(
            (2000..=20000).contains(&shell.triangles.len()),
            "{name}: {} triangles",
            shell.triangles.len()
        );
        let edges = edges(shell);
        for (&(a, b), &n) in &edges {
            assert!(
                n == 1 && edges.get(&(b, a)) == Some(&1),
                "{name}: edge {a}–{b} occurs {n} times"
            );
        }
        assert_eq!(
            pinched_vertices(shell),
            0,
            "{name}: vertices where two sheets touch"
        );
        let volume: f64 = (0..shell.triangles.len())
            .map(|t| {
                let [a, b, c] = corners(shell, t);
                a.coords.dot(&b.coords.cross(&c.coords)) / 6.0
            })
            .sum();
        assert!(volume > 0.0, "{name}: volume {volume}");
        let distinct: BTreeSet<[u32; 3]> = shell
            .points
            .iter()
            .map(|p| [0, 1, 2].map(|k| (p[k] as f32).to_bits()))
            .collect();
        assert_eq!(
            distinct.len(),
            shell.points.len(),
            "{name}: two vertices at one place"
        );
    });
}

#[test]
fn no_object_passes_through_itself() {
    each(|model| {
        let tree = Tree::new(&model.shell);
        let found = self_intersections(&model.shell, &tree);
        let first = found
            .first()
            .map(|&(t, u)| [corners(&model.shell, t), corners(&model.shell, u)]);
        assert!(
            found.is_empty(),
            "{}: {} pairs of triangles, first {first:?}",
            model.name,
            found.len()
        );
    });
}

#[test]
fn walls_and_blades_are_as_thick_as_drawn() {
    let mut thin = Vec::new();
    each(|model| {
        let (found, at) = least_thickness(&model.shell, &Tree::new(&model.shell));
        let most = if model.opening.is_some() { 6e-3 } else { f64::MAX };
        if !(model.least_thickness..most).contains(&found) {
            let drawn = model.least_thickness * 1e3;
            thin.push(format!(
                "{}: {:.2} mm at {at:.3}, drawn {drawn:.2} mm",
                model.name,
                found * 1e3
            ));
        }
    });
    assert!(thin.is_empty(), "{}", thin.join("\n"));
}

#[test]
fn vessels_are_open_down_to_the_floor() {
    each(|model| {
        let Some(opening) = model.opening else { return };
        let tree = Tree::new(&model.shell);
        let height = extents(model)[2];
        assert!(
            (opening.z - height).abs() < 1e-6,
            "{}: the rim is the top",
            model.name
        );
        let above = Point3::new(0.3e-3, 0.2e-3, opening.z + 0.01);
        let mut down = tree.crossings(&above, &-Vector3::z());
        down.sort_by(f64::total_cmp);
        assert!(
            down.len() >= 2 && down.len().is_multiple_of(2),
            "{}: {down:?}",
            model.name
        );
        let depth = down[0] - 0.01;
        assert!(depth > 0.35 * height, "{}: {depth} m deep", model.name);
        for k in 0..12 {
            let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 12.0 + 0.01).sin_cos();
            let inside = Point3::new(
                0.95 * opening.radius * cos,
                0.95 * opening.radius * sin,
                opening.z + 0.01,
            );
            let first = tree
                .crossings(&inside, &-Vector3::z())
                .into_iter()
                .fold(f64::MAX, f64::min);
            assert!(first > 0.012, "{}: the rim reaches into its opening", model.name);
        }
    });
}

#[test]
fn sizes_and_masses_are_those_of_real_things() {
    each(|model| {
        let [x, y, z] = extents(model);
        let range = |value: f64, low: f64, high: f64, what: &str| {
            assert!((low..=high).contains(&value), "{}: {what} {value}", model.name);
        };
        let (height, width, mass) = match model.kind {
            "bottle" => ([0.15, 0.35], [0.05, 0.17], [0.05, 1.0]),
            "glass" => ([0.05, 0.25], [0.04, 0.13], [0.05, 0.5]),
            "mug" => ([0.05, 0.20], [0.08, 0.16], [0.1, 1.2]),
            "knife" => ([0.15, 0.40], [0.015, 0.10], [0.02, 0.5]),
            "hammer" => ([0.20, 0.45], [0.08, 0.20], [0.25, 1.8]),
            "screwdriver" => ([0.08, 0.35], [0.01, 0.05], [0.01, 0.3]),
            other => panic!("{}: unknown type {other}", model.name),
        };
        range(z, height[0], height[1], "height");
        range(x.max(y), width[0], width[1], "width");
        range(model.mass, mass[0], mass[1], "mass");
        let base = model.shell.points.iter().map(|p| p.z).fold(f64::MAX, f64::min);
        assert!(base.abs() < 1e-6, "{}: stands at z = {base}", model.name);
    });
}

#[test]
fn no_two_objects_have_one_size() {
    let models = all();
    for (i, first) in models.iter().enumerate() {
        for second in &models[..i] {
            let (a, b) = (extents(first), extents(second));
            assert!(
                (0..3).any(|k| (a[k] - b[k]).abs() > 3e-3),
                "{} and {}",
                first.name,
                second.name
            );
        }
    }
}

#[test]
fn parts_hold_surface_and_handles_are_not_what_they_are_for() {
    each(|model| {
        let count = |boxes: &[PartBox]| {
            model
                .shell
                .points
                .iter()
                .filter(|point| boxes.iter().any(|part| part.contains(point)))
                .count()
        };
        for (part, boxes) in [
            ("handle", &model.handle),
            ("functional", &model.functional),
            ("sharp", &model.sharp),
        ] {
            for part_box in boxes {
                assert!(count(&[*part_box]) > 3, "{}: an empty box of {part}", model.name);
            }
        }
        assert!(!model.functional.is_empty(), "{}: no functional part", model.name);
        let tool = ["knife", "hammer", "screwdriver"].contains(&model.kind);
        assert_eq!(
            tool || model.kind == "mug",
            !model.handle.is_empty() && model.kind != "bottle",
            "{}",
            model.name
        );
        assert_eq!(model.kind == "knife", !model.sharp.is_empty(), "{}", model.name);
        if tool {
            let both = model.shell.points.iter().filter(|point| {
                model.handle.iter().any(|b| b.contains(point))
                    && model.functional.iter().any(|b| b.contains(point))
            });
            assert!(
                both.count() * 20 < model.shell.points.len(),
                "{}: handle and head share surface",
                model.name
            );
        }
    });
}

#[test]
fn an_edge_through_a_triangle_is_found() {
    let mut shell = Shell::new(super::shell::Part::Body);
    for [x, y, z] in [
        [0., 0., 0.],
        [1., 0., 0.],
        [0., 1., 0.],
        [0.2, 0.2, -1.],
        [0.3, 0.2, 1.],
        [0.2, 5.0, 1.],
    ] {
        shell.point(Point3::new(x, y, z));
    }
    shell.triangles = vec![[0, 1, 2], [3, 4, 5]];
    assert_eq!(self_intersections(&shell, &Tree::new(&shell)), [(0, 1)]);
    shell.points[3].z = 0.5;
    assert!(self_intersections(&shell, &Tree::new(&shell)).is_empty());
}
