//! Any text read as model.json; what is read survives JSON and the binary form, and answers or says why not.
#![no_main]

use prehend_model::{Evidence, Model};

libfuzzer_sys::fuzz_target!(|text: &str| {
    if let Ok(model) = Model::from_json(text) {
        assert_eq!(Model::from_json(&model.to_json()).as_ref(), Ok(&model));
        assert_eq!(Model::from_bytes(&model.to_bytes()).as_ref(), Ok(&model));
        for node in model.nodes().iter().take(3) {
            let _ = model.posterior(&[&node.name], &Evidence::new());
        }
    }
});
