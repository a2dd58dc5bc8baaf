//! Any text read as a URDF: an error that says something, or a hand whose links have poses.
#![no_main]

use libfuzzer_sys::fuzz_target;
use prehend_hand::Hand;

const MESH: &[u8] = b"OFF 4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

fuzz_target!(|text: &str| {
    match Hand::from_urdf(text, &|_| Ok(MESH.to_vec())) {
        Ok(hand) => {
            if let Ok(posture) = hand.positions(&Default::default()) {
                let poses = hand.link_poses(&posture);
                assert!(poses.root_from_link(hand.root()).translation.vector.norm() == 0.0);
            }
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
