//! k-means++ and some Lloyd steps: clusters to start EM from.

use pulp::{Arch, Simd, WithSimd};
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
    let arch = Arch::new();
    let columns: Vec<Vec<f64>> = (0..d)
        .map(|j| points.iter().map(|point| point[j]).collect())
        .collect();
    let mut nearest = Nearest {
        square: vec![f64::INFINITY; n],
        center: vec![0.0; n],
        sign: vec![1.0; n],
    };
    let look = |nearest: &mut Nearest, number: usize, center: &[f64]| {
        arch.dispatch(Look {
            columns: &columns,
            center,
            number: number as f64,
            latent_sign,
            nearest,
        });
    };
    let mut centers = vec![points[draw(weights, rng)].to_vec()];
    while centers.len() < k {
        look(&mut nearest, 0, &centers[centers.len() - 1]);
        let weighted: Vec<f64> = nearest.square.iter().zip(weights).map(|(s, w)| s * w).collect();
        centers.push(points[draw(&weighted, rng)].to_vec());
    }
    let mut masses = vec![0.0; k];
    for _ in 0..LLOYD_STEPS {
        nearest.square.fill(f64::INFINITY);
        for (c, center) in centers.iter().enumerate() {
            look(&mut nearest, c, center);
        }
        let mut sums = vec![0.0; k * d];
        masses.fill(0.0);
        for (i, point) in points.iter().enumerate() {
            let (c, sign) = nearest.of(i);
            masses[c] += weights[i];
            for (sum, x) in sums[c * d..].iter_mut().zip(*point) {
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
    (0..n)
        .map(|i| {
            let (c, sign) = nearest.of(i);
            (number[c], sign)
        })
        .collect()
}

/// The nearest of the centers looked at so far, for each point.
struct Nearest {
    /// Squared distance.
    square: Vec<f64>,
    /// Its number, as a number of the same width as the others.
    center: Vec<f64>,
    /// −1 where −point is the nearer one.
    sign: Vec<f64>,
}

impl Nearest {
    fn of(&self, point: usize) -> (usize, f64) {
        (self.center[point] as usize, self.sign[point])
    }
}

/// Looks at one more center.
struct Look<'a> {
    columns: &'a [Vec<f64>],
    center: &'a [f64],
    number: f64,
    latent_sign: bool,
    nearest: &'a mut Nearest,
}

impl WithSimd for Look<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        const BLOCK: usize = 64;
        let nearest = self.nearest;
        let parts = nearest
            .square
            .chunks_mut(BLOCK)
            .zip(nearest.center.chunks_mut(BLOCK));
        let parts = parts.zip(nearest.sign.chunks_mut(BLOCK)).enumerate();
        for (block, ((square, center), sign)) in parts {
            let (mut plus, mut minus) = ([0.0; BLOCK], [0.0; BLOCK]);
            for (column, c) in self.columns.iter().zip(self.center) {
                let column = &column[block * BLOCK..][..square.len()];
                for ((x, plus), minus) in column.iter().zip(&mut plus).zip(&mut minus) {
                    *plus += (x - c) * (x - c);
                    *minus += (x + c) * (x + c);
                }
            }
            for i in 0..square.len() {
                let turned = self.latent_sign && minus[i] < plus[i];
                let found = if turned { minus[i] } else { plus[i] };
                let nearer = found < square[i];
                square[i] = if nearer { found } else { square[i] };
                center[i] = if nearer { self.number } else { center[i] };
                let found = if turned { -1.0 } else { 1.0 };
                sign[i] = if nearer { found } else { sign[i] };
            }
        }
    }
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
