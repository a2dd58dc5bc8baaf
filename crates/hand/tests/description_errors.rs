//! Every way in which a `hand.toml` can be wrong, and what is said of it.

mod common;

use common::{HANDS, read_urdf};
use prehend_hand::HandError;

fn description() -> String {
    std::fs::read_to_string(format!("{HANDS}/schunk_sdh/hand.toml")).expect("hand.toml is bundled")
}

fn read(hand_toml: &str) -> Result<(), HandError> {
    read_urdf(&format!("{HANDS}/schunk_sdh/schunk_sdh.urdf"))
        .with_description(hand_toml)
        .map(|_| ())
}

#[track_caller]
fn message_with(old: &str, new: &str) -> String {
    let text = description();
    assert!(text.contains(old), "hand.toml has no `{old}`");
    read(&text.replacen(old, new, 1)).expect_err(new).to_string()
}

#[track_caller]
fn assert_changed_says(old: &str, new: &str, message: &str) {
    assert_eq!(message_with(old, new), message);
}

#[test]
fn text_that_is_no_toml_is_refused_with_its_line() {
    let message = message_with("opening_width = 0.212", "opening_width =");
    assert!(
        message.starts_with("hand.toml: TOML parse error at line 7, column 16"),
        "{message}"
    );
    let message = message_with("opening_width = 0.212", "opening_widht = 0.212");
    assert!(message.contains("unknown field `opening_widht`"), "{message}");
    let message = message_with("opening_width = 0.212", "");
    assert!(message.contains("missing field `opening_width`"), "{message}");
}

#[test]
fn names_must_be_those_of_the_urdf() {
    assert_changed_says(
        "link = \"palm\"",
        "link = \"plam\"",
        "hand.toml, palm.link: `plam` is not a link of the URDF; it has palm, finger_1_knuckle, finger_1_proximal, \
         finger_1_distal, finger_2_knuckle, finger_2_proximal, finger_2_distal, thumb_knuckle, thumb_proximal, \
         thumb_distal",
    );
    let free = "it has spread, finger_1_proximal_joint, finger_1_distal_joint, finger_2_proximal_joint, \
                finger_2_distal_joint, thumb_proximal_joint, thumb_distal_joint";
    assert_changed_says(
        "[closing]\nspread = 0",
        "[closing]\nspread_mirror = 1",
        &format!("hand.toml, closing: `spread_mirror` is not a free joint of the URDF; {free}"),
    );
    assert_changed_says(
        "[origin]\nspread = 0.79",
        "[origin]\nsprad = 0.79",
        &format!("hand.toml, origin: `sprad` is not a free joint of the URDF; {free}"),
    );
    assert_changed_says(
        "[eigengrasp.direction]\nspread = 1",
        "[eigengrasp.direction]\nsprad = 1",
        &format!("hand.toml, eigengrasp[0].direction: `sprad` is not a free joint of the URDF; {free}"),
    );
    for (old, new, starts) in [
        (
            "    \"palm\",",
            "    \"pal\",",
            "hand.toml, contact_links: `pal` is not a link",
        ),
        (
            "exempt = []",
            "exempt = [[\"palm\", \"x\"]]",
            "hand.toml, self_collision_exempt[0]: `x` is not a link",
        ),
        (
            "thumb_distal = \"rubber\"",
            "tip = \"rubber\"",
            "hand.toml, material.links: `tip` is not a link",
        ),
        (
            "joints = [\"spread\",",
            "joints = [\"sprad\",",
            "hand.toml, finger[0].joints: `sprad` is not a movable joint",
        ),
        (
            "links = [\"thumb_knuckle\",",
            "links = [\"th\",",
            "hand.toml, finger[2].links: `th` is not a link",
        ),
    ] {
        let message = message_with(old, new);
        assert!(message.starts_with(starts), "{message}");
    }
}

#[test]
fn values_must_make_sense() {
    for (width, found) in [("0.0", "0"), ("-1.0", "-1"), ("nan", "NaN"), ("inf", "inf")] {
        assert_changed_says(
            "opening_width = 0.212",
            &format!("opening_width = {width}"),
            &format!("hand.toml, opening_width: found {found}; expected a positive width in metres"),
        );
    }
    assert_changed_says(
        "exempt = []",
        "exempt = []\nbreak_away = [\"spread\"]",
        "hand.toml, break_away: found `spread`, which mimics no other joint; expected mimic joints only: a free joint \
         always closes on by itself",
    );
    let orientation =
        "either `rpy`, or the directions `approach` (out of the palm) and `closing` (thumb to fingers)";
    assert_changed_says(
        "approach = [0, 0, 1]\n",
        "",
        &format!("hand.toml, palm: found no orientation, or two; expected {orientation}"),
    );
    assert_changed_says(
        "approach = [0, 0, 1]",
        "approach = [0, 0, 0]",
        "hand.toml, palm.approach: found [0.0, 0.0, 0.0]; expected a non-zero direction",
    );
    assert_changed_says(
        "closing = [1, 0, 0]",
        "closing = [0, 0, 3]",
        "hand.toml, palm.closing: found [0.0, 0.0, 3.0]; expected a direction across `approach`",
    );
    assert_changed_says(
        "translation = [-0.00953,",
        "translation = [nan,",
        "hand.toml, palm.translation: found NaN; expected finite numbers",
    );
    assert_changed_says(
        "[origin]\nspread = 0.79",
        "[origin]\nspread = 1.79",
        "hand.toml, origin.spread: found 1.79, limits [0, 1.570796327]; expected a position within the joint's limits",
    );
    assert_changed_says(
        "limits = [-0.8, 0.8]",
        "limits = [0.8, -0.8]",
        "hand.toml, eigengrasp[0].limits: found [0.8, -0.8]; expected two finite amplitudes, the lower first",
    );
    assert_changed_says(
        "[eigengrasp.direction]\nspread = 1",
        "[eigengrasp.direction]\nspread = 0",
        "hand.toml, eigengrasp[0].direction: found length 0; expected a direction with some length",
    );
    assert_changed_says(
        "finger_1_proximal_joint = 1\n",
        "finger_1_proximal_joint = nan\n",
        "hand.toml, closing.finger_1_proximal_joint: found NaN; expected finite numbers",
    );
    let one = description().rsplit_once("[[eigengrasp]]").unwrap().0.to_owned();
    assert_eq!(
        read(&one).unwrap_err().to_string(),
        "hand.toml, eigengrasp: found 1; expected two: first spread, then extension"
    );
}

#[test]
fn fingers_must_run_from_base_to_tip() {
    assert_changed_says(
        "joints = [\"thumb_proximal_joint\", \"thumb_distal_joint\"]",
        "joints = [\"thumb_distal_joint\", \"thumb_proximal_joint\"]",
        "hand.toml, finger[2].joints: found [\"thumb_distal_joint\", \"thumb_proximal_joint\"], while the way to \
         `thumb_distal` is [\"thumb_proximal_joint\", \"thumb_distal_joint\"]; expected joints on the way to the last \
         link, from base to tip",
    );
    assert_changed_says(
        "name = \"finger_2\"",
        "name = \"finger_1\"",
        "hand.toml, finger[1].name: found `finger_1` again; expected a name of its own",
    );
    assert_changed_says(
        "links = [\"thumb_knuckle\", \"thumb_proximal\", \"thumb_distal\"]",
        "links = []",
        "hand.toml, finger[2]: found no joints or no links; expected both, from base to tip",
    );
}

#[test]
fn roll_pitch_yaw_and_two_directions_say_the_same() {
    let hand = || read_urdf(&format!("{HANDS}/schunk_sdh/schunk_sdh.urdf"));
    let by_directions =
        hand().with_description(&description().replace("closing = [1, 0, 0]", "closing = [0, 2, 9]"));
    let turned = description().replace(
        "approach = [0, 0, 1]\nclosing = [1, 0, 0]",
        "rpy = [0, 0, 1.5707963267948966]",
    );
    let by_angles = hand().with_description(&turned);
    let (a, b) = (by_directions.unwrap(), by_angles.unwrap());
    let (a, b) = (a.description().unwrap().palm, b.description().unwrap().palm);
    assert!(
        (a.link_from_palm.to_homogeneous() - b.link_from_palm.to_homogeneous())
            .abs()
            .max()
            < 1e-12
    );
}
