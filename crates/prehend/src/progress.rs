//! How a long stage tells where it is, and how it is told to stop.

use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

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

    /// The value of `result`; where its input is at fault, a warning that `what` is left out, and `None`, so that the
    /// rest goes on. `file` is the input where it is a file.
    ///
    /// # Errors
    ///
    /// Those that are no fault of the input pass: other files that cannot be read or written, and [`Error::Stopped`].
    pub fn or_left_out<T>(
        &self,
        what: &str,
        file: Option<&Path>,
        result: Result<T, Error>,
    ) -> Result<Option<T>, Error> {
        match result {
            Ok(value) => Ok(Some(value)),
            Err(e) => {
                let at_fault = match &e {
                    Error::Input(_) | Error::Model(_) => true,
                    Error::File { path, .. } => Some(path.as_path()) == file,
                    Error::Stopped => false,
                };
                if !at_fault {
                    return Err(e);
                }
                self.progress.warn(&format!("{what} is left out: {e}"));
                Ok(None)
            }
        }
    }
}

/// Runs jobs side by side and returns what they make, in their order. What they warn of is passed on in their order too,
/// whichever ends first.
///
/// # Errors
///
/// The first job's that fails, once all are done.
pub fn side_by_side<J: Sync, T: Send>(
    watch: Watch,
    jobs: &[J],
    work: impl Fn(&J, Watch) -> Result<T, Error> + Sync,
) -> Result<Vec<T>, Error> {
    let one = |job: &J| {
        let held = Held {
            inner: watch.progress,
            warnings: Mutex::default(),
        };
        let watch = Watch {
            progress: &held,
            ..watch
        };
        let result = watch.check().and_then(|()| work(job, watch));
        (held.warnings.into_inner().unwrap_or_default(), result)
    };
    let done: Vec<_> = jobs.par_iter().with_max_len(1).map(one).collect();
    done.into_iter()
        .map(|(warnings, result)| {
            for warning in warnings {
                watch.progress.warn(&warning);
            }
            result
        })
        .collect()
}

/// Passes steps on at once, and holds warnings back.
struct Held<'a> {
    inner: &'a dyn Progress,
    warnings: Mutex<Vec<String>>,
}

impl Progress for Held<'_> {
    fn advance(&self, steps: u64) {
        self.inner.advance(steps);
    }

    fn warn(&self, message: &str) {
        if let Ok(mut warnings) = self.warnings.lock() {
            warnings.push(message.to_owned());
        }
    }
}

/// Passes everything on, and keeps the warnings for the report.
pub struct Noted<'a> {
    inner: &'a dyn Progress,
    warnings: Mutex<Vec<String>>,
}

impl<'a> Noted<'a> {
    /// Listens in front of `inner`.
    pub fn new(inner: &'a dyn Progress) -> Self {
        Self {
            inner,
            warnings: Mutex::default(),
        }
    }

    /// The warnings so far, in order.
    pub fn warnings(&self) -> Vec<String> {
        self.warnings.lock().map_or(Vec::new(), |w| w.clone())
    }
}

impl Progress for Noted<'_> {
    fn begin(&self, name: &str, total: u64) {
        self.inner.begin(name, total);
    }

    fn advance(&self, steps: u64) {
        self.inner.advance(steps);
    }

    fn end(&self) {
        self.inner.end();
    }

    fn warn(&self, message: &str) {
        if let Ok(mut warnings) = self.warnings.lock() {
            warnings.push(message.to_owned());
        }
        self.inner.warn(message);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn warnings_of_jobs_side_by_side_come_in_the_order_of_the_jobs() {
        let noted = Noted::new(&Silent);
        let watch = Watch {
            progress: &noted,
            stop: &NEVER,
        };
        let jobs: Vec<u32> = (0..50).collect();
        let work = |job: &u32, watch: Watch| {
            let steps: u32 = (0..(50 - job) * 1000).map(|i| i % 3).sum();
            watch.progress.warn(&format!("{job} is slow"));
            Ok((*job, steps))
        };
        let done = side_by_side(watch, &jobs, work).unwrap();
        assert!(done.iter().map(|(job, _)| job).eq(&jobs));
        let expected: Vec<String> = jobs.iter().map(|job| format!("{job} is slow")).collect();
        assert_eq!(noted.warnings(), expected);
        let failed = side_by_side(watch, &jobs, |job, _| match job {
            3.. => Err::<(), _>(Error::input(job.to_string())),
            _ => Ok(()),
        });
        assert_eq!(failed.unwrap_err().to_string(), "3");
    }

    #[test]
    fn only_a_fault_of_the_input_is_left_out() {
        let noted = Noted::new(&Silent);
        let watch = Watch {
            progress: &noted,
            stop: &NEVER,
        };
        let (mine, other) = (Path::new("mine.ply"), Path::new("other.json"));
        let of = |e: Error| watch.or_left_out("it", Some(mine), Err::<(), _>(e));
        assert!(of(Error::input("no rows")).unwrap().is_none());
        assert!(of(Error::file(mine, "is flat")).unwrap().is_none());
        assert!(of(Error::file(other, "disk full")).is_err());
        assert!(matches!(of(Error::Stopped), Err(Error::Stopped)));
        assert_eq!(
            noted.warnings(),
            ["it is left out: no rows", "it is left out: mine.ply: is flat"]
        );
    }
}
