//! Any bytes read as OBJ.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| prehend_fuzz::shape(bytes, prehend_geometry::MeshFormat::Obj));
