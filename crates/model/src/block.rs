//! Hidden continuous nodes and the observed children that they reach: their components are enumerated, parents first,
//! and a Gaussian over the hidden values is carried along. A hidden node is appended, an observation conditions.
//!
//! Where the combinations are too many, each step keeps the likeliest and adds up a bound of all that the others could
//! have come to.

use nalgebra::DMatrix;

use crate::cpd::{MixtureCpd, NodeIdx, Sign};
use crate::error::ModelError;
use crate::gaussian::{log_add, log_sum_exp};
use crate::model::Model;
use crate::root_gaussian::{RootGaussian, log_peak};

/// What is known of a continuous node. Matrices have one column per entry of [row, 1]: a single one in a single query.
pub(crate) enum Known {
    Nothing,
    /// All its dimensions.
    Whole(DMatrix<f64>),
    /// Some dimensions, or all with an error of the given root.
    Part {
        dims: Vec<usize>,
        value: DMatrix<f64>,
        error: DMatrix<f64>,
    },
}

/// One node of a block in one configuration of its discrete parents.
pub(crate) struct Step {
    node: NodeIdx,
    configuration: usize,
    known: Known,
    alternatives: Vec<Alternative>,
    /// log of the most that this step can contribute.
    peak: f64,
}

/// A component with a sign: y ~ N(offset [row, 1] + coefficients · hidden, noise noiseᵀ).
struct Alternative {
    component: usize,
    log_weight: f64,
    offset: DMatrix<f64>,
    coefficients: DMatrix<f64>,
    noise: DMatrix<f64>,
}

/// Whether mixture components are summed, or the likeliest is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Latent {
    /// Summed.
    #[default]
    Summed,
    /// The likeliest is taken.
    Maximised,
}

impl Latent {
    pub(crate) fn join(self, logs: &[f64]) -> f64 {
        match self {
            Self::Summed => log_sum_exp(logs),
            Self::Maximised => logs.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        }
    }
}

/// One combination of components, summed up.
#[derive(Clone)]
pub(crate) struct Piece {
    pub log_weight: f64,
    /// Component of each node of the block.
    pub components: Vec<usize>,
    pub gaussian: RootGaussian,
}

/// What a block contributes.
pub(crate) struct BlockSum {
    /// Joined over all combinations that were looked at.
    pub total: f64,
    /// log of a bound of all others.
    pub lost: f64,
    /// The combinations, where they were asked for.
    pub pieces: Vec<Piece>,
}

/// The steps of a block's nodes (parents first), and where each hidden node starts among the hidden values.
pub(crate) fn steps(
    model: &Model,
    nodes: &[NodeIdx],
    states: &[usize],
    columns: usize,
    known: &dyn Fn(NodeIdx) -> Known,
) -> (Vec<Step>, Vec<Option<usize>>) {
    let mut starts = vec![None; model.nodes().len()];
    let mut hidden = 0;
    let mut out = Vec::with_capacity(nodes.len());
    for &idx in nodes {
        let Some(cpd) = model.mixture(idx) else { continue };
        let configuration = model.configuration(idx, states);
        let alternatives = alternatives(model, idx, cpd, configuration, (hidden, columns), &starts, known);
        let own = known(idx);
        if !matches!(own, Known::Whole(_)) {
            starts[idx.0] = Some(hidden);
            hidden += cpd.dim();
        }
        let peak = peak(&own, &alternatives);
        out.push(Step {
            node: idx,
            configuration,
            known: own,
            alternatives,
            peak,
        });
    }
    (out, starts)
}

fn alternatives(
    model: &Model,
    idx: NodeIdx,
    cpd: &MixtureCpd,
    configuration: usize,
    (hidden, columns): (usize, usize),
    starts: &[Option<usize>],
    known: &dyn Fn(NodeIdx) -> Known,
) -> Vec<Alternative> {
    let signs: &[f64] = if cpd.sign == Sign::Latent {
        &[1.0, -1.0]
    } else {
        &[1.0]
    };
    let mut out = Vec::new();
    for (k, component) in cpd.components[configuration].iter().enumerate() {
        if component.weight == 0.0 {
            continue;
        }
        let mut offset = DMatrix::zeros(cpd.dim(), columns);
        offset.column_mut(columns - 1).copy_from(&component.mean);
        let mut coefficients = DMatrix::zeros(cpd.dim(), hidden);
        let mut column = 0;
        for &parent in &cpd.continuous_parents {
            let width = model.mixture(parent).map_or(0, MixtureCpd::dim);
            let part = component.coefficients.columns(column, width);
            match (starts[parent.0], known(parent)) {
                (Some(start), _) => coefficients.columns_mut(start, width).copy_from(&part),
                (None, Known::Whole(value)) => offset += part * value,
                // A hidden parent stands before its children in every block.
                (None, _) => {}
            }
            column += width;
        }
        for &sign in signs {
            out.push(Alternative {
                component: k,
                log_weight: component.weight.ln() - (signs.len() as f64).ln(),
                offset: sign * &offset,
                coefficients: sign * &coefficients,
                noise: model.root(idx, configuration, k).clone(),
            });
        }
    }
    out
}

fn peak(known: &Known, alternatives: &[Alternative]) -> f64 {
    let peaks: Vec<f64> = alternatives
        .iter()
        .map(|alternative| {
            let highest = match known {
                Known::Nothing => 0.0,
                Known::Whole(_) => log_peak(&alternative.noise),
                Known::Part { dims, error, .. } => {
                    let noise = &alternative.noise;
                    let mut root = DMatrix::zeros(dims.len(), noise.ncols() + error.ncols());
                    root.columns_mut(0, noise.ncols())
                        .copy_from(&noise.select_rows(dims));
                    root.columns_mut(noise.ncols(), error.ncols()).copy_from(error);
                    log_peak(&root)
                }
            };
            alternative.log_weight + highest
        })
        .collect();
    if peaks.contains(&f64::INFINITY) {
        return f64::INFINITY;
    }
    log_sum_exp(&peaks)
}

impl Step {
    pub fn n_alternatives(&self) -> usize {
        self.alternatives.len()
    }

    /// Whether all dimensions of the node were observed.
    pub fn is_observed(&self) -> bool {
        matches!(self.known, Known::Whole(_))
    }

    /// What is read of the row: the residual of an observed node, the mean of a hidden one, but for what hidden parents add.
    pub fn reading(&self, i: usize) -> DMatrix<f64> {
        match &self.known {
            Known::Whole(value) => value - &self.alternatives[i].offset,
            Known::Nothing | Known::Part { .. } => self.alternatives[i].offset.clone(),
        }
    }

    /// What hidden values are multiplied with.
    pub fn coefficients(&self, i: usize) -> &DMatrix<f64> {
        &self.alternatives[i].coefficients
    }

    /// [`Step::enter`] with residuals in place of the observed value, whatever was read; `None` where there is no density.
    pub fn enter_residuals(
        &self,
        i: usize,
        gaussian: &RootGaussian,
        residuals: &DMatrix<f64>,
    ) -> Option<(f64, Option<DMatrix<f64>>, RootGaussian)> {
        let alternative = &self.alternatives[i];
        let (coefficients, noise) = (&alternative.coefficients, &alternative.noise);
        if self.is_observed() {
            let (density, after) = gaussian.condition(residuals, coefficients, noise)?;
            Some((
                alternative.log_weight + density.constant,
                Some(density.white),
                after,
            ))
        } else {
            let after = gaussian.append(residuals, coefficients, noise);
            Some((alternative.log_weight, None, after))
        }
    }

    /// log weight with the density's logarithm, and the Gaussian afterwards.
    fn enter(
        &self,
        model: &Model,
        i: usize,
        gaussian: &RootGaussian,
    ) -> Result<(f64, RootGaussian), ModelError> {
        let Alternative {
            component,
            log_weight,
            offset,
            coefficients,
            noise,
        } = &self.alternatives[i];
        let flat = || ModelError::NoDensity {
            node: model.node(self.node).name.clone(),
            configuration: self.configuration,
            component: *component,
        };
        match &self.known {
            Known::Nothing => Ok((*log_weight, gaussian.append(offset, coefficients, noise))),
            Known::Whole(value) => {
                let (density, after) = gaussian
                    .condition(&(value - offset), coefficients, noise)
                    .ok_or_else(flat)?;
                Ok((
                    log_weight + density.constant - 0.5 * density.white.norm_squared(),
                    after,
                ))
            }
            Known::Part { dims, value, error } => {
                let start = gaussian.dim();
                let longer = gaussian.append(offset, coefficients, noise);
                let pick = DMatrix::from_fn(dims.len(), longer.dim(), |i, j| f64::from(start + dims[i] == j));
                let (density, mut after) = longer.condition(value, &pick, error).ok_or_else(flat)?;
                if error.ncols() == 0 {
                    for (row, &i) in dims.iter().enumerate() {
                        after.pin(start + i, value, row);
                    }
                }
                Ok((
                    log_weight + density.constant - 0.5 * density.white.norm_squared(),
                    after,
                ))
            }
        }
    }

    pub fn component(&self, i: usize) -> usize {
        self.alternatives[i].component
    }
}

/// Sums (or maximises) over all combinations of components; `width` is the most that are kept at each step, none for
/// all. `keep` asks for the pieces, over these hidden values.
pub(crate) fn sum(
    model: &Model,
    steps: &[Step],
    latent: Latent,
    keep: Option<&[usize]>,
    width: Option<usize>,
) -> Result<BlockSum, ModelError> {
    let start = Piece {
        log_weight: 0.0,
        components: Vec::new(),
        gaussian: RootGaussian::empty(1),
    };
    let mut lost = f64::NEG_INFINITY;
    let mut logs = Vec::new();
    let mut pieces = Vec::new();
    match width {
        None => descend(model, steps, start, &mut |piece| {
            logs.push(piece.log_weight);
            if let Some(dims) = keep {
                pieces.push(piece.marginal(dims));
            }
        })?,
        Some(width) => {
            let mut level = vec![start];
            for (depth, step) in steps.iter().enumerate() {
                let mut next = Vec::with_capacity(level.len() * step.n_alternatives());
                for piece in &level {
                    for i in 0..step.n_alternatives() {
                        next.push(piece.entered(model, step, i)?);
                    }
                }
                if next.len() > width {
                    // Stable, so that equals are kept in the order of the file.
                    next.sort_by(|a, b| b.log_weight.total_cmp(&a.log_weight));
                    let rest: f64 = steps[depth + 1..].iter().map(|step| step.peak).sum();
                    let dropped: Vec<f64> = next[width..].iter().map(|piece| piece.log_weight).collect();
                    lost = log_add(lost, log_sum_exp(&dropped) + rest);
                    next.truncate(width);
                }
                level = next;
            }
            logs.extend(level.iter().map(|piece| piece.log_weight));
            if let Some(dims) = keep {
                pieces = level.iter().map(|piece| piece.marginal(dims)).collect();
            }
        }
    }
    Ok(BlockSum {
        total: latent.join(&logs),
        lost,
        pieces,
    })
}

/// Depth first over the combinations.
fn descend(
    model: &Model,
    steps: &[Step],
    piece: Piece,
    out: &mut impl FnMut(Piece),
) -> Result<(), ModelError> {
    let Some((step, rest)) = steps.split_first() else {
        out(piece);
        return Ok(());
    };
    for i in 0..step.n_alternatives() {
        descend(model, rest, piece.entered(model, step, i)?, out)?;
    }
    Ok(())
}

impl Piece {
    fn marginal(&self, dims: &[usize]) -> Self {
        let mut gaussian = self.gaussian.marginal(dims);
        gaussian.compress();
        Self {
            log_weight: self.log_weight,
            components: self.components.clone(),
            gaussian,
        }
    }

    fn entered(&self, model: &Model, step: &Step, i: usize) -> Result<Self, ModelError> {
        let (log_term, gaussian) = step.enter(model, i, &self.gaussian)?;
        let mut components = self.components.clone();
        components.push(step.component(i));
        Ok(Self {
            log_weight: self.log_weight + log_term,
            components,
            gaussian,
        })
    }
}
