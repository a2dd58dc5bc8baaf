//! What must hold for any density, hull or score? Laws for tests.

mod density;

pub use density::{integrates_to_one_on_line, integrates_to_one_on_sphere, never_falls};
