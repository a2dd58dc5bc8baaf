//! How a long stage tells where it is, and how it is told to stop.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::Error;

/// Receives what a stage does; the binary draws bars with it.
pub trait Progress: Sync {
    /// A stage or a part of it begins; `total` is its number of steps.
    fn begin(&self, _name: &str, _total: u64) {}
    /// So many steps more are done.
    fn advance(&self, _steps: u64) {}
    /// What began last is done.
    fn end(&self) {}
    /// Something a user should know, though the run goes on.
    fn warn(&self, _message: &str) {}
}

/// Says nothing.
pub struct Silent;

impl Progress for Silent {}

/// What every long stage is given: where to report, and the flag that asks it to stop.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// Where steps are reported.
    pub progress: &'a dyn Progress,
    /// Set by Ctrl-C.
    pub stop: &'a AtomicBool,
}

impl Watch<'_> {
    /// An error once the user has asked to stop.
    ///
    /// # Errors
    ///
    /// [`Error::Stopped`].
    pub fn check(&self) -> Result<(), Error> {
        if self.stop.load(Ordering::Relaxed) {
            Err(Error::Stopped)
        } else {
            Ok(())
        }
    }
}

static NEVER: AtomicBool = AtomicBool::new(false);

/// A watch that says nothing and never stops, for tests and short calls.
pub fn unwatched() -> Watch<'static> {
    Watch {
        progress: &Silent,
        stop: &NEVER,
    }
}
