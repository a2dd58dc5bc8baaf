//! Counts of tests, read from what they print.

use std::collections::BTreeMap;

/// How many tests passed and failed, and why some were skipped.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Tests, examples and plain steps that passed.
    pub passed: usize,
    /// Those that failed.
    pub failed: usize,
    /// Reason → how many.
    pub skipped: BTreeMap<String, usize>,
}

impl Tally {
    /// All that were skipped.
    pub fn n_skipped(&self) -> usize {
        self.skipped.values().sum()
    }

    /// Adds the summary of `cargo nextest`, or else those of `cargo test`. (Below nextest each test prints a summary of
    /// itself, which must not count again.)
    pub fn read_results(&mut self, text: &str) {
        let nextest = text.lines().any(|line| line.trim().starts_with("Summary ["));
        for line in text.lines() {
            let line = line.trim();
            let counts = match (line.strip_prefix("Summary"), line.strip_prefix("test result:")) {
                (Some(rest), _) if nextest => rest
                    .split_once("tests run:")
                    .or_else(|| rest.split_once("test run:"))
                    .map(|s| s.1),
                (_, Some(rest)) if !nextest => rest.split_once('.').map(|s| s.1),
                _ => None,
            };
            let Some(counts) = counts else { continue };
            for word in [" passed", " failed", " timed out", " skipped", " ignored"] {
                let Some(n) = number_before(counts, word) else {
                    continue;
                };
                match word {
                    " passed" => self.passed += n,
                    " failed" | " timed out" => self.failed += n,
                    _ if n > 0 => self.skip("marked #[ignore] in the source", n),
                    _ => {}
                }
            }
        }
    }

    fn skip(&mut self, reason: &str, n: usize) {
        *self.skipped.entry(reason.to_owned()).or_insert(0) += n;
    }

    /// Adds the lines `skipped: <what> needs <what>` that tests print. Their runner counts such tests among the passed.
    pub fn read_skips(&mut self, text: &str) {
        for line in text.lines() {
            if let Some(reason) = line.trim().strip_prefix("skipped: ") {
                self.skip(reason, 1);
            }
        }
    }
}

/// The number directly before `word`.
fn number_before(text: &str, word: &str) -> Option<usize> {
    let before = &text[..text.find(word)?];
    let digits = before.rfind(|c: char| !c.is_ascii_digit()).map_or(0, |at| at + 1);
    before[digits..].parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn summaries_of_cargo_test_add_up() {
        let mut tally = Tally::default();
        let line = |n| {
            format!("test result: FAILED. {n} passed; 1 failed; 1 ignored; 0 measured; finished in 0.01s\n")
        };
        tally.read_results(&(line(5) + "Summary of nothing\n" + &line(7)));
        assert_eq!((tally.passed, tally.failed, tally.n_skipped()), (12, 2, 2));
    }

    #[test]
    fn below_nextest_only_its_own_summary_counts() {
        let mut tally = Tally::default();
        tally.read_results(
            "    test result: ok. 1 passed; 0 failed; 0 ignored; 0 measured; 21 filtered out\n     \
             Summary [   3.412s] 12 tests run: 10 passed (1 slow), 2 failed, 3 skipped\n",
        );
        assert_eq!((tally.passed, tally.failed, tally.n_skipped()), (10, 2, 3));
    }

    #[test]
    fn skips_are_counted_by_reason() {
        let mut tally = Tally::default();
        tally.read_skips("    skipped: Princeton meshes need ../shared/data\nok\nskipped: Princeton meshes need ../shared/data\n");
        assert_eq!(tally.skipped["Princeton meshes need ../shared/data"], 2);
    }
}
