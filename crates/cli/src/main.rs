//! The binary `prehend`.

fn main() {}
