//! k-means++ and some Lloyd steps: clusters to start EM from.

use rand::{Rng, RngExt};

/// Lloyd steps after k-means++: the start only has to be near.
const LLOYD_STEPS: usize = 8;

/// Cluster and sign of each point; clusters are numbered by falling mass.
pub(crate) fn k_means(
    points: &[&[f64]],
    weights: &[f64],
    k: usize,
    latent_sign: bool,
    rng: &mut impl Rng,
) -> Vec<(usize, f64)> {
    let n = points.len();
    let d = points[0].len();
    let distance = |x: &[f64], center: &[f64]| -> (f64, f64) {
        let (mut plus, mut minus) = (0.0, 0.0);
        for (x, c) in x.iter().zip(center) {
            plus += (x - c) * (x - c);
            minus += (x + c) * (x + c);
        }
        if latent_sign && minus < plus {
            (minus, -1.0)
        } else {
            (plus, 1.0)
        }
    };
    let mut centers = vec![points[draw(weights, rng)].to_vec()];
    let mut square: Vec<f64> = vec![f64::INFINITY; n];
    let mut weighted = vec![0.0; n];
    while centers.len() < k {
        let newest = &centers[centers.len() - 1];
        for i in 0..n {
            square[i] = square[i].min(distance(points[i], newest).0);
            weighted[i] = square[i] * weights[i];
        }
        centers.push(points[draw(&weighted, rng)].to_vec());
    }
    let mut label = vec![(0, 1.0); n];
    let mut masses = vec![0.0; k];
    for _ in 0..LLOYD_STEPS {
        let mut sums = vec![0.0; k * d];
        masses.fill(0.0);
        for (i, label) in label.iter_mut().enumerate() {
            let mut least = f64::INFINITY;
            for (c, center) in centers.iter().enumerate() {
                let (square, sign) = distance(points[i], center);
                if square < least {
                    least = square;
                    *label = (c, sign);
                }
            }
            let (c, sign) = *label;
            masses[c] += weights[i];
            for (sum, x) in sums[c * d..].iter_mut().zip(points[i]) {
                *sum += weights[i] * sign * x;
            }
        }
        for (c, center) in centers.iter_mut().enumerate().filter(|(c, _)| masses[*c] > 0.0) {
            for (value, sum) in center.iter_mut().zip(&sums[c * d..]) {
                *value = sum / masses[c];
            }
        }
    }
    let mut order: Vec<usize> = (0..k).collect();
    order.sort_by(|&a, &b| masses[b].total_cmp(&masses[a]));
    let mut number = vec![0; k];
    for (new, &old) in order.iter().enumerate() {
        number[old] = new;
    }
    label.into_iter().map(|(c, sign)| (number[c], sign)).collect()
}

/// An index drawn in proportion to weights; the first where all are zero.
fn draw(weights: &[f64], rng: &mut impl Rng) -> usize {
    let total: f64 = weights.iter().filter(|w| w.is_finite()).sum();
    let mut left = rng.random::<f64>() * total;
    for (i, weight) in weights.iter().enumerate() {
        left -= weight;
        if left < 0.0 && *weight > 0.0 {
            return i;
        }
    }
    0
}
