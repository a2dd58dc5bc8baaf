//! Where a hand could come from: the faces of boxes.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use prehend_geometry::OrientedBox;

use crate::{GraspObject, Region};

/// Room (m) that the open hand needs on either side of what it closes around.
pub const OPENING_MARGIN: f64 = 0.005;
/// How far (m) off its face the palm must be free of other boxes.
pub const PALM_CLEARANCE: f64 = 0.02;
/// A face is blocked where more than this share of the samples in front of it lies in other boxes.
const BLOCKED_SHARE: f64 = 0.5;

/// A place on a box's face, and how the hand is turned there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothesis {
    /// The box: an index into [`GraspObject::regions`].
    pub box_idx: usize,
    /// The face, 0 to 5: `2 · axis`, plus 1 for the positive side.
    pub face: usize,
    /// The roll, 0 to 3: closing along +e₁, +e₂, −e₁, −e₂, the face's edge directions.
    pub roll: usize,
    /// From the face's centre along e₁ and e₂, metres.
    pub offset: [f64; 2],
}

/// A face of a box: its centre, outward normal and edges, object frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Face {
    /// Centre.
    pub center: Point3<f64>,
    /// Outward unit normal.
    pub normal: Vector3<f64>,
    /// Unit edge directions e₁, e₂ with e₁ × e₂ = normal.
    pub edges: [Vector3<f64>; 2],
    /// Lengths along them.
    pub lengths: [f64; 2],
    /// Length of the box along the normal.
    pub depth: f64,
}

impl Face {
    /// One of the six faces of a box: `2 · axis`, plus 1 for the positive side.
    pub fn of(oriented_box: &OrientedBox, face: usize) -> Self {
        let (axis, positive) = (face / 2 % 3, face % 2 == 1);
        let (k1, k2) = ((axis + 1) % 3, (axis + 2) % 3);
        // Negative sides swap their edges, which keeps e₁ × e₂ outward.
        let (k1, k2) = if positive { (k1, k2) } else { (k2, k1) };
        let normal = oriented_box.axis(axis) * if positive { 1.0 } else { -1.0 };
        let extents = oriented_box.extents();
        Self {
            center: oriented_box.center() + normal * (extents[axis] / 2.0),
            normal,
            edges: [oriented_box.axis(k1), oriented_box.axis(k2)],
            lengths: [extents[k1], extents[k2]],
            depth: extents[axis],
        }
    }

    /// A point of the face.
    pub fn point(&self, offset: [f64; 2]) -> Point3<f64> {
        self.center + self.edges[0] * offset[0] + self.edges[1] * offset[1]
    }
}

impl Hypothesis {
    /// Pose of the palm frame on the face: origin on it, z against its normal, x along the closing direction.
    pub fn object_from_palm(&self, object: &GraspObject) -> Isometry3<f64> {
        let face = Face::of(&object.regions()[self.box_idx].oriented_box, self.face);
        let z = -face.normal;
        let x = face.edges[self.roll % 2] * if self.roll >= 2 { -1.0 } else { 1.0 };
        let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
        Isometry3::from_parts(
            face.point(self.offset).into(),
            UnitQuaternion::from_rotation_matrix(&rotation),
        )
    }
}

/// All hypotheses of an object for a hand with this opening width and palm width (m), in order of box, face, roll and
/// position.
///
/// - A face is dropped where more than half of 5 × 5 points, [`PALM_CLEARANCE`] in front of it, lie in boxes other
///   than its own: there is no room for a palm, as where a cut went.
/// - A roll is dropped where the edge that the hand closes along does not fit the opening with [`OPENING_MARGIN`] on
///   either side.
/// - Across the closing direction, a face longer than the palm gets a position every half palm width, about its centre,
///   as far as three quarters of the palm stay on the face.
/// - A hypothesis that an earlier box gives, too (to 1 mm and 1°), is dropped.
pub fn hypotheses(object: &GraspObject, opening_width: f64, palm_width: f64) -> Vec<Hypothesis> {
    let mut found: Vec<Hypothesis> = Vec::new();
    let mut poses: Vec<Isometry3<f64>> = Vec::new();
    for (box_idx, region) in object.regions().iter().enumerate() {
        let first_of_box = poses.len();
        for face_idx in 0..6 {
            let face = Face::of(&region.oriented_box, face_idx);
            if is_blocked(&face, region, object.leaves()) {
                continue;
            }
            for roll in 0..4 {
                let (along, across) = (roll % 2, 1 - roll % 2);
                if face.lengths[along] + 2.0 * OPENING_MARGIN > opening_width {
                    continue;
                }
                for position in positions(face.lengths[across], palm_width) {
                    let mut offset = [0.0; 2];
                    offset[across] = position;
                    let hypothesis = Hypothesis {
                        box_idx,
                        face: face_idx,
                        roll,
                        offset,
                    };
                    let pose = hypothesis.object_from_palm(object);
                    if !poses[..first_of_box].iter().any(|other| is_same(other, &pose)) {
                        poses.push(pose);
                        found.push(hypothesis);
                    }
                }
            }
        }
    }
    found
}

/// Positions (m) along an edge, about its middle: one every half palm width where it is longer than the palm.
fn positions(length: f64, palm_width: f64) -> Vec<f64> {
    let step = palm_width / 2.0;
    let last = if length > palm_width {
        ((length / 2.0 - palm_width / 4.0) / step).floor() as i64
    } else {
        0
    };
    // A needle under a tiny hand gets no more than this many.
    let last = last.clamp(0, 50);
    (-last..=last).map(|k| k as f64 * step).collect()
}

/// Whether other boxes stand in front of a face.
fn is_blocked(face: &Face, region: &Region, leaves: &[OrientedBox]) -> bool {
    let others: Vec<_> = (0..leaves.len())
        .filter(|i| !region.owns(*i))
        .map(|i| &leaves[i])
        .collect();
    let mut n_blocked = 0;
    for i in 0..5 {
        for j in 0..5 {
            let at = |k: i32, length: f64| (f64::from(k) + 0.5) / 5.0 * length - length / 2.0;
            let sample =
                face.point([at(i, face.lengths[0]), at(j, face.lengths[1])]) + face.normal * PALM_CLEARANCE;
            n_blocked += usize::from(others.iter().any(|b| b.contains(&sample, 0.0)));
        }
    }
    n_blocked as f64 / 25.0 > BLOCKED_SHARE
}

fn is_same(a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
    (a.translation.vector - b.translation.vector).norm() < 1e-3
        && a.rotation.angle_to(&b.rotation) < 1f64.to_radians()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::boxes_object;

    #[test]
    fn a_single_small_cube_is_grasped_from_all_six_sides_with_four_rolls() {
        let cube = boxes_object(&[([0.0; 3], [0.04; 3])]);
        let found = hypotheses(&cube, 0.1, 0.08);
        assert_eq!(found.len(), 24);
        for hypothesis in &found {
            let pose = hypothesis.object_from_palm(&cube);
            let towards_center = -pose.translation.vector.normalize();
            assert!(
                (pose.rotation * Vector3::z() - towards_center).norm() < 1e-12,
                "the palm looks at the centre"
            );
        }
        // The four rolls of a face are quarter turns apart.
        let x = |i: usize| found[i].object_from_palm(&cube).rotation * Vector3::x();
        assert!(
            (x(0) + x(2)).norm() < 1e-12 && (x(1) + x(3)).norm() < 1e-12 && x(0).dot(&x(1)).abs() < 1e-12
        );
    }

    #[test]
    fn a_hand_closes_only_around_what_fits_its_opening() {
        let plate = boxes_object(&[([0.0; 3], [0.02, 0.05, 0.3])]);
        let closing_lengths = |opening: f64| {
            let mut lengths: Vec<i64> = hypotheses(&plate, opening, 1.0)
                .iter()
                .map(|h| {
                    let face = Face::of(&plate.regions()[0].oriented_box, h.face);
                    (face.lengths[h.roll % 2] * 1e3).round() as i64
                })
                .collect();
            lengths.sort_unstable();
            lengths.dedup();
            lengths
        };
        assert_eq!(closing_lengths(0.0301), [20]);
        assert_eq!(closing_lengths(0.0601), [20, 50]);
        assert_eq!(closing_lengths(0.0299), [] as [i64; 0]);
    }

    #[test]
    fn the_faces_between_two_boxes_are_blocked() {
        let two = boxes_object(&[([0.0; 3], [0.04; 3]), ([0.0, 0.0, 0.04], [0.04; 3])]);
        let faces = |b: usize| {
            let mut f: Vec<_> = hypotheses(&two, 0.1, 0.08)
                .iter()
                .filter(|h| h.box_idx == b)
                .map(|h| h.face)
                .collect();
            f.dedup();
            f
        };
        assert_eq!(faces(0), [0, 1, 2, 3, 4]);
        assert_eq!(faces(1), [0, 1, 2, 3, 5]);
    }

    #[test]
    fn a_long_handle_gets_a_position_every_half_palm_width() {
        let handle = boxes_object(&[([0.0; 3], [0.03, 0.03, 0.3])]);
        let found = hypotheses(&handle, 0.05, 0.08);
        let mut along: Vec<f64> = found
            .iter()
            .filter(|h| h.face == 1 && h.roll == 0)
            .map(|h| h.offset[1])
            .collect();
        along.sort_by(f64::total_cmp);
        assert_eq!(along, [-0.12, -0.08, -0.04, 0.0, 0.04, 0.08, 0.12]);
    }

    #[test]
    fn faces_point_outward_and_their_edges_are_right_handed() {
        let turned = OrientedBox::new(
            Point3::new(0.1, 0.2, 0.3),
            Rotation3::from_euler_angles(0.3, 0.5, -0.2),
            Vector3::new(0.1, 0.2, 0.3),
        )
        .unwrap();
        for i in 0..6 {
            let face = Face::of(&turned, i);
            assert!((face.edges[0].cross(&face.edges[1]) - face.normal).norm() < 1e-12);
            assert!(turned.contains(&face.center, 1e-12));
            assert!(!turned.contains(&(face.center + face.normal * 1e-6), 0.0));
        }
    }
}
