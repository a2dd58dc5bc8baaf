//! The continuous nodes of one configuration, compiled: the combinations of components as a tree, one level for each
//! node, parents first.
//!
//! A path through the tree chooses a component at each node. A hidden node appends its mean to those carried along; an
//! observed one contributes a Gaussian density, given the hidden ones' components and the observations before it, and
//! moves the means:
//!
//! ```text
//! residual = reading · [row, 1] − coefficients · means
//! log term += constant − ½ |white · residual|²
//! means    += pull · residual
//! ```
//!
//! Readings and coefficients belong to the component alone, constant, white and pull to the path; all factorization of
//! matrices is done beforehand, and a branch costs the same however long the row is.

use nalgebra::DMatrix;

use crate::block::Step;
use crate::gaussian::log_sum_exp;
use crate::root_gaussian::RootGaussian;
use crate::von_mises_fisher::{VonMisesFisher, log_normalizer};

/// Branches of the largest tree that is compiled.
const MAX_BRANCHES: usize = 400_000;

/// The compiled nodes.
#[derive(Default)]
pub(crate) struct Tree {
    pub levels: Vec<Level>,
    pub n_hidden: usize,
}

/// The components of one node, and what each branch has of its own.
pub(crate) struct Level {
    pub dim: usize,
    pub n_alternatives: usize,
    /// Where the values of a hidden node start among the means; none for an observed one.
    pub start: Option<usize>,
    /// Columns of [row, 1] that readings use; per alternative dim × columns.
    pub columns: Vec<usize>,
    pub reading: Vec<f64>,
    /// Means that are read; per alternative dim × as many.
    pub hidden_columns: Vec<usize>,
    pub coefficients: Vec<f64>,
    /// Means that are moved, as a later level reads them; per branch as many × dim.
    pub moved: Vec<usize>,
    pub pull: Vec<f64>,
    /// Per branch log weight and normalizer.
    pub constant: Vec<f64>,
    /// Per branch the lower triangle, row by row; empty where readings are white already.
    pub white: Vec<f64>,
    /// Per branch the log of the most that all below can contribute.
    pub below: Vec<f64>,
}

impl Tree {
    /// `None` where a component has no density, or the tree would be too large.
    pub fn grow(steps: &[Step]) -> Option<Self> {
        let mut tree = Self::default();
        let mut n_branches = 1usize;
        for (depth, step) in steps.iter().enumerate() {
            n_branches = n_branches.checked_mul(step.n_alternatives())?;
            if n_branches > MAX_BRANCHES {
                return None;
            }
            let start = (!step.is_observed()).then_some(tree.n_hidden);
            let level = Level::of(step, start, &steps[depth + 1..]);
            tree.n_hidden += start.map_or(0, |_| level.dim);
            tree.levels.push(level);
        }
        descend(steps, &mut tree.levels, &RootGaussian::empty(0))?;
        for depth in (1..tree.levels.len()).rev() {
            let (above, here) = tree.levels.split_at_mut(depth);
            let peaks = here[0].constant.iter().zip(&here[0].below);
            let peaks: Vec<f64> = peaks.map(|(constant, below)| constant + below).collect();
            above[depth - 1].below = peaks.chunks(here[0].n_alternatives).map(log_sum_exp).collect();
        }
        Some(tree)
    }

    /// Observed directions that start at this column: on the unit sphere κ μ·x = κ − ½ κ |x − μ|².
    pub fn of_directions(components: &[VonMisesFisher], start: usize, width: usize) -> Self {
        let components: Vec<&VonMisesFisher> = components.iter().filter(|c| c.weight > 0.0).collect();
        let dim = components.first().map_or(0, |c| c.direction.len());
        let mut level = Level::empty(dim, components.len(), None);
        level.columns = (start..start + dim).chain([width]).collect();
        for component in components {
            let root = component.concentration.sqrt();
            for i in 0..dim {
                let entry = |j: usize| if j == i { root } else { 0.0 };
                level.reading.extend((0..dim).map(entry));
                level.reading.push(-root * component.direction[i]);
            }
            level
                .constant
                .push(component.weight.ln() + log_normalizer(dim, component.concentration));
        }
        level.below = vec![0.0; level.constant.len()];
        Self {
            levels: vec![level],
            n_hidden: 0,
        }
    }
}

impl Level {
    fn empty(dim: usize, n_alternatives: usize, start: Option<usize>) -> Self {
        Self {
            dim,
            n_alternatives,
            start,
            columns: Vec::new(),
            reading: Vec::new(),
            hidden_columns: Vec::new(),
            coefficients: Vec::new(),
            moved: Vec::new(),
            pull: Vec::new(),
            constant: Vec::new(),
            white: Vec::new(),
            below: Vec::new(),
        }
    }

    /// What belongs to the components alone.
    fn of(step: &Step, start: Option<usize>, later: &[Step]) -> Self {
        let readings: Vec<DMatrix<f64>> = (0..step.n_alternatives()).map(|i| step.reading(i)).collect();
        let dim = readings.first().map_or(0, DMatrix::nrows);
        let mut level = Self::empty(dim, readings.len(), start);
        level.columns = used_columns(readings.iter());
        level.reading = entries(readings.iter(), &level.columns);
        let coefficients = || (0..step.n_alternatives()).map(|i| step.coefficients(i));
        level.hidden_columns = used_columns(coefficients());
        level.coefficients = entries(coefficients(), &level.hidden_columns);
        if start.is_none() && !level.hidden_columns.is_empty() {
            let all = later
                .iter()
                .flat_map(|step| (0..step.n_alternatives()).map(|i| step.coefficients(i)));
            let known = step.coefficients(0).ncols();
            level.moved = used_columns(all).into_iter().filter(|&j| j < known).collect();
        }
        level
    }

    /// Whether residuals are white as they are read: nothing hidden is read.
    fn is_white(&self) -> bool {
        self.start.is_none() && self.hidden_columns.is_empty()
    }

    /// Multiplies the readings of one alternative by its whitening matrix.
    fn whiten(&mut self, i: usize, white: &DMatrix<f64>) {
        let n = self.columns.len();
        let part = &mut self.reading[i * self.dim * n..(i + 1) * self.dim * n];
        let product = white * DMatrix::from_row_slice(self.dim, n, part);
        for (slot, value) in part.iter_mut().zip(product.transpose().iter()) {
            *slot = *value;
        }
    }
}

/// Columns in which some matrix is not zero.
fn used_columns<'a>(matrices: impl Iterator<Item = &'a DMatrix<f64>>) -> Vec<usize> {
    let mut used = std::collections::BTreeSet::new();
    for matrix in matrices {
        used.extend((0..matrix.ncols()).filter(|&j| matrix.column(j).iter().any(|v| *v != 0.0)));
    }
    used.into_iter().collect()
}

/// These columns of all matrices, row by row.
fn entries<'a>(matrices: impl Iterator<Item = &'a DMatrix<f64>>, columns: &[usize]) -> Vec<f64> {
    let mut out = Vec::new();
    for matrix in matrices {
        for row in matrix.row_iter() {
            out.extend(columns.iter().map(|&j| row[j]));
        }
    }
    out
}

/// What belongs to the branches, depth first: every level gets its branches in the order of their paths.
fn descend(steps: &[Step], levels: &mut [Level], gaussian: &RootGaussian) -> Option<()> {
    let Some((step, rest)) = steps.split_first() else {
        return Some(());
    };
    for i in 0..step.n_alternatives() {
        let dim = levels[0].dim;
        // Residuals of the unit vectors, and means of zero: what comes back is white, and the means are the pull.
        let mut before = gaussian.clone();
        before.mean = DMatrix::zeros(before.dim(), dim);
        let (constant, white, after) = step.enter_residuals(i, &before, &DMatrix::identity(dim, dim))?;
        let level = &mut levels[0];
        if let Some(white) = white {
            if level.is_white() {
                if level.constant.len() < level.n_alternatives {
                    level.whiten(i, &white);
                }
            } else {
                let rows = (0..dim).flat_map(|r| (0..=r).map(move |c| (r, c)));
                level.white.extend(rows.map(|place| white[place]));
            }
            for &j in &level.moved {
                level.pull.extend((0..dim).map(|c| after.mean[(j, c)]));
            }
        }
        level.constant.push(constant);
        level.below.push(0.0);
        descend(rest, &mut levels[1..], &after)?;
    }
    Some(())
}
