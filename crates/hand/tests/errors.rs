//! Every way in which a hand's files can be wrong, and what is said of it.

use std::collections::BTreeMap;

use prehend_hand::{Hand, HandError};

/// A URDF of a palm, a finger of two joints and one that mimics, with one piece replaced.
fn urdf_with(old: &str, new: &str) -> String {
    let urdf = r#"<robot name="gripper">
  <link name="palm"><collision><geometry><box size="0.1 0.1 0.02"/></geometry></collision></link>
  <link name="base"/>
  <link name="tip"><collision><geometry><mesh filename="package://gripper/tip.stl" scale="1 1 1"/></geometry></collision></link>
  <link name="other"/>
  <joint name="knuckle" type="revolute">
    <parent link="palm"/> <child link="base"/> <axis xyz="0 1 0"/>
    <limit lower="-0.5" upper="1.5" effort="1" velocity="1"/>
  </joint>
  <joint name="bend" type="revolute">
    <parent link="base"/> <child link="tip"/> <axis xyz="0 1 0"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/>
  </joint>
  <joint name="follower" type="prismatic">
    <parent link="palm"/> <child link="other"/> <axis xyz="1 0 0"/>
    <mimic joint="knuckle" multiplier="0.5" offset="0.1"/>
  </joint>
</robot>"#;
    assert!(urdf.contains(old), "the template has no `{old}`");
    urdf.replacen(old, new, 1)
}

/// A tetrahedron in ASCII STL.
fn tip_stl() -> Vec<u8> {
    let corners = ["0 0 0", "0.01 0 0", "0 0.01 0", "0 0 0.01"];
    let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].map(|[a, b, c]: [usize; 3]| {
        let (a, b, c) = (corners[a], corners[b], corners[c]);
        format!("facet normal 0 0 0\nouter loop\nvertex {a}\nvertex {b}\nvertex {c}\nendloop\nendfacet\n")
    });
    format!("solid tip\n{}endsolid tip\n", faces.concat()).into_bytes()
}

fn read(urdf: &str) -> Result<Hand, HandError> {
    Hand::from_urdf(urdf, &|file| match file {
        "package://gripper/tip.stl" => Ok(tip_stl()),
        "broken.stl" => Ok(b"solid".to_vec()),
        _ => Err("no such file".to_owned()),
    })
}

#[track_caller]
fn assert_says(urdf: &str, message: &str) {
    let found = read(urdf).expect_err("the URDF is wrong").to_string();
    assert_eq!(found, message);
}

#[track_caller]
fn assert_changed_says(old: &str, new: &str, message: &str) {
    assert_says(&urdf_with(old, new), message);
}

const FOLLOWER: &str = r#"<mimic joint="knuckle" multiplier="0.5" offset="0.1"/>"#;
const KNUCKLE_LIMIT: &str = r#"<limit lower="-0.5" upper="1.5" effort="1" velocity="1"/>"#;

#[test]
fn text_that_is_no_urdf_is_refused() {
    for text in ["", "no xml at all", "{\"json\": true}"] {
        let message = read(text).expect_err(text).to_string();
        assert!(message.starts_with("URDF, document: "), "{text:?}: {message}");
    }
    assert_says(
        "<sdf/>",
        "URDF, document: the outermost element is <sdf>; expected the <robot> of a URDF",
    );
    assert_says(
        "<robot name=\"empty\"/>",
        "URDF, robot: there is no <link>; expected <robot> with links and joints",
    );
    let whole = "check that the file is complete and well-formed XML";
    for cut in [
        "<robot name=\"x\">\n<link name=\"a\"",
        "<robot name=\"x\">\n<link name=\"a\">",
    ] {
        assert_says(
            cut,
            &format!(
                "URDF, line 2, in or after link `a`: the root node was opened but never closed; {whole}"
            ),
        );
    }
    assert_says(
        "\n<robot name=\"x\">\n<joint name='j' type=\"fixed\">\n</link></robot>",
        &format!("URDF, line 4, in or after joint `j`: expected 'joint' tag, not 'link' at 3:1; {whole}"),
    );
    for deep in [
        format!("<robot>{}", "<a>".repeat(100_000)),
        format!("<robot>{}{}", "<a>".repeat(100_000), "</a>".repeat(100_000)),
    ] {
        let message = read(&deep).unwrap_err().to_string();
        assert!(message.starts_with("URDF, line 1: "), "{message}");
    }
}

#[test]
fn elements_need_what_they_are_made_of() {
    for (old, new, message) in [
        (
            r#"<box size="0.1 0.1 0.02"/>"#,
            "<box/>",
            "URDF, link `palm` (line 2): <box> lacks `size`; add it",
        ),
        (
            r#"<box size="0.1 0.1 0.02"/>"#,
            "<plane/>",
            "URDF, link `palm` (line 2): <plane> is not a shape that is read; expected box, cylinder, capsule, sphere \
             or mesh",
        ),
        (
            r#"<geometry><box size="0.1 0.1 0.02"/></geometry>"#,
            "",
            "URDF, link `palm` (line 2): it has no <geometry>; give it one, or delete it",
        ),
        (
            r#"<link name="base"/>"#,
            "<link/>",
            "URDF, link `?` (line 3): <link> lacks `name`; add it",
        ),
        (
            r#"<parent link="base"/>"#,
            "",
            "URDF, joint `bend` (line 10): it has no <parent link=\"…\"/>",
        ),
        (
            r#" type="prismatic""#,
            "",
            "URDF, joint `follower` (line 14): <joint> lacks `type`; add it",
        ),
        (
            r#"multiplier="0.5""#,
            r#"multiplier="half""#,
            "URDF, joint `follower` (line 16): `multiplier` of <mimic> is `half`; expected a number",
        ),
    ] {
        assert_changed_says(old, new, message);
    }
}

/// As exporters and simulators write them.
#[test]
fn what_says_nothing_of_shape_or_motion_may_be_incomplete() {
    let bare = r#"<limit lower="-0.5" upper="1.5"/>"#;
    let body = "<inertial><mass value=\"0.1\"/></inertial><inertial/><collision><geometry>";
    let urdf = urdf_with(KNUCKLE_LIMIT, bare).replacen("<collision><geometry>", body, 1);
    let transmission =
        r#"<transmission name="t"><joint name="knuckle"><hardwareInterface/></joint></transmission></robot>"#;
    let urdf = format!("\n{}", urdf.replace("</robot>", transmission));
    let hand = read(&urdf).unwrap();
    assert_eq!((hand.joints().len(), hand.joints()[0].upper), (3, 1.5));
    assert_eq!(hand.links()[0].mass, Some(0.1));
}

#[test]
fn an_element_that_cannot_be_read_is_named_with_its_line() {
    let urdf = urdf_with(r#"lower="-0.5" upper="1.5""#, r#"lower="-0,5" upper="1.5""#);
    assert_says(
        &urdf,
        "URDF, joint `knuckle` (line 8): `lower` of <limit> is `-0,5`; expected a number",
    );
    let urdf = urdf_with(r#"<box size="0.1 0.1 0.02"/>"#, r#"<box size="0.1 0.1"/>"#);
    assert_says(
        &urdf,
        "URDF, link `palm` (line 2): `size` of <box> is `0.1 0.1`; expected three numbers",
    );
}

#[test]
fn names_must_be_unique_and_known() {
    assert_changed_says(
        r#"<link name="other"/>"#,
        r#"<link name="tip"/>"#,
        "two links are named `tip`; rename one of them",
    );
    assert_changed_says(
        r#"<joint name="bend""#,
        r#"<joint name="knuckle""#,
        "two joints are named `knuckle`; rename one of them",
    );
    assert_changed_says(
        r#"<child link="base"/>"#,
        r#"<child link="bass"/>"#,
        "joint `knuckle`: its child link `bass` does not exist; define the link or correct the name",
    );
    assert_changed_says(
        r#"<parent link="base"/>"#,
        r#"<parent link="bass"/>"#,
        "joint `bend`: its parent link `bass` does not exist; define the link or correct the name",
    );
}

#[test]
fn links_must_form_one_tree() {
    assert_changed_says(
        r#"<child link="other"/>"#,
        r#"<child link="tip"/>"#,
        "link `tip` is the child of both joint `bend` and joint `follower`; a hand is a tree, so model a closed \
         chain with a mimic joint",
    );
    assert_changed_says(
        r#"<link name="other"/>"#,
        r#"<link name="other"/><link name="lost"/>"#,
        "links `palm` and `lost` both have no parent joint; a hand is one tree, so join them",
    );
    // base and tip carry each other, beside the palm and the other link.
    assert_changed_says(
        r#"<parent link="palm"/> <child link="base"/>"#,
        r#"<parent link="tip"/> <child link="base"/>"#,
        "the joints form a loop through link `base`; a hand is a tree with one root link",
    );
    // All but one link on a loop.
    assert_changed_says(
        r#"<parent link="palm"/> <child link="other"/>"#,
        r#"<parent link="tip"/> <child link="palm"/>"#,
        "the joints form a loop through link `base`; a hand is a tree with one root link",
    );
    assert_says(
        r#"<robot name="ring"><link name="a"/><link name="b"/>
           <joint name="ab" type="fixed"><parent link="a"/><child link="b"/></joint>
           <joint name="ba" type="fixed"><parent link="b"/><child link="a"/></joint></robot>"#,
        "the joints form a loop through link `a`; a hand is a tree with one root link",
    );
}

#[test]
fn joints_need_a_type_an_axis_and_limits() {
    assert_changed_says(
        r#"<joint name="bend" type="revolute">"#,
        r#"<joint name="bend" type="planar">"#,
        "joint `bend` is of type planar; expected revolute, continuous, prismatic or fixed (use several single-axis \
         joints instead)",
    );
    for axis in ["0 0 0", "nan 0 0", "inf 0 0"] {
        let message = read(&urdf_with(
            r#"<axis xyz="0 1 0"/>"#,
            &format!("<axis xyz=\"{axis}\"/>"),
        ))
        .unwrap_err();
        let message = message.to_string();
        assert!(message.starts_with("joint `knuckle`: axis is ["), "{message}");
        assert!(
            message.ends_with("]; expected three finite numbers, not all 0"),
            "{message}"
        );
    }
    let no_range = "joint `knuckle` (revolute) has no range: its limits are missing or both 0; add \
                    <limit lower=\"…\" upper=\"…\"/> or make it continuous or fixed";
    assert_changed_says(KNUCKLE_LIMIT, "", no_range);
    assert_changed_says(KNUCKLE_LIMIT, r#"<limit effort="1" velocity="1"/>"#, no_range);
    let two = "expected two finite numbers, lower not above upper";
    assert_changed_says(
        r#"lower="-0.5" upper="1.5""#,
        r#"lower="1.5" upper="-0.5""#,
        &format!("joint `knuckle`: limit is lower 1.5, upper -0.5; {two}"),
    );
    assert_changed_says(
        r#"lower="-0.5" upper="1.5""#,
        r#"lower="-0.5" upper="nan""#,
        &format!("joint `knuckle`: limit is lower -0.5, upper NaN; {two}"),
    );
    assert_changed_says(
        r#"<axis xyz="0 1 0"/>"#,
        r#"<origin xyz="0 0 nan"/><axis xyz="0 1 0"/>"#,
        "joint `knuckle`: origin xyz is [0.0, 0.0, NaN]; expected three finite numbers",
    );
}

#[test]
fn an_axis_of_any_length_becomes_a_unit_axis() {
    for axis in ["0 2 0", "0 1e-200 0", "0 1e200 0"] {
        let hand = read(&urdf_with("0 1 0", axis)).unwrap();
        assert!(
            (hand.joints()[0].axis.into_inner() - nalgebra::Vector3::y()).norm() < 1e-15,
            "{axis}"
        );
    }
}

#[test]
fn a_continuous_joint_has_no_limits_even_where_it_says_so() {
    let hand = read(&urdf_with(
        r#"<joint name="bend" type="revolute">"#,
        r#"<joint name="bend" type="continuous">"#,
    ));
    let hand = hand.unwrap();
    assert_eq!(
        (hand.joints()[1].lower, hand.joints()[1].upper),
        (f64::NEG_INFINITY, f64::INFINITY)
    );
    let turned = hand
        .positions(&BTreeMap::from([("bend".to_owned(), 100.0)]))
        .unwrap();
    assert_eq!(turned.as_slice()[1], 100.0);
}

#[test]
fn mimic_joints_must_follow_a_joint_that_moves() {
    let follower = |joint: &str| FOLLOWER.replace("knuckle", joint);
    assert_changed_says(
        FOLLOWER,
        &follower("nobody"),
        "joint `follower` mimics `nobody`, which is not a joint; expected the name of a movable joint",
    );
    assert_changed_says(
        FOLLOWER,
        &follower("follower"),
        "joint `follower` mimics itself, directly or through others; let one joint of the circle move freely",
    );
    assert_changed_says(
        r#"<mimic joint="knuckle" multiplier="0.5""#,
        r#"<mimic joint="knuckle" multiplier="inf""#,
        "joint `follower`: mimic is multiplier inf, offset 0.1; expected two finite numbers",
    );
    let circle = urdf_with(
        KNUCKLE_LIMIT,
        &format!("{KNUCKLE_LIMIT}<mimic joint=\"follower\"/>"),
    );
    assert_says(
        &circle,
        "joint `knuckle` mimics itself, directly or through others; let one joint of the circle move freely",
    );
    let fixed = urdf_with(
        r#"<joint name="knuckle" type="revolute">"#,
        r#"<joint name="knuckle" type="fixed">"#,
    );
    assert_says(
        &fixed,
        "joint `follower` mimics `knuckle`, which is a fixed joint; expected the name of a movable joint",
    );
}

#[test]
fn chains_of_mimic_joints_are_multiplied_out() {
    // bend = 2 follower + 1 = 2 (0.5 knuckle + 0.1) + 1
    let bend = r#"<limit lower="0" upper="1" effort="1" velocity="1"/>"#;
    let chain = urdf_with(bend, r#"<mimic joint="follower" multiplier="2" offset="1"/>"#);
    let hand = read(&chain).unwrap();
    assert_eq!(hand.n_dof(), 1);
    let mimic = hand.joints()[1].mimic.unwrap();
    assert_eq!((mimic.joint.0, mimic.multiplier, mimic.offset), (0, 1.0, 1.2));
    let positions = hand
        .positions(&BTreeMap::from([("knuckle".to_owned(), 1.0)]))
        .unwrap();
    assert_eq!(positions.as_slice(), [1.0, 2.2, 0.6]);
    // Limits that a mimic joint leaves out are those that its leader can give it.
    assert_eq!((hand.joints()[2].lower, hand.joints()[2].upper), (-0.15, 0.85));
}

#[test]
fn shapes_need_a_size_and_a_file() {
    let lengths = "expected positive, finite lengths in metres";
    assert_changed_says(
        "0.1 0.1 0.02",
        "0.1 0 0.02",
        &format!("link `palm`: box size is [0.1, 0.0, 0.02]; {lengths}"),
    );
    for (shape, what) in [
        (r#"<sphere radius="-1"/>"#, "sphere radius is [-1.0]"),
        (
            r#"<cylinder radius="1" length="0"/>"#,
            "cylinder radius and length is [1.0, 0.0]",
        ),
        (
            r#"<capsule radius="nan" length="1"/>"#,
            "capsule radius and length is [NaN, 1.0]",
        ),
    ] {
        assert_changed_says(
            r#"<box size="0.1 0.1 0.02"/>"#,
            shape,
            &format!("link `palm`: {what}; {lengths}"),
        );
    }
    assert_changed_says(
        r#"scale="1 1 1""#,
        r#"scale="1 0 1""#,
        "link `tip`, mesh `package://gripper/tip.stl`: scale is [1.0, 0.0, 1.0]; expected three finite numbers, none \
         of them 0",
    );
    assert_changed_says(
        "package://gripper/tip.stl",
        "meshes/lost.stl",
        "link `tip`: mesh `meshes/lost.stl` cannot be had: no such file",
    );
    assert_changed_says(
        "package://gripper/tip.stl",
        "tip.fbx",
        "link `tip`: mesh `tip.fbx` cannot be read: `.fbx` is not a format that is read; use one of off, obj, stl, \
         ply, xyz, pcd, gltf, glb, dae",
    );
    let broken = read(&urdf_with("package://gripper/tip.stl", "broken.stl"))
        .unwrap_err()
        .to_string();
    assert_eq!(
        broken,
        "link `tip`: mesh `broken.stl` cannot be read: the shape has no triangles; check that the file is complete"
    );
    let negative = r#"<inertial><mass value="-1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>"#;
    assert_changed_says(
        r#"<link name="other"/>"#,
        &format!("<link name=\"other\">{negative}</link>"),
        "link `other`: mass is -1; expected a positive number of kilograms",
    );
}

#[test]
fn a_picture_that_cannot_be_read_is_left_out_with_a_warning() {
    let visual =
        r#"<link name="other"><visual><geometry><mesh filename="other.fbx"/></geometry></visual></link>"#;
    let hand = read(&urdf_with(r#"<link name="other"/>"#, visual)).unwrap();
    assert_eq!(
        hand.warnings(),
        [
            "not drawn: link `other`: mesh `other.fbx` cannot be read: `.fbx` is not a format that is read; use one of \
          off, obj, stl, ply, xyz, pcd, gltf, glb, dae"
        ]
    );
}

#[test]
fn postures_must_name_joints_and_keep_their_limits() {
    let hand = read(&urdf_with("gripper", "gripper")).unwrap();
    let says = |joint: &str, value: f64| {
        hand.positions(&BTreeMap::from([(joint.to_owned(), value)]))
            .expect_err(joint)
            .to_string()
    };
    assert_eq!(
        says("knukle", 0.1),
        "`knukle` is not a movable joint of `gripper`; it has knuckle, bend, follower"
    );
    assert_eq!(
        says("knuckle", 2.0),
        "joint `knuckle` is set to 2, outside its limits [-0.5, 1.5]"
    );
    assert_eq!(
        says("knuckle", f64::NAN),
        "joint `knuckle` is set to NaN, outside its limits [-0.5, 1.5]"
    );
    assert_eq!(
        says("follower", 0.3),
        "joint `follower` is set to 0.3, but it mimics `knuckle`, which puts it at 0.1; leave it out"
    );
    let both = BTreeMap::from([("follower".to_owned(), 0.6), ("knuckle".to_owned(), 1.0)]);
    assert_eq!(hand.positions(&both).unwrap().as_slice(), [1.0, 0.0, 0.6]);
}

#[test]
fn mutilated_text_gives_errors_and_no_panic() {
    let urdf = urdf_with("gripper", "gripper");
    for length in 0..urdf.len() {
        let _ = read(&urdf[..length]);
        let mut bytes = urdf.clone().into_bytes();
        bytes[length] = b"<>\"/=x0&"[length % 8];
        let _ = read(&String::from_utf8_lossy(&bytes));
    }
}
