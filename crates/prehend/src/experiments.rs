//! Which objects and hands the experiments use: `experiments.toml`, or derived from what there is.

use serde::{Deserialize, Serialize};

use crate::{Error, Object};

/// The experiments' settings (paper, sections V-C and VI).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Experiments {
    /// The hand that shows a grasp (the human hand in the paper).
    pub demonstrator: String,
    /// The hand that imitates it (the Schunk hand in the paper).
    pub imitator: String,
    /// Whose labels are learned: a persona of the tutor.
    pub persona: String,
    /// Experiment A: the maps of P(upos | task, size, cvex).
    pub a: MapExperiment,
    /// Experiment B: task classification.
    pub b: ClassificationExperiment,
    /// Experiment C: imitation.
    pub c: ImitationExperiment,
}

/// Experiment A: objects held out, shown as maps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MapExperiment {
    /// Objects that the model does not see in training.
    pub held_out: Vec<String>,
}

/// Experiment B: one object per type held out, in each fold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClassificationExperiment {
    /// Each fold's held-out objects.
    pub folds: Vec<Vec<String>>,
}

/// Experiment C: a demonstration on one object, and the objects to choose from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImitationExperiment {
    /// The object of the demonstration, o^H.
    pub demonstration: String,
    /// The task that the demonstrated grasp is chosen to show.
    pub task: String,
    /// The objects o₁ … o₆ to choose from.
    pub candidates: Vec<String>,
    /// Weight of the task probability against similarity in Eq. 5.
    pub lambda: f64,
}

impl Experiments {
    /// Reads `experiments.toml` and checks its names against the objects and hands of the run.
    ///
    /// # Errors
    ///
    /// Names the key and the name that is not there.
    pub fn parse(text: &str, objects: &[Object], hands: &[String]) -> Result<Self, Error> {
        let experiments: Self = toml::from_str(text).map_err(Error::input)?;
        for (key, hand) in [
            ("demonstrator", &experiments.demonstrator),
            ("imitator", &experiments.imitator),
        ] {
            if !hands.contains(hand) {
                return Err(Error::input(format!(
                    "{key} = \"{hand}\": no such hand; there are {}",
                    hands.join(", ")
                )));
            }
        }
        let mut named: Vec<(&str, &String)> = Vec::new();
        named.extend(experiments.a.held_out.iter().map(|o| ("a.held_out", o)));
        named.extend(experiments.b.folds.iter().flatten().map(|o| ("b.folds", o)));
        named.push(("c.demonstration", &experiments.c.demonstration));
        named.extend(experiments.c.candidates.iter().map(|o| ("c.candidates", o)));
        for (key, name) in named {
            if !objects.iter().any(|o| o.name == *name) {
                let names: Vec<_> = objects.iter().map(|o| o.name.as_str()).collect();
                return Err(Error::input(format!(
                    "{key}: no object `{name}`; there are {}",
                    names.join(", ")
                )));
            }
        }
        if !(0.0..=1.0).contains(&experiments.c.lambda) {
            return Err(Error::input(format!(
                "c.lambda = {}: expected a number from 0 to 1",
                experiments.c.lambda
            )));
        }
        Ok(experiments)
    }

    /// Settings for any set of objects and hands: the first hand by name that sorts first demonstrates, the last imitates;
    /// the last object of a type is held out; the paper's λ.
    ///
    /// # Errors
    ///
    /// Where there are no objects or no hands.
    pub fn derive(objects: &[Object], hands: &[String]) -> Result<Self, Error> {
        let (Some(demonstrator), Some(imitator)) = (hands.first(), hands.last()) else {
            return Err(Error::input("there is no hand to run experiments with"));
        };
        let mut kinds: Vec<&str> = objects.iter().map(|o| o.kind.as_str()).collect();
        kinds.sort_unstable();
        kinds.dedup();
        let of_kind = |kind: &str| {
            objects
                .iter()
                .filter(|o| o.kind == kind)
                .map(|o| o.name.clone())
                .collect::<Vec<_>>()
        };
        // A type with one object stays in training, else nothing would be known about it.
        let several: Vec<&str> = kinds.iter().copied().filter(|k| of_kind(k).len() > 1).collect();
        let nth_last = |kind: &str, n: usize| {
            let names = of_kind(kind);
            names[names.len() - 1 - n % names.len()].clone()
        };
        let fold: Vec<String> = several.iter().map(|k| nth_last(k, 0)).collect();
        let held_out = ["hammer", "bottle", "mug"]
            .iter()
            .filter(|k| several.contains(k))
            .map(|k| nth_last(k, 0))
            .collect();
        let shown = objects
            .iter()
            .filter(|o| o.kind == "mug")
            .chain(objects.iter().filter(|o| o.is_container()))
            .chain(objects)
            .next()
            .ok_or_else(|| Error::input("there are no objects to run experiments with"))?;
        let demonstration = shown.name.clone();
        let task = if shown.is_container() {
            "pouring"
        } else {
            "tool-use"
        };
        let mut candidates: Vec<String> = kinds
            .iter()
            .filter_map(|k| of_kind(k).into_iter().rev().find(|name| *name != demonstration))
            .collect();
        candidates.truncate(6);
        Ok(Self {
            demonstrator: demonstrator.clone(),
            imitator: imitator.clone(),
            persona: "strict".into(),
            a: MapExperiment { held_out },
            b: ClassificationExperiment {
                folds: if fold.is_empty() { vec![] } else { vec![fold] },
            },
            c: ImitationExperiment {
                demonstration,
                task: task.into(),
                candidates,
                lambda: 0.8,
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::ObjectOptions;

    fn bundled(names: &[&str]) -> Vec<Object> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../objects");
        names
            .iter()
            .map(|n| Object::read(&folder.join(n).with_extension("ply"), ObjectOptions::default()).unwrap())
            .collect()
    }

    fn hands() -> Vec<String> {
        vec!["human".into(), "schunk_sdh".into()]
    }

    #[test]
    fn the_last_of_a_type_is_held_out_and_a_lone_one_is_not() {
        let objects = bundled(&["glass/tumbler", "mug/camping_cup", "mug/coffee_mug"]);
        let derived = Experiments::derive(&objects, &hands()).unwrap();
        assert_eq!(derived.a.held_out, ["coffee_mug"]);
        assert_eq!(derived.b.folds, [["coffee_mug"]]);
        assert_eq!(
            (derived.demonstrator.as_str(), derived.imitator.as_str()),
            ("human", "schunk_sdh")
        );
        assert_eq!(
            (derived.c.demonstration.as_str(), derived.c.task.as_str()),
            ("camping_cup", "pouring")
        );
        assert_eq!(derived.c.candidates, ["tumbler", "coffee_mug"]);
    }

    #[test]
    fn without_a_vessel_the_demonstration_shows_the_use_of_a_tool() {
        let objects = bundled(&["hammer/ball_hammer"]);
        let derived = Experiments::derive(&objects, &hands()[1..]).unwrap();
        assert_eq!(derived.c.task, "tool-use");
        assert!(
            derived.a.held_out.is_empty() && derived.b.folds.is_empty() && derived.c.candidates.is_empty()
        );
        assert_eq!(derived.demonstrator, derived.imitator);
    }

    #[test]
    fn what_is_written_reads_back_and_unknown_names_are_named() {
        let objects = bundled(&["mug/camping_cup", "mug/coffee_mug"]);
        let derived = Experiments::derive(&objects, &hands()).unwrap();
        let text = toml::to_string(&derived).unwrap();
        assert_eq!(Experiments::parse(&text, &objects, &hands()).unwrap(), derived);
        let message = |from: &str, to: &str| {
            let changed = text.replace(from, to);
            assert_ne!(changed, text);
            Experiments::parse(&changed, &objects, &hands())
                .unwrap_err()
                .to_string()
        };
        assert_eq!(
            message("imitator = \"schunk_sdh\"", "imitator = \"claw\""),
            "imitator = \"claw\": no such hand; there are human, schunk_sdh"
        );
        assert_eq!(
            message("demonstration = \"camping_cup\"", "demonstration = \"jar\""),
            "c.demonstration: no object `jar`; there are camping_cup, coffee_mug"
        );
        assert_eq!(
            message("lambda = 0.8", "lambda = 8.0"),
            "c.lambda = 8: expected a number from 0 to 1"
        );
    }
}
