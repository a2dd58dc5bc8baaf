//! Hands of every kind that a URDF can tell: how each closes is worked out from shape alone.

use std::fmt::Write as _;

use nalgebra::Vector3;
use prehend_hand::{Hand, Proposal, urdf_below};

/// Joints and links of a URDF, put together piece by piece.
#[derive(Default)]
struct Urdf(String);

impl Urdf {
    /// A link that is a box: its size, and where its middle is.
    fn link(mut self, name: &str, size: [f64; 3], middle: [f64; 3]) -> Self {
        let [[a, b, c], [x, y, z]] = [size, middle];
        write!(
            self.0,
            r#"<link name="{name}"><collision><origin xyz="{x} {y} {z}"/><geometry><box size="{a} {b} {c}"/></geometry></collision></link>"#
        )
        .unwrap();
        self
    }

    /// A joint that stands at `xyz`, turned by `yaw`; `more` holds its limits and whom it follows.
    fn joint(
        mut self,
        name: &str,
        kind: &str,
        ends: [&str; 2],
        at: ([f64; 3], f64),
        axis: &str,
        more: &str,
    ) -> Self {
        let [parent, child] = ends;
        let ([x, y, z], yaw) = at;
        write!(
            self.0,
            r#"<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="{x} {y} {z}" rpy="0 0 {yaw}"/><axis xyz="{axis}"/>{more}</joint>"#
        )
        .unwrap();
        self
    }

    /// A finger of two links on the palm, 4 cm from its middle at an angle; it bends inwards with negative values.
    fn finger(self, name: &str, angle: f64, first: &str, more: &str) -> Self {
        let [base, tip] = [format!("{name}1"), format!("{name}2")];
        let at = [0.04 * angle.cos(), 0.04 * angle.sin(), 0.02];
        self.link(&base, [0.016, 0.016, 0.05], [0.0, 0.0, 0.025])
            .link(&tip, [0.014, 0.014, 0.045], [0.0, 0.0, 0.022])
            .joint(
                &format!("{name}_base"),
                first,
                ["palm", &base],
                (at, angle),
                "0 1 0",
                r#"<limit lower="-1.2" upper="0.6"/>"#,
            )
            .joint(
                &format!("{name}_tip"),
                "revolute",
                [&base, &tip],
                ([0.0, 0.0, 0.05], 0.0),
                "0 1 0",
                more,
            )
    }

    fn text(&self) -> String {
        format!("<robot name=\"kind\">{}</robot>", self.0)
    }

    fn hand(&self) -> Hand {
        read(&self.text())
    }
}

fn read(urdf: &str) -> Hand {
    Hand::from_urdf(urdf, &|file| Err(format!("{file} is not at hand"))).unwrap()
}

const BEND: &str = r#"<limit lower="-1.6" upper="0.1"/>"#;

fn three_fingers(first: &str) -> Urdf {
    let around = std::f64::consts::TAU / 3.0;
    Urdf::default()
        .link("palm", [0.08, 0.08, 0.04], [0.0; 3])
        .finger("a", 0.0, first, BEND)
        .finger("b", around, first, BEND)
        .finger("c", -around, first, BEND)
}

/// Two plates that slide over a third.
fn jaws(second: &str) -> Urdf {
    let slide = r#"<limit lower="0" upper="0.05"/>"#;
    Urdf::default()
        .link("palm", [0.04, 0.12, 0.02], [0.0; 3])
        .link("left", [0.02, 0.01, 0.06], [0.0, 0.005, 0.03])
        .link("right", [0.02, 0.01, 0.06], [0.0, -0.005, 0.03])
        .joint(
            "l",
            "prismatic",
            ["palm", "left"],
            ([0.0, 0.0, 0.01], 0.0),
            "0 1 0",
            slide,
        )
        .joint(
            "r",
            "prismatic",
            ["palm", "right"],
            ([0.0, 0.0, 0.01], 0.0),
            "0 -1 0",
            &format!("{slide}{second}"),
        )
}

/// Six joints and a plate to mount something on, `palm`'s parent; then what is mounted.
fn on_an_arm(hand: &Urdf) -> Urdf {
    let mut arm = Urdf::default().link("floor", [0.2, 0.2, 0.1], [0.0; 3]);
    let mut below = "floor".to_owned();
    for (k, axis) in ["0 0 1", "0 1 0", "0 1 0", "0 0 1", "0 1 0", "0 0 1"]
        .iter()
        .enumerate()
    {
        let name = format!("arm{k}");
        arm = arm.link(&name, [0.05, 0.05, 0.15], [0.0, 0.0, 0.08]).joint(
            &format!("turn{k}"),
            "revolute",
            [&below, &name],
            ([0.0, 0.0, 0.18], 0.0),
            axis,
            r#"<limit lower="-3" upper="3"/>"#,
        );
        below = name;
    }
    arm.0 += &hand.0;
    arm.joint(
        "mount",
        "fixed",
        [&below, "palm"],
        ([0.0, 0.0, 0.18], 0.0),
        "0 0 1",
        "",
    )
}

/// Read back, and looked at: z of the palm is the root's, and no pre-shape far from closed collides.
#[track_caller]
fn described(hand: &Hand) -> (Hand, Proposal) {
    let proposal = hand.propose_description().unwrap();
    let text = proposal.hand_toml(hand, "x.urdf");
    let described = hand.clone().with_description(&text).unwrap();
    let approach = described.description().unwrap().palm.link_from_palm * Vector3::z();
    assert!((approach - Vector3::z()).norm() < 1e-6, "{approach}");
    (described, proposal)
}

#[track_caller]
fn closing(hand: &Hand) -> Vec<(String, f64)> {
    let closing = hand.description().unwrap().closing.iter();
    closing
        .map(|c| (hand.joint(c.joint).name.clone(), c.speed))
        .collect()
}

#[test]
fn fingers_that_stand_evenly_around_all_close_inwards() {
    for first in ["revolute", "continuous"] {
        let (hand, _) = described(&three_fingers(first).hand());
        assert_eq!(hand.description().unwrap().fingers.len(), 3);
        let closing = closing(&hand);
        assert_eq!(closing.len(), 6);
        assert!(
            closing.iter().all(|(_, speed)| *speed == -1.0),
            "{first}: {closing:?}"
        );
    }
}

#[test]
fn followers_of_followers_close_with_their_leader() {
    let follow = |leader: &str| format!(r#"{BEND}<mimic joint="{leader}" multiplier="0.8" offset="-0.1"/>"#);
    let urdf = Urdf::default()
        .link("palm", [0.1, 0.08, 0.04], [0.0; 3])
        .finger("a", 0.0, "revolute", &follow("a_base"))
        .finger("b", std::f64::consts::PI, "revolute", &follow("a_tip"));
    let (hand, _) = described(&urdf.hand());
    assert_eq!(hand.n_dof(), 2);
    assert_eq!(
        closing(&hand),
        [("a_base".to_owned(), -1.0), ("b_base".to_owned(), -1.0)]
    );
}

#[test]
fn jaws_close_together_or_each_by_itself() {
    let (coupled, _) = described(&jaws(r#"<mimic joint="l"/>"#).hand());
    assert_eq!(closing(&coupled), [("l".to_owned(), -1.0)]);
    let (free, _) = described(&jaws("").hand());
    assert_eq!(closing(&free), [("l".to_owned(), -1.0), ("r".to_owned(), -1.0)]);
    for hand in [coupled, free] {
        let width = hand.description().unwrap().opening_width;
        assert!((0.09..=0.1).contains(&width), "{width}");
    }
}

#[test]
fn tongs_close_at_their_tips_though_their_hinges_are_as_near_as_ever() {
    let limit = r#"<limit lower="-0.6" upper="0.15"/>"#;
    let urdf = Urdf::default()
        .link("palm", [0.03, 0.06, 0.02], [0.0; 3])
        .link("left", [0.012, 0.01, 0.1], [0.0, 0.0, 0.05])
        .link("right", [0.012, 0.01, 0.1], [0.0, 0.0, 0.05])
        .joint(
            "l",
            "revolute",
            ["palm", "left"],
            ([0.0, 0.015, 0.01], 0.0),
            "1 0 0",
            limit,
        )
        .joint(
            "r",
            "revolute",
            ["palm", "right"],
            ([0.0, -0.015, 0.01], 0.0),
            "-1 0 0",
            &format!(r#"{limit}<mimic joint="l"/>"#),
        );
    let (hand, _) = described(&urdf.hand());
    assert_eq!(closing(&hand), [("l".to_owned(), 1.0)]);
}

#[test]
fn tongs_that_are_closed_at_0_close_towards_0() {
    let limit = r#"<limit lower="0" upper="0.55"/>"#;
    let urdf = Urdf::default()
        .link("palm", [0.06, 0.06, 0.1], [0.0, 0.0, -0.05])
        .link("left", [0.02, 0.01, 0.06], [0.0, 0.006, 0.03])
        .link("right", [0.02, 0.01, 0.06], [0.0, -0.006, 0.03])
        .joint(
            "l",
            "revolute",
            ["palm", "left"],
            ([0.0, 0.0, 0.01], 0.0),
            "-1 0 0",
            limit,
        )
        .joint(
            "r",
            "revolute",
            ["palm", "right"],
            ([0.0, 0.0, 0.01], 0.0),
            "1 0 0",
            limit,
        );
    let (hand, _) = described(&urdf.hand());
    assert_eq!(closing(&hand), [("l".to_owned(), -1.0), ("r".to_owned(), -1.0)]);
}

#[test]
fn one_jaw_closes_on_a_fixed_one() {
    let urdf = Urdf::default()
        .link("palm", [0.04, 0.12, 0.02], [0.0; 3])
        .link("left", [0.02, 0.01, 0.06], [0.0, 0.005, 0.03])
        .link("right", [0.02, 0.01, 0.06], [0.0, -0.005, 0.03])
        .joint(
            "l",
            "prismatic",
            ["palm", "left"],
            ([0.0, 0.0, 0.01], 0.0),
            "0 1 0",
            r#"<limit lower="0" upper="0.05"/>"#,
        )
        .joint(
            "r",
            "fixed",
            ["palm", "right"],
            ([0.0, 0.0, 0.01], 0.0),
            "0 0 1",
            "",
        );
    let (hand, _) = described(&urdf.hand());
    let d = hand.description().unwrap();
    assert_eq!(
        (hand.link(d.palm.link).name.as_str(), closing(&hand)),
        ("palm", vec![("l".to_owned(), -1.0)])
    );
    assert!((0.04..0.08).contains(&d.opening_width), "{}", d.opening_width);
}

#[test]
fn an_arm_below_the_palm_is_no_part_of_the_hand_and_a_wrist_is() {
    let robot = on_an_arm(&three_fingers("revolute"));
    let whole = robot.hand();
    let base = whole.base_of_hand().unwrap();
    assert_eq!(whole.link(base).name, "arm5", "the plate moves with the palm");
    let cut = read(&urdf_below(&robot.text(), "arm5").unwrap());
    assert_eq!((cut.n_dof(), cut.links().len()), (6, 8));
    assert_eq!(cut.base_of_hand().unwrap(), cut.root());
    let (hand, _) = described(&cut);
    assert_eq!(hand.link(hand.description().unwrap().palm.link).name, "palm");

    let mut wrist = Urdf::default()
        .link("forearm", [0.06, 0.06, 0.2], [0.0, 0.0, -0.1])
        .joint(
            "bend",
            "revolute",
            ["forearm", "palm"],
            ([0.0, 0.0, 0.05], 0.0),
            "0 1 0",
            r#"<limit lower="-1" upper="1"/>"#,
        );
    wrist.0 += &three_fingers("revolute").0;
    let hand = wrist.hand();
    assert_eq!(hand.base_of_hand().unwrap(), hand.root());
}

#[test]
fn a_robot_with_two_hands_is_asked_which() {
    let one = on_an_arm(&jaws("")).0;
    let mut other = one.clone();
    let mut names: Vec<String> = ["floor", "mount", "palm", "left", "right", "l", "r"]
        .map(str::to_owned)
        .into();
    names.extend((0..6).flat_map(|k| [format!("arm{k}"), format!("turn{k}")]));
    for name in names {
        other = other.replace(&format!("\"{name}\""), &format!("\"other_{name}\""));
    }
    let beside = Urdf(one + &other).joint(
        "beside",
        "fixed",
        ["floor", "other_floor"],
        ([0.0, 1.0, 0.0], 0.0),
        "0 0 1",
        "",
    );
    let error = beside.hand().base_of_hand().unwrap_err().to_string();
    assert_eq!(
        error,
        "how this closes cannot be worked out: it branches at `floor` into parts that reach 1.2 m, which are no fingers; \
         2 hands hang on it: take the one that begins at `arm5` or `other_arm5`"
    );
}
