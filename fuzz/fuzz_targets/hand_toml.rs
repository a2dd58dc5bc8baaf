//! Any text read as the `hand.toml` of a gripper with two fingers.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use prehend_hand::{Hand, urdf_named_in};

static GRIPPER: LazyLock<Hand> = LazyLock::new(|| {
    let finger = |name: &str, y: f64| {
        format!(
            "<link name='{name}'><collision><geometry><box size='0.01 0.02 0.04'/></geometry></collision></link>\
             <joint name='{name}_joint' type='prismatic'><parent link='palm'/><child link='{name}'/>\
             <origin xyz='0 {y} 0.05'/><axis xyz='0 1 0'/>\
             <limit lower='0' upper='0.04' effort='1' velocity='1'/></joint>"
        )
    };
    let urdf = format!(
        "<robot name='gripper'><link name='palm'/>{}{}</robot>",
        finger("left", 0.05),
        finger("right", -0.05)
    );
    Hand::from_urdf(&urdf, &|file| Err(format!("no file {file}"))).expect("the gripper is right")
});

fuzz_target!(|text: &str| {
    let _ = urdf_named_in(text);
    match GRIPPER.clone().with_description(text) {
        Ok(hand) => assert!(hand.description().is_some()),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
