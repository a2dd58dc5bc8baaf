//! Real hands on real objects: what comes out is held to its promises by means that share no code with the closing.

use std::path::Path;

use nalgebra::{Isometry3, Point3, Vector3};
use parry3d_f64::math::{Pose, Rotation, Vector};
use parry3d_f64::{query, shape};
use prehend_geometry::{DecomposeOptions, MeshFormat, Solid, decompose, read_mesh};
use prehend_grasp::{
    CONTACT_TOLERANCE, CloseOptions, Grasp, GraspError, GraspObject, Proposal, Reason, SynthesisOptions,
    close, retry, synthesize, synthesize_each,
};
use prehend_hand::Hand;
use prehend_quality::Material;

fn top() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn hand(name: &str) -> Hand {
    let folder = top().join("hands").join(name);
    let urdf = std::fs::read_to_string(folder.join(format!("{name}.urdf"))).unwrap();
    let description = std::fs::read_to_string(folder.join("hand.toml")).unwrap();
    Hand::from_urdf(&urdf, &|file| Err(file.to_owned()))
        .unwrap()
        .with_description(&description)
        .unwrap()
}

fn object(file: &str) -> GraspObject {
    let mesh = read_mesh(
        &std::fs::read(top().join("objects").join(file)).unwrap(),
        MeshFormat::Ply,
    )
    .unwrap();
    let boxes = decompose(&mesh, &DecomposeOptions::default()).unwrap();
    GraspObject::new(mesh, &boxes, None, Material::Plastic).unwrap()
}

fn options(tries: usize) -> SynthesisOptions {
    SynthesisOptions {
        tries,
        seed: 3,
        stream: "test".into(),
        ..SynthesisOptions::default()
    }
}

fn pose(p: &Isometry3<f64>) -> Pose {
    let (r, t) = (p.rotation.coords, p.translation.vector);
    Pose::from_parts(
        Vector::new(t.x, t.y, t.z),
        Rotation::from_xyzw(r.x, r.y, r.z, r.w),
    )
}

/// A solid as parry's own shape, and its pose in the solid's frame.
fn parry_shape(solid: &Solid) -> (Box<dyn shape::Shape>, Pose) {
    let v = |p: &Point3<f64>| Vector::new(p.x, p.y, p.z);
    let s = 0.5f64.sqrt();
    match solid {
        Solid::Sphere { radius } => (Box::new(shape::Ball::new(*radius)), Pose::IDENTITY),
        Solid::Capsule { half_length, radius } => (
            Box::new(shape::Capsule::new_z(*half_length, *radius)),
            Pose::IDENTITY,
        ),
        Solid::Cuboid { half_extents: h } => (
            Box::new(shape::Cuboid::new(Vector::new(h.x, h.y, h.z))),
            Pose::IDENTITY,
        ),
        Solid::Cylinder { half_length, radius } => {
            let turn = Pose::from_parts(Vector::new(0.0, 0.0, 0.0), Rotation::from_xyzw(s, 0.0, 0.0, s));
            (Box::new(shape::Cylinder::new(*half_length, *radius)), turn)
        }
        Solid::Hull(points) => {
            let points: Vec<_> = points.iter().map(v).collect();
            (
                Box::new(shape::ConvexPolyhedron::from_convex_hull(&points).unwrap()),
                Pose::IDENTITY,
            )
        }
        Solid::Mesh(mesh) => {
            let points = mesh.vertices().iter().map(v).collect();
            (
                Box::new(shape::TriMesh::new(points, mesh.triangles().to_vec()).unwrap()),
                Pose::IDENTITY,
            )
        }
    }
}

/// Every link keeps clear of the object by parry's distances, and every contact lies on both.
fn assert_clear_and_touching(hand: &Hand, object: &GraspObject, grasp: &Grasp) {
    let mesh = object.surface().mesh();
    let points = mesh
        .vertices()
        .iter()
        .map(|p| Vector::new(p.x, p.y, p.z))
        .collect();
    let shell = shape::TriMesh::new(points, mesh.triangles().to_vec()).unwrap();
    let poses = hand.link_poses(&grasp.joints);
    for (idx, link) in hand.links().iter().enumerate() {
        for placed in &link.collision {
            let object_from_solid = grasp.object_from_root * poses.as_slice()[idx] * placed.link_from_solid;
            let (solid, turn) = parry_shape(&placed.solid);
            let gap = query::distance(
                &Pose::IDENTITY,
                &shell,
                &(pose(&object_from_solid) * turn),
                &*solid,
            )
            .unwrap();
            assert!(
                gap.distance > 0.0,
                "try {}: `{}` penetrates",
                grasp.try_idx,
                link.name
            );
            assert!(
                !object
                    .surface()
                    .is_inside(&(object_from_solid * Point3::origin())),
                "`{}` is inside",
                link.name
            );
        }
    }
    for contact in &grasp.contacts {
        assert!(object.surface().closest_point(&contact.at.point).distance < 1e-9);
        let link = hand.link(contact.link);
        let distances = link.collision.iter().map(|placed| {
            let object_from_solid =
                grasp.object_from_root * poses.root_from_link(contact.link) * placed.link_from_solid;
            placed
                .solid
                .distance_to_point(&object_from_solid.inverse_transform_point(&contact.at.point))
        });
        let nearest = distances.fold(f64::INFINITY, f64::min);
        assert!(
            nearest < CONTACT_TOLERANCE + 1e-9,
            "a contact of `{}` is {nearest} m off it",
            link.name
        );
    }
}

#[test]
fn no_link_penetrates_and_every_contact_lies_on_link_and_object() {
    for (name, file) in [
        ("schunk_sdh", "mug/coffee_mug.ply"),
        ("human", "mug/coffee_mug.ply"),
        ("schunk_sdh", "hammer/claw_hammer.ply"),
        ("human", "hammer/claw_hammer.ply"),
    ] {
        let (hand, object) = (hand(name), object(file));
        let found = synthesize(&hand, &object, &options(150), &|_| true).unwrap();
        assert_eq!(
            found.grasps.len() + found.rejected.values().sum::<usize>(),
            found.tried
        );
        assert!(
            found.grasps.len() >= 10,
            "{name} {file}: {} grasps, {:?}",
            found.grasps.len(),
            found.rejected
        );
        for grasp in &found.grasps {
            assert_clear_and_touching(&hand, &object, grasp);
            let f = &grasp.features;
            assert!(f.qeps > 0.0 && (0.0..=1.0).contains(&f.fvol) && f.fvol_union <= 1.0 && f.dir[0] >= 0.0);
            assert!((Vector3::from(f.upos).norm() - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn one_thread_and_two_find_the_same_grasps_and_a_row_is_enough_to_make_one_again() {
    let (hand, object) = (hand("schunk_sdh"), object("mug/coffee_mug.ply"));
    let with = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| synthesize(&hand, &object, &options(80), &|_| true).unwrap())
    };
    let found = with(1);
    assert_eq!(found, with(2));
    for grasp in &found.grasps {
        assert_eq!(
            retry(&hand, &object, &options(1), grasp.try_idx)
                .unwrap()
                .as_ref(),
            Ok(grasp)
        );
    }
}

#[test]
fn a_hand_that_is_closed_again_where_it_stands_stays_and_keeps_its_quality() {
    let (hand, object) = (hand("schunk_sdh"), object("mug/coffee_mug.ply"));
    let found = synthesize(&hand, &object, &options(60), &|_| true).unwrap();
    for grasp in &found.grasps {
        let again = close(
            &hand,
            &object,
            &grasp.object_from_root,
            &grasp.joints,
            &CloseOptions::default(),
        )
        .unwrap();
        assert_eq!(
            (again.reason, again.penetration),
            (None, 0.0),
            "try {}",
            grasp.try_idx
        );
        let moved = again
            .joints
            .as_slice()
            .iter()
            .zip(grasp.joints.as_slice())
            .map(|(a, b)| (a - b).abs());
        // A link may use up what is left of its gap of 0.1 mm.
        assert!(moved.fold(0.0, f64::max) < 0.02, "try {}", grasp.try_idx);
        assert!(again.epsilon > 0.0);
    }
}

#[test]
fn a_hand_in_the_middle_of_the_object_is_told_how_deep_it_is() {
    let (hand, object) = (hand("schunk_sdh"), object("hammer/claw_hammer.ply"));
    let inside = Isometry3::translation(0.0, 0.0, -0.05);
    let closed = close(
        &hand,
        &object,
        &inside,
        &hand.preshape([0.0, 0.5]),
        &CloseOptions::default(),
    )
    .unwrap();
    assert_eq!(closed.reason, Some(Reason::StartCollision));
    assert!(
        closed.penetration > 1e-3 && closed.contacts.is_empty(),
        "{}",
        closed.penetration
    );
}

#[test]
fn a_plane_keeps_every_link_above_it_and_a_callback_can_stop_the_search() {
    let (hand, object) = (hand("schunk_sdh"), object("mug/coffee_mug.ply"));
    let above = SynthesisOptions {
        support_plane: Some(0.0),
        ..options(60)
    };
    let found = synthesize(&hand, &object, &above, &|_| true).unwrap();
    assert!(found.rejected[&Reason::BelowSupportPlane] > 0);
    for grasp in &found.grasps {
        let poses = hand.link_poses(&grasp.joints);
        for (idx, link) in hand.links().iter().enumerate() {
            for placed in &link.collision {
                let object_from_solid =
                    grasp.object_from_root * poses.as_slice()[idx] * placed.link_from_solid;
                let lowest = placed
                    .solid
                    .display_mesh()
                    .transformed(&object_from_solid)
                    .axis_aligned_bounds()
                    .0
                    .z;
                assert!(lowest > -1e-3, "`{}` at {lowest}", link.name);
            }
        }
    }
    let stopped = synthesize(&hand, &object, &options(60), &|n| n < 5);
    assert!(matches!(stopped, Err(GraspError::Stopped { tried }) if tried >= 5));
}

#[test]
fn refined_grasps_hold_at_least_as_well_and_stay_with_their_tries() {
    let (hand, object) = (hand("schunk_sdh"), object("mug/coffee_mug.ply"));
    let plain = synthesize(&hand, &object, &options(30), &|_| true).unwrap();
    let refining = SynthesisOptions {
        refinement: 4,
        ..options(30)
    };
    let refined = synthesize(&hand, &object, &refining, &|_| true).unwrap();
    assert_eq!(refined.rejected, plain.rejected);
    let better = |(before, after): (&Grasp, &Grasp)| {
        assert_eq!(before.try_idx, after.try_idx);
        assert!(after.features.qeps >= before.features.qeps);
        after.features.qeps > before.features.qeps
    };
    let n_better = plain
        .grasps
        .iter()
        .zip(&refined.grasps)
        .map(better)
        .filter(|b| *b)
        .count();
    assert!(
        n_better > plain.grasps.len() / 2,
        "{n_better} of {}",
        plain.grasps.len()
    );
    let last = refined.grasps.last().unwrap();
    assert_eq!(
        retry(&hand, &object, &refining, last.try_idx).unwrap().as_ref(),
        Ok(last)
    );
}

#[test]
fn tries_that_nobody_wants_are_passed_over_and_others_made_in_their_place() {
    let (hand, object) = (hand("schunk_sdh"), object("mug/coffee_mug.ply"));
    let open = |proposal: &Proposal| proposal.egpc[1] > 0.5;
    let mut grasps = Vec::new();
    let tally = synthesize_each(
        &hand,
        &object,
        &options(40),
        Some(&open),
        &|_| true,
        &mut |grasp| {
            grasps.push(grasp);
            true
        },
    );
    let tally = tally.unwrap();
    assert!(!grasps.is_empty() && grasps.iter().all(|g| g.features.egpc[1] > 0.5));
    let passed_over = tally.rejected[&Reason::PassedOver];
    assert_eq!(tally.tried - passed_over, 40);
    assert_eq!(tally.kept + tally.rejected.values().sum::<usize>(), tally.tried);
    let none = synthesize_each(
        &hand,
        &object,
        &options(5),
        Some(&|_| false),
        &|_| true,
        &mut |_| true,
    )
    .unwrap();
    assert_eq!((none.kept, none.rejected[&Reason::PassedOver]), (0, 500));
}
