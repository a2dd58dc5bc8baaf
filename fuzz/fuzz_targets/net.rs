//! Any text read as NET; what is read is written and read again without change.
#![no_main]

use prehend_model::Model;

libfuzzer_sys::fuzz_target!(|text: &str| {
    if let Ok(model) = Model::from_net(text) {
        if let Ok(export) = model.to_net() {
            let again = Model::from_net(&export.text).expect("what was written can be read");
            assert_eq!(again.nodes().len(), model.nodes().len());
        }
    }
});
