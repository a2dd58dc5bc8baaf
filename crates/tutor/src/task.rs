//! The tasks, and sets of them.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::TutorError;

/// What a grasp may be good for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Task {
    /// Giving the object to somebody.
    HandOver,
    /// Pouring from a container.
    Pouring,
    /// Using a tool: hammering, cutting, turning screws.
    ToolUse,
}

impl Task {
    /// All tasks, in the order of every table.
    pub const ALL: [Self; 3] = [Self::HandOver, Self::Pouring, Self::ToolUse];

    /// The name that files use: `hand-over`, `pouring`, `tool-use`.
    pub fn name(self) -> &'static str {
        match self {
            Self::HandOver => "hand-over",
            Self::Pouring => "pouring",
            Self::ToolUse => "tool-use",
        }
    }
}

impl std::fmt::Display for Task {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Task {
    type Err = TutorError;

    fn from_str(name: &str) -> Result<Self, TutorError> {
        Self::ALL
            .into_iter()
            .find(|t| t.name() == name)
            .ok_or_else(|| TutorError::Unknown {
                what: "task",
                found: name.to_owned(),
                expected: "hand-over, pouring or tool-use",
            })
    }
}

/// The tasks that one grasp was labelled with; may be none, one or several.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
pub struct Labels(pub [bool; 3]);

impl Labels {
    /// Whether the task is among them.
    pub fn contains(self, task: Task) -> bool {
        self.0[task as usize]
    }

    /// The tasks, in the order of [`Task::ALL`].
    pub fn tasks(self) -> impl Iterator<Item = Task> {
        Task::ALL.into_iter().filter(move |&t| self.contains(t))
    }

    /// How many there are.
    pub fn n_tasks(self) -> usize {
        self.0.iter().filter(|&&is| is).count()
    }
}

impl FromIterator<Task> for Labels {
    fn from_iter<I: IntoIterator<Item = Task>>(tasks: I) -> Self {
        let mut labels = Self::default();
        for task in tasks {
            labels.0[task as usize] = true;
        }
        labels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_read_back() {
        for task in Task::ALL {
            assert_eq!(task.name().parse(), Ok(task));
        }
        assert_eq!(
            "handover".parse::<Task>().unwrap_err().to_string(),
            "`handover` is not a task; expected hand-over, pouring or tool-use"
        );
    }

    #[test]
    fn labels_are_a_set() {
        let labels: Labels = [Task::ToolUse, Task::HandOver, Task::ToolUse]
            .into_iter()
            .collect();
        assert_eq!(
            labels.tasks().collect::<Vec<_>>(),
            [Task::HandOver, Task::ToolUse]
        );
        assert_eq!(labels.n_tasks(), 2);
    }
}
