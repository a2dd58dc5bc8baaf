//! Hidden continuous nodes of one configuration, compiled: the combinations of components as a tree, each of whose
//! branches reads the row through one whitened matrix.
//!
//! A path through the tree chooses a component at each node of the block. What it contributes is a product of one
//! Gaussian density for each observed node, given the hidden ones' components and the observations before it:
//!
//! ```text
//! log term = Σ over branches of constant − ½ |reader · [row, 1]|²
//! ```
//!
//! so that all factorization of matrices is done beforehand. A subtree is left out where a bound of all it holds is
//! below the largest term by more than rounding.

use std::ops::Range;

use nalgebra::DMatrix;

use crate::block::Step;
use crate::gaussian::{log_add, log_sum_exp};
use crate::model::Model;
use crate::reader::{LogSum, Reader, Readers};
use crate::root_gaussian::RootGaussian;

/// Terms this far below the largest one are left out, in nats: e⁻⁴⁵ = 3e-20, and a tree has fewer than 1e6 terms, so
/// at most 3e-14 of the result goes missing.
const NEGLIGIBLE: f64 = 45.0;
/// Branches of the largest tree that is compiled.
const MAX_BRANCHES: usize = 200_000;

/// The compiled block.
pub(crate) struct Tree {
    readers: Readers,
    branches: Vec<Branch>,
    top: Range<usize>,
    /// log weight of the paths that observe nothing.
    bare: f64,
}

struct Branch {
    /// log weight and normalizer.
    constant: f64,
    reader: Reader,
    /// log of the most that the branches below can contribute.
    below: f64,
    children: Range<usize>,
    /// log weight of the paths that end here.
    end: f64,
}

impl Tree {
    /// `None` where a component has no density, or the tree would be too large.
    pub fn grow(model: &Model, steps: &[Step], columns: usize) -> Option<Self> {
        let mut grown = Grown::default();
        let (top, bare) = grow(model, steps, &RootGaussian::empty(columns), &mut grown)?;
        Some(Self {
            readers: grown.readers,
            branches: grown.branches,
            top,
            bare,
        })
    }

    /// log of the block's integral at [row, 1].
    pub fn log_integral(&self, row: &[f64], open: &mut Vec<(f64, f64, usize)>) -> f64 {
        let mut sum = LogSum::default();
        sum.add(self.bare);
        open.clear();
        self.open(self.top.clone(), 0.0, row, &mut sum, open);
        // The most promising subtree is opened first: what is left out later is compared with the largest term.
        while let Some((bound, value, i)) = open.pop() {
            if bound >= sum.largest() - NEGLIGIBLE {
                sum.add(value + self.branches[i].end);
                self.open(self.branches[i].children.clone(), value, row, &mut sum, open);
            }
        }
        sum.value()
    }

    /// Adds up leaves, and puts other branches on the stack, the one with the highest bound on top.
    fn open(
        &self,
        range: Range<usize>,
        value: f64,
        row: &[f64],
        sum: &mut LogSum,
        open: &mut Vec<(f64, f64, usize)>,
    ) {
        let start = open.len();
        for i in range {
            let branch = &self.branches[i];
            let value = value + branch.constant - 0.5 * self.readers.norm_squared(branch.reader, row);
            if branch.children.is_empty() {
                sum.add(value + branch.end);
                continue;
            }
            let entry = (value + branch.below, value, i);
            // Insertion: there are few.
            let mut place = open.len();
            open.push(entry);
            while place > start && open[place - 1].0 > entry.0 {
                open[place] = open[place - 1];
                place -= 1;
            }
            open[place] = entry;
        }
    }
}

/// What has grown so far.
#[derive(Default)]
struct Grown {
    readers: Readers,
    branches: Vec<Branch>,
}

/// Branches for the first observation among the steps, and the log weight of paths without one.
fn grow(
    model: &Model,
    steps: &[Step],
    gaussian: &RootGaussian,
    grown: &mut Grown,
) -> Option<(Range<usize>, f64)> {
    let mut level = Vec::new();
    let mut bare = f64::NEG_INFINITY;
    collect(model, steps, (0.0, gaussian), &mut level, &mut bare)?;
    if grown.branches.len() + level.len() > MAX_BRANCHES {
        return None;
    }
    let start = grown.branches.len();
    let mut pending = Vec::with_capacity(level.len());
    for found in level {
        grown.branches.push(Branch {
            constant: found.constant,
            reader: grown.readers.push(&found.white),
            below: 0.0,
            children: 0..0,
            end: f64::NEG_INFINITY,
        });
        pending.push((found.gaussian, found.rest));
    }
    let end = grown.branches.len();
    for (i, (gaussian, rest)) in (start..end).zip(pending) {
        let (children, bare) = grow(model, rest, &gaussian, grown)?;
        let below = |branch: &Branch| branch.constant + branch.below;
        let peaks: Vec<f64> = grown.branches[children.clone()].iter().map(below).collect();
        let branch = &mut grown.branches[i];
        branch.below = log_add(bare, log_sum_exp(&peaks));
        branch.end = bare;
        branch.children = children;
    }
    Some((start..end, bare))
}

struct Found<'a> {
    constant: f64,
    white: DMatrix<f64>,
    gaussian: RootGaussian,
    rest: &'a [Step],
}

/// Walks over hidden nodes until something is observed.
fn collect<'a>(
    model: &Model,
    steps: &'a [Step],
    (log_weight, gaussian): (f64, &RootGaussian),
    out: &mut Vec<Found<'a>>,
    bare: &mut f64,
) -> Option<()> {
    let Some((step, rest)) = steps.split_first() else {
        *bare = log_add(*bare, log_weight);
        return Some(());
    };
    for i in 0..step.n_alternatives() {
        let (constant, white, after) = step.enter(model, i, gaussian).ok()?;
        let constant = log_weight + constant;
        match white {
            Some(white) => out.push(Found {
                constant,
                white,
                gaussian: after,
                rest,
            }),
            None => collect(model, rest, (constant, &after), out, bare)?,
        }
        if out.len() > MAX_BRANCHES {
            return None;
        }
    }
    Some(())
}
