//! Reading hands from folders, for tests.

use prehend_hand::Hand;

/// The folder of bundled hands.
pub const HANDS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../hands");

/// A hand from a URDF file; its meshes stand beside it.
pub fn read_urdf(path: &str) -> Hand {
    let folder = path.rsplit_once('/').expect("a path with a folder").0;
    let urdf = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let resolve = |file: &str| std::fs::read(format!("{folder}/{file}")).map_err(|e| e.to_string());
    Hand::from_urdf(&urdf, &resolve).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// A bundled hand with its description.
#[allow(dead_code, reason = "not every test file uses it")]
pub fn bundled(name: &str) -> Hand {
    let text = std::fs::read_to_string(format!("{HANDS}/{name}/hand.toml")).expect("hand.toml is bundled");
    let urdf = prehend_hand::urdf_named_in(&text)
        .expect("hand.toml is valid")
        .expect("it names its URDF");
    let hand = read_urdf(&format!("{HANDS}/{name}/{urdf}"));
    hand.with_description(&text)
        .unwrap_or_else(|e| panic!("{name}: {e}"))
}
