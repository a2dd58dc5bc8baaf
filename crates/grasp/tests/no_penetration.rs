//! Closed hands, held to their promises by exact checks that share no code with the closing: nothing reaches into the
//! object, every contact lies on its link and on the object.

mod exact;

use std::path::{Path, PathBuf};

use prehend_geometry::{DecomposeOptions, MeshFormat, TriMesh, decompose, read_mesh};
use prehend_grasp::{CONTACT_TOLERANCE, GraspObject, SynthesisOptions, synthesize};
use prehend_hand::Hand;
use prehend_quality::Material;

const DEEPEST: f64 = 1e-4;

fn top() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn bundled_hand(name: &str) -> Hand {
    let folder = top().join("hands").join(name);
    let urdf = std::fs::read_to_string(folder.join(format!("{name}.urdf"))).unwrap();
    let description = std::fs::read_to_string(folder.join("hand.toml")).unwrap();
    let hand = Hand::from_urdf(&urdf, &|file| Err(file.to_owned())).unwrap();
    hand.with_description(&description).unwrap()
}

/// The vendor's hand; with its visual meshes, which are no hulls, in the place of its collision geometry.
fn vendors_schunk(shared: &Path, visual: bool) -> Hand {
    let folder = shared.join("hands/schunk_sdh");
    let mut urdf = std::fs::read_to_string(folder.join("schunk_sdh.urdf")).unwrap();
    if visual {
        urdf = urdf
            .replace("<collision>", "<unused>")
            .replace("</collision>", "</unused>");
        urdf = urdf
            .replace("<visual>", "<collision>")
            .replace("</visual>", "</collision>");
    }
    let resolve = |file: &str| std::fs::read(folder.join(file)).map_err(|e| e.to_string());
    let hand = Hand::from_urdf(&urdf, &resolve).unwrap();
    hand.with_description(include_str!("schunk_sdh_hand.toml"))
        .unwrap()
}

fn object(path: &Path, scale: f64) -> GraspObject {
    let format = MeshFormat::from_extension(path.extension().unwrap().to_str().unwrap()).unwrap();
    let mesh = read_mesh(&std::fs::read(path).unwrap(), format)
        .unwrap()
        .scaled(scale);
    let boxes = decompose(&mesh, &DecomposeOptions::default()).unwrap();
    GraspObject::new(mesh, &boxes, None, Material::Plastic).unwrap()
}

/// A hand that comes as a URDF and meshes, with the description that is worked out from them.
fn foreign_hand(urdf: &Path) -> Hand {
    let text = std::fs::read_to_string(urdf).unwrap();
    let folder = urdf.parent().unwrap();
    let resolve = |file: &str| std::fs::read(folder.join(file)).map_err(|e| e.to_string());
    let hand = Hand::from_urdf(&text, &resolve).unwrap();
    let toml = hand.propose_description().unwrap().hand_toml(&hand, "hand.urdf");
    hand.with_description(&toml).unwrap()
}

/// How often a check of many tries makes those of the quick one.
fn times() -> usize {
    std::env::var("PREHEND_TIMES").map_or(1, |n| n.parse().expect("a number"))
}

/// Closes a hand on an object and checks every grasp.
fn assert_sound(hand: &Hand, path: &Path, scale: f64, tries: usize) {
    assert_sound_on(
        hand,
        &object(path, scale),
        &path.file_stem().unwrap().display().to_string(),
        tries,
    );
}

fn assert_sound_on(hand: &Hand, object: &GraspObject, name: &str, tries: usize) {
    let options = SynthesisOptions {
        tries: tries * times(),
        seed: 5,
        ..SynthesisOptions::default()
    };
    let found = synthesize(hand, object, &options, &|_| true).unwrap();
    let what = format!("{} on {name}", hand.name());
    assert!(!found.grasps.is_empty(), "{what}: {:?}", found.rejected);
    let mut worst = [0.0_f64; 3];
    for grasp in &found.grasps {
        let of = exact::check(
            hand,
            object.surface().mesh(),
            &grasp.object_from_root,
            &grasp.joints,
            &grasp.contacts,
        );
        assert!(of.depth <= DEEPEST, "{what}, try {}: {of:?}", grasp.try_idx);
        let on_both = of.off_link <= CONTACT_TOLERANCE && of.off_object <= CONTACT_TOLERANCE;
        assert!(on_both, "{what}, try {}: {of:?}", grasp.try_idx);
        worst = [
            worst[0].max(of.depth),
            worst[1].max(of.off_link),
            worst[2].max(of.off_object),
        ];
    }
    eprintln!(
        "{what}: {} grasps, depth, off link, off object at most {worst:?}",
        found.grasps.len()
    );
}

#[test]
fn bundled_hands_end_outside_bundled_objects_and_touch_them() {
    for (name, tries) in [("human", 80), ("schunk_sdh", 16)] {
        let hand = bundled_hand(name);
        for file in [
            "mug/beer_stein",
            "hammer/ball_hammer",
            "glass/wine_glass",
            "knife/cleaver",
            "bottle/handled_jug",
        ] {
            assert_sound(
                &hand,
                &top().join("objects").join(file).with_extension("ply"),
                1.0,
                tries,
            );
        }
    }
}

#[test]
fn link_meshes_end_outside_scans_with_holes_and_faults() {
    let shared = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data"));
    if !shared.is_dir() {
        eprintln!("skipped: link meshes on scans needs ../shared/data");
        return;
    }
    let objects = shared.join("objects");
    for (visual, file, scale) in [
        (false, "mug/ycb_025_mug.obj", 1.0),
        (true, "mug/ycb_025_mug.obj", 1.0),
        (true, "bottle/ycb_006_mustard_bottle.obj", 1.0),
        (true, "glass/psb_m496.obj", 0.2),
    ] {
        assert_sound(&vendors_schunk(&shared, visual), &objects.join(file), scale, 16);
    }
}

#[test]
fn hands_described_from_their_urdf_end_outside_objects() {
    let shared = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data"));
    if !shared.is_dir() {
        eprintln!("skipped: hands described from their URDF needs ../shared/data");
        return;
    }
    for (urdf, file, tries) in [
        ("allegro_hand/allegro_hand_right.urdf", "bottle/beer_bottle", 3),
        ("barrett_hand/bhand_model.urdf", "mug/coffee_mug", 4),
        ("panda_gripper/panda_gripper.urdf", "mug/coffee_mug", 24),
    ] {
        let hand = foreign_hand(&shared.join("hands").join(urdf));
        let path = top().join("objects").join(file).with_extension("ply");
        assert_sound(&hand, &path, 1.0, tries);
    }
}

#[test]
fn walls_like_paper_and_open_sheets_are_not_hopped_over() {
    // A sheet of 80 mm by 120 mm without thickness, bent to half a tube of 40 mm radius; and the same with 0.2 mm of wall.
    let tube = |radii: &[f64]| {
        let (n, half_length) = (24u32, 0.06);
        let mut vertices = Vec::new();
        let mut triangles = Vec::new();
        for (layer, &radius) in radii.iter().enumerate() {
            let first = vertices.len() as u32;
            for i in 0..=n {
                let (s, c) = (std::f64::consts::PI * f64::from(i) / f64::from(n)).sin_cos();
                let at = |z: f64| nalgebra::Point3::new(radius * c, radius * s, z);
                vertices.extend([at(-half_length), at(half_length)]);
            }
            for i in 0..n {
                let [a, b, c, d] = [0, 1, 2, 3].map(|k| first + 2 * i + k);
                triangles.extend(match layer {
                    0 => [[a, c, b], [b, c, d]],
                    _ => [[a, b, c], [b, d, c]],
                });
            }
        }
        let mesh = TriMesh::new(vertices, triangles).unwrap();
        let boxes = decompose(&mesh, &DecomposeOptions::default()).unwrap();
        GraspObject::new(mesh, &boxes, None, Material::Plastic).unwrap()
    };
    for (name, tries) in [("human", 60), ("schunk_sdh", 24)] {
        let hand = bundled_hand(name);
        assert_sound_on(&hand, &tube(&[0.04]), "a sheet", tries);
        assert_sound_on(&hand, &tube(&[0.04, 0.0398]), "a thin wall", tries);
    }
}

#[test]
fn the_check_itself_sees_a_link_that_is_pushed_in() {
    let hand = bundled_hand("schunk_sdh");
    let object = object(&top().join("objects/mug/beer_stein.ply"), 1.0);
    let options = SynthesisOptions {
        tries: 40,
        ..SynthesisOptions::default()
    };
    let found = synthesize(&hand, &object, &options, &|_| true).unwrap();
    let grasp = found.grasps.first().unwrap();
    let contact = grasp.contacts[0];
    for pushed in [5e-4, -5e-4] {
        let mut pose = grasp.object_from_root;
        pose.translation.vector += contact.at.normal.into_inner() * pushed;
        let mesh = object.surface().mesh();
        let of = exact::check(&hand, mesh, &pose, &grasp.joints, std::slice::from_ref(&contact));
        if pushed > 0.0 {
            assert!(of.depth > 3e-4 && of.depth < 6e-4, "{of:?}");
        } else {
            assert!(of.off_link > CONTACT_TOLERANCE && of.off_link < 1e-3, "{of:?}");
        }
    }
}
