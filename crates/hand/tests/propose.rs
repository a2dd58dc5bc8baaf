//! Descriptions that nobody wrote: what is worked out of a URDF alone.

mod common;

use common::{bundled, read_urdf};
use nalgebra::Vector3;
use prehend_hand::{Confidence, Hand, HandError, Proposal};

const SHARED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/hands");

/// Two jaws that slide along y, over a plate; the second follows the first. Names need quoting.
fn gripper() -> Hand {
    let jaw = |name: &str, side: f64| {
        format!(
            r#"<link name="{name}"><collision><origin xyz="0 {} 0.03"/><geometry><box size="0.02 0.01 0.06"/></geometry></collision></link>"#,
            side * 0.005
        )
    };
    let urdf = format!(
        r#"<robot name="jaws">
          <link name="mount"/>
          <link name="plate"><collision><geometry><box size="0.04 0.12 0.02"/></geometry></collision></link>
          <joint name="on" type="fixed"><parent link="mount"/><child link="plate"/></joint>
          {}{}
          <joint name="a.&quot;b" type="prismatic"><parent link="plate"/><child link="left"/>
            <origin xyz="0 0 0.01"/><axis xyz="0 1 0"/><limit lower="0" upper="0.05" effort="1" velocity="1"/></joint>
          <joint name="right joint" type="prismatic"><parent link="plate"/><child link="right"/>
            <origin xyz="0 0 0.01"/><axis xyz="0 -1 0"/><limit lower="0" upper="0.05" effort="1" velocity="1"/>
            <mimic joint="a.&quot;b"/></joint>
        </robot>"#,
        jaw("left", 1.0),
        jaw("right", -1.0)
    );
    Hand::from_urdf(&urdf, &|file| Err(format!("{file} is not at hand"))).unwrap()
}

/// The proposal, after its text was read back.
fn read_back(hand: &Hand) -> (Hand, Proposal) {
    let proposal = hand.propose_description().unwrap();
    let text = proposal.hand_toml(hand, "x.urdf");
    assert_eq!(
        prehend_hand::urdf_named_in(&text).unwrap().as_deref(),
        Some("x.urdf")
    );
    let described = hand.clone().with_description(&text);
    (described.unwrap_or_else(|e| panic!("{e}\n{text}")), proposal)
}

#[test]
fn two_jaws_close_on_each_other_before_the_plate() {
    let (hand, proposal) = read_back(&gripper());
    let d = hand.description().unwrap();
    assert_eq!(hand.link(d.palm.link).name, "plate");
    assert_eq!(d.fingers.len(), 2);
    assert_eq!((d.closing.len(), d.closing[0].speed), (1, -1.0));
    let axis = |v: Vector3<f64>| d.palm.link_from_palm.rotation * v;
    assert!((axis(Vector3::z()) - Vector3::z()).norm() < 1e-6);
    assert!(axis(Vector3::x()).y.abs() > 0.999_999);
    assert!(
        (d.palm.link_from_palm.translation.z - 0.01).abs() < 1e-6,
        "on the plate"
    );
    assert!((d.opening_width - 0.1).abs() < 1e-4);
    // Pre-shapes are from half open to open.
    for egpc in [[-1.0, -1.0], [0.0, 0.0], [1.0, 1.0]] {
        let opened = hand.preshape(egpc).as_slice()[0];
        assert!((0.0249..=0.05).contains(&opened), "{egpc:?}: {opened}");
    }
    let sure: Vec<Confidence> = proposal.guesses.iter().map(|g| g.confidence).collect();
    assert_eq!(sure[..3], [Confidence::High; 3], "fingers, closing, palm");
}

#[test]
fn what_is_no_hand_is_refused_with_the_reason() {
    let refused = |urdf: &str| {
        let hand = Hand::from_urdf(urdf, &|_| Err(String::new())).unwrap();
        let error = hand.propose_description().unwrap_err();
        assert!(matches!(error, HandError::NotAHand { .. }));
        error.to_string()
    };
    assert_eq!(
        refused(r#"<robot name="a"><link name="a"/></robot>"#),
        "how this closes cannot be worked out: no link has a <collision> shape; add shapes to touch with"
    );
    let ball = r#"<collision><geometry><sphere radius="0.1"/></geometry></collision>"#;
    assert_eq!(
        refused(&format!(
            r#"<robot name="a"><link name="a">{ball}</link></robot>"#
        )),
        "how this closes cannot be worked out: no movable joint carries a link with a shape; a hand needs at least one \
         finger that moves"
    );
    // A ball that turns about its own middle comes no nearer to anything.
    let turning = format!(
        r#"<robot name="a"><link name="a">{ball}</link><link name="b">{ball}</link>
        <joint name="j" type="continuous"><parent link="a"/><child link="b"/><origin xyz="0 0 1"/><axis xyz="0 0 1"/></joint>
        </robot>"#
    );
    assert_eq!(
        refused(&turning),
        "how this closes cannot be worked out: moving its joints brings no finger nearer to another one or to the palm; \
         check joint limits and axes"
    );
}

#[test]
fn the_bundled_hands_are_found_to_be_what_their_descriptions_say() {
    for name in ["human", "schunk_sdh"] {
        let written = bundled(name);
        let (found, _) = read_back(&written);
        let (w, f) = (written.description().unwrap(), found.description().unwrap());
        assert_eq!(f.palm.link, w.palm.link, "{name}");
        assert_eq!(f.fingers.len(), w.fingers.len(), "{name}");
        assert_eq!(f.closing, w.closing, "{name}: the same joints, the same way");
        assert_eq!(f.contact_links, w.contact_links, "{name}");
        for axis in [Vector3::z(), Vector3::x()] {
            let (a, b) = (f.palm.link_from_palm * axis, w.palm.link_from_palm * axis);
            assert!(a.dot(&b) > 0.99, "{name}: {a} and {b}");
        }
        // The Schunk's thumb stands on a knuckle that does not move: part of the palm here, of the thumb there.
        let thumbs = |d: &prehend_hand::Description| -> Vec<_> {
            let thumbs = d.fingers.iter().filter(|f| f.name == "thumb");
            thumbs.map(|f| f.links.last().copied()).collect()
        };
        assert_eq!(thumbs(f), thumbs(w), "{name}");
    }
}

/// Palm link, approach and closing direction in its frame, number of fingers, of closing joints, opening width (m)
/// between these.
type Expected = (
    &'static str,
    &'static str,
    [f64; 3],
    [f64; 3],
    usize,
    usize,
    [f64; 2],
);

#[test]
fn hands_from_elsewhere_are_found_to_close_as_they_do() {
    if !std::path::Path::new(SHARED).exists() {
        eprintln!("skipped: proposed descriptions of other hands needs ../shared/data");
        return;
    }
    let expected: [Expected; 4] = [
        (
            "allegro_hand/allegro_hand_right.urdf",
            "base_link",
            [1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0],
            4,
            11,
            [0.08, 0.18],
        ),
        (
            "barrett_hand/bhand_model.urdf",
            "base_link",
            [0.0, 0.0, 1.0],
            [0.0, 1.0, 0.0],
            3,
            6,
            [0.15, 0.3],
        ),
        (
            "panda_gripper/panda_gripper.urdf",
            "panda_hand",
            [0.0, 0.0, 1.0],
            [0.0, -1.0, 0.0],
            2,
            1,
            [0.079, 0.081],
        ),
        (
            "schunk_sdh/schunk_sdh.urdf",
            "sdh_palm_link",
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 0.0],
            3,
            6,
            [0.09, 0.25],
        ),
    ];
    for (urdf, palm, approach, closing, n_fingers, n_closing, [low, high]) in expected {
        let (hand, _) = read_back(&read_urdf(&format!("{SHARED}/{urdf}")));
        let d = hand.description().unwrap();
        assert_eq!(hand.link(d.palm.link).name, palm);
        let rotation = d.palm.link_from_palm.rotation;
        assert!(
            (rotation * Vector3::z()).dot(&Vector3::from(approach)) > 0.99,
            "{urdf}"
        );
        assert!(
            (rotation * Vector3::x()).dot(&Vector3::from(closing)) > 0.99,
            "{urdf}"
        );
        assert_eq!(
            (d.fingers.len(), d.closing.len()),
            (n_fingers, n_closing),
            "{urdf}"
        );
        assert!(
            (low..high).contains(&d.opening_width),
            "{urdf}: {}",
            d.opening_width
        );
    }
}
