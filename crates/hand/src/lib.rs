//! Where is every link of a hand in this posture?
