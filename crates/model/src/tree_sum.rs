//! What a compiled tree says of several rows at once: the log of the sum over all paths.
//!
//! A subtree is left out where a bound of all it holds is below the largest term by 45 nats in every row: less than
//! rounding.

use crate::lanes::{LANES, Lanes, LogSums, norm_of_product, norm_squared};
use crate::tree::{Level, Tree};

/// Buffers of one thread.
#[derive(Default)]
pub(crate) struct Open {
    /// Readings of all alternatives of all levels, one level behind the other.
    readings: Vec<Lanes>,
    starts: Vec<usize>,
    branches: Vec<Branch>,
    /// The means of each alternative of each level, which has one group of branches open at a time.
    means: Vec<Lanes>,
    places: Vec<usize>,
    /// The means of the branch whose alternatives are looked at.
    here: Vec<Lanes>,
    residual: Vec<Lanes>,
}

/// A branch whose subtree is still to be looked at.
#[derive(Clone, Copy)]
struct Branch {
    depth: usize,
    number: usize,
    log_term: Lanes,
    /// The highest bound of all lanes.
    bound: f64,
}

impl Tree {
    /// log of the sum over all paths, for each row; `x` has the rows' columns, and 1.
    pub fn log_sums(&self, x: &[Lanes], open: &mut Open) -> Lanes {
        let mut sums = LogSums::default();
        open.read(self, x);
        open.branches.clear();
        open.here.clear();
        open.here.resize(self.n_hidden, [0.0; LANES]);
        self.step(0, 0, &[0.0; LANES], open, &mut sums);
        // The most promising subtree is opened first: what is left out later is compared with the largest term.
        while let Some(branch) = open.branches.pop() {
            let below = self.levels[branch.depth].below[branch.number];
            let mut bound = branch.log_term;
            for lane in &mut bound {
                *lane += below;
            }
            if sums.matters(&bound) {
                let alternative = branch.number % self.levels[branch.depth].n_alternatives;
                let start = open.places[branch.depth] + alternative * self.n_hidden;
                open.here
                    .copy_from_slice(&open.means[start..start + self.n_hidden]);
                self.step(branch.depth + 1, branch.number, &branch.log_term, open, &mut sums);
            }
        }
        sums.values()
    }

    /// Looks at the alternatives below one branch, whose means are `open.here`.
    fn step(&self, depth: usize, parent: usize, log_term: &Lanes, open: &mut Open, sums: &mut LogSums) {
        let Some(level) = self.levels.get(depth) else {
            sums.add(log_term);
            return;
        };
        // The compiler unrolls what it knows the size of.
        match level.dim {
            1 => self.alternatives(1, level, depth, parent, log_term, open, sums),
            2 => self.alternatives(2, level, depth, parent, log_term, open, sums),
            3 => self.alternatives(3, level, depth, parent, log_term, open, sums),
            4 => self.alternatives(4, level, depth, parent, log_term, open, sums),
            dim => self.alternatives(dim, level, depth, parent, log_term, open, sums),
        }
    }

    #[inline(always)]
    #[expect(
        clippy::inline_always,
        reason = "unrolled where the dimension is known when compiling"
    )]
    #[expect(
        clippy::too_many_arguments,
        reason = "`dim` stands apart so that it can be known when compiling"
    )]
    fn alternatives(
        &self,
        dim: usize,
        level: &Level,
        depth: usize,
        parent: usize,
        log_term: &Lanes,
        open: &mut Open,
        sums: &mut LogSums,
    ) {
        let is_leaf = depth + 1 == self.levels.len();
        let first = open.branches.len();
        let (n_read, n_white) = (level.hidden_columns.len(), dim * (dim + 1) / 2);
        for i in 0..level.n_alternatives {
            let number = parent * level.n_alternatives + i;
            let start = open.starts[depth] + i * dim;
            open.residual.clear();
            open.residual
                .extend_from_slice(&open.readings[start..start + dim]);
            let residual = &mut open.residual[..dim];
            let coefficients = &level.coefficients[i * dim * n_read..(i + 1) * dim * n_read];
            let sign = if level.start.is_some() { 1.0 } else { -1.0 };
            for (r, residual) in residual.iter_mut().enumerate() {
                for (factor, &j) in coefficients[r * n_read..(r + 1) * n_read]
                    .iter()
                    .zip(&level.hidden_columns)
                {
                    let (factor, mean) = (sign * factor, &open.here[j]);
                    for lane in 0..LANES {
                        residual[lane] += factor * mean[lane];
                    }
                }
            }
            let mut value = *log_term;
            let constant = level.constant[number];
            if level.start.is_none() {
                let square = if level.white.is_empty() {
                    norm_squared(residual)
                } else {
                    norm_of_product(&level.white[number * n_white..(number + 1) * n_white], residual)
                };
                for lane in 0..LANES {
                    value[lane] += constant - 0.5 * square[lane];
                }
            } else {
                for lane in &mut value {
                    *lane += constant;
                }
            }
            if is_leaf {
                sums.add(&value);
                continue;
            }
            let place = open.places[depth] + i * self.n_hidden;
            let means = &mut open.means[place..place + self.n_hidden];
            means.copy_from_slice(&open.here);
            if let Some(start) = level.start {
                means[start..start + dim].copy_from_slice(residual);
            }
            for (k, &j) in level.moved.iter().enumerate() {
                let place = (number * level.moved.len() + k) * dim;
                let mean = &mut means[j];
                for (factor, residual) in level.pull[place..place + dim].iter().zip(residual.iter()) {
                    for lane in 0..LANES {
                        mean[lane] += factor * residual[lane];
                    }
                }
            }
            let below = level.below[number];
            let bound = value
                .iter()
                .fold(f64::NEG_INFINITY, |most, v| most.max(v + below));
            open.branches.push(Branch {
                depth,
                number,
                log_term: value,
                bound,
            });
        }
        open.sort(first);
    }
}

impl Open {
    /// What every component reads of the rows.
    fn read(&mut self, tree: &Tree, x: &[Lanes]) {
        self.readings.clear();
        self.starts.clear();
        self.places.clear();
        let mut place = 0;
        for level in &tree.levels {
            self.starts.push(self.readings.len());
            self.places.push(place);
            place += level.n_alternatives * tree.n_hidden;
            let n = level.columns.len();
            if n == 0 {
                let rows = level.n_alternatives * level.dim;
                self.readings.resize(self.readings.len() + rows, [0.0; LANES]);
                continue;
            }
            for row in level.reading.chunks_exact(n) {
                let mut sum = [0.0; LANES];
                for (factor, &j) in row.iter().zip(&level.columns) {
                    let x = &x[j];
                    for lane in 0..LANES {
                        sum[lane] += factor * x[lane];
                    }
                }
                self.readings.push(sum);
            }
        }
        self.means.resize(place.max(self.means.len()), [0.0; LANES]);
    }

    /// Puts the branch with the highest bound on top. Insertion: there are few.
    fn sort(&mut self, first: usize) {
        for i in first + 1..self.branches.len() {
            let mut place = i;
            while place > first && self.branches[place - 1].bound > self.branches[place].bound {
                self.branches.swap(place - 1, place);
                place -= 1;
            }
        }
    }
}
