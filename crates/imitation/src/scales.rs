//! Units in which features of different kinds can be compared.

use prehend_grasp::Features;

/// Standard deviation of each dimension over the imitator's training data; distances are measured in these.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    size: [f64; 3],
    cvex: f64,
    egpc: [f64; 2],
    upos: [f64; 3],
    dir: f64,
}

/// A dimension that does not vary gets this share of 1 as its unit, so that equal values stay at distance 0.
const LEAST: f64 = 1e-6;

impl Scales {
    /// Standard deviations of the training rows. `dir` has one unit for all four numbers: the root mean squared distance
    /// of an orientation from the first row's, either sign, since q and −q are one orientation.
    pub fn of(rows: &[Features]) -> Self {
        let deviation = |f: &dyn Fn(&Features) -> f64| {
            let n = rows.len().max(1) as f64;
            let mean = rows.iter().map(f).sum::<f64>() / n;
            (rows.iter().map(|r| (f(r) - mean).powi(2)).sum::<f64>() / n)
                .sqrt()
                .max(LEAST)
        };
        let first = rows.first().map_or([1.0, 0.0, 0.0, 0.0], |r| r.dir);
        let turned =
            rows.iter().map(|r| squared_turn(&first, &r.dir)).sum::<f64>() / rows.len().max(1) as f64;
        Self {
            size: std::array::from_fn(|k| deviation(&|f| f.size[k])),
            cvex: deviation(&|f| f.cvex),
            egpc: std::array::from_fn(|k| deviation(&|f| f.egpc[k])),
            upos: std::array::from_fn(|k| deviation(&|f| f.upos[k])),
            dir: turned.sqrt().max(LEAST),
        }
    }

    /// Squared distance of two objects: over size and cvex.
    pub fn squared_object_distance(&self, a: &Features, b: &Features) -> f64 {
        (0..3)
            .map(|k| ((a.size[k] - b.size[k]) / self.size[k]).powi(2))
            .sum::<f64>()
            + ((a.cvex - b.cvex) / self.cvex).powi(2)
    }

    /// Squared distance of two actions: over egpc (in [−1, 1] for both hands), upos and dir.
    pub fn squared_action_distance(&self, a: &Features, b: &Features) -> f64 {
        (0..2)
            .map(|k| ((a.egpc[k] - b.egpc[k]) / self.egpc[k]).powi(2))
            .sum::<f64>()
            + (0..3)
                .map(|k| ((a.upos[k] - b.upos[k]) / self.upos[k]).powi(2))
                .sum::<f64>()
            + squared_turn(&a.dir, &b.dir) / self.dir.powi(2)
    }
}

/// Squared distance of two orientations as points of the unit sphere in ℝ⁴, the nearer sign: 0 to 2.
fn squared_turn(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    let dot: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum();
    (2.0 - 2.0 * dot.abs()).max(0.0)
}
