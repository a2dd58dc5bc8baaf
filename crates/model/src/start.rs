//! Where EM starts: k-means++ on the values, or on what a single regression leaves over, or the fit with one component
//! fewer, split.
//!
//! All starts run a few steps, the better half goes on, and the best one is carried to its end: most starts are hopeless
//! long before they settle.

use nalgebra::DVector;
use rand::Rng;

use crate::cpd::Weights;
use crate::em::{Fit, Rows, expect, gather, resume, row_log_densities, run};
use crate::k_means::k_means;
use crate::moments::{Mixing, Moment, maximize};

/// Share of a row's responsibility that its own cluster starts with.
const SOFT: f64 = 0.9;
/// EM steps of each start before the worse half is given up.
const FIRST_STEPS: usize = 4;
/// EM steps of the better half before the best one is carried on.
const SHORT_STEPS: usize = 10;
/// Starts look at no more rows than this, evenly spread.
const MOST_START_ROWS: usize = 20_000;

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

/// Fits each number of components in turn; each but the first also starts from the one before, split.
pub(crate) fn fit_orders(
    rows: &Rows,
    orders: &[usize],
    options: FitOptions,
    mut rng: impl FnMut(usize) -> rand_chacha::ChaCha8Rng,
) -> Vec<(usize, Robust)> {
    let mut out: Vec<(usize, Robust)> = Vec::with_capacity(orders.len());
    for &k in orders {
        let smaller = out
            .last()
            .map(|(_, robust)| &robust.fit.mixing)
            .filter(|mixing| mixing.k() + 1 == k);
        let robust = fit_mixture(rows, k, smaller, options, &mut rng(k));
        out.push((k, robust));
    }
    out
}

/// Fits k components (fewer where rows do not carry them). `smaller` is a fit with one component fewer.
pub(crate) fn fit_mixture(
    rows: &Rows,
    k: usize,
    smaller: Option<&Mixing>,
    options: FitOptions,
    rng: &mut impl Rng,
) -> Robust {
    let sample = (rows.n() > MOST_START_ROWS).then(|| {
        let step = |i: usize| i * rows.n() / MOST_START_ROWS;
        rows.select(&(0..MOST_START_ROWS).map(step).collect::<Vec<_>>())
    });
    let best = best_start(sample.as_ref().unwrap_or(rows), k, smaller, options, rng);
    let fit = if sample.is_some() {
        resume(rows, best.mixing, options.max_steps, options.tolerance)
    } else {
        finish(rows, best, options)
    };
    let fit = if k > 2 && options.restarts > 1 {
        merge_and_split(rows, fit, options)
    } else {
        fit
    };
    keep_carried(rows, fit, options)
}

/// Two components that are nearly one become one, and the widest other component becomes two, if J gains by it: what
/// starts from clusters most often get wrong.
fn merge_and_split(rows: &Rows, fit: Fit, options: FitOptions) -> Fit {
    let settings = &rows.settings;
    let (_, moments) = expect(rows, &fit.mixing);
    let k = fit.mixing.k();
    let log_volume = |mixing: &Mixing, c: usize| -> f64 {
        let sets = mixing.components.iter();
        sets.map(|set| set[c].covariance.determinant().max(f64::MIN_POSITIVE).ln())
            .sum()
    };
    let volumes: Vec<f64> = (0..k).map(|c| log_volume(&fit.mixing, c)).collect();
    // What a pair's components together would look like; with one covariance for all, all others are needed too.
    let pair = |a: usize, b: usize| -> Vec<Vec<Moment>> {
        let one = |cell: &Vec<Moment>| {
            let mut sum = cell[a].clone();
            sum.add(&cell[b]);
            let others = (0..k).filter(|&c| settings.tied && c != a && c != b);
            std::iter::once(sum)
                .chain(others.map(|c| cell[c].clone()))
                .collect()
        };
        moments.iter().map(one).collect()
    };
    let mut least = (f64::INFINITY, 0, 1);
    for a in 0..k {
        for b in a + 1..k {
            let mass = fit.masses[a] + fit.masses[b];
            let volume = log_volume(&maximize(settings, &pair(a, b)), 0);
            let loss = mass * volume - fit.masses[a] * volumes[a] - fit.masses[b] * volumes[b];
            if loss < least.0 {
                least = (loss, a, b);
            }
        }
    }
    let (_, a, b) = least;
    let mut merged = moments;
    for cell in &mut merged {
        let other = cell.remove(b);
        cell[a].add(&other);
    }
    let merged = maximize(settings, &merged);
    let widest = (0..k)
        .filter(|c| *c != a && *c != b)
        .fold(None, |best: Option<usize>, c| match best {
            Some(best) if volumes[best] >= volumes[c] => Some(best),
            _ => Some(c),
        });
    let Some(widest) = widest else { return fit };
    // Components after b have moved down by one.
    let start = split(&merged, Some(if widest > b { widest - 1 } else { widest }));
    let short = resume(rows, start, SHORT_STEPS.min(options.max_steps), options.tolerance);
    // What is still far behind after some steps is no better optimum.
    let behind = last(&fit) - last(&short);
    let gain = match short.objectives.as_slice() {
        [.., before, after] => after - before,
        _ => 0.0,
    };
    if behind > 10.0 * gain {
        return fit;
    }
    let other = finish(rows, short, options);
    if last(&other) > last(&fit) { other } else { fit }
}

fn best_start(
    rows: &Rows,
    k: usize,
    smaller: Option<&Mixing>,
    options: FitOptions,
    rng: &mut impl Rng,
) -> Fit {
    let alone = k == 1 && !rows.settings.latent_sign;
    let restarts = if alone { 1 } else { options.restarts.max(1) };
    let residuals =
        (rows.settings.q > 0 && k > 1 && restarts > 1).then(|| residuals(rows, options.tolerance));
    let first = FIRST_STEPS.min(options.max_steps);
    let mut fits: Vec<Fit> = Vec::with_capacity(restarts);
    for restart in 0..restarts {
        let fit = match smaller {
            Some(smaller) if restart > 0 && restart + 1 == restarts => {
                resume(rows, split(smaller, None), first, options.tolerance)
            }
            _ => {
                let features = residuals.as_deref().filter(|_| restart % 2 == 1);
                let start = cluster(rows, features, k, rng);
                run(rows, &start, first, options.tolerance)
            }
        };
        fits.push(fit);
    }
    fits.sort_by(|a, b| last(b).total_cmp(&last(a)));
    fits.truncate(restarts.div_ceil(2));
    if fits.len() > 1 {
        let short = FitOptions {
            max_steps: SHORT_STEPS.min(options.max_steps),
            ..options
        };
        fits = fits.into_iter().map(|fit| finish(rows, fit, short)).collect();
        fits.sort_by(|a, b| last(b).total_cmp(&last(a)));
    }
    fits.swap_remove(0)
}

/// Starts components that lost their rows anew once, then drops them.
fn keep_carried(rows: &Rows, fit: Fit, options: FitOptions) -> Robust {
    let mut robust = Robust {
        fit,
        reinitialized: 0,
        dropped: 0,
    };
    let least = rows.settings.least_mass() * robust.fit.mixing.components.len() as f64;
    while robust.fit.mixing.k() > 1 {
        let mass = &robust.fit.masses;
        let Some(lost) = (0..mass.len())
            .filter(|&c| mass[c] < least)
            .min_by(|&a, &b| mass[a].total_cmp(&mass[b]))
        else {
            break;
        };
        if robust.reinitialized == 0 {
            robust.reinitialized = 1;
            let again = reinitialize(rows, &robust.fit.mixing, lost, options);
            if last(&again) > last(&robust.fit) {
                robust.fit = again;
            }
            continue;
        }
        let mut mixing = robust.fit.mixing.clone();
        for set in &mut mixing.components {
            set.remove(lost);
        }
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

/// Carries a short run on; the history joins up.
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

/// One component, by default the heaviest, becomes two, half a standard deviation to either side along its longest axis.
fn split(smaller: &Mixing, which: Option<usize>) -> Mixing {
    let k = smaller.k();
    let mut mixing = smaller.clone();
    // Where one set serves all configurations, the same component is split in all.
    let shared = smaller.components.len() != smaller.log_weights.len();
    let chosen = |cell: usize| {
        let row = &smaller.log_weights[if shared { 0 } else { cell }];
        which.unwrap_or_else(|| (0..k).fold(0, |best, c| if row[c] > row[best] { c } else { best }))
    };
    for (cell, row) in mixing.log_weights.iter_mut().enumerate() {
        let c = chosen(cell);
        row[c] -= std::f64::consts::LN_2;
        row.push(row[c]);
    }
    for (i, set) in mixing.components.iter_mut().enumerate() {
        let c = chosen(i);
        let eigen = set[c].covariance.clone().symmetric_eigen();
        let axis = eigen.eigenvalues.imax();
        let step: DVector<f64> =
            0.5 * eigen.eigenvalues[axis].max(0.0).sqrt() * eigen.eigenvectors.column(axis);
        let mut other = set[c].clone();
        for i in 0..step.len() {
            set[c].slopes[(i, 0)] += step[i];
            other.slopes[(i, 0)] -= step[i];
        }
        set.push(other);
    }
    mixing
}

/// Gives a component that lost its rows to those that are explained worst.
fn reinitialize(rows: &Rows, mixing: &Mixing, lost: usize, options: FitOptions) -> Fit {
    let density = row_log_densities(rows, mixing);
    let mut order: Vec<usize> = (0..rows.n()).collect();
    order.sort_by(|&a, &b| density[a].total_cmp(&density[b]));
    let mut label = nearest(rows, mixing, lost);
    let mut mass = 0.0;
    for &i in &order {
        if mass >= 2.0 * rows.settings.least_mass() {
            break;
        }
        label[i].0 = lost;
        mass += rows.weights[i];
    }
    run(
        rows,
        &soften(rows, &label, mixing.k()),
        options.max_steps,
        options.tolerance,
    )
}

/// The likeliest other component of each row, and the sign.
fn nearest(rows: &Rows, mixing: &Mixing, lost: usize) -> Vec<(usize, f64)> {
    let mut best = vec![(f64::NEG_INFINITY, 0, 1.0); rows.n()];
    for c in (0..mixing.k()).filter(|&c| c != lost) {
        let alone = Mixing {
            log_weights: vec![vec![0.0]; rows.ends.len()],
            components: mixing.components.iter().map(|set| vec![set[c].clone()]).collect(),
        };
        let densities = row_log_densities(rows, &alone);
        for cell in 0..rows.ends.len() {
            let slopes = &alone.set(cell)[0].slopes;
            for i in rows.cell(cell) {
                if densities[i] > best[i].0 {
                    let row = rows.row(i);
                    let side: f64 = predict(rows.settings.d, slopes, row)
                        .iter()
                        .zip(row)
                        .map(|(a, b)| a * b)
                        .sum();
                    best[i] = (densities[i], c, if side < 0.0 { -1.0 } else { 1.0 });
                }
            }
        }
    }
    best.into_iter().map(|(_, c, sign)| (c, sign)).collect()
}

fn predict(d: usize, slopes: &nalgebra::DMatrix<f64>, row: &[f64]) -> Vec<f64> {
    (0..d)
        .map(|j| (0..slopes.ncols()).map(|c| slopes[(j, c)] * row[d + c]).sum())
        .collect()
}

/// y minus one regression on p for each configuration, row after row.
fn residuals(rows: &Rows, tolerance: f64) -> Vec<f64> {
    let d = rows.settings.d;
    let one = run(rows, &gather(rows, 1, |_, _| (1.0, 0.0)), 0, tolerance).mixing;
    let mut out = Vec::with_capacity(rows.n() * d);
    for cell in 0..rows.ends.len() {
        for i in rows.cell(cell) {
            let row = rows.row(i);
            let mean = predict(d, &one.set(cell)[0].slopes, row);
            out.extend(row.iter().zip(mean).map(|(y, mean)| y - mean));
        }
    }
    out
}

/// k-means++ and some Lloyd steps on y or on the given features, softened. Configurations with components of their own
/// are clustered apart, heaviest cluster first, so that clusters of one number may share a weight.
fn cluster(rows: &Rows, features: Option<&[f64]>, k: usize, rng: &mut impl Rng) -> Vec<Vec<Moment>> {
    let mut labels = vec![(0, 1.0); rows.n()];
    let together = rows.settings.weights == Weights::Shared;
    let cells = if together { 1 } else { rows.ends.len() };
    for cell in 0..cells {
        let range = if together { 0..rows.n() } else { rows.cell(cell) };
        if range.is_empty() {
            continue;
        }
        let d = rows.settings.d;
        let point = |i: usize| match features {
            Some(features) => &features[i * d..(i + 1) * d],
            None => &rows.row(i)[..d],
        };
        let points: Vec<&[f64]> = range.clone().map(point).collect();
        let found = k_means(
            &points,
            &rows.weights[range.clone()],
            k,
            rows.settings.latent_sign,
            rng,
        );
        labels[range].copy_from_slice(&found);
    }
    soften(rows, &labels, k)
}

/// Moments where most of each row goes to its own cluster, with its sign.
fn soften(rows: &Rows, label: &[(usize, f64)], k: usize) -> Vec<Vec<Moment>> {
    let (soft, rest) = if k == 1 {
        (1.0, 0.0)
    } else {
        (SOFT, (1.0 - SOFT) / (k - 1) as f64)
    };
    gather(rows, k, |i, c| {
        let (own, sign) = label[i];
        let share = if c == own { soft } else { rest };
        if sign > 0.0 { (share, 0.0) } else { (0.0, share) }
    })
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::moments::{CovariancePrior, RIDGE, Settings};

    /// A grid without clusters, where a start depends on what is drawn.
    fn grid() -> Rows {
        let points = (0..400).map(|i| (f64::from(i % 20), f64::from(i / 20)));
        Rows {
            settings: Settings {
                d: 2,
                q: 0,
                weights: Weights::PerConfiguration,
                tied: false,
                floor: vec![0.0; 2],
                latent_sign: false,
                ridge: vec![RIDGE],
                prior: CovariancePrior::WEAK,
            },
            z: points.flat_map(|(x, y)| [x, y, 1.0]).collect(),
            weights: vec![1.0; 400],
            ends: vec![400],
            earlier: Vec::new(),
            kept: std::sync::OnceLock::new(),
        }
    }

    #[test]
    fn restarts_start_apart() {
        let rows = grid();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut means = || -> Vec<f64> {
            let start = maximize(&rows.settings, &cluster(&rows, None, 3, &mut rng));
            start
                .set(0)
                .iter()
                .flat_map(|part| part.slopes.iter().copied())
                .collect()
        };
        let starts = [means(), means(), means()];
        for (i, one) in starts.iter().enumerate() {
            for other in &starts[i + 1..] {
                let apart = one
                    .iter()
                    .zip(other)
                    .map(|(a, b)| (a - b).abs())
                    .fold(0.0, f64::max);
                assert!(apart > 0.1, "two starts with means within {apart}");
            }
        }
    }
}
