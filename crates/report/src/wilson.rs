//! An interval for a share.

/// Wilson's score interval at 95 % for `successes` of `n`; the whole of [0, 1] where `n` is 0.
///
/// ```text
/// (p̂ + z²/2n ± z √(p̂(1−p̂)/n + z²/4n²)) / (1 + z²/n),  z = 1.959964
/// ```
///
/// Rows are taken as independent.
pub fn wilson_interval(successes: usize, n: usize) -> (f64, f64) {
    if n == 0 {
        return (0.0, 1.0);
    }
    let z2 = 1.959964_f64.powi(2);
    let n = n as f64;
    let p = (successes as f64 / n).min(1.0);
    let middle = p + z2 / (2.0 * n);
    let half = (z2 * (p * (1.0 - p) / n + z2 / (4.0 * n * n))).sqrt();
    let scale = 1.0 + z2 / n;
    (
        ((middle - half) / scale).max(0.0),
        ((middle + half) / scale).min(1.0),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_agrees_with_statsmodels() {
        // statsmodels 0.14 proportion_confint(15, 20, method="wilson"): 0.5312899, 0.8881379.
        let (low, high) = wilson_interval(15, 20);
        assert!(
            (low - 0.531_29).abs() < 1e-4 && (high - 0.888_14).abs() < 1e-4,
            "{low} {high}"
        );
    }

    #[test]
    fn nothing_seen_says_nothing() {
        assert_eq!(wilson_interval(0, 0), (0.0, 1.0));
        assert_eq!(wilson_interval(0, 10).0, 0.0);
        assert!(wilson_interval(0, 10).1 < 0.31);
    }
}
