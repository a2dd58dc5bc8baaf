//! A mug and a hammer made in code, a gripper made in code, and what the tutor says of plain cases.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, UnitVector3, Vector3};
use prehend_geometry::{ContactPoint, OrientedBox, Surface, TriMesh};
use prehend_hand::{Hand, LinkIdx};
use prehend_tutor::{
    GraspView, Judgement, ObjectClass, Opening, Parts, Persona, Rule, Task, Thresholds, TutorError,
    TutorHand, TutorObject, judge, observe,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const N_SIDES: u32 = 48;

#[derive(Default)]
struct Builder {
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
}

impl Builder {
    /// Surface of revolution about z through (radius, height) points, for a profile with the solid on its left.
    fn revolve(mut self, profile: &[(f64, f64)]) -> Self {
        for (r, z) in profile {
            for j in 0..N_SIDES {
                let (s, c) = (TAU * f64::from(j) / f64::from(N_SIDES)).sin_cos();
                self.vertices.push(Point3::new(r * c, r * s, *z));
            }
        }
        let at = |ring: usize, j: u32| ring as u32 * N_SIDES + j % N_SIDES;
        for ring in 0..profile.len() - 1 {
            for j in 0..N_SIDES {
                self.triangles
                    .push([at(ring, j), at(ring, j + 1), at(ring + 1, j + 1)]);
                self.triangles
                    .push([at(ring, j), at(ring + 1, j + 1), at(ring + 1, j)]);
            }
        }
        self
    }

    fn cuboid(mut self, low: [f64; 3], high: [f64; 3]) -> Self {
        let base = self.vertices.len() as u32;
        for i in 0..8 {
            let pick = |k: usize| if i >> k & 1 == 1 { high[k] } else { low[k] };
            self.vertices.push(Point3::new(pick(0), pick(1), pick(2)));
        }
        for q in [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ] {
            let [a, b, c, d] = q.map(|i| base + i);
            self.triangles.extend([[a, b, c], [a, c, d]]);
        }
        self
    }

    fn object(self, object_type: &str, parts: &Parts) -> Result<TutorObject, TutorError> {
        let surface = Surface::new(TriMesh::new(self.vertices, self.triangles).unwrap());
        TutorObject::new(
            &surface,
            parts,
            ObjectClass::of(object_type, parts),
            &Thresholds::default(),
            1,
        )
    }
}

fn part(low: [f64; 3], high: [f64; 3]) -> OrientedBox {
    let (low, high) = (Vector3::from(low), Vector3::from(high));
    OrientedBox::new(
        Point3::from((low + high) / 2.0),
        Rotation3::identity(),
        high - low,
    )
    .unwrap()
}

/// Radius 40 mm, height 100 mm, wall 3 mm; a square handle at +x.
fn mug() -> TutorObject {
    let parts = Parts {
        opening: Some(Opening {
            center: Point3::new(0.0, 0.0, 0.1),
            normal: Vector3::z_axis(),
            radius: 0.037,
        }),
        handle: vec![part([0.0415, -0.008, 0.018], [0.072, 0.008, 0.087])],
        functional: vec![part([-0.041, -0.041, 0.0], [0.041, 0.041, 0.1])],
        sharp: vec![],
    };
    Builder::default()
        .revolve(&[
            (0.0, 0.0),
            (0.040, 0.0),
            (0.040, 0.1),
            (0.037, 0.1),
            (0.037, 0.005),
            (0.0, 0.005),
        ])
        .cuboid([0.039, -0.006, 0.075], [0.070, 0.006, 0.085])
        .cuboid([0.060, -0.006, 0.030], [0.070, 0.006, 0.075])
        .cuboid([0.039, -0.006, 0.020], [0.070, 0.006, 0.030])
        .object("mug", &parts)
        .unwrap()
}

/// Handle along z, 0 to 250 mm, head along x on top.
fn hammer() -> TutorObject {
    let parts = Parts {
        handle: vec![part([-0.016, -0.013, 0.0], [0.016, 0.013, 0.248])],
        functional: vec![part([-0.051, -0.016, 0.2495], [0.051, 0.016, 0.281])],
        ..Parts::default()
    };
    Builder::default()
        .cuboid([-0.015, -0.012, 0.0], [0.015, 0.012, 0.25])
        .cuboid([-0.05, -0.015, 0.25], [0.05, 0.015, 0.28])
        .object("hammer", &parts)
        .unwrap()
}

/// A palm with its top at z = 0 and two straight 60 mm fingers along z that slide along x: the thumb at −x.
fn gripper() -> Hand {
    let link = |name: &str, x: f64, z: f64, size: &str| {
        format!(
            r#"<link name="{name}"><collision><origin xyz="{x} 0 {z}"/><geometry><box size="{size}"/></geometry></collision></link>"#
        )
    };
    let slide = |child: &str, x: f64| {
        format!(
            r#"<joint name="{child}_slide" type="prismatic"><parent link="palm"/><child link="{child}"/><axis xyz="{x} 0 0"/>
               <limit lower="0" upper="0.06" effort="1" velocity="1"/></joint>"#
        )
    };
    let urdf = [
        r#"<robot name="gripper">"#.to_owned(),
        link("palm", 0.0, -0.01, "0.12 0.03 0.02"),
        link("thumb", -0.005, 0.03, "0.01 0.02 0.06"),
        link("finger", 0.005, 0.03, "0.01 0.02 0.06"),
        slide("thumb", -1.0),
        slide("finger", 1.0),
        "</robot>".to_owned(),
    ]
    .concat();
    let toml = r#"
        opening_width = 0.12
        contact_links = ["palm", "thumb", "finger"]
        self_collision_exempt = []
        [palm]
        link = "palm"
        translation = [0, 0, 0]
        approach = [0, 0, 1]
        closing = [1, 0, 0]
        [material]
        default = "rubber"
        [closing]
        thumb_slide = -1
        finger_slide = -1
        [origin]
        [[finger]]
        name = "thumb"
        joints = ["thumb_slide"]
        links = ["thumb"]
        [[finger]]
        name = "finger"
        joints = ["finger_slide"]
        links = ["finger"]
        [[eigengrasp]]
        name = "spread"
        limits = [0, 0.06]
        direction = { thumb_slide = 1 }
        [[eigengrasp]]
        name = "extension"
        limits = [0, 0.06]
        direction = { finger_slide = 1 }
    "#;
    Hand::from_urdf(&urdf, &|file| Err(file.to_owned()))
        .unwrap()
        .with_description(toml)
        .unwrap()
}

/// A grasp by the gripper: where the palm is, how far each finger stands from the middle, and what touches.
struct Case {
    pose: Isometry3<f64>,
    half: f64,
    contacts: Vec<([f64; 3], [f64; 3])>,
}

/// Both fingers touch 40 mm over the palm, unless the test says otherwise.
fn case(palm: [f64; 3], approach: Vector3<f64>, closing: Vector3<f64>, half: f64) -> Case {
    let axes = Matrix3::from_columns(&[closing, approach.cross(&closing), approach]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    let pose = Isometry3::from_parts(Translation3::from(Vector3::from(palm)), rotation);
    let at = |side: f64| pose * Point3::new(side * half, 0.0, 0.04);
    let contacts = [-1.0, 1.0]
        .map(|side| (at(side).coords.into(), (-side * closing).into()))
        .to_vec();
    Case { pose, half, contacts }
}

fn judged(object: &TutorObject, case: &Case, persona: Persona) -> Judgement {
    let hand = gripper();
    let tutor_hand = TutorHand::new(&hand).unwrap();
    let posture = BTreeMap::from(["thumb_slide", "finger_slide"].map(|joint| (joint.to_owned(), case.half)));
    let joints = hand.positions(&posture).unwrap();
    let contact = |(point, normal): &([f64; 3], [f64; 3])| {
        let normal = UnitVector3::new_normalize(Vector3::from(*normal));
        (
            LinkIdx(1),
            ContactPoint {
                point: (*point).into(),
                normal,
            },
        )
    };
    let contacts: Vec<(LinkIdx, ContactPoint)> = case.contacts.iter().map(contact).collect();
    let thresholds = Thresholds::default();
    let view = GraspView {
        object_from_root: case.pose,
        joints: &joints,
        contacts: &contacts,
    };
    judge(
        &observe(&tutor_hand, object, &view, &thresholds),
        persona,
        &thresholds,
    )
}

fn p(judgement: &Judgement, task: Task) -> f64 {
    judgement.of(task).probability
}

fn margin(judgement: &Judgement, rule: Rule) -> f64 {
    judgement
        .of(rule.task())
        .rules
        .iter()
        .find(|r| r.rule == rule)
        .unwrap()
        .margin
}

/// From −x, away from the handle, closing along y around the wall, well below the rim.
fn mug_from_the_side() -> Case {
    case([-0.06, 0.0, 0.045], Vector3::x(), Vector3::y(), 0.041)
}

#[test]
fn a_mug_held_from_the_side_can_be_poured_from_and_never_used_as_a_tool() {
    let judgement = judged(&mug(), &mug_from_the_side(), Persona::Lenient);
    assert!(p(&judgement, Task::Pouring) > 0.9, "{judgement:#?}");
    assert_eq!(
        (p(&judgement, Task::ToolUse), judgement.of(Task::ToolUse).deciding),
        (0.0, None)
    );
    assert!(judgement.of(Task::ToolUse).rules.is_empty());
}

#[test]
fn a_mug_held_from_the_top_cannot_be_poured_from() {
    // The palm straight over the opening, the fingers down the outside of the wall.
    let top = case([0.0, 0.0, 0.14], -Vector3::z(), Vector3::y(), 0.041);
    let judgement = judged(&mug(), &top, Persona::Lenient);
    assert!(p(&judgement, Task::Pouring) < 0.01);
    // Straight down: no angle at all, 45° short.
    assert!((margin(&judgement, Rule::ApproachOffOpening) + 45_f64.to_radians()).abs() < 1e-6);
}

#[test]
fn a_finger_in_the_opening_speaks_against_pouring() {
    // At 60° to the vertical, one finger inside the wall, one outside.
    let (sin, cos) = 60_f64.to_radians().sin_cos();
    let mut inside = case(
        [0.0, -0.05, 0.13],
        Vector3::new(0.0, sin, -cos),
        Vector3::x(),
        0.012,
    );
    inside.contacts = vec![
        ([0.0, -0.037, 0.08], [0.0, -1.0, 0.0]),
        ([0.0, -0.040, 0.08], [0.0, 1.0, 0.0]),
    ];
    let judgement = judged(&mug(), &inside, Persona::Lenient);
    assert_eq!(margin(&judgement, Rule::InsideUntouched), -1.0);
    assert!(margin(&judgement, Rule::OpeningClear) < 0.0);
    assert!(p(&judgement, Task::Pouring) < 0.05);
}

#[test]
fn a_mug_held_by_the_handle_leaves_the_receiver_the_wall_but_not_the_handle() {
    // From +x, pinching the handle's upright between thumb and finger.
    let mut handle = case([0.10, 0.0, 0.05], -Vector3::x(), -Vector3::y(), 0.006);
    handle.contacts = vec![
        ([0.065, 0.006, 0.05], [0.0, -1.0, 0.0]),
        ([0.065, -0.006, 0.05], [0.0, 1.0, 0.0]),
    ];
    let lenient = judged(&mug(), &handle, Persona::Lenient);
    assert!(p(&lenient, Task::HandOver) > 0.8, "{lenient:#?}");
    let receiver = judged(&mug(), &handle, Persona::ReceiverFirst);
    assert!(p(&receiver, Task::HandOver) < 0.05);
    assert_eq!(receiver.of(Task::HandOver).deciding, Some(Rule::HandleLeftFree));
    // Handle and wall at once is another matter.
    handle.contacts.push(([0.040, 0.0, 0.05], [-1.0, 0.0, 0.0]));
    let both = judged(&mug(), &handle, Persona::Lenient);
    assert_eq!(both.of(Task::HandOver).deciding, Some(Rule::NotHandleAndWall));
    // Two contacts on the handle, one on the wall.
    assert_eq!(margin(&both, Rule::NotHandleAndWall), 0.0);
}

#[test]
fn a_hammer_is_used_by_its_handle_and_handed_over_by_its_head() {
    let hammer = hammer();
    let by_handle = case([0.0, -0.045, 0.08], Vector3::y(), Vector3::x(), 0.015);
    let judgement = judged(&hammer, &by_handle, Persona::Lenient);
    assert!(p(&judgement, Task::ToolUse) > 0.9, "{judgement:#?}");
    // From the top, over the head.
    let by_head = case([0.0, 0.0, 0.31], -Vector3::z(), Vector3::y(), 0.015);
    let judgement = judged(&hammer, &by_head, Persona::ReceiverFirst);
    assert!(p(&judgement, Task::ToolUse) < 0.01);
    assert!(p(&judgement, Task::HandOver) > 0.9, "{judgement:#?}");
    assert_eq!(p(&judgement, Task::Pouring), 0.0);
}

#[test]
fn a_hand_that_closes_along_the_handle_does_not_use_the_tool() {
    let along = case([0.0, -0.045, 0.08], Vector3::y(), Vector3::z(), 0.03);
    let judgement = judged(&hammer(), &along, Persona::Lenient);
    assert_eq!(judgement.of(Task::ToolUse).deciding, Some(Rule::ClosesAcross));
    assert!(p(&judgement, Task::ToolUse) < 0.05);
}

#[test]
fn a_blade_that_is_all_that_is_free_is_no_place_for_a_receiver() {
    let blade = part([-0.016, -0.002, 0.0905], [0.016, 0.002, 0.251]);
    let parts = Parts {
        handle: vec![part([-0.013, -0.009, -0.001], [0.013, 0.009, 0.09])],
        functional: vec![blade],
        sharp: vec![blade],
        ..Parts::default()
    };
    let knife = Builder::default()
        .cuboid([-0.012, -0.008, 0.0], [0.012, 0.008, 0.09])
        .cuboid([-0.015, -0.001, 0.09], [0.015, 0.001, 0.25])
        .object("knife", &parts)
        .unwrap();
    // By the handle's middle: the blade is free, but sharp.
    let by_handle = case([0.0, -0.045, 0.045], Vector3::y(), Vector3::x(), 0.012);
    let judgement = judged(&knife, &by_handle, Persona::Lenient);
    assert!(p(&judgement, Task::ToolUse) > 0.9);
    assert!(p(&judgement, Task::HandOver) < 0.2, "{judgement:#?}");
    assert_eq!(
        judgement.of(Task::HandOver).deciding,
        Some(Rule::PatchForReceiver)
    );
}

#[test]
fn the_same_seed_draws_the_same_labels() {
    let judgement = judged(&mug(), &mug_from_the_side(), Persona::Strict);
    let draw = || {
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        (0..50)
            .map(|_| judgement.draw(0.08, &mut rng))
            .collect::<Vec<_>>()
    };
    assert_eq!(draw(), draw());
}

#[test]
fn a_hand_far_away_leaves_everything_free() {
    let far = case([5.0, 0.0, 0.0], Vector3::x(), Vector3::y(), 0.02);
    assert!(p(&judged(&hammer(), &far, Persona::ReceiverFirst), Task::HandOver) > 0.99);
}

#[test]
fn errors_say_what_is_missing() {
    let bare = "<robot name=\"stick\"><link name=\"a\"/></robot>";
    let bare = Hand::from_urdf(bare, &|file| Err(file.to_owned())).unwrap();
    assert_eq!(
        TutorHand::new(&bare).unwrap_err().to_string(),
        "the hand `stick` has no description; the tutor needs its palm frame, from `hand.toml`"
    );
    let parts = Parts {
        opening: Some(Opening {
            center: Point3::origin(),
            normal: Vector3::z_axis(),
            radius: 0.0,
        }),
        ..Parts::default()
    };
    let error = Builder::default()
        .cuboid([0.0; 3], [0.1; 3])
        .object("can", &parts)
        .unwrap_err();
    assert!(matches!(error, TutorError::BadOpening { radius: 0.0, .. }));
}
