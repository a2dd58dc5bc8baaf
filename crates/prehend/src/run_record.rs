//! `run.json`: what ran, with which arguments, and how long. The only place where times stand.

use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use crate::{Error, files};

/// What `run.json` holds.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct RunRecord {
    /// The program's version.
    pub version: String,
    /// Its arguments.
    pub arguments: Vec<String>,
    /// Seed of everything drawn.
    pub seed: u64,
    /// When it began, RFC 3339, UTC.
    pub started: String,
    /// The stages that ran, in order.
    pub stages: Vec<StageTime>,
}

/// One stage's time.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct StageTime {
    /// The stage's name.
    pub name: String,
    /// Wall seconds.
    pub seconds: f64,
    /// What it did, in a few words.
    pub detail: String,
}

/// Keeps the record of a run on disk, up to date after each stage.
pub struct Recorder {
    path: PathBuf,
    record: RunRecord,
}

impl Recorder {
    /// Begins the record of a run in `out`.
    pub fn begin(out: &Path, arguments: Vec<String>, seed: u64) -> Self {
        let record = RunRecord {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            arguments,
            seed,
            started: now(),
            stages: Vec::new(),
        };
        Self {
            path: out.join("run.json"),
            record,
        }
    }

    /// Runs a stage and records its time; `detail` says what it did.
    ///
    /// # Errors
    ///
    /// The stage's own, or that the record cannot be written.
    pub fn stage<T>(
        &mut self,
        name: &str,
        run: impl FnOnce() -> Result<T, Error>,
        detail: impl FnOnce(&T) -> String,
    ) -> Result<T, Error> {
        let start = monotonic();
        let result = run()?;
        let seconds = monotonic().saturating_sub(start).as_secs_f64();
        self.record.stages.push(StageTime {
            name: name.to_owned(),
            seconds,
            detail: detail(&result),
        });
        files::write(
            &self.path,
            &serde_json::to_vec_pretty(&self.record).map_err(Error::input)?,
        )?;
        Ok(result)
    }

    /// The record so far.
    pub fn record(&self) -> &RunRecord {
        &self.record
    }
}

/// A measured duration of one call, for answers that report their own speed.
pub fn timed<T>(run: impl FnOnce() -> T) -> (T, f64) {
    let start = monotonic();
    let value = run();
    (value, monotonic().saturating_sub(start).as_secs_f64())
}

#[expect(clippy::disallowed_methods, reason = "this module is where times may be read")]
fn monotonic() -> Duration {
    use std::sync::OnceLock;
    use std::time::Instant;
    static START: OnceLock<Instant> = OnceLock::new();
    let start = *START.get_or_init(Instant::now);
    Instant::now().duration_since(start)
}

/// The present moment, RFC 3339, UTC, whole seconds.
#[expect(clippy::disallowed_methods, reason = "labels and run.json carry the clock")]
pub fn now() -> String {
    let seconds = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |d| d.as_secs());
    rfc3339(seconds)
}

/// Civil date of a count of seconds since 1970; days from an era of 400 years, which has 146,097.
fn rfc3339(seconds: u64) -> String {
    let (days, second) = (seconds / 86_400, seconds % 86_400);
    let shifted = days + 719_468;
    let (era, day_of_era) = (shifted / 146_097, shifted % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 {
        month_from_march + 3
    } else {
        month_from_march - 9
    };
    let year = year_of_era + era * 400 + u64::from(month <= 2);
    format!(
        "{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}Z",
        second / 3_600,
        second / 60 % 60,
        second % 60
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_moments_have_their_dates() {
        // From `date -u -d @SECONDS`.
        assert_eq!(rfc3339(0), "1970-01-01T00:00:00Z");
        assert_eq!(rfc3339(951_782_400), "2000-02-29T00:00:00Z");
        assert_eq!(rfc3339(1_795_305_599), "2026-11-21T23:59:59Z");
    }

    #[test]
    fn a_failed_stage_leaves_no_time() {
        let folder = tempfile::tempdir().unwrap();
        let mut recorder = Recorder::begin(folder.path(), vec![], 1);
        assert!(
            recorder
                .stage("a", || Err::<(), _>(Error::Stopped), |()| String::new())
                .is_err()
        );
        recorder.stage("b", || Ok(3), |n| format!("{n} things")).unwrap();
        assert_eq!(recorder.record().stages.len(), 1);
        assert!(
            files::read_text(&folder.path().join("run.json"))
                .unwrap()
                .contains("3 things")
        );
    }
}
