//! Documents and comments refer to files, headings and recipes that exist.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;
use std::path::{Path, PathBuf};

/// A file of the repository that refers to others.
struct Text {
    /// Relative to the repository.
    path: PathBuf,
    text: String,
}

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

/// The Markdown, Rust and TOML files of a folder and its subfolders, and the justfile; without build outputs.
fn texts(folder: &Path) -> Vec<Text> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            if name != "target" && !name.starts_with('.') {
                found.extend(texts(&path));
            }
        } else if name == "justfile"
            || path.extension().is_some_and(|kind| kind == "md" || kind == "rs" || kind == "toml")
        {
            let text = fs::read_to_string(&path).unwrap();
            found.push(Text { path: path.strip_prefix(repository()).unwrap().into(), text });
        }
    }
    found
}

impl Text {
    /// Lines outside of fenced code, with their numbers.
    fn prose(&self) -> impl Iterator<Item = (usize, &str)> {
        let mut in_code = false;
        self.text.lines().enumerate().filter_map(move |(index, line)| {
            let is_fence = line.starts_with("```");
            in_code ^= is_fence;
            (!in_code && !is_fence).then_some((index + 1, line))
        })
    }

    /// What is wrong with the references that a check finds in a line.
    fn wrong(&self, check: impl Fn(&str) -> Vec<String>) -> Vec<String> {
        let at = |(number, line)| {
            check(line).into_iter().map(move |what| format!("{}:{number}: {what}", self.path.display()))
        };
        self.prose().flat_map(at).collect()
    }
}

/// Links with a target in the repository.
fn links(line: &str) -> impl Iterator<Item = &str> {
    let targets = line.split("](").skip(1).filter_map(|rest| Some(rest.split_once(')')?.0));
    targets.filter(|target| !target.starts_with("http"))
}

/// Code within a line.
fn quoted(line: &str) -> impl Iterator<Item = &str> {
    line.split('`').skip(1).step_by(2)
}

/// The anchor that a web page gives a heading.
fn anchor(heading: &str) -> String {
    let text = heading.trim_start_matches('#').trim().to_lowercase();
    text.replace(' ', "-")
        .chars()
        .filter(|letter| letter.is_alphanumeric() || "-_".contains(*letter))
        .collect()
}

#[test]
fn links_lead_to_files_and_headings() {
    let wrong = texts(&repository())
        .into_iter()
        .filter(|text| text.path.extension().is_some_and(|kind| kind == "md"))
        .flat_map(|text| {
            let here = repository().join(&text.path);
            text.wrong(|line| {
                let is_wrong = |link: &&str| {
                    let (file, heading) = link.split_once('#').unwrap_or((*link, ""));
                    let path = if file.is_empty() { here.clone() } else { here.parent().unwrap().join(file) };
                    let has_heading = || {
                        let target = fs::read_to_string(&path).unwrap_or_default();
                        target.lines().any(|line| line.starts_with('#') && anchor(line) == heading)
                    };
                    !path.exists() || !heading.is_empty() && !has_heading()
                };
                links(line).filter(is_wrong).map(Into::into).collect()
            })
        });
    assert_eq!(wrong.collect::<Vec<_>>(), [""; 0]);
}

/// A quoted path counts if it begins with a folder at the top of the repository and has an ending; `<name>` and `*` stand for
/// anything.
#[test]
fn quoted_files_exist() {
    let top = repository();
    let wrong = texts(&top).into_iter().flat_map(|text| {
        let here = top.join(&text.path);
        text.wrong(|line| {
            let is_path = |quoted: &&str| {
                let (first, _) = quoted.split_once('/').unwrap_or_default();
                !first.is_empty()
                    && !quoted.contains([' ', '<', '*', '{'])
                    && first != "target"
                    && top.join(first).is_dir()
                    && Path::new(quoted).extension().is_some()
            };
            let is_missing = |path: &&str| !here.ancestors().any(|folder| folder.join(path).exists());
            quoted(line).filter(is_path).filter(is_missing).map(Into::into).collect()
        })
    });
    assert_eq!(wrong.collect::<Vec<_>>(), [""; 0]);
}

#[test]
fn quoted_recipes_exist() {
    let justfile = fs::read_to_string(repository().join("justfile")).unwrap();
    let heads = justfile.lines().filter(|line| line.starts_with(char::is_alphabetic) && !line.contains(":="));
    let recipes: Vec<&str> = heads.filter_map(|line| line.split([' ', ':']).next()).collect();
    let wrong = texts(&repository()).into_iter().flat_map(|text| {
        text.wrong(|line| {
            let names = quoted(line).filter_map(|quoted| quoted.strip_prefix("just ")?.split(' ').next());
            names.filter(|name| !recipes.contains(name)).map(|name| format!("just {name}")).collect()
        })
    });
    assert_eq!(wrong.collect::<Vec<_>>(), [""; 0]);
}
