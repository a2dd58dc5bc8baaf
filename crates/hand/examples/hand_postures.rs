//! Prints where the fingertips of the bundled human hand are, in three pre-shapes.
//!
//! `cargo run -p prehend-hand --example hand_postures`

use prehend_hand::Hand;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../hands/human");
    let description = std::fs::read_to_string(format!("{folder}/hand.toml"))?;
    let urdf = std::fs::read_to_string(format!("{folder}/human.urdf"))?;
    let mesh = |file: &str| std::fs::read(format!("{folder}/{file}")).map_err(|e| e.to_string());
    let hand = Hand::from_urdf(&urdf, &mesh)?.with_description(&description)?;

    println!(
        "{}: {} joints, {} links",
        hand.name(),
        hand.n_dof(),
        hand.links().len()
    );
    println!("fingertips in the palm frame (mm): x towards the fingers, z out of the palm");
    for (what, egpc) in [
        ("middle", [0.0, 0.0]),
        ("spread wide", [0.6, 0.0]),
        ("extended", [0.0, 0.6]),
    ] {
        let positions = hand.preshape(egpc);
        let palm_from_root = hand.root_from_palm(&positions).inverse();
        let poses = hand.link_poses(&positions);
        println!("{what}, egpc {egpc:?}");
        for finger in ["index", "middle", "ring", "little", "thumb"] {
            let tip = hand
                .link_named(&format!("{finger}_tip"))
                .ok_or("the hand has no such tip")?;
            let at = 1000.0 * (palm_from_root * poses.root_from_link(tip)).translation.vector;
            println!("  {finger:<6} {:8.1} {:8.1} {:8.1}", at.x, at.y, at.z);
        }
    }
    Ok(())
}
