//! How far two tutors agree, and how often each label is given.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::{Labels, Task};

/// Cohen's κ of two raters' answers to the same questions, in order.
///
/// ```text
/// κ = (p_o − p_e) / (1 − p_e)
/// ```
///
/// p_o: share of equal answers; p_e: share of equal answers that two independent raters with the same prevalences would
/// reach. 1 is full agreement, 0 what chance gives, negative less. None where there is nothing to compare, the lists
/// differ in length, or both raters always gave one and the same answer (0/0).
///
/// Source: Cohen, Educational and Psychological Measurement 20 (1960).
///
/// ```
/// use prehend_tutor::cohen_kappa;
/// // 20 + 15 of 50 equal; prevalences 25/50 and 30/50: p_o = 0.7, p_e = 0.5.
/// let count = |yes_yes: usize, yes_no: usize, no_yes: usize, no_no: usize| {
///     let pairs = [(true, true, yes_yes), (true, false, yes_no), (false, true, no_yes), (false, false, no_no)];
///     let all: Vec<_> = pairs.iter().flat_map(|&(a, b, n)| std::iter::repeat_n((a, b), n)).collect();
///     all.into_iter().unzip::<bool, bool, Vec<_>, Vec<_>>()
/// };
/// let (a, b) = count(20, 5, 10, 15);
/// assert!((cohen_kappa(&a, &b).unwrap() - 0.4).abs() < 1e-12);
/// ```
pub fn cohen_kappa<T: Ord>(a: &[T], b: &[T]) -> Option<f64> {
    if a.is_empty() || a.len() != b.len() {
        return None;
    }
    let n = a.len() as f64;
    let equal = a.iter().zip(b).filter(|(x, y)| x == y).count() as f64 / n;
    let mut counts: BTreeMap<&T, [f64; 2]> = BTreeMap::new();
    for x in a {
        counts.entry(x).or_default()[0] += 1.0;
    }
    for y in b {
        counts.entry(y).or_default()[1] += 1.0;
    }
    let by_chance: f64 = counts.values().map(|[x, y]| (x / n) * (y / n)).sum();
    // Exactly 1 only where one answer is all that was ever given.
    (counts.len() > 1).then(|| (equal - by_chance) / (1.0 - by_chance))
}

/// How often each label was given.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Prevalence {
    /// Per object type: how many grasps, and how many of them carry each task (in the order of [`Task::ALL`]).
    pub by_type: BTreeMap<String, TypeCount>,
    /// How many grasps carry 0, 1, 2 and 3 labels.
    pub by_n_labels: [usize; 4],
}

/// Counts for one object type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct TypeCount {
    /// Grasps judged.
    pub grasps: usize,
    /// Of these, labelled with each task.
    pub labelled: [usize; 3],
}

impl Prevalence {
    /// Counts (object type, labels) pairs.
    pub fn count<'a>(labels: impl IntoIterator<Item = (&'a str, Labels)>) -> Self {
        let mut prevalence = Self::default();
        for (object_type, labels) in labels {
            let entry = prevalence.by_type.entry(object_type.to_owned()).or_default();
            entry.grasps += 1;
            for task in labels.tasks() {
                entry.labelled[task as usize] += 1;
            }
            prevalence.by_n_labels[labels.n_tasks()] += 1;
        }
        prevalence
    }

    /// Grasps labelled with a task, over all types.
    pub fn total(&self, task: Task) -> usize {
        self.by_type.values().map(|t| t.labelled[task as usize]).sum()
    }

    /// Share of the labelled grasps that carry more than one label; 0 where none is labelled.
    pub fn multi_label_share(&self) -> f64 {
        let [_, one, two, three] = self.by_n_labels;
        (two + three) as f64 / (one + two + three).max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn full_agreement_is_one_and_chance_is_zero() {
        assert_eq!(cohen_kappa(&[1, 2, 3, 1], &[1, 2, 3, 1]), Some(1.0));
        assert_eq!(
            cohen_kappa(&[true, true, false, false], &[true, false, true, false]),
            Some(0.0)
        );
    }

    #[test]
    fn one_answer_only_has_no_kappa() {
        assert_eq!(cohen_kappa(&[true, true], &[true, true]), None);
        assert_eq!(cohen_kappa::<bool>(&[], &[]), None);
        assert_eq!(cohen_kappa(&[true], &[true, false]), None);
    }

    #[test]
    fn prevalence_counts_by_type_and_by_number_of_labels() {
        let both: Labels = [Task::HandOver, Task::Pouring].into_iter().collect();
        let one: Labels = [Task::HandOver].into_iter().collect();
        let prevalence = Prevalence::count([("mug", both), ("mug", Labels::default()), ("knife", one)]);
        assert_eq!(
            prevalence.by_type["mug"],
            TypeCount {
                grasps: 2,
                labelled: [1, 1, 0]
            }
        );
        assert_eq!(prevalence.total(Task::HandOver), 2);
        assert_eq!(prevalence.by_n_labels, [1, 1, 1, 0]);
        assert_eq!(prevalence.multi_label_share(), 0.5);
    }
}
