//! Any text read as BIF; what is read is written and read again without change.
#![no_main]

use prehend_model::Model;

libfuzzer_sys::fuzz_target!(|text: &str| {
    if let Ok(model) = Model::from_bif(text) {
        if let Ok(export) = model.to_bif() {
            let again = Model::from_bif(&export.text).expect("what was written can be read");
            assert_eq!(again.nodes().len(), model.nodes().len());
        }
    }
});
