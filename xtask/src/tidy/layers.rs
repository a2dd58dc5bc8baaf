//! The table of who may know whom.

use anyhow::{Context, Result};
use toml::{Table, Value};

/// Which crates of ours each crate may use. `prehend-testkit` may serve anyone's tests.
const USES: &[(&str, &[&str])] = &[
    ("prehend-testkit", &[]),
    ("prehend-geometry", &[]),
    ("prehend-model", &[]),
    ("prehend-hand", &["prehend-geometry"]),
    ("prehend-quality", &["prehend-geometry"]),
    (
        "prehend-grasp",
        &["prehend-geometry", "prehend-hand", "prehend-quality"],
    ),
    ("prehend-tutor", &["prehend-geometry", "prehend-hand"]),
    ("prehend-imitation", &["prehend-grasp", "prehend-model"]),
    (
        "prehend-report",
        &[
            "prehend-geometry",
            "prehend-hand",
            "prehend-grasp",
            "prehend-model",
            "prehend-imitation",
        ],
    ),
    (
        "prehend",
        &[
            "prehend-geometry",
            "prehend-model",
            "prehend-hand",
            "prehend-quality",
            "prehend-grasp",
            "prehend-tutor",
            "prehend-imitation",
            "prehend-report",
        ],
    ),
    ("prehend-studio", &["prehend"]),
    ("prehend-cli", &["prehend", "prehend-studio"]),
    ("xtask", &[]),
];

/// Name of the package that `manifest` describes.
pub fn name(manifest: &str) -> Result<String> {
    let manifest: Table = manifest.parse().context("not TOML")?;
    let name = manifest
        .get("package")
        .and_then(|package| package.get("name"))
        .and_then(Value::as_str);
    Ok(name.context("a Cargo.toml has [package] name")?.to_owned())
}

/// Findings about one manifest: arrows that the table does not have, and lints that are not the workspace's.
pub fn check(file: &str, text: &str) -> Result<Vec<String>> {
    let manifest: Table = text.parse().with_context(|| format!("{file}: not TOML"))?;
    let name = name(text).with_context(|| file.to_owned())?;
    let mut findings = Vec::new();
    let Some((_, allowed)) = USES.iter().find(|(known, _)| *known == name) else {
        return Ok(vec![format!(
            "{file}: `{name}` is not in the table of layers; add it to xtask/src/tidy/layers.rs and docs/architecture.md"
        )]);
    };
    for section in ["dependencies", "build-dependencies", "dev-dependencies"] {
        let Some(dependencies) = manifest.get(section).and_then(Value::as_table) else {
            continue;
        };
        for used in dependencies.keys() {
            let ours = used == "prehend" || used == "xtask" || used.starts_with("prehend-");
            let for_tests = section == "dev-dependencies" && used == "prehend-testkit";
            if ours && !for_tests && !allowed.contains(&used.as_str()) {
                let line = line_of(text, used);
                findings.push(format!(
                    "{file}:{line}: `{name}` may not use `{used}` (it may use {}); move the code or discuss the arrow",
                    if allowed.is_empty() { "no crate of ours".to_owned() } else { allowed.join(", ") }
                ));
            }
        }
    }
    let lints = manifest
        .get("lints")
        .and_then(|lints| lints.get("workspace"))
        .and_then(Value::as_bool);
    if lints != Some(true) {
        findings.push(format!(
            "{file}: the workspace's lints are off; add `[lints]` with `workspace = true`"
        ));
    }
    Ok(findings)
}

/// Line on which `text` first names the dependency `used` as a key.
fn line_of(text: &str, used: &str) -> usize {
    let names = |line: &str| {
        line.trim_start()
            .strip_prefix(used)
            .is_some_and(|rest| rest.starts_with([' ', '.', '=']))
            || line.contains(&format!(".{used}]"))
    };
    text.lines().position(names).map_or(1, |idx| idx + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINTS: &str = "[lints]\nworkspace = true\n";

    #[test]
    fn an_arrow_upwards_is_named_with_its_line() {
        let text = format!(
            "[package]\nname = \"prehend-tutor\"\n[dependencies]\nprehend-hand.workspace = true\nprehend-grasp.workspace = true\n{LINTS}"
        );
        assert_eq!(
            check("crates/tutor/Cargo.toml", &text).unwrap(),
            [
                "crates/tutor/Cargo.toml:5: `prehend-tutor` may not use `prehend-grasp` (it may use prehend-geometry, prehend-hand); \
              move the code or discuss the arrow"
            ]
        );
    }

    #[test]
    fn the_testkit_serves_tests_only() {
        let text = |section| {
            format!(
                "[package]\nname = \"prehend-model\"\n[{section}]\nprehend-testkit.workspace = true\n{LINTS}"
            )
        };
        assert!(check("Cargo.toml", &text("dev-dependencies")).unwrap().is_empty());
        assert_eq!(check("Cargo.toml", &text("dependencies")).unwrap().len(), 1);
    }

    #[test]
    fn lints_must_be_the_workspaces_and_crates_must_be_known() {
        let found = check("a/Cargo.toml", "[package]\nname = \"xtask\"\n").unwrap();
        assert_eq!(
            found,
            ["a/Cargo.toml: the workspace's lints are off; add `[lints]` with `workspace = true`"]
        );
        let found = check("a/Cargo.toml", "[package]\nname = \"prehend-new\"\n").unwrap();
        assert!(found[0].contains("not in the table of layers"), "{found:?}");
    }
}
