//! The tutor must not see the features that a model learns from.

#[test]
fn the_tutor_depends_on_no_crate_of_ours_but_geometry_and_hand() {
    let manifest = include_str!("../Cargo.toml");
    let dependencies = manifest
        .split("[dependencies]")
        .nth(1)
        .unwrap()
        .split("\n[")
        .next()
        .unwrap();
    let ours: Vec<&str> = dependencies
        .lines()
        .filter_map(|line| line.split(['.', ' ', '=']).next())
        .filter(|name| name.starts_with("prehend"))
        .collect();
    assert_eq!(ours, ["prehend-geometry", "prehend-hand"]);
    // Nothing else brings one in by another name, a table of its own, or a target.
    assert!(!manifest.contains("package ="));
    assert!(!manifest.contains("[dependencies."));
    assert!(!manifest.contains("[target"));
}

#[test]
fn the_tutor_uses_nothing_of_geometry_that_makes_features() {
    let sources = [
        include_str!("../src/object.rs"),
        include_str!("../src/observe.rs"),
        include_str!("../src/placed_hand.rs"),
        include_str!("../src/samples.rs"),
        include_str!("../src/judge.rs"),
        include_str!("../src/parts.rs"),
    ];
    let words = [
        "decompose",
        "Decomposition",
        "Tetrahedron",
        "largest_tetrahedron",
        "minimum_volume_box",
        "union_volume",
    ];
    for word in words {
        assert!(
            sources.iter().all(|s| !s.contains(word)),
            "a source of the tutor names {word}"
        );
    }
}
