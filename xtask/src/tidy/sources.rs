//! What may stand in the sources: who opens files and prints, and what nobody leaves behind.

use super::code::code_lines;

/// Crates that may open files, read the environment, listen and print.
const OPEN_FILES: &[&str] = &["prehend", "prehend-studio", "prehend-cli", "xtask"];

/// Ways to reach the outside, and modules of `std` that lead there.
const OUTSIDE: &[&str] = &[
    "println!",
    "eprintln!",
    "print!",
    "eprint!",
    "io::stdout",
    "io::stderr",
    "io::stdin",
];
const OUTSIDE_MODULES: &[&str] = &["fs", "env", "net", "process"];

/// Macros of unfinished work.
const LEFTOVERS: &[&str] = &["todo!", "unimplemented!", "dbg!"];

/// Findings in one source file of the package `name`, outside its tests.
pub fn check(name: &str, file: &str, text: &str) -> Vec<String> {
    let mut findings = Vec::new();
    for (idx, line) in code_lines(text).iter().enumerate() {
        let at = idx + 1;
        for leftover in LEFTOVERS {
            if has_word(line, leftover) {
                findings.push(format!(
                    "{file}:{at}: `{leftover}` left behind; finish the work or return an error"
                ));
            }
        }
        if OPEN_FILES.contains(&name) {
            continue;
        }
        let found = OUTSIDE
            .iter()
            .find(|way| has_word(line, way))
            .map(|way| (*way).to_owned())
            .or_else(|| module(line));
        if let Some(found) = found {
            findings.push(format!(
                "{file}:{at}: `{found}` in `{name}`, which neither opens files nor reads the environment nor prints; \
                 take a value, `&str` or `impl Read`, or move it to `prehend`"
            ));
        }
    }
    findings
}

/// `std::fs` and the like, also inside `use std::{…}`.
fn module(line: &str) -> Option<String> {
    let (_, rest) = line.split_once("std::")?;
    let found = OUTSIDE_MODULES
        .iter()
        .find(|module| match rest.strip_prefix('{') {
            Some(list) => list
                .split([',', '}'])
                .any(|item| item.trim().split("::").next() == Some(module)),
            None => rest
                .strip_prefix(*module)
                .is_some_and(|after| !after.starts_with(|c: char| c.is_alphanumeric() || c == '_')),
        });
    found
        .map(|module| format!("std::{module}"))
        .or_else(|| module_in(rest))
}

fn module_in(rest: &str) -> Option<String> {
    if rest.contains("std::") {
        module(rest)
    } else {
        None
    }
}

fn has_word(line: &str, word: &str) -> bool {
    line.match_indices(word)
        .any(|(at, _)| !line[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_'))
}

/// Findings of paths that exist on one machine only, in any text file.
pub fn machine_paths(file: &str, text: &str) -> Vec<String> {
    let folders = ["work", "root", "home", "Users", "tmp"].map(|folder| format!("/{folder}/"));
    let mut findings = Vec::new();
    for (idx, line) in text.lines().enumerate() {
        let begins =
            |at: usize| !line[..at].ends_with(|c: char| c.is_alphanumeric() || "._-/~*}".contains(c));
        for folder in &folders {
            if line.match_indices(folder.as_str()).any(|(at, _)| begins(at)) {
                findings.push(format!(
                    "{file}:{}: a path of one machine (`{folder}`); use a relative one",
                    idx + 1
                ));
            }
        }
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_library_that_reads_files_or_prints_is_named() {
        let found = check(
            "prehend-geometry",
            "crates/geometry/src/io.rs",
            "fn f() {}\nuse std::{fmt, fs::File};\n",
        );
        assert_eq!(
            found,
            [
                "crates/geometry/src/io.rs:2: `std::fs` in `prehend-geometry`, which neither opens files nor reads the environment \
              nor prints; take a value, `&str` or `impl Read`, or move it to `prehend`"
            ]
        );
        assert_eq!(
            check("prehend-hand", "a.rs", "let x = std::env::var(\"A\");").len(),
            1
        );
        assert_eq!(check("prehend-hand", "a.rs", "eprintln!(\"a\");").len(), 1);
        assert!(
            check(
                "prehend-hand",
                "a.rs",
                "let p = std::f64::consts::PI; std::fmt::Error;"
            )
            .is_empty()
        );
        assert!(check("prehend", "a.rs", "std::fs::read(p)").is_empty());
    }

    #[test]
    fn tests_and_comments_may_do_as_they_like() {
        let text = "/// println!(\"a\")\n#[cfg(test)]\nmod tests {\n    use std::fs;\n}\n";
        assert!(check("prehend-hand", "a.rs", text).is_empty());
    }

    #[test]
    fn unfinished_work_is_named_everywhere() {
        let found = check("xtask", "a.rs", "\nfn f() { todo!() }");
        assert_eq!(
            found,
            ["a.rs:2: `todo!` left behind; finish the work or return an error"]
        );
    }

    #[test]
    fn paths_of_one_machine_are_named_and_relative_ones_are_not() {
        let bad = format!("see /{}/me/file", "home");
        assert_eq!(
            machine_paths("a.md", &bad),
            [format!(
                "a.md:1: a path of one machine (`/{}/`); use a relative one",
                "home"
            )]
        );
        assert!(machine_paths("a.md", &format!("../shared/{}/x and a/{}/b", "home", "work")).is_empty());
    }
}
