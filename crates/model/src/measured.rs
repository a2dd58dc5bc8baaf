//! How many independent measurements stand behind a fit: rows by weight, or groups where values repeat within them.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

/// Two standardised values closer than this are one: what a text file's sixth digit may change.
const SAME: f64 = 1e-5;

/// Rows of a cell, and what they are worth.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Measured {
    pub n_rows: usize,
    /// Σ w.
    weight: f64,
    /// Σ w².
    squares: f64,
    /// Whether every group has one value.
    one_value: bool,
    /// Names of the groups, where each has one value.
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    groups: BTreeSet<String>,
    /// Rows without a group, where each group has one value.
    #[serde(default)]
    alone: usize,
}

impl Measured {
    /// `names` are those of the numbered groups, `None` for a row that stands alone.
    pub fn of(
        values: &[&[f64]],
        weights: &[f64],
        groups: Option<&[usize]>,
        names: &[Option<String>],
    ) -> Self {
        let mut out = Self {
            n_rows: values.len(),
            weight: weights.iter().sum(),
            squares: weights.iter().map(|w| w * w).sum(),
            ..Self::default()
        };
        let Some(groups) = groups else { return out };
        let mut first = BTreeMap::new();
        out.one_value = values.iter().zip(groups).all(|(value, group)| {
            let known: &[f64] = first.entry(*group).or_insert(*value);
            known.iter().zip(*value).all(|(a, b)| (a - b).abs() <= SAME)
        });
        if out.one_value {
            for group in first.into_keys() {
                match names.get(group) {
                    Some(Some(name)) => {
                        out.groups.insert(name.clone());
                    }
                    _ => out.alone += 1,
                }
            }
        }
        out
    }

    /// Rows of both. Groups of one name are one group.
    pub fn joined(&self, other: &Self) -> Self {
        if self.n_rows == 0 || other.n_rows == 0 {
            return if self.n_rows == 0 { other } else { self }.clone();
        }
        let one_value = self.one_value && other.one_value;
        Self {
            n_rows: self.n_rows + other.n_rows,
            weight: self.weight + other.weight,
            squares: self.squares + other.squares,
            one_value,
            groups: if one_value {
                self.groups.union(&other.groups).cloned().collect()
            } else {
                BTreeSet::new()
            },
            alone: if one_value { self.alone + other.alone } else { 0 },
        }
    }

    /// Whether every group has one value, and some group has several rows.
    pub fn is_constant(&self) -> bool {
        self.one_value && self.groups.len() + self.alone < self.n_rows
    }

    /// Groups where they are constant, else (Σ w)² / Σ w².
    pub fn n_effective(&self) -> f64 {
        if self.is_constant() {
            (self.groups.len() + self.alone) as f64
        } else if self.squares > 0.0 {
            self.weight * self.weight / self.squares
        } else {
            0.0
        }
    }

    /// What a unit of weight counts.
    pub fn scale(&self) -> f64 {
        if self.weight > 0.0 {
            self.n_effective() / self.weight
        } else {
            1.0
        }
    }
}
