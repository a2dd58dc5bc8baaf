//! Any text read as the `NAME.toml` beside a mesh, and applied to one.
#![no_main]

use libfuzzer_sys::fuzz_target;
use prehend::object::Annotation;

fuzz_target!(|text: &str| {
    if let Err(error) = Annotation::parse(text) {
        assert!(!error.to_string().is_empty());
    }
});
