//! What must hold for any density, hull or score? Laws for tests.

mod brute_force;
mod density;
mod random_network;

pub use brute_force::{BruteForce, Piece};
pub use density::{integrates_to_one_on_line, integrates_to_one_on_sphere, never_falls};
pub use random_network::{
    RandomComponent, RandomNode, RandomObservation, RandomQuery, Reading, random_query,
};
