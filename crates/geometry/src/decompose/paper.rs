//! Fit and split, greedily: the paper's way.

use super::body::{Body, Part};
use super::cut::promising_cuts;
use super::fit::Cloud;
use super::region::{Plane, Region};
use super::{DecomposeOptions, Decomposition, TreeNode};
use crate::{GeometryError, OrientedBox};

/// Cuts whose halves are boxed with care, of those that look best with boxes about the axes of the whole.
const N_CAREFUL: usize = 3;

/// Rounds in which the place of a cut is found more closely.
const N_ROUNDS: usize = 2;

/// Smallest boxes are fitted to a split whose quickly found ones miss the gain by less than this.
const QUICK_ERROR: f64 = 0.02;

/// See [`super::decompose`].
pub(super) fn fit_and_split(body: &Body, options: &DecomposeOptions) -> Result<Decomposition, GeometryError> {
    let mut tree = vec![TreeNode {
        region: body.root,
        parent: None,
        children: None,
    }];
    let mut total = body.root.volume();
    let mut leaves = vec![Leaf::new(body, options, 0, body.whole(), body.quick_root)];
    while leaves.len() < options.max_boxes {
        let Some(best) = next_split(body, options, &tree, &mut leaves, total)? else {
            break;
        };
        let leaf = leaves.swap_remove(best);
        let Some(Candidate {
            plane,
            mut quick,
            fitted: Some(mut fitted),
            ..
        }) = leaf.split
        else {
            break;
        };
        if body.points_down(&plane) {
            // The order of the boxes follows the frame of the mesh.
            fitted.parts.reverse();
            fitted.boxes.reverse();
            quick.reverse();
        }
        tree[leaf.node].children = Some([tree.len(), tree.len() + 1]);
        for ((part, region), quick) in fitted.parts.into_iter().zip(fitted.boxes).zip(quick) {
            leaves.push(Leaf::new(body, options, tree.len(), part, quick));
            tree.push(TreeNode {
                region,
                parent: Some(leaf.node),
                children: None,
            });
        }
        total = leaves.iter().map(|leaf| tree[leaf.node].region.volume()).sum();
    }
    Ok(Decomposition::of_tree(tree))
}

/// A box that is not split yet, and how it would be.
struct Leaf {
    node: usize,
    part: Part,
    split: Option<Candidate>,
}

/// A cut, and the boxes on its sides.
struct Candidate {
    plane: Plane,
    /// Quickly found boxes in the body's own frame.
    quick: [OrientedBox; 2],
    fitted: Option<Fitted>,
    /// The volume that it takes off (m³); an estimate until boxes are fitted.
    saved: f64,
}

/// The smallest boxes on the sides of a cut.
struct Fitted {
    parts: [Part; 2],
    boxes: [OrientedBox; 2],
}

/// The leaf whose split takes off the most, if that pays; its boxes are fitted.
fn next_split(
    body: &Body,
    options: &DecomposeOptions,
    tree: &[TreeNode],
    leaves: &mut [Leaf],
    total: f64,
) -> Result<Option<usize>, GeometryError> {
    loop {
        let mut order: Vec<(f64, usize, usize)> = (0..leaves.len())
            .filter_map(|i| Some((leaves[i].split.as_ref()?.saved, leaves[i].node, i)))
            .collect();
        order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut has_fitted = false;
        for (saved, _, i) in order {
            let theta = (total - saved) / total;
            let leaf = &mut leaves[i];
            let Some(split) = &mut leaf.split else { continue };
            if split.fitted.is_some() {
                if theta < options.gain {
                    return Ok(Some(i));
                }
            } else if theta < options.gain + QUICK_ERROR {
                let region = tree[leaf.node].region;
                let parts = body.cut(&leaf.part, &split.plane);
                if parts.iter().any(|p| p.real.is_empty() || p.thought.is_empty()) {
                    leaf.split = None;
                } else {
                    let fit = |side: usize| body.fit(&[&parts[side].real], &[&split.quick[side]]);
                    let boxes = [fit(0)?, fit(1)?];
                    split.saved = region.volume() - boxes[0].volume() - boxes[1].volume();
                    split.fitted = Some(Fitted { parts, boxes });
                }
                has_fitted = true;
                break;
            }
        }
        if !has_fitted {
            return Ok(None);
        }
    }
}

impl Leaf {
    fn new(body: &Body, options: &DecomposeOptions, node: usize, part: Part, quick: OrientedBox) -> Self {
        let split = best_cut(body, options, &part.thought, &quick);
        Self { node, part, split }
    }
}

/// The cut that leaves the least volume, of the promising ones; none where no cut frees anything.
fn best_cut(
    body: &Body,
    options: &DecomposeOptions,
    region: &Region,
    fitted: &OrientedBox,
) -> Option<Candidate> {
    let axes = [0, 1, 2].map(|k| fitted.axis(k));
    let mut tried: Vec<(f64, Plane, [Cloud; 2])> = Vec::new();
    for cut in promising_cuts(region, fitted, options.n_cells, body.min_slab, N_ROUNDS) {
        let plane = Plane {
            normal: axes[cut.axis],
            origin: fitted.center() + axes[cut.axis] * cut.position,
        };
        let sides = region.points_beside(&plane);
        if sides.iter().any(|side| side.len() < body.min_points) {
            continue;
        }
        let clouds = sides.map(Cloud::new);
        let volume = clouds
            .iter()
            .map(|c| c.rough_volume(&axes, body.min_extent))
            .sum();
        tried.push((volume, plane, clouds));
    }
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best: Option<(f64, Plane, [OrientedBox; 2])> = None;
    for (_, plane, clouds) in tried.iter().take(N_CAREFUL) {
        let boxes = clouds.each_ref().map(|c| c.fit(&axes, body.min_extent));
        let volume = boxes[0].volume() + boxes[1].volume();
        if best
            .as_ref()
            .is_none_or(|(least, ..)| volume < least * (1.0 - 1e-6))
        {
            best = Some((volume, *plane, boxes));
        }
    }
    best.map(|(volume, plane, quick)| Candidate {
        plane,
        quick,
        fitted: None,
        saved: (fitted.volume() - volume) * body.real_volume(),
    })
}
