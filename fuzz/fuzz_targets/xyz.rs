//! Any bytes read as XYZ.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| prehend_fuzz::shape(bytes, prehend_geometry::MeshFormat::Xyz));
