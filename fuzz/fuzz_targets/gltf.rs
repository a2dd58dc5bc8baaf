//! Any bytes read as GLTF; further files do not exist.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| prehend_fuzz::shape(bytes, prehend_geometry::MeshFormat::Gltf));
