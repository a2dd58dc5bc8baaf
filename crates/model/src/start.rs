//! Where EM starts: k-means++ on the values, or on what a single regression leaves over.

use faer::Mat;
use nalgebra::DMatrix;
use rand::{Rng, RngExt};

use crate::em::{Fit, Mixing, Responsibilities, Rows, masses, resume, row_log_densities, run};

/// Share of a row's responsibility that its own cluster starts with.
const SOFT: f64 = 0.9;
/// Lloyd steps after k-means++: the start only has to be near.
const LLOYD_STEPS: usize = 8;
/// EM steps of each start before the best one is carried on.
const SHORT_STEPS: usize = 12;

/// How a mixture is fitted.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FitOptions {
    pub restarts: usize,
    pub max_steps: usize,
    pub tolerance: f64,
}

/// The best of several starts, with components that lost their rows started anew once, then dropped.
pub(crate) struct Robust {
    pub fit: Fit,
    pub reinitialized: usize,
    pub dropped: usize,
}

/// Fits k components (fewer where rows do not carry them).
pub(crate) fn fit_mixture(rows: &Rows, k: usize, options: FitOptions, rng: &mut impl Rng) -> Robust {
    let mut best: Option<Fit> = None;
    let restarts = if k == 1 && !rows.latent_sign {
        1
    } else {
        options.restarts.max(1)
    };
    let residuals = (rows.q() > 0 && k > 1 && restarts > 1).then(|| residuals(rows));
    for restart in 0..restarts {
        let features = match &residuals {
            Some(residuals) if restart % 2 == 1 => residuals,
            _ => &rows.z,
        };
        let start = cluster(rows, features, k, rng);
        let fit = run(
            rows,
            &start,
            k,
            SHORT_STEPS.min(options.max_steps),
            options.tolerance,
        );
        let better = best.as_ref().is_none_or(|best| last(&fit) > last(best));
        if better {
            best = Some(fit);
        }
    }
    let Some(best) = best else {
        unreachable!("there is at least one start")
    };
    let mut robust = Robust {
        fit: finish(rows, best, options),
        reinitialized: 0,
        dropped: 0,
    };
    while robust.fit.mixing.components.len() > 1 {
        let mass = masses(rows, &robust.fit.mixing);
        let Some(lost) = (0..mass.len())
            .filter(|&c| mass[c] < rows.least_mass())
            .min_by(|&a, &b| mass[a].total_cmp(&mass[b]))
        else {
            break;
        };
        if robust.reinitialized == 0 {
            robust.reinitialized = 1;
            let again = finish(
                rows,
                reinitialize(rows, &robust.fit.mixing, lost, options),
                options,
            );
            if last(&again) > last(&robust.fit) {
                robust.fit = again;
            }
            continue;
        }
        let mut mixing = robust.fit.mixing.clone();
        mixing.components.remove(lost);
        for row in &mut mixing.log_weights {
            row.remove(lost);
            let total = crate::gaussian::log_sum_exp(row);
            for log_weight in row.iter_mut() {
                *log_weight -= total;
            }
        }
        robust.fit = resume(rows, mixing, options.max_steps, options.tolerance);
        robust.dropped += 1;
    }
    robust
}

fn last(fit: &Fit) -> f64 {
    fit.objectives.last().copied().unwrap_or(f64::NEG_INFINITY)
}

/// Carries a short run to its end; the history joins up.
fn finish(rows: &Rows, short: Fit, options: FitOptions) -> Fit {
    if short.converged {
        return short;
    }
    let mut fit = resume(rows, short.mixing, options.max_steps, options.tolerance);
    let mut objectives = short.objectives;
    objectives.extend_from_slice(&fit.objectives[1..]);
    fit.objectives = objectives;
    fit
}

/// Gives a component that lost its rows to those that are explained worst.
fn reinitialize(rows: &Rows, mixing: &Mixing, lost: usize, options: FitOptions) -> Fit {
    let density = row_log_densities(rows, mixing);
    let mut order: Vec<usize> = (0..rows.n()).collect();
    order.sort_by(|&a, &b| density[a].total_cmp(&density[b]));
    let k = mixing.components.len();
    let mut label = nearest(rows, mixing, lost);
    let mut mass = 0.0;
    for &i in &order {
        if mass >= 2.0 * rows.least_mass() {
            break;
        }
        label[i].0 = lost;
        mass += rows.weights[i];
    }
    run(
        rows,
        &soften(rows, &label, k),
        k,
        options.max_steps,
        options.tolerance,
    )
}

/// The likeliest other component of each row, and the sign.
fn nearest(rows: &Rows, mixing: &Mixing, lost: usize) -> Vec<(usize, f64)> {
    let mut best = vec![(f64::NEG_INFINITY, 0, 1.0); rows.n()];
    for c in (0..mixing.components.len()).filter(|&c| c != lost) {
        let alone = Mixing {
            log_weights: vec![vec![0.0]; rows.n_cells],
            components: vec![mixing.components[c].clone()],
        };
        for (i, density) in row_log_densities(rows, &alone).into_iter().enumerate() {
            if density > best[i].0 {
                let mean = predict(rows, &alone.components[0].slopes, i);
                let side: f64 = (0..rows.d).map(|j| mean[j] * rows.z[(j, i)]).sum();
                best[i] = (density, c, if side < 0.0 { -1.0 } else { 1.0 });
            }
        }
    }
    best.into_iter().map(|(_, c, sign)| (c, sign)).collect()
}

fn predict(rows: &Rows, slopes: &DMatrix<f64>, i: usize) -> Vec<f64> {
    (0..rows.d)
        .map(|j| {
            (0..slopes.ncols())
                .map(|c| slopes[(j, c)] * rows.z[(rows.d + c, i)])
                .sum()
        })
        .collect()
}

/// y minus one regression on p, in the first d rows.
fn residuals(rows: &Rows) -> Mat<f64> {
    let all = Responsibilities {
        total: vec![vec![1.0]; rows.n()],
        signed: vec![vec![1.0]; rows.n()],
    };
    let one = run(rows, &all, 1, 0, 0.0).mixing;
    let slopes = &one.components[0].slopes;
    let mut out = Mat::zeros(rows.d, rows.n());
    for i in 0..rows.n() {
        for (j, mean) in predict(rows, slopes, i).into_iter().enumerate() {
            out[(j, i)] = rows.z[(j, i)] - mean;
        }
    }
    out
}

/// k-means++ and some Lloyd steps on the first d rows of `features`, softened.
fn cluster(rows: &Rows, features: &Mat<f64>, k: usize, rng: &mut impl Rng) -> Responsibilities {
    let n = rows.n();
    let point = |i: usize| -> Vec<f64> { (0..rows.d).map(|j| features[(j, i)]).collect() };
    let distance = |i: usize, center: &[f64]| -> (f64, f64) {
        let (mut plus, mut minus) = (0.0, 0.0);
        for (j, c) in center.iter().enumerate() {
            let x = features[(j, i)];
            plus += (x - c) * (x - c);
            minus += (x + c) * (x + c);
        }
        if rows.latent_sign && minus < plus {
            (minus, -1.0)
        } else {
            (plus, 1.0)
        }
    };
    let mut centers = vec![point(draw(&rows.weights, rng))];
    let mut square: Vec<f64> = vec![f64::INFINITY; n];
    while centers.len() < k {
        let newest = &centers[centers.len() - 1];
        for i in 0..n {
            square[i] = square[i].min(distance(i, newest).0);
        }
        let weighted: Vec<f64> = square.iter().zip(&rows.weights).map(|(s, w)| s * w).collect();
        centers.push(point(draw(&weighted, rng)));
    }
    let mut label = vec![(0, 1.0); n];
    for _ in 0..LLOYD_STEPS {
        for (i, label) in label.iter_mut().enumerate() {
            let mut least = f64::INFINITY;
            for (c, center) in centers.iter().enumerate() {
                let (square, sign) = distance(i, center);
                if square < least {
                    least = square;
                    *label = (c, sign);
                }
            }
        }
        let mut sums = vec![(0.0, vec![0.0; rows.d]); k];
        for (i, &(c, sign)) in label.iter().enumerate() {
            sums[c].0 += rows.weights[i];
            for (j, sum) in sums[c].1.iter_mut().enumerate() {
                *sum += rows.weights[i] * sign * features[(j, i)];
            }
        }
        for (center, (mass, sum)) in centers.iter_mut().zip(sums) {
            if mass > 0.0 {
                *center = sum.into_iter().map(|value| value / mass).collect();
            }
        }
    }
    soften(rows, &label, k)
}

fn soften(rows: &Rows, label: &[(usize, f64)], k: usize) -> Responsibilities {
    let soft = if k == 1 { 1.0 } else { SOFT };
    let rest = if k == 1 {
        0.0
    } else {
        (1.0 - SOFT) / (k - 1) as f64
    };
    let total: Vec<Vec<f64>> = label
        .iter()
        .map(|&(own, _)| (0..k).map(|c| if c == own { soft } else { rest }).collect())
        .collect();
    let signed = if rows.latent_sign {
        label
            .iter()
            .zip(&total)
            .map(|(&(_, sign), row)| row.iter().map(|r| r * sign).collect())
            .collect()
    } else {
        Vec::new()
    };
    Responsibilities { total, signed }
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
