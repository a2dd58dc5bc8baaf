//! Cross-validation over groups: how many components do unseen objects bear out?

use rand::seq::SliceRandom;

use crate::cell::{CellTask, Prepared, fit_options, in_order, stream};
use crate::em::row_log_densities;
use crate::moments::{CovariancePrior, RIDGE};
use crate::network::MixtureOrder;
use crate::start::{FitOptions, Robust, fit_mixture};

/// Folds of the cross-validation over groups.
const FOLDS: usize = 5;
/// Starts of EM in each fold: the curve needs the order right, not the last nat.
const FOLD_RESTARTS: usize = 2;

/// Held-out log densities per group and number of components, for cells that ask for them.
pub(crate) type HeldOut = Vec<Vec<f64>>;

pub(crate) fn cross_validate(
    tasks: &[CellTask],
    prepared: &[Prepared],
    fits: &[Vec<(usize, Robust)>],
    chosen: &[usize],
) -> Vec<Option<HeldOut>> {
    let mut jobs = Vec::new();
    let mut folds_of = Vec::with_capacity(tasks.len());
    for (i, task) in tasks.iter().enumerate() {
        let wanted = matches!(task.spec.order, MixtureOrder::Bic { guard: true, .. }) && task.grouped;
        let folds = if wanted && chosen[i] > 0 {
            folds(task, &prepared[i])
        } else {
            Vec::new()
        };
        for fold in 0..folds.len() {
            for (k, _) in &fits[i][..=chosen[i]] {
                jobs.push((i, fold, *k));
            }
        }
        folds_of.push(folds);
    }
    let mut order: Vec<usize> = (0..jobs.len()).collect();
    order.sort_by_key(|&j| std::cmp::Reverse(prepared[jobs[j].0].rows.n() * jobs[j].2));
    let scores = in_order(&order, |j| {
        let (i, fold, k) = jobs[j];
        held_out(&tasks[i], &prepared[i], &folds_of[i][fold], k, fold)
    });
    let mut out: Vec<Option<HeldOut>> = folds_of
        .iter()
        .zip(chosen)
        .map(|(folds, &best)| (!folds.is_empty()).then(|| vec![Vec::new(); best + 1]))
        .collect();
    for ((i, _, k), groups) in jobs.into_iter().zip(scores) {
        let position = fits[i].iter().position(|(asked, _)| *asked == k).unwrap_or(0);
        if let Some(held_out) = &mut out[i] {
            held_out[position].extend(groups);
        }
    }
    out
}

/// Ridges tried for parents that do not vary within a group, in groups' worth of evidence, strongest first.
const RIDGES: [f64; 6] = [1e4, 1e3, 100.0, 10.0, 1.0, 0.0];
/// Prior deviations tried, in standard deviations of the column, widest first; 0 stands for the weak prior.
const DEVIATIONS: [f64; 4] = [1.0, 0.5, 0.25, 0.0];

/// How strongly regressions on what is constant within a group are held back, and how wide covariances are kept: what
/// held-out groups bear out.
///
/// Thousands of rows of a dozen objects are a dozen measurements of how a feature goes with size: taken as thousands
/// they give slopes that fit each object and mislead about the next. Only for cells that ask for the guard. Of the
/// strengths within one standard error of the best the strongest is taken.
pub(crate) fn choose_priors(task: &CellTask, mut cell: Prepared) -> Prepared {
    let wanted = matches!(task.spec.order, MixtureOrder::Bic { guard: true, .. }) && task.grouped;
    let folds = if wanted { folds(task, &cell) } else { Vec::new() };
    if folds.is_empty() {
        return cell;
    }
    let held_back = parents_constant_in_groups(&cell);
    let mut groups = cell.groups.clone().unwrap_or_default();
    groups.sort_unstable();
    groups.dedup();
    let one_group = cell.n_effective / groups.len() as f64;
    let try_all = |cell: &mut Prepared, n: usize, set: &dyn Fn(&mut Prepared, usize)| {
        let mut held: HeldOut = Vec::with_capacity(n);
        for choice in 0..n {
            set(cell, choice);
            let fold = |(number, fold): (usize, &Vec<usize>)| held_out(task, cell, fold, 1, number);
            held.push(folds.iter().enumerate().flat_map(fold).collect());
        }
        set(cell, best_held_out(&held));
    };
    if held_back.iter().any(|constant| *constant) {
        try_all(&mut cell, RIDGES.len(), &|cell, choice| {
            for (ridge, constant) in cell.rows.settings.ridge[1..].iter_mut().zip(&held_back) {
                *ridge = RIDGE
                    + if *constant {
                        RIDGES[choice] * one_group
                    } else {
                        0.0
                    };
            }
        });
    }
    try_all(&mut cell, DEVIATIONS.len(), &|cell, choice| {
        cell.rows.settings.prior = if DEVIATIONS[choice] > 0.0 {
            CovariancePrior {
                rows: one_group,
                deviation: DEVIATIONS[choice],
            }
        } else {
            CovariancePrior::WEAK
        };
    });
    cell
}

/// For each parent whether it has one value in each group.
fn parents_constant_in_groups(cell: &Prepared) -> Vec<bool> {
    let groups = cell.groups.as_deref().unwrap_or(&[]);
    let settings = &cell.rows.settings;
    (0..settings.q)
        .map(|parent| {
            let mut first = std::collections::BTreeMap::new();
            groups.iter().enumerate().all(|(row, group)| {
                let value = cell.rows.row(row)[settings.d + 1 + parent];
                let known: f64 = *first.entry(*group).or_insert(value);
                (known - value).abs() <= 1e-5
            })
        })
        .collect()
}

/// Rows of each fold; groups stay whole. None where there are too few groups.
fn folds(task: &CellTask, cell: &Prepared) -> Vec<Vec<usize>> {
    let Some(groups) = &cell.groups else {
        return Vec::new();
    };
    let mut distinct = groups.clone();
    distinct.sort_unstable();
    distinct.dedup();
    if distinct.len() < 3 {
        return Vec::new();
    }
    distinct.shuffle(&mut stream(task, 0, usize::MAX));
    let n = FOLDS.min(distinct.len());
    let mut out = vec![Vec::new(); n];
    for (row, group) in groups.iter().enumerate() {
        let place = distinct.iter().position(|other| other == group).unwrap_or(0);
        out[place % n].push(row);
    }
    out
}

/// Fits without a fold, and returns the mean log density of each of its groups.
fn held_out(task: &CellTask, cell: &Prepared, fold: &[usize], k: usize, number: usize) -> Vec<f64> {
    let Some(groups) = &cell.groups else {
        return Vec::new();
    };
    let train: Vec<usize> = (0..cell.rows.n()).filter(|row| !fold.contains(row)).collect();
    let options = FitOptions {
        restarts: FOLD_RESTARTS,
        ..fit_options(&task.options)
    };
    let fit = fit_mixture(
        &cell.rows.select(&train),
        k,
        None,
        options,
        &mut stream(task, k, number + 1),
    );
    let density = row_log_densities(&cell.rows.select(fold), &fit.fit.mixing);
    let mut sums: std::collections::BTreeMap<usize, (f64, f64)> = std::collections::BTreeMap::new();
    for (&row, density) in fold.iter().zip(density) {
        let (sum, mass) = sums.entry(groups[row]).or_default();
        *sum += cell.rows.weights[row] * density;
        *mass += cell.rows.weights[row];
    }
    sums.into_values().map(|(sum, mass)| sum / mass).collect()
}

pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The fewest components whose held-out density is within one standard error, by group, of the best.
pub(crate) fn best_held_out(held_out: &HeldOut) -> usize {
    let means: Vec<f64> = held_out.iter().map(|groups| mean(groups)).collect();
    let best = (0..means.len()).fold(0, |best, i| if means[i] > means[best] { i } else { best });
    (0..best)
        .find(|&i| {
            let lost: Vec<f64> = held_out[best]
                .iter()
                .zip(&held_out[i])
                .map(|(a, b)| a - b)
                .collect();
            let center = mean(&lost);
            let variance =
                lost.iter().map(|l| (l - center) * (l - center)).sum::<f64>() / (lost.len() as f64 - 1.0);
            center <= (variance / lost.len() as f64).sqrt()
        })
        .unwrap_or(best)
}
