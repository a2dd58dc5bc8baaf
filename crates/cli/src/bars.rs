//! Progress bars on standard error, and Ctrl-C.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::{ProgressBar, ProgressStyle};
use prehend::progress::{Progress, Watch};

static STOP: AtomicBool = AtomicBool::new(false);

/// Draws one bar at a time; where standard error is no terminal, one line a stage.
#[derive(Default)]
pub struct Bars {
    current: Mutex<Option<ProgressBar>>,
}

impl Bars {
    /// A watch that draws here and stops on Ctrl-C. A second Ctrl-C ends at once.
    pub fn watch(&self) -> Watch<'_> {
        let handler = || {
            if STOP.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
            eprintln!("\nstopping after the current step; again to end at once");
        };
        // A second command in one process keeps the first handler.
        let _ = ctrlc::set_handler(handler);
        Watch {
            progress: self,
            stop: &STOP,
        }
    }

    fn with<T>(&self, f: impl FnOnce(&mut Option<ProgressBar>) -> T) -> T {
        f(&mut self
            .current
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner))
    }
}

impl Progress for Bars {
    fn begin(&self, name: &str, total: u64) {
        let style = ProgressStyle::with_template("{msg:28} {bar:32} {pos}/{len}  {elapsed} gone, {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = ProgressBar::new(total)
            .with_style(style)
            .with_message(name.to_owned());
        if bar.is_hidden() {
            eprintln!("{name} …");
        }
        self.with(|current| *current = Some(bar));
    }

    fn advance(&self, steps: u64) {
        self.with(|current| current.iter().for_each(|bar| bar.inc(steps)));
    }

    fn end(&self) {
        self.with(|current| current.take().iter().for_each(ProgressBar::finish));
    }

    fn warn(&self, message: &str) {
        self.with(|current| match current {
            Some(bar) if !bar.is_hidden() => bar.println(format!("note: {message}")),
            _ => eprintln!("note: {message}"),
        });
    }
}
