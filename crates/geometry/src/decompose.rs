//! An object as a few boxes.

mod body;
mod body_frame;
mod cut;
mod fit;
mod paper;
mod refined;
mod region;
mod simplify;
mod whole;

use nalgebra::Point3;
use serde::{Deserialize, Serialize, Serializer};

use crate::{BoxRecord, GeometryError, OrientedBox, TriMesh};
use body::Body;
use paper::fit_and_split;
use refined::refine;

/// How boxes are found.
///
/// The two methods beyond the paper first cut the body into more pieces than are wanted. Planes across and aslant the
/// axes of a piece's box are swept, and those of facets at concave edges tried; what they leave is measured by boxes in
/// sampled directions first and, for the best, by boxes fitted to both sides. Where no cut takes off much, the one is
/// taken whose sides lose most by the next. Pieces are then merged two by two, where V(A ∪ B) − V(A) − V(B) is least, and
/// neighbouring boxes are cut anew together, with the cut moved to its best place, for as long as that leaves less.
/// All this looks at no more than some 2,000 triangles, to which finer surfaces are simplified; the boxes are then fitted
/// to what the same planes leave of all triangles.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum DecomposeMethod {
    /// The paper's fit and split, see [`decompose`]: what `size`, `cvex` and the grasp hypotheses rest on.
    #[default]
    FitAndSplit,
    /// The boxes with the least union and price.
    ///
    /// ```text
    /// vol(B₁ ∪ … ∪ Bₙ) + price · n · vol(B₀)
    /// ```
    Refined {
        /// What a box costs, as a share of vol(B₀), above 0 and at most 1: a box counts that takes more than this off
        /// the union. 0.02 gives about as many boxes as a person sees parts.
        price: f64,
    },
    /// This many boxes, at least 1, with as little volume as was found; fewer where thinner slabs than
    /// [`DecomposeOptions::min_slab`] would be needed, or [`DecomposeOptions::max_boxes`] is smaller.
    Exactly {
        /// The number of boxes.
        boxes: usize,
    },
}

/// When to split a box, and how finely to look.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecomposeOptions {
    /// How the boxes are found.
    pub method: DecomposeMethod,
    /// Split while new total volume / old < `gain`; above 0 and at most 1. Smaller gives fewer boxes; each split
    /// takes at least the share 1 − `gain` off the total. The paper gives no value; 0.94 follows its authors' habit.
    pub gain: f64,
    /// No more boxes than this, at least 1. Reached only for a `gain` close to 1.
    pub max_boxes: usize,
    /// Cuts tried first along each axis: one between every two of this many cells, at least 2.
    pub n_cells: usize,
    /// Thinnest slab that a cut may take off, relative to the longest extent of the root box, in [0, 0.5). A part
    /// thinner than a finger (10 mm of a 0.3 m hammer) is no part.
    pub min_slab: f64,
    /// Smallest extent of any box, relative to the longest extent of the root box, above 0 and at most 1. Blades
    /// modelled without thickness get this one (1.5 mm at 0.3 m) instead of a volume of 0.
    pub min_extent: f64,
}

impl Default for DecomposeOptions {
    fn default() -> Self {
        Self {
            method: DecomposeMethod::FitAndSplit,
            gain: 0.94,
            max_boxes: 32,
            n_cells: 48,
            min_slab: 0.03,
            min_extent: 0.005,
        }
    }
}

impl DecomposeOptions {
    fn check(&self) -> Result<(), GeometryError> {
        let bad = |name, value, expected| {
            Err(GeometryError::BadOption {
                name,
                value,
                expected,
            })
        };
        if !(self.gain > 0.0 && self.gain <= 1.0) {
            return bad("gain", self.gain, "a number above 0 and at most 1");
        }
        match self.method {
            DecomposeMethod::Refined { price } if !(price > 0.0 && price <= 1.0) => {
                return bad("price", price, "a number above 0 and at most 1");
            }
            DecomposeMethod::Exactly { boxes: 0 } => return bad("boxes", 0.0, "at least 1"),
            _ => {}
        }
        if self.max_boxes == 0 {
            return bad("max_boxes", 0.0, "at least 1");
        }
        if self.n_cells < 2 {
            return bad("n_cells", self.n_cells as f64, "at least 2");
        }
        if !(self.min_slab >= 0.0 && self.min_slab < 0.5) {
            return bad("min_slab", self.min_slab, "a number of at least 0 and below 0.5");
        }
        if !(self.min_extent > 0.0 && self.min_extent <= 1.0) {
            return bad("min_extent", self.min_extent, "a number above 0 and at most 1");
        }
        Ok(())
    }
}

/// A body as boxes that together cover it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Decomposition {
    /// B₀, the smallest box around the whole; its extents are the paper's `size` (m).
    #[serde(serialize_with = "with_volume")]
    pub root: OrientedBox,
    /// B₁ … Bₙ, the leaves of `tree` in its order; neighbours may overlap a little.
    #[serde(serialize_with = "with_volumes")]
    pub boxes: Vec<OrientedBox>,
    /// vol(B₀) / Σ vol(Bᵢ), at least 1; the paper's "convexity", though it grows with non-convexity.
    pub cvex: f64,
    /// Every box that was split, and the leaves; the root first, children after their parent.
    pub tree: Vec<TreeNode>,
}

/// A box of the tree: split into two others, or a leaf.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TreeNode {
    /// The smallest box around this part.
    pub region: OrientedBox,
    /// Index of the node that was split; none for the root.
    pub parent: Option<usize>,
    /// Indices of the two nodes that it was split into; none for a leaf.
    pub children: Option<[usize; 2]>,
}

impl Decomposition {
    fn of_tree(tree: Vec<TreeNode>) -> Self {
        let root = tree[0].region;
        let leaves = tree.iter().filter(|n| n.children.is_none());
        let boxes: Vec<OrientedBox> = leaves.map(|n| n.region).collect();
        let total: f64 = boxes.iter().map(OrientedBox::volume).sum();
        Self {
            root,
            cvex: root.volume() / total,
            boxes,
            tree,
        }
    }

    /// The tree's leaves as indices of `tree`, in the order of `boxes`.
    pub fn leaves(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.tree.len()).filter(|&node| self.tree[node].children.is_none())
    }
}

fn with_volume<S: Serializer>(b: &OrientedBox, serializer: S) -> Result<S::Ok, S::Error> {
    BoxRecord::from(b).serialize(serializer)
}

fn with_volumes<S: Serializer>(boxes: &[OrientedBox], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(boxes.iter().map(BoxRecord::from))
}

/// Wraps a body in boxes by fit and split.
///
/// Starting from the smallest box around the whole, a box b is cut parallel to one of its faces, and the smallest
/// boxes C₁, C₂ are fitted to the two parts. The split counts if it shrinks the total volume enough:
///
/// ```text
/// Θ = (vol(C₁) + vol(C₂) + vol(rest)) / (vol(b) + vol(rest)) < gain,    rest: all other current boxes
/// ```
///
/// The box whose split has the least Θ goes first, and all are looked at again after it, since Θ falls as the rest
/// shrinks; so the result does not depend on the order in which boxes are visited. The tree has at most
/// 1 + ln(cvex) / ln(1/gain) leaves.
///
/// Cuts of a box are scored by the area that they free in one of the images of its content on its faces:
///
/// ```text
/// α = 1 − (H − H₁ − H₂) / A,    H, H₁, H₂: area of the convex hull of the image, and of its two parts; A: of the face
/// ```
///
/// All images and both of their axes are tried at [`DecomposeOptions::n_cells`] places, and the best one of
/// each is refined. Boxes are fitted at these (at most six) cuts, and the split that leaves the least volume
/// is meant: where the smallest box lies askew, as it does about a mug, the cut with the least α alone is a
/// matter of luck. H₁ and H₂ are computed from the triangles clipped at the cut: the limit of ever denser
/// samples of the surface, without their noise, so there is no seed.
///
/// Cuts are chosen in a frame that the body carries with it (principal axes of its surface), with coordinates rounded
/// to 1e-9 of its size and boxes found quickly; whether a split counts is decided by the smallest boxes around the
/// triangles where they lie. So cvex does not depend on how the body is turned, but for what
/// [`minimum_volume_box`](crate::minimum_volume_box) misses in one pose and finds in another.
///
/// Together the boxes cover the surface exactly and, where it is closed, the inside: they hold the clipped triangles,
/// and the points inside where three cuts meet. The cavity of a vessel counts as object, since the rim of each cut
/// belongs to both of its sides.
/// Meshes may have holes, loose parts and either winding.
///
/// # Errors
///
/// [`GeometryError::BadOption`] for an option outside its range, [`GeometryError::BadExtents`] where all vertices
/// coincide or are too far apart for the volume of their box to be finite.
///
/// # Source
///
/// Paper, section III-A; Huebner, Ruthotto, Kragic, "Minimum Volume Bounding Box Decomposition for Shape
/// Approximation in Robot Grasping" (ICRA 2008). The paper is silent on the score of cuts and on the order of splits.
///
/// # Examples
///
/// ```
/// use nalgebra::Point3;
/// use prehend_geometry::{DecomposeOptions, OrientedBox, TriMesh, decompose};
///
/// // A tetrahedron fills a third of its box, but no plane cuts a dent out of it.
/// let corners = [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]].map(Point3::from);
/// let mesh = TriMesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]])?;
/// let decomposition = decompose(&mesh, &DecomposeOptions::default())?;
/// assert_eq!((decomposition.boxes.len(), decomposition.cvex), (1, 1.0));
/// # Ok::<(), prehend_geometry::GeometryError>(())
/// ```
pub fn decompose(mesh: &TriMesh, options: &DecomposeOptions) -> Result<Decomposition, GeometryError> {
    options.check()?;
    boxes_of(&Body::of_mesh(mesh, options)?, options)
}

/// Wraps points without a surface in boxes: [`decompose`] for a cloud.
///
/// All is as there, with images and boxes of points in the place of images and boxes of triangles. The boxes together
/// hold every point, and nothing is known of what lies between points: a cut may pass through any gap (so points must be
/// close beside the body's thickness), and a scan of one
/// side of a body is the thin shell that it is. A cut leaves at least 20 points on either side, so few stray points
/// get no boxes of their own but stretch those of others: filter a scan first. The more points, the closer the boxes come
/// to those of the surface they lie on; duplicates change nothing but this count.
///
/// # Errors
///
/// As [`decompose`]; [`GeometryError::Empty`] for no points, [`GeometryError::NotFinite`] for a coordinate that is NaN or
/// infinite.
///
/// # Examples
///
/// ```
/// use nalgebra::Point3;
/// use prehend_geometry::{DecomposeOptions, decompose_points};
///
/// // Two bars that form an L, 40 mm wide and 160 mm long, as points 2.5 mm apart.
/// let bar = |i: i32, j: i32| Point3::new(f64::from(i), f64::from(j), 0.0) / 400.0;
/// let points: Vec<Point3<f64>> = (0..=64)
///     .flat_map(|i| (0..=16).flat_map(move |j| [bar(i, j), bar(j, i)]))
///     .collect();
/// let found = decompose_points(&points, &DecomposeOptions::default())?;
/// assert_eq!(found.boxes.len(), 2);
/// assert!(points.iter().all(|p| found.boxes.iter().any(|b| b.contains(p, 1e-12))));
/// # Ok::<(), prehend_geometry::GeometryError>(())
/// ```
pub fn decompose_points(
    points: &[Point3<f64>],
    options: &DecomposeOptions,
) -> Result<Decomposition, GeometryError> {
    options.check()?;
    boxes_of(&Body::of_points(points, options)?, options)
}

fn boxes_of(body: &Body, options: &DecomposeOptions) -> Result<Decomposition, GeometryError> {
    match options.method {
        DecomposeMethod::FitAndSplit => fit_and_split(body, options),
        DecomposeMethod::Refined { .. } | DecomposeMethod::Exactly { .. } => refine(body, options),
    }
}
