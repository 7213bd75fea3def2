//! The tables of constants on the modules' pages hold what the code has.

use std::fs;
use std::path::{Path, PathBuf};

/// A constant with a number.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Constant {
    file: String,
    name: String,
    value: String,
}

/// Files of code below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else if !path.to_string_lossy().ends_with("_tests.rs") {
            found.push(path);
        }
    }
    found
}

fn in_code(line: &str) -> Option<(&str, &str)> {
    let (before, rest) = line.split_once("const ")?;
    let (name, rest) = rest.split_once(": ")?;
    let value = rest.split_once(" = ")?.1.strip_suffix(';')?;
    let is_number = value.contains(|of: char| of.is_ascii_digit()) && !value.contains(['"', '&']);
    (!before.starts_with([' ', '/']) && name != "STREAM" && is_number).then_some((name, value))
}

fn on_page(line: &str) -> Option<Constant> {
    let cells: Vec<&str> = line.strip_prefix("//! | ")?.split(" | ").collect();
    let [file, name, value, kind, reason] = cells[..] else { return None };
    let code = |cell: &str| Some(cell.strip_prefix('`')?.strip_suffix('`')?.to_owned());
    assert!(!kind.is_empty() && reason.trim_end_matches('|').len() > 3, "{line}");
    Some(Constant { file: file.into(), name: code(name)?, value: code(value)? })
}

#[test]
fn each_module_lists_its_constants_with_their_values() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for module in ["data", "fit", "search", "verdict", "next"] {
        let page = root.join(module).with_extension("rs");
        let mut wanted = Vec::new();
        for path in files(&root.join(module)).into_iter().chain([page.clone()]) {
            let file = path.strip_prefix(root.join(module)).or_else(|_| path.strip_prefix(&root)).unwrap();
            let text = fs::read_to_string(&path).unwrap();
            wanted.extend(text.lines().filter_map(in_code).map(|(name, value)| Constant {
                file: file.to_string_lossy().into_owned(),
                name: name.into(),
                value: value.into(),
            }));
        }
        let mut listed: Vec<Constant> =
            fs::read_to_string(&page).unwrap().lines().filter_map(on_page).collect();
        wanted.sort();
        listed.sort();
        assert!(!wanted.is_empty(), "{module} has constants");
        assert_eq!(listed, wanted, "{module}");
    }
}
