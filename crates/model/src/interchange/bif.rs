//! BIF 0.15, the interchange format of discrete networks that bnlearn, pgmpy and pyAgrum read and write.

use std::collections::BTreeMap;

use super::lexer::{Style, Tokens};
use super::names::legal_names;
use super::{Export, Foreign, discrete_model, n_configurations};
use crate::error::ModelError;
use crate::model::Model;

const STYLE: Style = Style {
    format: "BIF",
    in_words: "-+",
    comment: None,
};

impl Model {
    /// Reads BIF. Rows of probabilities are divided by their sum where printing rounded them.
    ///
    /// # Errors
    ///
    /// [`ModelError::TextFile`] with the line; otherwise what [`Model::new`] finds.
    pub fn from_bif(text: &str) -> Result<Self, ModelError> {
        let mut tokens = Tokens::read(text, STYLE)?;
        let mut nodes: Vec<Foreign> = Vec::new();
        let mut positions: BTreeMap<String, usize> = BTreeMap::new();
        while tokens.peek().is_some() {
            if tokens.pass("network") {
                while !tokens.pass("{") {
                    tokens.name("the network's name")?;
                }
                tokens.skip_past("}")?;
            } else if tokens.pass("variable") {
                let node = variable(&mut tokens)?;
                if positions.insert(node.name.clone(), nodes.len()).is_some() {
                    return Err(ModelError::DuplicateNode { node: node.name });
                }
                nodes.push(node);
            } else if tokens.pass("probability") {
                probability(&mut tokens, &mut nodes, &positions)?;
            } else {
                return Err(tokens.unexpected("`network`, `variable` or `probability`"));
            }
        }
        discrete_model(STYLE.format, nodes)
    }

    /// Writes the discrete nodes as BIF. Nothing of them is lost: numbers read back to the same bits. Names that BIF
    /// cannot hold are changed; that, and the continuous nodes, are listed as losses.
    ///
    /// # Errors
    ///
    /// [`ModelError::Export`] where no node is discrete, or two names become one.
    pub fn to_bif(&self) -> Result<Export, ModelError> {
        let (nodes, mut losses) = self.discrete_part(STYLE.format)?;
        let legal = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
        let all: Vec<&str> = nodes
            .iter()
            .map(|(idx, _)| self.node(*idx).name.as_str())
            .collect();
        let names = legal_names(STYLE.format, "node", all.iter().copied(), legal, &mut losses)?;
        let mut states = BTreeMap::new();
        let mut text = String::from("network prehend {\n}\n");
        for ((idx, cpd), name) in nodes.iter().zip(&names) {
            let what = format!("state of `{name}`");
            let own = legal_names(
                STYLE.format,
                &what,
                cpd.states.iter().map(String::as_str),
                legal,
                &mut losses,
            )?;
            text += &format!(
                "variable {name} {{\n  type discrete [ {} ] {{ {} }};\n}}\n",
                own.len(),
                own.join(", ")
            );
            states.insert(*idx, (name, own));
        }
        for ((_, cpd), name) in nodes.iter().zip(&names) {
            let parents: Vec<&str> = cpd
                .parents
                .iter()
                .map(|parent| states[parent].0.as_str())
                .collect();
            if parents.is_empty() {
                text += &format!(
                    "probability ( {name} ) {{\n  table {};\n}}\n",
                    numbers(&cpd.table[0])
                );
                continue;
            }
            text += &format!("probability ( {name} | {} ) {{\n", parents.join(", "));
            for (row, probabilities) in cpd.table.iter().enumerate() {
                let of_parents = self.parent_states(&cpd.parents, row);
                let words: Vec<&str> = cpd
                    .parents
                    .iter()
                    .zip(of_parents)
                    .map(|(parent, state)| states[parent].1[state].as_str())
                    .collect();
                text += &format!("  ({}) {};\n", words.join(", "), numbers(probabilities));
            }
            text += "}\n";
        }
        Ok(Export { text, losses })
    }
}

fn numbers(row: &[f64]) -> String {
    row.iter().map(f64::to_string).collect::<Vec<_>>().join(", ")
}

/// `NAME { type discrete [ 2 ] { a, b }; property …; }`
fn variable(tokens: &mut Tokens) -> Result<Foreign, ModelError> {
    let line = tokens.at().line;
    let name = tokens.name("a variable's name")?;
    tokens.expect("{")?;
    let mut states = Vec::new();
    while !tokens.pass("}") {
        if tokens.pass("property") {
            tokens.skip_past(";")?;
            continue;
        }
        tokens.expect("type")?;
        tokens.expect("discrete")?;
        tokens.expect("[")?;
        let at = tokens.at();
        let count = tokens.name("the number of states")?;
        tokens.expect("]")?;
        tokens.expect("{")?;
        while !tokens.pass("}") {
            states.push(tokens.name("a state")?);
            tokens.pass(",");
        }
        tokens.expect(";")?;
        if count.parse() != Ok(states.len()) {
            return Err(at.error(
                format!("{} states of `{name}`", states.len()),
                format!("{count}, as announced"),
            ));
        }
    }
    Ok(Foreign {
        name,
        states,
        line,
        parents: Vec::new(),
        table: None,
    })
}

/// `( CHILD | PARENTS ) { table …; }` or `{ (states) …; default …; }`
fn probability(
    tokens: &mut Tokens,
    nodes: &mut [Foreign],
    positions: &BTreeMap<String, usize>,
) -> Result<(), ModelError> {
    let start = tokens.at();
    tokens.expect("(")?;
    let mut names = Vec::new();
    while !tokens.pass(")") {
        let at = tokens.at();
        let name = tokens.name("a variable")?;
        let Some(&position) = positions.get(&name) else {
            return Err(at.error(format!("`{name}`"), "a variable declared before"));
        };
        names.push(position);
        if !tokens.pass("|") {
            tokens.pass(",");
        }
    }
    let Some((&child, parents)) = names.split_first() else {
        return Err(start.error("no variable", "`( CHILD | PARENTS )`"));
    };
    let n_states = nodes[child].states.len();
    let n_rows = n_configurations(start, parents.iter().map(|&p| nodes[p].states.len()), n_states)?;
    let mut table = vec![f64::NAN; n_rows * n_states];
    tokens.expect("{")?;
    while !tokens.pass("}") {
        let at = tokens.at();
        if tokens.pass("property") {
            tokens.skip_past(";")?;
        } else if tokens.pass("table") {
            // The child varies slowest in a whole table.
            let row = read_numbers(tokens, table.len())?;
            for (i, p) in row.into_iter().enumerate() {
                table[(i % n_rows) * n_states + i / n_rows] = p;
            }
        } else if tokens.pass("default") {
            let row = read_numbers(tokens, n_states)?;
            for slots in table
                .chunks_mut(n_states)
                .filter(|slots| slots.iter().all(|p| p.is_nan()))
            {
                slots.copy_from_slice(&row);
            }
        } else {
            tokens.expect("(")?;
            let mut number = 0;
            for &parent in parents {
                let here = tokens.at();
                let word = tokens.name("a state")?;
                tokens.pass(",");
                let states = &nodes[parent].states;
                let state = states.iter().position(|state| *state == word).ok_or_else(|| {
                    let known = crate::error::list(states.iter().map(String::as_str));
                    here.error(
                        format!("`{word}`"),
                        format!("a state of `{}`: {known}", nodes[parent].name),
                    )
                })?;
                number = number * states.len() + state;
            }
            tokens.expect(")")?;
            let row = read_numbers(tokens, n_states)?;
            table[number * n_states..(number + 1) * n_states].copy_from_slice(&row);
        }
        if tokens.peek().is_none() {
            return Err(at.error("the end of the file", "`}`"));
        }
    }
    if let Some(missing) = table.iter().position(|p| p.is_nan()) {
        return Err(start.error(
            format!(
                "no probabilities of `{}` in configuration {}",
                nodes[child].name,
                missing / n_states.max(1)
            ),
            "one row for each configuration of the parents, or `default`",
        ));
    }
    let parents = parents.iter().map(|&p| nodes[p].name.clone()).collect();
    let node = &mut nodes[child];
    if node.table.is_some() {
        return Err(start.error(format!("a second `probability` of `{}`", node.name), "one"));
    }
    (node.parents, node.table, node.line) = (parents, Some(table), start.line);
    Ok(())
}

fn read_numbers(tokens: &mut Tokens, n: usize) -> Result<Vec<f64>, ModelError> {
    let start = tokens.at();
    let mut out = Vec::new();
    while !tokens.pass(";") {
        let at = tokens.at();
        let word = tokens.name("a probability")?;
        let number: f64 = word
            .parse()
            .map_err(|_| at.error(format!("`{word}`"), "a probability"))?;
        if !(number >= 0.0 && number.is_finite()) {
            return Err(at.error(format!("`{word}`"), "a probability"));
        }
        out.push(number);
        tokens.pass(",");
    }
    if out.len() != n {
        return Err(start.error(format!("{} probabilities", out.len()), n.to_string()));
    }
    Ok(out)
}
