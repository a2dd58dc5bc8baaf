//! The label ceiling: how well anyone could do on these labels.

use serde::{Deserialize, Serialize};

use crate::Task;

/// The best that a classifier of tasks could reach; see [`label_ceiling`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Ceiling {
    /// Mean recall over the classes that occur.
    pub mean_recall: f64,
    /// Recall of each class, in the order of [`Task::ALL`], by the classifier that reaches `mean_recall`; 0 for a class that never occurs.
    pub recall: [f64; 3],
    /// Expected copies per class, Nₜ.
    pub copies: [f64; 3],
}

/// The best mean per-class recall that any classifier could reach on copies of multi-label grasps.
///
/// A grasp that carries k labels enters the data k times, once per task, with equal features; a classifier, which sees
/// the grasp but not the label, must answer every copy alike. With pᵢₜ the probability that grasp i is labelled t,
/// class t has Nₜ = Σᵢ pᵢₜ copies to be expected, and a classifier that answers aᵢ for grasp i recalls Σ_{i: aᵢ = t} pᵢₜ
/// of them. Over the K classes that occur,
///
/// ```text
/// mean recall = 1/K Σₜ (1/Nₜ) Σ_{i: aᵢ = t} pᵢₜ = 1/K Σᵢ pᵢ,ₐᵢ / N_aᵢ  ≤  1/K Σᵢ maxₜ pᵢₜ / Nₜ
/// ```
///
/// and aᵢ = argmaxₜ pᵢₜ / Nₜ reaches the bound; answering at random cannot beat it, since the sum is linear in the
/// chances of the answers. Drawing as many copies per class (balancing) leaves it unchanged, as recall does not depend
/// on a class's size. The bound holds for recall over expected counts; single draws of labels scatter about it.
///
/// With `label_probabilities` of 0 and 1 (labels already drawn) it is the best that hindsight could do. None where no
/// class occurs. Values outside [0, 1] or NaN count as 0.
///
/// ```
/// use prehend_tutor::label_ceiling;
/// // Two grasps that suit two tasks each, and are alike in both: every answer loses one copy of each grasp.
/// let ceiling = label_ceiling(&[[1.0, 1.0, 0.0], [1.0, 1.0, 0.0]]).unwrap();
/// assert_eq!(ceiling.mean_recall, 0.5);
/// ```
pub fn label_ceiling(label_probabilities: &[[f64; 3]]) -> Option<Ceiling> {
    let sound = |p: f64| if (0.0..=1.0).contains(&p) { p } else { 0.0 };
    let mut copies = [0.0; 3];
    for p in label_probabilities {
        for t in 0..3 {
            copies[t] += sound(p[t]);
        }
    }
    let n_classes = copies.iter().filter(|&&n| n > 0.0).count();
    if n_classes == 0 {
        return None;
    }
    let mut recall = [0.0; 3];
    for p in label_probabilities {
        let worth = |t: usize| {
            if copies[t] > 0.0 {
                sound(p[t]) / copies[t]
            } else {
                0.0
            }
        };
        // The first of equals, so that the recalls do not depend on the order of comparison.
        let answer = (1..Task::ALL.len()).fold(0, |best, t| if worth(t) > worth(best) { t } else { best });
        recall[answer] += worth(answer);
    }
    Some(Ceiling {
        mean_recall: recall.iter().sum::<f64>() / n_classes as f64,
        recall,
        copies,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn single_labels_can_be_told_apart_perfectly() {
        let ceiling = label_ceiling(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).unwrap();
        assert!((ceiling.mean_recall - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_class_that_never_occurs_is_left_out() {
        let ceiling = label_ceiling(&[[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]]).unwrap();
        assert_eq!((ceiling.mean_recall, ceiling.copies), (1.0, [0.5, 0.5, 0.0]));
        assert_eq!(label_ceiling(&[[0.0; 3]]), None);
        assert_eq!(label_ceiling(&[[f64::NAN, 0.0, 2.0]]), None);
    }

    #[test]
    fn no_way_of_answering_beats_it() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let p: Vec<[f64; 3]> = (0..6).map(|_| std::array::from_fn(|_| rng.random())).collect();
        let ceiling = label_ceiling(&p).unwrap();
        let mut best = 0.0_f64;
        for code in 0..3_usize.pow(6) {
            let answers = (0..6).map(|i| code / 3_usize.pow(i) % 3);
            let sum: f64 = answers
                .enumerate()
                .map(|(i, a)| p[i][a] / ceiling.copies[a])
                .sum();
            best = best.max(sum / 3.0);
        }
        assert!((best - ceiling.mean_recall).abs() < 1e-12);
    }
}
