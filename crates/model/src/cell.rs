//! One cell: rows of one configuration, and how many components they get.
//!
//! ```text
//! BIC(K) = −2 Σ log p + n_parameters · log n
//! ```
//!
//! n counts what was measured independently. Where the node's own columns are constant within each group (the size of an
//! object, over all grasps on it), that is the number of groups: the rows are weighted down to it, so that a component
//! per object never pays. `choose = "bic+cv"` also leaves out whole groups, five folds, and takes the fewest components
//! whose density on held-out groups is within one standard error of the best.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;

use crate::cpd::{Scaling, Sign, Weights, n_mixture_parameters};
use crate::cross_validation::{HeldOut, best_held_out, choose_priors, cross_validate, mean};
use crate::em::{Rows, expect, resume};
use crate::family::{Cells, Family};
use crate::measured::Measured;
use crate::moments::{CovariancePrior, Mixing, Moment, RIDGE, Settings, maximize};
use crate::network::{MixtureOrder, MixtureSpec};
use crate::start::{FitOptions, Robust, fit_orders};
use crate::statistics::EarlierCell;
use crate::train::TrainOptions;

/// BIC differences below this are no evidence; the smaller mixture wins.
const NEAR_TIE: f64 = 2.0;
/// Rows per free parameter of one component below which BIC is not asked.
const ROWS_PER_PARAMETER: f64 = 2.0;

/// What to fit.
pub(crate) struct CellTask<'a> {
    pub node: usize,
    /// Configuration of the discrete parents; `None` takes all, which share something.
    pub cell: Option<usize>,
    pub spec: &'a MixtureSpec,
    pub cells: &'a Cells,
    pub family: &'a Family,
    pub options: TrainOptions,
    pub grouped: bool,
    /// Name of each group; `None` for a row that stands alone.
    pub group_names: &'a [Option<String>],
    /// What rows that are no longer here said of the node, cell by cell; empty for none.
    pub earlier: &'a [EarlierCell],
}

/// What came out.
pub(crate) struct FittedCell {
    pub cell: Option<usize>,
    pub mixing: Mixing,
    /// Complete rows.
    pub rows: Rows,
    /// Expected moments of each configuration and component under `mixing`.
    pub moments: Vec<Vec<Moment>>,
    /// What a row's weight counts here.
    pub scale: f64,
    /// What was measured of the cell itself.
    pub measured: Measured,
    /// The moments of the cell itself where it is pooled, and `moments` are those of all cells.
    pub own_moments: Option<Vec<Vec<Moment>>>,
    pub report: CellReport,
    pub warnings: Vec<String>,
}

/// How one configuration of a continuous node was trained.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CellReport {
    /// Parent and state, for each discrete parent.
    pub configuration: Vec<(String, String)>,
    /// Rows in it.
    pub n_rows: usize,
    /// Independent measurements in it: rows, or groups where the node is constant within groups. BIC's n.
    pub n_effective: f64,
    /// Whether the node is constant within groups here.
    pub constant_in_groups: bool,
    /// Components of the mixture.
    pub components: usize,
    /// Every number of components that was tried.
    pub curve: Vec<OrderScore>,
    /// EM steps of the chosen fit.
    pub steps: usize,
    /// Whether EM ended by itself.
    pub converged: bool,
    /// Components that lost their rows and were started anew.
    pub reinitialized: usize,
    /// Components that lost their rows again and were dropped.
    pub dropped: usize,
    /// Whether there were too few rows, so that the fit over all configurations stands in.
    pub pooled: bool,
    /// Penalised log-likelihood after each step of the chosen fit: never falls.
    #[serde(skip)]
    pub objectives: Vec<f64>,
}

/// One number of components.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OrderScore {
    /// Components asked for.
    pub asked: usize,
    /// Components that kept their rows.
    pub components: usize,
    /// Log-likelihood in standardised units, in independent measurements.
    pub log_likelihood: f64,
    /// Free parameters.
    pub n_parameters: usize,
    /// −2 log-likelihood + `n_parameters` log `n_effective`; smaller is better.
    pub bic: f64,
    /// Mean log density of a held-out group, where cross-validation was asked for.
    pub held_out: Option<f64>,
}

impl CellReport {
    /// ` given task=pouring`, for messages.
    pub fn label(&self) -> String {
        let parts: Vec<String> = self
            .configuration
            .iter()
            .map(|(parent, state)| format!("{parent}={state}"))
            .collect();
        format!(" given {}", parts.join(", "))
    }
    /// [`CellReport::label`], empty where there are no discrete parents.
    pub(crate) fn place(&self) -> String {
        if self.configuration.is_empty() {
            String::new()
        } else {
            self.label()
        }
    }
    /// BIC of the chosen fit.
    pub fn bic(&self) -> Option<f64> {
        self.curve
            .iter()
            .find(|score| score.components == self.components)
            .map(|score| score.bic)
    }
}

/// Fits all cells; every number of components of every cell is one piece of parallel work.
pub(crate) fn fit_cells(tasks: &[CellTask]) -> Vec<FittedCell> {
    let prepared: Vec<Prepared> = tasks
        .par_iter()
        .map(|task| choose_priors(task, Prepared::new(task)))
        .collect();
    // Longest first keeps all threads busy to the end; results come back in the tasks' order.
    let mut order: Vec<usize> = (0..tasks.len()).collect();
    order.sort_by_key(|&i| std::cmp::Reverse(prepared[i].rows.n() * prepared[i].orders.len()));
    let fits_of = in_order(&order, |i| {
        let rng = |k| stream(&tasks[i], k, 0);
        fit_orders(
            &prepared[i].rows,
            &prepared[i].orders,
            fit_options(&tasks[i].options),
            rng,
        )
    });
    let chosen: Vec<usize> = prepared
        .iter()
        .zip(&fits_of)
        .map(|(cell, fits)| best_bic(cell, fits))
        .collect();
    let held_out = cross_validate(tasks, &prepared, &fits_of, &chosen);
    let pieces = tasks
        .iter()
        .zip(prepared)
        .zip(fits_of)
        .zip(chosen.into_iter().zip(held_out));
    pieces
        .map(|(((task, cell), fits), (best, held_out))| conclude(task, cell, fits, best, held_out.as_ref()))
        .collect()
}

/// Goes on from what earlier rows said, with the numbers of components that they chose.
///
/// The components of earlier rows stay as they were given (incremental EM, Neal and Hinton 1998), so the objective never
/// falls; with one component this is the fit to all rows.
pub(crate) fn refit(task: &CellTask) -> FittedCell {
    let cell = Prepared::new(task);
    let settings = &cell.rows.settings;
    let start = maximize(settings, &cell.rows.earlier);
    let (_, moments) = expect(&cell.rows, &start);
    let options = fit_options(&task.options);
    let fit = resume(
        &cell.rows,
        maximize(settings, &moments),
        options.max_steps,
        options.tolerance,
    );
    let k = fit.mixing.k();
    let fits = vec![(
        k,
        Robust {
            fit,
            reinitialized: 0,
            dropped: 0,
        },
    )];
    let mut fitted = conclude(task, cell, fits, 0, None);
    fitted.report.curve.clear();
    fitted
}

/// Runs the work in the given order, and returns the results in index order.
pub(crate) fn in_order<T: Send>(order: &[usize], work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let mut out: Vec<(usize, T)> = order.par_iter().with_max_len(1).map(|&j| (j, work(j))).collect();
    out.sort_by_key(|(j, _)| *j);
    out.into_iter().map(|(_, value)| value).collect()
}

pub(crate) fn fit_options(options: &TrainOptions) -> FitOptions {
    FitOptions {
        restarts: options.restarts,
        max_steps: options.max_steps,
        tolerance: options.tolerance,
    }
}

/// A random stream of its own for every fit: order and threads do not matter.
pub(crate) fn stream(task: &CellTask, k: usize, fold: usize) -> ChaCha8Rng {
    let cell = task.cell.map_or(0, |cell| cell + 1);
    let mut mixed = task.options.seed;
    for part in [task.node, cell, k, fold] {
        mixed = (mixed ^ part as u64)
            .wrapping_mul(0x9E37_79B9_7F4A_7C15)
            .rotate_left(29);
    }
    ChaCha8Rng::seed_from_u64(mixed)
}

/// Rows of a cell, ready for EM.
pub(crate) struct Prepared {
    pub rows: Rows,
    pub groups: Option<Vec<usize>>,
    pub n_effective: f64,
    scale: f64,
    constant: bool,
    pooled: bool,
    orders: Vec<usize>,
    measured: Measured,
    warnings: Vec<String>,
}

impl Prepared {
    fn new(task: &CellTask) -> Self {
        let mut prepared = Self::of(task, task.cell);
        let measured = prepared.measured.clone();
        let enough = prepared.n_effective >= prepared.rows.settings.least_mass() || task.cell.is_none();
        if !enough {
            let found = prepared.n_effective;
            let least = prepared.rows.settings.least_mass();
            let what = if prepared.constant { "groups" } else { "rows" };
            prepared = Self::of(task, None);
            prepared.pooled = true;
            prepared.orders = vec![1];
            prepared.warnings = vec![format!(
                "{found} {what} are too few for {least} unknowns; took one component over all configurations"
            )];
        }
        if task.family.with_gaps {
            prepared
                .warnings
                .push("hardly a row is complete; EM starts with gaps filled by the columns' means".into());
        }
        prepared.measured = measured;
        prepared
    }

    fn of(task: &CellTask, configuration: Option<usize>) -> Self {
        let (family, spec, cells) = (task.family, task.spec, task.cells);
        let d = spec.columns.len();
        let range = family.members(configuration);
        let members = &family.rows[range.clone()];
        let groups: Option<Vec<usize>> = family
            .groups
            .as_ref()
            .map(|groups| groups[range.clone()].to_vec());
        let mut weights: Vec<f64> = members.iter().map(|&row| cells.weights[row]).collect();
        let parents: Vec<&Vec<f64>> = family.parents.iter().flat_map(|&i| &cells.values[i]).collect();
        let q = parents.len();
        let mut z = Vec::with_capacity(members.len() * (d + 1 + q));
        // Gaps are here only where hardly a row is complete: the mean, 0, is where EM starts.
        let filled = |value: f64| if value.is_nan() { 0.0 } else { value };
        for &row in members {
            z.extend(cells.values[task.node].iter().map(|column| filled(column[row])));
            z.push(1.0);
            z.extend(parents.iter().map(|column| filled(column[row])));
        }
        // Pooled cells are a stand-in and share nothing; one configuration alone neither.
        let together = configuration.is_none() && task.cell.is_none();
        let mut settings = settings(spec, &cells.scaling[task.node], q, together);
        let earlier = EarlierCell::of(task.earlier, configuration, task.cell.is_some());
        if let Some(earlier) = &earlier {
            settings.prior = earlier.prior;
            settings.ridge.clone_from(&earlier.ridge);
        }
        let m = settings.m();
        let values: Vec<&[f64]> = z.chunks_exact(m).map(|row| &row[..d]).collect();
        let mut measured = Measured::of(&values, &weights, groups.as_deref(), task.group_names);
        if let Some(earlier) = &earlier {
            measured = measured.joined(&earlier.measured);
        }
        let constant = measured.is_constant();
        let n_effective = measured.n_effective();
        let mut warnings = Vec::new();
        if !constant && groups.is_none() && repeats(&values) {
            warnings.push(
                "most values repeat exactly; if they were measured once per object, say which column names it (group)"
                    .into(),
            );
        }
        let scale = measured.scale();
        for weight in &mut weights {
            *weight *= scale;
        }
        let ends = if together {
            family.ends.clone()
        } else {
            vec![members.len()]
        };
        let rows = Rows {
            settings,
            z,
            weights,
            ends,
            earlier: earlier.map_or_else(Vec::new, |earlier| earlier.scaled(scale)),
            kept: std::sync::OnceLock::new(),
        };
        let orders = orders(spec, &rows, n_effective, constant);
        Self {
            rows,
            groups,
            n_effective,
            scale,
            constant,
            pooled: false,
            orders,
            measured,
            warnings,
        }
    }
}

/// What a cell is fitted with, in units of the node. `together`: several configurations that share something.
pub(crate) fn settings(spec: &MixtureSpec, unit: &Scaling, q: usize, together: bool) -> Settings {
    let units = spec.noise_floor.iter().zip(&unit.standard_deviation);
    Settings {
        d: spec.columns.len(),
        q,
        weights: if together {
            spec.weights
        } else {
            Weights::PerConfiguration
        },
        tied: spec.shared_covariance,
        floor: units.map(|(f, s)| f / s).collect(),
        latent_sign: spec.sign == Sign::Latent,
        ridge: vec![RIDGE; 1 + q],
        prior: CovariancePrior::WEAK,
    }
}

/// Numbers of components to try.
fn orders(spec: &MixtureSpec, rows: &Rows, n_effective: f64, constant: bool) -> Vec<usize> {
    let settings = &rows.settings;
    let one = n_mixture_parameters(1, settings.d, settings.q) as f64;
    // Configurations with Gaussians of their own need rows each.
    let sets = if settings.weights == Weights::Shared {
        1
    } else {
        rows.ends.len()
    };
    let least = settings.least_mass();
    let n_effective = n_effective / sets as f64;
    let per_component = if constant {
        least
    } else {
        (ROWS_PER_PARAMETER * one).max(least)
    };
    let most = ((n_effective / per_component) as usize).max(1);
    match spec.order {
        MixtureOrder::Fixed(k) => vec![k.min(((n_effective / least) as usize).max(1))],
        MixtureOrder::Bic { max, .. } => (1..=max.min(most)).collect(),
    }
}

/// Whether rows outnumber distinct values three to one.
fn repeats(values: &[&[f64]]) -> bool {
    let distinct: std::collections::BTreeSet<Vec<u64>> = values
        .iter()
        .map(|value| value.iter().map(|v| v.to_bits()).collect())
        .collect();
    values.len() >= 30 && 3 * distinct.len() < values.len()
}

fn score(cell: &Prepared, asked: usize, fit: &Robust) -> OrderScore {
    let components = fit.fit.mixing.k();
    let n_parameters = cell.rows.settings.n_parameters(components, cell.rows.ends.len());
    let log_likelihood = fit.fit.log_likelihood;
    let bic = -2.0 * log_likelihood + n_parameters as f64 * cell.n_effective.max(1.0).ln();
    OrderScore {
        asked,
        components,
        log_likelihood,
        n_parameters,
        bic,
        held_out: None,
    }
}

/// Position of the fit with the least BIC, near ties to fewer components.
fn best_bic(cell: &Prepared, fits: &[(usize, Robust)]) -> usize {
    let bics: Vec<f64> = fits.iter().map(|(k, fit)| score(cell, *k, fit).bic).collect();
    let least = bics.iter().copied().fold(f64::INFINITY, f64::min);
    bics.iter().position(|bic| *bic <= least + NEAR_TIE).unwrap_or(0)
}

fn conclude(
    task: &CellTask,
    cell: Prepared,
    mut fits: Vec<(usize, Robust)>,
    by_bic: usize,
    held_out: Option<&HeldOut>,
) -> FittedCell {
    let mut curve: Vec<OrderScore> = fits.iter().map(|(k, fit)| score(&cell, *k, fit)).collect();
    let mut best = by_bic;
    if let Some(held_out) = held_out {
        for (score, groups) in curve.iter_mut().zip(held_out) {
            score.held_out = Some(mean(groups));
        }
        best = best_held_out(held_out);
    }
    let (asked, chosen) = fits.swap_remove(best);
    let components = chosen.fit.mixing.k();
    let mut warnings = cell.warnings;
    if chosen.dropped > 0 && matches!(task.spec.order, MixtureOrder::Fixed(_)) {
        warnings.push(format!(
            "{components} of {asked} components kept their rows; the others were dropped"
        ));
    }
    if let MixtureOrder::Fixed(k) = task.spec.order
        && asked < k
        && !cell.pooled
    {
        warnings.push(format!(
            "{} measurements carry {asked} of {k} components",
            cell.n_effective
        ));
    }
    if !chosen.fit.converged {
        warnings.push(format!(
            "EM ended after {} steps without settling",
            chosen.fit.objectives.len() - 1
        ));
    }
    let report = CellReport {
        configuration: Vec::new(),
        n_rows: cell.measured.n_rows,
        n_effective: cell.n_effective,
        constant_in_groups: cell.constant,
        components,
        curve,
        steps: chosen.fit.objectives.len() - 1,
        converged: chosen.fit.converged,
        reinitialized: chosen.reinitialized,
        dropped: chosen.dropped,
        pooled: cell.pooled,
        objectives: chosen.fit.objectives,
    };
    let own_moments = cell.pooled.then(|| {
        let own = Prepared::of(task, task.cell);
        expect(&own.rows, &chosen.fit.mixing).1
    });
    let rows = if task.family.with_gaps {
        let place = if cell.pooled { None } else { task.cell };
        let start = task.family.members(place).start;
        let known = |&i: &usize| {
            let mut family = task.family.parents.iter().chain([&task.node]);
            family.all(|&node| task.cells.is_known(node, task.family.rows[start + i]))
        };
        cell.rows
            .select(&(0..cell.rows.n()).filter(known).collect::<Vec<_>>())
    } else {
        cell.rows
    };
    let (_, moments) = expect(&rows, &chosen.fit.mixing);
    FittedCell {
        cell: task.cell,
        mixing: chosen.fit.mixing,
        rows,
        moments,
        scale: cell.scale,
        measured: cell.measured,
        own_moments,
        report,
        warnings,
    }
}
