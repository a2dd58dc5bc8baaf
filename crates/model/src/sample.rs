//! Rows drawn from a model: for tests, and for looking at what a model believes.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::cpd::Cpd;
use crate::model::Model;
use crate::table::{Column, Table};

impl Model {
    /// Draws rows, parents first. Discrete nodes become texts, continuous ones a column of numbers per dimension.
    pub fn sample(&self, n_rows: usize, seed: u64) -> Table {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut states = vec![Vec::with_capacity(n_rows); self.nodes().len()];
        let mut values = vec![Vec::with_capacity(n_rows); self.nodes().len()];
        for _ in 0..n_rows {
            let mut row_states = vec![0; self.nodes().len()];
            let mut row_values: Vec<Vec<f64>> = vec![Vec::new(); self.nodes().len()];
            for &idx in self.order() {
                let configuration = self.configuration(idx, &row_states);
                match &self.node(idx).cpd {
                    Cpd::Discrete(cpd) => row_states[idx.0] = cpd.sample(configuration, &mut rng),
                    Cpd::VonMisesFisher(cpd) => row_values[idx.0] = cpd.sample(configuration, &mut rng),
                    Cpd::Mixture(cpd) => {
                        let parents: Vec<f64> = cpd
                            .continuous_parents
                            .iter()
                            .flat_map(|p| row_values[p.0].clone())
                            .collect();
                        row_values[idx.0] = cpd.sample(configuration, &parents, &mut rng);
                    }
                }
            }
            for (i, (state, value)) in row_states.into_iter().zip(row_values).enumerate() {
                states[i].push(state);
                values[i].push(value);
            }
        }
        let mut columns = Vec::new();
        for (i, node) in self.nodes().iter().enumerate() {
            match &node.cpd {
                Cpd::Discrete(cpd) => {
                    let texts = states[i].iter().map(|&state| cpd.states[state].clone()).collect();
                    columns.push((node.name.clone(), Column::Text(texts)));
                }
                Cpd::Mixture(_) | Cpd::VonMisesFisher(_) => {
                    for (d, column) in node.columns().iter().enumerate() {
                        let numbers = values[i].iter().map(|value| value[d]).collect();
                        columns.push((column.clone(), Column::Numbers(numbers)));
                    }
                }
            }
        }
        Table::from_columns(n_rows, columns)
    }
}
