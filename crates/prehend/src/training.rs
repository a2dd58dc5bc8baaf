//! Rows to learn from: a grasp enters once for each task that it is labelled with.

use std::collections::BTreeMap;

use prehend_model::Table;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use crate::Error;
use crate::frame::{Column, Frame};
use crate::labels::Answer;

/// The tasks, in the order of the network's states.
pub const TASKS: [&str; 3] = ["hand-over", "pouring", "tool-use"];

/// Copies of the labelled grasps, one per task that a grasp affords, with the column `task` in front. Grasps without
/// any task are left out: the paper trains on positives only.
///
/// # Errors
///
/// Where the table has no column `grasp_id`.
pub fn labelled_copies(frame: &Frame, answers: &BTreeMap<String, Vec<Answer>>) -> Result<Frame, Error> {
    let ids = frame.texts("grasp_id")?;
    let (mut rows, mut tasks) = (Vec::new(), Vec::new());
    for (row, id) in ids.iter().enumerate() {
        let answers = answers.get(id).map_or(&[][..], Vec::as_slice);
        for task in TASKS {
            if answers.iter().any(|a| a.task == task && a.yes) {
                rows.push(row);
                tasks.push(Some(task.to_owned()));
            }
        }
    }
    let copies = frame.select(&rows);
    let mut with_task = Frame::new();
    with_task.push("task", Column::Text(tasks));
    for (name, column) in copies.columns() {
        with_task.push(name.clone(), column.clone());
    }
    Ok(with_task)
}

/// Rows such that every value of `column` is as frequent as the rarest, and, within a value, the groups of `group` are
/// as even as their sizes allow. Drawn with `seed`, returned in rising order.
///
/// # Errors
///
/// Where one of the columns is missing.
pub fn balanced_rows(
    frame: &Frame,
    column: &str,
    group: Option<&str>,
    seed: u64,
) -> Result<Vec<usize>, Error> {
    let values = frame.texts(column)?;
    let groups = match group {
        Some(group) => frame.texts(group)?,
        None => vec![String::new(); frame.n_rows()],
    };
    let mut cells: BTreeMap<&str, BTreeMap<&str, Vec<usize>>> = BTreeMap::new();
    for (row, (value, group)) in values.iter().zip(&groups).enumerate() {
        cells
            .entry(value)
            .or_default()
            .entry(group)
            .or_default()
            .push(row);
    }
    let least = cells
        .values()
        .map(|groups| groups.values().map(Vec::len).sum::<usize>())
        .min()
        .unwrap_or(0);
    let mut chosen = Vec::with_capacity(least * cells.len());
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for groups in cells.values_mut() {
        for rows in groups.values_mut() {
            rows.shuffle(&mut rng);
        }
        // Take one row of each group in turn, until the value has its share.
        let mut left = least;
        while left > 0 {
            for rows in groups.values_mut() {
                if left > 0
                    && let Some(row) = rows.pop()
                {
                    chosen.push(row);
                    left -= 1;
                }
            }
        }
    }
    chosen.sort_unstable();
    Ok(chosen)
}

/// The frame as the model crate takes it.
///
/// # Errors
///
/// Never for a frame of ours, whose columns have one length; the model crate's own otherwise.
pub fn to_table(frame: &Frame) -> Result<Table, Error> {
    let mut table = Table::new(frame.n_rows());
    for (name, column) in frame.columns() {
        table = match column {
            Column::Number(v) => table.with_numbers(name, v.clone())?,
            Column::Integer(v) => table.with_numbers(name, v.iter().map(|x| *x as f64).collect())?,
            Column::Text(v) => {
                table.with_text(name, v.iter().map(|t| t.clone().unwrap_or_default()).collect())?
            }
        };
    }
    Ok(table)
}

/// How many rows there are of each task and object.
///
/// # Errors
///
/// Where the columns are missing.
pub fn prevalence(frame: &Frame) -> Result<BTreeMap<String, BTreeMap<String, usize>>, Error> {
    let mut counts: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
    for (task, kind) in frame.texts("task")?.into_iter().zip(frame.texts("object_type")?) {
        *counts.entry(task).or_default().entry(kind).or_default() += 1;
    }
    Ok(counts)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame() -> Frame {
        let mut frame = Frame::new();
        let text = |v: &[&str]| Column::Text(v.iter().map(|t| Some((*t).to_owned())).collect());
        frame.push("grasp_id", text(&["a", "b", "c", "d"]));
        frame.push("object", text(&["o", "o", "p", "p"]));
        frame
    }

    fn answer(task: &str, yes: bool) -> Answer {
        Answer {
            task: task.into(),
            yes,
            probability: 0.5,
            rule: String::new(),
        }
    }

    #[test]
    fn a_grasp_enters_once_per_task() {
        let answers = BTreeMap::from([
            (
                "a".to_owned(),
                vec![answer("hand-over", true), answer("pouring", true)],
            ),
            ("b".to_owned(), vec![answer("hand-over", false)]),
            ("d".to_owned(), vec![answer("tool-use", true)]),
        ]);
        let copies = labelled_copies(&frame(), &answers).unwrap();
        assert_eq!(copies.texts("grasp_id").unwrap(), ["a", "a", "d"]);
        assert_eq!(
            copies.texts("task").unwrap(),
            ["hand-over", "pouring", "tool-use"]
        );
    }

    #[test]
    fn balance_evens_out_tasks_and_then_objects() {
        let mut frame = Frame::new();
        let column = |f: &dyn Fn(usize) -> &'static str| {
            Column::Text((0..60).map(|i| Some(f(i).to_owned())).collect())
        };
        frame.push("task", column(&|i| if i < 40 { "x" } else { "y" }));
        frame.push("object", column(&|i| if i < 5 { "few" } else { "many" }));
        let rows = balanced_rows(&frame, "task", Some("object"), 7).unwrap();
        assert_eq!(rows.len(), 40);
        assert_eq!(rows.iter().filter(|r| **r < 40).count(), 20);
        assert_eq!(
            rows.iter().filter(|r| **r < 5).count(),
            5,
            "all of the small group, since it is below its share"
        );
        assert_eq!(rows, balanced_rows(&frame, "task", Some("object"), 7).unwrap());
    }
}
