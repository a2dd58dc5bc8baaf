//! Beyond fit and split: cut finely, merge what costs least, move the cuts.

mod candidates;
mod groups;
mod pieces;
mod widths;

use super::body::Body;
use super::{DecomposeMethod, DecomposeOptions, Decomposition, TreeNode};
use crate::{GeometryError, OrientedBox, union_volume};
use candidates::Candidates;
use groups::{Group, Merges, agglomerate};
use pieces::cut_finely;

/// Pieces that a body is cut into before they are merged, where the number of boxes is to be found.
const N_PIECES: usize = 24;

/// See [`super::DecomposeMethod`].
pub(super) fn refine(body: &Body, options: &DecomposeOptions) -> Result<Decomposition, GeometryError> {
    let candidates = Candidates::new(body, options.n_cells);
    let most = options.max_boxes;
    let (n_pieces, wanted, price) = match options.method {
        DecomposeMethod::Exactly { boxes: 1 } => (1, Some(1), 0.0),
        DecomposeMethod::Exactly { boxes } => (2 * boxes + 6, Some(boxes.min(most)), 0.0),
        DecomposeMethod::Refined { price } => (N_PIECES, None, price * body.quick_root.volume()),
        DecomposeMethod::FitAndSplit => (most, Some(most), 0.0),
    };
    let pieces = cut_finely(body, &candidates, n_pieces);
    let merges = agglomerate(body, pieces);
    let n_boxes = wanted.unwrap_or_else(|| best_count(&merges, most, price));
    let mut groups = merges.groups(n_boxes);
    candidates.improve(body, &mut groups);
    if wanted.is_none() {
        groups = worth_their_price(body, groups, price);
    }
    let mut tree = in_a_tree(body, groups)?;
    if let DecomposeMethod::Refined { price } = options.method {
        undo_poor_splits(&mut tree, price);
    }
    Ok(Decomposition::of_tree(tree))
}

/// The number of boxes with the least union and price; the smaller of equals.
fn best_count(merges: &Merges, most: usize, price: f64) -> usize {
    let mut best = (1, f64::INFINITY);
    for n in 1..=most.min(merges.n_pieces()) {
        let boxes: Vec<OrientedBox> = merges.groups(n).iter().map(|g| g.fitted).collect();
        let cost = union_volume(&boxes) + price * n as f64;
        if cost < best.1 * (1.0 - 1e-9) {
            best = (n, cost);
        }
    }
    best.0
}

/// Merges groups for as long as that makes union and price smaller.
fn worth_their_price(body: &Body, groups: Vec<Group>, price: f64) -> Vec<Group> {
    let merges = agglomerate(body, groups);
    let n = best_count(&merges, merges.n_pieces(), price);
    merges.groups(n)
}

/// The groups as leaves of a tree whose inner nodes are what merging them costs least; boxes fitted where they lie.
fn in_a_tree(body: &Body, groups: Vec<Group>) -> Result<Vec<TreeNode>, GeometryError> {
    let merges = agglomerate(body, groups);
    let mut tree = vec![TreeNode {
        region: body.root,
        parent: None,
        children: None,
    }];
    let mut open = vec![(0, merges.root())];
    while let Some((node, merged)) = open.pop() {
        let Some(mut sides) = merges.sides(merged) else {
            continue;
        };
        let first = tree.len();
        let mut regions = Vec::with_capacity(2);
        for side in sides {
            let group = merges.group(side);
            regions.push(body.fit(&group.real_regions(), &[&group.fitted])?);
        }
        // The order of the boxes follows the frame of the mesh.
        let apart = regions[1].center() - regions[0].center();
        if apart[apart.iamax()] < 0.0 {
            regions.reverse();
            sides.reverse();
        }
        tree[node].children = Some([first, first + 1]);
        for (region, side) in regions.into_iter().zip(sides) {
            open.push((tree.len(), side));
            tree.push(TreeNode {
                region,
                parent: Some(node),
                children: None,
            });
        }
    }
    Ok(tree)
}

/// Takes two leaves back into the node above them for as long as that makes union and price smaller: other boxes may
/// cover what the split left out, which merging groups one by one does not see. `price` is a share of the root.
fn undo_poor_splits(tree: &mut Vec<TreeNode>, price: f64) {
    let price = price * tree[0].region.volume();
    loop {
        let is_leaf = |node: usize| tree[node].children.is_none();
        let leaves: Vec<usize> = (0..tree.len()).filter(|&node| is_leaf(node)).collect();
        let union_without = |left_out: &[usize], added: Option<usize>| {
            let kept = leaves.iter().filter(|node| !left_out.contains(node));
            union_volume(
                &kept
                    .chain(&added)
                    .map(|&node| tree[node].region)
                    .collect::<Vec<_>>(),
            )
        };
        let joins = (0..tree.len()).filter_map(|node| Some((node, tree[node].children?)));
        let cheapest = joins
            .filter(|(_, children)| children.iter().all(|&child| is_leaf(child)))
            .map(|(node, children)| (union_without(&children, Some(node)), node))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let whole = union_without(&[], None);
        let Some((_, node)) = cheapest.filter(|(union, _)| *union < whole + price) else {
            return;
        };
        let Some([first, second]) = tree[node].children.take() else {
            return;
        };
        tree.drain(first..=second);
        let moved = |place: usize| if place > second { place - 2 } else { place };
        for node in tree.iter_mut() {
            node.parent = node.parent.map(moved);
            node.children = node.children.map(|children| children.map(moved));
        }
    }
}
