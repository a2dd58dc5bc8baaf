//! Laws of the decomposition, for both of its methods.

mod shapes;

use nalgebra::{Isometry3, Point3, Rotation3, Vector3};
use prehend_geometry::{
    DecomposeMethod, DecomposeOptions, Decomposition, OrientedBox, TriMesh, decompose, decompose_points,
    minimum_volume_box, signed_volume, union_volume,
};
use proptest::prelude::*;
use shapes::{bottle, boxes, hammer, mug};

/// How far a triangle may stick out of the boxes, relative to the largest coordinate or extent: clipping, fitting and
/// this test each round a few times.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

const METHODS: [DecomposeMethod; 3] = [
    DecomposeMethod::FitAndSplit,
    DecomposeMethod::Refined { price: 0.02 },
    DecomposeMethod::Exactly { boxes: 5 },
];

fn with(method: DecomposeMethod) -> DecomposeOptions {
    DecomposeOptions {
        method,
        ..DecomposeOptions::default()
    }
}

/// The part of a convex polygon on one side of every face but the `skip`ped ones; the outer pieces go to `left`.
fn outside(polygon: Vec<Point3<f64>>, region: &OrientedBox, margin: f64, left: &mut Vec<Vec<Point3<f64>>>) {
    let mut inside = polygon;
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            let depth = |p: &Point3<f64>| region.half_extents()[axis] + margin - sign * region.local(p)[axis];
            let (mut kept, mut beyond) = (Vec::new(), Vec::new());
            for (i, p) in inside.iter().enumerate() {
                let q = &inside[(i + 1) % inside.len()];
                let (a, b) = (depth(p), depth(q));
                if a >= 0.0 {
                    kept.push(*p);
                }
                if a <= 0.0 {
                    beyond.push(*p);
                }
                if a * b < 0.0 {
                    let cut = p + (q - p) * (a / (a - b));
                    kept.push(cut);
                    beyond.push(cut);
                }
            }
            // Pieces that only touch have no area.
            if beyond.len() >= 3 && beyond.iter().any(|p| depth(p) < 0.0) {
                left.push(beyond);
            }
            if kept.len() < 3 {
                return;
            }
            inside = kept;
        }
    }
}

/// Asserts that nothing is left of any triangle when all boxes, grown by rounding, are taken away from it.
fn assert_covers(found: &Decomposition, mesh: &TriMesh) {
    let reach = mesh
        .vertices()
        .iter()
        .map(|p| p.coords.amax())
        .fold(0.0, f64::max);
    let margin = ROUNDING * (reach + found.root.extents().max());
    for (i, corners) in mesh.corners().enumerate() {
        let mut pieces = vec![corners.to_vec()];
        for region in &found.boxes {
            let mut left = Vec::new();
            for piece in pieces {
                outside(piece, region, margin, &mut left);
            }
            pieces = left;
        }
        // What grown boxes leave between them is thinner than what they were grown by.
        let width = |piece: &Vec<Point3<f64>>| {
            let area: f64 = piece
                .windows(2)
                .skip(1)
                .map(|w| (w[0] - piece[0]).cross(&(w[1] - piece[0])).norm() / 2.0)
                .sum();
            let longest = piece.iter().map(|p| (p - piece[0]).norm()).fold(0.0, f64::max);
            if longest > 0.0 { area / longest } else { 0.0 }
        };
        let worst = pieces.iter().map(width).fold(0.0, f64::max);
        assert!(
            worst <= margin,
            "triangle {i} sticks out: {worst:e} wide, {margin:e} allowed"
        );
    }
}

/// `solid` is the volume that the mesh encloses.
fn assert_sound(found: &Decomposition, mesh: &TriMesh, solid: f64, options: &DecomposeOptions) {
    assert_covers(found, mesh);
    assert!(union_volume(&found.boxes) >= solid * (1.0 - 1e-9));
    assert_eq!(found.leaves().count(), found.boxes.len());
    assert!(found.boxes.len() <= options.max_boxes);
    for node in &found.tree {
        for child in node.children.into_iter().flatten() {
            assert_eq!(
                found.tree[child].parent.map(|p| found.tree[p].children),
                Some(node.children)
            );
        }
    }
    if let DecomposeMethod::Refined { price } = options.method {
        assert_pays_its_price(found, price);
    }
    if options.method == DecomposeMethod::FitAndSplit {
        // Leaves in the order of the splits: the children of each took at least the gain off the total then.
        let mut splits: Vec<usize> = (0..found.tree.len())
            .filter(|&n| found.tree[n].children.is_some())
            .collect();
        splits.sort_by_key(|&n| found.tree[n].children);
        let mut total = found.root.volume();
        for node in splits {
            let halves: f64 = found.tree[node]
                .children
                .into_iter()
                .flatten()
                .map(|c| found.tree[c].region.volume())
                .sum();
            let new_total = total - found.tree[node].region.volume() + halves;
            assert!(
                new_total < total * options.gain,
                "a split that does not pay: {new_total} of {total}"
            );
            total = new_total;
        }
        let bound = 1.0 + found.cvex.ln() / (1.0 / options.gain).ln();
        assert!(found.boxes.len() as f64 <= bound + 1e-9);
    }
}

/// Every box of a refined decomposition takes its price off the union: so there are no more than 1 + 1 / price, and no
/// two of them are better replaced by the box around both. Boxes are chosen by boxes found quickly, hence the margin.
fn assert_pays_its_price(found: &Decomposition, price: f64) {
    const QUICK: f64 = 0.01;
    let root = found.root.volume();
    let n = found.boxes.len();
    let union = union_volume(&found.boxes) / root;
    assert!(
        n as f64 - 1.0 <= (1.0 + QUICK - union) / price,
        "{n} boxes: {union}"
    );
    let is_leaf = |node: usize| found.tree[node].children.is_none();
    let joins = found
        .tree
        .iter()
        .filter(|n| n.children.is_some_and(|c| c.into_iter().all(is_leaf)));
    for join in joins {
        let children = join.children.unwrap_or_default().map(|c| found.tree[c].region);
        let mut fewer: Vec<OrientedBox> = found
            .boxes
            .iter()
            .filter(|b| !children.contains(b))
            .copied()
            .collect();
        fewer.push(join.region);
        let merged = union_volume(&fewer) / root;
        assert!(
            union + price <= merged + QUICK,
            "two boxes that do not pay: {union} and {merged}"
        );
    }
}

#[test]
fn cvex_is_the_papers_unless_another_method_is_asked_for() {
    let mesh = mug();
    let plain = decompose(&mesh, &DecomposeOptions::default()).unwrap();
    assert_eq!(
        plain,
        decompose(&mesh, &with(DecomposeMethod::FitAndSplit)).unwrap()
    );
    let refined = decompose(&mesh, &with(DecomposeMethod::Refined { price: 0.02 })).unwrap();
    assert!(
        refined.cvex > 1.5 * plain.cvex,
        "{} and {}",
        refined.cvex,
        plain.cvex
    );
}

#[test]
fn known_bodies_are_covered_and_every_split_pays() {
    for mesh in [hammer(), mug(), bottle()] {
        for options in METHODS.map(with) {
            let found = decompose(&mesh, &options).unwrap();
            assert_sound(&found, &mesh, signed_volume(&mesh).abs(), &options);
        }
    }
}

#[test]
fn the_refined_boxes_of_a_hammer_are_its_two() {
    let found = decompose(&hammer(), &with(DecomposeMethod::Refined { price: 0.02 })).unwrap();
    assert_eq!(found.boxes.len(), 2);
    assert!((found.cvex - 1188.0 / 288.0).abs() < 0.01, "{}", found.cvex);
}

#[test]
fn as_many_boxes_as_asked_and_never_more_volume_for_more_of_them() {
    let mesh = mug();
    let mut last = f64::INFINITY;
    for boxes in [1, 2, 4, 9] {
        let found = decompose(&mesh, &with(DecomposeMethod::Exactly { boxes })).unwrap();
        assert_eq!(found.boxes.len(), boxes);
        let total: f64 = found.boxes.iter().map(OrientedBox::volume).sum();
        assert!(total < last, "{boxes} boxes: {total} after {last}");
        last = total;
    }
    let paper = decompose(&mesh, &DecomposeOptions::default()).unwrap();
    let refined = decompose(
        &mesh,
        &with(DecomposeMethod::Exactly {
            boxes: paper.boxes.len(),
        }),
    )
    .unwrap();
    assert!(
        refined.cvex >= paper.cvex * (1.0 - 1e-3),
        "{} {}",
        refined.cvex,
        paper.cvex
    );
}

#[test]
fn inner_nodes_have_the_smallest_box_around_what_their_leaves_hold() {
    let found = decompose(&mug(), &with(DecomposeMethod::Exactly { boxes: 6 })).unwrap();
    for node in found.tree.iter().filter(|n| n.children.is_some()) {
        // Each leaf box reaches out of its parent's by no more than its own slack, and the parent is no larger than a
        // box around the leaves' boxes.
        let corners: Vec<Point3<f64>> = node
            .children
            .into_iter()
            .flatten()
            .flat_map(|c| found.tree[c].region.corners())
            .collect();
        let around = minimum_volume_box(&corners).unwrap().volume();
        assert!(node.region.volume() <= around * (1.0 + 1e-6));
    }
}

#[test]
fn a_price_or_a_number_out_of_range_is_an_error() {
    for (method, message) in [
        (
            DecomposeMethod::Refined { price: 0.0 },
            "`price` is 0, expected a number above 0 and at most 1",
        ),
        (
            DecomposeMethod::Exactly { boxes: 0 },
            "`boxes` is 0, expected at least 1",
        ),
    ] {
        assert_eq!(
            decompose(&hammer(), &with(method)).unwrap_err().to_string(),
            message
        );
    }
}

/// A few overlapping blocks around the origin, and the volume of their union.
fn blocks() -> impl Strategy<Value = (TriMesh, f64)> {
    let block = (
        [-1.0..0.0, -1.0..0.0, -1.0..0.0],
        [0.05..1.0, 0.05..1.0, 0.05..1.0],
    );
    proptest::collection::vec(block, 1..4).prop_map(|blocks| {
        let solids: Vec<OrientedBox> = blocks
            .iter()
            .map(|(low, high)| (Vector3::from(*low), Vector3::from(*high)))
            .map(|(low, high)| {
                OrientedBox::new(((low + high) / 2.0).into(), Rotation3::identity(), high - low).unwrap()
            })
            .collect();
        (boxes(&blocks), union_volume(&solids))
    })
}

fn motion() -> impl Strategy<Value = Isometry3<f64>> {
    (
        [-2.0..2.0, -2.0..2.0, -2.0..2.0],
        [-3.0..3.0, -3.0..3.0, -3.0..3.0],
    )
        .prop_map(|(shift, turn)| Isometry3::new(Vector3::from(shift), Vector3::from(turn)))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_blocks_are_covered_and_every_split_pays((mesh, solid) in blocks(), motion in motion(), method in 0..3_usize) {
        let options = with(METHODS[method]);
        let moved = mesh.transformed(&motion);
        assert_sound(&decompose(&moved, &options).unwrap(), &moved, solid, &options);
    }

    #[test]
    fn any_cloud_is_covered_and_every_split_pays((mesh, _) in blocks(), motion in motion(), method in 0..3_usize) {
        let options = with(METHODS[method]);
        // Points 1/20 apart on the faces of the blocks.
        let points: Vec<Point3<f64>> = mesh
            .corners()
            .flat_map(|[a, b, c]| {
                let steps = (0..=20).flat_map(|i| (0..=20 - i).map(move |j| (f64::from(i) / 20.0, f64::from(j) / 20.0)));
                steps.map(move |(s, t)| motion * (a + (b - a) * s + (c - a) * t))
            })
            .collect();
        let found = decompose_points(&points, &options).unwrap();
        let corners = (0..points.len() as u32).map(|i| [i; 3]).collect();
        assert_sound(&found, &TriMesh::new(points, corners).unwrap(), 0.0, &options);
    }

    #[test]
    fn blocks_have_the_same_cvex_however_they_lie((mesh, _) in blocks(), motion in motion()) {
        let options = DecomposeOptions::default();
        let here = decompose(&mesh, &options).unwrap().cvex;
        let there = decompose(&mesh.transformed(&motion), &options).unwrap().cvex;
        prop_assert!((here / there - 1.0).abs() < 0.01, "{here} and {there}");
    }
}
