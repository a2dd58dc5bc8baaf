//! Volumes that tetrahedra and boxes share, each region counted once.

use nalgebra::{Matrix3, Vector3};

use crate::simplex::{HalfSpace, Simplex, box_simplices, is_outside, split, volume};
use crate::{OrientedBox, Tetrahedron};

impl Tetrahedron {
    /// Volume (m³) of the part of the tetrahedron inside a box.
    ///
    /// The tetrahedron moves into the box's frame (centre subtracted first, so that a pair far from the origin loses
    /// no digits), where each of the six slabs cuts every piece into at most three. The result lies between 0 and the
    /// smaller of the two volumes; a flat tetrahedron shares nothing.
    ///
    /// # Examples
    ///
    /// The corner tetrahedron of a unit cube:
    ///
    /// ```
    /// use nalgebra::Vector3;
    /// use prehend_geometry::{OrientedBox, Tetrahedron};
    ///
    /// let cube = OrientedBox::centered([1.0; 3]);
    /// let corner = cube.min_corner();
    /// let tetrahedron = Tetrahedron([corner, corner + Vector3::x(), corner + Vector3::y(), corner + Vector3::z()]);
    /// assert!((tetrahedron.intersection_volume(&cube) - 1.0 / 6.0).abs() < 1e-15);
    /// ```
    pub fn intersection_volume(&self, oriented_box: &OrientedBox) -> f64 {
        if self.0.iter().all(|p| oriented_box.contains(p, 0.0)) {
            return self.volume().min(oriented_box.volume());
        }
        total(&self.clipped(oriented_box))
            .min(self.volume())
            .min(oriented_box.volume())
    }

    /// Volume (m³) of the part of the tetrahedron inside at least one of the boxes: what boxes share counts once.
    ///
    /// Each box adds the pieces inside it that no earlier box holds. Between 0 and the tetrahedron's volume, and never
    /// more than the sum of [`intersection_volume`](Self::intersection_volume) over the boxes; 0 without boxes.
    pub fn union_volume(&self, boxes: &[OrientedBox]) -> f64 {
        let covered: f64 = (0..boxes.len())
            .map(|i| total(&beyond(self.clipped(&boxes[i]), &boxes[i], &boxes[..i])))
            .sum();
        covered.min(self.volume())
    }

    /// The pieces inside a box, in the box's frame.
    fn clipped(&self, oriented_box: &OrientedBox) -> Vec<Simplex> {
        let local: Simplex = self.0.map(|p| oriented_box.local(&p));
        if volume(&local) == 0.0 {
            return Vec::new();
        }
        clip(
            vec![local],
            &slabs(
                &oriented_box.half_extents(),
                &Vector3::zeros(),
                &Matrix3::identity(),
            ),
        )
    }
}

/// Volume (m³) of a union of boxes: what they share counts once. 0 without boxes.
///
/// Each box adds what no earlier box holds, so the result lies between the largest box and the sum of all.
pub fn union_volume(boxes: &[OrientedBox]) -> f64 {
    (0..boxes.len())
        .map(|i| {
            let overlapping: Vec<OrientedBox> = boxes[..i]
                .iter()
                .filter(|other| may_overlap(&boxes[i], other))
                .copied()
                .collect();
            if overlapping.is_empty() {
                return boxes[i].volume();
            }
            let pieces = box_simplices(&boxes[i].half_extents()).to_vec();
            total(&beyond(pieces, &boxes[i], &overlapping)).min(boxes[i].volume())
        })
        .sum()
}

fn total(pieces: &[Simplex]) -> f64 {
    pieces.iter().map(volume).sum()
}

/// What lies inside all half-spaces.
fn clip(mut pieces: Vec<Simplex>, planes: &[HalfSpace; 6]) -> Vec<Simplex> {
    let mut discarded = Vec::new();
    for plane in planes {
        let mut kept = Vec::with_capacity(pieces.len() * 2);
        for piece in &pieces {
            split(piece, plane, &mut kept, &mut discarded);
        }
        discarded.clear();
        pieces = kept;
    }
    pieces
}

/// What is left of pieces (in `frame`'s frame) when the boxes are taken away, one after the other.
fn beyond(mut pieces: Vec<Simplex>, frame: &OrientedBox, boxes: &[OrientedBox]) -> Vec<Simplex> {
    for other in boxes.iter().filter(|other| may_overlap(frame, other)) {
        let center = frame.local(&other.center());
        let axes = (frame.axes().inverse() * other.axes()).into_inner();
        let planes = slabs(&other.half_extents(), &center, &axes);
        let mut left = Vec::with_capacity(pieces.len());
        for piece in pieces {
            if planes.iter().any(|plane| is_outside(&piece, plane)) {
                left.push(piece);
                continue;
            }
            let mut inside = vec![piece];
            for plane in &planes {
                let mut still_inside = Vec::with_capacity(inside.len() * 2);
                for piece in &inside {
                    split(piece, plane, &mut still_inside, &mut left);
                }
                inside = still_inside;
            }
        }
        pieces = left;
    }
    pieces
}

/// The six half-spaces of a box whose axes are the columns; the thinnest slab first, since it shrinks pieces most.
fn slabs(half: &Vector3<f64>, center: &Vector3<f64>, axes: &Matrix3<f64>) -> [HalfSpace; 6] {
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| half[i].total_cmp(&half[j]));
    std::array::from_fn(|i| {
        let k = order[i / 2];
        let normal: Vector3<f64> = if i % 2 == 0 {
            axes.column(k).into()
        } else {
            -axes.column(k)
        };
        HalfSpace {
            normal,
            offset: half[k] + normal.dot(center),
        }
    })
}

/// Whether the balls about two boxes meet; boxes for which they do not share nothing.
fn may_overlap(a: &OrientedBox, b: &OrientedBox) -> bool {
    (a.center() - b.center()).norm() < a.half_extents().norm() + b.half_extents().norm()
}
