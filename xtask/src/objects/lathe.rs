//! Vessels: a profile from the middle of the base over the rim to the middle of the floor, turned about z.

use super::curve::{Corner, rounded};
use super::shell::{Ring, Shell};
use nalgebra::Point3;
use std::f64::consts::PI;

/// Angles of the columns of a lathe, rising from −π; the front (+x) is in the middle.
#[derive(Debug, Clone)]
pub struct Columns(Vec<f64>);

impl Columns {
    /// `n` columns at even angles.
    pub fn even(n: usize) -> Self {
        Self((0..n).map(|k| -PI + 2.0 * PI * k as f64 / n as f64).collect())
    }

    /// `m` columns across the front, from −`half_angle` to `half_angle`, and `n` around the rest.
    pub fn with_front(n: usize, half_angle: f64, m: usize) -> Self {
        let side = n / 2;
        let mut angles: Vec<f64> = (0..side)
            .map(|k| -PI + (PI - half_angle) * k as f64 / side as f64)
            .collect();
        angles.extend((0..m).map(|k| -half_angle + 2.0 * half_angle * k as f64 / m as f64));
        angles.extend((0..side).map(|k| half_angle + (PI - half_angle) * k as f64 / side as f64));
        Self(angles)
    }

    /// Columns between −`half_angle` and `half_angle` of [`Columns::with_front`].
    pub fn front(n: usize, m: usize) -> std::ops::Range<usize> {
        n / 2..n / 2 + m
    }

    /// The angles.
    pub fn angles(&self) -> &[f64] {
        &self.0
    }
}

/// Outline of a vessel's wall as (radius, z) from the middle of its base, over the outside, the rim and the inside, to
/// the middle of its floor.
#[derive(Debug, Clone)]
pub struct Profile(pub Vec<[f64; 2]>);

impl Profile {
    /// A profile through rounded corners (radius, z, rounding).
    pub fn new(corners: &[Corner], spacing: f64) -> Self {
        Self(rounded(corners, spacing))
    }

    /// Places `n` + 1 even rows from `low` to `high` on the outside, in place of the samples there, so that something
    /// can be attached between them.
    pub fn with_rows(&self, low: f64, high: f64, n: usize) -> Self {
        let rim = self.rim();
        let margin = 0.6 * (high - low) / n as f64;
        let outside = &self.0[..=rim];
        let radius_at = |z: f64| {
            let i = outside
                .iter()
                .rposition(|sample| sample[1] < z)
                .expect("the rows lie above the base");
            let ([r0, z0], [r1, z1]) = (outside[i], outside[i + 1]);
            r0 + (r1 - r0) * (z - z0) / (z1 - z0)
        };
        let first = outside
            .iter()
            .rposition(|sample| sample[1] < low - margin)
            .expect("the rows lie above the base");
        let last = outside
            .iter()
            .position(|sample| sample[1] > high + margin)
            .expect("the rows lie below the rim");
        let mut samples = self.0[..=first].to_vec();
        samples.extend((0..=n).map(|k| {
            let z = low + (high - low) * k as f64 / n as f64;
            [radius_at(z), z]
        }));
        samples.extend_from_slice(&self.0[last..]);
        Self(samples)
    }

    /// Index of the ring (the base's middle is no ring) nearest to height `z` on the outside.
    pub fn row(&self, z: f64) -> usize {
        let off = |i: usize| (self.0[i][1] - z).abs();
        (1..=self.rim())
            .min_by(|&i, &j| off(i).total_cmp(&off(j)).then(j.cmp(&i)))
            .expect("a profile has a rim")
            - 1
    }

    fn rim(&self) -> usize {
        let top = self.0.iter().map(|sample| sample[1]).fold(f64::MIN, f64::max);
        self.0
            .iter()
            .position(|sample| sample[1] == top)
            .expect("a profile has a highest point")
    }
}

/// Turns `profile` about z into rings from base to floor. `section(angle, radius, z)` gives x and y.
pub fn turn(
    shell: &mut Shell,
    profile: &Profile,
    columns: &Columns,
    section: &dyn Fn(f64, f64, f64) -> [f64; 2],
) -> Vec<Ring> {
    let inner = &profile.0[1..profile.0.len() - 1];
    inner
        .iter()
        .map(|&[radius, z]| {
            shell.ring(columns.angles().iter().map(|&angle| {
                let [x, y] = section(angle, radius, z);
                Point3::new(x, y, z)
            }))
        })
        .collect()
}

/// A circle.
pub fn round(angle: f64, radius: f64, _z: f64) -> [f64; 2] {
    [radius * angle.cos(), radius * angle.sin()]
}

/// Closes both ends of turned rings on the axis.
pub fn close(shell: &mut Shell, profile: &Profile, rings: &[Ring]) {
    let [first, last] = [profile.0[0], profile.0[profile.0.len() - 1]];
    shell.cap_start(&rings[0], Point3::new(0.0, 0.0, first[1]));
    shell.cap_end(&rings[rings.len() - 1], Point3::new(0.0, 0.0, last[1]));
}
