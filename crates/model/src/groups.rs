//! Which rows belong together: those of one object, subject or session.

use std::collections::BTreeMap;

use crate::error::ModelError;
use crate::network::Network;
use crate::table::Table;

/// Rows that belong together.
pub(crate) struct Groups {
    /// A number for each row, equal where the rows belong together.
    pub of_row: Vec<usize>,
    /// Name of each number; `None` for a row that stands alone.
    pub names: Vec<Option<String>>,
}

/// Reads the group column. Rows without a group stand alone.
pub(crate) fn read_groups(
    network: &Network,
    table: &Table,
    group: Option<&str>,
    warnings: &mut Vec<String>,
) -> Result<Option<Groups>, ModelError> {
    let column = match (group, network.group()) {
        (Some(column), _) => column,
        (None, Some(column)) => {
            if table.column(column).is_none() {
                warnings.push(format!(
                    "the network's group column `{column}` is not in the table; values that repeat within a group \
                     count as if each row had measured them anew"
                ));
                return Ok(None);
            }
            column
        }
        (None, None) => return Ok(None),
    };
    let mut known = BTreeMap::new();
    let mut groups = Groups {
        of_row: Vec::with_capacity(table.n_rows()),
        names: Vec::new(),
    };
    for cell in table.texts(column, "grouping")? {
        let next = groups.names.len();
        let group = match &cell {
            Some(text) => *known.entry(text.clone()).or_insert(next),
            None => next,
        };
        if group == next {
            groups.names.push(cell);
        }
        groups.of_row.push(group);
    }
    Ok(Some(groups))
}
