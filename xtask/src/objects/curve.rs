//! Curves that shapes are drawn with: rounded polylines, and tables of stations with smooth values between them.

/// A corner of a polyline in a plane, cut off over `round` on both sides and replaced by a parabola.
#[derive(Debug, Clone, Copy)]
pub struct Corner(pub f64, pub f64, pub f64);

/// Samples of the polyline through `corners` with its corners rounded, no two neighbours farther apart than `spacing`
/// on straight runs. The ends are kept.
pub fn rounded(corners: &[Corner], spacing: f64) -> Vec<[f64; 2]> {
    let at = |i: usize| [corners[i].0, corners[i].1];
    let mut samples = vec![at(0)];
    for i in 1..corners.len() {
        let previous = *samples.last().expect("the first corner is in");
        if i + 1 == corners.len() {
            push_straight(&mut samples, previous, at(i), spacing);
            break;
        }
        let (before, here, after) = (at(i - 1), at(i), at(i + 1));
        let (length_in, length_out) = (distance(before, here), distance(here, after));
        let free_in = if i == 1 { length_in } else { 0.5 * length_in };
        let free_out = if i + 2 == corners.len() {
            length_out
        } else {
            0.5 * length_out
        };
        let cut = corners[i].2.min(free_in).min(free_out);
        let start = lerp(here, before, cut / length_in);
        let end = lerp(here, after, cut / length_out);
        push_straight(&mut samples, previous, start, spacing);
        if cut > 0.0 {
            let turn = turn_angle(before, here, after);
            let n = ((turn / 0.42).ceil() as usize)
                .max((distance(start, end) / spacing).ceil() as usize)
                .max(2);
            for k in 1..=n {
                let t = k as f64 / n as f64;
                samples.push(lerp(lerp(start, here, t), lerp(here, end, t), t));
            }
        }
    }
    samples
}

fn push_straight(samples: &mut Vec<[f64; 2]>, from: [f64; 2], to: [f64; 2], spacing: f64) {
    let length = distance(from, to);
    if length < 1e-9 {
        return;
    }
    let n = (length / spacing).ceil() as usize;
    samples.extend((1..=n).map(|k| lerp(from, to, k as f64 / n as f64)));
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

fn lerp(a: [f64; 2], b: [f64; 2], t: f64) -> [f64; 2] {
    [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]
}

fn turn_angle(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - b[0], c[1] - b[1]]);
    (u[0] * v[1] - u[1] * v[0]).atan2(u[0] * v[0] + u[1] * v[1]).abs()
}

/// `n` + 1 points at even distances along a polyline, ends included.
pub fn evenly(polyline: &[[f64; 2]], n: usize) -> Vec<[f64; 2]> {
    let mut along = vec![0.0];
    for pair in polyline.windows(2) {
        along.push(along[along.len() - 1] + distance(pair[0], pair[1]));
    }
    let total = along[along.len() - 1];
    (0..=n)
        .map(|k| {
            let s = total * k as f64 / n as f64;
            let i = along.partition_point(|&a| a < s).clamp(1, polyline.len() - 1);
            lerp(
                polyline[i - 1],
                polyline[i],
                (s - along[i - 1]) / (along[i] - along[i - 1]),
            )
        })
        .collect()
}

/// Values at stations, and between them the monotone cubic interpolation of Fritsch and Carlson (with the harmonic
/// mean as slope), which never overshoots: where two stations agree, the shape is straight.
#[derive(Debug, Clone)]
pub struct Track<const N: usize>(Vec<(f64, [f64; N])>);

impl<const N: usize> Track<N> {
    /// A track through `stations`, whose first numbers grow.
    pub fn new(stations: &[(f64, [f64; N])]) -> Self {
        assert!(
            stations.windows(2).all(|pair| pair[0].0 < pair[1].0),
            "stations are in order"
        );
        Self(stations.to_vec())
    }

    /// Values at `t`.
    pub fn at(&self, t: f64) -> [f64; N] {
        let stations = &self.0;
        let i = stations
            .partition_point(|station| station.0 <= t)
            .clamp(1, stations.len() - 1)
            - 1;
        let width = stations[i + 1].0 - stations[i].0;
        let u = ((t - stations[i].0) / width).clamp(0.0, 1.0);
        std::array::from_fn(|k| {
            let (from, to) = (stations[i].1[k], stations[i + 1].1[k]);
            let (slope_from, slope_to) = (self.slope(i, k) * width, self.slope(i + 1, k) * width);
            let (u2, u3) = (u * u, u * u * u);
            (2.0 * u3 - 3.0 * u2 + 1.0) * from
                + (u3 - 2.0 * u2 + u) * slope_from
                + (3.0 * u2 - 2.0 * u3) * to
                + (u3 - u2) * slope_to
        })
    }

    fn slope(&self, i: usize, k: usize) -> f64 {
        let secant = |j: usize| (self.0[j + 1].1[k] - self.0[j].1[k]) / (self.0[j + 1].0 - self.0[j].0);
        let last = self.0.len() - 1;
        if i == 0 {
            return secant(0);
        }
        if i == last {
            return secant(last - 1);
        }
        let (before, after) = (secant(i - 1), secant(i));
        if before * after <= 0.0 {
            0.0
        } else {
            2.0 * before * after / (before + after)
        }
    }

    /// All stations, and between them even steps of at most `step`.
    pub fn steps(&self, step: f64) -> Vec<f64> {
        let mut steps = vec![self.0[0].0];
        for pair in self.0.windows(2) {
            let (from, to) = (pair[0].0, pair[1].0);
            let n = ((to - from) / step).ceil().max(1.0) as usize;
            steps.extend((1..=n).map(|k| from + (to - from) * k as f64 / n as f64));
        }
        steps
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_track_meets_its_stations_and_never_overshoots() {
        let track = Track::new(&[(0.0, [1.0]), (1.0, [1.0]), (2.0, [5.0]), (4.0, [5.5])]);
        assert_eq!(track.at(1.0), [1.0]);
        assert_eq!(track.at(2.0), [5.0]);
        assert!((0..=100).all(|k| (1.0..=5.5).contains(&track.at(0.04 * k as f64)[0])));
        assert_eq!(track.at(0.5), [1.0]);
    }

    #[test]
    fn a_rounded_corner_stays_inside_the_corner() {
        let samples = rounded(
            &[
                Corner(0.0, 0.0, 0.0),
                Corner(10.0, 0.0, 2.0),
                Corner(10.0, 10.0, 0.0),
            ],
            3.0,
        );
        assert_eq!(samples[0], [0.0, 0.0]);
        assert_eq!(samples[samples.len() - 1], [10.0, 10.0]);
        assert!(
            samples
                .iter()
                .all(|p| p[0] <= 10.0 && p[1] >= 0.0 && *p != [10.0, 0.0])
        );
    }
}
