//! What must hold for any density, hull or score? Laws for tests.
