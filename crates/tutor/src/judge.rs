//! From margins to probabilities and labels.

use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

use crate::{Labels, Observation, Persona, Rule, Task, Thresholds};

/// What a persona thinks of a grasp, task by task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Judgement {
    /// One per task, in the order of [`Task::ALL`].
    pub tasks: [TaskJudgement; 3],
}

/// What a persona thinks of a grasp for one task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TaskJudgement {
    /// The task.
    pub task: Task,
    /// Whether the object affords it at all.
    pub afforded: bool,
    /// Probability that the persona says yes: the product over the rules; 0 where the object does not afford the task.
    pub probability: f64,
    /// Every rule that was asked.
    pub rules: Vec<RuleOutcome>,
    /// The rule with the least probability, the first of them on a tie: it speaks most against the task, or least for
    /// it. None where no rule was asked.
    pub deciding: Option<Rule>,
}

/// What one rule says.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RuleOutcome {
    /// The rule.
    pub rule: Rule,
    /// Its margin, in the unit that [`Rule::margin_in_words`] names; positive speaks for the task.
    pub margin: f64,
    /// Probability that this persona lets it pass.
    pub probability: f64,
}

/// Judges an observed grasp.
///
/// ```text
/// p(task) = Πₖ 1 / (1 + exp(−(mₖ/τₖ + s)))        s = −1 strict, 0 receiver-first, 1 lenient
/// ```
///
/// over the task's rules k, with margins mₖ and softnesses τₖ ([`Thresholds::softness`]). [`Rule::HandleLeftFree`]
/// counts for the receiver-first persona only.
pub fn judge(observation: &Observation, persona: Persona, thresholds: &Thresholds) -> Judgement {
    let leniency = persona.leniency();
    let tasks = Task::ALL.map(|task| {
        let afforded = observation.affords.contains(&task);
        let asked = observation.margins.iter().filter(|(rule, _)| {
            rule.task() == task && (*rule != Rule::HandleLeftFree || persona == Persona::ReceiverFirst)
        });
        let rules: Vec<RuleOutcome> = asked
            .map(|&(rule, margin)| {
                let probability = sigmoid(margin / thresholds.softness(rule) + leniency);
                RuleOutcome {
                    rule,
                    margin,
                    probability,
                }
            })
            .collect();
        let deciding = rules
            .iter()
            .min_by(|a, b| a.probability.total_cmp(&b.probability))
            .map(|r| r.rule);
        let probability = if afforded {
            rules.iter().map(|r| r.probability).product()
        } else {
            0.0
        };
        TaskJudgement {
            task,
            afforded,
            probability,
            rules,
            deciding,
        }
    });
    Judgement { tasks }
}

impl Judgement {
    /// The verdict on one task.
    pub fn of(&self, task: Task) -> &TaskJudgement {
        &self.tasks[task as usize]
    }

    /// Probability of each label when a share `flip` of the answers is turned round by mistake:
    /// p (1 − flip) + (1 − p) flip for the tasks that the object affords, 0 for the others.
    pub fn label_probabilities(&self, flip: f64) -> [f64; 3] {
        self.tasks.each_ref().map(|t| {
            if t.afforded {
                t.probability * (1.0 - flip) + (1.0 - t.probability) * flip
            } else {
                0.0
            }
        })
    }

    /// Draws the labels. `flip` (0, 0.03 and 0.08 in the experiments) is the chance that an answer is turned round by
    /// mistake; tasks that the object does not afford are never flipped. Takes two numbers per task from `rng`,
    /// whatever the outcome, so that one stream serves all flips alike.
    pub fn draw(&self, flip: f64, rng: &mut impl Rng) -> Labels {
        Labels(self.tasks.each_ref().map(|t| {
            let (says, slips) = (rng.random::<f64>(), rng.random::<f64>());
            t.afforded && ((says < t.probability) != (slips < flip))
        }))
    }
}

fn sigmoid(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn observation() -> Observation {
        Observation {
            affords: vec![Task::HandOver, Task::Pouring],
            margins: vec![
                (Rule::SurfaceLeftFree, 0.08),
                (Rule::PatchForReceiver, 1.5),
                (Rule::HandleLeftFree, -0.4),
                (Rule::OpeningClear, 0.0),
            ],
        }
    }

    #[test]
    fn a_task_is_the_product_of_its_rules_and_the_least_favourable_decides() {
        let judgement = judge(&observation(), Persona::ReceiverFirst, &Thresholds::default());
        let pouring = judgement.of(Task::Pouring);
        assert_eq!(
            (pouring.probability, pouring.deciding),
            (0.5, Some(Rule::OpeningClear))
        );
        let hand_over = judgement.of(Task::HandOver);
        // σ(0.08/0.04) σ(1.5/0.15) σ(−0.4/0.04).
        let expected = sigmoid(2.0) * sigmoid(10.0) * sigmoid(-10.0);
        assert!((hand_over.probability - expected).abs() < 1e-15);
        assert_eq!(hand_over.deciding, Some(Rule::HandleLeftFree));
    }

    #[test]
    fn only_the_receiver_first_persona_asks_for_the_handle_and_the_strict_one_doubts_most() {
        let of = |persona| {
            judge(&observation(), persona, &Thresholds::default())
                .of(Task::HandOver)
                .probability
        };
        assert!(of(Persona::Lenient) > of(Persona::Strict));
        // σ(2 − 1) against σ(2 + 1), and the handle that is not free.
        assert!(
            of(Persona::Strict) > 0.7 && of(Persona::Lenient) > 0.94 && of(Persona::ReceiverFirst) < 0.01
        );
    }

    #[test]
    fn flips_stay_among_the_tasks_that_the_object_affords() {
        let judgement = judge(&observation(), Persona::Lenient, &Thresholds::default());
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let labels = judgement.draw(1.0, &mut rng);
        assert!(!labels.contains(Task::ToolUse));
        assert_eq!(judgement.label_probabilities(0.08)[Task::ToolUse as usize], 0.0);
    }

    #[test]
    fn labels_are_drawn_as_often_as_their_probability_says() {
        let judgement = judge(&observation(), Persona::ReceiverFirst, &Thresholds::default());
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let n = 20_000;
        let yes = (0..n)
            .filter(|_| judgement.draw(0.08, &mut rng).contains(Task::Pouring))
            .count();
        // p = 0.5 stays 0.5 under flips; five standard deviations.
        assert!((yes as f64 / f64::from(n) - 0.5).abs() < 5.0 * (0.25 / f64::from(n)).sqrt());
    }
}
