//! Why a Bayesian network could not be built, trained or queried.

/// Why a Bayesian network could not be built, trained or queried.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// The arcs contain a directed cycle, so Eq. 1 has no factorization.
    #[error("arcs form a cycle through `{node}`; remove one of its incoming arcs")]
    Cycle {
        /// A node on the cycle.
        node: String,
    },

    /// An arc starts at a node that does not exist.
    #[error("`{node}` names the parent `{parent}`, which is not a node; the nodes are {known}")]
    UnknownParent {
        /// The node at the arc's head.
        node: String,
        /// The name that no node has.
        parent: String,
        /// All nodes, separated by commas.
        known: String,
    },

    /// An arc leads from a continuous to a discrete node.
    #[error(
        "`{node}` is discrete and has the continuous parent `{parent}`; \
         turn the arc round (`{parent}` gets the parent `{node}`) or remove it"
    )]
    ContinuousParent {
        /// The discrete node.
        node: String,
        /// Its continuous parent.
        parent: String,
    },

    /// Two nodes share a name.
    #[error("two nodes are called `{node}`; give each its own name")]
    DuplicateNode {
        /// The name.
        node: String,
    },

    /// A column belongs to two nodes, or twice to one.
    #[error("the column `{column}` is used by `{first}` and by `{second}`; each column belongs to one node")]
    DuplicateColumn {
        /// The column.
        column: String,
        /// The node that names it first.
        first: String,
        /// The node that names it again.
        second: String,
    },

    /// A network file is not TOML, or a key has the wrong type.
    #[error("network file: {problem}")]
    NetworkFile {
        /// What the reader found, with the line.
        problem: String,
    },

    /// A setting of a node makes no sense.
    #[error("`{node}`: `{key}` is {found}; expected {expected}")]
    BadSetting {
        /// The node.
        node: String,
        /// The key in the network file.
        key: String,
        /// What stands there.
        found: String,
        /// What should stand there.
        expected: String,
    },

    /// A table lacks a column.
    #[error("the table has no column `{column}`, which `{node}` needs; its columns are {known}")]
    MissingColumn {
        /// The column.
        column: String,
        /// Who needs it.
        node: String,
        /// All columns, separated by commas.
        known: String,
    },

    /// A cell of a table has no meaning for its node.
    #[error("column `{column}`, row {row}: found {found}, expected {expected}")]
    Cell {
        /// The column.
        column: String,
        /// The row, from 0.
        row: usize,
        /// What stands there.
        found: String,
        /// What should stand there.
        expected: String,
    },

    /// Two things that must have one length differ.
    #[error("{what} has {found} entries; expected {expected}")]
    Length {
        /// What was counted.
        what: String,
        /// How many there are.
        found: usize,
        /// How many there should be.
        expected: usize,
    },

    /// No row is left to train a node on.
    #[error("`{node}`: none of the {n_rows} rows has all its columns; fill in some or remove the node")]
    NoRows {
        /// The node.
        node: String,
        /// Rows of the table.
        n_rows: usize,
    },

    /// A model file is not JSON, or lacks a key.
    #[error("model file, {place}: {problem}")]
    ModelFile {
        /// Where, for example ``node `size` ``.
        place: String,
        /// What is wrong there.
        problem: String,
    },

    /// A row of a discrete node's table is no distribution.
    #[error("`{node}`: table row {row} is {found}; expected {expected}")]
    BadTable {
        /// The discrete node.
        node: String,
        /// The row, from 0.
        row: usize,
        /// What stands there.
        found: String,
        /// What should stand there.
        expected: String,
    },

    /// A mixture component cannot be.
    #[error("`{node}`: configuration {configuration}, component {component}: {problem}")]
    BadComponent {
        /// The continuous node.
        node: String,
        /// Row of `components`, from 0.
        configuration: usize,
        /// Component in that row, from 0.
        component: usize,
        /// What is wrong with it.
        problem: String,
    },

    /// A file of another program's format has something unexpected.
    #[error("{format} file, line {line}: found {found}, expected {expected}")]
    TextFile {
        /// The format.
        format: String,
        /// The line, from 1.
        line: usize,
        /// What stands there.
        found: String,
        /// What should stand there.
        expected: String,
    },

    /// A model cannot be written in another program's format.
    #[error("the model cannot be written as {format}: {problem}")]
    Export {
        /// The format.
        format: String,
        /// What stands in the way.
        problem: String,
    },

    /// A binary model file is damaged or of another kind.
    #[error("binary model file: found {found}, expected {expected}")]
    Binary {
        /// What stands there.
        found: String,
        /// What should stand there.
        expected: String,
    },

    /// A query names a node that the model does not have.
    #[error("the model has no node `{node}`; its nodes are {known}")]
    UnknownNode {
        /// The name.
        node: String,
        /// All nodes, separated by commas.
        known: String,
    },

    /// A value is no value of its node.
    #[error("`{node}`: found {found}, expected {expected}")]
    BadValue {
        /// The node.
        node: String,
        /// What was given.
        found: String,
        /// What would do.
        expected: String,
    },

    /// The evidence lies where a flat component has no density.
    #[error(
        "`{node}`: component {component} of configuration {configuration} has a singular covariance, so the \
         evidence has no density; leave `{node}` unobserved, give it as {{mean, covariance}}, or widen the component"
    )]
    NoDensity {
        /// The continuous node.
        node: String,
        /// Row of `components`, from 0.
        configuration: usize,
        /// Component in that row, from 0.
        component: usize,
    },

    /// The evidence has probability zero.
    #[error("the evidence has probability zero under this model; {hint}")]
    ImpossibleEvidence {
        /// Which nodes to look at.
        hint: String,
    },

    /// A continuous target has no density: some component of its posterior is singular.
    #[error(
        "the posterior of `{node}` has a component without spread in some direction, so it has no density at points; \
         ask without points: its mean and covariance are there"
    )]
    FlatAnswer {
        /// The targets.
        node: String,
    },

    /// Too many combinations of components: the sum over the likeliest ones is too far from the whole.
    #[error(
        "this query sums so many combinations of components that only a part was taken, and its probabilities may be \
         off by {error_bound:.1e}; observe more nodes or use fewer components"
    )]
    Pruned {
        /// Most that a probability can be off.
        error_bound: f64,
    },

    /// Exact elimination would take too many terms.
    #[error(
        "this query sums {n_terms:.1e} terms, more than {limit:.1e}; observe more nodes or use fewer components"
    )]
    TooManyTerms {
        /// How many combinations of states and components.
        n_terms: f64,
        /// How many are allowed.
        limit: f64,
    },
}

/// Names in backquotes, separated by commas, as the messages list them.
pub(crate) fn list<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let names: Vec<String> = names.into_iter().map(|name| format!("`{name}`")).collect();
    if names.is_empty() {
        "none".into()
    } else {
        names.join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_say_what_to_try() {
        let cycle = ModelError::Cycle { node: "cvex".into() };
        assert_eq!(
            cycle.to_string(),
            "arcs form a cycle through `cvex`; remove one of its incoming arcs"
        );
        let parent = ModelError::ContinuousParent {
            node: "task".into(),
            parent: "size".into(),
        };
        assert_eq!(
            parent.to_string(),
            "`task` is discrete and has the continuous parent `size`; turn the arc round (`size` gets the parent \
             `task`) or remove it"
        );
        let flat = ModelError::NoDensity {
            node: "size".into(),
            configuration: 1,
            component: 0,
        };
        assert_eq!(
            flat.to_string(),
            "`size`: component 0 of configuration 1 has a singular covariance, so the evidence has no density; leave \
             `size` unobserved, give it as {mean, covariance}, or widen the component"
        );
    }
}
