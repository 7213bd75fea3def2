//! Direction of use within crates whose modules have an order: a module uses only those before it.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// A crate's sources, and its modules in order. What stands in no module is above all of them.
const ORDERED: [(&str, &[&str]); 1] = [(
    "crates/tactus-discover/src",
    &["numbers", "progress", "data", "fit", "search", "next", "verdict", "discover"],
)];

#[test]
fn modules_use_only_those_before_them() {
    for (sources, order) in ORDERED {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(sources);
        let place = |module: &str| order.iter().position(|one| *one == module);
        let mut seen = BTreeSet::new();
        for path in rust_files(&root) {
            let inside = path.strip_prefix(&root).unwrap();
            let user = inside.iter().next().unwrap().to_str().unwrap().trim_end_matches(".rs");
            let Some(user_place) = place(user).filter(|_| !is_test(&path)) else { continue };
            seen.insert(user.to_owned());
            let text = text_of(&path);
            let beyond = "super::".repeat(inside.iter().count());
            assert!(!text.contains(&beyond), "{} leaves its module by {beyond}", inside.display());
            for used in used_of_crate(&text) {
                let used_place = place(&used);
                assert!(
                    used_place.is_some_and(|used_place| used_place <= user_place),
                    "{} uses crate::{used}, which does not come before `{user}`",
                    inside.display()
                );
            }
        }
        assert_eq!(seen.len(), order.len(), "modules of {sources}: {seen:?}");
    }
}

#[test]
fn every_form_of_use_is_seen() {
    let text = "
        /// crate::comment
        use crate::data::{Bins, Frames};
        use crate::{
            fit::{Fitted, Problem},
            search::Search,
        };
        pub(crate) fn of() -> f64 { crate::numbers::median(&[]) }
    ";
    let used: Vec<String> = used_of_crate(text).into_iter().collect();
    assert_eq!(used, ["data", "fit", "numbers", "search"]);
}

fn text_of(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn is_test(path: &Path) -> bool {
    path.file_stem().unwrap().to_str().unwrap().ends_with("_tests")
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files
}

/// What follows `crate::` anywhere outside comments: the first name of each path.
fn used_of_crate(text: &str) -> BTreeSet<String> {
    let code: String = text
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .flat_map(|line| [line, "\n"])
        .collect();
    code.split("crate::").skip(1).flat_map(first_names).collect()
}

/// The first names of a path, or of each path in braces.
fn first_names(path: &str) -> Vec<String> {
    let name = |path: &str| -> String {
        path.trim_start().chars().take_while(|letter| letter.is_alphanumeric() || *letter == '_').collect()
    };
    let Some(group) = path.strip_prefix('{') else { return vec![name(path)] };
    let mut names = vec![name(group)];
    let mut depth = 0;
    for (at, letter) in group.char_indices() {
        match letter {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => names.push(name(&group[at + 1..])),
            _ => {}
        }
    }
    names.retain(|name| !name.is_empty());
    names
}
