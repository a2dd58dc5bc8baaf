//! The tutor's rules, what they ask, and which feature of a grasp comes nearest to saying the same.
//!
//! Run with `cargo run -p prehend-tutor --example rules_and_features`.

use prehend_tutor::{Rule, Task, Thresholds, label_ceiling};

fn main() {
    let thresholds = Thresholds::default();
    for task in Task::ALL {
        println!("{task}");
        for rule in Rule::ALL.into_iter().filter(|r| r.task() == task) {
            println!(
                "  {:24} softness {:.3}: {}",
                rule.name(),
                thresholds.softness(rule),
                rule.margin_in_words()
            );
            println!("  {:24} nearest feature: {}", "", rule.nearest_feature());
        }
    }

    // Half of the grasps suit pouring alone, half suit pouring and hand-over alike: what can a classifier reach?
    let grasps: Vec<[f64; 3]> = (0..100).map(|i| [f64::from(i % 2), 1.0, 0.0]).collect();
    let ceiling = label_ceiling(&grasps).expect("two classes occur");
    println!(
        "ceiling {:.2}: hand-over {:.2}, pouring {:.2}",
        ceiling.mean_recall, ceiling.recall[0], ceiling.recall[1]
    );
    // 50 copies of hand-over against 100 of pouring: the shared grasps are worth more as hand-over.
    assert_eq!((ceiling.mean_recall * 100.0).round(), 75.0);
}
