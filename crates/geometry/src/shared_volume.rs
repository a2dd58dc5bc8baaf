//! Volumes that tetrahedra and boxes share, each region counted once.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::clip;
use crate::simplex::{HalfSpace, Simplex, box_simplices, is_outside, split, volume};
use crate::twofold::Twofold;
use crate::{OrientedBox, Tetrahedron};

impl Tetrahedron {
    /// Volume (m³) of the part of the tetrahedron inside a box.
    ///
    /// Bodies of ordinary shape take one pass over the tetrahedron's faces (the source of `clip` tells how), in the
    /// box's frame. Where an estimate says that rounding could cost more than some 1e-13 of the smaller body (needles,
    /// plates, bodies of very different size) each of the box's faces cuts every piece of the tetrahedron into at most
    /// three, in coordinates of the smaller body, from a point of its own. The error stays below 1e-12 of the smaller
    /// body where bodies are up to a thousand times longer than thick, or than each other, at any place and scale; beyond,
    /// below 4 ε times longest over shortest extent (ε = 2.2e-16). The result lies between 0 and the smaller of the two
    /// volumes; a flat tetrahedron shares nothing.
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
        match self.quick_volume(oriented_box) {
            Quick::Settled(volume) => volume,
            Quick::Whole => self.volume().min(oriented_box.volume()),
            Quick::Unsure => {
                let (frame, pieces) = self.clipped(oriented_box);
                frame
                    .volume(&pieces)
                    .min(self.volume())
                    .min(oriented_box.volume())
            }
        }
    }

    /// The shared volume where one pass over the faces is enough.
    fn quick_volume(&self, oriented_box: &OrientedBox) -> Quick {
        let scale = oriented_box.half_extents().map(f64::recip);
        let mut corners = [Vector3::zeros(); 4];
        let mut reach = 0.0_f64;
        let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        for (corner, p) in corners.iter_mut().zip(&self.0) {
            let from_center = p - oriented_box.center();
            reach = reach.max(from_center.amax());
            *corner = oriented_box
                .axes()
                .matrix()
                .tr_mul(&from_center)
                .component_mul(&scale);
            low = low.inf(corner);
            high = high.sup(corner);
        }
        if (0..3).any(|k| low[k] >= 1.0 || high[k] <= -1.0) {
            return Quick::Settled(0.0);
        }
        if (0..3).all(|k| low[k] >= -1.0 && high[k] <= 1.0) {
            return Quick::Whole;
        }
        let [a, b, c, d] = corners;
        let six_volumes = (b - a).cross(&(c - a)).dot(&(d - a));
        if six_volumes < 0.0 {
            corners.swap(2, 3);
        }
        // Each face's outward normal, as long as twice its area: does the face cut the cube?
        let mut holds_cube = true;
        let mut shadows = Vector3::zeros();
        for [i, j, k] in clip::FACES {
            let normal = (corners[j] - corners[i]).cross(&(corners[k] - corners[i]));
            let absolute = normal.abs();
            shadows += absolute;
            let (offset, half_width) = (normal.dot(&corners[i]), absolute.sum());
            if offset <= -half_width {
                return Quick::Settled(0.0);
            }
            holds_cube &= offset >= half_width;
        }
        let smaller = (six_volumes.abs() / 6.0).min(8.0);
        // Rounding moves corners along axis k by some ε · reach / half extent, and with them all surfaces seen along it.
        let width = high.map(|h| h.min(1.0)) - low.map(|l| l.max(-1.0));
        let seen = |k: usize| (shadows[k] / 2.0).min(2.0 * width[(k + 1) % 3] * width[(k + 2) % 3]);
        let moved: f64 = (0..3).map(|k| scale[k] * reach * seen(k)).sum();
        let unsure = f64::EPSILON * moved > QUICK_ENOUGH * smaller;
        if unsure || !smaller.is_finite() {
            return Quick::Unsure;
        }
        let unit = oriented_box.volume() / 8.0;
        if holds_cube {
            return Quick::Settled(oriented_box.volume());
        }
        let volume = clip::inside_cube(&corners, &low, &high) * unit;
        if volume > smaller * unit * (1.0 - 1e-9) {
            return Quick::Settled(volume.min(self.volume()).min(oriented_box.volume()));
        }
        Quick::Settled(volume.max(0.0))
    }

    /// Volume (m³) of the part of the tetrahedron inside at least one of the boxes: what boxes share counts once.
    ///
    /// Each box adds the pieces inside it that no earlier box holds. Between 0 and the tetrahedron's volume, and never
    /// more than the sum of [`intersection_volume`](Self::intersection_volume) over the boxes; 0 without boxes.
    pub fn union_volume(&self, boxes: &[OrientedBox]) -> f64 {
        let parts: Vec<f64> = boxes.iter().map(|b| self.intersection_volume(b)).collect();
        let covered: f64 = (0..boxes.len())
            .map(|i| {
                let earlier = (0..i).filter(|&j| parts[j] > 0.0).map(|j| &boxes[j]);
                let earlier = overlapping(&boxes[i], earlier);
                if parts[i] == 0.0 || earlier.is_empty() {
                    return parts[i];
                }
                let (frame, pieces) = self.clipped(&boxes[i]);
                frame.volume(&beyond(pieces, &frame, &earlier))
            })
            .sum();
        covered.min(self.volume())
    }

    /// The pieces inside a box, and the frame that they are in: that of the smaller body.
    fn clipped(&self, oriented_box: &OrientedBox) -> (Frame, Vec<Simplex>) {
        if self.volume() <= oriented_box.volume() {
            let frame = Frame::of_tetrahedron(self);
            let whole = [Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::z()];
            let pieces = if self.volume() > 0.0 {
                vec![whole]
            } else {
                Vec::new()
            };
            let planes = frame.slabs(oriented_box, &frame.basis.tr_mul(oriented_box.axes().matrix()));
            return (frame, clip(pieces, &planes));
        }
        let frame = Frame::of_box(oriented_box);
        let whole = self.0.map(|p| oriented_box.local(&p));
        let planes = frame.slabs(oriented_box, &Matrix3::identity());
        (frame, clip(vec![whole], &planes))
    }
}

/// What one pass over the faces found.
enum Quick {
    /// The volume (m³).
    Settled(f64),
    /// The whole tetrahedron lies inside.
    Whole,
    /// Rounding might show.
    Unsure,
}

/// The quick way is taken where its estimated error stays below this share of the smaller body.
const QUICK_ENOUGH: f64 = 2.5e-13;

/// Coordinates in which one body is simple: `point = origin + basis · coordinates`.
struct Frame {
    origin: Point3<f64>,
    basis: Matrix3<f64>,
    /// Volume (m³) of a unit of volume in these coordinates.
    unit: f64,
}

impl Frame {
    /// The three edges from the first corner are the unit vectors, so that a needle is as good as any other.
    fn of_tetrahedron(tetrahedron: &Tetrahedron) -> Self {
        let [a, b, c, d] = tetrahedron.0;
        Self {
            origin: a,
            basis: Matrix3::from_columns(&[b - a, c - a, d - a]),
            unit: 6.0 * tetrahedron.volume(),
        }
    }

    fn of_box(oriented_box: &OrientedBox) -> Self {
        Self {
            origin: oriented_box.center(),
            basis: *oriented_box.axes().matrix(),
            unit: 1.0,
        }
    }

    /// Volume of pieces, in m³.
    fn volume(&self, pieces: &[Simplex]) -> f64 {
        pieces.iter().map(volume).sum::<f64>() * self.unit
    }

    /// The six half-spaces of a box with the given normals (columns) in this frame's coordinates; the thinnest slab
    /// first, since it shrinks pieces most.
    fn slabs(&self, oriented_box: &OrientedBox, normals: &Matrix3<f64>) -> [HalfSpace; 6] {
        let half = oriented_box.half_extents();
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| half[i].total_cmp(&half[j]));
        std::array::from_fn(|i| {
            let k = order[i / 2];
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            let offset = plane_offset(
                half[k],
                &(oriented_box.axis(k) * sign),
                &oriented_box.center(),
                &self.origin,
            );
            HalfSpace {
                normal: normals.column(k) * sign,
                offset,
            }
        })
    }
}

/// `half + axis · (center − origin)`, where the terms may all but cancel: the origin may lie next to a face of a large
/// box.
fn plane_offset(half: f64, axis: &Vector3<f64>, center: &Point3<f64>, origin: &Point3<f64>) -> f64 {
    (0..3)
        .map(|k| Twofold::from(axis[k]) * Twofold::difference(center[k], origin[k]))
        .fold(Twofold::from(half), |sum, term| sum + term)
        .value()
}

/// Volume (m³) of a union of boxes: what they share counts once. 0 without boxes.
///
/// Each box adds what no earlier box holds, so the result lies between the largest box and the sum of all.
pub fn union_volume(boxes: &[OrientedBox]) -> f64 {
    (0..boxes.len())
        .map(|i| {
            let earlier = overlapping(&boxes[i], &boxes[..i]);
            if earlier.is_empty() {
                return boxes[i].volume();
            }
            let frame = Frame::of_box(&boxes[i]);
            let pieces = box_simplices(&boxes[i].half_extents()).to_vec();
            frame
                .volume(&beyond(pieces, &frame, &earlier))
                .min(boxes[i].volume())
        })
        .sum()
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

/// What is left of pieces when boxes are taken away, one after the other.
fn beyond(mut pieces: Vec<Simplex>, frame: &Frame, boxes: &[OrientedBox]) -> Vec<Simplex> {
    for other in boxes {
        let planes = frame.slabs(other, &frame.basis.tr_mul(other.axes().matrix()));
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

/// Those of the other boxes that may share something with this one, nearest first: what the nearest one leaves is
/// mostly clear of the others.
fn overlapping<'a>(
    this: &OrientedBox,
    others: impl IntoIterator<Item = &'a OrientedBox>,
) -> Vec<OrientedBox> {
    let mut near: Vec<OrientedBox> = others
        .into_iter()
        .filter(|other| !are_apart(this, other))
        .copied()
        .collect();
    let distance = |other: &OrientedBox| (this.center() - other.center()).norm_squared();
    near.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    near
}

/// Whether a face's plane of one of the boxes separates them; `false` says nothing.
fn are_apart(first: &OrientedBox, second: &OrientedBox) -> bool {
    let between = second.center() - first.center();
    let turned = first.axes().matrix().tr_mul(second.axes().matrix()).abs();
    let (a, b) = (first.half_extents(), second.half_extents());
    let along_first = first.axes().matrix().tr_mul(&between).abs();
    let along_second = second.axes().matrix().tr_mul(&between).abs();
    let (reach_first, reach_second) = (a + turned * b, turned.tr_mul(&a) + b);
    (0..3).any(|k| along_first[k] >= reach_first[k] || along_second[k] >= reach_second[k])
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn cube_at(x: f64, y: f64, z: f64) -> OrientedBox {
        OrientedBox::new(Point3::new(x, y, z), Rotation3::identity(), Vector3::repeat(1.0)).unwrap()
    }

    /// Legs of length a on a unit cube's corner: a³/6 less (a − 1)³/6 beyond each of three faces, up to a = 2; 1 from 3 on.
    #[test]
    fn a_corner_tetrahedron_leaves_the_cube_as_it_grows() {
        let cube = cube_at(0.5, 0.5, 0.5);
        for (leg, expected) in [(1.0, 1.0 / 6.0), (1.5, 0.5), (2.0, 5.0 / 6.0), (3.0, 1.0)] {
            let corner = Point3::origin();
            let t = Tetrahedron([
                corner,
                corner + Vector3::x() * leg,
                corner + Vector3::y() * leg,
                corner + Vector3::z() * leg,
            ]);
            assert!(
                (t.intersection_volume(&cube) - expected).abs() < 1e-15,
                "leg {leg}"
            );
        }
    }

    #[test]
    fn both_ways_agree_where_the_quick_one_is_taken() {
        let mut rng = ChaCha8Rng::seed_from_u64(31);
        let (mut n_quick, mut worst) = (0, 0.0_f64);
        for i in 0..4000 {
            let mut random = |size: f64| Vector3::from_fn(|_, _| rng.random_range(-size..size));
            // From fat to a thousand times longer than thick, from far smaller than the box to far larger.
            let squeeze = Vector3::new(1.0, 1.0, [1.0, 0.1, 1e-3][i % 3]);
            let size = [0.1, 1.0, 10.0][i / 3 % 3];
            let shift = random(0.5);
            let t = Tetrahedron([(); 4].map(|()| (random(size).component_mul(&squeeze) + shift).into()));
            let extents = random(0.6).map(|x| x + 0.7);
            let b = OrientedBox::new(
                Point3::origin(),
                Rotation3::from_scaled_axis(random(3.0)),
                extents,
            )
            .unwrap();
            if let Quick::Settled(quick) = t.quick_volume(&b) {
                let (frame, pieces) = t.clipped(&b);
                worst = worst.max((quick - frame.volume(&pieces)).abs() / t.volume().min(b.volume()));
                n_quick += 1;
            }
        }
        assert!(n_quick > 2000 && worst < 2e-13, "{n_quick} {worst:e}");
    }

    #[test]
    fn shared_corners_and_copies_count_once() {
        // Two unit cubes half a unit apart along every axis share an eighth.
        let cubes = [cube_at(0.0, 0.0, 0.0), cube_at(0.5, 0.5, 0.5)];
        assert!((union_volume(&cubes) - 1.875).abs() < 1e-14);
        assert!((union_volume(&[cubes[0], cubes[0], cubes[0]]) - 1.0).abs() < 1e-14);
        assert_eq!(union_volume(&[cubes[0], cube_at(5.0, 0.0, 0.0)]), 2.0);
        assert_eq!(union_volume(&[]), 0.0);
    }

    #[test]
    fn flat_tetrahedra_share_nothing() {
        let flat = Tetrahedron([[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 1., 0.]].map(Point3::from));
        assert_eq!(flat.intersection_volume(&cube_at(0.0, 0.0, 0.0)), 0.0);
        assert_eq!(flat.union_volume(&[cube_at(0.0, 0.0, 0.0)]), 0.0);
    }
}
