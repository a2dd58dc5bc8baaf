//! Laws on generated input: shared volumes, mass properties, repairs.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use prehend_geometry::{
    MeshFormat, OrientedBox, Shape, Tetrahedron, TriMesh, largest_tetrahedron, mass_properties, read_shape,
    repair, signed_volume, surface_area, surface_centroid, union_volume, write_ply,
};
use proptest::prelude::*;

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    [-size..size, -size..size, -size..size].prop_map(Vector3::from)
}

fn rotation() -> impl Strategy<Value = UnitQuaternion<f64>> {
    vector(3.0).prop_map(UnitQuaternion::from_scaled_axis)
}

fn tetrahedron() -> impl Strategy<Value = Tetrahedron> {
    [vector(1.0), vector(1.0), vector(1.0), vector(1.0)]
        .prop_map(|corners| Tetrahedron(corners.map(Point3::from)))
}

fn oriented_box() -> impl Strategy<Value = OrientedBox> {
    (vector(0.5), rotation(), [0.02..1.5, 0.02..1.5, 0.02..1.5]).prop_map(|(center, rotation, extents)| {
        OrientedBox::new(center.into(), rotation.to_rotation_matrix(), extents.into()).unwrap()
    })
}

/// The two parts of a box on either side of a cut across one axis.
fn cut(whole: &OrientedBox, axis: usize, share: f64) -> [OrientedBox; 2] {
    [(share, share / 2.0 - 0.5), (1.0 - share, share / 2.0)].map(|(length, middle)| {
        let mut extents = whole.extents();
        let shift = whole.axis(axis) * (extents[axis] * middle);
        extents[axis] *= length;
        OrientedBox::new(whole.center() + shift, *whole.axes(), extents).unwrap()
    })
}

fn moved(whole: &OrientedBox, motion: &Isometry3<f64>) -> OrientedBox {
    let mut axes = motion.rotation.to_rotation_matrix() * whole.axes();
    axes.renormalize();
    OrientedBox::new(motion * whole.center(), axes, whole.extents()).unwrap()
}

/// A closed surface with the shape of a stretched, dented ball; outward.
fn ball(stretch: Vector3<f64>) -> TriMesh {
    let (rings, sides) = (8_u32, 12_u32);
    let mut vertices = vec![Point3::new(0.0, 0.0, 1.0), Point3::new(0.0, 0.0, -0.8)];
    for ring in 1..rings {
        for side in 0..sides {
            let tilt = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
            let turn = std::f64::consts::TAU * f64::from(side) / f64::from(sides);
            let radius = tilt.sin() * (1.0 + 0.2 * (3.0 * turn).sin());
            vertices.push(Point3::new(radius * turn.cos(), radius * turn.sin(), tilt.cos()));
        }
    }
    let at = |ring: u32, side: u32| 2 + (ring - 1) * sides + side % sides;
    let mut triangles = Vec::new();
    for side in 0..sides {
        triangles.push([0, at(1, side), at(1, side + 1)]);
        triangles.push([1, at(rings - 1, side + 1), at(rings - 1, side)]);
        for ring in 1..rings - 1 {
            triangles.push([at(ring, side), at(ring + 1, side), at(ring + 1, side + 1)]);
            triangles.push([at(ring, side), at(ring + 1, side + 1), at(ring, side + 1)]);
        }
    }
    let vertices = vertices
        .into_iter()
        .map(|p| p.coords.component_mul(&stretch).into())
        .collect();
    TriMesh::new(vertices, triangles).unwrap()
}

proptest! {
    #[test]
    fn a_shared_volume_never_exceeds_either_body(t in tetrahedron(), b in oriented_box()) {
        let shared = t.intersection_volume(&b);
        prop_assert!(shared >= 0.0 && shared <= t.volume() && shared <= b.volume());
    }

    #[test]
    fn a_shared_volume_adds_up_when_the_box_is_cut(
        t in tetrahedron(), b in oriented_box(), axis in 0..3_usize, share in 0.05..0.95,
    ) {
        let parts = cut(&b, axis, share);
        let sum: f64 = parts.iter().map(|part| t.intersection_volume(part)).sum();
        let whole = t.intersection_volume(&b);
        prop_assert!((sum - whole).abs() < 1e-12 * b.volume().max(t.volume()));
        prop_assert!((t.union_volume(&parts) - whole).abs() < 1e-12 * b.volume().max(t.volume()));
    }

    #[test]
    fn a_shared_volume_ignores_rigid_motion(
        t in tetrahedron(), b in oriented_box(), turn in rotation(), shift in vector(2.0),
    ) {
        let motion = Isometry3::from_parts(shift.into(), turn);
        let there = Tetrahedron(t.0.map(|p| motion * p)).intersection_volume(&moved(&b, &motion));
        prop_assert!((there - t.intersection_volume(&b)).abs() < 1e-13);
    }

    #[test]
    fn a_shared_volume_ignores_the_order_of_corners(t in tetrahedron(), b in oriented_box(), first in 0..4_usize) {
        let mut corners = t.0;
        corners.swap(0, first);
        corners.swap(1, 2);
        let difference = Tetrahedron(corners).intersection_volume(&b) - t.intersection_volume(&b);
        prop_assert!(difference.abs() < 1e-14);
    }

    #[test]
    fn a_union_lies_between_its_largest_part_and_their_sum(
        t in tetrahedron(), boxes in proptest::collection::vec(oriented_box(), 1..5),
    ) {
        let parts: Vec<f64> = boxes.iter().map(|b| t.intersection_volume(b)).collect();
        let union = t.union_volume(&boxes);
        prop_assert!(union <= parts.iter().sum::<f64>() + 1e-13 && union <= t.volume());
        prop_assert!(union >= parts.iter().copied().fold(0.0, f64::max) - 1e-13);
        let turned: Vec<_> = boxes.iter().rev().copied().collect();
        prop_assert!((t.union_volume(&turned) - union).abs() < 1e-12);
        let all = union_volume(&boxes);
        prop_assert!((union_volume(&turned) - all).abs() < 1e-12);
        prop_assert!(all <= boxes.iter().map(OrientedBox::volume).sum::<f64>() + 1e-13 && union <= all + 1e-12);
    }

    #[test]
    fn the_union_of_two_boxes_is_their_sum_less_what_they_share(
        t in tetrahedron(), turn in rotation(),
        (low, middle, high) in ([0.0..0.5, 0.0..0.5, 0.0..0.5], [0.5..0.7, 0.5..0.7, 0.5..0.7], [0.7..1.2, 0.7..1.2, 0.7..1.2]),
    ) {
        // Two boxes with the same axes share a box: from `middle` to `high` and from `low` to a little beyond `middle`.
        let spanned = |low: Vector3<f64>, high: Vector3<f64>| {
            let rotation = turn.to_rotation_matrix();
            OrientedBox::new((rotation * ((low + high) / 2.0)).into(), rotation, high - low).unwrap()
        };
        let (low, middle, high) = (Vector3::from(low), Vector3::from(middle), Vector3::from(high));
        let beyond = middle + Vector3::repeat(0.1);
        let (first, second) = (spanned(low, beyond), spanned(middle, high.sup(&(beyond + Vector3::repeat(0.1)))));
        let shared = spanned(middle, beyond);
        let expected = t.intersection_volume(&first) + t.intersection_volume(&second) - t.intersection_volume(&shared);
        prop_assert!((t.union_volume(&[first, second]) - expected).abs() < 1e-14);
        let expected = first.volume() + second.volume() - shared.volume();
        prop_assert!((union_volume(&[first, second]) - expected).abs() < 1e-14);
    }

    #[test]
    fn no_three_contacts_span_more_than_the_largest_tetrahedron(
        apex in vector(1.0), contacts in proptest::collection::vec(vector(1.0), 3..7),
    ) {
        let (apex, contacts): (Point3<f64>, Vec<Point3<f64>>) =
            (apex.into(), contacts.into_iter().map(Point3::from).collect());
        let largest = largest_tetrahedron(apex, &contacts).map_or(0.0, |t| t.volume());
        for triple in contacts.windows(3) {
            prop_assert!(Tetrahedron([apex, triple[0], triple[1], triple[2]]).volume() <= largest + 1e-9);
        }
    }

    #[test]
    fn mass_properties_move_with_the_mesh(
        stretch in [0.05..2.0, 0.05..2.0, 0.05..2.0], turn in rotation(), shift in vector(1000.0),
    ) {
        let mesh = ball(stretch.into());
        let motion = Isometry3::from_parts(shift.into(), turn);
        let there = mesh.transformed(&motion);
        let (here_mass, there_mass) = (mass_properties(&mesh), mass_properties(&there));
        let relative = |found: f64, expected: f64| (found - expected).abs() / expected.abs();
        prop_assert!(here_mass.volume > 0.0 && relative(there_mass.volume, here_mass.volume) < 1e-9);
        prop_assert!(relative(signed_volume(&there), here_mass.volume) < 1e-9);
        prop_assert!(relative(surface_area(&there), surface_area(&mesh)) < 1e-9);
        prop_assert!((there_mass.center_of_mass - motion * here_mass.center_of_mass).norm() < 1e-9);
        prop_assert!((surface_centroid(&there) - motion * surface_centroid(&mesh)).norm() < 1e-9);
        let rotation: Matrix3<f64> = *Rotation3::from(turn).matrix();
        let expected = rotation * here_mass.inertia * rotation.transpose();
        prop_assert!((there_mass.inertia - expected).norm() < 1e-9 * expected.norm());
    }

    #[test]
    fn scaling_scales_volume_by_the_cube(factor in 0.001..1000.0_f64) {
        let mesh = ball(Vector3::new(1.0, 0.5, 2.0));
        let ratio = signed_volume(&mesh.scaled(factor)) / (signed_volume(&mesh) * factor.powi(3));
        prop_assert!((ratio - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_repaired_mesh_needs_no_repair(turned in proptest::collection::vec(any::<bool>(), 168)) {
        let ball = ball(Vector3::repeat(1.0));
        let triangles = ball.triangles().iter().zip(&turned);
        let triangles = triangles.map(|(&[a, b, c], &turn)| if turn { [a, c, b] } else { [a, b, c] }).collect();
        let (once, _) = repair(TriMesh::new(ball.vertices().to_vec(), triangles).unwrap());
        prop_assert!((signed_volume(&once) - signed_volume(&ball)).abs() < 1e-14);
        let (twice, repairs) = repair(once.clone());
        prop_assert_eq!(&twice, &once);
        prop_assert_eq!(repairs, prehend_geometry::Repairs::default());
    }

    #[test]
    fn written_meshes_are_read_back_bit_by_bit(
        points in proptest::collection::vec(vector(1e3), 3..40), seed in any::<u32>(),
    ) {
        let n = points.len() as u32;
        let triangles = (0..n).map(|i| [i, (i.wrapping_mul(seed)) % n, (i + 1) % n]).collect();
        let mesh = TriMesh::new(points.into_iter().map(Point3::from).collect(), triangles).unwrap();
        prop_assert_eq!(read_shape(&write_ply(&mesh), MeshFormat::Ply).unwrap(), Shape::Mesh(mesh));
    }
}
