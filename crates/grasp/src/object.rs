//! An object made ready for grasping.

use nalgebra::Point3;
use prehend_geometry::{Decomposition, OrientedBox, Surface, TriMesh, surface_centroid, union_volume};
use prehend_quality::{Material, QualityOptions};

use crate::{GraspError, object_size};

/// An object made ready for grasping: its surface, its boxes, and the point that torques are taken about.
#[derive(Debug, Clone)]
pub struct GraspObject {
    surface: Surface,
    regions: Vec<Region>,
    leaves: Vec<OrientedBox>,
    root: OrientedBox,
    size: [f64; 3],
    cvex: f64,
    box_volumes: (f64, f64),
    wrench_center: Point3<f64>,
    torque_scale: f64,
    material: Material,
}

/// A box that grasp hypotheses come from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// The box.
    pub oriented_box: OrientedBox,
    /// The leaf boxes that make it up, as bits over [`GraspObject::leaves`]: they do not block its faces.
    pub(crate) own_leaves: u128,
}

impl Region {
    /// Whether leaf box `leaf_idx` is a part of it.
    pub(crate) fn owns(&self, leaf_idx: usize) -> bool {
        leaf_idx < 128 && self.own_leaves >> leaf_idx & 1 == 1
    }
}

impl GraspObject {
    /// An object from its mesh and decomposition; both in the object's frame, metres.
    ///
    /// Torques are taken about `wrench_center` (the centre of mass); without one, about the centroid of the surface.
    ///
    /// # Errors
    ///
    /// As [`GraspObject::from_boxes`].
    pub fn new(
        mesh: TriMesh,
        decomposition: &Decomposition,
        wrench_center: Option<Point3<f64>>,
        material: Material,
    ) -> Result<Self, GraspError> {
        let tree = &decomposition.tree;
        let leaf_nodes: Vec<usize> = decomposition.leaves().collect();
        let mut inner = Vec::new();
        for (idx, node) in tree.iter().enumerate() {
            if node.children.is_some() {
                let is_below =
                    |leaf: usize| std::iter::successors(Some(leaf), |n| tree[*n].parent).any(|n| n == idx);
                let own = (0..leaf_nodes.len())
                    .filter(|i| is_below(leaf_nodes[*i]))
                    .collect();
                inner.push((node.region, own));
            }
        }
        Self::from_boxes(
            mesh,
            decomposition.root,
            decomposition.boxes.clone(),
            &inner,
            wrench_center,
            material,
        )
    }

    /// An object from its mesh and boxes; all in the object's frame, metres.
    ///
    /// `leaves` are the boxes of the decomposition, `inner` the boxes around several of them (the root and other nodes
    /// of the tree), each with the indices of its leaves. Torques are taken about `wrench_center` (the centre of mass);
    /// without one, about the centroid of the surface, as `GraspIt`! does.
    ///
    /// # Errors
    ///
    /// [`GraspError::NoBoxes`] without leaves, [`GraspError::NoExtent`] where all vertices lie in one point.
    pub fn from_boxes(
        mesh: TriMesh,
        root: OrientedBox,
        leaves: Vec<OrientedBox>,
        inner: &[(OrientedBox, Vec<usize>)],
        wrench_center: Option<Point3<f64>>,
        material: Material,
    ) -> Result<Self, GraspError> {
        if leaves.is_empty() {
            return Err(GraspError::NoBoxes);
        }
        let wrench_center = wrench_center.unwrap_or_else(|| surface_centroid(&mesh));
        let torque_scale = mesh
            .corners()
            .flatten()
            .map(|p| (p - wrench_center).norm())
            .fold(0.0, f64::max);
        if !(torque_scale.is_finite() && torque_scale > 0.0) {
            return Err(GraspError::NoExtent {
                center: wrench_center.coords.into(),
            });
        }
        let bit = |leaf: usize| if leaf < 128 { 1u128 << leaf } else { 0 };
        let of_leaf = |(i, b): (usize, &OrientedBox)| Region {
            oriented_box: *b,
            own_leaves: bit(i),
        };
        let of_inner = |(b, own): &(OrientedBox, Vec<usize>)| Region {
            oriented_box: *b,
            own_leaves: own.iter().fold(0, |bits, i| bits | bit(*i)),
        };
        let regions = leaves
            .iter()
            .enumerate()
            .map(of_leaf)
            .chain(inner.iter().map(of_inner))
            .collect();
        let sum: f64 = leaves.iter().map(OrientedBox::volume).sum();
        Ok(Self {
            surface: Surface::new(mesh),
            regions,
            size: object_size(&root),
            cvex: root.volume() / sum,
            box_volumes: (sum, union_volume(&leaves)),
            root,
            leaves,
            wrench_center,
            torque_scale,
            material,
        })
    }

    /// The surface.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// The boxes that hypotheses come from: first the leaves, then the inner nodes, root first.
    pub fn regions(&self) -> &[Region] {
        &self.regions
    }

    /// The boxes of the decomposition.
    pub fn leaves(&self) -> &[OrientedBox] {
        &self.leaves
    }

    /// The minimum-volume box of the whole object.
    pub fn root(&self) -> &OrientedBox {
        &self.root
    }

    /// `size`: the root box's extents matched to x, y, z.
    pub fn size(&self) -> [f64; 3] {
        self.size
    }

    /// `cvex`: the root box's volume over the sum of the leaves'.
    pub fn cvex(&self) -> f64 {
        self.cvex
    }

    /// The point that torques are taken about.
    pub fn wrench_center(&self) -> Point3<f64> {
        self.wrench_center
    }

    /// The length that torques are divided by: the largest distance of a vertex from the wrench centre.
    pub fn torque_scale(&self) -> f64 {
        self.torque_scale
    }

    /// What it is made of.
    pub fn material(&self) -> Material {
        self.material
    }

    /// How grasps of it are measured: 8 edges, L₁.
    pub fn quality_options(&self) -> QualityOptions {
        QualityOptions::new(self.wrench_center, self.torque_scale)
    }

    /// Sum and union of the leaves' volumes.
    pub(crate) fn box_volumes(&self) -> (f64, f64) {
        self.box_volumes
    }
}
