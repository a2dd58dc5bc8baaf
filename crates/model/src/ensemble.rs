//! What do all models say that the training rows allow?

use crate::error::ModelError;
use crate::evidence::Evidence;
use crate::gaussian::log_sum_exp;
use crate::mixture::Term;
use crate::model::Model;
use crate::posterior::Posterior;

/// Models of one structure with equal standing: draws of parameters that the training rows allow ([`Model::draws`]).
///
/// One trained model takes its parameters for certain. From few rows they are not, and its probabilities come out too
/// near to 0 and 1; the mean over draws does not.
#[derive(Debug, Clone, PartialEq)]
pub struct Ensemble {
    members: Vec<Model>,
}

/// What the members of an [`Ensemble`] say.
#[derive(Debug, Clone, PartialEq)]
pub struct EnsemblePosterior {
    /// The mean of the members' answers. Its `log_evidence` is the logarithm of the mean density of the evidence.
    pub mean: Posterior,
    /// Each member's answer.
    pub members: Vec<Posterior>,
}

impl Ensemble {
    /// Models of the same nodes, at least one.
    ///
    /// # Errors
    ///
    /// [`ModelError::Length`] for none, [`ModelError::UnknownNode`] where one lacks a node of the first.
    pub fn new(members: Vec<Model>) -> Result<Self, ModelError> {
        let Some(first) = members.first() else {
            return Err(ModelError::Length {
                what: "an ensemble".into(),
                found: 0,
                expected: 1,
            });
        };
        for (member, node) in members
            .iter()
            .flat_map(|m| first.nodes().iter().map(move |node| (m, node)))
        {
            member.index(&node.name)?;
        }
        Ok(Self { members })
    }

    /// `n` draws from what the rows leave open that a model was trained on.
    ///
    /// # Errors
    ///
    /// As [`Model::draws`] and [`Ensemble::new`].
    pub fn drawn(model: &Model, n: usize, seed: u64) -> Result<Self, ModelError> {
        Self::new(model.draws(n, seed)?)
    }

    /// The models.
    pub fn members(&self) -> &[Model] {
        &self.members
    }

    /// The posterior of the targets under every member, and its mean: what is believed once the parameters' uncertainty is
    /// counted. The mean of a continuous target is the mixture of all members' mixtures.
    ///
    /// # Errors
    ///
    /// As [`Model::query`].
    pub fn query(&self, targets: &[&str], evidence: &Evidence) -> Result<EnsemblePosterior, ModelError> {
        let members = self
            .members
            .iter()
            .map(|model| model.query(targets, evidence))
            .collect::<Result<Vec<Posterior>, _>>()?;
        let share = (members.len() as f64).ln();
        let terms = members
            .iter()
            .flat_map(|answer| &answer.terms)
            .map(|term: &Term| {
                let mut term = term.clone();
                term.log_weight -= share;
                term
            });
        let logs: Vec<f64> = members.iter().map(|answer| answer.log_evidence).collect();
        let bound = members
            .iter()
            .map(|answer| answer.error_bound)
            .fold(0.0, f64::max);
        let targets = members
            .first()
            .map_or_else(Vec::new, |answer| answer.targets.clone());
        let mean = Posterior::new(log_sum_exp(&logs) - share, targets, terms.collect(), bound);
        Ok(EnsemblePosterior { mean, members })
    }
}

impl EnsemblePosterior {
    /// Per state of a discrete target the probabilities between which the middle `level` of the members lie, for example
    /// 0.9; `None` if it was not asked about, or is continuous.
    pub fn interval(&self, name: &str, level: f64) -> Option<Vec<(f64, f64)>> {
        let members: Vec<Vec<f64>> = self
            .members
            .iter()
            .map(|answer| answer.probabilities(name))
            .collect::<Option<_>>()?;
        let n = members.len();
        let tail = 0.5 * (1.0 - level.clamp(0.0, 1.0));
        let low = ((tail * n as f64) as usize).min(n.saturating_sub(1));
        let states = 0..members.first()?.len();
        let of_state = |state: usize| {
            let mut values: Vec<f64> = members.iter().map(|member| member[state]).collect();
            values.sort_by(f64::total_cmp);
            (values[low], values[n - 1 - low])
        };
        Some(states.map(of_state).collect())
    }
}
